//! The limits of a path, piece by piece, for a planner other than the control's own.
//!
//! In: the [`JointPath`]s of a program in order. Out: [`PieceRules`]: what every axis may do on the piece, its feed, and the highest
//! speed at the junction before it, all from the rules by which [`Planner`](super::Planner) plans. Where a time law limits the step of
//! acceleration at the ends of a blend (`continuous`), so do these rules; `seven-phase` leaves those steps free, as published.
//!
//! DRIVE is one set of limits a piece here, as for the planner: full acceleration where F keeps every axis below the velocity from
//! which it is lower, the lower acceleration elsewhere. Does not plan, and does not know the cycle: no piece is too short.

use super::junction;
use super::limits::{AxisRules, Ends, FeedCap};
use super::modes::ModeRules;
use crate::kinematics::JointPath;
use crate::machine::{Machine, TimeLawKind};
use crate::smoothing::PieceKind;
use std::sync::Arc;

/// Finds the limits along a path.
#[derive(Clone, Debug)]
pub struct PathRules {
    rules: ModeRules,
    before: Option<(Ends, Arc<AxisRules>)>,
    blend_ends_free: bool,
}

/// What one axis may do on a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisCaps {
    /// V, with FL in a feed motion and OVRRAP in a rapid.
    pub velocity_max_lu_s: f64,
    /// A.
    pub acceleration_max_lu_s2: f64,
    /// J; inside a blend the transition jerk.
    pub jerk_max_lu_s3: f64,
}

/// The limits of a piece that moves.
#[derive(Clone, Debug, PartialEq)]
pub struct PieceRules {
    /// Of every axis, in order.
    pub axes: Vec<AxisCaps>,
    /// F along s with OVR; `None`: a rapid.
    pub feed_lu_s: Option<f64>,
    /// SOFT: jerk is limited.
    pub jerk_limited: bool,
    /// Highest speed where it begins: 0 after a rest.
    pub junction_lu_s: f64,
}

impl PathRules {
    /// At rest, at the start of a path on `machine`.
    pub fn new(machine: &Machine) -> Self {
        let blend_ends_free = machine.feed.time_law == TimeLawKind::SevenPhase;
        Self { rules: ModeRules::new(machine), before: None, blend_ends_free }
    }

    /// The path rests here.
    pub fn rest(&mut self) {
        self.before = None;
    }

    /// The limits of the next piece; `None` for one that does not move.
    pub fn piece(&mut self, path: &JointPath) -> Option<PieceRules> {
        let contour = &path.contour;
        let curve = contour.curve().filter(|curve| curve.length_lu() > 0.0)?;
        let in_blend = matches!(contour.kind, PieceKind::Blend(..));
        let rules = self.rules.of(&contour.modes);
        let ends = Ends {
            start: path.at(0.0),
            end: path.at(curve.length_lu()),
            blend: in_blend && self.blend_ends_free,
            rotary_only: curve.rotary_only(),
        };
        let junction =
            self.before.as_ref().map_or(junction::STOP, |(before, its)| junction::cap([its, &rules], before, &ends));
        let feed = rules.feed_cap(&contour.feed, curve);
        let piece = PieceRules {
            axes: rules.caps(path, &feed, in_blend),
            feed_lu_s: match feed {
                FeedCap::Rapid => None,
                FeedCap::Programmed(cap) => Some(cap.velocity_lu_s),
            },
            jerk_limited: rules.jerk_limited,
            junction_lu_s: junction.velocity_lu_s,
        };
        self.before = Some((ends, rules));
        Some(piece)
    }
}

impl AxisRules {
    /// What every axis may do in a feed motion or rapid, in a block or blend.
    fn caps(&self, path: &JointPath, feed: &FeedCap, in_blend: bool) -> Vec<AxisCaps> {
        let rules = self.throughout(path);
        let caps = |(limits, feed_velocity_lu_s): (&crate::machine::AxisLimits, &f64)| AxisCaps {
            velocity_max_lu_s: match feed {
                FeedCap::Rapid => limits.velocity_max_lu_s * self.rapid_override_ratio,
                FeedCap::Programmed(_) => *feed_velocity_lu_s,
            },
            acceleration_max_lu_s2: limits.acceleration_max_lu_s2,
            jerk_max_lu_s3: if in_blend { limits.transition_jerk_max_lu_s3 } else { limits.jerk_max_lu_s3 },
        };
        rules.axes.iter().zip(&rules.feed_velocities_max_lu_s).map(caps).collect()
    }
}
