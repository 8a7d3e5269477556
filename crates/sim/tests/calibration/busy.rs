//! Calibration by a master that is held up again and again, as on an overloaded computer.

use can::Frame;
use client::{Link, LinkError};

use super::motors::Dice;
use super::*;

/// A link whose master is held up now and then before it sends. Frames have the stamp of the bus.
struct Busy<'a> {
    link: VirtualLink<'a>,
    dice: Dice,
    /// How often, and for how long at most, ms.
    share: f64,
    most_ms: f64,
    stamp_ns: Option<u64>,
    held_up: u32,
}

impl Link for Busy<'_> {
    fn now(&self) -> Instant {
        self.link.now()
    }

    fn stamp_ns(&self) -> Option<u64> {
        self.stamp_ns
    }

    async fn send(&mut self, frame: Frame) -> Result<(), LinkError> {
        if self.dice.roll() < self.share {
            let ms = self.dice.between(1.0, self.most_ms);
            let until = self.link.now().plus_ns((ms * 1e6) as u64);
            self.link.bus().run_until(until);
            self.held_up += 1;
        }
        self.link.send(frame).await
    }

    async fn receive(&mut self, until: Instant) -> Result<Option<(Instant, Frame)>, LinkError> {
        let received = self.link.receive(until).await?;
        if let Some((at, _)) = received {
            self.stamp_ns = Some(at.0);
        }
        Ok(received)
    }
}

#[test]
fn a_master_that_is_held_up_finds_the_same() {
    let all = for_each(16, |seed| {
        let motor = individual(seed);
        let mut bus = bus(&motor, personality(seed), seed);
        let link = Busy {
            link: VirtualLink::new(&mut bus, 0),
            dice: Dice::new(seed ^ 0xB057),
            share: 0.1,
            most_ms: 25.0,
            stamp_ns: None,
            held_up: 0,
        };
        let mut client = Client::new(link);
        let found = block_on(async {
            enter(&mut client, NODE, &motor.sheet).await;
            let mut session = Session::new(&mut client, NODE, ());
            session.calibrate_current_sensor().await?;
            let zero = session.calibrate_electrical_zero(Method::Turn).await?;
            let lag = session.calibrate_encoder_lag().await?;
            Ok::<_, ProcedureError>((zero, lag))
        });
        let held_up = client.into_link().held_up;
        assert!(held_up > 200, "{held_up}");
        let (zero, lag) = found.map_err(|error| format!("motor {seed}: {error}"))?;
        let truth = &motor.truth;
        let turn = COUNTS / f64::from(truth.motor.pole_pairs);
        let off = zero.zero_counts.round() - f64::from(truth.encoder.zero_counts);
        let off = (off + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
        let lag_deg = (lag.lag_us * 1e-6 - truth.encoder.lag_s) * lag.speed / turn * 360.0;
        Ok::<_, String>((off / turn * 360.0, lag_deg))
    });
    println!("{all:.2?}");
    for (seed, result) in all.iter().enumerate() {
        let (zero_deg, lag_deg) = result.as_ref().unwrap_or_else(|text| panic!("{text}"));
        assert!(zero_deg.abs() <= 0.5, "motor {seed}: {zero_deg} degrees");
        assert!(lag_deg.abs() <= 1.0, "motor {seed}: {lag_deg} degrees");
    }
}
