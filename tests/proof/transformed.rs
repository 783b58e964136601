//! Paths that are no polynomial in any joint: lines, arcs and blends in the part, seen from turning tables and heads, q(s) with sines.
//!
//! No word of the language makes them yet. The pieces are those of a program; the planner and the interpolator are handed them with the
//! chain of the machine in force, and every joint is judged as on any other path.

use crate::program::Program;
use crate::random::Random;
use crate::run::{Row, Run, places, prepared};
use crate::settings::{Law, Settings};
use crate::verdict::{Finding, Kind};
use crate::{axes, contour, run};
use sollwert::feed::{PlannedPiece, Planner};
use sollwert::interpolator::Interpolator;
use sollwert::interpreter::ToolOffset;
use sollwert::kinematics::{JointPath, Kinematics, Transformation};
use sollwert::machine::Machine;
use std::sync::Arc;

/// A machine and a program in the part.
pub fn case(seed: u64, law: Law) -> (Settings, Program) {
    let mut random = Random::new(seed);
    let settings = Settings::five_axes(&mut random, law);
    let count = 3 + random.below(12) as usize;
    let program = Program::random(&mut random, &settings, count);
    (settings, program)
}

/// Everything that is wrong, the worst first.
pub fn judged(settings: &Settings, program: &Program) -> Vec<Finding> {
    let machine = settings.machine();
    let run = match transformed(&machine, &program.text(settings)) {
        Ok(run) => run,
        Err(text) => return vec![Finding { kind: Kind::Alarm, ratio: f64::INFINITY, text }],
    };
    let mut findings = match places(&run) {
        Ok(places) => {
            let mut findings = axes::check(&machine, settings.law, &run, &places);
            findings.extend(contour::rests(&machine, &run, &places));
            findings
        }
        Err(text) => vec![Finding { kind: Kind::Path, ratio: f64::INFINITY, text }],
    };
    findings.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
    findings
}

/// The set-points of a program under the chain of the machine, with a tool of 80 mm.
fn transformed(machine: &Machine, text: &str) -> Result<Run, String> {
    let (targets, pieces) = prepared(machine, text)?;
    let kinematics = Kinematics::new(machine);
    let transformation = Arc::new(Transformation::new(kinematics.clone()));
    let mut length = sollwert::base::AxisVector::zero();
    length[sollwert::base::AxisId::new(2)] = 80.0;
    let tool = Arc::new(ToolOffset { tool: "T1".into(), edge: 1, length, radius_mm: 5.0 });
    let paths: Vec<JointPath> = pieces
        .into_iter()
        .map(|mut piece| {
            piece.modes.tool = Some(tool.clone());
            JointPath { transformation: Some(transformation.clone()), ..kinematics.to_joint(piece) }
        })
        .collect();
    let (stretches, joints) = run::path(&paths);
    let mut planned = planned(machine, paths)?.into_iter();
    let mut interpolator = Interpolator::new(machine);
    let mut next = || planned.next();
    let rows: Vec<Row> =
        (0..).map_while(|k| interpolator.sample(k, &mut next).map(|setpoint| Row::new(&setpoint))).collect();
    let t_s = machine.cycle.time_base.setpoint_period_s();
    Ok(Run { rows, targets, stretches, joints, summary: None, t_s })
}

pub fn planned(machine: &Machine, paths: Vec<JointPath>) -> Result<Vec<PlannedPiece>, String> {
    let mut planner = Planner::new(machine);
    let mut planned = Vec::new();
    for path in paths {
        while let Some(piece) = planner.pop() {
            planned.push(piece);
        }
        planner.push(path).map_err(|alarm| alarm.render(false))?;
    }
    planner.finish();
    while let Some(piece) = planner.pop() {
        planned.push(piece);
    }
    Ok(planned)
}

/// Turns joints and asks whether a line in the part is none for the axes: the harness would otherwise judge nothing new.
pub fn bends(law: Law) -> bool {
    let (settings, program) = case(1, law);
    let run = transformed(&settings.machine(), &program.text(&settings)).unwrap_or_else(|text| panic!("{text}"));
    run.stretches.iter().filter_map(|stretch| stretch.path.as_ref()).any(|path| path.at(0.0).second.norm() > 1e-6)
}
