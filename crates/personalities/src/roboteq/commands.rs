//! RoboCommands: their names, and the objects that they read and write. Whoever offers them on a serial
//! line needs no CAN for it.

use canopen::Address;

use super::axis::in_window;

/// Which sign comes before a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `!`: does something.
    Runtime,
    /// `?`: reads something.
    Query,
    /// `^` sets, `~` reads: a configuration.
    Configuration,
    /// `%`: maintenance.
    Maintenance,
}

/// Where a command finds its object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum At {
    /// In the channel's window, so far from its start.
    Window(u16, u8),
    /// In the channel's window; odd elements are sub-index 1, even ones 2: two for each channel
    /// (R25).
    Elements(u16),
    /// The channel is the sub-index.
    Channel(u16),
    /// The element is the sub-index.
    Element(u16),
    /// One for the controller.
    Controller(u16, u8),
}

/// A RoboCommand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Command {
    /// Its name, as in `!CW`.
    pub name: &'static str,
    /// Its sign.
    pub kind: Kind,
    at: At,
}

impl Command {
    /// How many elements there are on a controller of so many channels: 1 if it has none to choose.
    pub const fn elements(&self, channels: u8) -> u8 {
        match self.at {
            At::Window(..) | At::Channel(_) => channels,
            At::Elements(_) => 2 * channels,
            At::Element(_) => 3,
            At::Controller(..) => 1,
        }
    }

    /// The object of an element, from 1; `None` if the controller has fewer.
    pub const fn object(&self, element: u8, channels: u8) -> Option<Address> {
        if element == 0 || element > self.elements(channels) {
            return None;
        }
        let n = element - 1;
        Some(match self.at {
            At::Window(offset, sub) => in_window(n, offset, sub),
            At::Elements(offset) => in_window(n / 2, offset, n % 2 + 1),
            At::Channel(index) | At::Element(index) => Address::new(index, element),
            At::Controller(index, sub) => Address::new(index, sub),
        })
    }
}

const fn command(name: &'static str, kind: Kind, at: At) -> Command {
    Command { name, kind, at }
}

/// Those that act.
#[rustfmt::skip]
pub const COMMANDS: &[Command] = {
    use At::{Channel, Controller, Element, Elements, Window};
    use Kind::{Configuration, Maintenance, Query, Runtime};
    &[
        command("CW", Runtime, Window(0x40, 0)),
        command("SW", Query, Window(0x41, 0)),
        command("S", Runtime, Channel(0x2002)),
        command("G", Runtime, Channel(0x2000)),
        command("P", Runtime, Channel(0x2001)),
        command("AC", Runtime, Channel(0x2006)),
        command("DC", Runtime, Channel(0x2007)),
        command("ROM", Runtime, Window(0x60, 0)),
        command("ROM", Query, Window(0x60, 0)),
        command("AOM", Query, Window(0x61, 0)),
        command("POS", Runtime, Window(0x7A, 0)),
        command("POS", Query, Window(0x7A, 0)),
        command("PSP", Runtime, Window(0x81, 0)),
        command("PSP", Query, Window(0x81, 0)),
        command("PAC", Runtime, Window(0x83, 0)),
        command("PAC", Query, Window(0x83, 0)),
        command("PDC", Runtime, Window(0x84, 0)),
        command("PDC", Query, Window(0x84, 0)),
        command("SPL", Runtime, Elements(0x46)),
        command("SPL", Query, Elements(0x46)),
        command("SAC", Runtime, Elements(0x48)),
        command("SAC", Query, Elements(0x48)),
        command("SDC", Runtime, Elements(0x49)),
        command("SDC", Query, Elements(0x49)),
        command("TC", Runtime, Window(0x71, 0)),
        command("TC", Query, Window(0x71, 0)),
        command("TSL", Runtime, Window(0x87, 0)),
        command("TSL", Query, Window(0x87, 0)),
        command("SDM", Query, Window(0x502, 0)),
        command("VNM", Query, Window(0x7FE, 0)),
        command("F", Query, Channel(0x2110)),
        command("A", Query, Channel(0x2100)),
        command("RMP", Query, Window(0x43, 0)),
        command("S", Query, Channel(0x2103)),
        command("M", Query, Channel(0x2101)),
        command("C", Query, Channel(0x2104)),
        command("E", Query, Channel(0x2114)),
        command("BA", Query, Channel(0x210C)),
        command("V", Query, Element(0x210D)),
        command("FS", Query, Controller(0x2111, 0)),
        command("FF", Query, Controller(0x2112, 0)),
        command("FM", Query, Channel(0x2122)),
        command("EX", Runtime, Controller(0x200C, 0)),
        command("MG", Runtime, Controller(0x200D, 0)),
        command("MS", Runtime, Controller(0x200E, 0)),
        command("FSA", Configuration, Controller(0x3000, 0)),
        command("OVL", Configuration, Controller(0x3001, 1)),
        command("UVL", Configuration, Controller(0x3001, 2)),
        command("OTL", Configuration, Controller(0x3001, 3)),
        command("MMOD", Configuration, Channel(0x3010)),
        command("MAC", Configuration, Channel(0x3011)),
        command("MDEC", Configuration, Channel(0x3012)),
        command("MVEL", Configuration, Channel(0x3013)),
        command("EDEC", Configuration, Channel(0x3014)),
        command("MXRPM", Configuration, Channel(0x3015)),
        command("ALIM", Configuration, Channel(0x3016)),
        command("ELL", Configuration, Channel(0x3017)),
        command("EHL", Configuration, Channel(0x3018)),
        command("CLERD", Configuration, Channel(0x3019)),
        command("EESAV", Maintenance, Controller(0x2017, 0)),
    ]
};

/// The command of that name and sign; names in capitals.
pub fn find(kind: Kind, name: &str) -> Option<&'static Command> {
    COMMANDS
        .iter()
        .find(|command| command.kind == kind && command.name == name)
}
