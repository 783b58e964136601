//! The interpolator: samples the time laws at k * t_s.
//!
//! In: [`PlannedPiece`]s in order, taken when they begin. Out: a [`Setpoint`] per cycle, and what began in that cycle ([`Begun`]).
//!
//! Time inside a piece is what the cycle before left over when the piece began, plus whole cycles counted from there: no block is
//! rounded to ticks and t_s is never summed up. Positions come from the curve, not from integration. Row 0 is the start posture;
//! the last row is the end posture at rest, on the first tick at or after the end of the last law.
//!
//! Where drives are simulated ([`Interpolator::waiting_in_position`]) a piece that the planner has marked (`waits_at_end`) ends when it is told so
//! ([`Interpolator::release`]): until then its last set-point stands, and the next piece begins on a tick.
//! Does not plan, does not know what events mean, nor where the axes are.

use super::overlay::Overlay;
use super::spindle_course::SpindleCourse;
use super::{AxisSetpoint, ExactStopWait, PathSample, Setpoint, SpindleSetpoint};
use crate::base::{AxisVector, PerAxis, TimeBase};
use crate::feed::{Limit, LimitKind, PathState, PlannedPiece, ProgrammedTime};
use crate::interpreter::{Event, ExactStop};
use crate::machine::{Machine, PathMode};
use crate::program::BlockRef;
use crate::smoothing::{Corner, PieceKind};

/// A path that ends this share of its time after a tick ends on that tick: times are sums of rounded durations.
const SAME_TIME_RATIO: f64 = 1e-9;

/// A law that ends this share of its piece before its end has stopped there.
const STOPPED_SHARE: f64 = 1e-6;

/// Pieces that may begin in one cycle before the list of them has to grow.
const BEGUN_USUAL: usize = 64;

/// Samples planned pieces once a cycle.
#[derive(Clone, Debug)]
pub struct Interpolator {
    time_base: TimeBase,
    active: Option<Active>,
    /// Taken to see whether the path goes on, but not begun yet.
    next: Option<PlannedPiece>,
    path_length_mm: f64,
    begun: Vec<Begun>,
    ended: bool,
    /// Axes on their own way.
    overlay: Overlay,
    spindle: SpindleCourse,
    programmed: ProgrammedTime,
    /// Block ends wait for the axes.
    waits: bool,
    hold: Option<Hold>,
    /// Time of all waits that are over.
    waited_s: f64,
}

/// A block end that waits, or has waited.
#[derive(Clone, Copy, Debug)]
struct Hold {
    /// The first set-point at the end.
    since_k: u64,
    /// From the end of the block to that set-point.
    carry_s: f64,
    /// The set-point at which the next piece begins, once it is known.
    released_k: Option<u64>,
}

/// A piece that began in the cycle that was sampled last.
#[derive(Clone, Debug, PartialEq)]
pub struct Begun {
    /// Block that it belongs to.
    pub block: BlockRef,
    /// Motion blocks that begin with it.
    pub blocks_begun: u32,
    /// It must end at rest.
    pub stop_at_end: bool,
    /// Path mode in force.
    pub path_mode: PathMode,
    /// What an exact stop waits for.
    pub exact_stop: ExactStop,
    /// What is output at its start.
    pub events: Vec<Event>,
    /// The corner, where the piece is a blend.
    pub corner: Option<Corner>,
    /// Path speed at its start.
    pub entry_feed_lu_s: f64,
    /// Programmed feed along the path (under FGROUP: at which the group has F); `None` for rapids and waits.
    pub programmed_feed_lu_s: Option<f64>,
    /// Time at the programmed feed, rapids at the velocities of the axes, waits as they are.
    pub programmed_time_s: f64,
    /// Path length; 0 for a wait.
    pub length_lu: f64,
    /// The `_lu` here are rad: no linear axis moves.
    pub rotary_only: bool,
    /// Time of its law.
    pub duration_s: f64,
    /// It began this long before the tick: at least 0, less than t_s (but for rounding); t_s after a wait for the axes.
    pub before_tick_s: f64,
    /// Path length of the linear axes where it begins.
    pub path_length_mm: f64,
}

#[derive(Clone, Debug)]
struct Active {
    piece: PlannedPiece,
    programmed_feed_lu_s: Option<f64>,
    length_lu: f64,
    rotary_only: bool,
    /// Tick number at or after its start, and how long after (a piece that takes no time: or a rounding error before it).
    entry_k: u64,
    carry_s: f64,
    /// At its start.
    path_length_mm: f64,
}

impl Interpolator {
    /// Before the first cycle.
    pub fn new(machine: &Machine) -> Self {
        Self {
            time_base: machine.cycle.time_base,
            active: None,
            next: None,
            path_length_mm: 0.0,
            begun: Vec::with_capacity(BEGUN_USUAL),
            ended: false,
            overlay: Overlay::new(machine),
            spindle: SpindleCourse::new(machine.cycle.time_base),
            programmed: ProgrammedTime::new(machine),
            waits: false,
            hold: None,
            waited_s: 0.0,
        }
    }

    /// Block ends wait for [`Interpolator::release`].
    pub fn waiting_in_position(self) -> Self {
        Self { waits: true, ..self }
    }

