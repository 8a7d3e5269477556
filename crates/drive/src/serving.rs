//! The owner of the node's objects for one call: the application, and the host that it reaches into.

use canopen::{Abort, Address, Image, Owner, Verdict};
use personalities::HostObjects;
use personalities::own::OwnBehaviour;

use crate::Host;
use crate::application::Application;
use crate::body::Body;
use crate::program::Action;

/// The application together with the host of a call.
pub(crate) struct Serving<'a, H, O, B: Body> {
    pub(crate) application: &'a mut Application<O, B>,
    pub(crate) host: &'a mut H,
}

impl<H: Host, O: OwnBehaviour, B: Body> Serving<'_, H, O, B> {
    fn objects(&self) -> Option<&'static HostObjects> {
        self.application.personality.host.as_ref()
    }

    fn is_program(&self, object: Address) -> bool {
        self.objects()
            .is_some_and(|objects| objects.program == object)
    }

    fn is_scratch(&self, object: Address) -> bool {
        self.objects()
            .is_some_and(|objects| objects.scratch == object)
    }

    /// What a stream that can be read holds.
    fn contents(&self, object: Address) -> Result<&[u8], Abort> {
        match self.objects() {
            Some(objects) if objects.data_sheet == object => match self.host.data_sheet() {
                [] => Err(Abort::NO_DATA),
                sheet => Ok(sheet),
            },
            Some(objects) if objects.scratch == object => Ok(self.host.scratch()),
            _ => Err(Abort::UNSUPPORTED_ACCESS),
        }
    }

    /// 0x1F51. A program stops only with the power stage off: the motor must not be left to itself.
    fn control_program(&mut self, value: u8) -> Verdict {
        if self.application.is_powered() {
            return Verdict::Refuse(Abort::DEVICE_STATE);
        }
        match self.host.control_program(value) {
            Ok(Action::Stop) => self.application.program_stops(),
            Ok(Action::Start) => self.application.program_starts(),
            Ok(Action::Nothing | Action::Clear) => {}
            Err(abort) => return Verdict::Refuse(abort),
        }
        // What it reads as is published.
        Verdict::Done
    }
}

fn verdict(result: Result<(), Abort>) -> Verdict {
    match result {
        Ok(()) => Verdict::Accept,
        Err(abort) => Verdict::Refuse(abort),
    }
}

impl<H: Host, O: OwnBehaviour, B: Body> Owner for Serving<'_, H, O, B> {
    fn write(&mut self, image: &Image<'_>, object: Address, new: &[u8]) -> Verdict {
        match self.objects() {
            Some(objects) if objects.program_control == object => {
                self.control_program(new.first().copied().unwrap_or(0))
            }
            _ => self.application.write(image, object, new),
        }
    }

    #[inline]
    fn publish(&mut self, image: &mut Image<'_>) {
        self.application.publish(image);
        if let Some(objects) = self.objects() {
            let program = self.host.program();
            image.set(objects.program_state, program.control);
            image.set(objects.program_identification, program.identification);
            image.set(objects.program_status, program.status);
            image.set_bytes(
                objects.software_version,
                self.host.software_version().as_bytes(),
            );
        }
    }

    fn stream_size(&mut self, object: Address) -> Result<Option<u32>, Abort> {
        let length = self.contents(object)?.len();
        u32::try_from(length)
            .map(Some)
            .map_err(|_| Abort::OUT_OF_MEMORY)
    }

    fn stream_read(&mut self, object: Address, at: u32, into: &mut [u8]) -> Result<usize, Abort> {
        let contents = self.contents(object)?;
        let rest = usize::try_from(at)
            .ok()
            .and_then(|at| contents.get(at..))
            .unwrap_or(&[]);
        let mut given = 0;
        for (place, byte) in into.iter_mut().zip(rest) {
            *place = *byte;
            given += 1;
        }
        Ok(given)
    }

    fn stream_begin(&mut self, object: Address, size: Option<u32>) -> Verdict {
        match self.is_program(object) {
            true => verdict(self.host.begin_program(size)),
            false if self.is_scratch(object) => verdict(self.host.clear_scratch(size)),
            false => Verdict::Refuse(Abort::UNSUPPORTED_ACCESS),
        }
    }

    fn stream_write(&mut self, object: Address, at: u32, bytes: &[u8]) -> Result<(), Abort> {
        match self.is_program(object) {
            true => self.host.take_program(at, bytes),
            false if self.is_scratch(object) => self.host.append_scratch(bytes),
            false => Err(Abort::UNSUPPORTED_ACCESS),
        }
    }

    fn stream_end(&mut self, object: Address, _size: u32) -> Verdict {
        match self.is_program(object) {
            true => verdict(self.host.finish_program()),
            false if self.is_scratch(object) => Verdict::Accept,
            false => Verdict::Refuse(Abort::UNSUPPORTED_ACCESS),
        }
    }

    fn stream_abort(&mut self, object: Address, _why: Abort) {
        if self.is_program(object) {
            self.host.abort_program();
        }
    }
}
