//! Block ends that wait for the axes, where drives are simulated.
//!
//! In: the front piece and what follows it, how long waits have lasted. Out: which pieces end with a wait; times that count the waits. The rule is the
//! control's: an exact stop (G60, G9 with G601 or G602), a block in front of one that rests the path (G4, M0, M6, STOPRE), a wait for axes on their own
//! way (POS, WAITP). The end of the program is not waited for under the continuous modes. Does not know where the axes are.

use super::{Motion, Planner};
use crate::feed::profile::standstill;
use crate::feed::{Limit, LimitKind};
use crate::interpreter::{Event, ExactStop};
use crate::kinematics::JointPath;
use crate::machine::PathMode;
use crate::smoothing::{ContourPiece, PieceKind};

/// What is known of the waits.
#[derive(Clone, Debug, Default)]
pub(super) struct Waits {
    /// Drives are simulated.
    listens: bool,
    /// The piece whose wait is not told yet.
    open: Option<JointPath>,
    /// Of all waits so far.
    told_s: f64,
}

impl Waits {
    /// A piece was handed out.
    pub(super) fn begin(&mut self, waits_at_end: bool, path: &JointPath) {
        self.open = waits_at_end.then(|| path.clone());
    }
}

impl Planner {
    /// With block ends that wait for the axes: [`Planner::tell_waited`] must follow each.
    pub fn waiting_in_position(self, waits: bool) -> Self {
        Self { waits: Waits { listens: waits, ..Waits::default() }, ..self }
    }

    /// True after a piece that ends with a wait, until [`Planner::tell_waited`].
    pub fn awaits(&self) -> bool {
        self.waits.open.is_some()
    }

    /// How long all block ends have waited by now.
    pub fn tell_waited(&mut self, waited_s: f64) {
        let Some(path) = self.waits.open.take() else { return };
        let wait_s = (waited_s - self.waits.told_s).max(0.0);
        self.waits.told_s = waited_s;
        if self.continuous.is_some() && wait_s > 0.0 {
            self.stand_by(&path, &standstill(wait_s, Limit { kind: LimitKind::InPosition, axis: None }));
        }
        self.elapsed_s += wait_s;
    }

    /// Whether the front piece ends with a wait; `None`: what follows it is not known yet, and decides.
    pub(super) fn waits_at_end(&self) -> Option<bool> {
        if self.waits.open.is_some() {
            return None;
        }
        let Some(front) = self.entries.front().filter(|_| self.waits.listens) else { return Some(false) };
        let contour = &front.path.contour;
        if let Motion::WaitsFor { .. } = front.motion {
            return Some(!ends(contour));
        }
        let moves = matches!(front.motion, Motion::Moves { .. } | Motion::Flows(_) | Motion::Threads(_));
        if !contour.stop_at_end || !moves || contour.modes.exact_stop == ExactStop::Setpoint {
            return Some(false);
        }
        if contour.modes.path_mode == PathMode::ExactStop {
            return Some(true);
        }
        match self.entries.get(1) {
            Some(next) => {
                let contour = &next.path.contour;
                // M0, M6, G4, STOPRE: for these the axes must be where they should be. The program may end before they are.
                Some(matches!(contour.kind, PieceKind::Wait { .. }) && !ends(contour))
            }
            None if self.finished => Some(false),
            None => None,
        }
    }
}

/// M2, M17, M30.
fn ends(contour: &ContourPiece) -> bool {
    contour.events.iter().any(|event| matches!(event, Event::MFunction(2 | 17 | 30)))
}
