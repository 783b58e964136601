//! One program on one machine: the set-points that come out, the path that they are on, and the programmed points.
//!
//! The path is the contour of the rooms before the planner (its shape, with the block numbers). Every set-point must lie on it, at the
//! path length that it says; that is how the harness knows which joints of the path lie between two set-points. Nothing
//! here knows how speeds were chosen.

use sollwert::base::PerAxis;
use sollwert::feed::OverrideSchedule;
use sollwert::geometry::Curve;
use sollwert::interpolator::Setpoint;
use sollwert::interpreter::{Feed, Interpreter, Modes, MoveKind};
use sollwert::kernel::{Kernel, Preparation, RunSummary, Status};
use sollwert::kinematics::{JointPath, Kinematics};
use sollwert::machine::{AccelerationMode, Machine, PathMode};
use sollwert::program::ProgramSource;
use sollwert::smoothing::{ContourPiece, PieceKind, Smoother};
use std::sync::Arc;

/// All axes; mm and rad.
pub type Posture = [f64; 5];

/// One set-point.
#[derive(Clone, Debug)]
pub struct Row {
    pub q: Posture,
    pub block: u64,
    pub line: u32,
    pub s_mm: f64,
    pub feed: f64,
    pub limit: String,
}

/// A programmed motion: where it ends and how it is to get there.
#[derive(Clone, Debug)]
pub struct Target {
    pub block: u64,
    pub line: u32,
    pub end: Posture,
    pub modes: Modes,
    pub feed: Option<f64>,
}

impl Target {
    /// Without a limit of jerk.
    pub fn brisk(&self) -> bool {
        self.modes.acceleration_mode != AccelerationMode::Soft
    }
}

/// A smooth stretch of the path.
#[derive(Clone, Debug)]
pub struct Stretch {
    pub block: u64,
    /// `None`: stands still at `at`.
    pub path: Option<JointPath>,
    pub at: Posture,
    pub start_mm: f64,
    pub length_lu: f64,
    pub rotary_only: bool,
    pub blend: bool,
}

/// What the path does between two stretches.
#[derive(Clone, Copy, Debug, Default)]
pub struct Joint {
    /// Step of the direction, per lu of path.
    pub turn: Posture,
    /// Step of the second derivative.
    pub bend: Posture,
    /// One of the two is a blend.
    pub blend: bool,
    /// The path rests here.
    pub rests: bool,
}

/// Directions that differ by less are one direction [Gassara 2013]: rounding of the points of arcs.
pub const TANGENT_RAD: f64 = 1e-3;

/// Everything that is judged.
#[derive(Clone)]
pub struct Run {
    pub rows: Vec<Row>,
    pub targets: Vec<Target>,
    pub stretches: Vec<Stretch>,
    /// Joint n is between stretch n and n + 1.
    pub joints: Vec<Joint>,
    /// `None`: not by the kernel.
    pub summary: Option<RunSummary>,
    pub t_s: f64,
}

pub fn posture(values: &PerAxis<f64>) -> Posture {
    std::array::from_fn(|i| values.as_slice()[i])
}

fn source(text: &str) -> ProgramSource {
    ProgramSource::from_bytes("proof.mpf", text.as_bytes())
}

impl Row {
    pub fn new(setpoint: &Setpoint) -> Self {
        let path = &setpoint.path;
        Self {
            q: posture(&setpoint.axes.map(|axis| axis.position_lu)),
            block: path.block.number,
            line: path.block.line,
            s_mm: path.path_length_mm,
            feed: path.feed_lu_s,
            limit: format!("{:?} {:?}", path.limit.kind, path.limit.axis.map(|axis| axis.index())),
        }
    }
}

impl Run {
    /// An alarm is an `Err` with its text.
    pub fn new(machine: &Arc<Machine>, text: &str) -> Result<Self, String> {
        Self::overridden(machine, text, &OverrideSchedule::none())
    }

