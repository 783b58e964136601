//! End, and centre or radius -> an arc whose start and end lie on its circle.
//!
//! In: start, end, centre or radius in the plane. Out: [`ArcGeometry`]. A programmed centre is rounded to the digits of the
//! program, so the two radii differ a little: the centre moves onto the perpendicular bisector of start and end, to the place
//! nearest to the programmed one. Beyond the control's tolerance that is an alarm. Does not know frames or axes' limits.

use super::wire::ArcGeometry;
use crate::base::AxisId;
use crate::base::Portable;
use crate::program::{Columns, Fault, Outcome, codes};
use std::f64::consts::TAU;

/// Largest difference of the radii at start and end (MD21000).
pub const RADIUS_TOLERANCE_MM: f64 = 0.01;
/// Ends nearer to the start than this make a full circle: below any digit that a program carries.
const SAME_POINT_MM: f64 = 1e-6;
/// How far the middle of the adjusted arc may lie from that of the programmed one. On a nearly full circle a small difference of
/// the radii moves the centre far along the short chord: such an arc is no longer what was programmed.
const SHAPE_TOLERANCE_MM: f64 = 0.05;

/// An arc as programmed, absolute, after frames.
#[derive(Clone, Debug)]
pub struct ProgrammedArc {
    /// First and second axis of the plane.
    pub plane: [AxisId; 2],
    /// Start in these axes.
    pub start_mm: [f64; 2],
    /// End in these axes.
    pub end_mm: [f64; 2],
    /// Centre or radius.
    pub shape: ArcShape,
    /// G3.
    pub counter_clockwise: bool,
    /// Full circles added by TURN.
    pub extra_turns: u32,
}

/// How the circle is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArcShape {
    /// I, J, K.
    Centre {
        /// Absolute.
        centre_mm: [f64; 2],
    },
    /// CR; negative: more than half a circle.
    Radius {
        /// As programmed.
        radius_mm: f64,
    },
}

/// Makes the geometry; `columns` mark what gives the circle.
pub fn arc_geometry(arc: &ProgrammedArc, columns: &Columns) -> Outcome<ArcGeometry> {
    let chord_mm = distance(arc.start_mm, arc.end_mm);
    let centre_mm = match arc.shape {
        ArcShape::Centre { centre_mm } if chord_mm <= SAME_POINT_MM => return full_circle(arc, centre_mm, columns),
        ArcShape::Centre { centre_mm } => adjusted_centre(arc, centre_mm, columns)?,
        ArcShape::Radius { radius_mm } => centre_from_radius(arc, radius_mm, chord_mm, columns)?,
    };
    let mut geometry = through(arc, centre_mm);
    if let ArcShape::Centre { centre_mm: programmed_mm } = arc.shape {
        check_shape(arc, &geometry, programmed_mm, columns)?;
    }
    geometry.sweep_rad += geometry.sweep_rad.signum() * TAU * f64::from(arc.extra_turns);
    Ok(geometry)
}

fn full_circle(arc: &ProgrammedArc, centre_mm: [f64; 2], columns: &Columns) -> Outcome<ArcGeometry> {
    let radius_mm = distance(arc.start_mm, centre_mm);
    if radius_mm <= SAME_POINT_MM {
        return Err(Fault::new(codes::ARC_WITHOUT_CENTRE, columns.clone(), "the centre of this arc is its start")
            .label("radius 0")
            .help("I, J and K lead from the start to the centre: give the one that is missing, or CR"));
    }
    let turns = TAU * f64::from(arc.extra_turns + 1);
    let sweep_rad = if arc.counter_clockwise { turns } else { -turns };
    Ok(ArcGeometry { plane: arc.plane, centre_mm, radius_mm, sweep_rad })
}

/// The point of the perpendicular bisector nearest to the programmed centre.
fn adjusted_centre(arc: &ProgrammedArc, centre_mm: [f64; 2], columns: &Columns) -> Outcome<[f64; 2]> {
    let start_radius_mm = distance(arc.start_mm, centre_mm);
    let end_radius_mm = distance(arc.end_mm, centre_mm);
    if (start_radius_mm - end_radius_mm).abs() > RADIUS_TOLERANCE_MM {
        return Err(end_off(start_radius_mm, end_radius_mm, columns));
    }
    let (middle, normal) = bisector(arc);
    let along = (centre_mm[0] - middle[0]) * normal[0] + (centre_mm[1] - middle[1]) * normal[1];
    Ok([middle[0] + along * normal[0], middle[1] + along * normal[1]])
}

