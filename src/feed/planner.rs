//! The look-ahead: speeds at all junctions of a window, and the law of its first piece.
//!
//! In: [`JointPath`]s in order. Out: [`PlannedPiece`]s in order. The window holds the piece at hand and at most `look_ahead_blocks`
//! motion blocks beyond it, whatever was pushed; at its end the path must be able to rest. A backward pass finds for every junction
//! the highest speed from which that is possible; it runs from the newest piece towards the first and ends where a junction keeps its
//! speed, so that its cost is that of the braking distance and not of the window. More path can only raise these speeds: what was
//! fixed stays possible. (A ramp ends without acceleration, so that a *higher* speed at the end of a piece may ask for a *lower* one
//! at its start. Where the speed at the end can still rise, the speed at the start is therefore one from which any of them can be
//! met; it is exact where the speed at the end is settled.) A forward pass is one step: the piece at hand begins with the speed that the one before was left with.
//! A thread has a law of its own, which the spindle gives it: the path rests before and after it.
//! Where drives are simulated, block ends wait for the axes: nothing beyond such an end is planned before its wait is told
//! ([`Planner::tell_waited`]), so that all times here are those of the run. Does not sample, and does not know axes: `limits` and `junction` do.

use super::continuous::{Continuous, Flowing};
use super::crept::Crept;
use super::feed_override::{OverrideCourse, OverrideSchedule};
use super::junction::{self, FREE, STOP};
use super::limits::{AxisRules, Ends, PieceLimits};
use super::modes::ModeRules;
use super::positioning::Arrivals;
use super::profile::{Bounds, SpeedCap, Stretch, seven_phases, standstill};
use super::published::{self, Tally};
use super::spindle::Spindle;
use super::split::{self, Part};
use super::synchronised::SynchronisedActions;
use super::thread::{Before, ThreadPiece};
use super::{Limit, LimitKind, PlannedPiece, TimeLaw, varying};
use crate::base::{Diagnostic, PerAxis};
use crate::geometry::Curve;
use crate::interpreter::{Event, Feed};
use crate::kinematics::JointPath;
use crate::machine::{BlendLaw, Machine, TimeLawKind};
use crate::program::BlockRef;
use crate::smoothing::PieceKind;
use std::collections::VecDeque;
use std::sync::Arc;

mod checks;
mod flowing;
mod ramping_feed;
mod with_spindle;
mod waits;

use checks::{Axes, check_flow, check_motion, check_time};
pub(super) use ramping_feed::Ramp;
use waits::Waits;

/// Plans speeds over a window of the path.
#[derive(Clone, Debug)]
pub struct Planner {
    rules: ModeRules,
    /// t_s.
    setpoint_period_s: f64,
    look_ahead_blocks: u32,
    /// The window, then pieces that wait to enter it.
    entries: VecDeque<Entry>,
    /// Entries in the window.
    admitted: usize,
    /// Motion blocks in the window beyond its first piece.
    blocks_beyond: u32,
    /// Places in the window, after the start of its first piece, where the path rests.
    rests: usize,
    /// The next pieces would make the window hold too many blocks.
    full: bool,
    finished: bool,
    /// Entries from here on have changed since the backward pass.
    changed_from: usize,
    /// Speed at the start of the first piece.
    entry: SpeedCap,
    /// Ends of the last piece pushed that moves, unless the path rests after it.
    last: Option<(Ends, Arc<AxisRules>)>,
    /// Time from the start of the program to the start of the first piece: the sum of all durations before.
    elapsed_s: f64,
    /// Of it, time of motions with feed.
    cutting_s: f64,
    /// Axes that move on their own.
    arrivals: Arrivals,
    spindle: Spindle,
    /// The thread that was pushed last, if the path does not rest after it.
    last_thread: Option<Before>,
    /// The ramp of the spindle that pieces with F a revolution are still to follow.
    ramp: Option<Ramp>,
    /// The path rests where the first piece begins.
    rests_now: bool,
    /// What a person should know, with its block.
    findings: Vec<(BlockRef, Diagnostic)>,
    /// A spindle that cannot follow a constant cutting speed has been told of.
    late_told: bool,
    waits: Waits,
    /// What the printed blend law did.
    published: Tally,
    /// Blends that take longer than a stop.
    crept: Crept,
    /// Where it came to a stand first, and whether that has been told.
    stalled: Option<(BlockRef, bool)>,
    /// Half of the blend that was admitted last, if nothing moved since: part of the next block.
    half_blend_lu: f64,
    /// The law `continuous`; `None` under `seven-phase`.
    continuous: Option<Box<Continuous>>,
    /// The feed override at run time, and what acts on it.
    overrides: OverrideCourse,
    actions: SynchronisedActions,
    /// Where the override holds the path for ever, and whether that has been told.
    held: Option<(BlockRef, bool)>,
}

