//! The published corner blend: a symmetric cubic Hermite curve (models/local-smoothing.md sections 1 and 2) [Essid 2019].
//!
//! In: corner P, unit directions U and V, transition length T, alpha. Out: [`HermiteBlend`], by arc length and by its own
//! parameter u in [0, 1].
//!
//! The curve lies in the plane of U and V. With the bisectors `e1 = (U+V)/|U+V|`, `e2 = (V-U)/|V-U|`, `c = cos(theta/2)`,
//! `s = sin(theta/2)` and `w = 2u - 1` the cubic of section 1 becomes
//!
//! ```text
//! S = P + T ( X(w) e1 + Y(w) e2 )
//! dX/dw = c (h + g w²) / 2,  dY/dw = alpha s w / 2,   g = 3 (alpha-2) / 2,  h = alpha - g = 3 - alpha/2
//! ```
//!
//! so that everything is odd or even in w, all shapes of one theta are the same but for the scale T, and
//! `|dS/du| = T sqrt(p0 + p1 w² + p2 w⁴)`. The arc length from the middle is an elliptic integral. Its integrand has its nearest
//! singularities at `w = ± i b`; the half domain is cut into panels whose width grows like `sqrt(b² + w²)`, so that eight Gauss nodes
//! a panel give the length to about 1e-13 for every corner that is rounded, and the same panels are the table from which s is
//! turned into w with one step of Halley's method.
//!
//! Does not decide T or whether there is a blend: that is the smoothing's.

use super::CurveState;
use super::quadrature::integral;
use crate::base::Portable;
use crate::base::{AxisId, AxisVector, PartPoint};

/// Panels in half of the parameter range.
const PANELS: usize = 8;

/// Below this |V-U| or |V+U| the bisectors are rounding errors.
const BISECTOR_MIN_RATIO: f64 = 1e-9;

/// An axis with less of both bisectors does not move: it is the rounding of the directions.
const DIRECTION_MIN_RATIO: f64 = 1e-12;

/// Corner rounded by a cubic Hermite curve.
#[derive(Clone, Debug, PartialEq)]
pub struct HermiteBlend {
    corner: PartPoint,
    start: PartPoint,
    end: PartPoint,
    along: AxisVector,
    inward: AxisVector,
    shape: Shape,
    transition_length_mm: f64,
    // Part of the arc length that this curve is: the whole, unless trimmed.
    offset_mm: f64,
    length_mm: f64,
}

/// The blend at one value of u (models/local-smoothing.md section 2), for limits along the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlendPoint {
    /// sigma = |dS/du|, mm per unit of u.
    pub sigma_mm: f64,
    /// d(sigma)/du.
    pub sigma_first_mm: f64,
    /// d²(sigma)/du².
    pub sigma_second_mm: f64,
    /// k, positive towards the inside of the corner (negative beyond the inflection that alpha > 3 has near the ends).
    pub curvature_per_mm: f64,
    /// dk/ds.
    pub curvature_slope_per_mm_mm: f64,
    /// Unit tangent.
    pub tangent: AxisVector,
    /// Unit normal towards the inside of the corner.
    pub normal: AxisVector,
}

