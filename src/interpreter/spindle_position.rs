//! SPOS, SPOSA and M19: where the spindle is sent.
//!
//! In: words of a block. Out: events, and whether the block waits. Decisions where the manuals leave room:
//!
//! * A plain value, AC and DC go on in the sense in which the spindle turns; from rest they take the shorter way. ACP and ACN turn as they say.
//! * IC counts from where the spindle stands, or comes to rest.
//! * SPOS and M19 end their block when the spindle has arrived; SPOSA does not, WAITS waits for it. M19 goes to 0 (SD43240).
//!
//! Only spindle 1 is simulated: others are on record. Does not know the law of the motion.

use super::block::Collected;
use super::evaluate::number;
use super::feed_state::SIMULATED_SPINDLE;
use super::feed_words::word_of;
use super::run::Interpreter;
use super::value::trimmed;
use super::wire::{Event, SpindleApproach, SpindlePositioning};
use crate::base::units::rad_from_deg;
use crate::program::syntax::{AddressValue, Expr, Form};
use crate::program::words::IndexedAddress;
use crate::program::{Columns, Fault, Outcome, codes};

/// Largest angle or way: 10,000 revolutions.
const ANGLE_MAX_DEG: f64 = 3.6e6;

impl Interpreter {
    /// SPOS and SPOSA: the spindle stands afterwards.
    pub(super) fn position_spindle(
        &mut self,
        address: IndexedAddress,
        index: Option<&Expr>,
        value: &AddressValue,
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        let angle_deg = number(&value.value, self)?;
        if angle_deg.abs() > ANGLE_MAX_DEG || angle_deg.is_nan() {
            let message = format!("{angle_deg} deg is no position of a spindle");
            return Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), message)
                .label(format!("expected at most {ANGLE_MAX_DEG} deg")));
        }
        let word = word_of(address);
        let name = match index {
            Some(index) => format!("[{}]", number(index, self)?),
            None => String::new(),
        };
        let (approach, shown) = match value.form {
            Form::Modal => (SpindleApproach::Onward, trimmed(angle_deg)),
            Form::Absolute => (SpindleApproach::Onward, format!("AC({})", trimmed(angle_deg))),
            Form::Shortest => (SpindleApproach::Onward, format!("DC({})", trimmed(angle_deg))),
            Form::Positive => (SpindleApproach::Positive, format!("ACP({})", trimmed(angle_deg))),
            Form::Negative => (SpindleApproach::Negative, format!("ACN({})", trimmed(angle_deg))),
            Form::Incremental => (SpindleApproach::By, format!("IC({})", trimmed(angle_deg))),
        };
        let text = format!("{word}{name}={shown}").into();
        let spindle = match index {
            Some(index) => number(index, self)?.max(0.0) as u32,
            None => self.modal.feed_modes.master_spindle,
        };
        self.other_spindle(spindle, |state| state.1 = false);
        if spindle != SIMULATED_SPINDLE {
            self.report_unsimulated(spindle, columns);
            self.report_no_time(columns, "SPOS of this spindle is recorded and takes no time: only spindle 1 moves");
            block.events.push(Event::Spindle(text));
            return Ok(());
        }
        let positioning = SpindlePositioning { angle_rad: rad_from_deg(angle_deg), approach, text };
        block.events.push(Event::SpindlePosition(positioning.into()));
        if self.machine.spindle.is_none() {
            self.report_no_time(columns, "SPOS takes no time: the machine file has no `[spindle]`");
        } else {
            block.waits_for_spindle |= address == IndexedAddress::SpindlePosition;
        }
        Ok(())
    }

    /// M19.
    pub(super) fn home_spindle(&mut self, block: &mut Collected) {
        if !self.modal.feed_modes.master_is_simulated() {
            return;
        }
        block.events.push(home());
        block.waits_for_spindle |= self.machine.spindle.is_some();
    }

    fn report_no_time(&mut self, columns: &Columns, message: &str) {
        if self.first_report(codes::SPINDLE_TIME) {
            let fault = Fault::new(codes::SPINDLE_TIME, columns.clone(), message)
                .label("takes no time")
                .help("give the machine file `acceleration_rot_s2` of the master spindle, such as --set spindle.acceleration_rot_s2=20");
            self.warn(*fault);
        }
    }
}

/// To 0, as M19.
pub(super) fn home() -> Event {
    let positioning = SpindlePositioning { angle_rad: 0.0, approach: SpindleApproach::Onward, text: "".into() };
    Event::SpindlePosition(positioning.into())
}