/// A piece in the window or before it.
#[derive(Clone, Debug)]
struct Entry {
    path: JointPath,
    motion: Motion,
    /// What the junction at its start allows.
    corner: SpeedCap,
    /// The path rests at its end, whatever follows.
    rests_after: bool,
    /// Backward pass: highest speed at its start.
    entry: Planned,
}

/// Result of the backward pass at a junction.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Planned {
    /// Highest speed.
    cap: SpeedCap,
    /// More path cannot raise it.
    settled: bool,
}

/// The path rests for good.
const REST: Planned = Planned { cap: STOP, settled: true };

/// How a piece moves.
#[derive(Clone, Debug)]
enum Motion {
    /// Along a curve.
    Moves {
        limits: PieceLimits,
        length_lu: f64,
        /// The block's own share of the path, halves of its blends included, which must take one cycle at least; `None`: a blend.
        block_length_lu: Option<f64>,
    },
    /// Along a curve, under the law `continuous`.
    Flows(Flowing),
    /// Stands still for a time.
    Waits { time_s: f64 },
    /// Stands still until these axes have arrived.
    WaitsFor { axes: PerAxis<bool> },
    /// Follows the spindle, or leads it.
    Threads(Box<ThreadPiece>),
    /// Stands still until the spindle is near its speed or at its position.
    WaitsForSpindle,
    /// Takes neither way nor time: speed passes through it.
    Nothing,
}

impl Planner {
    /// An empty window on a path that begins at rest.
    pub fn new(machine: &Machine) -> Self {
        Self {
            rules: ModeRules::new(machine),
            setpoint_period_s: machine.cycle.time_base.setpoint_period_s(),
            look_ahead_blocks: u32::try_from(machine.look_ahead_blocks).unwrap_or(u32::MAX),
            entries: VecDeque::new(),
            admitted: 0,
            blocks_beyond: 0,
            rests: 0,
            full: false,
            finished: false,
            changed_from: 0,
            entry: STOP,
            last: None,
            elapsed_s: 0.0,
            cutting_s: 0.0,
            arrivals: Arrivals::new(),
            spindle: Spindle::new(machine.spindle),
            last_thread: None,
            ramp: None,
            rests_now: true,
            findings: Vec::new(),
            late_told: false,
            waits: Waits::default(),
            published: Tally::default(),
            crept: Crept::default(),
            stalled: None,
            half_blend_lu: 0.0,
            continuous: (machine.feed.time_law == TimeLawKind::Continuous).then(Box::default),
            overrides: OverrideCourse::new(&OverrideSchedule::none(), machine.cycle.time_base),
            actions: SynchronisedActions::default(),
            held: None,
        }
    }

    /// With changes of the feed override at run time, which only `continuous` follows.
    pub fn with_overrides(self, schedule: &OverrideSchedule) -> Self {
        let time_base = self.rules.machine().cycle.time_base;
        Self { overrides: OverrideCourse::new(schedule, time_base), ..self }
    }

    /// Time of everything that has been handed out, and of the motions with feed among it.
    pub fn elapsed_s(&self) -> (f64, f64) {
        (self.elapsed_s, self.cutting_s)
    }

    /// The alarm of the piece handed out last, with its block: the path comes to rest at the end of what was pushed, after
    /// [`Planner::finish`].
    pub fn take_alarm(&mut self) -> Option<(BlockRef, Diagnostic)> {
        if let Some((block, told @ false)) = &mut self.held {
            *told = true;
            return Some((*block, checks::held(*block)));
        }
        let (block, told) = self.stalled.as_mut()?;
        (!std::mem::replace(told, true)).then(|| (*block, published::stalled(*block)))
    }

    /// What a person should know about the laws handed out so far, with the block where it began; each once.
    pub fn take_warning(&mut self) -> Option<(BlockRef, Diagnostic)> {
        if !self.findings.is_empty() {
            return Some(self.findings.remove(0));
        }
        std::mem::take(&mut self.published).warning().or_else(|| std::mem::take(&mut self.crept).warning())
    }

