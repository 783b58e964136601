//! Arc length of a chain of polynomial pieces: s(u) and u(s).
//!
//! In: a [`PolynomialGeometry`]. Out: [`ArcLengthTable`]: the parameter cut into panels with their lengths.
//!
//! A panel is cut in two until eight Gauss-Legendre nodes on the whole and on its halves agree to [`PANEL_ERROR_RATIO`] of its length,
//! or to [`FLOOR_RATIO`] of that of the curve where the speed |dq/du| has a zero. The halves are what is kept. For a smooth integrand
//! their error is the difference over 2^16. Near a zero of the speed the differences fall slowly from one halving to the next, but they
//! do not rise, and a parameter has not more than [`HALVINGS`]: so many times the sum of the differences bounds the error of the
//! length ([`ArcLengthTable::error_max_lu`]), below 1e-9 of it. Tests compare with another quadrature. The inverse is Newton's method
//! inside the panel, held by a bracket.
//!
//! Where the speed is 0 the curve has no direction: such a cusp is the border of two panels, and derivatives near it are taken a
//! little beside it ([`Panel::safe_ratio`]), so that they are numbers. Positions are exact everywhere.
//!
//! A curve whose length is no number, or whose panels do not converge, has the length NaN: feed makes an alarm of it.

use super::curve::DISPLACEMENT_MIN_LU;
use super::quadrature::integral;
use super::rational::{derivatives, is_plain, speed, speeds};
use crate::base::PerAxis;
use crate::interpreter::{PolynomialGeometry, PolynomialPiece};
use std::sync::Arc;

/// Agreement of a panel with its halves, as share of its length.
const PANEL_ERROR_RATIO: f64 = 1e-11;

/// The same as share of the length of the curve: enough for a panel whatever its length.
const FLOOR_RATIO: f64 = 1e-13;

/// A quotient knows the speed to the rounding of its coordinates only: differences below this share of them are noise.
const NOISE_RATIO: f64 = 2.0 * f64::EPSILON;

/// So often an interval can be halved before its ends are neighbours in f64.
const HALVINGS: f64 = 52.0;

/// Panels of one piece: more means a curve that no control would drive, such as one with poles.
const PANELS_MAX: usize = 1024;

/// Speeds below this share of the mean are 0: rounding of coefficients.
const CUSP_SPEED_RATIO: f64 = 1e-7;

/// Near a cusp, derivatives are those where the speed is this share of the mean: within about 1e-6 of the length.
const SAFE_SPEED_RATIO: f64 = 1e-3;

/// Rounds of bisection: the parameter to its last bit.
const BISECTIONS: u32 = 64;

/// Rounds of Newton's method with a bracket that is halved at least every second one.
const INVERSION_ROUNDS: u32 = 100;

/// A step of Newton's method as share of the panel after which no further one is needed.
const SETTLED_RATIO: f64 = 1e-9;

/// A stretch of the parameter of one piece.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Panel {
    /// Which piece.
    pub piece: usize,
    /// First and last u.
    pub ends_ratio: [f64; 2],
    /// Arc length where it begins and where it ends.
    pub lengths_lu: [f64; 2],
    /// What its length may be off by.
    error_lu: f64,
    /// |dq/du| at its ends.
    speeds_lu: [f64; 2],
    /// u between which derivatives exist.
    pub safe_ratio: [f64; 2],
}

/// A chain of pieces with its arc length.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ArcLengthTable {
    geometry: Arc<PolynomialGeometry>,
    /// Axes that are divided by the denominator.
    linear: PerAxis<bool>,
    /// Axes whose travel is the length.
    counted: PerAxis<bool>,
    panels: Vec<Panel>,
    rotary_only: bool,
    length_lu: f64,
    error_max_lu: f64,
}

impl ArcLengthTable {
    /// `linear` says which axes count as path length; where none of them moves, the others do.
    pub fn new(geometry: Arc<PolynomialGeometry>, linear: &PerAxis<bool>) -> Self {
        let along_linear = Self::over(geometry.clone(), linear, *linear, false);
        if along_linear.length_lu.is_nan() || along_linear.length_lu >= DISPLACEMENT_MIN_LU {
            return along_linear;
        }
        let along_rotary = Self::over(geometry, linear, linear.map(|is_linear| !is_linear), true);
        if along_rotary.length_lu > along_linear.length_lu { along_rotary } else { along_linear }
    }

    fn over(
        geometry: Arc<PolynomialGeometry>,
        linear: &PerAxis<bool>,
        counted: PerAxis<bool>,
        rotary_only: bool,
    ) -> Self {
        let linear = *linear;
        let (panels, length_lu, error_max_lu) = (Vec::new(), 0.0, 0.0);
        let mut table = Self { geometry, linear, counted, panels, rotary_only, length_lu, error_max_lu };
        let rough_lu: Vec<f64> = table.geometry.pieces.iter().map(|piece| table.rough_length(piece)).collect();
        let total_lu: f64 = rough_lu.iter().sum();
        let mut length_lu = 0.0;
        for (index, rough_lu) in rough_lu.iter().enumerate() {
            match table.piece_panels(index, *rough_lu, total_lu) {
                Some(panels) => {
                    for mut panel in panels {
                        let own_lu = panel.lengths_lu[1];
                        panel.lengths_lu = [length_lu, length_lu + own_lu];
                        length_lu += own_lu;
                        table.error_max_lu += panel.error_lu;
                        table.panels.push(panel);
                    }
                }
                None => length_lu = f64::NAN,
            }
        }
        table.length_lu = length_lu;
        table
    }

