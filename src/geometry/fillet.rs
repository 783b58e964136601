//! The corner between two arcs and the arc that rounds it (models/arcs.md sections 2 and 3) [Gassara 2013].
//!
//! In: two arcs of one plane that meet in the corner D ([`ArcCorner`]), and the largest distance `eps` between D and the rounded path,
//! or the radius `R_c` of the rounding. Out: [`Fillet`]: its circle, where it touches both arcs, its angle, the other one of `eps` and
//! `R_c`, and TIT, the distance that the rounding of the control (G641 ADIS) would need. An arc without bend is a line.
//!
//! With `p` from D to the centre of the fillet, `m_i` the unit normals of the two arcs at D on the inner side of the turn, and `sigma_i`
//! = 1 for an arc of the fillet's sense (contact inside), -1 for the other sense (contact outside), the three conditions of section 3,
//!
//! ```text
//! |O_c - O_i| = R_i - sigma_i R_c,  |p| = R_c + eps,   become with   w = |p|² - R_c²
//! p . m_i = R_c + sigma_i w / (2 R_i)
//! ```
//!
//! so that `p = R_c a + w b` with vectors a and b that depend on the corner alone. Put into `|p|² = R_c² + w` (R_c given) or into
//! `|p| = R_c + eps` (eps given) that is a quadratic equation: the root that goes to D with R_c is the intersection nearer to D.
//! Holds for every pair of senses and either turn; the printed systems hold for a right turn after a left-hand arc only.
//!
//! The second published row, at 1.29 mm from the corner:
//!
//! ```
//! use sollwert::geometry::{ArcCorner, PlaneArc, Sense::CounterClockwise};
//!
//! let before = PlaneArc::new([10.0, 20.0], [67.85, 20.0], 45.0, CounterClockwise)?;
//! let after = PlaneArc::new([67.85, 20.0], [143.81, 6.6], 60.0, CounterClockwise)?;
//! let fillet = ArcCorner::new(before, after)?.fillet_with_deviation(1.29)?;
//! assert!((fillet.radius_mm - 3.47).abs() < 0.005 && !fillet.is_rounding_distance());
//! # Ok::<(), sollwert::geometry::NoFillet>(())
//! ```
//!
//! Does not plan speed and does not change a program: `RND` with the radius found here puts the arc into it.

use crate::base::Portable;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Directions that differ by less are one direction: suits points rounded to 0.01 mm (models/arcs.md section 2).
const TANGENT_RAD: f64 = 1e-3;

/// Nearer than this to a half turn the corner is a cusp.
const CUSP_RAD: f64 = 1e-6;

/// A rounding that needs at most this distance may be left to the control (models/arcs.md section 3).
pub const ROUNDING_DISTANCE_MAX_MM: f64 = 0.5;

/// Ends that are nearer than the last digit of a program are one point.
const SAME_POINT_MM: f64 = 0.01;

/// A chord longer than the diameter by this factor is a rounding error.
const SAME_LENGTH_RATIO: f64 = 1.0 + 1e-12;

/// Largest radius of a fillet, in lengths of the corner: beyond it the fillet is straight.
const RADIUS_MAX_RATIO: f64 = 1e6;

/// A fillet inside an arc is smaller than the arc by this share of it: of two equal circles nobody knows where they touch.
const INSIDE_MIN_RATIO: f64 = 1e-6;

/// Halvings of an interval of radii: its ends then agree to the last digits.
const HALVINGS: usize = 60;

/// A deviation that its radius gives back to this is met: the other root of the equation gives another one.
const SAME_DEVIATION_RATIO: f64 = 1e-3;

/// A point or direction in the plane of the arcs.
type Plane = [f64; 2];

/// Sense in which an arc is driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sense {
    /// To the left, G3.
    CounterClockwise,
    /// To the right, G2.
    Clockwise,
}

/// An arc of at most half a turn, from a point to a point; with an infinite radius a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneArc {
    start_mm: Plane,
    end_mm: Plane,
    radius_mm: f64,
    sense: Sense,
    angle_rad: f64,
    length_mm: f64,
}

/// Two arcs that meet in D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArcCorner {
    before: PlaneArc,
    after: PlaneArc,
    turn_rad: f64,
    fillet_sense: Sense,
    inward: [Plane; 2],
    // a and b of the module's head.
    per_radius: Plane,
    per_power_mm: Plane,
}

/// What kind of junction two arcs make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Junction {
    /// One direction: only the curvature may jump.
    Tangential,
    /// To be rounded.
    Corner,
    /// The path turns back: there is no fillet.
    Cusp,
}