    /// The next piece of the path. An alarm if its motion has no speed that every axis allows: the piece is then not taken (of a
    /// spline or a changing feed, the parts before), and no other may follow. What was pushed before comes to rest at its end after
    /// [`Planner::finish`].
    pub fn push(&mut self, path: JointPath) -> Result<(), Box<Diagnostic>> {
        if !matches!(path.contour.feed, Feed::Varying { .. }) {
            return self.push_constant(path);
        }
        let stretches = varying::stretches(path, self.setpoint_period_s);
        stretches.into_iter().try_for_each(|stretch| self.push_constant(stretch))
    }

    /// A piece whose F is the same all along, unless it follows the ramp of the spindle.
    fn push_constant(&mut self, mut path: JointPath) -> Result<(), Box<Diagnostic>> {
        self.wait_for_spindle(&mut path);
        self.ramp_stretches(path).into_iter().try_for_each(|stretch| self.push_stretch(stretch))
    }

    fn push_stretch(&mut self, path: JointPath) -> Result<(), Box<Diagnostic>> {
        let polynomial = matches!(path.contour.curve(), Some(Curve::Polynomial(_) | Curve::Quintic(_)));
        let scanned = polynomial || !path.is_contour();
        // A length that is no number is refused as it is.
        if !scanned || !path.length_lu().is_finite() {
            return self.push_part(Part { path, worst: None });
        }
        if self.continuous.is_some() {
            return split::smooth_parts(path).into_iter().try_for_each(|part| self.push_part(part));
        }
        let rules = self.rules.of(&path.contour.modes);
        split::parts(&rules, path).into_iter().try_for_each(|part| self.push_part(part))
    }

    fn push_part(&mut self, part: Part) -> Result<(), Box<Diagnostic>> {
        let Part { path, worst } = part;
        let contour = &path.contour;
        let mut rests_after = contour.stop_at_end;
        let mut corner = FREE;
        let last_thread = self.last_thread.take();
        let motion = match &contour.kind {
            PieceKind::Block(curve) if contour.modes.thread.is_some() && curve.length_lu() != 0.0 => {
                let ends = Ends { start: path.at(0.0), end: path.at(f64::INFINITY), blend: false, rotary_only: false };
                let piece = self.thread(&path, ends, last_thread)?;
                corner = if piece.goes_on { FREE } else { STOP };
                Motion::Threads(Box::new(piece))
            }
            // A length that is no number is not 0 either.
            PieceKind::Block(curve) | PieceKind::Blend(curve, _) if curve.length_lu() != 0.0 => {
                let length_lu = curve.length_lu();
                let blend = matches!(contour.kind, PieceKind::Blend(..));
                let flows = self.continuous.is_some();
                let (start, end) = (path.at(0.0), path.at(length_lu));
                // Under `continuous` a step of curvature is one, wherever it is.
                let ends = Ends { start, end, blend: blend && !flows, rotary_only: curve.rotary_only() };
                let rules = self.rules.of(&contour.modes);
                corner = self
                    .last
                    .as_ref()
                    .map_or(STOP, |(before, before_rules)| junction::cap([before_rules, &rules], before, &ends));
                if flows {
                    let flow = Flowing::new(rules.clone(), &path, blend, [&ends.start, &ends.end]);
                    check_flow(&flow, length_lu, &path, &Axes { modes: &self.rules, rules: &rules, ends: &ends })?;
                    self.last = Some((ends, rules));
                    Motion::Flows(flow)
                } else {
                    let limits = rules.piece(contour, curve, &ends, worst.as_ref());
                    check_motion(&limits, length_lu, &path, &Axes { modes: &self.rules, rules: &rules, ends: &ends })?;
                    self.last = Some((ends, rules));
                    let block_length_lu = (!blend).then_some(contour.block_length_lu.unwrap_or(length_lu));
                    Motion::Moves { limits, length_lu, block_length_lu }
                }
            }
            PieceKind::Wait { time_s, .. } if *time_s > 0.0 => {
                check_time(*time_s, &path, || None)?;
                (corner, rests_after) = (STOP, true);
                Motion::Waits { time_s: *time_s }
            }
            PieceKind::Wait { .. } if contour.events.contains(&Event::SpindleWait) => {
                (corner, rests_after) = (STOP, true);
                Motion::WaitsForSpindle
            }
            PieceKind::WaitPositioned { axes, .. } => {
                (corner, rests_after) = (STOP, true);
                Motion::WaitsFor { axes: *axes }
            }
            _ => Motion::Nothing,
        };
        if rests_after {
            self.last = None;
        }
        self.entries.push_back(Entry { path, motion, corner, rests_after, entry: REST });
        Ok(())
    }

