//! The same path in another way takes the same time: reversed, and with a block in two; with a stop at every block end it is not much quicker.

use crate::program::{Block, Program};
use crate::random::Random;
use crate::run::Run;
use crate::settings::{Law, Settings};
use crate::verdict::{Finding, Kind};
use sollwert::machine::Machine;
use std::cell::OnceCell;
use std::sync::Arc;

/// A window that is longer than every stopping distance here.
const WINDOW_BLOCKS: u32 = 2000;

/// A program in that window.
pub struct Wide<'a> {
    settings: Settings,
    program: &'a Program,
    machine: Arc<Machine>,
    run: OnceCell<Option<Run>>,
}

impl<'a> Wide<'a> {
    pub fn new(settings: &Settings, program: &'a Program) -> Self {
        let settings = Settings { look_ahead_blocks: WINDOW_BLOCKS, ..settings.clone() };
        let machine = Arc::new(settings.machine());
        Self { settings, program, machine, run: OnceCell::new() }
    }

    fn of(&self, text: &str) -> Option<Run> {
        Run::new(&self.machine, text).ok()
    }

    /// The program itself. `None`: it is no program.
    fn run(&self) -> Option<&Run> {
        self.run.get_or_init(|| self.of(&self.program.text(&self.settings))).as_ref()
    }
}

/// What times may differ by, of the time, and in cycles: two runs end between two cycles each, and so does the approach.
const REVERSED_RATIO: f64 = 0.005;
const REVERSED_CYCLES: f64 = 3.0;

/// What the corners of one path may differ by, and its steps of curvature; less than this sum of those is rounding.
const STEPS_RATIO: f64 = 0.01;
const BENDING_MIN: f64 = 1e-6;

/// And each of its blends.
const BLEND_RATIO: f64 = 1e-3;

/// The reversed path takes as long. `None`: it does, or there is no such path. Under `seven-phase` a ramp ends where a block ends, and a
/// backward pass is not the mirror of a forward one: nothing is promised.
pub fn reversed(wide: &Wide<'_>) -> Option<Finding> {
    let settings = &wide.settings;
    if settings.law == Law::SevenPhase {
        return None;
    }
    let [_, approach, back] = texts(settings, wide.program)?;
    let (first, second, third) = (wide.run()?, wide.of(&back)?, wide.of(&approach)?);
    // Rounding of points may make a corner, or take one away: at a hair of a line between an arc and its tangent, for one.
    let (blends, mirrored) = (first.blends_lu(), second.blends_lu());
    let alike = |(a, b): (&f64, &f64)| (a - b).abs() <= BLEND_RATIO * a.max(*b);
    let same_path = blends.len() == mirrored.len()
        && blends.iter().zip(mirrored.iter().rev()).all(alike)
        && (first.turning() - second.turning()).abs() <= STEPS_RATIO * first.turning()
        && (first.bending() - second.bending()).abs() <= STEPS_RATIO * first.bending() + BENDING_MIN
        && (first.path_length_lu() + third.path_length_lu() - second.path_length_lu()).abs() < 1e-4;
    if !same_path {
        return None;
    }
    let there_s = first.cycle_time_s();
    let back_s = second.cycle_time_s() - third.cycle_time_s();
    let allowed = REVERSED_RATIO * there_s + REVERSED_CYCLES * first.t_s;
    let ratio = (there_s - back_s).abs() / allowed;
    let text = format!("{there_s:.6} s, reversed {back_s:.6} s ({:+.3} %)", 100.0 * (back_s / there_s - 1.0));
    (ratio > 1.0).then_some(Finding { kind: Kind::Reversed, ratio, text })
}

/// The program, the way to its end, and that with the reversed program after it. `None`: it has no reverse.
pub fn texts(settings: &Settings, program: &Program) -> Option<[String; 3]> {
    let back = program.reversed()?;
    let (there, end) = program.text_from(settings, [0.0; 5], "");
    let words: String =
        settings.axes.iter().enumerate().map(|(i, axis)| format!(" {}{:.6}", axis.name, end[i])).collect();
    let opening = format!("G60\nG0{words}\n");
    let approach = format!("G17 G90 G71 G94 G1\n{opening}M30\n");
    let (back, _) = back.text_from(settings, end, &opening);
    Some([there, approach, back])
}

/// The path goes on: with exact stops for its corners, and without a compressor, it would not take a third of the time. `None`: so it is, or that is no program.
/// `seven-phase` drives a blend at the speed of its worst place, and promises nothing but that it says so.
pub fn crept(settings: &Settings, program: &Program, run: &Run) -> Option<Finding> {
    let time_s = run.cycle_time_s();
    // At F alone a path with stops takes as long as one without: it is the longer one.
    let feed_s = run.summary.as_ref().map_or(0.0, |summary| summary.cam_time_s);
    let tells = settings.law == Law::SevenPhase && run.warns(CREEPS);
    if tells || time_s <= CREPT_RATIO * feed_s {
        return None;
    }
    let machine = Arc::new(settings.machine());
    let stops = Run::new(&machine, &program.with_stops().text(settings)).ok()?;
    let allowed_s = CREPT_RATIO * stops.cycle_time_s() + CREPT_MIN_S;
    let text = format!("{time_s:.6} s, with exact stops {:.6} s", stops.cycle_time_s());
    (time_s > allowed_s).then_some(Finding { kind: Kind::Creep, ratio: time_s / allowed_s, text })
}

/// So much longer than with exact stops a program never takes: a blend may bend more than the axes like, and the window be a block.
const CREPT_RATIO: f64 = 3.0;
const CREPT_MIN_S: f64 = 0.1;

/// The code of the warning.
const CREEPS: &str = "P0010";

/// A line in two is the same motion. `None`: it is, or there is no line to split, or the split changes the path.
pub fn split(wide: &Wide<'_>, random: &mut Random) -> Option<Finding> {
    let Wide { settings, program, .. } = wide;
    // A compressor makes another curve of another point.
    if settings.law != Law::Continuous || program.compresses() {
        return None;
    }
    let lines: Vec<usize> =
        (0..program.blocks.len()).filter(|index| matches!(program.blocks[*index], Block::Motion { .. })).collect();
    let index = *lines.get(random.below(lines.len().max(1) as u32) as usize)?;
    let parted = program.split(index, random.between(0.25, 0.75))?;
    let (whole, parts) = (wide.run()?, wide.of(&parted.text(settings))?);
    // A block that ends in a stop, or a corner whose blend takes half of a block, is another path when the block is in two.
    let same_path = whole.is_like(&parts) && (whole.path_length_lu() - parts.path_length_lu()).abs() < 1e-7;
    if !same_path {
        return None;
    }
    let [whole_s, parts_s] = [whole, &parts].map(Run::cycle_time_s);
    let allowed = SPLIT_RATIO * whole_s + 1.5 * whole.t_s;
    let ratio = (whole_s - parts_s).abs() / allowed;
    let text = format!("{whole_s:.6} s, with block {index} in two {parts_s:.6} s");
    (ratio > 1.0).then_some(Finding { kind: Kind::Split, ratio, text })
}

/// What a split may change, of the time: a block in two has more places at which the jerk may change, which gains up to a thousandth of a path as
/// short as these where a slow block meets a fast one.
const SPLIT_RATIO: f64 = 1e-3;