/// The arc that rounds a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fillet {
    /// O_c.
    pub centre_mm: [f64; 2],
    /// R_c.
    pub radius_mm: f64,
    /// Its sense.
    pub sense: Sense,
    /// eps, the distance between D and the fillet.
    pub deviation_mm: f64,
    /// M and N, where it touches the first arc and the second.
    pub contacts_mm: [[f64; 2]; 2],
    /// What it takes of the end of the first arc and of the start of the second, along them.
    pub taken_mm: [f64; 2],
    /// theta_c; not exactly the turn of the corner, because the arcs bend.
    pub angle_rad: f64,
    /// TIT, from the intersection of the tangents at M and N to either.
    pub rounding_distance_mm: f64,
}

/// Why there is no such arc or fillet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoFillet {
    /// Start and end of an arc are one point, or a number is none.
    NoChord,
    /// The radius is not positive, or less than half of the chord.
    ChordTooLong {
        /// The chord.
        chord_mm: f64,
        /// 2 R.
        diameter_mm: f64,
    },
    /// The second arc does not start where the first ends.
    Apart {
        /// The gap.
        apart_mm: f64,
    },
    /// The junction is tangential: there is nothing to round.
    Tangential,
    /// The path turns back.
    Cusp,
    /// A deviation or radius that is not positive.
    NotPositive,
    /// The fillet would touch an arc beyond its end, or not at all.
    TooLarge {
        /// The largest that does.
        largest: Fillet,
    },
    /// The arcs are too short for any fillet that numbers can express.
    NoRoom,
}

impl Sense {
    /// s: +1 to the left, -1 to the right.
    pub fn sign(self) -> f64 {
        match self {
            Self::CounterClockwise => 1.0,
            Self::Clockwise => -1.0,
        }
    }

    fn of(sign: f64) -> Self {
        if sign < 0.0 { Self::Clockwise } else { Self::CounterClockwise }
    }
}

impl PlaneArc {
    /// The minor arc between two points (mm). An infinite radius makes a line, whatever the sense.
    pub fn new(start_mm: [f64; 2], end_mm: [f64; 2], radius_mm: f64, sense: Sense) -> Result<Self, NoFillet> {
        let chord_mm = length(minus(end_mm, start_mm));
        if !(chord_mm > 0.0 && chord_mm.is_finite()) {
            return Err(NoFillet::NoChord);
        }
        let diameter_mm = 2.0 * radius_mm;
        if chord_mm > diameter_mm * SAME_LENGTH_RATIO || diameter_mm.is_nan() {
            return Err(NoFillet::ChordTooLong { chord_mm, diameter_mm });
        }
        let half_sine = (chord_mm / diameter_mm).min(1.0);
        let angle_rad = 2.0 * half_sine.portable_asin();
        let length_mm = if radius_mm.is_finite() { radius_mm * angle_rad } else { chord_mm };
        Ok(Self { start_mm, end_mm, radius_mm, sense, angle_rad, length_mm })
    }

    /// theta, at most pi; 0 for a line.
    pub fn angle_rad(&self) -> f64 {
        self.angle_rad
    }

    /// R theta.
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// 1/R with the sense: positive to the left.
    pub fn signed_curvature_per_mm(&self) -> f64 {
        self.sense.sign() / self.radius_mm
    }

    /// Direction of the path at the start: chord - s theta/2.
    pub fn direction_start_rad(&self) -> f64 {
        self.chord_rad() - self.sense.sign() * self.angle_rad / 2.0
    }

    /// Direction of the path at the end: chord + s theta/2.
    pub fn direction_end_rad(&self) -> f64 {
        self.chord_rad() + self.sense.sign() * self.angle_rad / 2.0
    }

    /// How much two fillets at its ends take more than there is; `None` where both fit. They are not to be trimmed past each other: the
    /// deviation of one has to be less.
    pub fn overlap_mm(&self, at_start: &Fillet, at_end: &Fillet) -> Option<f64> {
        let over_mm = at_start.taken_mm[1] + at_end.taken_mm[0] - self.length_mm;
        (over_mm > 0.0).then_some(over_mm)
    }

    fn chord_rad(&self) -> f64 {
        let [x, y] = minus(self.end_mm, self.start_mm);
        y.portable_atan2(x)
    }
}

impl ArcCorner {
    /// Two arcs, the second of which starts where the first ends.
    pub fn new(before: PlaneArc, after: PlaneArc) -> Result<Self, NoFillet> {
        let apart_mm = length(minus(after.start_mm, before.end_mm));
        if apart_mm > SAME_POINT_MM {
            return Err(NoFillet::Apart { apart_mm });
        }
        let (in_rad, out_rad) = (before.direction_end_rad(), after.direction_start_rad());
        let turn_rad = wrapped(in_rad - out_rad);
        let fillet_sense = Sense::of(-turn_rad);
        let side = fillet_sense.sign();
        let inward = [in_rad, out_rad].map(|direction_rad| times(unit(direction_rad + FRAC_PI_2), side));
        // a . m_1 = a . m_2 = 1, b . m_i = sigma_i / (2 R_i).
        let bends = [before, after].map(|arc| side * arc.signed_curvature_per_mm() / 2.0);
        let per_radius = solved(inward, [1.0, 1.0]);
        let per_power_mm = solved(inward, bends);
        Ok(Self { before, after, turn_rad, fillet_sense, inward, per_radius, per_power_mm })
    }

