//! Work area: G25 and G26 with axes, WALIMON, WALIMOF.
//!
//! In: limits of axes in the basic system (no frame applies to them), end points of moves. Out: an alarm at the block that leads
//! outside. Limits hold from their block on (WALIMON is the initial state) and keep their values through WALIMOF. What is watched is
//! the tool tip at the programmed end of a block and, on circles in a plane of two axes, at their outermost points.

use super::block::Collected;
use super::motion::MotionWords;
use super::run::Interpreter;
use super::value::trimmed;
use super::wire::{ArcGeometry, MoveKind};
use crate::base::Portable;
use crate::base::units::deg_from_rad;
use crate::base::{AxisId, AxisKind, PartPoint, PerAxis};
use crate::program::{Columns, Fault, Outcome, codes};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Set-points that miss a limit by less are on it: below any digit that a program carries.
const ON_LIMIT_LU: f64 = 1e-9;

/// Limits of all axes.
#[derive(Clone, Debug)]
pub(super) struct WorkArea {
    is_on: bool,
    low_lu: PerAxis<Option<f64>>,
    high_lu: PerAxis<Option<f64>>,
}

impl Default for WorkArea {
    fn default() -> Self {
        Self { is_on: true, low_lu: PerAxis::splat(None), high_lu: PerAxis::splat(None) }
    }
}

impl WorkArea {
    /// The limit that a position violates.
    pub fn violated_lu(&self, id: AxisId, position_lu: f64) -> Option<f64> {
        let below = |low_lu: &f64| position_lu < low_lu - ON_LIMIT_LU;
        let above = |high_lu: &f64| position_lu > high_lu + ON_LIMIT_LU;
        self.low_lu[id].filter(below).or(self.high_lu[id].filter(above)).filter(|_| self.is_on)
    }
}

impl Interpreter {
    /// WALIMON, WALIMOF.
    pub(super) fn work_area(&mut self, on: bool, _columns: &Columns) -> Outcome<()> {
        self.work_area.is_on = on;
        Ok(())
    }

    /// G25 (lower) and G26 (upper) with axes; with S they limit the spindle.
    pub(super) fn set_limits(
        &mut self,
        upper: bool,
        words: &MotionWords,
        block: &mut Collected,
        columns: &Columns,
    ) -> Outcome<()> {
        let spindle = block.take_spindle_speed();
        if !words.any() && spindle.is_none() {
            return Err(Fault::new(codes::BAD_BLOCK, columns.clone(), "G25 and G26 limit something")
                .label("expected axes or S"));
        }
        if let Some((speed_rpm, _)) = spindle {
            self.modal.feed_modes.spindle_limits_rpm[usize::from(upper)] = Some(speed_rpm);
        }
        for id in self.machine.axis_ids() {
            if let Some(word) = &words.axes[id] {
                let limit_lu = Some(self.modal.position_lu(self.machine.axis(id).kind, word.typed));
                if upper {
                    self.work_area.high_lu[id] = limit_lu;
                } else {
                    self.work_area.low_lu[id] = limit_lu;
                }
            }
        }
        Ok(())
    }

    /// An alarm if the block leaves the work area.
    pub(super) fn check_work_area(&self, words: &MotionWords, kind: &MoveKind, end: &PartPoint) -> Outcome<()> {
        for id in self.machine.axis_ids() {
            let columns = match &words.axes[id] {
                Some(word) => word.columns.clone(),
                None => words.columns(),
            };
            let moves = words.axes[id].is_some() || end.0[id] != self.position.0[id];
            if moves {
                self.check_limit(id, end.0[id], &columns)?;
            }
            if let MoveKind::Arc(arc) = kind {
                let start_mm = arc.plane.map(|axis| self.position.0[axis]);
                for position_mm in outermost_mm(arc, id, start_mm).into_iter().flatten() {
                    self.check_limit(id, position_mm, &columns)?;
                }
            }
        }
        Ok(())
    }

    fn check_limit(&self, id: AxisId, position_lu: f64, columns: &Columns) -> Outcome<()> {
        let Some(limit_lu) = self.work_area.violated_lu(id, position_lu) else { return Ok(()) };
        let axis = self.machine.axis(id);
        let shown = |value_lu: f64| match axis.kind {
            AxisKind::Linear => format!("{} mm", trimmed(value_lu)),
            AxisKind::Rotary => format!("{} deg", trimmed(deg_from_rad(value_lu))),
        };
        let side = if position_lu < limit_lu { "below the lower" } else { "above the upper" };
        let message = format!(
            "{} would go to {}, {side} limit of the work area, {}",
            axis.name,
            shown(position_lu),
            shown(limit_lu)
        );
        Err(Fault::new(codes::WORK_AREA, columns.clone(), message)
            .label("outside the work area")
            .help("G25 and G26 set it, in the basic coordinate system; WALIMOF switches it off"))
    }
}

/// Positions of an axis of the plane where an arc that starts at `start_mm` turns back in it.
fn outermost_mm(arc: &ArcGeometry, id: AxisId, start_mm: [f64; 2]) -> [Option<f64>; 2] {
    let Some(index) = arc.plane.iter().position(|axis| *axis == id) else { return [None, None] };
    let [first_mm, second_mm] = [start_mm[0] - arc.centre_mm[0], start_mm[1] - arc.centre_mm[1]];
    let start_rad = second_mm.portable_atan2(first_mm);
    let sides = [(0.0, 1.0), (PI, -1.0)];
    sides.map(|(angle_rad, side_ratio)| {
        let turn_rad = (angle_rad + index as f64 * FRAC_PI_2 - start_rad) * arc.sweep_rad.signum();
        (turn_rad.rem_euclid(TAU) <= arc.sweep_rad.abs()).then(|| arc.centre_mm[index] + side_ratio * arc.radius_mm)
    })
}
