//! The curvature-continuous corner blend: its direction turns as a polynomial of degree 5 of the arc length.
//!
//! In: directions U and V (unit length over the linear axes, rotary axes along), corner P, transition length T. Out:
//! [`QuinticShape`] (what depends on the directions alone) and [`QuinticBlend`], by arc length.
//!
//! The published cubic steps in curvature at its ends; this one has curvature 0 and dk/ds = 0 there. In the plane of U and V, with
//! the bisectors `e1 = (U+V)/|U+V|`, `e2 = (V-U)/|V-U|`, `h = theta/2`, `c = cos h`, `s = sin h`, half the length L and
//! `w = s/L - 1` in [-1, 1]:
//!
//! ```text
//! phi(w) = h (15 w - 10 w³ + 3 w⁵)/8      angle of the direction against e1, from -h to h
//! k(w)   = 15/8 h (1 - w²)²/L             curvature,   dk/ds = -15/2 h w (1 - w²)/L²
//! q      = P + (T s + L y(w)) e2 + L x(w) e1,   x = ∫_0 cos phi dw,   y = ∫_1 sin phi dw
//! ```
//!
//! The parameter is the arc length by construction: |q'| = 1 without any inversion. That both ends lie on the lines at distance T
//! from P asks for `L = T c/x(1)`, and the distance of the middle from P, which is the greatest deviation, is
//!
//! ```text
//! eps = T D(theta),   D = s - c ∫_0^1 sin phi dw / ∫_0^1 cos phi dw   (5/16 sin h for small angles; 1 at 180 deg)
//! ```
//!
//! so that T = eps/D. x and y are entire functions of w, odd and even; their Chebyshev series ([`TIERS`]) give positions to 1e-14 L.
//! Rotary axes are the same combination of e1 and e2 as the plane: they leave and meet their lines with all derivatives continuous.
//!
//! Does not decide T or whether there is a blend: that is the smoothing's.

use super::CurveState;
use crate::base::Portable;
use crate::base::{AxisVector, PartPoint, PerAxis};
use std::f64::consts::FRAC_PI_2;
use std::sync::{Arc, LazyLock};

/// Below this |V-U| or |V+U| the bisectors are rounding errors.
const BISECTOR_MIN_RATIO: f64 = 1e-9;

/// Intervals between samples of the derivatives.
const BEND_SAMPLES: usize = 24;

/// Chebyshev terms, powers of h², and the greatest h for which so many leave less than 1e-15.
const TIERS: [(usize, usize, f64); 5] =
    [(9, 4, 0.015), (11, 5, 0.05), (13, 6, 0.15), (16, 8, 0.5), (TERMS_MAX, POWERS_MAX, FRAC_PI_2)];
const TERMS_MAX: usize = 20;
const POWERS_MAX: usize = 11;

/// Chebyshev nodes for (phi/h)^21: the table is exact.
const NODES: usize = 64;

/// Coefficients of the series of x and y to powers of h².
static TABLE: LazyLock<Vec<Series>> = LazyLock::new(table);

/// Everything about a corner's blend but its place and size.
#[derive(Clone, Debug, PartialEq)]
pub struct QuinticShape {
    incoming: AxisVector,
    outgoing: AxisVector,
    along: AxisVector,
    inward: AxisVector,
    half_angle_rad: f64,
    /// L over T.
    length_ratio: f64,
    /// s of the module's head.
    sin_ratio: f64,
    series: Arc<Series>,
}

/// Corner rounded without a step of curvature.
#[derive(Clone, Debug, PartialEq)]
pub struct QuinticBlend {
    corner: PartPoint,
    start: PartPoint,
    end: PartPoint,
    along: AxisVector,
    inward: AxisVector,
    half_angle_rad: f64,
    transition_length_mm: f64,
    /// L of the module's head.
    half_length_mm: f64,
    /// T s.
    inset_mm: f64,
    series: Arc<Series>,
    // Part of the arc length that this curve is: the whole, unless trimmed.
    offset_mm: f64,
    length_mm: f64,
}

impl QuinticShape {
    /// Blend from direction `incoming` to `outgoing`; `linear` says which axes count as path length. `None` if there is no such
    /// curve: the directions of the linear axes are equal or opposite, or no numbers.
    pub fn new(incoming: &AxisVector, outgoing: &AxisVector, linear: &PerAxis<bool>) -> Option<Self> {
        let (sum, difference) = (*outgoing + *incoming, *outgoing - *incoming);
        let [twice_cos, twice_sin] = [sum, difference].map(|vector| vector.masked(linear).norm());
        let bent = twice_cos > BISECTOR_MIN_RATIO && twice_sin > BISECTOR_MIN_RATIO;
        if !(bent && twice_cos.is_finite() && twice_sin.is_finite()) {
            return None;
        }
        let half_angle_rad = twice_sin.portable_atan2(twice_cos);
        let series = Series::new(half_angle_rad);
        let (sin, cos) = half_angle_rad.portable_sin_cos();
        Some(Self {
            incoming: *incoming,
            outgoing: *outgoing,
            along: sum * (1.0 / twice_cos),
            inward: difference * (1.0 / twice_sin),
            half_angle_rad,
            length_ratio: cos / series.at(1.0)[0],
            sin_ratio: sin,
            series: Arc::new(series),
        })
    }

