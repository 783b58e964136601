//! Polynomials and rational polynomials up to degree 5, by arc length: ASPLINE, BSPLINE, CSPLINE, POLY.
//!
//! In: start, end and the [`PolynomialGeometry`] of the move. Out: [`PolynomialCurve`]. Parts share the table of the whole. As with
//! arcs, what the programmed points miss of the pieces is rounding and is spread linearly.
//!
//! With the speed `sigma = |dq/du|` over the axes that count, and primes for d/ds:
//!
//! ```text
//! dq/du   = sigma q'
//! d²q/du² = sigma² q'' + sigma_u q'
//! d³q/du³ = sigma³ q''' + 3 sigma sigma_u q'' + sigma_uu q'
//! ```
//!
//! Does not make splines from points: that is the interpreter's.

use super::CurveState;
use super::arc_length::{ArcLengthTable, Panel};
use super::rational::derivatives;
use crate::base::{AxisId, AxisVector, PartPoint, PerAxis};
use crate::interpreter::{PolynomialGeometry, PolynomialPiece};
use std::sync::Arc;

/// Directions that differ by less go on smoothly.
const SAME_DIRECTION_RATIO: f64 = 1e-9;

/// Curvatures that differ by less than this share go on smoothly.
const SAME_CURVATURE_RATIO: f64 = 1e-6;

/// A chain of polynomial pieces, or a part of it.
#[derive(Clone, Debug, PartialEq)]
pub struct PolynomialCurve {
    table: Arc<ArcLengthTable>,
    start: PartPoint,
    end: PartPoint,
    /// Panels that the part lies in.
    panels: [usize; 2],
    /// Arc length of the whole where this part begins.
    offset_lu: f64,
    length_lu: f64,
    /// The parameter at both ends, in the first and the last panel.
    ends_ratio: [f64; 2],
    /// Added to the pieces: at the start of the whole, and per arc length.
    shift: AxisVector,
    shift_slope: AxisVector,
}

impl PolynomialCurve {
    /// From `start` to `end` along `geometry`; `linear` says which axes count as path length. Without displacement the length is 0,
    /// and it is NaN where there is no such curve (a pole, numbers out of range).
    pub fn new(start: PartPoint, end: PartPoint, geometry: &Arc<PolynomialGeometry>, linear: &PerAxis<bool>) -> Self {
        let table = Arc::new(ArcLengthTable::new(geometry.clone(), linear));
        let length_lu = table.length_lu();
        let panels = [0, table.panels().len().saturating_sub(1)];
        let ends_ratio = match table.panels() {
            [] => [0.0; 2],
            [first, ..] => [first.ends_ratio[0], table.panels()[panels[1]].ends_ratio[1]],
        };
        let mut curve = Self {
            table,
            ends_ratio,
            start,
            end,
            panels,
            offset_lu: 0.0,
            length_lu,
            shift: AxisVector::zero(),
            shift_slope: AxisVector::zero(),
        };
        if length_lu > 0.0 {
            curve.shift = start.0 - curve.state_at(0.0).position.0;
            let at_end = end.0 - curve.state_at(length_lu).position.0;
            curve.shift_slope = at_end.map(|missing| missing / length_lu);
        }
        curve
    }

    /// Arc length.
    pub fn length_lu(&self) -> f64 {
        self.length_lu
    }

    /// What the arc length of the whole may be off by, rounding apart.
    pub fn length_error_max_lu(&self) -> f64 {
        self.table.error_max_lu()
    }

    /// True where no linear axis moves: lengths are then in rad.
    pub fn rotary_only(&self) -> bool {
        self.table.rotary_only()
    }

    /// The coefficients keep this axis within `most_lu` of 0, denominators apart; false where one of them is no number.
    pub fn stays_within(&self, axis: AxisId, most_lu: f64) -> bool {
        let reach = |piece: &PolynomialPiece| {
            let rows = piece.numerator_lu.iter().rev();
            rows.fold(0.0, |sum: f64, row| sum * piece.parameter_end_ratio + row[axis].abs())
        };
        self.table.pieces().iter().all(|piece| reach(piece) <= most_lu)
    }

    /// First point.
    pub fn start(&self) -> PartPoint {
        self.start
    }

    /// Last point.
    pub fn end(&self) -> PartPoint {
        self.end
    }

    /// The curve at s, clamped to its ends.
    pub fn at(&self, s_lu: f64) -> CurveState {
        let s_lu = s_lu.max(0.0).min(self.length_lu);
        let mut state = self.state_at(s_lu);
        if s_lu >= self.length_lu {
            state.position = self.end;
        } else if s_lu <= 0.0 {
            state.position = self.start;
        }
        state
    }

    /// Arc length of the first piece up to its parameter u; meant for whole curves.
    pub fn length_at_lu(&self, u: f64) -> f64 {
        self.table.length_at(u).max(0.0).min(self.length_lu)
    }

    /// Places between which the curve is smooth and changes little, in order, without the ends: where the quadrature had to be cut.
    pub fn nodes_lu(&self) -> impl Iterator<Item = f64> {
        let borders = self.own_panels().iter().map(|panel| panel.lengths_lu[0] - self.offset_lu);
        borders.filter(|s_lu| *s_lu > 0.0 && *s_lu < self.length_lu)
    }

    /// Places inside where one polynomial ends and the next begins, in order.
    pub fn knots_lu(&self) -> impl Iterator<Item = f64> {
        let pairs = self.own_panels().windows(2).filter(|pair| pair[0].piece != pair[1].piece);
        pairs.map(|pair| pair[1].lengths_lu[0] - self.offset_lu)
    }

