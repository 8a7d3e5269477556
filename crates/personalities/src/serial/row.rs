//! The rows of a table of commands.

use canopen::Address;

/// Which kind of line a command is, by its first character.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `!`: a command, answered `+` or `-`.
    Command,
    /// `?`: a query, answered `NAME=VALUE` and kept in the history.
    Query,
    /// `^`: sets what is configured, answered `+` or `-`.
    Set,
    /// `~`: reads what is configured, answered `NAME=VALUE`.
    Get,
    /// `%`: maintenance, answered `+` or `-`.
    Maintenance,
}

impl Kind {
    /// The character with which a line of this kind begins.
    pub const fn prefix(self) -> u8 {
        match self {
            Kind::Command => b'!',
            Kind::Query => b'?',
            Kind::Set => b'^',
            Kind::Get => b'~',
            Kind::Maintenance => b'%',
        }
    }

    /// The kind that this character stands for.
    pub(crate) const fn of(prefix: u8) -> Option<Kind> {
        Some(match prefix {
            b'!' => Kind::Command,
            b'?' => Kind::Query,
            b'^' => Kind::Set,
            b'~' => Kind::Get,
            b'%' => Kind::Maintenance,
            _ => return None,
        })
    }
}

/// What a command has a value of: how its first number is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// The drive has one; no number says of what.
    Drive,
    /// It is an order that needs no value.
    Order,
    /// Each channel has one: the number is the channel's, from 1.
    Channel,
    /// Each channel has two, in sub-indices that follow each other: the number is an element's,
    /// 1 and 2 for the first channel, 3 and 4 for the second, and so on.
    Pair,
    /// The drive has so many, in sub-indices that follow each other: the number is an element's.
    Elements(u8),
}

/// Where an object lies for each channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Object {
    /// That of the first channel.
    pub first: Address,
    /// From one channel's index to the next one's.
    pub index_step: u16,
    /// From one channel's sub-index to the next one's.
    pub sub_step: u8,
}

impl Object {
    /// An object of the device profile: the next channel's lies 0x800 higher (CiA 402).
    pub const fn profile(index: u16, sub: u8) -> Object {
        Object {
            first: Address::new(index, sub),
            index_step: 0x800,
            sub_step: 0,
        }
    }

    /// An object with a sub-index for each channel, from 1.
    pub const fn channels(index: u16) -> Object {
        Object {
            first: Address::new(index, 1),
            index_step: 0,
            sub_step: 1,
        }
    }

    /// An object that the drive has once.
    pub const fn single(index: u16, sub: u8) -> Object {
        Object {
            first: Address::new(index, sub),
            index_step: 0,
            sub_step: 0,
        }
    }

    /// That of `channel`, from 0, and `step` sub-indices further.
    pub const fn at(self, channel: u8, step: u8) -> Address {
        let index = self.index_step.wrapping_mul(channel as u16);
        let sub = self.sub_step.wrapping_mul(channel).wrapping_add(step);
        Address::new(
            self.first.index.wrapping_add(index),
            self.first.sub.wrapping_add(sub),
        )
    }
}

/// What a command does.
#[derive(Clone, Copy, Debug)]
pub enum Action {
    /// Reads an object.
    Read(Object),
    /// Writes an object; 1 if the command is an order.
    Write(Object),
    /// Reads or sets whether received characters are sent back: 1 they are not, 0 they are.
    Echo,
    /// Stores all parameters.
    Store,
}

/// One row: a command of the command line.
#[derive(Clone, Copy, Debug)]
pub struct Command {
    /// Its kind.
    pub kind: Kind,
    /// Its name, in capitals; small letters mean the same.
    pub name: &'static str,
    /// What it has a value of.
    pub of: Of,
    /// What it does.
    pub action: Action,
}
