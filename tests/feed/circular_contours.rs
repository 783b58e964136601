//! The published model of circular contours (models/arcs.md sections 4 to 7) [Gassara 2013], worked out here a second time and compared
//! with the planner block by block: `arc_limits = "printed"`, both ways to measure a jump of curvature, unequal axes.

use crate::support::{Program, plan, test_machine_shipped, total_s};
use sollwert::geometry::{ArcCorner, PlaneArc, Sense};
use sollwert::kernel::{Kernel, Status};
use sollwert::machine::{ArcLimits, CurvatureJump, Machine, PathMode};
use sollwert::program::ProgramSource;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// One arc of a contour: where the path points at its start, its sense, radius and angle.
#[derive(Clone, Copy, Debug)]
struct Block {
    direction: f64,
    sense: f64,
    radius: f64,
    angle: f64,
}

/// Limits of the two axes, of the path, and the cycle.
#[derive(Clone, Copy)]
struct Limits {
    velocity: [f64; 2],
    acceleration: [f64; 2],
    jerk: [f64; 2],
    programmed: f64,
    cycle_s: f64,
    signed: bool,
}

/// What section 6 needs of a block.
#[derive(Clone, Copy, Debug)]
struct Moves {
    length: f64,
    speed: f64,
    acceleration: f64,
    jerk: f64,
}

/// lim(LX, LY; psi) of section 4.
fn lim(limits: [f64; 2], psi: f64) -> f64 {
    (limits[0] / psi.cos().abs()).min(limits[1] / psi.sin().abs())
}

/// Its minimum over a range of directions: the ends, the axis-parallel ones and a fine grid.
fn worst(limits: [f64; 2], from: f64, to: f64) -> f64 {
    let (low, high) = (from.min(to), from.max(to));
    let grid = (0..=20_000).map(|i| low + (high - low) * f64::from(i) / 20_000.0);
    let parallel = (-20..=20).map(|i| f64::from(i) * FRAC_PI_2).filter(|psi| *psi >= low && *psi <= high);
    grid.chain(parallel).map(|psi| lim(limits, psi)).fold(f64::INFINITY, f64::min)
}

impl Block {
    fn end_direction(&self) -> f64 {
        self.direction + self.sense * self.angle
    }

    fn curvature(&self) -> f64 {
        self.sense / self.radius
    }

    /// Section 4, rule "printed".
    fn moves(&self, limits: &Limits) -> Moves {
        let (from, to) = (self.direction, self.end_direction());
        let acceleration = lim(limits.acceleration, from - self.sense * FRAC_PI_2);
        let jerk = worst(limits.jerk, from, to);
        let length = self.radius * self.angle;
        let caps = [
            worst(limits.velocity, from, to),
            limits.programmed,
            (jerk * self.radius * self.radius).cbrt(),
            (self.radius * acceleration).sqrt(),
            length / limits.cycle_s,
        ];
        Moves { length, speed: caps.into_iter().fold(f64::INFINITY, f64::min), acceleration, jerk }
    }
}

impl Moves {
    /// Ramp of section 6: its length and its time.
    fn ramp(&self, va: f64, vb: f64) -> (f64, f64) {
        let (dv, a, j) = ((vb - va).abs(), self.acceleration, self.jerk);
        let time = if dv <= a * a / j { 2.0 * (dv / j).sqrt() } else { 2.0 * (a / j) + dv / a - a / j };
        ((va + vb) / 2.0 * time, time)
    }

    /// Highest speed at one end of the block if it is `v` at the other.
    fn reachable(&self, v: f64) -> f64 {
        bisect(v, 1e4, |w| self.ramp(v, w).0 <= self.length)
    }

    /// Time of the block, and of its phase 4.
    fn time(&self, v0: f64, v7: f64) -> (f64, f64, f64) {
        let ramps = |v: f64| (self.ramp(v0, v).0 + self.ramp(v, v7).0, self.ramp(v0, v).1 + self.ramp(v, v7).1);
        let peak = bisect(v0.max(v7), self.speed, |v| ramps(v).0 <= self.length);
        let cruise = ((self.length - ramps(peak).0) / peak).max(0.0);
        (ramps(peak).1 + cruise, cruise, peak)
    }
}

/// Largest value in a range for which a condition holds that holds at its start.
fn bisect(low: f64, high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    if high <= low || holds(high) {
        return high.max(low);
    }
    let (mut low, mut high) = (low, high);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if holds(middle) { low = middle } else { high = middle }
    }
    low
}

