//! The runner.

use std::collections::VecDeque;

use can::Frame;
use canopen::Instant;

use super::expression::Values;
use super::options::Options;
use super::pattern::{Pattern, notation};
use super::physics::{Physics, Reading};
use super::report::{
    Expected, Failure, FailureKind, Misprint, NotChecked, Received, Report, duration,
};
use super::step::{Action, Assertion, Block, Expectation, Ignored, Span, Step, Transcript};
use crate::decode::Decoder;
use crate::{Link, LinkError};

/// Plays a transcript and reports. Ends at the first line that fails, but carries out what the
/// transcript says for the end (`finally`) even then.
pub async fn play<B: Link + Physics>(
    transcript: &Transcript,
    bench: &mut B,
    options: &Options,
) -> Report {
    let begin = bench.now();
    let mut player = Player {
        transcript,
        bench,
        decoder: options.decoder(),
        queue: VecDeque::new(),
        rules: Vec::new(),
        values: Values::new(),
        limit_ns: options.limit_ns,
        reference: begin,
        report: Report {
            file: transcript.file.clone(),
            ..Report::default()
        },
    };
    let settle_ns = transcript.header.settle_ns.unwrap_or(options.settle_ns);
    let mut played = player.settle(settle_ns).await;
    if played.is_ok() {
        played = player.steps(&transcript.steps).await;
    }
    if played.is_ok() {
        played = player.steps(&transcript.finally).await;
    }
    if played.is_ok() {
        played = player.closing().await;
    } else {
        player.clear_up(&transcript.finally).await;
    }
    let mut report = player.report;
    report.duration_ns = player.bench.now().since_ns(begin);
    report.failure = played.err().map(|failure| *failure);
    report
}

/// A frame that waits to be expected.
struct Waiting {
    at: Instant,
    frame: Frame,
    meaning: String,
}

struct Player<'a, B> {
    transcript: &'a Transcript,
    bench: &'a mut B,
    decoder: Decoder,
    queue: VecDeque<Waiting>,
    rules: Vec<&'a Ignored>,
    values: Values,
    limit_ns: u64,
    /// When the line before was done.
    reference: Instant,
    report: Report,
}

type Played = Result<(), Box<Failure>>;

impl<'a, B: Link + Physics> Player<'a, B> {
    async fn steps(&mut self, steps: &'a [Step]) -> Played {
        for step in steps {
            match &step.action {
                Action::Misprint(block) => self.misprint(step, block).await?,
                _ => self.step(step).await?,
            }
        }
        Ok(())
    }

    async fn step(&mut self, step: &'a Step) -> Played {
        match &step.action {
            Action::Send(pattern) => self.send(step, pattern).await,
            Action::Expect(expected, span) => self.expect(step, expected, *span).await,
            Action::Wait(ns) => self.wait(step, *ns).await,
            Action::Silence(ns) => {
                self.wait(step, *ns).await?;
                self.nothing_unlisted(step.line, &step.text)
            }
            Action::Limit(ns) => {
                self.limit_ns = *ns;
                Ok(())
            }
            Action::Ignore(rule) => {
                self.rules.push(rule);
                Ok(())
            }
            Action::Let(name, expression) => {
                let value = expression.value(&self.values).map_err(|cause| {
                    let cause = format!("${name} cannot be computed: {cause}");
                    self.failure(step, FailureKind::Unplayable { cause })
                })?;
                self.values.insert(name.clone(), value);
                Ok(())
            }
            Action::Assert(assertion) => self.assert(step, assertion),
            // The parser lets no misprint stand within another.
            Action::Misprint(_) => Ok(()),
        }
    }

    fn failure(&self, step: &Step, kind: FailureKind) -> Box<Failure> {
        let file = self.transcript.file.clone();
        Box::new(Failure {
            file,
            line: step.line,
            text: step.text.clone(),
            kind,
        })
    }

