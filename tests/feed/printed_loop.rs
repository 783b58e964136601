//! `blend_law = "published"`: the printed loop of models/local-smoothing.md section 4, worked out a second time on the cubic itself
//! [Essid 2019], and `limits = "path"` beside the limits of the axes.

use crate::support::{Program, Random, spinner, test_machine_shipped};
use sollwert::feed::{LimitKind, PlannedPiece};
use sollwert::geometry::{Curve, HermiteBlend};
use sollwert::kernel::{Kernel, Status};
use sollwert::machine::{AxisLimits, BlendLaw, BlendLimits, Machine, PathMode};
use sollwert::program::ProgramSource;
use sollwert::smoothing::PieceKind;
use std::sync::Arc;

type V = [f64; 2];

fn add(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1]]
}

fn scale(a: V, f: f64) -> V {
    [a[0] * f, a[1] * f]
}

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// The cubic of section 1: S' = 3 A u² + 2 B u + C.
struct Cubic {
    a: V,
    b: V,
    c: V,
}

/// Section 2 at one u.
struct Frame {
    sigma: [f64; 3],
    tangent: V,
    normal: V,
    k: f64,
    k_slope: f64,
}

impl Cubic {
    fn new(incoming: V, outgoing: V, t: f64, alpha: f64) -> Self {
        let sum = add(incoming, outgoing);
        let b = add(scale(incoming, 3.0 - 2.0 * alpha), scale(outgoing, 3.0 - alpha));
        Self { a: scale(sum, (alpha - 2.0) * t), b: scale(b, t), c: scale(incoming, alpha * t) }
    }

    fn frame(&self, u: f64) -> Frame {
        let d1 = add(add(scale(self.a, 3.0 * u * u), scale(self.b, 2.0 * u)), self.c);
        let (d2, d3) = (add(scale(self.a, 6.0 * u), scale(self.b, 2.0)), scale(self.a, 6.0));
        let s = dot(d1, d1).sqrt();
        let s1 = dot(d1, d2) / s;
        let s2 = (dot(d2, d2) + dot(d1, d3) - s1 * s1) / s;
        let tangent = scale(d1, 1.0 / s);
        let across = add(d2, scale(tangent, -s1));
        let size = dot(across, across).sqrt();
        let normal = scale(across, 1.0 / size);
        let k = size / (s * s);
        let k_slope = (dot(d3, normal) / (s * s) - 3.0 * k * s1 / s) / s;
        Frame { sigma: [s, s1, s2], tangent, normal, k, k_slope }
    }
}

/// Limits of section 2 and the share of an axis: all of the path's, or its component.
struct Limits {
    axes: [AxisLimits; 2],
    feed: f64,
    radial: [f64; 2],
    whole: bool,
}

impl Limits {
    fn of(machine: &Machine, feed: f64) -> Self {
        let smoothing = &machine.smoothing;
        Self {
            axes: [machine.axes[0].limits, machine.axes[1].limits],
            feed,
            radial: [smoothing.radial_acceleration_share, smoothing.radial_jerk_share],
            whole: smoothing.limits == BlendLimits::Path,
        }
    }

    /// Largest over the axes of |component| times a value over a limit.
    fn ratio(&self, value: f64, direction: V, limit: impl Fn(&AxisLimits) -> f64) -> f64 {
        let share = |i: usize| if self.whole { 1.0 } else { direction[i].abs() };
        (0..2).map(|i| value.abs() * share(i) / limit(&self.axes[i])).fold(0.0, f64::max)
    }

