//! Several independent buses on several threads.

use canopen::Instant;
use rayon::prelude::*;

use crate::Bus;

/// Moves every bus to `until` on `threads` threads. Buses know nothing of each other, so the
/// result is the same for any number of threads.
///
/// # Errors
/// The thread pool's error if the threads cannot be started.
pub fn run_fleet(
    buses: &mut [Bus],
    until: Instant,
    threads: usize,
) -> Result<(), rayon::ThreadPoolBuildError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()?;
    pool.install(|| buses.par_iter_mut().for_each(|bus| bus.run_until(until)));
    Ok(())
}