    /// The same with changes of the feed override.
    pub fn overridden(machine: &Arc<Machine>, text: &str, overrides: &OverrideSchedule) -> Result<Self, String> {
        let preparation = Preparation::new(source(text), machine).with_overrides(overrides);
        let mut kernel = Kernel::with_source(machine.clone(), preparation, false);
        let mut rows = Vec::new();
        while kernel.cycle().map_err(|error| format!("{error:?}"))? == Status::Running {
            let Some(setpoint) = &kernel.output().setpoint else { return Err("a cycle without set-point".into()) };
            rows.push(Row::new(setpoint));
        }
        let findings = kernel.take_findings();
        if let Some(alarm) = findings.alarm {
            return Err(alarm.render(false));
        }
        let mut summary = RunSummary::new(machine, "proof.mpf", kernel.figures(), false);
        summary.add_warnings(&findings.warnings);
        let (targets, pieces) = prepared(machine, text)?;
        let kinematics = Kinematics::new(machine);
        let paths: Vec<JointPath> = pieces.into_iter().map(|piece| kinematics.to_joint(piece)).collect();
        let (stretches, joints) = path(&paths);
        let t_s = machine.cycle.time_base.setpoint_period_s();
        Ok(Self { rows, targets, stretches, joints, summary: Some(summary), t_s })
    }

    /// A warning with this code was given.
    pub fn warns(&self, code: &str) -> bool {
        self.summary.as_ref().is_some_and(|summary| summary.warnings.iter().any(|warning| warning.code == code))
    }

    /// N t_s.
    pub fn cycle_time_s(&self) -> f64 {
        (self.rows.len() - 1) as f64 * self.t_s
    }

    /// Length of the path and number of its stretches: equal for programs whose paths are the same curve.
    pub fn path_length_lu(&self) -> f64 {
        self.stretches.iter().map(|stretch| stretch.length_lu).sum()
    }

    /// Lengths of the blends: one that is cut short by a shorter block makes another path, also where the tip does not show it.
    pub fn blends_lu(&self) -> Vec<f64> {
        self.stretches.iter().filter(|stretch| stretch.blend).map(|stretch| stretch.length_lu).collect()
    }

    /// Programmed motions that a row, or the way between two, belongs to.
    pub fn targets_of(&self, from: &Row, to: &Row) -> &[Target] {
        let index = |block: u64| self.targets.partition_point(|target| target.block <= block).saturating_sub(1);
        self.targets.get(index(from.block)..=index(to.block)).unwrap_or(&[])
    }

    /// The jerk is not limited somewhere.
    pub fn brisk(&self) -> bool {
        self.targets.iter().any(Target::brisk)
    }

    /// Places where the path rests.
    pub fn rests(&self) -> usize {
        self.joints.iter().filter(|joint| joint.rests).count()
    }

    /// Steps of direction at corners that are left by a step of the velocity, together.
    pub fn turning(&self) -> f64 {
        self.turns(0..self.joints.len()).sum()
    }

    /// Steps of the curvature where the path goes on, together.
    pub fn bending(&self) -> f64 {
        let moving = self.joints.iter().filter(|joint| !joint.rests);
        moving.map(|joint| joint.bend.iter().map(|x| x * x).sum::<f64>().sqrt()).sum()
    }

    /// Steps of direction among some joints.
    pub fn turns(&self, joints: std::ops::Range<usize>) -> impl Iterator<Item = f64> {
        let joints = self.joints.get(joints.start..joints.end.min(self.joints.len())).unwrap_or(&[]);
        let moving = joints.iter().filter(|joint| !joint.rests);
        let turns = moving.map(|joint| joint.turn.iter().map(|x| x * x).sum::<f64>().sqrt());
        turns.filter(|turn| *turn > TANGENT_RAD)
    }

    /// The same stops and the same blends, in the same order.
    pub fn is_like(&self, other: &Self) -> bool {
        let (own, others) = (self.blends_lu(), other.blends_lu());
        let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-7 * a.max(*b);
        self.rests() == other.rests() && own.len() == others.len() && own.iter().zip(&others).all(near)
    }
}

