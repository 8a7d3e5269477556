//! How the encoder sits on the rotor, and in which order the phases are connected (P3 l.258 to
//! l.284).

use cia402::Mode;

use super::sweep::{Led, POINTS, TURN, phase_voltage};
use crate::Link;
use crate::fit::{circular_mean, fit};
use crate::session::{
    CALIBRATION_CURRENT, Cause, ELECTRICAL_ANGLE, ELECTRICAL_POLARITY, ELECTRICAL_ZERO, Finding,
    Motor, ProcedureError, RAW_ENCODER, Session, VOLTAGE_D, Watch,
};

/// How the electrical zero is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// One whole turn of the shaft forward and back, 16 readings per electrical turn, and their
    /// circular mean. Friction, cogging and eccentricity of the encoder average out; pole count and
    /// phase order are checked on the way.
    #[default]
    Turn,
    /// Angle 0 approached from −22.5° and from +22.5°, and the mean of both. Friction averages out.
    Approach,
    /// As the manual prints it: the rotor is pulled to angle 0 and read after a second. The phase
    /// order is not looked at.
    Stall,
}

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElectricalZero {
    /// Encoder reading with the d axis at phase A, counts; in the electrical turn where it is
    /// nearest to a whole count.
    pub zero_counts: f64,
    /// 1, or −1 where the electrical angle falls as the encoder counts up; `None` if not looked at.
    pub polarity: Option<i64>,
    /// How far friction holds the rotor back from the field, electrical degrees.
    pub friction_deg: f64,
    /// How far the readings lie from their mean (cogging, eccentricity), electrical degrees, rms.
    pub spread_deg: f64,
    /// Inertia at the shaft over the rotor's by the data sheet; `None` if not looked at.
    pub inertia_ratio: Option<f64>,
}

/// More friction than this is a load, electrical degrees: a third of the holding torque.
const FRICTION_DEG: f64 = 20.0;
/// The rotor must make this part of the expected way.
const TRAVEL: f64 = 0.75;
/// The way of a whole turn may differ by this; more is a wrong pole count.
const POLE_CHECK: f64 = 0.05;
/// A rotor that follows lies this near to a straight line, electrical degrees rms.
const FOLLOWS_DEG: f64 = 35.0;

/// From here on the back-EMF is believed, and beyond there neither, electrical degrees. The fewer
/// pole pairs, the finer the encoder is for the rotor at rest.
const APART_DEG: f64 = 0.2;
const APART_DEG_PER_TURN: f64 = 0.1;
const MOST_APART_DEG: f64 = 12.0;

