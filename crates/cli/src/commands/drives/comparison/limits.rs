//! What limits the first axis, by the objects in which the axis itself looks.

use personalities::{AxisPersonality, Figure, Scaled, TargetWindow};

use super::start::Start;
use super::{Drives, NONE, Part, Row};

/// One limit of an axis: the objects that hold it, or a figure with its unit.
enum Limit {
    Object(Scaled),
    Fixed(f32, &'static str),
}

impl Limit {
    /// A figure of 0 is none.
    fn figure(figure: Figure, unit: &'static str) -> Option<Limit> {
        match figure {
            Figure::Object(object) => Some(Limit::Object(object)),
            Figure::Fixed(0.0) => None,
            Figure::Fixed(value) => Some(Limit::Fixed(value, unit)),
        }
    }

    fn window(window: TargetWindow, unit: &'static str) -> Limit {
        match window {
            TargetWindow::Fixed { size, .. } => Limit::Fixed(size as f32, unit),
            TargetWindow::Objects(window) => Limit::Object(window.size),
            TargetWindow::Size(size) => Limit::Object(size),
        }
    }

    fn words(&self, start: &Start) -> String {
        match self {
            Limit::Object(object) => start.object(object.field),
            Limit::Fixed(value, unit) => format!("{value} {unit}"),
        }
    }
}

fn objects<const N: usize>(objects: [Option<Scaled>; N]) -> Vec<Limit> {
    objects.into_iter().flatten().map(Limit::Object).collect()
}

type Look = fn(&AxisPersonality) -> Vec<Limit>;

/// What each row looks at.
const LIMITS: &[(&str, Look)] = &[
    ("least position", |axis| {
        let limits = axis.objects.configuration.position_limits;
        objects([limits.map(|(least, _)| least)])
    }),
    ("greatest position", |axis| {
        let limits = axis.objects.configuration.position_limits;
        objects([limits.map(|(_, greatest)| greatest)])
    }),
    ("velocity", |axis| {
        objects(axis.objects.configuration.max_velocity)
    }),
    ("velocity in torque modes", |axis| {
        objects([axis.objects.configuration.max_motor_velocity])
    }),
    ("acceleration", |axis| {
        objects([axis.objects.configuration.max_acceleration])
    }),
    ("deceleration", |axis| {
        objects([axis.objects.configuration.max_deceleration])
    }),
    ("torque", |axis| {
        objects([Some(axis.objects.configuration.max_torque)])
    }),
    ("continuous current", |axis| {
        let mut limits = Vec::from_iter(Limit::figure(axis.motor.continuous_current, "A"));
        limits.extend(objects([axis.motor.user_continuous_current]));
        limits
    }),
    ("peak current", |axis| {
        let mut limits = Vec::from_iter(Limit::figure(axis.motor.peak_current, "A"));
        limits.extend(objects([axis.motor.user_peak_current]));
        limits
    }),
    ("current of the amplifier", |axis| {
        let mut limits = Vec::from_iter(Limit::figure(axis.amplifier.max_current, "A"));
        if let Some((share, of)) = axis.amplifier.max_of_rated_current {
            limits.extend(objects([Some(share), Some(of)]));
        }
        limits
    }),
    ("rated torque", |axis| {
        Vec::from_iter(Limit::figure(axis.objects.rated_torque_nm, "Nm"))
    }),
    ("quick stop deceleration", |axis| {
        objects([axis.objects.configuration.quick_stop_deceleration])
    }),
    ("position reached within", |axis| {
        let window = axis.objects.configuration.position_window;
        vec![Limit::window(window, "cts")]
    }),
    ("velocity reached within", |axis| {
        let window = axis.objects.configuration.velocity_window;
        vec![Limit::window(window, "cts/s")]
    }),
];

pub(super) fn limits(drives: Drives<'_>, starts: &[Start]) -> Part {
    let rows = LIMITS.iter().map(|(name, look)| {
        let cells = drives.iter().zip(starts).map(|(drive, start)| {
            let limits = drive.axes.first().map_or(vec![], look);
            let words: Vec<String> = limits.iter().map(|limit| limit.words(start)).collect();
            match words.as_slice() {
                [] => NONE.to_owned(),
                words => words.join(", "),
            }
        });
        Row {
            name: (*name).to_owned(),
            drives: cells.collect(),
        }
    });
    Part {
        title: "limits",
        rows: rows.collect(),
    }
}