/// Programmed motions, and the pieces of the contour.
pub fn prepared(machine: &Machine, text: &str) -> Result<(Vec<Target>, Vec<ContourPiece>), String> {
    let mut interpreter = Interpreter::new(source(text), machine);
    let mut smoother = Smoother::new(machine);
    let (mut targets, mut pieces): (Vec<Target>, Vec<ContourPiece>) = (Vec::new(), Vec::new());
    let mut at: Posture = [0.0; 5];
    while let Some(next) = interpreter.next_move().map_err(|alarm| alarm.render(false))? {
        let moves = matches!(
            next.kind,
            MoveKind::Rapid
                | MoveKind::Line
                | MoveKind::Arc(_)
                | MoveKind::SpatialArc(_)
                | MoveKind::Spline(_)
                | MoveKind::Polynomial(_)
        );
        let end = posture(&next.end.0);
        let stands = end == at
            && !matches!(
                next.kind,
                MoveKind::Arc(_) | MoveKind::SpatialArc(_) | MoveKind::Spline(_) | MoveKind::Polynomial(_)
            );
        at = end;
        // A block without displacement says nothing: its point is that of the block before, with the mode of that one.
        if moves && !stands {
            let feed = match next.feed {
                Feed::Path { feed_lu_s } => Some(feed_lu_s),
                _ => None,
            };
            let (block, line) = (next.block.number, next.block.line);
            targets.push(Target { block, line, end, modes: next.modes.clone(), feed });
        }
        smoother.push(next, &mut |piece| pieces.push(piece));
    }
    smoother.finish(&mut |piece| pieces.push(piece));
    Ok((targets, pieces))
}

/// Stretches, cut where a spline itself steps, and the joints between them.
pub fn path(paths: &[JointPath]) -> (Vec<Stretch>, Vec<Joint>) {
    let mut stretches: Vec<Stretch> = Vec::new();
    let mut rests_after: Vec<bool> = Vec::new();
    let mut s_mm = 0.0;
    for path in paths {
        let piece = &path.contour;
        let blend = matches!(piece.kind, PieceKind::Blend(..));
        let block = piece.block.number;
        let curves = match &piece.kind {
            PieceKind::Block(curve) | PieceKind::Blend(curve, _) => smooth_parts(curve),
            PieceKind::Wait { .. } | PieceKind::WaitPositioned { .. } => {
                let at = posture(&path.at(0.0).position.0);
                let wait = Stretch { block, path: None, at, start_mm: s_mm, length_lu: 0.0, rotary_only: false, blend };
                stretches.push(wait);
                rests_after.push(true);
                continue;
            }
        };
        let last = curves.len() - 1;
        // A corner inside a curve is a stop, but for G64.
        let stops = |pair: &[Curve]| piece.modes.path_mode != PathMode::G64 && turns(&pair[0], &pair[1]);
        let inner: Vec<bool> = curves.windows(2).map(stops).collect();
        for (n, curve) in curves.into_iter().enumerate() {
            let (length_lu, rotary_only) = (curve.length_lu(), curve.rotary_only());
            let contour = ContourPiece { kind: PieceKind::Block(curve), ..piece.clone() };
            let part = JointPath { contour, ..path.clone() };
            let at = posture(&part.at(0.0).position.0);
            stretches.push(Stretch { block, path: Some(part), at, start_mm: s_mm, length_lu, rotary_only, blend });
            rests_after.push(if n == last { piece.stop_at_end } else { inner[n] });
            if !rotary_only {
                s_mm += length_lu;
            }
        }
    }
    let joints = joints(&stretches, &rests_after);
    (stretches, joints)
}

fn smooth_parts(curve: &Curve) -> Vec<Curve> {
    let Curve::Polynomial(polynomial) = curve else { return vec![curve.clone()] };
    let mut borders = vec![0.0];
    borders.extend(polynomial.breaks_lu());
    borders.push(curve.length_lu());
    borders.windows(2).map(|ends| curve.trimmed(ends[0], ends[1])).collect()
}

/// The direction steps from one curve to the next by more than rounding.
fn turns(before: &Curve, after: &Curve) -> bool {
    (after.at(0.0).first - before.at(f64::INFINITY).first).norm() > TANGENT_RAD
}

