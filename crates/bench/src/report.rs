//! The figures as a table and as JSON.

use comfy_table::{CellAlignment, Table, presets};
use serde_json::{Map, Value};

use crate::period::PeriodTime;

/// One line of the report: a figure for each subject that has the function.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The name of the figure, with its unit.
    pub metric: &'static str,
    /// One figure for each subject of the report, in the same order; None where the subject lacks
    /// the function.
    pub figures: Vec<Option<Figure>>,
}

/// A figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Figure {
    /// A count of instructions, exact.
    Instructions(u64),
    /// Instructions for each byte that is transferred; written with one decimal.
    InstructionsPerByte(f64),
    /// A time, in nanoseconds; written with one decimal.
    Nanoseconds(f64),
    /// A speed; written without decimals.
    BytesPerSecond(f64),
    /// Anything else, its unit in the metric's name; written with two decimals.
    Decimal(f64),
}

/// The figures of all subjects.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The subjects' names: the columns.
    pub subjects: Vec<&'static str>,
    /// The lines.
    pub rows: Vec<Row>,
}

impl Report {
    /// Adds the time of a control period: the best run under the first name of `metrics`, the middle
    /// one under the second. Subjects that are not in `times` have none.
    pub fn push_control_period(
        &mut self,
        metrics: [&'static str; 2],
        times: &[(&'static str, PeriodTime)],
    ) {
        let of = [
            |time: &PeriodTime| time.best_ns,
            |time: &PeriodTime| time.median_ns,
        ];
        for (metric, of) in metrics.into_iter().zip(of) {
            let figure = |subject: &&str| {
                let time = times.iter().find(|(name, _)| name == subject);
                time.map(|(_, time)| Figure::Nanoseconds(of(time)))
            };
            let figures = self.subjects.iter().map(figure).collect();
            self.rows.push(Row { metric, figures });
        }
    }

    /// Adds how fast a pair of ends transfers blocks, if a transfer of `bytes` bytes takes `time`;
    /// only `subject` has them. The best run under the first name of `metrics`, the middle one
    /// under the second.
    pub fn push_block_speed(
        &mut self,
        metrics: [&'static str; 2],
        subject: &str,
        bytes: usize,
        time: PeriodTime,
    ) {
        for (metric, time_ns) in metrics.into_iter().zip([time.best_ns, time.median_ns]) {
            let speed = Figure::BytesPerSecond(bytes as f64 / time_ns * 1e9);
            self.push_one(metric, subject, speed);
        }
    }

    /// Adds a figure that only `subject` has.
    pub fn push_decimal(&mut self, metric: &'static str, subject: &str, value: f64) {
        self.push_one(metric, subject, Figure::Decimal(value));
    }

    fn push_one(&mut self, metric: &'static str, subject: &str, figure: Figure) {
        let figure = |name: &&str| (*name == subject).then_some(figure);
        let figures = self.subjects.iter().map(figure).collect();
        self.rows.push(Row { metric, figures });
    }

    /// The report as a table for people; a dash stands where a subject lacks the function.
    pub fn table(&self) -> Table {
        let mut table = Table::new();
        table.load_style(presets::UTF8_FULL_CONDENSED);
        let header = ["figure"];
        table.set_header(header.iter().chain(&self.subjects));
        for row in &self.rows {
            let figures = row.figures.iter().map(|figure| match figure {
                None => "–".to_owned(),
                Some(Figure::Instructions(count)) => thousands(*count),
                Some(Figure::InstructionsPerByte(value) | Figure::Nanoseconds(value)) => {
                    format!("{value:.1}")
                }
                Some(Figure::BytesPerSecond(speed)) => thousands(speed.round() as u64),
                Some(Figure::Decimal(value)) => format!("{value:.2}"),
            });
            table.add_row(std::iter::once(row.metric.to_owned()).chain(figures));
        }
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table
    }

    /// The report as JSON: `{"metric": {"subject": figure, …}, …}`, null where a subject lacks the
    /// function.
    pub fn json(&self) -> Value {
        let metric = |row: &Row| {
            let figures = self.subjects.iter().zip(&row.figures);
            let object: Map<String, Value> = figures
                .map(|(&subject, figure)| (subject.to_owned(), number(*figure)))
                .collect();
            (row.metric.to_owned(), Value::Object(object))
        };
        Value::Object(self.rows.iter().map(metric).collect())
    }
}

fn number(figure: Option<Figure>) -> Value {
    match figure {
        None => Value::Null,
        Some(Figure::Instructions(count)) => count.into(),
        Some(Figure::InstructionsPerByte(value) | Figure::Nanoseconds(value)) => {
            ((value * 10.0).round() / 10.0).into()
        }
        Some(Figure::BytesPerSecond(speed)) => (speed.round() as u64).into(),
        Some(Figure::Decimal(value)) => ((value * 100.0).round() / 100.0).into(),
    }
}

/// `1234567` as `1,234,567`.
fn thousands(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> Report {
        let mut report = Report {
            subjects: vec!["ours", "theirs"],
            rows: vec![
                Row {
                    metric: "idle_poll_instructions",
                    figures: vec![Some(Figure::Instructions(1_254)), None],
                },
                Row {
                    metric: "block_upload_instructions_per_byte",
                    figures: vec![Some(Figure::InstructionsPerByte(44.449)), None],
                },
            ],
        };
        let time = PeriodTime {
            best_ns: 189.96,
            median_ns: 201.0,
        };
        let metrics = ["control_period_ns", "control_period_median_ns"];
        report.push_control_period(metrics, &[("ours", time)]);
        let time = PeriodTime {
            best_ns: 1_000.0,
            median_ns: 3_000.0,
        };
        let metrics = [
            "block_upload_bytes_per_s",
            "block_upload_median_bytes_per_s",
        ];
        report.push_block_speed(metrics, "ours", 7, time);
        report
    }

    #[test]
    fn json_has_the_figures_by_metric_and_subject() {
        let expected = serde_json::json!({
            "idle_poll_instructions": {"ours": 1254, "theirs": null},
            "block_upload_instructions_per_byte": {"ours": 44.4, "theirs": null},
            "control_period_ns": {"ours": 190.0, "theirs": null},
            "control_period_median_ns": {"ours": 201.0, "theirs": null},
            "block_upload_bytes_per_s": {"ours": 7_000_000, "theirs": null},
            "block_upload_median_bytes_per_s": {"ours": 2_333_333, "theirs": null},
        });
        assert_eq!(report().json(), expected);
    }

    #[test]
    fn table_has_a_dash_for_a_missing_function() {
        let table = report().table().to_string();
        let line = |metric: &str| -> Vec<String> {
            let line = table.lines().find(|line| line.contains(metric));
            let words = line.unwrap_or_default().split_whitespace();
            let words = words.filter(|word| !["│", "┆"].contains(word));
            words.map(str::to_owned).collect()
        };
        let poll = ["idle_poll_instructions", "1,254", "–"];
        let byte = ["block_upload_instructions_per_byte", "44.4", "–"];
        let period = ["control_period_ns", "190.0", "–"];
        let speed = ["block_upload_bytes_per_s", "7,000,000", "–"];
        for expected in [poll, byte, period, speed] {
            assert_eq!(line(expected[0]), expected);
        }
    }

    #[test]
    fn groups_digits_by_three() {
        assert_eq!(thousands(0), "0");
        assert_eq!(thousands(999), "999");
        assert_eq!(thousands(1_000), "1,000");
        assert_eq!(thousands(1_234_567), "1,234,567");
    }
}