    /// No more pieces: the path ends at rest.
    pub fn finish(&mut self) {
        self.finished = true;
        // The end of the window may turn from a place where one must be able to stop into one where the path ends.
        self.changed_from = self.changed_from.min(self.admitted.saturating_sub(1));
    }

    /// The next piece, fixed for good: as soon as the window beyond it is full, or a rest inside the window is known, or the path is
    /// finished.
    pub fn pop(&mut self) -> Option<PlannedPiece> {
        self.admit();
        if self.admitted == 0 || self.held.is_some() || !(self.full || self.finished || self.rests > 0) {
            return None;
        }
        self.follow_ramp();
        let waits_at_end = self.waits_at_end()?;
        self.actions.begin(&self.entries.front()?.path, self.elapsed_s);
        let flowing = self.flow();
        if self.continuous.is_none() {
            self.plan_backward();
        }
        let ahead = if self.admitted > 1 { self.entries[1].entry.cap } else { self.end_of_window().cap };
        let front = self.entries.pop_front()?;
        let machine = self.rules.machine();
        let events = &front.path.contour.events;
        let positionings =
            if events.is_empty() { Vec::new() } else { self.arrivals.set_out(machine, events, self.elapsed_s) };
        self.spindle.begin(events, self.elapsed_s);
        let mut spindle = self.spindle.hand_out(self.elapsed_s);
        let (law, exit) = match &front.motion {
            Motion::WaitsFor { axes } => {
                let (time_s, limit) = self.arrivals.wait(machine, axes, self.elapsed_s);
                (if time_s > 0.0 { standstill(time_s, limit) } else { TimeLaw::new([]) }, STOP)
            }
            Motion::WaitsForSpindle => {
                let time_s = self.spindle.ready_s() - self.elapsed_s;
                let limit = Limit { kind: LimitKind::Spindle, axis: None };
                (if time_s > 0.0 { standstill(time_s, limit) } else { TimeLaw::new([]) }, STOP)
            }
            Motion::Flows(_) => (flowing.unwrap_or_default(), STOP),
            Motion::Threads(piece) => (self.thread_law(piece, &front, &mut spindle), STOP),
            _ => match self.printed_law(&front, ahead) {
                Some(printed) => printed,
                None => front.fixed(self.entry, ahead, self.setpoint_period_s),
            },
        };
        if let Some(tracked) = self.track_cutting(&front.path, &law) {
            spindle = Some(tracked);
        }
        if self.continuous.is_some() && !matches!(front.motion, Motion::Flows(_)) {
            self.stand_by(&front.path, &law);
        }
        self.count(&front, &law);
        self.actions.pass(&front.path);
        let start_s = self.elapsed_s;
        self.elapsed_s += law.duration_s();
        let overrides = self.overrides.steps(start_s, self.elapsed_s);
        self.waits.begin(waits_at_end, &front.path);
        let piece = PlannedPiece {
            junction: junction::holding(front.corner, &law),
            path: front.path,
            law,
            buffered_blocks: self.blocks_beyond,
            positionings,
            overrides,
            spindle,
            waits_at_end,
        };
        self.entry = exit;
        self.admitted -= 1;
        self.changed_from = self.changed_from.saturating_sub(1);
        self.full = false;
        self.rests -= usize::from(front.rests_after);
        self.rests_now = front.rests_after || (self.rests_now && matches!(front.motion, Motion::Nothing));
        if self.admitted > 0 {
            let next = &self.entries[0];
            self.blocks_beyond -= next.blocks();
            self.rests -= usize::from(next.rests_before());
        }
        Some(piece)
    }