impl HermiteBlend {
    /// Blend at `corner` from unit direction `incoming` to `outgoing`. `None` if there is no such curve: the directions are
    /// equal or opposite, T is not positive, or alpha is outside ]0, 4[.
    pub fn new(
        corner: PartPoint,
        incoming: &AxisVector,
        outgoing: &AxisVector,
        transition_length_mm: f64,
        alpha_ratio: f64,
    ) -> Option<Self> {
        let (sum, difference) = (*outgoing + *incoming, *outgoing - *incoming);
        let (twice_cos, twice_sin) = (sum.norm(), difference.norm());
        let bent = twice_cos > BISECTOR_MIN_RATIO && twice_sin > BISECTOR_MIN_RATIO;
        let sized = transition_length_mm > 0.0 && transition_length_mm.is_finite();
        if !(bent && sized && alpha_ratio > 0.0 && alpha_ratio < 4.0) {
            return None;
        }
        // Normalised together, so that cos² + sin² = 1 whatever the rounding of the directions.
        let scale = twice_cos.portable_hypot(twice_sin);
        let shape = Shape::new(twice_cos / scale, twice_sin / scale, alpha_ratio);
        Some(Self {
            corner,
            start: PartPoint(corner.0 + *incoming * -transition_length_mm),
            end: PartPoint(corner.0 + *outgoing * transition_length_mm),
            along: sum.map(|component| component / twice_cos),
            inward: difference.map(|component| component / twice_sin),
            transition_length_mm,
            offset_mm: 0.0,
            length_mm: 2.0 * shape.half_length() * transition_length_mm,
            shape,
        })
    }

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

    /// alpha.
    pub fn alpha_ratio(&self) -> f64 {
        self.shape.alpha_ratio
    }

    /// theta, the turning angle: 0 = straight.
    pub fn angle_rad(&self) -> f64 {
        2.0 * self.shape.sin_ratio.portable_atan2(self.shape.cos_ratio)
    }

    /// True for the axes that span the plane of the blend.
    pub fn moves(&self, axis: AxisId) -> bool {
        self.along[axis].abs().max(self.inward[axis].abs()) > DIRECTION_MIN_RATIO
    }

    /// The shape at u, clamped to [0, 1]; u counts over the whole blend, trimmed or not.
    pub fn shape(&self, u: f64) -> BlendPoint {
        let plane = self.shape.at(w_from_u(u));
        let t = self.transition_length_mm;
        // d/du = 2 d/dw; sigma'' = (S''.S'' + S'.S''' - sigma'²) / sigma, models/local-smoothing.md section 2.
        let PlanePoint { sigma_ratio: sigma_w, first: d1, second: d2, third: d3, .. } = plane;
        let sigma_ww = dot(d1, d2) / sigma_w;
        let sigma_www = (dot(d2, d2) + dot(d1, d3) - sigma_ww * sigma_ww) / sigma_w;
        let tangent = [d1[0] / sigma_w, d1[1] / sigma_w];
        BlendPoint {
            sigma_mm: 2.0 * t * sigma_w,
            sigma_first_mm: 4.0 * t * sigma_ww,
            sigma_second_mm: 8.0 * t * sigma_www,
            curvature_per_mm: plane.curvature() / t,
            curvature_slope_per_mm_mm: plane.curvature_slope() / (t * t),
            tangent: self.in_space(tangent),
            normal: self.in_space([-tangent[1], tangent[0]]),
        }
    }

    /// u at arc length s from the start of this curve.
    pub fn u_at(&self, s_lu: f64) -> f64 {
        0.5 * (self.parameter_at(s_lu.max(0.0).min(self.length_mm)) + 1.0)
    }

    /// Arc length from the start of this curve at u; negative or beyond the length outside a trimmed part.
    pub fn arc_length_at_u_lu(&self, u: f64) -> f64 {
        let w = w_from_u(u);
        (self.shape.half_length() + self.shape.length_to(w)) * self.transition_length_mm - self.offset_mm
    }

