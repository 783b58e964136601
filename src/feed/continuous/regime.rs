//! Under which override the front piece stands where.
//!
//! In: the override, the place of the front piece. Out: pieces with the limits that hold under it, and how far a plan may go and must look. Does not plan.

use super::Piece;
use super::chain::PathPoint;
use super::grid::{End, Settling, Stretch};
use crate::feed::limits::AxisRules;
use crate::kinematics::JointPath;
use std::sync::Arc;

/// A plan for a change looks so much further than the change takes.
const REACH_RATIO: f64 = 1.5;

/// The override, and where the front piece stands under it.
#[derive(Clone, Debug)]
pub(super) struct Regime {
    /// In force.
    pub override_ratio: f64,
    /// The last one above 0: feeds are planned with it.
    pub moving_ratio: f64,
    /// The highest since the path last kept one: while it settles it may be as fast as under that.
    pub fastest_ratio: f64,
    /// So far from where the front stands the speed may still be that of the plan before.
    pub settling_lu: f64,
    /// Where the front piece stands.
    pub from_lu: f64,
    /// The state there, if it is not that at the start of the plan.
    pub point: Option<PathPoint>,
    /// What a change takes, about, while it is planned.
    pub transition: Option<Settling>,
    /// Rules under the override that were asked for last, with those that they come from.
    overridden: Option<(Arc<AxisRules>, [f64; 2], Arc<AxisRules>)>,
}

impl Default for Regime {
    fn default() -> Self {
        Self {
            override_ratio: 1.0,
            moving_ratio: 1.0,
            fastest_ratio: 1.0,
            settling_lu: 0.0,
            from_lu: 0.0,
            point: None,
            transition: None,
            overridden: None,
        }
    }
}

impl Regime {
    /// How far a plan must look beyond the front.
    pub fn reach_lu(&self) -> f64 {
        let change_lu = self.transition.map_or(0.0, |change| change.way_lu);
        REACH_RATIO * change_lu.max(self.settling_lu)
    }

    /// The pieces over which the path may go: with 0 % the rapids before the first feed, with a rest at their end.
    pub fn allowed<'a, 'b>(&self, pieces: &'a mut [Piece<'b>]) -> &'a mut [Piece<'b>] {
        if self.override_ratio > 0.0 {
            return pieces;
        }
        let rapids = rapids(pieces);
        let stops = rapids < pieces.len();
        let allowed = &mut pieces[..rapids];
        if let Some(last) = allowed.last_mut() {
            last.rests_after |= stops;
        }
        allowed
    }

    /// Another override above 0 in force from now on; the feeds before it, to go back to them.
    pub fn move_to(&mut self, override_ratio: f64) -> [f64; 2] {
        let before = [self.moving_ratio, self.fastest_ratio];
        let settled = self.settling_lu <= 0.0;
        self.fastest_ratio = if settled { self.moving_ratio } else { self.fastest_ratio }.max(override_ratio);
        self.moving_ratio = override_ratio;
        before
    }

    /// The same from rest.
    pub fn begin_at(&mut self, override_ratio: f64) {
        (self.moving_ratio, self.fastest_ratio) = (override_ratio, override_ratio);
    }

    /// Brings a piece under the override that feeds are planned with.
    pub fn look(&mut self, piece: &mut Piece<'_>) {
        let flow = &mut piece.flow;
        let settles = self.settling_lu > 0.0 || self.transition.is_some();
        let leaves = settles && flow.programmed.weakens() && flow.fastest_ratio < self.fastest_ratio;
        if flow.override_ratio == self.moving_ratio && !leaves {
            return;
        }
        (flow.override_ratio, flow.fastest_ratio) = (self.moving_ratio, self.fastest_ratio);
        if !piece.is_rapid() {
            let rules = self.overridden(&piece.flow.programmed);
            piece.flow.follow(rules, piece.path);
        }
    }

    fn overridden(&mut self, programmed: &Arc<AxisRules>) -> Arc<AxisRules> {
        let key = [self.moving_ratio, self.fastest_ratio];
        if key == [1.0; 2] {
            return programmed.clone();
        }
        if let Some((from, known, rules)) = &self.overridden
            && Arc::ptr_eq(from, programmed)
            && *known == key
        {
            return rules.clone();
        }
        let rules = Arc::new(programmed.overridden(self.moving_ratio, self.fastest_ratio));
        self.overridden = Some((programmed.clone(), key, rules.clone()));
        rules
    }

    /// What is cut of a piece that begins so far ahead; `None`: the front.
    pub fn stretch(&self, path: &JointPath, ends: [End; 2], ahead_lu: Option<f64>) -> Stretch {
        let settling = self.transition.unwrap_or_default().after(ahead_lu.unwrap_or(0.0));
        let from_lu = if ahead_lu.is_none() { self.from_lu } else { 0.0 };
        Stretch { from_lu, settling, ..Stretch::whole(path, ends) }
    }
}

/// How many pieces in front are rapids.
pub(super) fn rapids(pieces: &[Piece<'_>]) -> usize {
    pieces.iter().take_while(|piece| piece.is_rapid()).count()
}
