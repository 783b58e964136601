//! Threads in the window: what is refused, and the law of the front piece.
//!
//! In: a piece with a thread, the spindle. Out: a [`ThreadPiece`] or an alarm; its [`TimeLaw`], and the motion of the spindle that it leads. Does not
//! calculate laws: `thread` does.

use super::{Entry, Motion, Planner};
use crate::base::Diagnostic;
use crate::base::units::rpm_from_rad_s;
use crate::feed::limits::Ends;
use crate::feed::thread::{Before, ThreadPiece, TooFast, Turning};
use crate::feed::{LimitKind, SpindleMotion, TimeLaw};
use crate::kinematics::JointPath;

impl Planner {
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
        super::check_time(length_lu / (thread.rise_mm * thread.speed_rad_s), path)?;
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
        // Rounded down, so that it is possible as it is shown.
        let most_rpm = (most_rpm * 10.0).floor() / 10.0;
        let message = format!(
            "the thread of line {line} at S{speed_rpm:.1} is too fast for axis {axis}: its {what} allows S{most_rpm:.1} at most (alarm 22270)"
        );
        Diagnostic::error("P0006", message).help(format!("give S{most_rpm:.1} or less, or a smaller lead"))
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
        let turning =
            Turning { now_s, ready_s, angle_rad: state.angle_rad, speed_rad_s: state.speed_rad_s, acceleration_rad_s2 };
        // The front entry has left the window: the next one is its first.
        let goes_on = |next: &Entry| matches!(&next.motion, Motion::Threads(next) if next.goes_on);
        let leaves = front.rests_after || !self.entries.front().is_some_and(goes_on);
        let (law, synchronous) = piece.law(&turning, leaves);
        if !synchronous {
            let block = front.path.contour.block;
            let most_rpm = rpm_from_rad_s(piece.room_share(leaves) * piece.thread.speed_rad_s);
            let message = format!(
                "the thread of line {} is too short: {:.3} mm are not enough to come to the speed of S{:.1} and to rest, and the axis never follows the spindle",
                block.line,
                piece.length_lu(),
                rpm_from_rad_s(piece.thread.speed_rad_s)
            );
            let help = format!("begin earlier, end later, or give S{:.1} or less", (most_rpm * 10.0).floor() / 10.0);
            self.short_threads.push((block, Diagnostic::warning("P0007", message).help(help)));
        }
        if !piece.thread.is_cut() {
            let motion = spindle.get_or_insert_with(|| self.spindle.motion(now_s));
            motion.follows_rad_per_lu = Some(piece.turn_rad_per_lu());
            self.spindle.follow(now_s + law.duration_s(), piece.turn_rad());
        }
        law
    }
}

/// The planner calls with threads only.
fn no_thread(path: &JointPath) -> Diagnostic {
    Diagnostic::error("P0001", format!("the thread of line {} has no lead", path.contour.block.line))
}

/// Events that make another spindle motion.
fn turns(event: &crate::interpreter::Event) -> bool {
    use crate::interpreter::Event;
    matches!(event, Event::MFunction(3 | 4 | 5 | 19) | Event::SpindlePosition(_))
}