    /// The rules (a) to (e).
    fn broken(&self, frame: &Frame, [_, d1, d2]: [f64; 3], d3: f64) -> [bool; 5] {
        let [s, s1, s2] = frame.sigma;
        let [ra, rj] = self.radial;
        let v = s * d1;
        let a = s1 * d1 * d1 + s * d2;
        let j = s2 * d1.powi(3) + 3.0 * s1 * d1 * d2 + s * d3;
        let along = j - v.powi(3) * frame.k * frame.k;
        let across = 3.0 * v * a * frame.k + v.powi(3) * frame.k_slope;
        let over = |ratio: f64| ratio > 1.0 + 1e-9;
        [
            over(v / self.feed) || over(self.ratio(v, frame.tangent, |l| l.velocity_max_lu_s)),
            over(self.ratio(a, frame.tangent, |l| (1.0 - ra) * l.acceleration_max_lu_s2)),
            over(self.ratio(v * v * frame.k, frame.normal, |l| ra * l.acceleration_max_lu_s2)),
            over(self.ratio(along, frame.tangent, |l| (1.0 - rj) * l.transition_jerk_max_lu_s3)),
            over(self.ratio(across, frame.normal, |l| rj * l.transition_jerk_max_lu_s3)),
        ]
    }
}

/// The printed loop from `v` at the entry: u, u', u'' after every step of 1 ms, the last beyond 1, and how often each rule is broken.
/// `None` where u' comes to 0.
fn printed(cubic: &Cubic, limits: &Limits, v: f64) -> Option<(Vec<[f64; 3]>, [u64; 5])> {
    const STEP: f64 = 1e-3;
    let first = cubic.frame(0.0);
    let d1 = v / first.sigma[0];
    let mut state = [0.0, d1, -first.sigma[1] * d1 * d1 / first.sigma[0]];
    let (mut states, mut counts) = (vec![state], [0; 5]);
    while state[0] < 1.0 {
        let frame = cubic.frame(state[0]);
        let [s, s1, s2] = frame.sigma;
        let v = s * state[1];
        let h = s2 * state[1].powi(3) + 3.0 * s1 * state[1] * state[2] - v.powi(3) * frame.k * frame.k;
        let [_, rj] = limits.radial;
        let along = 1.0 / limits.ratio(1.0, frame.tangent, |l| (1.0 - rj) * l.transition_jerk_max_lu_s3);
        let most = ((along - h.abs()) / s).max(0.0);
        let step = |d3: f64| {
            let [u, d1, d2] = state;
            let u = u + STEP * d1 + 0.5 * STEP * STEP * d2 + STEP.powi(3) * d3 / 6.0;
            [u, d1 + STEP * d2 + 0.5 * STEP * STEP * d3, d2 + STEP * d3]
        };
        let broken = |d3: f64| limits.broken(&cubic.frame(step(d3)[0].min(1.0)), step(d3), d3);
        let chosen = [most, 0.0].into_iter().find(|d3| !broken(*d3).contains(&true)).unwrap_or(-most);
        for (count, broken) in counts.iter_mut().zip(broken(chosen)) {
            *count += u64::from(broken);
        }
        state = step(chosen);
        if state[1] <= 0.0 {
            return None;
        }
        states.push(state);
    }
    Some((states, counts))
}

fn blends(planned: &[PlannedPiece]) -> Vec<(&PlannedPiece, &HermiteBlend)> {
    let blend = |piece: &PlannedPiece| matches!(piece.path.contour.kind, PieceKind::Blend(..));
    let shape = |piece: &'_ PlannedPiece| match piece.path.contour.curve() {
        Some(Curve::Blend(_)) => true,
        other => panic!("{other:?}"),
    };
    let pieces = planned.iter().filter(|piece| blend(piece) && shape(piece));
    pieces
        .map(|piece| match piece.path.contour.curve() {
            Some(Curve::Blend(blend)) => (piece, &**blend),
            _ => unreachable!(),
        })
        .collect()
}

/// A corner between long lines.
fn corner(first_rad: f64, angle_rad: f64, feed_mm_min: f64, tolerance_mm: f64) -> Program {
    let direction = |rad: f64| [80.0 * rad.cos(), 80.0 * rad.sin()];
    let (first, second) = (direction(first_rad), direction(first_rad + angle_rad));
    let mut program = Program::polyline(PathMode::G642, feed_mm_min, &[]);
    program.modes.contour_tolerance_mm = Some(tolerance_mm);
    program.line(&first);
    program.line(&add(first, second));
    program
}