    /// The printed law of a blend, where the machine asks for it and it leaves with a speed that the path ahead allows.
    fn printed_law(&mut self, front: &Entry, ahead: SpeedCap) -> Option<(TimeLaw, SpeedCap)> {
        let contour = &front.path.contour;
        let (PieceKind::Blend(Curve::Blend(blend), _), true) = (&contour.kind, front.path.is_contour()) else {
            return None;
        };
        let rules = self.rules.of(&contour.modes);
        if rules.blend_law != BlendLaw::Published || !rules.jerk_limited || self.stalled.is_some() {
            return None;
        }
        let curve = contour.curve()?;
        let ahead = if front.rests_after { STOP } else { ahead };
        match published::crossing(&rules, blend, rules.feed_cap(&contour.feed, curve), self.entry.velocity_lu_s) {
            Ok(crossing) if crossing.exit_lu_s <= ahead.velocity_lu_s * published::RULE_RATIO => {
                self.published.crossed(contour.block, &crossing);
                let exit = SpeedCap { velocity_lu_s: crossing.exit_lu_s, limit: crossing.limit };
                Some((crossing.law, exit.min(ahead)))
            }
            Ok(_) => {
                self.published.guarded(contour.block);
                None
            }
            Err(published::Stalled) => {
                self.stalled = Some((contour.block, false));
                None
            }
        }
    }

    /// Lets pieces into the window, as many as it may hold: a blend only together with the block after it.
    fn admit(&mut self) {
        while !self.full && self.admitted < self.entries.len() {
            let waiting = self.entries.range(self.admitted..);
            let ends_group = |entry: &Entry| entry.blocks() > 0 || entry.rests_after;
            let group = match waiting.clone().position(ends_group) {
                Some(last) => last + 1,
                None if self.finished => waiting.len(),
                None => return,
            };
            let blocks: u32 = waiting.take(group).map(Entry::blocks).sum();
            // Where several blocks begin at one place the window may hold more than its number, rather than none.
            let first = self.blocks_beyond == 0 && self.look_ahead_blocks > 0;
            self.full = self.admitted > 0 && !first && self.blocks_beyond + blocks > self.look_ahead_blocks;
            if !self.full {
                for _ in 0..group {
                    self.admit_one();
                }
            }
        }
        self.full |= self.admitted > 0 && self.blocks_beyond >= self.look_ahead_blocks;
    }

    fn admit_one(&mut self) {
        let index = self.admitted;
        let half_before_lu = self.half_blend_lu;
        // The piece before ended the window until now, and the speed at its start was not settled.
        self.changed_from = self.changed_from.min(index.saturating_sub(2));
        let entry = &mut self.entries[index];
        self.rests += usize::from(entry.rests_after);
        if index > 0 {
            self.blocks_beyond += entry.blocks();
            self.rests += usize::from(entry.rests_before());
        }
        self.admitted += 1;
        match &mut entry.motion {
            Motion::Moves { block_length_lu: Some(block_length_lu), .. } => {
                *block_length_lu += half_before_lu;
                self.half_blend_lu = 0.0;
            }
            Motion::Moves { length_lu, .. } => {
                self.half_blend_lu = *length_lu / 2.0;
                let half_lu = self.half_blend_lu;
                if let Some(before) = index.checked_sub(1)
                    && let Motion::Moves { block_length_lu: Some(lu), .. } = &mut self.entries[before].motion
                {
                    *lu += half_lu;
                    self.changed_from = self.changed_from.min(before);
                }
            }
            Motion::Waits { .. } | Motion::WaitsFor { .. } | Motion::WaitsForSpindle | Motion::Threads(_) => {
                self.half_blend_lu = 0.0;
            }
            Motion::Flows(_) | Motion::Nothing => {}
        }
    }

    /// The window ends where the path does.
    fn window_ends_path(&self) -> bool {
        self.finished && self.admitted == self.entries.len()
    }

    /// Speed at the end of the window.
    fn end_of_window(&self) -> Planned {
        let last = self.admitted.checked_sub(1).map(|last| &self.entries[last]);
        if self.window_ends_path() || last.is_none_or(|last| last.rests_after) {
            return REST;
        }
        let limit = Limit { kind: LimitKind::LookAhead, axis: None };
        Planned { cap: SpeedCap { velocity_lu_s: 0.0, limit }, settled: false }
    }

    /// Highest speeds at the starts of all pieces but the first, from the end of the window.
    fn plan_backward(&mut self) {
        let mut exit = self.end_of_window();
        for index in (1..self.admitted).rev() {
            let entry = self.highest_entry(index, exit);
            let kept = entry == self.entries[index].entry;
            self.entries[index].entry = entry;
            if kept && index <= self.changed_from {
                break;
            }
            exit = entry;
        }
        self.changed_from = self.admitted;
    }