    /// What the set-point that was sampled last waits for, if it stands at a block end that waits.
    pub fn exact_stop_wait(&self) -> Option<ExactStopWait> {
        let (hold, active) = (self.hold.filter(|hold| hold.released_k.is_none())?, self.active.as_ref()?);
        let contour = &active.piece.path.contour;
        let positions = matches!(contour.kind, PieceKind::WaitPositioned { .. });
        Some(ExactStopWait {
            since: self.time_base.setpoint_tick(hold.since_k),
            window: if positions { ExactStop::Fine } else { contour.modes.exact_stop },
            elsewhere: self.overlay.under_way(),
        })
    }

    /// The axes are in position: the next piece begins at set-point `k`, the one that was sampled last.
    pub fn release(&mut self, k: u64) {
        if let Some(hold) = &mut self.hold {
            hold.released_k = Some(k);
            let cycles = k.saturating_sub(hold.since_k);
            self.waited_s += hold.carry_s + self.time_base.seconds(cycles * self.time_base.ticks_per_setpoint());
        }
    }

    /// Time that block ends have waited so far.
    pub fn waited_s(&self) -> f64 {
        self.waited_s
    }

    /// Set-point `k`; to be called with k = 0, 1, 2, ... `next` gives the next planned piece, `None` once the path has ended, and is
    /// called for every piece that begins at or before k * t_s. `None` after the set-point at the end of the path, or if there is no
    /// path at all.
    pub fn sample(&mut self, k: u64, next: &mut impl FnMut() -> Option<PlannedPiece>) -> Option<Setpoint> {
        let mut sampled = self.path_sample(k, next);
        if let Some(setpoint) = &mut sampled {
            self.overlay.add(k, &mut setpoint.axes);
        }
        sampled
    }

    /// The set-point of the path alone.
    fn path_sample(&mut self, k: u64, next: &mut impl FnMut() -> Option<PlannedPiece>) -> Option<Setpoint> {
        self.begun.clear();
        if self.ended {
            return None;
        }
        if self.active.is_none() {
            let piece = next()?;
            self.begin(piece, k, 0.0);
        }
        loop {
            let active = self.active.as_ref()?;
            let time_s =
                active.carry_s + self.time_base.seconds((k - active.entry_k) * self.time_base.ticks_per_setpoint());
            let left_s = active.piece.law.duration_s() - time_s;
            if left_s > self.tolerance_s(k) {
                return Some(self.setpoint(k, active, time_s));
            }
            match self.hold {
                Some(Hold { released_k: Some(from_k), .. }) => {
                    self.hold = None;
                    let Some(piece) = self.next.take().or_else(&mut *next) else {
                        self.ended = true;
                        return None;
                    };
                    self.begin(piece, from_k, 0.0);
                    continue;
                }
                Some(_) => return Some(self.standing(k, active)),
                None => {
                    if self.waits && active.piece.waits_at_end {
                        self.hold = Some(Hold { since_k: k, carry_s: -left_s, released_k: None });
                        let active = self.active.as_ref()?;
                        return Some(self.setpoint_of(k, active, active.at_end(), active.piece.law.duration_s()));
                    }
                }
            }
            // A next piece that begins up to the tolerance after the tick is only looked at, not begun; one that takes no time
            // (M30 at the end) does not ask for a cycle of its own.
            let following = self.next.take().or_else(&mut *next);
            match following {
                Some(piece) if left_s > 0.0 && !takes_no_time(&piece) => {
                    self.next = Some(piece);
                    let active = self.active.as_ref()?;
                    return Some(self.setpoint(k, active, time_s));
                }
                Some(piece) => self.begin(piece, k, -left_s),
                None => {
                    self.ended = true;
                    let active = self.active.as_ref()?;
                    return Some(self.setpoint_of(k, active, active.at_end(), active.piece.law.duration_s()));
                }
            }
        }
    }

    /// The end of the active piece, while the axes are waited for.
    fn standing(&self, k: u64, active: &Active) -> Setpoint {
        let limit = Limit { kind: LimitKind::InPosition, axis: None };
        let mut setpoint =
            self.setpoint_of(k, active, PathState { limit, ..active.at_end() }, active.piece.law.duration_s());
        setpoint.path.programmed_feed_lu_s = None;
        setpoint
    }

    /// What began in the cycle that was sampled last, in order. The caller may take the events out.
    pub fn begun(&mut self) -> &mut [Begun] {
        &mut self.begun
    }

    /// Exchanges the list of what began for `other`, so that it outlives the next sample without a copy.
    pub fn swap_begun(&mut self, other: &mut Vec<Begun>) {
        std::mem::swap(&mut self.begun, other);
    }

    /// The master spindle at a set-point behind the end of the path, where it goes on as it was told.
    pub fn spindle_behind_end(&self, k: u64) -> SpindleSetpoint {
        self.active.as_ref().map_or_else(SpindleSetpoint::default, |active| self.spindle.at(k, &active.at_end()))
    }

    /// True once the set-point at the end of the path has been given.
    pub fn ended(&self) -> bool {
        self.ended
    }