/// Where the rotor was on a way there and back.
#[derive(Default)]
struct Way {
    /// Field angle, 1/65,536 electrical turn; counts on the way there; counts on the way back.
    points: Vec<(i64, f64, f64)>,
    /// At every step, both ways: field angle and counts. Whole turns, so that cogging, which makes
    /// the rotor jump from tooth to tooth, is seen in all of its phases.
    steps: Vec<(i64, f64)>,
    /// By how much the back-EMF held the rotor back, electrical degrees.
    drag_deg: f64,
}

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Calibrates the electrical zero, 0x3011,1, and (but for [`Method::Stall`]) the phase order,
    /// 0x3011,2. The shaft must be free: it makes up to one turn forward and back, and is then
    /// driven to and fro to see that nothing is coupled to it.
    ///
    /// # Errors
    /// [`ProcedureError`]; nothing has changed then, and the motor is without power.
    pub async fn calibrate_electrical_zero(
        &mut self,
        method: Method,
    ) -> Result<ElectricalZero, ProcedureError> {
        let done = self.electrical_zero(method).await;
        self.end(done).await
    }

    /// Calibrates the phase order alone, 0x3011,2: whether the encoder counts up as the field turns
    /// forward. The shaft makes one electrical turn forward and back.
    ///
    /// # Errors
    /// [`ProcedureError`]; nothing has changed then, and the motor is without power.
    pub async fn calibrate_phase_order(&mut self) -> Result<i64, ProcedureError> {
        let done = self.phase_order().await;
        self.end(done).await
    }

    async fn phase_order(&mut self) -> Result<i64, Cause> {
        let motor = self.ready().await?;
        let current_a = self.calibration_current(&motor).await?;
        let mut led = self.lead(&motor, current_a).await?;
        self.step("leading the rotor one electrical turn forward and back");
        let way = self.there_and_back(&motor, &mut led, 1).await?;
        let (polarity, _) = way.judge(&motor)?;
        self.find(ELECTRICAL_POLARITY, polarity).await?;
        Ok(polarity)
    }

    async fn electrical_zero(&mut self, method: Method) -> Result<ElectricalZero, Cause> {
        let motor = self.ready().await?;
        let current_a = self.calibration_current(&motor).await?;
        if method == Method::Stall {
            return self.stall(&motor, current_a).await;
        }
        let mut led = self.lead(&motor, current_a).await?;
        let turns = match method {
            Method::Turn => motor.pole_pairs as u32,
            Method::Approach | Method::Stall => 0,
        };
        let way = if turns > 0 {
            self.step("leading the rotor one turn forward and back");
            self.there_and_back(&motor, &mut led, turns).await?
        } else {
            self.step("approaching angle 0 from both sides");
            self.both_sides(&mut led).await?
        };
        let found = way.evaluate(&motor)?;
        self.measured("friction", found.friction_deg, "electrical degrees");
        self.measured("spread", found.spread_deg, "electrical degrees");
        self.write(VOLTAGE_D, 0).await?;
        self.set_mode(Mode::IDLE.0).await?;
        self.power_off().await?;
        let mut zero_counts = nearly_whole(found.zero_counts, &motor);
        self.find(ELECTRICAL_ZERO, zero_counts.round() as i64)
            .await?;
        if let Some(polarity) = found.polarity {
            self.find(ELECTRICAL_POLARITY, polarity).await?;
        }
        let holding_nm = motor.torque_constant_nm_per_a * led.current_a;
        let friction_nm = holding_nm * found.friction_deg.to_radians().sin();
        let inertia_ratio = self.free_shaft(&motor, friction_nm).await?;
        if let (Method::Turn, Some(polarity)) = (method, found.polarity) {
            let off_deg = self.zero_error_deg(&motor).await?;
            self.measured(
                "zero by the back-EMF, less this",
                off_deg,
                "electrical degrees",
            );
            Finding {
                what: "the electrical zero by the back-EMF, less that at standstill",
                seen: off_deg,
                low: -MOST_APART_DEG,
                high: MOST_APART_DEG,
                unit: "electrical degrees",
                remedy: "the rotor is loaded or cogs too much; free the shaft, or raise the \
                         calibration current (0x3011,11)",
            }
            .check()?;
            // The rotor at rest is the finer measure as long as nothing but friction holds it.
            if off_deg.abs() > APART_DEG + APART_DEG_PER_TURN / motor.pole_pairs {
                let turn = motor.counts_per_electrical_turn();
                zero_counts -= polarity as f64 * off_deg / 360.0 * turn;
                zero_counts = nearly_whole(zero_counts.rem_euclid(turn), &motor);
                self.find(ELECTRICAL_ZERO, zero_counts.round() as i64)
                    .await?;
            }
        }
        Ok(ElectricalZero {
            zero_counts,
            inertia_ratio: Some(inertia_ratio),
            ..found
        })
    }

    /// Half of the continuous current, as the manual says, or what 0x3011,11 says where there is
    /// one.
    async fn calibration_current(&mut self, motor: &Motor) -> Result<f64, Cause> {
        let half = 0.5 * motor.continuous_a;
        Ok(match self.read_if_there(CALIBRATION_CURRENT).await? {
            Some(ma) if ma > 0 => (ma as f64 * 1e-3).min(motor.continuous_a),
            _ => half,
        })
    }

    /// The manual's messages, one by one.
    async fn stall(&mut self, motor: &Motor, current_a: f64) -> Result<ElectricalZero, Cause> {
        self.enable().await?;
        self.set_mode(12).await?;
        self.write(ELECTRICAL_ANGLE, 0).await?;
        let voltage = phase_voltage(motor, current_a);
        self.step("pulling the rotor under phase A");
        self.write(VOLTAGE_D, voltage.round() as i64).await?;
        self.wait(1_000).await?;
        let reading = self.read(RAW_ENCODER).await? as f64;
        self.set_mode(Mode::IDLE.0).await?;
        self.find(ELECTRICAL_ZERO, reading as i64).await?;
        Ok(ElectricalZero {
            zero_counts: reading.rem_euclid(motor.counts_per_electrical_turn()),
            polarity: None,
            friction_deg: 0.0,
            spread_deg: 0.0,
            inertia_ratio: None,
        })
    }

    /// `turns` electrical turns forward and back, evenly: a halt would fall on the same phases of the
    /// cogging again and again.
    async fn there_and_back(
        &mut self,
        motor: &Motor,
        led: &mut Led,
        turns: u32,
    ) -> Result<Way, Cause> {
        let distance = TURN / POINTS;
        let last = i64::from(turns) * POINTS;
        // Coming from further back, friction has its side from the first point on.
        self.lead_to(led, -3 * distance).await?;
        self.lead_past(led, -distance).await?;
        let mut way = Way::default();
        let steps = 2 * last as u32 + 1;
        let began = self.client.now();
        for place in 0..=last {
            self.part(place as u32, steps);
            let there = self.lead_past(led, place * distance).await?;
            way.point(&there, place > 0);
        }
        let time_s = self.client.now().since_ns(began) as f64 * 1e-9;
        self.lead_to(led, (last + 3) * distance).await?;
        self.lead_past(led, (last + 1) * distance).await?;
        for place in (0..=last).rev() {
            self.part((2 * last - place) as u32, steps);
            let back = self.lead_past(led, place * distance).await?;
            way.back(&back, place as usize, place < last);
        }
        let electrical = (last + 1) as f64 / POINTS as f64;
        way.drag_deg = Self::drag_deg(motor, led, electrical, time_s);
        Ok(way)
    }

    /// Angles −22.5°, 0 and 22.5° from below and from above.
    async fn both_sides(&mut self, led: &mut Led) -> Result<Way, Cause> {
        let distance = TURN / POINTS;
        let angles = [-distance, 0, distance];
        self.lead_to(led, -3 * distance).await?;
        let mut way = Way::default();
        for angle in angles {
            let there = self.lead_to(led, angle).await?;
            way.point(&[(angle, there)], false);
        }
        self.lead_to(led, 3 * distance).await?;
        for (place, angle) in angles.into_iter().enumerate().rev() {
            let back = self.lead_to(led, angle).await?;
            way.back(&[(angle, back)], place, false);
        }
        // Angle 0 alone says where the zero is.
        if let Some((angle, there, back)) = way.points.get(1).copied() {
            way.steps = vec![(angle, there), (angle, back)];
        }
        Ok(way)
    }
}