    /// Places inside where the direction or the curvature steps, in order.
    pub fn breaks_lu(&self) -> Vec<f64> {
        let pairs = self.own_panels().windows(2);
        let breaks = pairs.filter(|pair| self.steps_between(&pair[0], &pair[1]));
        breaks.map(|pair| pair[1].lengths_lu[0] - self.offset_lu).collect()
    }

    /// The part from `start_lu` to `end_lu`, both inside the curve and in order.
    pub(super) fn trimmed(&self, start_lu: f64, end_lu: f64) -> Self {
        let mut part = self.clone();
        part.offset_lu = self.offset_lu + start_lu;
        part.length_lu = end_lu - start_lu;
        let (from_lu, to_lu) = (part.offset_lu, self.offset_lu + end_lu);
        let panels = self.own_panels();
        // A part that begins on a border begins with what follows it, and one that ends there ends with what is before it.
        let first = panels.partition_point(|panel| panel.lengths_lu[1] <= from_lu);
        let last = panels.partition_point(|panel| panel.lengths_lu[0] < to_lu).saturating_sub(1);
        let [low, high] = self.panels;
        let first = (low + first).min(high);
        part.panels = [first, (low + last).max(first).min(high)];
        // Places are those of the whole, so that neighbours meet to the last bit.
        if start_lu > 0.0
            && let Some((index, u)) = self.place(start_lu)
        {
            part.start = self.state_in(index, u, from_lu).position;
            let border = self.table.panels()[part.panels[0]].ends_ratio[0];
            part.ends_ratio[0] = if index == part.panels[0] { u } else { border };
        }
        if end_lu < self.length_lu
            && let Some((index, u)) = self.place(end_lu)
        {
            part.end = self.state_in(index, u, to_lu).position;
            let border = self.table.panels()[part.panels[1]].ends_ratio[1];
            part.ends_ratio[1] = if index == part.panels[1] { u } else { border };
        }
        part
    }

    fn own_panels(&self) -> &[Panel] {
        let [first, last] = self.panels;
        self.table.panels().get(first..=last).unwrap_or(&[])
    }

    /// The panel in which the place `s_lu` of this part lies, and the parameter there; `None`: nothing moves.
    fn place(&self, s_lu: f64) -> Option<(usize, f64)> {
        let panels = self.own_panels();
        let last = panels.len().checked_sub(1)?;
        // The ends are asked for most, and their parameters are known.
        if s_lu <= 0.0 {
            return Some((self.panels[0], self.ends_ratio[0]));
        }
        if s_lu >= self.length_lu {
            return Some((self.panels[1], self.ends_ratio[1]));
        }
        let along_lu = self.offset_lu + s_lu;
        let index = panels.partition_point(|panel| panel.lengths_lu[1] < along_lu).min(last);
        Some((self.panels[0] + index, self.table.parameter_at(&panels[index], along_lu)))
    }

    /// The pieces with what is added to them at s of this part.
    fn state_at(&self, s_lu: f64) -> CurveState {
        match self.place(s_lu) {
            Some((index, u)) => self.state_in(index, u, self.offset_lu + s_lu),
            None => {
                let still = AxisVector::zero();
                CurveState { position: self.start, first: still, second: still, third: still }
            }
        }
    }

    /// The same in a panel at u, `along_lu` from the start of the whole.
    fn state_in(&self, panel: usize, u: f64, along_lu: f64) -> CurveState {
        let mut state = self.pieces_at(&self.table.panels()[panel], u);
        state.position.0 += self.shift + self.shift_slope * along_lu;
        state.first += self.shift_slope;
        state
    }

    /// A piece at u, derivatives to s.
    fn pieces_at(&self, panel: &Panel, u: f64) -> CurveState {
        let (linear, counted) = (self.table.linear(), self.table.counted());
        let piece = &self.table.pieces()[panel.piece];
        let exact = derivatives(piece, linear, u);
        let [low, high] = panel.safe_ratio;
        let safe = u.max(low).min(high);
        let d = if safe == u { exact } else { derivatives(piece, linear, safe) };
        let (q_u, q_uu, q_uuu) = (d.first, d.second, d.third);
        let [c_u, c_uu] = [q_u, q_uu].map(|vector| vector.masked(counted));
        let sigma = c_u.norm();
        let sigma_u = c_u.dot(&q_uu) / sigma;
        let sigma_uu = (c_uu.dot(&q_uu) + c_u.dot(&q_uuu) - sigma_u * sigma_u) / sigma;
        let first = q_u * (1.0 / sigma);
        let second = (q_uu - first * sigma_u) * (1.0 / (sigma * sigma));
        let third = (q_uuu - second * (3.0 * sigma * sigma_u) - first * sigma_uu) * (1.0 / (sigma * sigma * sigma));
        CurveState { position: PartPoint(exact.position), first, second, third }
    }

    /// The direction or the curvature steps from one panel to the next.
    fn steps_between(&self, before: &Panel, after: &Panel) -> bool {
        if before.piece == after.piece && before.safe_ratio == after.safe_ratio {
            return false;
        }
        let end = self.pieces_at(before, before.ends_ratio[1]);
        let start = self.pieces_at(after, after.ends_ratio[0]);
        let turn = (start.first - end.first).norm();
        let bend = (start.second - end.second).norm();
        !(turn <= SAME_DIRECTION_RATIO
            && bend <= SAME_CURVATURE_RATIO * start.second.norm().max(end.second.norm()).max(SAME_CURVATURE_RATIO))
    }
}
