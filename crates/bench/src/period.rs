//! Wall-clock time of one control period, or of one block transfer.

use std::hint::black_box;
use std::time::Instant;

/// How many runs [`measure`] should make, unless told otherwise.
pub const RUNS: usize = 9;

/// How many periods a run should have at least.
pub const PERIODS: u32 = 200_000;

/// How many block transfers a run should have.
pub const TRANSFERS: u32 = 8;

/// The time of one period over several runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodTime {
    /// The mean of the fastest run, in nanoseconds: what the code costs when nothing disturbs it.
    pub best_ns: f64,
    /// The mean of the middle run, in nanoseconds.
    pub median_ns: f64,
}

/// Times `runs` runs of `periods` calls of `period` each, after one run that is not counted. What
/// `period` returns is kept from being optimised away. None if there is nothing to run.
pub fn measure<T>(runs: usize, periods: u32, mut period: impl FnMut() -> T) -> Option<PeriodTime> {
    if runs == 0 || periods == 0 {
        return None;
    }
    let mut run = || {
        let start = Instant::now();
        for _ in 0..periods {
            black_box(period());
        }
        start.elapsed().as_secs_f64() * 1e9 / f64::from(periods)
    };
    run();
    summary((0..runs).map(|_| run()).collect())
}

fn summary(mut means_ns: Vec<f64>) -> Option<PeriodTime> {
    means_ns.sort_by(f64::total_cmp);
    Some(PeriodTime {
        best_ns: *means_ns.first()?,
        median_ns: *means_ns.get(means_ns.len() / 2)?,
    })
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn best_and_median_of_unordered_runs() {
        let time = summary(vec![30.0, 10.0, 50.0, 20.0, 40.0]);
        let expected = PeriodTime {
            best_ns: 10.0,
            median_ns: 30.0,
        };
        assert_eq!(time, Some(expected));
        assert_eq!(summary(Vec::new()), None);
    }

    #[test]
    fn counts_every_call_and_times_them() {
        let mut calls = 0;
        let time = measure(3, 5, || {
            calls += 1;
            std::thread::sleep(Duration::from_micros(200));
        });
        let time = time.expect("three runs");
        assert_eq!(calls, (3 + 1) * 5);
        assert!(time.best_ns >= 200_000.0, "{time:?}");
        assert!(time.median_ns >= time.best_ns, "{time:?}");
        assert_eq!(measure(0, 5, || ()), None);
        assert_eq!(measure(5, 0, || ()), None);
    }
}