    /// Arc length of all pieces.
    pub fn length_lu(&self) -> f64 {
        self.length_lu
    }

    /// What the length may be off by, rounding apart.
    pub fn error_max_lu(&self) -> f64 {
        self.error_max_lu
    }

    /// No linear axis moves: lengths are in rad.
    pub fn rotary_only(&self) -> bool {
        self.rotary_only
    }

    /// In order; empty where nothing moves.
    pub fn panels(&self) -> &[Panel] {
        &self.panels
    }

    /// Axes that are divided by the denominator.
    pub fn linear(&self) -> &PerAxis<bool> {
        &self.linear
    }

    /// Axes whose travel is the length.
    pub fn counted(&self) -> &PerAxis<bool> {
        &self.counted
    }

    /// The pieces.
    pub fn pieces(&self) -> &[PolynomialPiece] {
        &self.geometry.pieces
    }

    /// u at arc length `s_lu` inside a panel.
    pub fn parameter_at(&self, panel: &Panel, s_lu: f64) -> f64 {
        let [u0, u1] = panel.ends_ratio;
        let [l0, l1] = panel.lengths_lu;
        if s_lu <= l0 || l1 <= l0 {
            return u0;
        }
        if s_lu >= l1 {
            return u1;
        }
        let piece = &self.geometry.pieces[panel.piece];
        let (mut low, mut high) = (u0, u1);
        let mut u = guess(panel, s_lu).max(u0).min(u1);
        let mut step_before = u1 - u0;
        for _ in 0..INVERSION_ROUNDS {
            // From the nearer end, so that the quadrature is the better one.
            let error_lu = if u - u0 < u1 - u {
                l0 + self.length_between(piece, u0, u) - s_lu
            } else {
                l1 - self.length_between(piece, u, u1) - s_lu
            };
            if error_lu > 0.0 {
                high = u
            } else {
                low = u
            }
            let newton = error_lu / self.speed(piece, u);
            let mut next = u - newton;
            if newton.abs() <= SETTLED_RATIO * (u1 - u0) {
                // Newton squares the error: this step leaves nothing to see.
                return next.max(u0).min(u1);
            }
            if !(next > low && next < high && newton.abs() < 0.5 * step_before) {
                next = 0.5 * (low + high);
            }
            step_before = (next - u).abs();
            u = next;
        }
        u
    }

    /// Arc length of the first piece up to u.
    pub fn length_at(&self, u: f64) -> f64 {
        let first = self.panels.iter().take_while(|panel| panel.piece == 0);
        let Some(panel) = first.filter(|panel| panel.ends_ratio[0] <= u).last() else { return 0.0 };
        let [u0, u1] = panel.ends_ratio;
        let u = u.min(u1);
        let piece = &self.geometry.pieces[panel.piece];
        if u - u0 < u1 - u {
            panel.lengths_lu[0] + self.length_between(piece, u0, u)
        } else {
            panel.lengths_lu[1] - self.length_between(piece, u, u1)
        }
    }

    fn speed(&self, piece: &PolynomialPiece, u: f64) -> f64 {
        speed(piece, &self.linear, &self.counted, u)
    }

    fn length_between(&self, piece: &PolynomialPiece, from: f64, to: f64) -> f64 {
        integral(from, to, |places| speeds(piece, &self.linear, &self.counted, places))
    }

    /// Length to a few digits: only a scale.
    fn rough_length(&self, piece: &PolynomialPiece) -> f64 {
        let step = piece.parameter_end_ratio / 4.0;
        (0..4).map(|i| self.length_between(piece, f64::from(i) * step, f64::from(i + 1) * step)).sum()
    }

    /// Panels of a piece with their own lengths in `lengths_lu[1]`; `None` if they do not converge.
    fn piece_panels(&self, index: usize, rough_lu: f64, total_lu: f64) -> Option<Vec<Panel>> {
        let piece = &self.geometry.pieces[index];
        let end = piece.parameter_end_ratio;
        if !(total_lu.is_finite() && end > 0.0) {
            return None;
        }
        if total_lu < DISPLACEMENT_MIN_LU {
            return Some(Vec::new());
        }
        if rough_lu < DISPLACEMENT_MIN_LU {
            // Shorter than any motion. Where other axes move meanwhile, they would jump.
            return self.stands(piece).then(Vec::new);
        }
        let noise_lu = if is_plain(piece) { 0.0 } else { NOISE_RATIO * piece.numerator_lu[0].norm() };
        let floor_lu = noise_lu.max(FLOOR_RATIO * total_lu);
        let mean = rough_lu / end;
        let mut panels = self.cut(index, [0.0, end], floor_lu)?;
        let cusps = self.cusps(piece, &panels, mean);
        if !cusps.is_empty() {
            panels.clear();
            let borders: Vec<f64> = [0.0].into_iter().chain(cusps).chain([end]).collect();
            for range in borders.windows(2) {
                panels.append(&mut self.cut(index, [range[0], range[1]], floor_lu)?);
            }
        }
        self.keep_off_zeros(piece, &mut panels, mean);
        Some(panels)
    }

