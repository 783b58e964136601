//! The spindle in the window: waits for it, threads and constant cutting speed, what is refused, and the law of the front piece.
//!
//! In: a piece with a thread, the spindle. Out: a [`ThreadPiece`] or an alarm; its [`TimeLaw`], and the motion of the spindle that it leads. Does not
//! calculate laws: `thread` does.

use super::{Entry, Motion, Planner};
use crate::base::Diagnostic;
use crate::base::units::{percent_from_ratio, rpm_from_rad_s};
use crate::feed::junction::STOP;
use crate::feed::limits::Ends;
use crate::feed::thread::{Before, ThreadPiece, TooFast, Turning};
use crate::feed::{LimitKind, SpindleMotion, TimeLaw};
use crate::geometry::Curve;
use crate::interpreter::{Event, Feed};
use crate::kinematics::JointPath;
use crate::smoothing::{ContourPiece, PieceKind};

/// A spindle whose speed is off by more under a constant cutting speed is told of.
const OFF_SHARE_MAX: f64 = 0.1;

/// Speeds above their limits by less are rounding, as for the thread.
const ROUNDING_RATIO: f64 = 1e-9;

impl Planner {
    /// Before a feed that follows a change of the spindle speed, or begins with one, the path rests. What happens when the piece begins happens
    /// when the wait does.
    pub(super) fn wait_for_spindle(&mut self, path: &mut JointPath) {
        let contour = &mut path.contour;
        let curve = contour.curve().filter(|curve| curve.length_lu() != 0.0);
        let feeds = curve.is_some() && contour.feed != Feed::Rapid;
        // A thread waits in its own law.
        if !self.spindle.push(&contour.events, feeds) || contour.modes.thread.is_some() {
            return;
        }
        let Some(at) = contour.curve().map(Curve::start) else { return };
        let wait = ContourPiece {
            kind: PieceKind::Wait { time_s: 0.0, at },
            events: std::mem::take(&mut contour.events),
            blocks_begun: 0,
            block_length_lu: None,
            stop_at_end: true,
            ..contour.clone()
        };
        (self.last, self.last_thread, self.ramp) = (None, None, None);
        self.entries.push_back(Entry {
            path: JointPath { contour: wait, transformation: path.transformation.clone() },
            motion: Motion::WaitsForSpindle,
            corner: STOP,
            rests_after: true,
            entry: super::REST,
        });
    }

    /// A thread that is pushed behind `before`. The alarm: an axis cannot follow the spindle.
    pub(super) fn thread(
        &mut self,
        path: &JointPath,
        ends: Ends,
        before: Option<Before>,
    ) -> Result<ThreadPiece, Box<Diagnostic>> {
        let contour = &path.contour;
        let Some(thread) = contour.modes.thread.as_deref().copied() else { return Err(Box::new(no_thread(path))) };
        // A spindle that changes its speed breaks the thread: the next block begins anew.
        let same =
            |before: &Before| before.thread.speed_rad_s == thread.speed_rad_s && !contour.events.iter().any(turns);
        let before = before.filter(|before| thread.is_cut() && same(before));
        let rules = self.rules.of(&contour.modes);
        let length_lu = path.length_lu();
        let piece = ThreadPiece::new(thread, length_lu, &ends, &rules, before.as_ref())
            .map_err(|too_fast| Box::new(self.too_fast(path, thread.speed_rad_s, too_fast)))?;
        if let Some(blocked) = self.rules.blocked_axis(&rules, &ends.start) {
            return Err(Box::new(Diagnostic::error(
                "P0001",
                format!("the thread of line {}: {blocked}", contour.block.line),
            )));
        }
        super::check_time(length_lu / (thread.rise_mm * thread.speed_rad_s), path, || None)?;
        self.last_thread = (thread.is_cut() && !contour.stop_at_end).then_some(Before { thread, length_lu, ends });
        Ok(piece)
    }

    fn too_fast(&self, path: &JointPath, speed_rad_s: f64, found: TooFast) -> Diagnostic {
        let line = path.contour.block.line;
        let axis = found.limit.axis.map_or("an axis", |axis| self.rules.machine().axis(axis).name.as_str());
        let what = match found.limit.kind {
            LimitKind::Velocity => "velocity",
            LimitKind::Corner => "step of velocity from the thread before",
            _ => "acceleration",
        };
        let [speed_rpm, most_rpm] = [1.0, found.speed_share].map(|share| rpm_from_rad_s(share * speed_rad_s));
        let most_rpm = rounded_down(most_rpm);
        let message = format!(
            "the thread of line {line} at S{speed_rpm:.1} is too fast for axis {axis}: its {what} allows S{most_rpm:.1} at most (alarm 22270)"
        );
        Diagnostic::error("P0006", message).help(format!("give S{most_rpm:.1} or less, or a smaller lead"))
    }