    /// The blend at s, clamped to its ends.
    pub fn at(&self, s_lu: f64) -> CurveState {
        let s_lu = s_lu.max(0.0).min(self.length_mm);
        let w = self.parameter_at(s_lu);
        let plane = self.shape.at(w);
        let t = self.transition_length_mm;
        let position = if s_lu >= self.length_mm {
            self.end
        } else if s_lu > 0.0 {
            let [x, y] = plane.position;
            PartPoint(self.corner.0 + self.in_space([t * x, t * y]))
        } else {
            self.start
        };
        // Frenet in the plane: r' = t, r'' = k n, r''' = k' n - k² t.
        let [x, y] = [plane.first[0] / plane.sigma_ratio, plane.first[1] / plane.sigma_ratio];
        let k = plane.curvature() / t;
        let slope = plane.curvature_slope() / (t * t);
        CurveState {
            position,
            first: self.in_space([x, y]),
            second: self.in_space([-k * y, k * x]),
            third: self.in_space([-slope * y - k * k * x, slope * x - k * k * y]),
        }
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
    fn parameter_at(&self, s_mm: f64) -> f64 {
        let from_middle = (self.offset_mm + s_mm) / self.transition_length_mm - self.shape.half_length();
        self.shape.parameter_at_length(from_middle)
    }

    fn in_space(&self, [along, inward]: [f64; 2]) -> AxisVector {
        self.along * along + self.inward * inward
    }
}

/// Everything that depends on theta and alpha only: the blend with T = 1 in the plane (e1, e2), corner at the origin.
#[derive(Clone, Debug, PartialEq)]
struct Shape {
    /// c and s of the module's head.
    cos_ratio: f64,
    sin_ratio: f64,
    alpha_ratio: f64,
    /// Ends of the panels in w, from 0 to 1.
    nodes: [f64; PANELS + 1],
    /// Arc length from the middle to each node.
    lengths: [f64; PANELS + 1],
}

/// A point of the shape; derivatives to w.
struct PlanePoint {
    sigma_ratio: f64,
    position: [f64; 2],
    first: [f64; 2],
    second: [f64; 2],
    third: [f64; 2],
}

impl Shape {
    fn new(cos_ratio: f64, sin_ratio: f64, alpha_ratio: f64) -> Self {
        let (nodes, lengths) = ([0.0; PANELS + 1], [0.0; PANELS + 1]);
        let mut shape = Self { cos_ratio, sin_ratio, alpha_ratio, nodes, lengths };
        let [p0, p1, p2] = shape.speed_squared();
        // b² is the smaller root of p0 - p1 b² + p2 b⁴; alpha < 2 may have complex roots, far away. The clamp only keeps the
        // table finite for corners that nobody rounds.
        let discriminant = (p1 * p1 - 4.0 * p0 * p2).max(0.0);
        let b = (2.0 * p0 / (p1.abs() + discriminant.sqrt())).sqrt().clamp(1e-6, 1e3);
        let tau_end = (1.0 / b).portable_asinh();
        for i in 1..=PANELS {
            let node = if i == PANELS { 1.0 } else { b * (tau_end * i as f64 / PANELS as f64).portable_sinh() };
            shape.nodes[i] = node;
            shape.lengths[i] = shape.lengths[i - 1] + shape.length_between(shape.nodes[i - 1], node);
        }
        shape
    }

    /// g and h of the module's head.
    fn bend(&self) -> (f64, f64) {
        (1.5 * (self.alpha_ratio - 2.0), 3.0 - 0.5 * self.alpha_ratio)
    }

    /// p0, p1, p2: |dS/du|² = p0 + p1 w² + p2 w⁴.
    fn speed_squared(&self) -> [f64; 3] {
        let (g, h) = self.bend();
        let (c, s, alpha) = (self.cos_ratio, self.sin_ratio, self.alpha_ratio);
        [c * c * h * h, 2.0 * c * c * h * g + alpha * alpha * s * s, c * c * g * g]
    }

    fn length_between(&self, from_ratio: f64, to_ratio: f64) -> f64 {
        let [p0, p1, p2] = self.speed_squared();
        0.5 * integral(from_ratio, to_ratio, |places| {
            places.map(|w| {
                let ww = w * w;
                (p0 + ww * (p1 + ww * p2)).max(0.0).sqrt()
            })
        })
    }

    fn half_length(&self) -> f64 {
        self.lengths[PANELS]
    }

    /// Signed arc length from the middle to w.
    fn length_to(&self, w_ratio: f64) -> f64 {
        let w = w_ratio.abs();
        let panel = self.nodes[1..PANELS].iter().filter(|node| **node < w).count();
        (self.lengths[panel] + self.length_between(self.nodes[panel], w)).copysign(w_ratio)
    }