fn centre_from_radius(arc: &ProgrammedArc, radius_mm: f64, chord_mm: f64, columns: &Columns) -> Outcome<[f64; 2]> {
    if chord_mm <= SAME_POINT_MM {
        return Err(Fault::new(codes::ARC_RADIUS, columns.clone(), "a full circle cannot be programmed with CR")
            .label("start and end are the same point")
            .help("give the centre with I, J or K"));
    }
    let half_mm = chord_mm / 2.0;
    if radius_mm.abs() < half_mm - RADIUS_TOLERANCE_MM || radius_mm == 0.0 {
        let message = format!("radius {} mm does not reach the end: half the way is {half_mm:.3} mm", radius_mm.abs());
        return Err(Fault::new(codes::ARC_RADIUS, columns.clone(), message)
            .label(format!("expected at least {half_mm:.3}"))
            .help("check the end point and CR: the circle must reach from start to end"));
    }
    let height_mm = (radius_mm * radius_mm - half_mm * half_mm).max(0.0).sqrt();
    let (middle, normal) = bisector(arc);
    // The normal points to the left of the way: there lies the centre of a G3 of less than half a circle.
    let left = arc.counter_clockwise == (radius_mm > 0.0);
    let along = if left { height_mm } else { -height_mm };
    Ok([middle[0] + along * normal[0], middle[1] + along * normal[1]])
}

/// Middle of the chord and the unit normal to its left.
fn bisector(arc: &ProgrammedArc) -> ([f64; 2], [f64; 2]) {
    let (start, end) = (arc.start_mm, arc.end_mm);
    let chord_mm = distance(start, end);
    let middle = [(start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0];
    (middle, [-(end[1] - start[1]) / chord_mm, (end[0] - start[0]) / chord_mm])
}

/// The arc from start to end about a centre that is equally far from both.
fn through(arc: &ProgrammedArc, centre_mm: [f64; 2]) -> ArcGeometry {
    let angle = |point: [f64; 2]| (point[1] - centre_mm[1]).portable_atan2(point[0] - centre_mm[0]);
    let difference = angle(arc.end_mm) - angle(arc.start_mm);
    let sweep_rad = if arc.counter_clockwise { difference.rem_euclid(TAU) } else { -(-difference).rem_euclid(TAU) };
    ArcGeometry { plane: arc.plane, centre_mm, radius_mm: distance(arc.start_mm, centre_mm), sweep_rad }
}

/// Compares the middle of the adjusted arc with that of the programmed one.
fn check_shape(arc: &ProgrammedArc, adjusted: &ArcGeometry, programmed_mm: [f64; 2], columns: &Columns) -> Outcome<()> {
    let start_radius_mm = distance(arc.start_mm, programmed_mm);
    let end_radius_mm = distance(arc.end_mm, programmed_mm);
    let programmed = through(arc, programmed_mm);
    // An end beside the start, along the radius, is neither a small arc nor a full circle.
    if programmed.sweep_rad.abs() * start_radius_mm < distance(arc.start_mm, arc.end_mm) / 2.0 {
        return Err(end_off(start_radius_mm, end_radius_mm, columns));
    }
    let middle = |geometry: &ArcGeometry, radius_mm: f64| {
        let centre = geometry.centre_mm;
        let start = (arc.start_mm[1] - centre[1]).portable_atan2(arc.start_mm[0] - centre[0]);
        let (sine, cosine) = (start + geometry.sweep_rad / 2.0).portable_sin_cos();
        [centre[0] + radius_mm * cosine, centre[1] + radius_mm * sine]
    };
    let off_mm =
        distance(middle(adjusted, adjusted.radius_mm), middle(&programmed, (start_radius_mm + end_radius_mm) / 2.0));
    if off_mm > SHAPE_TOLERANCE_MM { Err(end_off(start_radius_mm, end_radius_mm, columns)) } else { Ok(()) }
}

fn end_off(start_radius_mm: f64, end_radius_mm: f64, columns: &Columns) -> Box<Fault> {
    let message = format!(
        "the end is not on the circle: radius {start_radius_mm:.4} mm at the start, {end_radius_mm:.4} mm at the end"
    );
    Fault::new(codes::ARC_END_OFF, columns.clone(), message)
        .label(format!("they may differ by {RADIUS_TOLERANCE_MM} mm"))
        .help("check the end point and the centre; I, J, K count from the start unless AC() is written")
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).portable_hypot(a[1] - b[1])
}