    fn link_lost(&self, line: usize, text: &str, error: &LinkError) -> Box<Failure> {
        let kind = FailureKind::Link {
            cause: error.to_string(),
        };
        let file = self.transcript.file.clone();
        Box::new(Failure {
            file,
            line,
            text: text.to_owned(),
            kind,
        })
    }

    /// The next frame, put into words.
    async fn receive(&mut self, until: Instant) -> Result<Option<Waiting>, LinkError> {
        let Some((at, frame)) = self.bench.receive(until).await? else {
            return Ok(None);
        };
        let meaning = self.decoder.decode(at, &frame).meaning.to_string();
        Ok(Some(Waiting { at, frame, meaning }))
    }

    /// Drops what comes until the bus has settled.
    async fn settle(&mut self, ns: u64) -> Played {
        let until = self.bench.now().plus_ns(ns);
        loop {
            match self.receive(until).await {
                Ok(Some(_)) => {}
                Ok(None) => break,
                Err(error) => return Err(self.link_lost(1, "(before the first line)", &error)),
            }
        }
        self.reference = self.bench.now();
        Ok(())
    }

    fn is_ignored(&self, frame: &Frame) -> bool {
        self.rules.iter().any(|rule| match rule {
            Ignored::Heartbeats => {
                let is_state = matches!(frame.data(), [state] if *state != 0);
                is_state && matches!(frame.key(), 0x701..=0x77F)
            }
            Ignored::Frames(pattern) => pattern.takes(frame, &mut Values::new()),
        })
    }

    /// Nothing may be waiting that no rule ignores.
    fn nothing_unlisted(&mut self, line: usize, text: &str) -> Played {
        while let Some(waiting) = self.queue.pop_front() {
            if self.is_ignored(&waiting.frame) {
                self.report.ignored += 1;
                continue;
            }
            let kind = FailureKind::Unlisted {
                received: self.received(&waiting),
            };
            let file = self.transcript.file.clone();
            return Err(Box::new(Failure {
                file,
                line,
                text: text.to_owned(),
                kind,
            }));
        }
        Ok(())
    }

    /// Receives into the queue for `ns` after the line before.
    async fn wait(&mut self, step: &Step, ns: u64) -> Played {
        let until = self.reference.plus_ns(ns);
        self.listen(until, step.line, &step.text).await?;
        self.reference = until;
        Ok(())
    }

    async fn listen(&mut self, until: Instant, line: usize, text: &str) -> Played {
        loop {
            match self.receive(until).await {
                Ok(Some(waiting)) => self.queue.push_back(waiting),
                Ok(None) => return Ok(()),
                Err(error) => return Err(self.link_lost(line, text, &error)),
            }
        }
    }

    async fn send(&mut self, step: &Step, pattern: &Pattern) -> Played {
        self.listen(self.bench.now(), step.line, &step.text).await?;
        self.nothing_unlisted(step.line, &step.text)?;
        let frame = pattern.frame(&self.values).map_err(|misfit| {
            let (name, value, bytes) = (misfit.name, misfit.value, misfit.bytes);
            let cause = format!("${name} is {value}, which does not fit {bytes} bytes");
            self.failure(step, FailureKind::Unplayable { cause })
        })?;
        self.transmit(frame)
            .await
            .map_err(|e| self.link_lost(step.line, &step.text, &e))
    }

    async fn transmit(&mut self, frame: Frame) -> Result<(), LinkError> {
        self.bench.send(frame).await?;
        self.reference = self.bench.now();
        self.decoder.decode(self.reference, &frame);
        self.report.sent += 1;
        Ok(())
    }