/// The same electrical zero in that electrical turn where it is nearest to a whole count: the object
/// holds no fractions, and with seven pole pairs half a count is a third of a degree.
fn nearly_whole(zero_counts: f64, motor: &Motor) -> f64 {
    let turn = motor.counts_per_electrical_turn();
    let off = |counts: f64| (counts - counts.round()).abs();
    (0..motor.pole_pairs as u32)
        .map(|turns| zero_counts + f64::from(turns) * turn)
        .filter(|counts| counts.round() <= f64::from(i16::MAX))
        .fold(zero_counts, |best, other| {
            if off(other) < off(best) - 1e-9 {
                other
            } else {
                best
            }
        })
}

impl Way {
    /// Adds a point of the way there, and the steps to it if they count.
    fn point(&mut self, way: &[(i64, f64)], steps: bool) {
        if let Some((angle, there)) = way.last() {
            self.points.push((*angle, *there, 0.0));
        }
        if steps {
            self.steps.extend(way);
        }
    }

    /// Adds what the way back says of a point, and the steps to it if they count.
    fn back(&mut self, way: &[(i64, f64)], place: usize, steps: bool) {
        if let (Some((_, back)), Some(point)) = (way.last(), self.points.get_mut(place)) {
            point.2 = *back;
        }
        if steps {
            self.steps.extend(way);
        }
    }

    fn angle(&self, from: usize) -> f64 {
        self.points.get(from).map_or(0.0, |point| point.0 as f64)
    }