    /// w at a signed arc length from the middle.
    fn parameter_at_length(&self, length_ratio: f64) -> f64 {
        let target = length_ratio.abs();
        if target >= self.half_length() {
            return 1.0_f64.copysign(length_ratio);
        }
        let panel = self.lengths[1..PANELS].iter().filter(|end| **end < target).count();
        let (w0, w1) = (self.nodes[panel], self.nodes[panel + 1]);
        let (l0, l1) = (self.lengths[panel], self.lengths[panel + 1]);
        let [p0, p1, p2] = self.speed_squared();
        // dl/dw.
        let speed = |w: f64| 0.5 * (p0 + w * w * (p1 + w * w * p2)).max(0.0).sqrt();
        let mut w = cubic_at([l0, l1], [w0, w1], [1.0 / speed(w0), 1.0 / speed(w1)], target);
        // The guess is good to about 1e-4 of the panel and Halley's step cubes that: the loop is for the sharpest corners.
        for _ in 0..4 {
            w = w.max(w0).min(w1);
            let (node, base) = if w - w0 < w1 - w { (w0, l0) } else { (w1, l1) };
            let error = base + self.length_between(node, w) - target;
            let d1 = speed(w);
            let d2 = 0.25 * w * (p1 + 2.0 * p2 * w * w) / d1;
            let newton = error / d1;
            let step = newton / (1.0 - 0.5 * newton * d2 / d1);
            w -= step;
            if step.abs() <= 1e-5 * (w1 - w0) {
                break;
            }
        }
        w.max(w0).min(w1).copysign(length_ratio)
    }

    fn at(&self, w_ratio: f64) -> PlanePoint {
        let (g, h) = self.bend();
        let (c, s, alpha, w) = (self.cos_ratio, self.sin_ratio, self.alpha_ratio, w_ratio);
        let first = [0.5 * c * (h + g * w * w), 0.5 * alpha * s * w];
        PlanePoint {
            sigma_ratio: dot(first, first).sqrt(),
            // X is odd: 0 in the middle and c at the end. Y is s at the ends and (4 - alpha) s / 4 in the middle.
            position: [0.5 * c * w * (h + g * w * w / 3.0), s * (1.0 + 0.25 * alpha * (w * w - 1.0))],
            first,
            second: [c * g * w, 0.5 * alpha * s],
            third: [c * g, 0.0],
        }
    }
}

impl PlanePoint {
    fn curvature(&self) -> f64 {
        cross(self.first, self.second) / (self.sigma_ratio * self.sigma_ratio * self.sigma_ratio)
    }

    /// dk/ds = (N' - 3 N (r'.r'')/sigma²) / sigma⁴ with N = r' x r''.
    fn curvature_slope(&self) -> f64 {
        let squared = self.sigma_ratio * self.sigma_ratio;
        let turning = cross(self.first, self.second) * dot(self.first, self.second) / squared;
        (cross(self.first, self.third) - 3.0 * turning) / (squared * squared)
    }
}

/// w of u clamped to [0, 1]; a NaN counts as 0.
fn w_from_u(u_ratio: f64) -> f64 {
    if u_ratio > 0.0 { 2.0 * u_ratio.min(1.0) - 1.0 } else { -1.0 }
}

/// Cubic through two points (x, y) with slopes, at `at_ratio`.
fn cubic_at(x: [f64; 2], y: [f64; 2], slope: [f64; 2], at_ratio: f64) -> f64 {
    let width = x[1] - x[0];
    let t = (at_ratio - x[0]) / width;
    let (rise, m0, m1) = (y[1] - y[0], slope[0] * width, slope[1] * width);
    y[0] + t * (m0 + t * (3.0 * rise - 2.0 * m0 - m1 + t * (m0 + m1 - 2.0 * rise)))
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
