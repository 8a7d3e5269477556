//! Gains of the position and the velocity controller: by bandwidth and damping, or given directly.
//!
//! What was written last is what counts. The other form is computed and shown: the gains that the
//! rule makes of a bandwidth, or the bandwidth and damping that belong to given gains.

use canopen::{Address, Image};
use control::Real;
use control::tuning::{self, Pd, Pi, TuningError};
use personalities::{Figure, GainObjects, LoopObjects, MotionLoop, PidObjects, Scaled};

use crate::configuration::{limit, value};

/// Which controllers' gains are given directly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Direct {
    position: bool,
    velocity: bool,
}

/// A controller with all three parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pid {
    pub(crate) pi: Pi,
    /// Output per input's rate.
    pub(crate) kd: f32,
    /// Bound of the integral part, where the objects say one.
    pub(crate) integral_limit: Option<f32>,
}

/// What velocity gains follow from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Figures {
    /// 0 where the drive does not know it.
    pub(crate) inertia_kg_m2: f32,
    pub(crate) torque_constant_nm_per_a: f32,
    pub(crate) counts_per_turn: f32,
    /// Turns of the output for one of the motor.
    pub(crate) gear: f32,
}

/// What a write to one of a controller's objects does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GainWrite {
    /// Bandwidth or damping.
    ByRule,
    /// A gain.
    Direct,
    /// A proportional gain of 0, with which there is no controller.
    NoGain,
    /// A damping where no bandwidth belongs to the gains that are given.
    NoBandwidth,
}

/// Objects of a controller, one after the other: bandwidth, damping, three gains.
const RUN: u8 = 5;

/// The objects of a controller that follows from a bandwidth, or may.
fn tuned(objects: &MotionLoop) -> Option<&LoopObjects> {
    match objects {
        MotionLoop::Tuned(objects) => Some(objects),
        MotionLoop::Gains(_) => None,
    }
}

fn place(objects: &LoopObjects, object: Address) -> Option<u8> {
    let direct = objects.direct.as_ref()?;
    let step = object.sub.wrapping_sub(direct.first.sub);
    (object.index == direct.first.index && step < RUN).then_some(step)
}

/// The objects that are stored together with `object`, because they are one setting.
pub(crate) fn stored_together(gains: &GainObjects, object: Address) -> Option<(Address, u8)> {
    let objects = [&gains.position, &gains.velocity];
    let one = objects
        .into_iter()
        .filter_map(tuned)
        .find(|one| place(one, object).is_some())?;
    one.direct.as_ref().map(|direct| (direct.first, RUN))
}

impl Direct {
    /// As stored: gains that are given have a proportional part, those by the rule are stored as 0.
    pub(crate) fn of_stored(image: &Image<'_>, gains: &GainObjects) -> Direct {
        let given = |objects: &MotionLoop| {
            let direct = tuned(objects).and_then(|objects| objects.direct.as_ref());
            direct.is_some_and(|direct| image.number(direct.proportional.field) != 0)
        };
        Direct {
            position: given(&gains.position),
            velocity: given(&gains.velocity),
        }
    }

    /// What is stored of the gains is what counts: none where the rule makes them.
    pub(crate) fn before_store(self, image: &mut Image<'_>, gains: &GainObjects) {
        for (objects, given) in [
            (&gains.position, self.position),
            (&gains.velocity, self.velocity),
        ] {
            let direct = tuned(objects).and_then(|objects| objects.direct.as_ref());
            if let (Some(direct), false) = (direct, given) {
                for gain in [direct.proportional, direct.integral, direct.derivative] {
                    image.set_number(gain.field, 0);
                }
            }
        }
    }

