//! G33, G34, G35, G331 and G332: the path and the master spindle as one motion.
//!
//! In: axis words, I, J or K, SF, F, the speed of the spindle. Out: the [`Thread`] of the block, a straight line, and its nominal feed.
//!
//! * I, J or K is the way of X, Y or Z in one revolution: the word of the axis that goes the longer way on a taper, exactly one of them in
//!   every block. The path makes its length over that axis' way as much.
//! * G34 and G35 change the lead by F from one revolution to the next, so that its square changes by 2 F a millimetre. F holds until the next one
//!   and is not the F of the path.
//! * SF is the angle of the spindle at which the block begins, 0 without it. A block that goes on from another thread needs none.
//! * G331: the sign of the lead is the sense of the spindle, as M3 or as M4; G332 turns it back. The spindle must stand, S is its speed.
//! * The cutting speed must not be constant (G96): the spindle would change its speed in the thread.
//!
//! * DITS and DITE hold until they are written again (SD42010); a negative one is as without: what the limits of the axes need.
//! * Overrides of the spindle act on threads that are cut, and not on tapping.
//!
//! Does not know accelerations, nor when the spindle passes an angle.

use super::block::Collected;
use super::motion::MotionWords;
use super::run::Interpreter;
use super::value::trimmed;
use super::wire::{Feed, MoveKind, Thread, ThreadCoupling};
use crate::base::units::{RAD_PER_REV, rad_from_deg, rad_s_from_rpm};
use crate::base::{AxisKind, PartPoint};
use crate::program::syntax::Typed;
use crate::program::words::ThreadWord;
use crate::program::{Columns, Fault, Outcome, codes};
use std::sync::Arc;

/// Leads of the control, mm.
const LEAD_MIN_MM: f64 = 0.001;
const LEAD_MAX_MM: f64 = 2000.0;

/// Names of the words of the lead, by axis.
const LEAD_WORDS: [&str; 3] = ["I", "J", "K"];

/// F of a block of a thread: what the spindle asks for in the mean.
pub(super) fn thread_feed(thread: &Thread, length_mm: f64) -> Feed {
    let mean_mm = 0.5 * (thread.rise_mm + thread.rise_at_mm(length_mm));
    Feed::Path { feed_lu_s: mean_mm / RAD_PER_REV * thread.speed_rad_s }
}

impl Interpreter {
    /// F under G34 and G35: the change of the lead, and no feed.
    pub(super) fn take_lead_change(&mut self, block: &mut Collected) -> Outcome<()> {
        let changes = super::modal::Motion::Thread(ThreadWord::Rising);
        let shrinks = super::modal::Motion::Thread(ThreadWord::Falling);
        if ![changes, shrinks].contains(&self.modal.motion) || !block.motion.any() {
            return Ok(());
        }
        let Some((typed, columns)) = block.feed.take() else { return Ok(()) };
        if !(typed.0 > 0.0 && typed.0 <= LEAD_MAX_MM) {
            return Err(Fault::new(codes::OUT_OF_RANGE, columns, "F of G34 and G35 is the change of the lead")
                .label(format!("expected more than 0 and at most {LEAD_MAX_MM} mm a revolution")));
        }
        self.modal.lead_change_mm = self.modal.length_mm(typed);
        Ok(())
    }

