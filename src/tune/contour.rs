//! Where the tool is off the path: vectors from the nearest point of the path of the set-points to the tool.
//!
//! In: postures of a course, following errors of axes. Out: three residuals a t_s, mm. The path is the polyline of the set-points; the nearest
//! point is looked for around the one before, so that a pure lag is no error. Smoothing and programmed geometry do not count.

use super::course::Course;
use crate::base::{AxisId, MachinePoint};
use crate::kinematics::Kinematics;
use crate::machine::{KinematicsSettings, Machine};

/// Segments looked at behind the nearest one of the set-point before; forward all up to the set-point, so that a path that turns back close to
/// itself is not followed backwards.
const BEHIND: usize = 8;
/// Most of them: at 1 ms and a lag of 60 ms the nearest point is 60 behind.
const HISTORY: usize = 512;

/// Points of the tool in the part.
pub(super) struct Tool {
    kinematics: Kinematics,
    /// X, Y, Z of a machine without rotary axes.
    cartesian: Option<[Option<AxisId>; 3]>,
}

impl Tool {
    pub fn new(machine: &Machine) -> Self {
        let cartesian = matches!(machine.kinematics, KinematicsSettings::Cartesian)
            .then(|| ["X", "Y", "Z"].map(|name| machine.axis_by_name(name)));
        Self { kinematics: Kinematics::new(machine), cartesian }
    }

    fn point_mm(&self, posture: &MachinePoint) -> [f64; 3] {
        match &self.cartesian {
            Some(axes) => axes.map(|axis| axis.map_or(0.0, |axis| posture.0[axis])),
            None => self.kinematics.tool_pose(posture).position_mm,
        }
    }

    /// Set-points of the tool.
    pub fn path_mm(&self, course: &Course) -> Vec<[f64; 3]> {
        course.postures.iter().map(|posture| self.point_mm(posture)).collect()
    }

    /// Error vectors in a row. `lags`: steps in t_s and following errors of the axes that have a drive; the others are where they should be.
    pub fn errors_mm(&self, course: &Course, path_mm: &[[f64; 3]], lags: &[(AxisId, usize, &[f64])]) -> Vec<f64> {
        let mut errors_mm = Vec::with_capacity(3 * path_mm.len());
        let mut nearest = 0_usize;
        for (k, posture) in course.postures.iter().enumerate() {
            let mut actual = *posture;
            for (axis, steps, lags_lu) in lags {
                actual.0[*axis] -= lags_lu.get(k * steps).copied().unwrap_or(0.0);
            }
            let point_mm = self.point_mm(&actual);
            let first = nearest.saturating_sub(BEHIND).max(k.saturating_sub(HISTORY));
            let last = (k + 2).min(path_mm.len().saturating_sub(1));
            let mut best = (f64::INFINITY, nearest, [0.0; 3]);
            for segment in first..last.max(first + 1) {
                let from = path_mm.get(segment).copied().unwrap_or(point_mm);
                let to = path_mm.get(segment + 1).copied().unwrap_or(from);
                let gap_mm = gap(from, to, point_mm);
                let square: f64 = gap_mm.iter().map(|part| part * part).sum();
                // Of equally near ones the last: behind a rest the path goes on.
                if square <= best.0 {
                    best = (square, segment, gap_mm);
                }
            }
            nearest = best.1;
            errors_mm.extend(best.2);
        }
        errors_mm
    }
}

/// From the nearest point of a-b to p.
fn gap(a: [f64; 3], b: [f64; 3], p: [f64; 3]) -> [f64; 3] {
    let ab: [f64; 3] = std::array::from_fn(|i| b[i] - a[i]);
    let ap: [f64; 3] = std::array::from_fn(|i| p[i] - a[i]);
    let dot = |x: &[f64; 3], y: &[f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let length_mm2 = dot(&ab, &ab);
    let share = if length_mm2 > 0.0 { (dot(&ap, &ab) / length_mm2).clamp(0.0, 1.0) } else { 0.0 };
    std::array::from_fn(|i| ap[i] - share * ab[i])
}

/// Axes whose position moves the tool: X, Y, Z, and those of the kinematic chain.
pub(super) fn moves_tool(machine: &Machine, axis: AxisId) -> bool {
    let of_chain = match &machine.kinematics {
        KinematicsSettings::Cartesian => false,
        KinematicsSettings::Rotary { table, head } => table.iter().chain(head).any(|joint| joint.axis == axis),
    };
    of_chain || matches!(machine.axis(axis).name.as_str(), "X" | "Y" | "Z")
}
