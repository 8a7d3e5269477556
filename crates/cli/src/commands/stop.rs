//! Ctrl-C and SIGTERM.

use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::Failure;

/// Whether the user wants this to end.
#[derive(Clone, Debug)]
pub(crate) struct Stop(Arc<AtomicBool>);

/// Exit code of a process that Ctrl-C ended at once, by custom of shells.
const KILLED: i32 = 130;

impl Stop {
    /// From here on SIGINT, SIGTERM and SIGHUP ask for an end. The second one is the end.
    ///
    /// # Errors
    /// The system does not allow it.
    pub(crate) fn watch() -> Result<Stop, Failure> {
        let asked = Arc::new(AtomicBool::new(false));
        let seen = asked.clone();
        ctrlc::set_handler(move || {
            if seen.swap(true, Ordering::Relaxed) {
                process::exit(KILLED);
            }
        })
        .map_err(|error| Failure::input(format!("cannot watch for Ctrl-C: {error}")))?;
        Ok(Stop(asked))
    }

    /// Whether an end was asked for.
    pub(crate) fn asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