    /// Takes note of a write; `None` if it is to no controller's object.
    pub(crate) fn written(
        &mut self,
        image: &Image<'_>,
        gains: &GainObjects,
        object: Address,
        new: u32,
    ) -> Option<GainWrite> {
        for (objects, given) in [
            (&gains.position, &mut self.position),
            (&gains.velocity, &mut self.velocity),
        ] {
            let Some(objects) = tuned(objects) else {
                continue;
            };
            let Some(step) = place(objects, object) else {
                continue;
            };
            let has_bandwidth = value(image, objects.bandwidth) != 0.0;
            let write = match step {
                1 if !has_bandwidth => GainWrite::NoBandwidth,
                0 | 1 => GainWrite::ByRule,
                2 if new == 0 => GainWrite::NoGain,
                _ => GainWrite::Direct,
            };
            match write {
                GainWrite::ByRule => *given = false,
                GainWrite::Direct => *given = true,
                GainWrite::NoGain | GainWrite::NoBandwidth => {}
            }
            return Some(write);
        }
        None
    }

    /// The position controller, 1/s, 1/s² and a number; its integral part in counts/s. By the rule it
    /// has no integral part.
    pub(crate) fn position(
        self,
        image: &Image<'_>,
        objects: &MotionLoop,
        figures: &Figures,
    ) -> Result<Pid, TuningError> {
        match objects {
            MotionLoop::Gains(objects) => {
                let rad_per_count = figures.rad_per_count();
                Ok(pid(image, objects, 1.0, 1.0 / rad_per_count))
            }
            MotionLoop::Tuned(objects) => self.tuned_position(image, objects),
        }
    }

    fn tuned_position(self, image: &Image<'_>, objects: &LoopObjects) -> Result<Pid, TuningError> {
        match given(image, objects) {
            Some(pid) if self.position => Ok(pid),
            _ => {
                let bandwidth = value(image, objects.bandwidth);
                let damping = objects.damping.map_or(1.0, |damping| value(image, damping));
                let Pd { kp, kd } = tuning::position(bandwidth, damping)?;
                Ok(Pid {
                    pi: Pi { kp, ki: 0.0 },
                    kd,
                    integral_limit: None,
                })
            }
        }
    }

    /// The velocity controller, A per count/s, A per count, A per count/s²; its integral part in A.
    pub(crate) fn velocity(
        self,
        image: &Image<'_>,
        objects: &MotionLoop,
        figures: &Figures,
    ) -> Result<Pid, TuningError> {
        match objects {
            MotionLoop::Gains(objects) => {
                let per_nm = figures.gear / figures.torque_constant_nm_per_a;
                let rad_per_count = figures.rad_per_count();
                Ok(pid(image, objects, rad_per_count * per_nm, per_nm))
            }
            MotionLoop::Tuned(objects) => self.tuned_velocity(image, objects, figures),
        }
    }

    fn tuned_velocity(
        self,
        image: &Image<'_>,
        objects: &LoopObjects,
        figures: &Figures,
    ) -> Result<Pid, TuningError> {
        let turns = 1.0 / figures.counts_per_turn;
        match given(image, objects) {
            Some(Pid { pi, kd, .. }) if self.velocity => Ok(Pid {
                pi: Pi {
                    kp: pi.kp * turns,
                    ki: pi.ki * turns,
                },
                kd: kd * turns,
                integral_limit: None,
            }),
            _ => {
                let pi = tuning::velocity(
                    value(image, objects.bandwidth),
                    objects.damping.map_or(1.0, |damping| value(image, damping)),
                    figures.inertia_kg_m2,
                    figures.torque_constant_nm_per_a,
                    figures.counts_per_turn,
                )?;
                Ok(Pid {
                    pi,
                    kd: 0.0,
                    integral_limit: None,
                })
            }
        }
    }