    /// No axis moves along the piece: the size of each coefficient bounds what its power adds.
    fn stands(&self, piece: &PolynomialPiece) -> bool {
        let mut power = 1.0;
        let mut travel = 0.0_f64;
        for coefficient in &piece.numerator_lu[1..] {
            power *= piece.parameter_end_ratio;
            travel += power * coefficient.masked(&self.counted.map(|counts| !counts)).norm();
        }
        travel < DISPLACEMENT_MIN_LU
    }

    /// Cuts a range of u until the quadrature has converged.
    fn cut(&self, index: usize, range: [f64; 2], floor_lu: f64) -> Option<Vec<Panel>> {
        let piece = &self.geometry.pieces[index];
        let mut panels = Vec::new();
        let mut waiting = vec![(range, self.length_between(piece, range[0], range[1]))];
        while let Some(([from, to], whole_lu)) = waiting.pop() {
            let middle = 0.5 * (from + to);
            let (left_lu, right_lu) =
                (self.length_between(piece, from, middle), self.length_between(piece, middle, to));
            let error_lu = (left_lu + right_lu - whole_lu).abs();
            if !error_lu.is_finite() || panels.len() + waiting.len() > PANELS_MAX {
                return None;
            }
            if error_lu > floor_lu.max(PANEL_ERROR_RATIO * (left_lu + right_lu)) {
                waiting.push(([middle, to], right_lu));
                waiting.push(([from, middle], left_lu));
                continue;
            }
            for (ends_ratio, own_lu) in [([from, middle], left_lu), ([middle, to], right_lu)] {
                let speeds_lu = ends_ratio.map(|u| self.speed(piece, u));
                let lengths_lu = [0.0, own_lu];
                panels.push(Panel {
                    piece: index,
                    ends_ratio,
                    lengths_lu,
                    error_lu: 0.5 * HALVINGS * error_lu,
                    speeds_lu,
                    safe_ratio: range,
                });
            }
        }
        Some(panels)
    }

    /// Parameters inside the piece where the speed is 0.
    fn cusps(&self, piece: &PolynomialPiece, panels: &[Panel], mean: f64) -> Vec<f64> {
        let mut cusps = Vec::new();
        for pair in panels.windows(2) {
            let [before, after] = [&pair[0], &pair[1]];
            let lowest = after.speeds_lu[0];
            if lowest > before.speeds_lu[0] || lowest > after.speeds_lu[1] || lowest > 0.5 * mean {
                continue;
            }
            let (mut low, mut high) = (before.ends_ratio[0], after.ends_ratio[1]);
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                let state = derivatives(piece, &self.linear, middle);
                if state.first.masked(&self.counted).dot(&state.second) < 0.0 { low = middle } else { high = middle }
            }
            let u = if self.speed(piece, low) < self.speed(piece, high) { low } else { high };
            if self.speed(piece, u) <= CUSP_SPEED_RATIO * mean {
                cusps.push(u);
            }
        }
        cusps.dedup();
        cusps.retain(|u| *u > 0.0 && *u < piece.parameter_end_ratio);
        cusps
    }

    /// Moves the places where derivatives are taken away from the zeros of the speed at the ends of the ranges.
    fn keep_off_zeros(&self, piece: &PolynomialPiece, panels: &mut [Panel], mean: f64) {
        let beside = |zero: f64, other: f64| {
            if self.speed(piece, zero) > CUSP_SPEED_RATIO * mean {
                return zero;
            }
            let mut distance = 0.5 * (other - zero);
            for _ in 0..BISECTIONS {
                if self.speed(piece, zero + 0.5 * distance) < SAFE_SPEED_RATIO * mean {
                    break;
                }
                distance *= 0.5;
            }
            zero + distance
        };
        for panel in panels {
            let [from, to] = panel.safe_ratio;
            panel.safe_ratio = [beside(from, to), beside(to, from)];
        }
    }
}

/// u by a cubic in s with the slopes 1/speed at the ends; linear where the slopes say nothing.
fn guess(panel: &Panel, s_lu: f64) -> f64 {
    let ([u0, u1], [l0, l1], [v0, v1]) = (panel.ends_ratio, panel.lengths_lu, panel.speeds_lu);
    let (width, rise) = (l1 - l0, u1 - u0);
    let t = (s_lu - l0) / width;
    let (m0, m1) = (width / v0, width / v1);
    let cubic = u0 + t * (m0 + t * (3.0 * rise - 2.0 * m0 - m1 + t * (m0 + m1 - 2.0 * rise)));
    // A cubic that leaves the panel, or is no number, is worse than a line.
    if cubic > u0 && cubic < u1 { cubic } else { u0 + t * rise }
}
