//! A program image that comes piece by piece.

use embedded_storage::nor_flash::NorFlash;

use super::{Bank, Banks, Failure, IMAGE_HEADER, ImageHeader};
use crate::flash::{CHUNK, Checksum};

/// What has come so far. Pieces have any length; the flash gets whole chunks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Download {
    /// Bytes that the client has announced.
    announced: Option<u32>,
    /// Bytes that have come.
    received: u32,
    /// Bytes of `chunk` that are there.
    filled: usize,
    chunk: [u8; CHUNK],
    /// Known with the first chunk.
    image: Option<ImageHeader>,
    sum: Checksum,
}

/// Where an image goes and for which drive it must be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Destination {
    pub(crate) banks: Banks,
    pub(crate) bank: Bank,
    pub(crate) product: u32,
}

impl Download {
    /// A download of `announced` bytes, if the client says how many.
    pub(crate) const fn new(announced: Option<u32>, capacity: u32) -> Result<Download, Failure> {
        match announced {
            Some(bytes) if bytes > capacity => Err(Failure::OutOfBank { bytes, capacity }),
            Some(received) if received <= IMAGE_HEADER as u32 => Err(Failure::TooShort {
                expected: IMAGE_HEADER as u32 + 1,
                received,
            }),
            _ => Ok(Download {
                announced,
                received: 0,
                filled: 0,
                chunk: [0; CHUNK],
                image: None,
                sum: Checksum::EMPTY,
            }),
        }
    }

    pub(crate) const fn received(&self) -> u32 {
        self.received
    }

    /// Whether anything was written to the bank, or may have been.
    pub(crate) const fn has_written(&self) -> bool {
        self.image.is_some()
    }

    /// Takes `bytes` for place `at` of the image.
    pub(crate) fn take<F: NorFlash>(
        &mut self,
        flash: &mut F,
        to: &Destination,
        at: u32,
        bytes: &[u8],
    ) -> Result<(), Failure> {
        let expected = self.received;
        if at != expected {
            return Err(Failure::OutOfOrder { expected, at });
        }
        let mut rest = bytes;
        while !rest.is_empty() {
            let free = CHUNK.saturating_sub(self.filled);
            let (now, later) = rest.split_at(free.min(rest.len()));
            let place = self.chunk.iter_mut().skip(self.filled);
            for (place, byte) in place.zip(now) {
                *place = *byte;
            }
            self.filled = self.filled.saturating_add(now.len());
            self.received = self.received.saturating_add(now.len() as u32);
            rest = later;
            if let Some(image) = self.image
                && self.received > image.image_bytes()
            {
                let expected = image.image_bytes();
                return Err(Failure::TooLong { expected });
            }
            if self.filled == CHUNK {
                self.flush(flash, to)?;
            }
        }
        Ok(())
    }

    /// Writes the chunk; of the first one, the image's header, finds out what it says before.
    fn flush<F: NorFlash>(&mut self, flash: &mut F, to: &Destination) -> Result<(), Failure> {
        let filled = self.chunk.get(..self.filled).unwrap_or(&self.chunk);
        if self.image.is_none() {
            self.image = Some(self.header(to)?);
            self.sum = ImageHeader::checksum_start(&self.chunk);
        } else {
            self.sum = self.sum.and(filled);
        }
        let at = self.received.saturating_sub(filled.len() as u32);
        to.banks.write(flash, to.bank, at, filled)?;
        self.filled = 0;
        Ok(())
    }

    fn header(&self, to: &Destination) -> Result<ImageHeader, Failure> {
        let image = ImageHeader::parse(&self.chunk).ok_or(Failure::NotAnImage)?;
        let (wanted, found) = (to.product, image.product);
        if wanted != found {
            return Err(Failure::OtherProduct { wanted, found });
        }
        let (bytes, capacity) = (image.image_bytes(), to.banks.capacity());
        if bytes > capacity {
            return Err(Failure::OutOfBank { bytes, capacity });
        }
        match self.announced {
            Some(announced) if announced > bytes => Err(Failure::TooLong { expected: bytes }),
            Some(received) if received < bytes => Err(Failure::TooShort {
                expected: bytes,
                received,
            }),
            _ => Ok(image),
        }
    }

    /// The client says that this was all: writes what is left, and checks what came.
    pub(crate) fn finish<F: NorFlash>(
        &mut self,
        flash: &mut F,
        to: &Destination,
    ) -> Result<ImageHeader, Failure> {
        let received = self.received;
        let Some(image) = self.image else {
            let expected = IMAGE_HEADER as u32 + 1;
            return Err(Failure::TooShort { expected, received });
        };
        let expected = image.image_bytes();
        if received < expected {
            return Err(Failure::TooShort { expected, received });
        }
        if self.filled > 0 {
            self.flush(flash, to)?;
        }
        let (stated, computed) = (image.checksum, self.sum.value());
        if stated != computed {
            return Err(Failure::Checksum { stated, computed });
        }
        Ok(image)
    }
}
