//! S, M, SETMS, OVRA, ACC and VELOLIM of spindles: what the spindle of the machine file is told, and what is only on record.
//!
//! In: words of a block. Out: modal state, events. Decisions where the manuals leave room:
//!
//! * The machine file describes spindle 1, and that one is simulated. S, M3, M4, M5, M19, M70 mean the master spindle: behind SETMS(2) they are put on record with
//!   their number, and spindle 1 goes on as it was told. Any other spindle is at its speed at once, nothing waits for it, and the first one is reported.
//! * OVRA\[S1\] and the switch of the control panel multiply S; G25 S, G26 S, LIMS and the highest speed of the machine hold behind them. Not in tapping.
//! * ACC\[S1\] acts on ramps that begin later; VELOLIM\[S1\] is a share of the highest speed of the machine file.
//!
//! Positions are in `spindle_position`. Does not know when the spindle has its speed.

use super::block::Collected;
use super::feed_state::SIMULATED_SPINDLE;
use super::feed_words::{percent, turns_after};
use super::run::Interpreter;
use super::value::trimmed;
use super::wire::Event;
use crate::base::units::mm_s_from_m_min;
use crate::program::words::IndexedAddress;
use crate::program::{Columns, Fault, Outcome, codes};

/// The M function that positions.
const POSITION: u32 = 19;

impl Interpreter {
    /// Events of the block; those of a master spindle that is not simulated get its number.
    pub(super) fn take_events(&self, block: &mut Collected) -> Vec<Event> {
        let mut events = std::mem::take(&mut block.events);
        let modes = &self.modal.feed_modes;
        if !modes.master_is_simulated() {
            let master = modes.master_spindle;
            for event in &mut events {
                let named = match event {
                    Event::SpindleSpeed { speed_rpm } => format!("S{master}={}", trimmed(*speed_rpm)),
                    Event::MFunction(function) if turns_after(*function).is_some() => format!("M{master}={function}"),
                    _ => continue,
                };
                *event = Event::Spindle(named.into());
            }
        }
        events.append(&mut block.simulated_spindle);
        events
    }

    /// S: the speed, or under G96 the cutting speed.
    pub(super) fn take_spindle_speed(&mut self, speed: f64, columns: &Columns, block: &mut Collected) {
        if self.modal.feed_modes.cutting {
            self.modal.feed_modes.cutting_speed_mm_s = Some(mm_s_from_m_min(speed));
            let speed_rpm = self.cutting_rpm_here().unwrap_or(0.0);
            self.keep_speed(speed_rpm);
            return output_speed(block, speed_rpm);
        }
        self.modal.spindle_speed_rpm = speed;
        let modes = &self.modal.feed_modes;
        let limited_rpm = modes.limited_rpm(speed);
        if modes.highest_rpm().is_some_and(|highest_rpm| speed * modes.override_ratio() > highest_rpm) {
            self.report_too_high(speed, columns);
        }
        if limited_rpm != speed {
            output_speed(block, limited_rpm);
        }
    }

    /// The speed that the spindle has came from a cutting speed, overrides included: S is without them.
    pub(super) fn keep_speed(&mut self, speed_rpm: f64) {
        self.modal.spindle_speed_rpm = speed_rpm / self.modal.feed_modes.override_ratio();
    }

    /// S2=.
    pub(super) fn speed_of(&mut self, spindle: u32, speed_rpm: f64, columns: &Columns, block: &mut Collected) {
        let modes = &self.modal.feed_modes;
        if spindle == modes.master_spindle {
            block.spindle_speed_rpm = Some((speed_rpm, columns.clone()));
            return block.events.push(Event::SpindleSpeed { speed_rpm });
        }
        if spindle == SIMULATED_SPINDLE {
            let limited_rpm = self.simulated_rpm(speed_rpm);
            block.simulated_spindle.push(Event::SpindleSpeed { speed_rpm: limited_rpm });
        } else {
            block.events.push(Event::Spindle(format!("S{spindle}={}", trimmed(speed_rpm)).into()));
            self.report_unsimulated(spindle, columns);
        }
        self.other_spindle(spindle, |state| state.0 = speed_rpm);
    }

    /// M2=.
    pub(super) fn function_of(&mut self, spindle: u32, function: u32, columns: &Columns, block: &mut Collected) {
        if spindle == SIMULATED_SPINDLE && spindle == self.modal.feed_modes.master_spindle {
            return self.m_word(function, block);
        }
        let Some(turns) = turns_after(function) else {
            return block.events.push(Event::Spindle(format!("M{spindle}={function}").into()));
        };
        if spindle == self.modal.feed_modes.master_spindle {
            return self.m_word(function, block);
        }
        if spindle == SIMULATED_SPINDLE {
            block.simulated_spindle.push(Event::MFunction(function));
            if function == POSITION {
                block.simulated_spindle.push(super::spindle_position::home());
                block.waits_for_spindle |= self.machine.spindle.is_some();
            }
        } else {
            block.events.push(Event::Spindle(format!("M{spindle}={function}").into()));
            self.report_unsimulated(spindle, columns);
        }
        self.other_spindle(spindle, |state| state.1 = turns);
    }

