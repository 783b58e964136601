//! q(s) of a piece of path.
//!
//! In: the contour piece inside a [`JointPath`], and the transformation that is in force, if any. Out: its length and
//! [`JointState`]s. Without a transformation the axes stand where the tip of the tool is, plus the length of the tool; with one they
//! stand where the chain puts them (`transformation`). The parameter is the same s: arc length of the tip in the part.

use super::{JointPath, JointState};
use crate::base::{AxisVector, MachinePoint};
use crate::geometry::Curve;
use crate::smoothing::PieceKind;
use std::f64::consts::FRAC_PI_8;

/// Places at which the angles of the joints are looked at between two nodes of a curve.
const LOOKS: usize = 9;

impl JointPath {
    /// Length of the parameter s: mm of the linear axes, rad where only rotary axes move, 0 for a wait.
    pub fn length_lu(&self) -> f64 {
        self.contour.curve().map_or(0.0, |curve| curve.length_lu())
    }

    /// True where every axis moves in proportion to s: the derivatives are the same all along.
    pub fn is_straight(&self) -> bool {
        self.is_contour() && matches!(self.contour.curve(), Some(Curve::Line(_)))
    }

    /// Posture and derivatives at s, clamped to the ends of the piece.
    pub fn at(&self, s_lu: f64) -> JointState {
        let mut state = self.tip_at(s_lu);
        let tool = self.contour.modes.tool.as_ref();
        if let Some(transformation) = &self.transformation {
            return transformation.axes(&state, &tool.map_or(AxisVector::zero(), |tool| tool.length));
        }
        if let Some(tool) = tool {
            state.position.0 += tool.length;
        }
        state
    }

    /// The axes follow the contour's own curve, so that its shape says what they do. `false`: only [`at`](Self::at) does, a line in
    /// the part is none for the axes, and demands have no closed form.
    pub fn is_contour(&self) -> bool {
        self.transformation.is_none()
    }

    /// From start to end, per axis.
    pub fn displacement_lu(&self) -> AxisVector {
        if self.is_contour() {
            return self.contour.curve().map_or(AxisVector::zero(), |curve| curve.end().0 - curve.start().0);
        }
        self.at(self.length_lu()).position.0 - self.at(0.0).position.0
    }

    /// Places inside, in order, between which the motion of every axis is smooth and turns little: to begin a search for its greatest
    /// demands with. They say nothing about steps of direction or curvature.
    pub fn nodes_lu(&self) -> Vec<f64> {
        let length_lu = self.length_lu();
        let own: Vec<f64> = match self.contour.curve() {
            Some(Curve::Polynomial(curve)) => curve.nodes_lu().collect(),
            _ => Vec::new(),
        };
        let Some(transformation) = &self.transformation else { return own };
        let mut nodes: Vec<f64> = Vec::new();
        let mut from_lu = 0.0;
        for to_lu in own.into_iter().chain([length_lu]) {
            let look = |i: usize| self.tip_at(from_lu + (to_lu - from_lu) * i as f64 / (LOOKS - 1) as f64);
            let states: [JointState; LOOKS] = std::array::from_fn(look);
            let parts = transformation.parts(&states).max(self.turns(to_lu - from_lu));
            nodes.extend((1..=parts).map(|i| from_lu + (to_lu - from_lu) * i as f64 / parts as f64));
            from_lu = to_lu;
        }
        // The last one is the end.
        nodes.pop();
        nodes
    }

    /// The same for the turn of a circle.
    fn turns(&self, length_lu: f64) -> usize {
        let turn_rate_per_mm = match self.contour.curve() {
            Some(Curve::Arc(arc)) => arc.turn_rate_per_mm(),
            Some(Curve::SpatialArc(arc)) => arc.turn_rate_per_mm(),
            _ => 0.0,
        };
        ((turn_rate_per_mm * length_lu).abs() / FRAC_PI_8).ceil().clamp(1.0, 1e4) as usize
    }

    /// The same for the tip of the tool.
    fn tip_at(&self, s_lu: f64) -> JointState {
        match &self.contour.kind {
            PieceKind::Block(curve) | PieceKind::Blend(curve, _) => {
                let state = curve.at(s_lu);
                JointState {
                    position: MachinePoint(state.position.0),
                    first: state.first,
                    second: state.second,
                    third: state.third,
                }
            }
            PieceKind::Wait { at, .. } | PieceKind::WaitPositioned { at, .. } => {
                let still = AxisVector::zero();
                JointState { position: MachinePoint(at.0), first: still, second: still, third: still }
            }
        }
    }
}
