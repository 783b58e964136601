//! How much `continuous` leaves on the table: its time over the least time for the same path under the same limits (`optimum`).
//!
//! In: a seed. Out: both times. The window is longer than every stopping distance here, so that it holds nothing back.

use crate::run::prepared;
use crate::settings::{Law, Settings};
use crate::{case, transformed};
use sollwert::kinematics::Kinematics;
use sollwert::optimum::Collector;

/// A window that is longer than every stopping distance here.
const WINDOW_BLOCKS: u32 = 2000;

/// Times of the control and of the optimum, without rests.
#[derive(Clone, Copy, Debug)]
pub struct Times {
    pub control_s: f64,
    pub optimum_s: f64,
}

/// `Err`: what the program or the optimum says.
pub fn times(seed: u64) -> Result<Times, String> {
    let (settings, program, _) = case(seed, Law::Continuous);
    let settings = Settings { look_ahead_blocks: WINDOW_BLOCKS, ..settings };
    let machine = settings.machine();
    let (_, pieces) = prepared(&machine, &program.text(&settings))?;
    let kinematics = Kinematics::new(&machine);
    let planned = transformed::planned(&machine, pieces.into_iter().map(|piece| kinematics.to_joint(piece)).collect())?;
    let mut collector = Collector::new(&machine);
    let mut control_s = 0.0;
    for piece in &planned {
        control_s += piece.law.duration_s();
        collector.push(piece);
    }
    let optimum = collector.solve(&mut |_, _| {}).map_err(|reason| format!("{reason:?}"))?;
    if let [line, ..] = optimum.unsolved_lines[..] {
        return Err(format!("nothing found from line {line} on"));
    }
    Ok(Times { control_s: control_s - optimum.rest_s, optimum_s: optimum.time_s - optimum.rest_s })
}