    /// OVRA, ACC and VELOLIM of a spindle.
    pub(super) fn spindle_word(
        &mut self,
        address: IndexedAddress,
        (spindle, name): (u32, &str),
        value_percent: f64,
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        let word = format!("{}[{name}]", super::feed_words::word_of(address));
        block.events.push(Event::Spindle(format!("{word}={}", trimmed(value_percent)).into()));
        if spindle != SIMULATED_SPINDLE {
            self.report_unsimulated(spindle, columns);
            return Ok(());
        }
        match address {
            IndexedAddress::AxisOverride => {
                self.modal.feed_modes.spindle_override_ratio[0] = percent(&word, value_percent, 200.0, columns)?;
            }
            IndexedAddress::Velocity => {
                self.modal.feed_modes.spindle_max_ratio = percent(&word, value_percent, 100.0, columns)?;
            }
            IndexedAddress::Acceleration => {
                let ratio = percent(&word, value_percent, 200.0, columns)?;
                block.simulated_spindle.push(Event::SpindleAcceleration { ratio });
                return Ok(());
            }
            _ => return Ok(()),
        }
        let speed_rpm = self.simulated_speed_rpm();
        if speed_rpm > 0.0 {
            block.simulated_spindle.push(Event::SpindleSpeed { speed_rpm });
        }
        Ok(())
    }

    /// SETMS: speed and sense of the old master spindle are kept for its number.
    pub(super) fn set_master(&mut self, spindle: u32, columns: &Columns) {
        let modal = &mut self.modal;
        let modes = &mut modal.feed_modes;
        if spindle == modes.master_spindle {
            return;
        }
        modes.other_spindles.insert(modes.master_spindle, (modal.spindle_speed_rpm, modes.spindle_turns));
        let (speed_rpm, turns) = modes.other_spindles.remove(&spindle).unwrap_or((0.0, false));
        (modal.spindle_speed_rpm, modes.spindle_turns, modes.master_spindle) = (speed_rpm, turns, spindle);
        if spindle != SIMULATED_SPINDLE {
            self.report_unsimulated(spindle, columns);
        }
    }

    /// What the simulated spindle gets now.
    pub(super) fn simulated_speed_rpm(&self) -> f64 {
        let modes = &self.modal.feed_modes;
        if !modes.master_is_simulated() {
            return modes.other_spindles.get(&SIMULATED_SPINDLE).map_or(0.0, |state| self.simulated_rpm(state.0));
        }
        if modes.cutting {
            return self.cutting_rpm_here().unwrap_or(0.0);
        }
        modes.limited_rpm(self.modal.spindle_speed_rpm)
    }

    /// What it gets for an S while another one is the master spindle: G25 S and G26 S are of that one.
    fn simulated_rpm(&self, speed_rpm: f64) -> f64 {
        let modes = &self.modal.feed_modes;
        let override_ratio: f64 = modes.spindle_override_ratio.iter().product();
        let highest_rpm = modes.spindle_max_rpm.map_or(f64::INFINITY, |max_rpm| max_rpm * modes.spindle_max_ratio);
        (speed_rpm * override_ratio).min(highest_rpm)
    }

    /// Where spindles take their time, one that does not is told of.
    pub(super) fn report_unsimulated(&mut self, spindle: u32, columns: &Columns) {
        if self.machine.spindle.is_none() || !self.first_report(codes::SPINDLE_UNKNOWN) {
            return;
        }
        let message = format!("spindle {spindle} is not simulated: it is at its speed and at its position at once");
        let fault = Fault::new(codes::SPINDLE_UNKNOWN, columns.clone(), message)
            .label("takes no time")
            .help("the machine file describes spindle 1 alone; what this one is told is recorded, and F a revolution counts with its S");
        self.warn(*fault);
    }

    fn report_too_high(&mut self, speed_rpm: f64, columns: &Columns) {
        let Some(highest_rpm) = self.modal.feed_modes.highest_rpm() else { return };
        if !self.first_report(codes::SPINDLE_LIMITED) {
            return;
        }
        let message = format!(
            "S{} is above the highest speed of the spindle, which turns at {} rpm",
            trimmed(speed_rpm),
            trimmed(highest_rpm)
        );
        let fault = Fault::new(codes::SPINDLE_LIMITED, columns.clone(), message)
            .label("limited, as on the control")
            .help("give a lower S, or --set spindle.speed_max_rpm; F a revolution counts with the limited speed");
        self.warn(*fault);
    }
}

/// The speed that the spindle is given in place of the programmed one.
fn output_speed(block: &mut Collected, speed_rpm: f64) {
    for event in &mut block.events {
        if matches!(event, Event::SpindleSpeed { .. }) {
            *event = Event::SpindleSpeed { speed_rpm };
        }
    }
}