    /// G96: the spindle over a piece with a constant cutting speed.
    pub(super) fn track_cutting(&mut self, path: &JointPath, law: &TimeLaw) -> Option<SpindleMotion> {
        let cutting = *path.contour.modes.cutting.as_deref()?;
        let curve = path.contour.curve()?;
        let target = |time_s: f64| cutting.speed_rad_s(curve.at(law.at(time_s).position_lu).position.0[cutting.axis]);
        let off_share = self.spindle.track(self.elapsed_s, law.duration_s(), self.setpoint_period_s, target);
        if off_share > OFF_SHARE_MAX
            && path.contour.feed != Feed::Rapid
            && !std::mem::replace(&mut self.late_told, true)
        {
            let block = path.contour.block;
            let message = format!(
                "the spindle cannot follow the cutting speed in line {}: its speed is off by {:.0} %, and F a revolution counts with the wanted one",
                block.line,
                percent_from_ratio(off_share)
            );
            let help = "limit the speed near the axis of rotation with LIMS, or lower the feed; reported once, for the first such block";
            self.findings.push((block, Diagnostic::warning("P0008", message).help(help)));
        }
        self.spindle.hand_out(self.elapsed_s)
    }

    /// The law of the thread at the front.
    pub(super) fn thread_law(
        &mut self,
        piece: &ThreadPiece,
        front: &Entry,
        spindle: &mut Option<SpindleMotion>,
    ) -> TimeLaw {
        let now_s = self.elapsed_s;
        let ready_s = self.spindle.settled_s().max(now_s);
        let state = self.spindle.at(ready_s);
        let acceleration_rad_s2 = self.spindle.following_acceleration_rad_s2();
        let turning = match piece.thread.simulated {
            true => Turning {
                now_s,
                ready_s,
                angle_rad: state.angle_rad,
                speed_rad_s: state.speed_rad_s,
                acceleration_rad_s2,
            },
            false => Turning { now_s, ready_s: now_s, angle_rad: 0.0, speed_rad_s: 0.0, acceleration_rad_s2: None },
        };
        // The front entry has left the window: the next one is its first.
        let goes_on = |next: &Entry| matches!(&next.motion, Motion::Threads(next) if next.goes_on);
        let leaves = front.rests_after || !self.entries.front().is_some_and(goes_on);
        let (law, synchronous) = piece.law(&turning, leaves);
        self.tell_short_runs(piece, front, leaves);
        if !synchronous {
            let block = front.path.contour.block;
            let most_rpm = rpm_from_rad_s(piece.room_share(leaves) * piece.thread.speed_rad_s);
            let message = format!(
                "the thread of line {} is too short: {:.3} mm are not enough to come to the speed of S{:.1} and to rest, and the axis never follows the spindle",
                block.line,
                piece.length_lu(),
                rpm_from_rad_s(piece.thread.speed_rad_s)
            );
            let help = format!("begin earlier, end later, or give S{:.1} or less", rounded_down(most_rpm));
            self.findings.push((block, Diagnostic::warning("P0007", message).help(help)));
        }
        if !piece.thread.is_cut() && piece.thread.simulated {
            let motion = spindle.get_or_insert_with(|| self.spindle.motion(now_s));
            motion.follows_rad_per_lu = Some(piece.turn_rad_per_lu());
            self.spindle.follow(now_s + law.duration_s(), piece.turn_rad());
        }
        law
    }

    /// DITS and DITE that the axes cannot keep.
    fn tell_short_runs(&mut self, piece: &ThreadPiece, front: &Entry, leaves: bool) {
        if !piece.thread.is_cut() {
            return;
        }
        for (run_lu, word) in piece.short_runs_lu(leaves).into_iter().zip(["DITS", "DITE"]) {
            let Some([programmed_lu, least_lu]) = run_lu else { continue };
            let block = front.path.contour.block;
            let message = format!(
                "{word} of the thread of line {} is {programmed_lu:.3} mm of path, and its axes need {least_lu:.3} mm (alarm 22280)",
                block.line
            );
            let help = "the run has what the axes need; the control would drive them beyond their acceleration. Give a longer one, a lower S, or -1 for what is needed";
            self.findings.push((block, Diagnostic::warning("P0009", message).help(help)));
        }
    }
}

/// The planner calls with threads only.
fn no_thread(path: &JointPath) -> Diagnostic {
    Diagnostic::error("P0001", format!("the thread of line {} has no lead", path.contour.block.line))
}

/// To a tenth, so that the speed is possible as it is shown; what is a tenth but for rounding stays.
fn rounded_down(speed_rpm: f64) -> f64 {
    (speed_rpm * 10.0 * (1.0 + ROUNDING_RATIO)).floor() / 10.0
}

/// Events that make another spindle motion.
pub(super) fn turns(event: &Event) -> bool {
    matches!(event, Event::MFunction(3 | 4 | 5 | 19 | 70) | Event::SpindlePosition(_))
}