#[test]
fn every_step_is_that_of_the_printed_loop() {
    let (mut compared, mut guarded, mut at_feed, mut broken_blends, mut steps) = (0, 0, 0, 0, 0);
    for seed in 0..300 {
        let mut random = Random::new(9100 + seed);
        let mut machine = spinner();
        machine.smoothing.blend_law = BlendLaw::Published;
        if seed % 3 == 1 {
            machine.smoothing.limits = BlendLimits::Path;
        }
        for axis in &mut machine.axes[..2] {
            axis.limits.transition_jerk_max_lu_s3 = random.logarithmic(2000.0, 50_000.0);
            axis.limits.acceleration_max_lu_s2 = random.logarithmic(300.0, 5000.0);
        }
        let (turn, angle) = (random.between(-3.0, 3.0), random.between(0.05, 2.6));
        let feed_mm_min = random.logarithmic(300.0, 12_000.0);
        let planned = corner(turn, angle, feed_mm_min, 0.1).planned(&machine);
        let name = format!("seed {seed} angle {angle} feed {feed_mm_min}");
        let [(piece, blend)] = blends(&planned)[..] else { panic!("{name}") };
        let direction = |rad: f64| [rad.cos(), rad.sin()];
        let cubic = Cubic::new(direction(turn), direction(turn + angle), blend.transition_length_mm(), 2.5);
        let limits = Limits::of(&machine, feed_mm_min / 60.0);
        let entry = piece.law.at(0.0).velocity_lu_s;
        if entry > limits.feed * (1.0 - 1e-6) {
            // At the feed from the start the loop hangs on the last bits of (a): two machines need not take the same steps.
            at_feed += 1;
            continue;
        }
        let Some((states, counts)) = printed(&cubic, &limits, entry) else {
            guarded += 1;
            continue;
        };
        let phases = piece.law.phases();
        if states[states.len() - 1][1] * cubic.frame(1.0).sigma[0] > feed_mm_min / 60.0 {
            // It would leave above what the next line may have: the law of the blend is the guarded one.
            assert!(phases.len() <= 7, "{name}: {}", phases.len());
            guarded += 1;
            continue;
        }
        assert_eq!(phases.len(), states.len() - 1, "{name}");
        for (phase, state) in phases.iter().zip(&states) {
            let place = blend.arc_length_at_u_lu(state[0]);
            let v = cubic.frame(state[0]).sigma[0] * state[1];
            assert!((phase.start_lu - place).abs() < 1e-9 && (phase.velocity_lu_s - v).abs() < 1e-6 * v, "{name}");
        }
        // In the middle of the steps the cubic phases are the loop's motion to a nanometre.
        for (phase, state) in phases.iter().zip(&states).take(states.len() - 2) {
            let [u, d1, d2] = *state;
            let next = states[states.iter().position(|other| other == state).unwrap() + 1];
            let d3 = (next[2] - d2) / 1e-3;
            let t = 0.5e-3;
            let middle = [u + t * d1 + t * t * d2 / 2.0 + t.powi(3) * d3 / 6.0, d1 + t * d2 + t * t * d3 / 2.0];
            let error = phase.at(t).position_lu - blend.arc_length_at_u_lu(middle[0]);
            assert!(error.abs() < 1e-6, "{name}: {error}");
        }
        // And the next line begins with the speed that the loop ends with.
        let exit = piece.law.at(piece.law.duration_s());
        assert!((exit.position_lu - blend.length_lu()).abs() < 1e-9, "{name}");
        let after = planned.iter().skip_while(|other| !std::ptr::eq(*other, piece)).nth(1).unwrap();
        assert!((after.law.at(0.0).velocity_lu_s - exit.velocity_lu_s).abs() < 1e-6, "{name}");
        compared += 1;
        broken_blends += usize::from(counts.iter().any(|count| *count > 0));
        steps += phases.len();
    }
    let counts = format!("{compared} {guarded} {at_feed} {broken_blends} {steps}");
    assert!(compared > 150 && broken_blends > 100 && steps > 5000, "{counts}");
}