    /// Waits for all of `expected`, in any order.
    async fn expect(
        &mut self,
        step: &Step,
        expected: &[Expectation],
        span: Option<Span>,
    ) -> Played {
        let span = span.unwrap_or(Span {
            from_ns: 0,
            to_ns: self.limit_ns,
        });
        let begin = self.reference;
        let until = begin.plus_ns(span.to_ns);
        let mut missing: Vec<&Expectation> = expected.iter().collect();
        while !missing.is_empty() {
            let waiting = match self.queue.pop_front() {
                Some(waiting) => Some(waiting),
                None => {
                    let received = self.receive(until).await;
                    received.map_err(|e| self.link_lost(step.line, &step.text, &e))?
                }
            };
            let Some(waiting) = waiting else {
                let expected = self.expected(&missing, None);
                let within_ns = span.to_ns;
                return Err(self.failure(
                    step,
                    FailureKind::Missing {
                        expected,
                        within_ns,
                    },
                ));
            };
            let values = &mut self.values;
            let taken = missing
                .iter()
                .position(|e| e.pattern.takes(&waiting.frame, values));
            let Some(taken) = taken else {
                if self.is_ignored(&waiting.frame) {
                    self.report.ignored += 1;
                    continue;
                }
                return Err(self.failure(step, self.differs(&missing, &waiting)));
            };
            let taken = missing.remove(taken);
            let received = self.received(&waiting);
            if waiting.at.since_ns(begin) < span.from_ns {
                let expected = self.expected(&[taken], Some(&waiting.frame));
                let from_ns = span.from_ns;
                return Err(self.failure(
                    step,
                    FailureKind::Early {
                        expected,
                        received,
                        from_ns,
                    },
                ));
            }
            self.report.matched += 1;
            self.reference = self.reference.max(waiting.at);
        }
        Ok(())
    }

    fn differs(&self, missing: &[&Expectation], waiting: &Waiting) -> FailureKind {
        let same_id: Vec<_> = missing
            .iter()
            .filter(|e| e.pattern.has_id_of(&waiting.frame))
            .collect();
        let differences = match same_id.as_slice() {
            [only] => only.pattern.differences(&waiting.frame, &self.values),
            _ => Vec::new(),
        };
        FailureKind::Differs {
            expected: self.expected(missing, Some(&waiting.frame)),
            received: self.received(waiting),
            differences,
        }
    }

    fn received(&self, waiting: &Waiting) -> Received {
        Received {
            frame: notation(&waiting.frame),
            meaning: waiting.meaning.clone(),
            after_ns: waiting.at.since_ns(self.reference),
        }
    }

    fn expected(&self, missing: &[&Expectation], like: Option<&Frame>) -> Vec<Expected> {
        let expected = missing.iter().map(|expectation| {
            let (example, is_open) = expectation.pattern.example(&self.values, like);
            // A copy decodes it, so that what never came teaches nothing.
            let meaning = self
                .decoder
                .clone()
                .decode(self.reference, &example)
                .meaning;
            let note = if is_open {
                ", or with other open bytes"
            } else {
                ""
            };
            Expected {
                line: expectation.line,
                frame: expectation.pattern.notation(&self.values),
                meaning: format!("{meaning}{note}"),
            }
        });
        expected.collect()
    }

    fn assert(&mut self, step: &Step, assertion: &Assertion) -> Played {
        let Assertion {
            node,
            quantity,
            comparison,
            unit,
        } = assertion;
        let reading = self.bench.quantity(*node, quantity);
        let unplayable = |cause: String| Err(self.failure(step, FailureKind::Unplayable { cause }));
        let (value, own_unit) = match reading {
            Reading::Value { value, unit } => (value, unit),
            Reading::NoPlant => {
                let text = step.text.clone();
                self.report.not_checked.push(NotChecked {
                    line: step.line,
                    text,
                });
                return Ok(());
            }
            Reading::UnknownNode => {
                return unplayable(format!("there is no node {node}; name it under \"nodes\""));
            }
            Reading::UnknownQuantity { known } => {
                let known = known.join(", ");
                return unplayable(format!("no quantity \"{quantity}\"; there are {known}"));
            }
        };
        if !own_unit.eq_ignore_ascii_case(unit) {
            let unit = if unit.is_empty() { "no unit" } else { unit };
            return unplayable(format!("{quantity} is in {own_unit}, not in {unit}"));
        }
        if comparison.holds(value) {
            self.report.assertions += 1;
            return Ok(());
        }
        let measured = format!("node {node} {quantity} {value} {own_unit}");
        let wanted = format!("node {node} {quantity} {comparison} {unit}");
        Err(self.failure(step, FailureKind::Assertion { measured, wanted }))
    }

