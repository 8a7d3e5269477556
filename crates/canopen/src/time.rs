//! Points in time, always passed in.

/// A point in time: nanoseconds since an origin that the caller chose (power-on, or the start of
/// a simulation). A 64-bit count lasts 584 years.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Instant(pub u64);

impl Instant {
    /// The origin.
    pub const ZERO: Instant = Instant(0);
    /// Later than anything: "no deadline".
    pub const NEVER: Instant = Instant(u64::MAX);

    /// `ns` nanoseconds later; stays at [`Instant::NEVER`].
    #[inline]
    pub const fn plus_ns(self, ns: u64) -> Instant {
        Instant(self.0.saturating_add(ns))
    }

    /// `us` microseconds later.
    pub const fn plus_us(self, us: u64) -> Instant {
        self.plus_ns(us.saturating_mul(1_000))
    }

    /// `ms` milliseconds later.
    pub const fn plus_ms(self, ms: u64) -> Instant {
        self.plus_ns(ms.saturating_mul(1_000_000))
    }

    /// Nanoseconds since `earlier`; 0 if that is not earlier.
    pub const fn since_ns(self, earlier: Instant) -> u64 {
        self.0.saturating_sub(earlier.0)
    }

    /// Seconds since the origin.
    pub fn seconds(self) -> f64 {
        self.0 as f64 * 1e-9
    }
}