    /// DITS and DITE; a negative value is that of the axes again.
    pub(super) fn thread_run(&mut self, leaves: bool, typed: Typed, columns: &Columns) -> Outcome<()> {
        let run_mm = self.modal.length_mm(typed);
        if run_mm.is_nan() || run_mm > LEAD_MAX_MM {
            let message = "DITS and DITE are ways of the axis of the thread";
            return Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), message)
                .label(format!("expected at most {LEAD_MAX_MM} mm, or -1")));
        }
        self.modal.thread_runs_mm[usize::from(leaves)] = (run_mm >= 0.0).then_some(run_mm);
        Ok(())
    }

    /// The block as a thread; leaves its coupling in the modal state for the move.
    pub(super) fn thread(&mut self, word: ThreadWord, words: &MotionWords, end: PartPoint) -> Outcome<MoveKind> {
        let columns = words.columns();
        let taps = matches!(word, ThreadWord::Tap | ThreadWord::Retract);
        let (lead_mm, axis_way_mm) = self.lead(words)?;
        if lead_mm < 0.0 && !taps {
            return Err(Fault::new(codes::OUT_OF_RANGE, columns, "a lead below 0: M3 and M4 decide on right or left")
                .label("expected a lead above 0"));
        }
        let way = end.0 - self.position.0;
        let linear = self.machine.axis_ids().filter(|id| self.machine.axis(*id).kind == AxisKind::Linear);
        let length_mm = linear.map(|id| way[id] * way[id]).sum::<f64>().sqrt();
        let ratio = length_mm / axis_way_mm.abs();
        let change_mm = match word {
            ThreadWord::Rising => self.modal.lead_change_mm,
            ThreadWord::Falling => -self.modal.lead_change_mm,
            _ => 0.0,
        };
        if change_mm == 0.0 && matches!(word, ThreadWord::Rising | ThreadWord::Falling) {
            return Err(Fault::new(codes::NO_FEED, columns, "G34 and G35 need F, the change of the lead")
                .label("expected F with mm a revolution"));
        }
        let speed_rad_s = self.thread_speed(taps, &columns)?;
        let coupling = match word {
            ThreadWord::Tap => ThreadCoupling::Tap { sense_ratio: lead_mm.signum() },
            ThreadWord::Retract => ThreadCoupling::Tap { sense_ratio: -lead_mm.signum() },
            _ => ThreadCoupling::Cut {
                start_angle_rad: words.start_angle.as_ref().map(|(typed, _)| rad_from_deg(typed.0)),
            },
        };
        let runs_mm = self.modal.thread_runs_mm.map(|run_mm| run_mm.map(|run_mm| run_mm * ratio));
        let simulated = self.modal.feed_modes.master_is_simulated();
        let thread = Thread {
            coupling,
            rise_mm: lead_mm.abs() * ratio,
            rise_change_mm: change_mm * ratio,
            speed_rad_s,
            runs_mm,
            simulated,
        };
        let last_mm = thread.rise_at_mm(length_mm) / ratio;
        if last_mm.is_nan() || last_mm < LEAD_MIN_MM {
            let most_mm = lead_mm * lead_mm / (2.0 * axis_way_mm.abs());
            return Err(Fault::new(codes::OUT_OF_RANGE, columns, "the lead falls to 0 before the end of the block")
                .label("too long for this F")
                .help(format!("over {} mm F can be at most {}", trimmed(axis_way_mm.abs()), trimmed(most_mm))));
        }
        self.modal.thread = Some(Arc::new(thread));
        Ok(MoveKind::Line)
    }

    /// The lead with its sign, and the way of its axis.
    fn lead(&self, words: &MotionWords) -> Outcome<(f64, f64)> {
        let columns = words.columns();
        let bad = |message: &str, label: &str| {
            Err(Fault::new(codes::BAD_BLOCK, columns.clone(), message)
                .label(label)
                .help("such as G33 Z-20 K1.5: K is the way of Z in one revolution"))
        };
        let mut given = (0..3).filter_map(|i| Some((i, words.centre[i].as_ref()?)));
        let (Some((index, word)), None, None) = (given.next(), given.next(), &words.radius) else {
            return bad("a thread needs its lead", "expected exactly one of I, J and K");
        };
        let Some(axis) = self.geometry[index] else {
            return bad("the machine does not have the axis of this lead", "expected the word of an axis that moves");
        };
        let lead_mm = self.modal.position_lu(AxisKind::Linear, word.typed);
        if !(LEAD_MIN_MM..=LEAD_MAX_MM).contains(&lead_mm.abs()) {
            let message = format!("{}{} is no lead", LEAD_WORDS[index], trimmed(word.typed.0));
            return Err(Fault::new(codes::OUT_OF_RANGE, word.columns.clone(), message)
                .label(format!("expected {LEAD_MIN_MM} to {LEAD_MAX_MM} mm a revolution")));
        }
        let start_mm = self.work_position_lu(words.suppression)[axis];
        let axis_way_mm = match &words.axes[axis] {
            Some(word) => self.axis_target_lu(axis, word, words.suppression)? - start_mm,
            None => 0.0,
        };
        if axis_way_mm.abs() < LEAD_MIN_MM {
            return bad("the axis of this lead does not move", "expected the word of an axis that moves");
        }
        Ok((lead_mm, axis_way_mm))
    }

    /// Speed of the spindle in a thread.
    fn thread_speed(&self, taps: bool, columns: &Columns) -> Outcome<f64> {
        let modes = &self.modal.feed_modes;
        let fault = |message: &str, help: &str| {
            Err(Fault::new(codes::BAD_BLOCK, columns.clone(), message).label("not with this spindle").help(help))
        };
        if modes.cutting {
            return fault(
                "a thread under a constant cutting speed",
                "write G97 and S before it: the spindle must keep its speed",
            );
        }
        if taps && modes.spindle_turns {
            return fault(
                "G331 and G332 need a spindle that stands",
                "write SPOS=0 (or M5) before it; S alone is the speed of tapping (alarm 16715 of the control)",
            );
        }
        if !taps && !modes.spindle_turns {
            return fault("a thread, and the spindle stands", "write M3 or M4 before it; the control would wait here");
        }
        let speed_rpm = match taps {
            true => modes.within_limits_rpm(self.modal.spindle_speed_rpm),
            false => modes.limited_rpm(self.modal.spindle_speed_rpm),
        };
        if speed_rpm <= 0.0 {
            return fault("a thread, and no spindle speed is programmed", "write S before it");
        }
        Ok(rad_s_from_rpm(speed_rpm))
    }
}