    /// Plays a block that must fail at its last line.
    async fn misprint(&mut self, step: &Step, block: &'a Block) -> Played {
        let Some((last, before)) = block.steps.split_last() else {
            return Ok(());
        };
        let values = self.values.clone();
        let not_checked = self.report.not_checked.len();
        for inner in before {
            self.step(inner).await?;
        }
        let shown = self.step(last).await;
        self.values = values;
        let instead = match shown.map_err(|failure| failure.kind) {
            Err(FailureKind::Differs { received, .. } | FailureKind::Unlisted { received }) => {
                format!("{} ({})", received.frame, received.meaning)
            }
            Err(FailureKind::Early { received, .. }) => {
                format!("{} after {}", received.frame, duration(received.after_ns))
            }
            Err(FailureKind::Missing { within_ns, .. }) => {
                format!("nothing within {}", duration(within_ns))
            }
            Err(FailureKind::Assertion { measured, .. }) => measured,
            Err(kind @ (FailureKind::Link { .. } | FailureKind::Unplayable { .. })) => {
                return Err(self.failure(last, kind));
            }
            Ok(()) if self.report.not_checked.len() > not_checked => return Ok(()),
            Ok(()) | Err(FailureKind::NoMisprint { .. }) => {
                let reason = block.reason.clone();
                return Err(self.failure(step, FailureKind::NoMisprint { reason }));
            }
        };
        self.reference = self.bench.now();
        let reason = block.reason.clone();
        self.report.misprints.push(Misprint {
            line: step.line,
            reason,
            instead,
        });
        Ok(())
    }

    /// After the last line nothing unlisted may follow.
    async fn closing(&mut self) -> Played {
        let steps = &self.transcript.steps;
        let last = self
            .transcript
            .finally
            .last()
            .or(steps.last())
            .map_or(0, |step| step.line);
        let text = "(after the last line)";
        self.listen(self.bench.now().plus_ns(self.limit_ns), last + 1, text)
            .await?;
        self.nothing_unlisted(last + 1, text)
    }

    /// Carries out `finally` after a failure: sends and waits, and checks nothing.
    async fn clear_up(&mut self, finally: &'a [Step]) {
        for step in finally {
            let done = match &step.action {
                Action::Send(pattern) => match pattern.frame(&self.values) {
                    Ok(frame) => self.transmit(frame).await.is_ok(),
                    Err(_) => true,
                },
                // Give the drive the time for its answer that a line allows.
                Action::Expect(expected, span) => {
                    let until = self
                        .reference
                        .plus_ns(span.map_or(self.limit_ns, |s| s.to_ns));
                    self.pass(until, |frame| {
                        expected.iter().any(|e| e.pattern.has_id_of(frame))
                    })
                    .await
                }
                Action::Wait(ns) | Action::Silence(ns) => {
                    self.pass(self.reference.plus_ns(*ns), |_| false).await
                }
                _ => true,
            };
            if !done {
                return;
            }
        }
    }

    /// Drops frames until `until` or the first that `ends`; false if the link broke.
    async fn pass(&mut self, until: Instant, ends: impl Fn(&Frame) -> bool) -> bool {
        loop {
            match self.receive(until).await {
                Ok(Some(waiting)) if ends(&waiting.frame) => return true,
                Ok(Some(_)) => {}
                Ok(None) => return true,
                Err(_) => return false,
            }
        }
    }
}