/// The corner of the paper: T 0.2263 mm, entered at 5.97 mm/s; then the loop slows down to keep (e), and leaves faster than it came.
#[test]
fn the_published_corner_under_the_printed_law() {
    let mut machine = spinner();
    machine.smoothing.blend_law = BlendLaw::Published;
    let points = [[7.071, 7.071], [9.659, 16.73], [19.318, 14.142], [26.389, 21.213]];
    let planned = Program::polyline(PathMode::G642, 3000.0, &points).planned(&machine);
    let (piece, blend) = blends(&planned)[1];
    assert!((blend.transition_length_mm() - 0.2263).abs() < 5e-5);
    let entry = piece.law.at(0.0).velocity_lu_s;
    assert!((entry - 5.97).abs() < 0.005, "{entry}");
    let speeds: Vec<f64> = piece.law.phases().iter().map(|phase| phase.velocity_lu_s).collect();
    let lowest = speeds.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(lowest < 0.95 * entry && speeds[speeds.len() - 1] > entry, "{lowest} {speeds:?}");
    assert!(piece.law.phases().iter().any(|phase| phase.limit.kind == LimitKind::RadialJerk));
    // The entry is that of `blend_law = "entry"`.
    machine.smoothing.blend_law = BlendLaw::Entry;
    let held = Program::polyline(PathMode::G642, 3000.0, &points).planned(&machine);
    assert!((blends(&held)[1].0.law.at(0.0).velocity_lu_s - entry).abs() < 1e-9);
}

fn run(machine: Machine, text: &str) -> Kernel {
    let mut kernel = Kernel::new(Arc::new(machine), ProgramSource::from_bytes("part.mpf", text.as_bytes()), false);
    while kernel.cycle().unwrap() == Status::Running {}
    kernel
}

/// One warning: how many steps broke each rule, as the loop worked out here counts them, and where it began.
#[test]
fn what_the_loop_breaks_is_counted_in_one_warning() {
    let mut machine = test_machine_shipped("spinner_mvc850");
    machine.smoothing.blend_law = BlendLaw::Published;
    let cubic = |sign: f64| Cubic::new([1.0, 0.0], [0.0, sign], 8.0 * 0.08 / (3.0 * 0.5_f64.sqrt()), 2.5);
    let limits = Limits::of(&machine, 50.0);
    let first = cubic(1.0).frame(0.0);
    let jerk = 0.2 * machine.axes[1].limits.transition_jerk_max_lu_s3;
    let entry = (jerk / first.k_slope.abs()).cbrt();
    let (_, counts) = printed(&cubic(1.0), &limits, entry).unwrap();
    assert!(counts[4] > 0, "{counts:?}");
    // No axis reverses: 0.8 of the tolerance. Two corners of the same shape.
    let mut kernel = run(machine, "G642 CTOL=0.1 F3000\nG1 X50\nY50\nX100\nM30\n");
    let findings = kernel.take_findings();
    assert!(findings.alarm.is_none());
    let printed: Vec<_> = findings.warnings.iter().filter(|warning| warning.code == "P0004").collect();
    assert_eq!(printed.len(), 1, "{:?}", findings.warnings);
    let warning = printed[0];
    assert_eq!(warning.line(), 2);
    let place = warning.place.as_ref().unwrap();
    assert_eq!((&*place.file, &*place.line_text), ("part.mpf", "G1 X50"));
    assert!(warning.message.contains("in 2 of 2 blends") && warning.help.is_some(), "{}", warning.message);
    let expected = format!("(e) radial jerk after {}", 2 * counts[4]);
    assert!(warning.message.contains(&expected), "{} for {expected}", warning.message);
    assert_eq!(warning.message.contains("(c)"), counts[2] > 0, "{}", warning.message);
}