    /// Highest speed at the start of a piece if it is `exit` at its end.
    fn highest_entry(&self, index: usize, exit: Planned) -> Planned {
        let (before, piece) = (&self.entries[index - 1], &self.entries[index]);
        if before.rests_after || piece.rests_before() {
            return REST;
        }
        let t_s = self.setpoint_period_s;
        let junction = piece.corner.min(piece.motion.cap(t_s)).min(before.motion.exit_cap(t_s));
        let inside = piece.motion.highest_entry(if piece.rests_after { REST } else { exit });
        if inside.cap.velocity_lu_s < junction.velocity_lu_s {
            return inside;
        }
        // The last block of the window may still get the half of its blend, unless the path rests there.
        let last = index + 1 == self.admitted && !piece.rests_after && !self.window_ends_path();
        Planned { cap: junction, settled: !last }
    }
}

impl Entry {
    fn blocks(&self) -> u32 {
        self.path.contour.blocks_begun
    }

    fn rests_before(&self) -> bool {
        self.corner.velocity_lu_s == 0.0
    }

    /// The law of this piece from the speed that it begins with to the highest one that it reaches and that is allowed `ahead`.
    fn fixed(&self, entry: SpeedCap, ahead: SpeedCap, setpoint_period_s: f64) -> (TimeLaw, SpeedCap) {
        let ahead = if self.rests_after { STOP } else { ahead };
        match &self.motion {
            Motion::Moves { limits, length_lu, .. } => {
                let own = self.motion.cap(setpoint_period_s);
                let reached = limits.reach(entry, *length_lu).min(own);
                let exit = ahead.min(reached);
                let bounds = Bounds { cruise: own.min(limits.ramp_cap), ..limits.bounds };
                (seven_phases(&Stretch { length_lu: *length_lu, entry, exit }, &bounds), exit)
            }
            Motion::Waits { time_s } => (standstill(*time_s, Limit { kind: LimitKind::Dwell, axis: None }), STOP),
            // A wait for axes gets its time where it is handed out.
            Motion::WaitsFor { .. } | Motion::WaitsForSpindle | Motion::Threads(_) | Motion::Flows(_) => {
                (TimeLaw::new([]), STOP)
            }
            Motion::Nothing => (TimeLaw::new([]), ahead.min(entry)),
        }
    }
}

impl Motion {
    /// Highest speed anywhere on the piece, alone.
    fn cap(&self, setpoint_period_s: f64) -> SpeedCap {
        match self {
            Self::Moves { limits, block_length_lu: Some(block_length_lu), .. } => limits.cap.min(SpeedCap {
                velocity_lu_s: block_length_lu / setpoint_period_s,
                limit: Limit { kind: LimitKind::Cycle, axis: None },
            }),
            Self::Moves { limits, .. } => limits.cap,
            Self::Waits { .. } | Self::WaitsFor { .. } | Self::WaitsForSpindle => STOP,
            Self::Flows(_) | Self::Threads(_) | Self::Nothing => FREE,
        }
    }

    /// Highest speed at its end.
    fn exit_cap(&self, setpoint_period_s: f64) -> SpeedCap {
        match self {
            Self::Moves { limits, block_length_lu: None, .. } => limits.exit_cap,
            _ => self.cap(setpoint_period_s),
        }
    }

    /// Highest speed at the start from which the piece can be left with `exit`.
    fn highest_entry(&self, exit: Planned) -> Planned {
        match self {
            Self::Moves { limits, length_lu, .. } => {
                let cap =
                    if exit.settled { limits.reach(exit.cap, *length_lu) } else { limits.brake(exit.cap, *length_lu) };
                // Where the path rests for good it is the braking that holds; any other junction passes on its own reason.
                let limit = if exit == REST { cap.limit } else { exit.cap.limit };
                Planned { cap: SpeedCap { limit, ..cap }, settled: exit.settled }
            }
            Self::Waits { .. } | Self::WaitsFor { .. } | Self::WaitsForSpindle | Self::Threads(_) => REST,
            Self::Flows(_) | Self::Nothing => exit,
        }
    }
}

/// Pieces that one plan of the law `continuous` looks at, at most.
const PLANNED_PIECES_MAX: usize = 4096;