    /// How close to a tick an end counts as on it.
    fn tolerance_s(&self, k: u64) -> f64 {
        SAME_TIME_RATIO * self.time_base.time_s(self.time_base.setpoint_tick(k))
    }

    fn begin(&mut self, mut piece: PlannedPiece, k: u64, carry_s: f64) {
        if let Some(active) = &self.active
            && !active.rotary_only
        {
            self.path_length_mm += active.length_lu;
        }
        for motion in piece.positionings.drain(..) {
            self.overlay.set_out(motion, k, carry_s);
        }
        self.spindle.take(piece.spindle.take(), k, carry_s);
        let programmed_feed_lu_s = self.programmed.feed_lu_s(&piece.path);
        let programmed_time_s = self.programmed.time_s(&piece.path).unwrap_or(piece.law.duration_s());
        let contour = &mut piece.path.contour;
        let events = std::mem::take(&mut contour.events);
        let corner = match &contour.kind {
            PieceKind::Blend(_, corner) => Some(*corner),
            PieceKind::Block(_) | PieceKind::Wait { .. } | PieceKind::WaitPositioned { .. } => None,
        };
        let rotary_only = contour.curve().is_some_and(crate::geometry::Curve::rotary_only);
        let length_lu = contour.curve().map_or(0.0, crate::geometry::Curve::length_lu);
        self.begun.push(Begun {
            block: contour.block,
            blocks_begun: contour.blocks_begun,
            stop_at_end: contour.stop_at_end,
            path_mode: contour.modes.path_mode,
            exact_stop: contour.modes.exact_stop,
            events,
            corner,
            entry_feed_lu_s: piece.law.at(0.0).velocity_lu_s,
            programmed_feed_lu_s,
            programmed_time_s,
            length_lu,
            rotary_only,
            duration_s: piece.law.duration_s(),
            before_tick_s: carry_s.max(0.0),
            path_length_mm: self.path_length_mm,
        });
        let path_length_mm = self.path_length_mm;
        self.active =
            Some(Active { piece, programmed_feed_lu_s, length_lu, rotary_only, entry_k: k, carry_s, path_length_mm });
    }

    fn setpoint(&self, k: u64, active: &Active, time_s: f64) -> Setpoint {
        self.setpoint_of(k, active, active.piece.law.at(time_s), time_s)
    }

    fn setpoint_of(&self, k: u64, active: &Active, state: PathState, time_s: f64) -> Setpoint {
        let s_lu = state.position_lu.clamp(0.0, active.length_lu);
        // A law that ends at rest may end a rounding error below it.
        let v = state.velocity_lu_s.max(0.0);
        let (a, j) = (state.acceleration_lu_s2, state.jerk_lu_s3);
        let q = active.piece.path.at(s_lu);
        let velocity = q.first * v;
        let acceleration = q.second * (v * v) + q.first * a;
        let jerk = q.third * (v * v * v) + q.second * (3.0 * v * a) + q.first * j;
        let axes = PerAxis::from_fn(|axis| AxisSetpoint {
            position_lu: q.position.0[axis],
            velocity_lu_s: velocity[axis],
            acceleration_lu_s2: acceleration[axis],
            jerk_lu_s3: jerk[axis],
        });
        let contour = &active.piece.path.contour;
        let linear_mm = if active.rotary_only { 0.0 } else { s_lu };
        Setpoint {
            tick: self.time_base.setpoint_tick(k),
            axes,
            path: PathSample {
                block: contour.block,
                path_length_mm: active.path_length_mm + linear_mm,
                feed_lu_s: v,
                programmed_feed_lu_s: active.programmed_feed_lu_s,
                override_ratio: active.piece.override_ratio(time_s),
                acceleration_lu_s2: a,
                jerk_lu_s3: j,
                limit: state.limit,
                buffered_blocks: active.piece.buffered_blocks,
                rotary_only: active.rotary_only,
            },
            feedforward_active: contour.modes.feedforward_active,
            tool_length: contour.modes.tool.as_ref().map_or(AxisVector::zero(), |tool| tool.length),
            spindle: self.spindle.at(k, &PathState { position_lu: s_lu, velocity_lu_s: v, ..state }),
        }
    }
}

impl Active {
    /// The end of the path: exactly there, at rest.
    fn at_end(&self) -> PathState {
        let limit =
            self.piece.law.phases().last().map_or(Limit { kind: LimitKind::Feed, axis: None }, |last| last.limit);
        // A path that an alarm has stopped inside a block ends there.
        let reached_lu = self.piece.law.at(self.piece.law.duration_s()).position_lu;
        let stopped = reached_lu < (1.0 - STOPPED_SHARE) * self.length_lu && !self.piece.law.phases().is_empty();
        let position_lu = if stopped { reached_lu } else { self.length_lu };
        PathState { position_lu, velocity_lu_s: 0.0, acceleration_lu_s2: 0.0, jerk_lu_s3: 0.0, limit }
    }
}

/// A wait of 0 s: a function block.
fn takes_no_time(piece: &PlannedPiece) -> bool {
    piece.path.contour.curve().is_none() && piece.law.duration_s() == 0.0
}
