//! The subcommands.

pub(crate) mod calibrate;
pub(crate) mod drives;
pub(crate) mod eds;
pub(crate) mod lss;
pub(crate) mod monitor;
mod motor;
pub(crate) mod nmt;
pub(crate) mod od;
pub(crate) mod play;
pub(crate) mod program;
pub(crate) mod replay;
pub(crate) mod scan;
pub(crate) mod scenario;
pub(crate) mod sdo;
pub(crate) mod sim;
mod stop;
pub(crate) mod tune;