    /// D: distance of the middle from the corner over T.
    pub fn deviation_ratio(&self) -> f64 {
        self.sin_ratio + self.length_ratio * self.series.at(0.0)[1]
    }

    /// The direction in which the middle lies from the corner: unit length over the linear axes.
    pub fn inward(&self) -> &AxisVector {
        &self.inward
    }

    /// Greatest |d²q/ds²| and |d³q/ds³| of every axis for T = 1; they fall with T and with T². Sampled: what is missed between samples
    /// is below 1 % of them.
    pub fn greatest_bends(&self) -> [AxisVector; 2] {
        let mut greatest = [AxisVector::zero(); 2];
        let Some(unit) = self.blend(PartPoint::default(), 1.0) else { return greatest };
        for i in 1..BEND_SAMPLES {
            let [_, second, third] = unit.derivatives_at(unit.length_lu() * i as f64 / BEND_SAMPLES as f64);
            for (most, found) in greatest.iter_mut().zip([second, third]) {
                for (most, found) in most.as_mut_slice().iter_mut().zip(found.as_slice()) {
                    *most = most.max(found.abs());
                }
            }
        }
        greatest
    }

    /// The blend of this shape at a place, of a size. `None` if T is not positive.
    pub fn blend(&self, corner: PartPoint, transition_length_mm: f64) -> Option<QuinticBlend> {
        if !(transition_length_mm > 0.0 && transition_length_mm.is_finite()) {
            return None;
        }
        let half_length_mm = self.length_ratio * transition_length_mm;
        Some(QuinticBlend {
            corner,
            start: PartPoint(corner.0 + self.incoming * -transition_length_mm),
            end: PartPoint(corner.0 + self.outgoing * transition_length_mm),
            along: self.along,
            inward: self.inward,
            half_angle_rad: self.half_angle_rad,
            transition_length_mm,
            half_length_mm,
            inset_mm: self.sin_ratio * transition_length_mm,
            series: self.series.clone(),
            offset_mm: 0.0,
            length_mm: 2.0 * half_length_mm,
        })
    }
}

impl QuinticBlend {
    /// The same blend with its first point moved by a rounding error, to meet a neighbour to the last bit.
    pub(crate) fn starting_at(mut self, start: PartPoint) -> Self {
        self.start = start;
        self
    }

    /// Arc length.
    pub fn length_lu(&self) -> f64 {
        self.length_mm
    }

    /// First point.
    pub fn start(&self) -> PartPoint {
        self.start
    }

    /// Last point.
    pub fn end(&self) -> PartPoint {
        self.end
    }

    /// P, the programmed corner.
    pub fn corner(&self) -> PartPoint {
        self.corner
    }

    /// T, the distance from the corner at which the blend begins and ends.
    pub fn transition_length_mm(&self) -> f64 {
        self.transition_length_mm
    }

    /// theta, the turning angle: 0 = straight.
    pub fn angle_rad(&self) -> f64 {
        2.0 * self.half_angle_rad
    }

    /// The blend at s, clamped to its ends.
    pub fn at(&self, s_lu: f64) -> CurveState {
        let s_lu = s_lu.max(0.0).min(self.length_mm);
        let position = if s_lu >= self.length_mm {
            self.end
        } else if s_lu > 0.0 {
            let [x, y] = self.series.at(self.place(s_lu));
            let in_plane = [self.half_length_mm * x, self.inset_mm + self.half_length_mm * y];
            PartPoint(self.corner.0 + self.in_space(in_plane))
        } else {
            self.start
        };
        let [first, second, third] = self.derivatives_at(s_lu);
        CurveState { position, first, second, third }
    }

    /// dq/ds, d²q/ds² and d³q/ds³ at s, clamped to the ends.
    pub fn derivatives_at(&self, s_lu: f64) -> [AxisVector; 3] {
        let w = self.place(s_lu.max(0.0).min(self.length_mm));
        let (h, l) = (self.half_angle_rad, self.half_length_mm);
        let (ww, hollow) = (w * w, 1.0 - w * w);
        let (sin, cos) = turned_rad(h, w).portable_sin_cos();
        let k = 1.875 * h * hollow * hollow / l;
        let slope = -7.5 * h * w * (1.0 - ww) / (l * l);
        // Frenet in the plane: r' = t, r'' = k n, r''' = k' n - k² t.
        [
            self.in_space([cos, sin]),
            self.in_space([-k * sin, k * cos]),
            self.in_space([-slope * sin - k * k * cos, slope * cos - k * k * sin]),
        ]
    }

    /// The part from `start_lu` to `end_lu`, both inside the curve and in order.
    pub(super) fn trimmed(&self, start_lu: f64, end_lu: f64) -> Self {
        let mut part = self.clone();
        part.start = self.at(start_lu).position;
        part.end = self.at(end_lu).position;
        part.offset_mm = self.offset_mm + start_lu;
        part.length_mm = end_lu - start_lu;
        part
    }