    /// Writes into the image the form that does not count. What cannot be computed is 0.
    pub(crate) fn show(self, image: &mut Image<'_>, gains: &GainObjects, figures: &Figures) {
        let none = Pid {
            pi: Pi { kp: 0.0, ki: 0.0 },
            kd: 0.0,
            integral_limit: None,
        };
        if let Some(objects) = tuned(&gains.position) {
            let position = self.tuned_position(image, objects).unwrap_or(none);
            // The velocity loop is taken for ideal: position follows velocity demand.
            let stiffness = Some(1.0 + position.kd);
            show_loop(
                image,
                objects,
                self.position,
                &position,
                stiffness,
                1.0,
                1.0,
            );
        }
        if let Some(objects) = tuned(&gains.velocity) {
            let velocity = self.tuned_velocity(image, objects, figures);
            let inertia = tuning::acceleration_current(
                figures.inertia_kg_m2,
                figures.torque_constant_nm_per_a,
                figures.counts_per_turn,
            );
            show_loop(
                image,
                objects,
                self.velocity,
                &velocity.unwrap_or(none),
                None,
                inertia.unwrap_or(0.0),
                figures.counts_per_turn,
            );
        }
    }
}

impl Figures {
    /// By what the output turns while the motor does by a count.
    fn rad_per_count(&self) -> f32 {
        core::f32::consts::TAU / self.counts_per_turn * self.gear
    }
}

/// Gains at the output, `per_gain` and for the integral's bound `per_limit` times as great at the
/// motor.
fn pid(image: &Image<'_>, objects: &PidObjects, per_gain: f32, per_limit: f32) -> Pid {
    let gain = |object: Scaled| limit(image, Some(object)).unwrap_or(0.0) * per_gain;
    Pid {
        pi: Pi {
            kp: gain(objects.proportional),
            ki: gain(objects.integral),
        },
        kd: gain(objects.derivative),
        integral_limit: Some(limit(image, Some(objects.integral_limit)).unwrap_or(0.0) * per_limit),
    }
}

/// The gains in the objects' units.
fn given(image: &Image<'_>, objects: &LoopObjects) -> Option<Pid> {
    let direct = objects.direct.as_ref()?;
    Some(Pid {
        pi: Pi {
            kp: value(image, direct.proportional),
            ki: value(image, direct.integral),
        },
        kd: value(image, direct.derivative),
        integral_limit: None,
    })
}

/// `first_order` is the damping of a loop of first order, if it has one, `inertia` the output for which
/// the controlled quantity's rate is 1, `per_object` the objects' gain of an internal gain of 1.
fn show_loop(
    image: &mut Image<'_>,
    objects: &LoopObjects,
    is_given: bool,
    pid: &Pid,
    first_order: Option<f32>,
    inertia: f32,
    per_object: f32,
) {
    let Some(direct) = &objects.direct else {
        return;
    };
    if is_given {
        let (bandwidth_hz, damping) = equivalent(pid, inertia);
        put(image, objects.bandwidth, bandwidth_hz);
        if let (Some(object), Some(damping)) = (objects.damping, damping.or(first_order)) {
            put(image, object, damping);
        }
    } else {
        put(image, direct.proportional.into(), pid.pi.kp * per_object);
        put(image, direct.integral.into(), pid.pi.ki * per_object);
        put(image, direct.derivative.into(), pid.kd * per_object);
    }
}

/// The natural frequency, Hz, and the damping ratio of (inertia + kd)·s² + kp·s + ki. Without an
/// integral part the loop is of first order and has no such damping.
fn equivalent(pid: &Pid, inertia: f32) -> (f32, Option<f32>) {
    let Pid {
        pi: Pi { kp, ki },
        kd,
        ..
    } = *pid;
    let total = inertia + kd;
    if ki > 0.0 && total > 0.0 {
        let root = <f32 as Real>::sqrt(ki * total);
        let omega = root / total;
        return (omega / core::f32::consts::TAU, Some(kp / (2.0 * root)));
    }
    if total > 0.0 {
        (kp / (total * core::f32::consts::TAU), None)
    } else {
        (0.0, None)
    }
}

/// Rounded, and held within the object's type; what is not a number is 0.
fn put(image: &mut Image<'_>, figure: Figure, value: f32) {
    if let Figure::Object(object) = figure {
        let half = if value < 0.0 { -0.5 } else { 0.5 };
        image.set_number(object.field, (value * object.per_unit + half) as i64);
    }
}