/// Section 7: speeds at all junctions, T_c, T_Vprog.
fn model(contour: &[Block], limits: &Limits) -> (Vec<f64>, f64, f64) {
    let blocks: Vec<Moves> = contour.iter().map(|block| block.moves(limits)).collect();
    let mut speeds = vec![0.0; contour.len() + 1];
    for i in 1..contour.len() {
        let (k1, k2) = (contour[i - 1].curvature(), contour[i].curvature());
        let jump = if limits.signed { (k1 - k2).abs() } else { (k1.abs() - k2.abs()).abs() };
        let jerk = lim(limits.jerk, contour[i].direction + FRAC_PI_2);
        speeds[i] = (jerk * limits.cycle_s / jump).sqrt().min(blocks[i - 1].speed).min(blocks[i].speed);
    }
    for i in 0..contour.len() {
        speeds[i + 1] = speeds[i + 1].min(blocks[i].reachable(speeds[i]));
    }
    for i in (0..contour.len()).rev() {
        speeds[i] = speeds[i].min(blocks[i].reachable(speeds[i + 1]));
    }
    let times: Vec<(f64, f64, f64)> = (0..contour.len()).map(|i| blocks[i].time(speeds[i], speeds[i + 1])).collect();
    let at_programmed = times.iter().filter(|(_, _, peak)| *peak > limits.programmed * (1.0 - 1e-9));
    let programmed_s = at_programmed.map(|(_, cruise, _)| cruise).sum();
    (speeds, times.iter().map(|(time, ..)| time).sum(), programmed_s)
}

/// The published contour with its corner rounded at `eps`: three blocks.
fn published(deviation_mm: f64) -> Vec<Block> {
    let [c, d, e] = [[10.0, 20.0], [46.36, 56.36], [109.54, 100.60]];
    let left = |from, to, radius| PlaneArc::new(from, to, radius, Sense::CounterClockwise).unwrap();
    let (first, second) = (left(c, d, 40.0), left(d, e, 60.0));
    let fillet = ArcCorner::new(first, second).unwrap().fillet_with_deviation(deviation_mm).unwrap();
    let block = |direction, sense, radius, length: f64| Block { direction, sense, radius, angle: length / radius };
    let (cut_first, cut_second) = (first.length_mm() - fillet.taken_mm[0], second.length_mm() - fillet.taken_mm[1]);
    let start = first.direction_start_rad();
    let turn = start + cut_first / 40.0;
    vec![
        block(start, 1.0, 40.0, cut_first),
        block(turn, -1.0, fillet.radius_mm, fillet.length_mm()),
        block(turn - fillet.angle_rad, 1.0, 60.0, cut_second),
    ]
}

/// Arcs in a row without a step of direction, of either sense.
fn chain(directions: f64, arcs: &[[f64; 2]]) -> Vec<Block> {
    let mut direction = directions;
    arcs.iter()
        .map(|[radius, angle]| {
            let block = Block { direction, sense: angle.signum(), radius: *radius, angle: angle.abs() };
            direction = block.end_direction();
            block
        })
        .collect()
}

fn contours() -> Vec<Vec<Block>> {
    vec![
        published(0.02),
        published(0.2),
        published(1.5),
        chain(0.1, &[[40.0, 1.4], [60.0, 1.4], [60.0, -0.7], [2.0, -2.9], [2.0, 0.4], [300.0, 0.3]]),
        chain(2.0, &[[0.3, 1.0], [25.0, -1.2], [0.05, 1.5], [0.06, 1.5], [80.0, 1.0]]),
        chain(-1.3, &[[15.0, 3.0]]),
    ]
}

fn program(contour: &[Block], feed_mm_min: f64) -> Program {
    let mut program = Program::new(PathMode::G64, feed_mm_min);
    for block in contour {
        let end = program.end().0;
        let (x, y) = (end.as_slice()[0], end.as_slice()[1]);
        let (sin, cos) = block.direction.sin_cos();
        let centre = [x - block.sense * block.radius * sin, y + block.sense * block.radius * cos];
        program.arc(centre, block.sense * block.angle, 0.0);
    }
    program
}

fn machine(uneven: bool, signed: bool) -> (Machine, Limits) {
    let mut machine = test_machine_shipped("huron_kx10");
    machine.feed.arc_limits = ArcLimits::Printed;
    machine.feed.curvature_jump = if signed { CurvatureJump::Signed } else { CurvatureJump::Printed };
    let mut limits = Limits {
        velocity: [500.0; 2],
        acceleration: [3000.0; 2],
        jerk: [50_000.0; 2],
        programmed: 10_000.0 / 60.0,
        cycle_s: 0.002,
        signed,
    };
    if uneven {
        (limits.velocity[1], limits.acceleration[1], limits.jerk[1]) = (150.0, 700.0, 20_000.0);
        let axis = &mut machine.axes[1].limits;
        (axis.velocity_max_lu_s, axis.acceleration_max_lu_s2) = (150.0, 700.0);
        (axis.jerk_max_lu_s3, axis.transition_jerk_max_lu_s3) = (20_000.0, 20_000.0);
    }
    (machine, limits)
}