    /// w at an arc length inside this curve.
    fn place(&self, s_mm: f64) -> f64 {
        ((self.offset_mm + s_mm) / self.half_length_mm - 1.0).clamp(-1.0, 1.0)
    }

    fn in_space(&self, [along, inward]: [f64; 2]) -> AxisVector {
        self.along * along + self.inward * inward
    }
}

/// phi of the module's head.
fn turned_rad(half_angle_rad: f64, w_ratio: f64) -> f64 {
    let ww = w_ratio * w_ratio;
    half_angle_rad * w_ratio * (1.875 + ww * (-1.25 + 0.375 * ww))
}

/// x and y of the module's head as Chebyshev series: x over T1, T3, T5 ..., y over T0, T2, T4 ...
#[derive(Clone, Debug, PartialEq)]
struct Series {
    terms: usize,
    x: [f64; TERMS_MAX + 1],
    y: [f64; TERMS_MAX + 1],
}

impl Series {
    fn new(half_angle_rad: f64) -> Self {
        let fits = |(.., reach_rad): &&(usize, usize, f64)| half_angle_rad <= *reach_rad;
        let (terms, powers, _) = *TIERS.iter().find(fits).unwrap_or(&TIERS[TIERS.len() - 1]);
        let mut series = Self { terms, x: [0.0; TERMS_MAX + 1], y: [0.0; TERMS_MAX + 1] };
        let square = -half_angle_rad * half_angle_rad;
        for power in TABLE[..powers].iter().rev() {
            for m in 0..=TERMS_MAX {
                series.x[m] = series.x[m] * square + power.x[m];
                series.y[m] = series.y[m] * square + power.y[m];
            }
        }
        series.y = series.y.map(|y| y * half_angle_rad);
        // y(1) = 0, where every T is 1; the small ones first.
        series.y[0] = -series.y[1..=terms].iter().rev().sum::<f64>();
        series
    }

    /// x and y at w, by Clenshaw's recurrence in T2(w).
    fn at(&self, w_ratio: f64) -> [f64; 2] {
        let t = 2.0 * w_ratio * w_ratio - 1.0;
        let twice = 2.0 * t;
        let [mut x1, mut x2, mut y1, mut y2] = [0.0; 4];
        for (x, y) in self.x.iter().zip(&self.y).take(self.terms + 1).skip(1).rev() {
            (x1, x2) = ((x - x2) + twice * x1, x1);
            (y1, y2) = ((y - y2) + twice * y1, y1);
        }
        let x0 = (self.x[0] - x2) + twice * x1;
        [w_ratio * (x0 - x1), (self.y[0] - y2) + t * y1]
    }
}

/// Of `cos phi = sum (-h²)^k p^2k/(2k)!` and `sin phi = h sum (-h²)^k p^(2k+1)/(2k+1)!`, p = phi/h, the integrals of every k.
fn table() -> Vec<Series> {
    let nodes: Vec<f64> = (0..NODES).map(|j| (j as f64 + 0.5) * FRAC_PI_2 / NODES as f64).collect();
    let turned: Vec<f64> = nodes.iter().map(|angle_rad| turned_rad(1.0, angle_rad.portable_cos())).collect();
    // Coefficient of T(degree) of the power of p.
    let coefficient = |power: i32, degree: usize| {
        let weight = if degree == 0 { 1.0 } else { 2.0 } / NODES as f64;
        let value = |(angle_rad, p): (&f64, &f64)| p.powi(power) * (degree as f64 * angle_rad).portable_cos();
        weight * nodes.iter().zip(&turned).map(value).sum::<f64>()
    };
    let mut factorial = 1.0;
    let mut table = Vec::with_capacity(POWERS_MAX);
    for k in 0..POWERS_MAX {
        let mut series = Series { terms: TERMS_MAX, x: [0.0; TERMS_MAX + 1], y: [0.0; TERMS_MAX + 1] };
        let even: Vec<f64> = (0..=TERMS_MAX + 1).map(|m| coefficient(2 * k as i32, 2 * m)).collect();
        let odd: Vec<f64> = (0..=TERMS_MAX).map(|m| coefficient(2 * k as i32 + 1, 2 * m + 1)).collect();
        let next = factorial * (2 * k + 1) as f64;
        // Integrals: of T2m it is T(2m+1)/(4m+2) - T(2m-1)/(4m-2), of T(2m+1) it is T(2m+2)/(4m+4) - T2m/4m.
        for m in 0..=TERMS_MAX {
            series.x[m] = (even[m] - even[m + 1]) / (4 * m + 2) as f64 / factorial;
        }
        series.x[0] += 0.5 * even[0] / factorial;
        for m in 1..=TERMS_MAX {
            series.y[m] = (odd[m - 1] - odd[m]) / (4 * m) as f64 / next;
        }
        factorial = next * (2 * k + 2) as f64;
        table.push(series);
    }
    table
}
