//! Giving power to the motor and taking it away.

use canopen::Instant;
use cia402::{State, Statusword};

use super::{
    CONTROLWORD, Cause, ERROR_CODE, MODE, MODE_DISPLAY, STATUSWORD, SYNC_LOSS, Session, VOLTAGE_D,
    Watch,
};
use crate::{Link, LinkError};

/// The drive takes the power away by itself after so long without SYNC. Long enough for a slow way
/// to the bus, short enough for a winding.
const SUPERVISION_MS: u16 = 1_000;
/// How long a transition or a change of mode may take.
const WITHIN_MS: u64 = 500;

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Walks to operation enabled by the manual's two writes (P3 l.243), and by the standard's
    /// where the drive does not take fault reset and command in one.
    pub(crate) async fn enable(&mut self) -> Result<(), Cause> {
        self.looked = None;
        self.borrow(SYNC_LOSS, i64::from(SUPERVISION_MS)).await?;
        self.supervised_ms = SUPERVISION_MS;
        self.write(CONTROLWORD, 0x0086).await?;
        if self.state().await? != Some(State::ReadyToSwitchOn) {
            self.write(CONTROLWORD, 0x0006).await?;
            self.reach(State::ReadyToSwitchOn).await?;
        }
        self.powered = true;
        self.write(CONTROLWORD, 0x000F).await?;
        if self.state().await? == Some(State::SwitchedOn) {
            self.write(CONTROLWORD, 0x000F).await?;
        }
        self.reach(State::OperationEnabled).await?;
        self.looked = Some(self.client.now());
        Ok(())
    }

    async fn state(&mut self) -> Result<Option<State>, Cause> {
        Ok(Statusword(self.read(STATUSWORD).await? as u16).state())
    }

    async fn reach(&mut self, wanted: State) -> Result<(), Cause> {
        let until = self.client.now().plus_ms(WITHIN_MS);
        loop {
            let word = self.read(STATUSWORD).await? as u16;
            match Statusword(word).state() {
                Some(state) if state == wanted => return Ok(()),
                Some(State::Fault) => return Err(self.fault().await),
                _ if self.client.now() >= until => {
                    return Err(Cause::Unreached {
                        wanted,
                        statusword: word,
                    });
                }
                _ => self.wait(5).await?,
            }
        }
    }

    async fn fault(&mut self) -> Cause {
        let code = self.read_anyway(ERROR_CODE).await;
        Cause::Fault {
            code: code.ok().map(|code| code as u16),
        }
    }

    /// Fails if the drive is not in operation enabled any more.
    pub(crate) async fn must_be_enabled(&mut self) -> Result<(), Cause> {
        self.looked = Some(self.client.now());
        let word = self.read(STATUSWORD).await? as u16;
        self.judge(word).await
    }

    /// Fails if a statusword is not that of operation enabled.
    pub(crate) async fn judge(&mut self, word: u16) -> Result<(), Cause> {
        match Statusword(word).state() {
            Some(State::OperationEnabled) => Ok(()),
            Some(State::Fault | State::FaultReactionActive) => Err(self.fault().await),
            _ => Err(Cause::State { statusword: word }),
        }
    }

    pub(crate) async fn set_mode(&mut self, mode: i8) -> Result<(), Cause> {
        self.write(MODE, i64::from(mode)).await?;
        let until = self.client.now().plus_ms(WITHIN_MS);
        loop {
            let shown = self.read(MODE_DISPLAY).await? as i8;
            if shown == mode {
                return Ok(());
            }
            if self.client.now() >= until {
                return Err(Cause::Mode {
                    wanted: mode,
                    shown,
                });
            }
            self.wait(5).await?;
        }
    }

    /// Takes the power from the motor, whatever the user wants: voltage 0, mode idle, disable
    /// voltage. A drive in fault has done so by itself.
    ///
    /// # Errors
    /// [`Cause::Unreached`] if the drive answers and keeps the power; it does not answer otherwise.
    pub(crate) async fn power_off(&mut self) -> Result<(), Cause> {
        self.looked = None;
        if !self.powered {
            return Ok(());
        }
        // The first two matter if the last one gets lost. They are refused in other modes and
        // states, which is as good.
        let _ = self.write_anyway(VOLTAGE_D, 0).await;
        let _ = self.write_anyway(MODE, 0).await;
        match self.write_anyway(CONTROLWORD, 0).await {
            // Its state says how it stands.
            Err(Cause::Sdo(error)) if error.abort().is_some() => {}
            written => written?,
        }
        let until = self.client.now().plus_ms(WITHIN_MS);
        loop {
            let word = self.read_anyway(STATUSWORD).await? as u16;
            if matches!(
                Statusword(word).state(),
                Some(
                    State::SwitchOnDisabled
                        | State::ReadyToSwitchOn
                        | State::Fault
                        | State::NotReadyToSwitchOn
                )
            ) {
                self.powered = false;
                return Ok(());
            }
            if self.client.now() >= until {
                return Err(Cause::Unreached {
                    wanted: State::SwitchOnDisabled,
                    statusword: word,
                });
            }
            let next = self.client.now().plus_ms(5);
            self.quiet(next).await?;
        }
    }

    /// [`Session::power_off`]; if the drive does not obey, it is left without SYNC for as long as it
    /// takes the power away by itself.
    pub(super) async fn power_off_by_all_means(&mut self) -> Result<(), Cause> {
        match self.power_off().await {
            Err(Cause::Unreached { .. }) if self.supervised_ms > 0 => {
                let wait_ms = u64::from(self.supervised_ms) + WITHIN_MS;
                let until = self.client.now().plus_ms(wait_ms);
                self.quiet(until).await?;
                self.power_off().await
            }
            done => done,
        }
    }

    /// Lets time pass without a look and without SYNC.
    async fn quiet(&mut self, until: Instant) -> Result<(), Cause> {
        let nothing = self.client.wait_for(until, |_, _| None::<()>).await;
        nothing.map_err(|error: LinkError| Cause::Link(error))?;
        Ok(())
    }
}
