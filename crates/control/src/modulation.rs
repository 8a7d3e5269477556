//! From a voltage vector to the duties of three half bridges.
//!
//! Space-vector modulation in its min-max form: the three phase voltages are shifted together so
//! that the greatest and the smallest stand symmetrically about half the supply. The shift appears
//! in no line voltage, and the linear range grows from Vbus/2 to Vbus/√3 (P3 l.258: a phase voltage
//! of 2¹⁵ is Vbus/√3).
//!
//! The vector is held inside the circle of that radius, in which every direction is realised
//! exactly; the corners of the hexagon outside it are not used. If it must be shortened, the d axis
//! keeps its voltage and the q axis gives way: the flux axis stays under control while torque, which
//! the user sees as a limit anyway, is lost.

use crate::io::Duty;
use crate::transform::{Rotor, Stator, phases};
use crate::{Mask as _, Real};

/// 1/√3: radius of the linear range in supply voltages.
pub const LINEAR_RANGE: f32 = 0.577_350_27;

/// How far duties may go from one half when they are held between `duty_margin` and
/// 1 − `duty_margin`: a number from 0 to ½, whatever the margin is.
pub fn reach<R: Real>(duty_margin: R) -> R {
    let half = R::splat(0.5);
    (half - duty_margin).least(half).greatest(R::splat(0.0))
}

/// The longest realisable vector in supply voltages, for a [`reach`] of the duties.
pub fn radius<R: Real>(reach: R) -> R {
    reach * R::splat(2.0 * LINEAR_RANGE)
}

/// A voltage vector held inside the circle of `radius_v`, the d axis first; and whether it had to
/// be shortened. One square root. A vector or radius that is not a number gives one inside the
/// circle or, with such a radius, none: [`duties`] holds whatever it gets.
#[inline(always)]
pub fn inside_circle<R: Real>(wanted: Rotor<R>, radius_v: R) -> (Rotor<R>, R::Mask) {
    // A shortcut that changes no bit: nothing is cut.
    let square = wanted.d * wanted.d + wanted.q * wanted.q;
    let inside = square.lt(radius_v * radius_v.abs() * R::splat(0.999));
    if !(!inside).any() {
        return (wanted, !inside);
    }
    let d = wanted.d.within(radius_v);
    let q_limit = (radius_v * radius_v - d * d).sqrt();
    let q = wanted.q.within(q_limit);
    // Equal unless limited; NaN is unequal to itself and counts as limited.
    let kept = wanted.d.abs().le(radius_v) & wanted.q.abs().le(q_limit);
    (Rotor { d, q }, !kept)
}

/// The part of a PWM period that a dead time takes off a phase: a number from 0 to ¼, whatever the
/// times are.
pub fn dead_part<R: Real>(dead_time_s: R, pwm_period_s: R) -> R {
    let part = dead_time_s / pwm_period_s;
    R::select(R::splat(0.0).lt(part), part, R::splat(0.0)).least(R::splat(0.25))
}

/// What is added to the duties against the dead time: its part of the period with the sign of each
/// phase's current. After a switching the current decides where the phase is: one into the motor
/// finds the positive half of the period shortened, one out of it the negative half. So the mean
/// voltage is off by dead time/period · Vbus against the current; in duties the supply has no part in
/// it. About zero, where a sign is a guess, it is as much less as the current is: `part_per_a` is the
/// slope there.
#[inline(always)]
pub fn against_dead_time<R: Real>(current_a: Stator<R>, part: R, part_per_a: R) -> [R; 3] {
    phases(current_a).map(|current| (current * part_per_a).within(part))
}