    /// gamma, from the direction that leaves D to the one that reaches it, in ]-pi, pi]: positive where the path turns right.
    pub fn orientation_rad(&self) -> f64 {
        self.turn_rad
    }

    /// What kind of junction it is.
    pub fn junction(&self) -> Junction {
        let turn_rad = self.turn_rad.abs();
        if turn_rad < TANGENT_RAD {
            Junction::Tangential
        } else if turn_rad > PI - CUSP_RAD {
            Junction::Cusp
        } else {
            Junction::Corner
        }
    }

    /// The fillet at the distance `eps` of D.
    pub fn fillet_with_deviation(&self, deviation_mm: f64) -> Result<Fillet, NoFillet> {
        self.check(deviation_mm)?;
        let eps = deviation_mm;
        // p = R_c u + v in |p|² = (R_c + eps)².
        let u = plus(self.per_radius, times(self.per_power_mm, 2.0 * eps));
        let v = times(self.per_power_mm, eps * eps);
        let (a, b, c) = (dot(u, u) - 1.0, eps - dot(u, v), eps * eps - dot(v, v));
        let radius_mm = (b + (b * b + a * c).sqrt()) / a;
        // No root, or one that belongs to the intersection farther from D: the deviation is beyond all that fit.
        let fillet = self.touching(radius_mm);
        let met = fillet.filter(|fillet| (fillet.deviation_mm - eps).abs() <= SAME_DEVIATION_RATIO * eps);
        met.map(|fillet| Fillet { deviation_mm, ..fillet }).ok_or_else(|| self.too_large())
    }

    /// The fillet of the radius `R_c`.
    pub fn fillet_with_radius(&self, radius_mm: f64) -> Result<Fillet, NoFillet> {
        self.check(radius_mm)?;
        self.touching(radius_mm).ok_or_else(|| self.too_large())
    }

    /// The largest fillet that touches both arcs between their ends; one that is nearly straight counts as the largest.
    pub fn largest_fillet(&self) -> Result<Fillet, NoFillet> {
        self.check(1.0)?;
        let size_mm = self.before.length_mm.min(self.after.length_mm);
        let mut largest = None;
        let (mut low_mm, mut high_mm) = (0.0, size_mm);
        while let Some(fillet) = self.touching(high_mm).filter(|_| high_mm < RADIUS_MAX_RATIO * size_mm) {
            largest = Some(fillet);
            (low_mm, high_mm) = (high_mm, 2.0 * high_mm);
        }
        for _ in 0..HALVINGS {
            let middle_mm = 0.5 * (low_mm + high_mm);
            match self.touching(middle_mm) {
                Some(fillet) => {
                    largest = Some(fillet);
                    low_mm = middle_mm;
                }
                None => high_mm = middle_mm,
            }
        }
        largest.ok_or(NoFillet::NoRoom)
    }

    fn too_large(&self) -> NoFillet {
        self.largest_fillet().map_or_else(|none| none, |largest| NoFillet::TooLarge { largest })
    }

    fn check(&self, size_mm: f64) -> Result<(), NoFillet> {
        match self.junction() {
            Junction::Tangential => Err(NoFillet::Tangential),
            Junction::Cusp => Err(NoFillet::Cusp),
            Junction::Corner if size_mm > 0.0 && size_mm.is_finite() => Ok(()),
            Junction::Corner => Err(NoFillet::NotPositive),
        }
    }

    /// The fillet of a radius, if it touches both arcs between their ends.
    fn touching(&self, radius_mm: f64) -> Option<Fillet> {
        let (a, b, r) = (self.per_radius, self.per_power_mm, radius_mm);
        // w² b² - w (1 - 2 R_c a.b) + R_c² (a² - 1) = 0, the lower root.
        let (middle, last) = (1.0 - 2.0 * r * dot(a, b), r * r * (dot(a, a) - 1.0));
        let root = middle * middle - 4.0 * dot(b, b) * last;
        if !(middle > 0.0 && root >= 0.0) {
            return None;
        }
        let w = 2.0 * last / (middle + root.sqrt());
        let p = plus(times(a, r), times(b, w));
        let corner_mm = self.before.end_mm;
        let centre_mm = plus(corner_mm, p);
        let [first, second] = [self.contact(0, p, r)?, self.contact(1, p, r)?];
        let side = self.fillet_sense.sign();
        let angle_rad = (side * cross(first.inward, second.inward)).portable_atan2(dot(first.inward, second.inward));
        let contacts_mm = [first, second].map(|contact| plus(centre_mm, times(contact.inward, -r)));
        (angle_rad > 0.0).then(|| Fillet {
            centre_mm,
            radius_mm,
            sense: self.fillet_sense,
            deviation_mm: w / (length(p) + r),
            contacts_mm,
            taken_mm: [first.taken_mm, second.taken_mm],
            angle_rad,
            rounding_distance_mm: r * (angle_rad / 2.0).portable_tan(),
        })
    }