    /// Direction of the encoder against the field, and counts per electrical turn.
    ///
    /// # Errors
    /// The rotor did not follow, or not as its pole count says.
    fn judge(&self, motor: &Motor) -> Result<(i64, f64), Cause> {
        let expected = motor.counts_per_electrical_turn();
        let turns = (self.angle(self.points.len() - 1) - self.angle(0)) / TURN as f64;
        let ways = [
            self.points.iter().map(|p| (p.0, p.1)).collect::<Vec<_>>(),
            self.points.iter().map(|p| (p.0, p.2)).collect(),
        ];
        let mut slopes = [0.0; 2];
        for (slope, way) in slopes.iter_mut().zip(&ways) {
            let rows: Vec<_> = way
                .iter()
                .map(|(angle, counts)| (vec![1.0, *angle as f64 / TURN as f64], *counts))
                .collect();
            let line = fit(&rows).ok_or(Cause::Samples {
                sent: rows.len(),
                came: 0,
            })?;
            *slope = line.coefficients[1];
            let off_deg = line.rms / expected * 360.0;
            // The end points tell the way that was made, whatever lies between.
            let way_made = match (way.first(), way.last()) {
                (Some(first), Some(last)) => (last.1 - first.1) / turns,
                _ => 0.0,
            };
            let part = way_made.abs() / expected;
            let pairs = motor.pole_pairs / part;
            let steady = off_deg * part.min(1.0).recip() < FOLLOWS_DEG;
            // A rotor that follows well, but by another number of pole pairs.
            if (part - 1.0).abs() > POLE_CHECK && steady && turns >= 1.0 {
                let whole = (pairs - pairs.round()).abs() < POLE_CHECK * pairs.max(1.0);
                if whole && pairs.round() >= 1.0 && pairs.round() != motor.pole_pairs {
                    return Err(Finding {
                        what: "the pole count by the rotor's way",
                        seen: 2.0 * pairs.round(),
                        low: 2.0 * motor.pole_pairs,
                        high: 2.0 * motor.pole_pairs,
                        unit: "",
                        remedy: "correct 0x3011,3",
                    }
                    .into());
                }
            }
            Finding {
                what: "the way of the rotor behind the field",
                seen: part * 100.0,
                low: TRAVEL * 100.0,
                high: 200.0 - TRAVEL * 100.0,
                unit: "% of the field's",
                remedy: "the rotor is blocked or loaded; free the shaft",
            }
            .check()?;
            Finding {
                what: "the distance of the rotor from the field",
                seen: off_deg,
                low: 0.0,
                high: FOLLOWS_DEG,
                unit: "electrical degrees",
                remedy: "the rotor slips: it is loaded, or a phase is open; free the shaft and \
                         check the motor's wires",
            }
            .check()?;
        }
        let [there, back] = slopes;
        Finding {
            what: "the rotor's way back over its way there",
            seen: back / there,
            low: 0.9,
            high: 1.1,
            unit: "",
            remedy: "the rotor is held or driven from outside; free the shaft",
        }
        .check()?;
        Ok((if there > 0.0 { 1 } else { -1 }, 0.5 * (there + back).abs()))
    }