/// The duties that make a stator voltage vector at a supply of 1/`inverse_bus_per_v`, with `more` of
/// each phase, each within `reach` of one half, whatever the voltage and the supply are.
///
/// A pulse shorter than the dead time cannot be made: of it there is all or nothing. Where the vector
/// asks for one at each end, because there is less than `shortest` of the period left beside the outer
/// phases, all three are shifted until one of them does not switch; the one which the middle phase is
/// further from.
#[inline(always)]
pub fn duties<R: Real>(
    voltage_v: Stator<R>,
    inverse_bus_per_v: R,
    more: [R; 3],
    shortest: R,
    reach: R,
    enabled: R::Mask,
) -> Duty<R> {
    let [a, b, c] = phases(voltage_v);
    let greatest = a.greatest(b).greatest(c);
    let least = a.least(b).least(c);
    let (zero, half) = (R::splat(0.0), R::splat(0.5));
    let shift = (greatest + least) * half;
    let left = half - (greatest - shift) * inverse_bus_per_v;
    let left = R::select(left.lt(shortest), left, zero);
    // The middle phase is below the middle where the shift is above 0.
    let push = R::select(shift.lt(zero), -left, left);
    let duty = |phase: R, more: R| {
        let duty = (phase - shift) * inverse_bus_per_v + (more + push);
        duty.within(reach) + half
    };
    let [more_a, more_b, more_c] = more;
    Duty {
        phase: [duty(a, more_a), duty(b, more_b), duty(c, more_c)],
        enabled,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transform::Rotation;

    const BUS_V: f32 = 48.0;

    fn realised(vector: Rotor<f32>, angle: i32, margin: f32) -> [f32; 3] {
        let stator = Rotation::<f32>::at(angle).unpark(vector);
        duties(stator, 1.0 / BUS_V, [0.0; 3], 0.0, reach(margin), true).phase
    }

    #[test]
    fn line_voltages_are_reproduced_over_the_whole_circle() {
        for margin in [0.0, 0.05] {
            let radius = BUS_V * radius(reach(margin));
            for step in 0..720 {
                let angle = (step as u32).wrapping_mul(5_965_232) as i32;
                for part in [0.0, 0.3, 0.77, 0.999_99] {
                    let vector = Rotor {
                        d: -0.6 * radius * part,
                        q: 0.8 * radius * part,
                    };
                    let (held, limited) = inside_circle(vector, radius);
                    assert!(!limited);
                    let duty = realised(held, angle, margin);
                    let [a, b, c] = phases(Rotation::<f32>::at(angle).unpark(vector));
                    for (got, wanted) in [
                        (duty[0] - duty[1], a - b),
                        (duty[1] - duty[2], b - c),
                        (duty[2] - duty[0], c - a),
                    ] {
                        assert!((got * BUS_V - wanted).abs() < 3e-5, "{got} {wanted}");
                    }
                    // Min-max: the outer two stand symmetrically about one half.
                    let mut sorted = duty;
                    sorted.sort_by(f32::total_cmp);
                    assert!((sorted[0] + sorted[2] - 1.0).abs() < 1e-6);
                    assert!(sorted[0] >= margin && sorted[2] <= 1.0 - margin);
                }
            }
        }
    }

    #[test]
    fn the_circle_touches_the_ends_of_the_duty_range() {
        // A vector of Vbus/√3 pointing between two phases uses the whole supply: 0 and 1.
        let radius = BUS_V * radius(reach(0.0_f32));
        assert!((radius - 27.712_812).abs() < 1e-5);
        let twelfth = 357_913_941; // 30 degrees
        let duty = realised(Rotor { d: radius, q: 0.0 }, twelfth, 0.0);
        assert!(
            (duty[0] - 1.0).abs() < 1e-6 && duty[2].abs() < 1e-6,
            "{duty:?}"
        );
    }

    #[test]
    fn the_d_axis_has_priority() {
        // 3-4-5 triangle: with d = 3 and radius 5, q is cut to 4.
        let (held, limited) = inside_circle(
            Rotor {
                d: 3.0_f32,
                q: 100.0,
            },
            5.0,
        );
        assert!(limited);
        assert_eq!(held.d, 3.0);
        assert!((held.q - 4.0).abs() < 1e-6);
        let (held, limited) = inside_circle(
            Rotor {
                d: -9.0_f32,
                q: -1.0,
            },
            5.0,
        );
        assert!(limited);
        assert_eq!((held.d, held.q), (-5.0, 0.0));
        let (held, limited) = inside_circle(
            Rotor {
                d: 3.0_f32,
                q: -3.9,
            },
            5.0,
        );
        assert_eq!((held, limited), (Rotor { d: 3.0, q: -3.9 }, false));
    }

    #[test]
    fn no_input_leaves_the_duty_range() {
        let odd = [
            0.0,
            -0.0,
            1.0,
            -20.0,
            1e-40,
            f32::MAX,
            f32::MIN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
        ];
        for alpha in odd {
            for beta in odd {
                for inverse in odd {
                    for margin in odd {
                        let part = dead_part(margin, inverse);
                        assert!((0.0..=0.25).contains(&part), "{part}");
                        let current = Stator {
                            alpha: beta,
                            beta: inverse,
                        };
                        let more = against_dead_time(current, part, alpha);
                        assert!(more.iter().all(|more| more.abs() <= 0.25), "{more:?}");
                        let voltage = Stator { alpha, beta };
                        let duty = duties(voltage, inverse, more, part, reach(margin), true);
                        for phase in duty.phase {
                            assert!((0.0..=1.0).contains(&phase), "{phase}");
                        }
                    }
                }
            }
        }
    }
}
