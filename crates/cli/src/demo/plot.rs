//! Position, velocity and current of the three drives over time, as SVG.

use canopen::Instant;
use plotters::coord::Shift;
use plotters::prelude::*;
use sim::ProbeSample;

use super::Report;
use super::report::Act;

/// The backend draws on whole pixels. So the picture is drawn this much larger than it is shown.
const SCALE: i32 = 3;
const WIDTH: i32 = 1000;
const HEIGHT: i32 = 960;
/// Where the charts begin.
const LEFT: i32 = 76;

/// Colours that everybody can tell apart (Okabe and Ito).
const COLOURS: [RGBColor; 3] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
];
const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(222, 222, 222);
const BAND: RGBColor = RGBColor(243, 244, 246);

/// One of the three charts.
struct Panel {
    title: &'static str,
    value: fn(&ProbeSample) -> f64,
    /// The axis shows at least this much to both sides of 0.
    at_least: f64,
}

/// Where a chart stands among the others.
#[derive(Clone, Copy)]
struct Place {
    is_first: bool,
    is_last: bool,
}

const PANELS: [Panel; 3] = [
    Panel {
        title: "position, turns",
        value: |sample| sample.position_turns,
        at_least: 1.0,
    },
    Panel {
        title: "velocity, rpm",
        value: |sample| f64::from(sample.speed_rad_s) * 60.0 / std::f64::consts::TAU,
        at_least: 10.0,
    },
    Panel {
        title: "current, A",
        value: |sample| f64::from(sample.current_a),
        at_least: 0.05,
    },
];

const CAPTION: [&str; 2] = [
    "Position and velocity are the simulated shafts' own: the truth, which neither drives nor master see.",
    "Current is what each drive measures in quadrature to its magnet. Whether a target was reached was judged from the bus alone.",
];

/// The picture as text of an SVG file.
pub(super) fn svg(report: &Report) -> String {
    let mut text = String::new();
    let size = ((WIDTH * SCALE) as u32, (HEIGHT * SCALE) as u32);
    // Writing to a string cannot fail, and no axis is empty.
    if let Err(error) = draw(
        report,
        SVGBackend::with_string(&mut text, size).into_drawing_area(),
    ) {
        debug_assert!(false, "{error}");
    }
    let drawn = format!("width=\"{}\" height=\"{}\"", size.0, size.1);
    text.replacen(&drawn, &format!("width=\"{WIDTH}\" height=\"{HEIGHT}\""), 1)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn<T> = Result<T, Box<dyn std::error::Error>>;

fn font(size: i32) -> TextStyle<'static> {
    ("sans-serif", size * SCALE).into_font().color(&INK)
}

fn draw(report: &Report, area: Area<'_>) -> Drawn<()> {
    area.fill(&WHITE)?;
    let (head, rest) = area.split_vertically(70 * SCALE);
    let (panels, foot) = rest.split_vertically((HEIGHT - 70 - 48) * SCALE);
    draw_head(report, &head)?;
    for (line, y) in CAPTION.iter().zip([4, 22]) {
        foot.draw_text(line, &font(12), (LEFT * SCALE, y * SCALE))?;
    }
    let areas = panels.split_evenly((PANELS.len(), 1));
    for (n, (panel, area)) in PANELS.iter().zip(&areas).enumerate() {
        let place = Place {
            is_first: n == 0,
            is_last: n + 1 == PANELS.len(),
        };
        draw_panel(report, panel, place, area)?;
    }
    area.present()?;
    Ok(())
}

/// Title and legend.
fn draw_head(report: &Report, area: &Area<'_>) -> Drawn<()> {
    let title = format!("servobus demo: {} on one CAN bus", report.who);
    area.draw_text(&title, &font(20), (LEFT * SCALE, 12 * SCALE))?;
    for ((actor, colour), x) in
        actors(report)
            .into_iter()
            .zip(COLOURS)
            .zip([LEFT, LEFT + 220, LEFT + 440])
    {
        let (x, y) = (x * SCALE, 52 * SCALE);
        let line = vec![(x, y), (x + 26 * SCALE, y)];
        area.draw(&PathElement::new(
            line,
            colour.stroke_width(3 * SCALE as u32),
        ))?;
        let mode = actor.mode.split_once(' ').map_or("", |(_, name)| name);
        let name = format!("node {}, {mode}", actor.who());
        area.draw_text(&name, &font(13), (x + 34 * SCALE, y - 8 * SCALE))?;
    }
    Ok(())
}