    fn evaluate(&self, motor: &Motor) -> Result<ElectricalZero, Cause> {
        let (polarity, _) = self.judge(motor)?;
        let turn = motor.counts_per_electrical_turn();
        let zeros = self
            .steps
            .iter()
            .map(|(angle, counts)| counts - polarity as f64 * *angle as f64 / TURN as f64 * turn);
        let (zero_counts, _) = circular_mean(zeros, turn);
        let points = &self.points;
        // Without friction, which is told by itself.
        let middles = points.iter().map(|(angle, there, back)| {
            0.5 * (there + back) - polarity as f64 * *angle as f64 / TURN as f64 * turn
        });
        let (_, length) = circular_mean(middles, turn);
        let lags: f64 = points.iter().map(|(_, there, back)| back - there).sum();
        let lag = 0.5 * polarity as f64 * lags / points.len() as f64;
        let friction_deg = lag / turn * 360.0 - self.drag_deg;
        Finding {
            what: "the friction at the shaft",
            seen: friction_deg,
            low: -10.0,
            high: FRICTION_DEG,
            unit: "electrical degrees behind the field",
            remedy: "the rotor is loaded; free the shaft, or raise the calibration current",
        }
        .check()?;
        Ok(ElectricalZero {
            zero_counts,
            polarity: Some(polarity),
            friction_deg,
            spread_deg: (-2.0 * length.max(1e-9).ln()).max(0.0).sqrt().to_degrees(),
            inertia_ratio: None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOTOR: Motor = Motor {
        pole_pairs: 4.0,
        counts: 4096.0,
        phase_resistance_ohm: 6.55,
        phase_inductance_h: 0.000_364_5,
        torque_constant_nm_per_a: 0.032,
        rotor_inertia_kgm2: 4.45e-7,
        continuous_a: 0.716,
        rated_torque_nm: 0.023,
        supply_v: 48.0,
    };

    /// A way of whole turns of a rotor whose place follows from the field's angle, in electrical
    /// turns, and from the direction.
    fn way(turns: i64, place: impl Fn(f64, f64) -> f64) -> Way {
        let points = (0..=turns * POINTS)
            .map(|n| {
                let angle = n * TURN / POINTS;
                let field = angle as f64 / TURN as f64;
                (angle, place(field, 1.0).floor(), place(field, -1.0).floor())
            })
            .collect();
        let steps = |direction: f64| {
            (0..turns * 128)
                .map(|n| {
                    let angle = n * TURN / 128;
                    (angle, place(angle as f64 / TURN as f64, direction).floor())
                })
                .collect::<Vec<_>>()
        };
        Way {
            points,
            steps: [steps(1.0), steps(-1.0)].concat(),
            drag_deg: 0.0,
        }
    }

    #[test]
    fn the_formula_is_the_manuals_at_the_supply_of_its_example() {
        // P7: 2218 is the figure of 60 V, 2773 that of 48 V.
        assert_eq!(phase_voltage(&MOTOR, 0.358).round(), 2773.0);
        let at_60 = Motor {
            supply_v: 60.0,
            ..MOTOR
        };
        assert_eq!(phase_voltage(&at_60, 0.358).round(), 2218.0);
    }

    #[test]
    fn zero_direction_and_friction_come_out_of_a_whole_turn() {
        for polarity in [1.0, -1.0] {
            for zero in [0.4, 511.6, 1023.0] {
                let found = way(4, |field, direction| {
                    let lag = direction * 7.0 / 360.0;
                    let wobble = 12.0 * (field / 4.0 * std::f64::consts::TAU + 0.7).sin();
                    zero + polarity * (field - lag) * 1024.0 + wobble
                })
                .evaluate(&MOTOR)
                .unwrap();
                let off = (found.zero_counts - zero + 512.0).rem_euclid(1024.0) - 512.0;
                assert!(off.abs() < 0.7, "{zero} {found:?}");
                assert_eq!(found.polarity, Some(polarity as i64));
                assert!((found.friction_deg - 7.0).abs() < 0.1);
                assert!((found.spread_deg - 12.0 / 2f64.sqrt() / 1024.0 * 360.0).abs() < 0.2);
            }
        }
    }

    #[test]
    fn a_rotor_that_does_not_follow_is_named_for_what_it_is() {
        let words = |way: Way| match way.evaluate(&MOTOR) {
            Err(Cause::Implausible(finding)) => finding.to_string(),
            other => panic!("{other:?}"),
        };
        let blocked = words(way(4, |_, _| 100.0));
        assert!(blocked.contains("blocked or loaded"), "{blocked}");
        let other = words(way(4, |field, _| field * 4096.0 / 5.0));
        assert!(
            other.contains("pole count") && other.contains("10"),
            "{other}"
        );
        let rubbed = words(way(4, |field, direction| {
            (field - direction * 30.0 / 360.0) * 1024.0
        }));
        assert!(rubbed.contains("friction"), "{rubbed}");
        let slipping = words(way(4, |field, _| (field / 2.0).floor() * 2048.0));
        assert!(slipping.contains("loaded"), "{slipping}");
    }
}
