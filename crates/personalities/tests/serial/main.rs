//! The serial command line: grammar, table of commands, history, and what must not harm it.

mod harness;
mod history;
mod robustness;
mod table;