/// What happened between two times.
struct Band {
    title: &'static str,
    from_s: f64,
    to_s: f64,
}

fn bands(report: &Report) -> Vec<Band> {
    let seconds = Instant::seconds;
    let begin = report.acts.first().map(|act| Band {
        title: "set-up",
        from_s: 0.0,
        to_s: seconds(act.phase.from),
    });
    let acts = report.acts.iter().map(|act| Band {
        title: act.phase.title,
        from_s: seconds(act.phase.from),
        to_s: seconds(act.phase.to),
    });
    begin.into_iter().chain(acts).collect()
}

/// The range of an axis that shows all values, with some air.
fn range(values: impl Iterator<Item = f64>, at_least: f64) -> std::ops::Range<f64> {
    let (low, high) = values.fold((-at_least, at_least), |(low, high), value| {
        (f64::min(low, value), f64::max(high, value))
    });
    let air = 0.06 * (high - low);
    low - air..high + air
}

fn draw_panel(report: &Report, panel: &Panel, place: Place, area: &Area<'_>) -> Drawn<()> {
    let end_s = report.length_ns as f64 * 1e-9;
    let values = report.samples.iter().map(panel.value);
    let range = range(values, panel.at_least);
    let top = range.end;
    let mut chart = ChartBuilder::on(area)
        .margin_top(24 * SCALE)
        .margin_left(12 * SCALE)
        .margin_right(20 * SCALE)
        .margin_bottom(6 * SCALE)
        .x_label_area_size(34 * SCALE)
        .y_label_area_size(64 * SCALE)
        .build_cartesian_2d(0.0..end_s, range.clone())?;
    for (n, band) in bands(report).iter().enumerate() {
        if n % 2 == 0 {
            let corners = [(band.from_s, range.start), (band.to_s, range.end)];
            chart.draw_series([Rectangle::new(corners, BAND.filled())])?;
        }
    }
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID.stroke_width(SCALE as u32))
        .axis_style(INK.stroke_width(SCALE as u32))
        .label_style(font(12))
        .axis_desc_style(font(13))
        .x_desc(if place.is_last { "time, s" } else { "" })
        .y_desc(panel.title)
        .x_labels(10)
        .y_labels(7)
        .x_label_formatter(&|value| format!("{value:.1}"))
        .y_label_formatter(&|value| label(*value))
        .set_all_tick_mark_size(4 * SCALE)
        .draw()?;
    for (actor, colour) in actors(report).into_iter().zip(COLOURS) {
        let line = of(report, actor).map(|s| (s.at.seconds(), (panel.value)(s)));
        let style = colour.stroke_width(2 * SCALE as u32);
        chart.draw_series(LineSeries::new(line, style))?;
    }
    // The names of the bands stand above the first chart, the time below the last.
    for band in bands(report).iter().filter(|_| place.is_first) {
        let (x, y) = chart.backend_coord(&(band.from_s, top));
        let (left, above) = area.get_pixel_range();
        let at = (x - left.start + 4 * SCALE, y - above.start - 19 * SCALE);
        area.draw_text(band.title, &font(12), at)?;
    }
    Ok(())
}

/// The first act of each axis.
fn actors(report: &Report) -> Vec<&Act> {
    let mut actors: Vec<&Act> = Vec::new();
    for act in &report.acts {
        if !actors
            .iter()
            .any(|a| (a.node, a.axis) == (act.node, act.axis))
        {
            actors.push(act);
        }
    }
    actors
}

fn of<'a>(report: &'a Report, actor: &Act) -> impl Iterator<Item = &'a ProbeSample> {
    let (place, axis) = (sim::Place::of_node(actor.node), actor.axis);
    let samples = report.samples.iter();
    samples.filter(move |s| s.place == place && s.axis == axis)
}

/// A number of an axis: no more digits than it needs.
fn label(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match text {
        "-0" => "0".to_owned(),
        text => text.replace('-', "\u{2212}"),
    }
}