/// Where nothing moves between two stretches that do (a block without displacement), the joint stands before the second one.
fn joints(stretches: &[Stretch], rests_after: &[bool]) -> Vec<Joint> {
    let mut joints = vec![Joint::default(); stretches.len()];
    let mut before: Option<usize> = None;
    let mut rests = true;
    for (n, stretch) in stretches.iter().enumerate() {
        if n > 0 {
            rests |= rests_after[n - 1];
            joints[n - 1].rests = rests;
        }
        let Some(path) = stretch.path.as_ref().filter(|_| stretch.length_lu > 0.0) else { continue };
        if let Some((index, last)) = before.and_then(|index| Some((index, stretches[index].path.as_ref()?)))
            && !rests
            && n > 0
        {
            let (end, start) = (last.at(f64::INFINITY), path.at(0.0));
            joints[n - 1] = Joint {
                turn: posture(&(start.first - end.first)),
                bend: posture(&(start.second - end.second)),
                blend: stretches[index].blend || stretch.blend,
                rests,
            };
        }
        before = Some(n);
        rests = false;
    }
    joints
}

/// Where on the path the rows stand: stretch and length from its start. A row that is not on the path where it says is an `Err`.
pub fn places(run: &Run) -> Result<Vec<(usize, f64)>, String> {
    let mut places: Vec<(usize, f64)> = Vec::with_capacity(run.rows.len());
    let mut from = 0;
    for (k, row) in run.rows.iter().enumerate() {
        let candidates = run.stretches[from..].iter().take_while(|stretch| stretch.block <= row.block);
        let mut nearest = f64::INFINITY;
        let mut found = None;
        for (n, stretch) in candidates.enumerate().filter(|(_, stretch)| stretch.block == row.block) {
            let (s_lu, off) = stretch.nearest(row);
            nearest = nearest.min(off);
            if off <= ON_PATH_LU {
                found = Some((from + n, s_lu));
                break;
            }
        }
        let Some(place) = found else {
            let Row { line, q, s_mm, .. } = row;
            return Err(format!("tick {k}, line {line}: {q:?} at s = {s_mm} mm is {nearest:e} off the path"));
        };
        from = place.0;
        places.push(place);
    }
    Ok(places)
}

/// Places from which the foot of a set-point is looked for.
const STARTS: usize = 4;

/// What a set-point may be off the path at its own path length: lengths are sums of thousands of pieces.
const ON_PATH_LU: f64 = 2e-8;

impl Stretch {
    /// Place of a row, and how far it is from there (infinite where its path length is another).
    fn nearest(&self, row: &Row) -> (f64, f64) {
        let Some(path) = &self.path else { return (0.0, distance(&self.at, &row.q)) };
        let s_lu = if self.rotary_only { self.foot(path, &row.q) } else { row.s_mm - self.start_mm };
        if s_lu < -BORDER_LU || s_lu > self.length_lu + BORDER_LU {
            return (s_lu, f64::INFINITY);
        }
        let s_lu = s_lu.clamp(0.0, self.length_lu);
        (s_lu, distance(&posture(&path.at(s_lu).position.0), &row.q))
    }

    /// Place whose tangent is square to the way to `q`, over the rotary axes: rows say nothing about their path length. They have unit
    /// speed, so that what is left along the tangent is what is left of the way. Where the axes turn back there are several such places.
    fn foot(&self, path: &JointPath, q: &Posture) -> f64 {
        let off = |s_lu: &f64| distance(&posture(&path.at(*s_lu).position.0), q);
        let feet = (0..=STARTS).map(|n| self.foot_from(path, q, self.length_lu * n as f64 / STARTS as f64));
        feet.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0.0)
    }

    fn foot_from(&self, path: &JointPath, q: &Posture, start_lu: f64) -> f64 {
        let Some(curve) = path.contour.curve() else { return 0.0 };
        let mut s_lu = start_lu;
        for _ in 0..50 {
            let state = curve.at(s_lu);
            let (position, first) = (posture(&state.position.0), posture(&state.first));
            // What does not count as path does not move, but for rounding; through a transformation it is elsewhere.
            let counts = |i: &usize| first[*i].abs() > 1e-9;
            let left: f64 = (0..5).filter(counts).map(|i| (q[i] - position[i]) * first[i]).sum();
            s_lu = (s_lu + left / first.iter().map(|x| x * x).sum::<f64>()).clamp(0.0, self.length_lu);
            if left.abs() < 1e-13 {
                break;
            }
        }
        s_lu
    }
}

/// A row so near to a joint may stand on either side of it.
pub const BORDER_LU: f64 = 1e-8;

pub fn distance(a: &Posture, b: &Posture) -> f64 {
    (0..5).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}
