//! The transformation of a chain: motion of the tool in the part -> motion of the machine axes, with three derivatives.
//!
//! In: tip of the tool in the part and angles of the rotary joints along a path, with their derivatives to s. Out: the same of the
//! machine axes. With the joints of `chain` (J_i carry the part, H_i the tool) and the tool L, X, Y and Z of the machine are
//!
//! ```text
//! XYZ = J_1 .. J_n p  -  H_1 .. H_m (-L)
//! ```
//!
//! Rotary axes stand where the path says; so do axes that are neither X, Y, Z nor joints. Every joint turns a point about its own line
//! by Rodrigues' formula, and every sum and product is one of truncated Taylor series ([`Jet`]), so that q', q'' and q''' are exact
//! to rounding: no difference quotient, no polynomial. Nothing here depends on how many joints there are.
//! Does not choose the angles: that is the inverse problem of TRAORI, a later room's.

use super::chain::Joint;
use super::{JointState, Kinematics};
use crate::base::Portable;
use crate::base::{AxisId, AxisVector};
use std::f64::consts::FRAC_PI_8;

/// Most nodes between two of the curve: an eighth of half a turn each for 60 revolutions, coarser beyond.
const NODES_MAX: usize = 1000;

/// A chain that is in force: shared by all pieces under it.
#[derive(Clone, Debug, PartialEq)]
pub struct Transformation {
    kinematics: Kinematics,
}

/// A function of s at one place: value and derivatives, `[f, f', f'', f''']`.
type Jet = [f64; 4];

/// A point in space that moves with s.
type PointJet = [Jet; 3];

impl Transformation {
    /// Of the chain of a machine.
    pub fn new(kinematics: Kinematics) -> Self {
        Self { kinematics }
    }

    /// The axes where the tool is as `tip` says: X, Y and Z are those of the tip in the part, all others axes of the machine. `length`: position of
    /// the axes minus position of the tip, with the head at 0.
    pub(super) fn axes(&self, tip: &JointState, length: &AxisVector) -> JointState {
        let Kinematics { geometry_axes, table, head } = &self.kinematics;
        let angle = |joint: &Joint| jet(tip, joint.axis);
        let part: PointJet = geometry_axes.map(|axis| axis.map_or([0.0; 4], |axis| jet(tip, axis)));
        let tool: PointJet = geometry_axes.map(|axis| constant(axis.map_or(0.0, |axis| -length[axis])));
        let carried = table.iter().rev().fold(part, |point, joint| turned(joint, &angle(joint), &point));
        let reached = head.iter().rev().fold(tool, |point, joint| turned(joint, &angle(joint), &point));
        let mut axes = *tip;
        for (axis, (carried, reached)) in geometry_axes.iter().zip(carried.iter().zip(&reached)) {
            let Some(axis) = *axis else { continue };
            let [position, first, second, third] = minus(carried, reached);
            axes.position.0[axis] = position;
            axes.first[axis] = first;
            axes.second[axis] = second;
            axes.third[axis] = third;
        }
        axes
    }

    /// The rotary axes whose angles X, Y and Z depend on.
    fn joints(&self) -> impl Iterator<Item = AxisId> {
        self.kinematics.table.iter().chain(&self.kinematics.head).map(|joint| joint.axis)
    }

    /// In how many equal parts a stretch of path is to be cut so that in each the joints turn by an eighth of half a turn together,
    /// about: `states` are places on it, dense enough that no angle turns back unseen by much.
    pub(super) fn parts(&self, states: &[JointState]) -> usize {
        let turned = |pair: &[JointState]| -> f64 {
            let way = pair[1].position.0 - pair[0].position.0;
            self.joints().map(|axis| way[axis].abs()).sum()
        };
        let travel_rad: f64 = states.windows(2).map(turned).sum();
        // `as` saturates: infinities and NaN give some number, and the limits of such a path are refused elsewhere.
        ((travel_rad / FRAC_PI_8).ceil() as usize).clamp(1, NODES_MAX)
    }
}

/// The point carried by a joint: c + R(angle) (p - c), by Rodrigues' formula
/// `R v = v cos + (k x v) sin + k (k . v) (1 - cos)`.
fn turned(joint: &Joint, angle: &Jet, point: &PointJet) -> PointJet {
    let (k, c) = (&joint.direction, &joint.point);
    let v: PointJet = std::array::from_fn(|i| minus(&point[i], &constant(c[i])));
    let [sin, cos] = sine_cosine(angle);
    let versine = minus(&constant(1.0), &cos);
    let along = plus(&plus(&scaled(&v[0], k[0]), &scaled(&v[1], k[1])), &scaled(&v[2], k[2]));
    let across = |i: usize| {
        let (next, last) = ((i + 1) % 3, (i + 2) % 3);
        minus(&scaled(&v[last], k[next]), &scaled(&v[next], k[last]))
    };
    std::array::from_fn(|i| {
        let turned = plus(&product(&v[i], &cos), &product(&across(i), &sin));
        plus(&constant(c[i]), &plus(&turned, &scaled(&product(&along, &versine), k[i])))
    })
}

/// Motion of one axis.
fn jet(state: &JointState, axis: AxisId) -> Jet {
    [state.position.0[axis], state.first[axis], state.second[axis], state.third[axis]]
}

fn constant(value: f64) -> Jet {
    [value, 0.0, 0.0, 0.0]
}

fn plus(a: &Jet, b: &Jet) -> Jet {
    std::array::from_fn(|i| a[i] + b[i])
}

fn minus(a: &Jet, b: &Jet) -> Jet {
    std::array::from_fn(|i| a[i] - b[i])
}

fn scaled(a: &Jet, factor: f64) -> Jet {
    a.map(|derivative| derivative * factor)
}

/// Leibniz.
fn product(a: &Jet, b: &Jet) -> Jet {
    [
        a[0] * b[0],
        a[1] * b[0] + a[0] * b[1],
        a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2],
        a[3] * b[0] + 3.0 * (a[2] * b[1] + a[1] * b[2]) + a[0] * b[3],
    ]
}

/// Sine and cosine of an angle, by the chain rule.
fn sine_cosine(angle: &Jet) -> [Jet; 2] {
    let [_, w, dw, ddw] = *angle;
    let (sin, cos) = angle[0].portable_sin_cos();
    let (even, odd) = (w * w, ddw - w * w * w);
    [
        [sin, cos * w, cos * dw - sin * even, cos * odd - 3.0 * sin * w * dw],
        [cos, -sin * w, -sin * dw - cos * even, -sin * odd - 3.0 * cos * w * dw],
    ]
}
