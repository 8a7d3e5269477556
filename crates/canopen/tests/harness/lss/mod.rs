//! LSS slaves and a master on a wire that loses frames. Bytes make a script: the fuzz target, the
//! replay of its corpus and the property tests run the same code.

mod model;
mod pair;
mod script;
mod wire;

pub use model::Model;
pub use pair::Pair;
pub use script::run;
pub use wire::{Wire, identity};