#[test]
fn every_block_is_that_of_the_model() {
    for (uneven, signed) in [(false, true), (false, false), (true, true), (true, false)] {
        let (machine, limits) = machine(uneven, signed);
        for (i, contour) in contours().iter().enumerate() {
            let name = format!("contour {i} uneven {uneven} signed {signed}");
            let planned = plan(&machine, program(contour, 10_000.0).paths(&machine));
            let (speeds, time_s, _) = model(contour, &limits);
            assert_eq!(planned.len(), contour.len(), "{name}");
            for (piece, expected) in planned.iter().zip(&speeds) {
                let entry = piece.law.at(0.0).velocity_lu_s;
                assert!((entry - expected).abs() <= 1e-6 * expected, "{name}: {entry} for {expected} in {speeds:?}");
                // Seven phases at most, and they end where the block does.
                assert!(piece.law.phases().len() <= 7, "{name}");
                let end = piece.law.at(piece.law.duration_s());
                assert!((end.position_lu - piece.path.length_lu()).abs() < 1e-9, "{name}");
                assert!(end.acceleration_lu_s2.abs() < 1e-6, "{name}");
            }
            let total = total_s(&planned);
            assert!((total / time_s - 1.0).abs() < 1e-6, "{name}: {total} for {time_s}");
        }
    }
}

/// The fillet of the published corner, by hand: R 0.49, sqrt(0.49 * 3000) = 38, cbrt(50000 * 0.49²) = 22.9; at its ends with the sum of
/// the curvatures sqrt(100 / (1/0.49 + 1/40)) = 6.96, printed with their difference 7.04.
#[test]
fn the_published_fillet_by_hand() {
    for (signed, expected) in [(true, 6.96), (false, 7.04)] {
        let (machine, _) = machine(false, signed);
        let planned = plan(&machine, program(&published(0.2), 10_000.0).paths(&machine));
        let entry = planned[1].law.at(0.0).velocity_lu_s;
        // The radius is printed to two digits.
        assert!((entry - expected).abs() < 0.04, "{entry}");
    }
}

/// A larger deviation does not always shorten the cycle (section 8): the fillet is crossed slowly. Without one the path stops at D.
#[test]
fn a_small_fillet_can_cost_more_than_a_stop_saves() {
    let (machine, _) = machine(false, true);
    let time_s = |contour: &[Block]| total_s(&plan(&machine, program(contour, 10_000.0).paths(&machine)));
    // Rest to rest over both arcs, by the model: two paths of one block each.
    let whole = chain(0.0, &[[40.0, 80.0_f64.to_radians()], [60.0, 80.0_f64.to_radians()]]);
    let (_, limits) = self::machine(false, true);
    let stopped: f64 = whole.iter().map(|block| model(&[*block], &limits).1).sum();
    let (fine, middle, coarse) = (time_s(&published(0.002)), time_s(&published(0.2)), time_s(&published(8.0)));
    // 1.077 s, 1.116 s, 1.045 s; 1.069 s with a stop.
    assert!(middle > fine && middle > stopped && coarse < stopped, "{fine} {middle} {coarse} {stopped}");
}

/// Section 7, step 6: T_c, T_CAM, eta and r1 as the figures of a run.
#[test]
fn the_figures_are_those_of_the_model() {
    let (machine, limits) = machine(false, true);
    for contour in contours() {
        let (_, time_s, programmed_s) = model(&contour, &limits);
        let mut text = String::from("G64 G17 G90 F10000\n");
        let moved = program(&contour, 10_000.0);
        let mut at = [0.0, 0.0];
        for (block, next) in contour.iter().zip(&moved.moves) {
            let (sin, cos) = block.direction.sin_cos();
            let (i, j) = (-block.sense * block.radius * sin, block.sense * block.radius * cos);
            let end = next.end.0.as_slice();
            let g = if block.sense > 0.0 { 3 } else { 2 };
            text += &format!("G{g} X{:.12} Y{:.12} I{i:.12} J{j:.12}\n", end[0], end[1]);
            at = [end[0], end[1]];
        }
        assert_ne!(at, [0.0, 0.0]);
        text += "M30\n";
        let source = ProgramSource::from_bytes("contour.mpf", text.as_bytes());
        let mut kernel = Kernel::new(Arc::new(machine.clone()), source, false);
        while kernel.cycle().unwrap() == Status::Running {}
        let figures = kernel.figures();
        let cycles = (time_s / limits.cycle_s - 1e-6).ceil();
        assert_eq!(figures.setpoints as f64, cycles, "{text}");
        let length: f64 = contour.iter().map(|block| block.radius * block.angle).sum();
        assert!((figures.cam_time_s / (length / limits.programmed) - 1.0).abs() < 1e-9);
        // Ticks within 0.1 % of F: the phases 4, and the last of the ramps to them (sqrt(2 * 0.001 V / J) = 2.6 ms each).
        let ticks = figures.at_programmed_feed as f64;
        let blocks = contour.len() as f64;
        let (least, most) = (programmed_s / limits.cycle_s - blocks, programmed_s / limits.cycle_s + 5.0 * blocks);
        assert!(ticks >= least && ticks <= most, "{ticks} not in {least} .. {most}");
    }
}