    /// Where a circle touches one of the arcs, if that is between its ends.
    fn contact(&self, which: usize, p: Plane, radius_mm: f64) -> Option<Contact> {
        let (arc, backward) = if which == 0 { (&self.before, -1.0) } else { (&self.after, 1.0) };
        let (m, side) = (self.inward[which], self.fillet_sense.sign());
        let bend = side * arc.signed_curvature_per_mm();
        // O_c - O_i = p - m/k and its length 1/k - R_c, over k: holds for a line too. Contact inside needs R_c < R_i.
        let left = 1.0 - bend * radius_mm;
        if left < INSIDE_MIN_RATIO {
            return None;
        }
        // Of length `left`, but for rounding.
        let towards = minus(m, times(p, bend));
        let inward = times(towards, 1.0 / length(towards));
        let along_mm = if bend == 0.0 {
            side * cross(p, m)
        } else {
            cross(m, inward).portable_atan2(dot(m, inward)) / arc.signed_curvature_per_mm()
        };
        let taken_mm = backward * along_mm;
        (taken_mm >= 0.0 && taken_mm <= arc.length_mm).then_some(Contact { inward, taken_mm })
    }
}

impl Fillet {
    /// True where the control may be asked for the rounding by its distance (G641 ADIS = TIT); otherwise the arc is written in the
    /// program (RND, or the arc itself).
    pub fn is_rounding_distance(&self) -> bool {
        self.rounding_distance_mm <= ROUNDING_DISTANCE_MAX_MM
    }

    /// R_c theta_c.
    pub fn length_mm(&self) -> f64 {
        self.radius_mm * self.angle_rad
    }
}

impl std::fmt::Display for NoFillet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoChord => write!(f, "an arc starts and ends in one point"),
            Self::ChordTooLong { chord_mm, diameter_mm } => {
                write!(f, "a chord of {chord_mm} mm does not fit a circle of {diameter_mm} mm")
            }
            Self::Apart { apart_mm } => write!(f, "the second arc starts {apart_mm} mm off the end of the first"),
            Self::Tangential => write!(f, "the arcs meet in one direction: there is no corner"),
            Self::Cusp => write!(f, "the path turns back: no arc rounds that"),
            Self::NotPositive => write!(f, "a deviation or radius is greater than 0"),
            Self::TooLarge { largest } => {
                let Fillet { deviation_mm, radius_mm, .. } = largest;
                write!(f, "the arcs are too short: at most {deviation_mm} mm from the corner, radius {radius_mm} mm")
            }
            Self::NoRoom => write!(f, "the arcs are too short for any rounding"),
        }
    }
}

impl std::error::Error for NoFillet {}

/// A contact of the fillet with an arc.
#[derive(Clone, Copy)]
struct Contact {
    /// Unit vector from it to the centre of the fillet.
    inward: Plane,
    /// Way along the arc from the corner.
    taken_mm: f64,
}

/// An angle in ]-pi, pi].
fn wrapped(angle_rad: f64) -> f64 {
    let turns = ((angle_rad - PI) / TAU).ceil();
    angle_rad - turns * TAU
}

/// The vector x with `x . rows[i] = values[i]`.
fn solved(rows: [Plane; 2], values: [f64; 2]) -> Plane {
    let [[a, b], [c, d]] = rows;
    let determinant = a * d - b * c;
    [(values[0] * d - values[1] * b) / determinant, (values[1] * a - values[0] * c) / determinant]
}

fn unit(direction_rad: f64) -> Plane {
    let (sin, cos) = direction_rad.portable_sin_cos();
    [cos, sin]
}

fn plus(a: Plane, b: Plane) -> Plane {
    [a[0] + b[0], a[1] + b[1]]
}

fn minus(a: Plane, b: Plane) -> Plane {
    [a[0] - b[0], a[1] - b[1]]
}

fn times(a: Plane, factor: f64) -> Plane {
    [a[0] * factor, a[1] * factor]
}

fn dot(a: Plane, b: Plane) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: Plane, b: Plane) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn length(a: Plane) -> f64 {
    a[0].portable_hypot(a[1])
}
