//! q(s) of a piece of path.
//!
//! In: the contour piece inside a [`JointPath`]. Out: its length and [`JointState`]s. The mapping is the identity: without an
//! active transformation the axes stand where the tip of the tool is, plus the length of the tool. A transformation would put
//! its chain rule here and nowhere else.

use super::{JointPath, JointState};
use crate::base::{AxisVector, MachinePoint};
use crate::geometry::Curve;
use crate::smoothing::PieceKind;

impl JointPath {
    /// Length of the parameter s: mm of the linear axes, rad where only rotary axes move, 0 for a wait.
    pub fn length_lu(&self) -> f64 {
        self.contour.curve().map_or(0.0, |curve| curve.length_lu())
    }

    /// True where every axis moves in proportion to s: the derivatives are the same all along.
    pub fn is_straight(&self) -> bool {
        matches!(self.contour.curve(), Some(Curve::Line(_)))
    }

    /// Posture and derivatives at s, clamped to the ends of the piece.
    pub fn at(&self, s_lu: f64) -> JointState {
        let mut state = self.tip_at(s_lu);
        if let Some(tool) = &self.contour.modes.tool {
            state.position.0 += tool.length;
        }
        state
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
