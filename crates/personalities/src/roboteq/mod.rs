//! Roboteq's motor controllers with DS402, as their document of February 2018 describes them.

pub mod command_line;