/// u' <= 0 is an alarm with its line, and the path comes to rest after it.
#[test]
fn a_loop_that_comes_to_a_stand_is_an_alarm() {
    let mut machine = test_machine_shipped("spinner_mvc850");
    machine.smoothing.blend_law = BlendLaw::Published;
    for axis in &mut machine.axes {
        axis.limits.acceleration_max_lu_s2 = 10.1;
        axis.limits.transition_jerk_max_lu_s3 = 64_136.8;
    }
    let (turn, angle) = (19.39_f64.to_radians(), 35.20_f64.to_radians());
    let program = corner(turn, angle, 6000.0, 0.0206);
    // The entry of the same corner, where the loop worked out here comes to a stand too.
    let mut held = machine.clone();
    held.smoothing.blend_law = BlendLaw::Entry;
    let planned = program.planned(&held);
    let (piece, blend) = blends(&planned)[0];
    let direction = |rad: f64| [rad.cos(), rad.sin()];
    let cubic = Cubic::new(direction(turn), direction(turn + angle), blend.transition_length_mm(), 2.5);
    let entry = piece.law.at(0.0).velocity_lu_s;
    assert!(printed(&cubic, &Limits::of(&machine, 100.0), entry).is_none());
    let ends = program.moves.iter().map(|next| next.end.0.as_slice().to_vec());
    let lines: Vec<String> = ends.map(|end| format!("X{:.9} Y{:.9}", end[0], end[1])).collect();
    let text = format!("G642 CTOL=0.0206 F6000\nG1 {}\n{}\nG91 X10\nM30\n", lines[0], lines[1]);
    let mut kernel = Kernel::new(Arc::new(machine), ProgramSource::from_bytes("part.mpf", text.as_bytes()), false);
    let mut feed = f64::NAN;
    while kernel.cycle().unwrap() == Status::Running {
        feed = kernel.output().setpoint.map_or(feed, |setpoint| setpoint.path.feed_lu_s);
    }
    let alarm = kernel.take_findings().alarm.expect("an alarm");
    assert_eq!((alarm.code, alarm.line()), ("P0003", 2), "{alarm:?}");
    assert!(alarm.help.is_some() && alarm.place.is_some());
    assert!(feed < 0.1, "{feed}");
}

/// The older model beside the axis limits: equal where N and T lie along axes at the entry (a line along X), slower by 2^(1/6) where they
/// lie between them (jerk; an axis has 1/sqrt 2 of it), and never faster with equal axes. Z does not count in a blend of X and Y.
#[test]
fn path_limits_beside_axis_limits() {
    let feed = |limits: BlendLimits, law: BlendLaw, turn: f64, angle: f64| {
        let mut machine = spinner();
        machine.axes[2].limits.transition_jerk_max_lu_s3 = 1.0;
        (machine.smoothing.limits, machine.smoothing.blend_law) = (limits, law);
        let planned = corner(turn, angle, 60_000.0, 0.1).planned(&machine);
        blends(&planned)[0].0.law.at(0.0).velocity_lu_s
    };
    let ratio = |law, turn: f64, angle: f64| {
        feed(BlendLimits::Axis, law, turn, angle) / feed(BlendLimits::Path, law, turn, angle)
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    assert!((ratio(BlendLaw::Entry, 0.0, quarter) - 1.0).abs() < 1e-9);
    assert!((ratio(BlendLaw::Entry, quarter / 2.0, quarter) - 2.0_f64.powf(1.0 / 6.0)).abs() < 1e-9);
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for i in 0..60 {
        let turn = f64::from(i) * 0.11;
        for angle in [0.1, 0.5, 1.0, quarter, 2.2] {
            let ratio = ratio(BlendLaw::Limits, turn, angle);
            (least, most) = (least.min(ratio), most.max(ratio));
        }
    }
    assert!(least >= 1.0 - 1e-9 && most > 1.05 && most <= 2.0_f64.powf(0.25) + 1e-9, "{least} {most}");
}
