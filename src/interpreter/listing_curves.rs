//! Curves of moves as text.
//!
//! In: the kind of a move. Out: the words of a listing that say which curve it is. Does not read them back.

use super::value::trimmed;
use super::wire::{ArcGeometry, MoveKind, PolynomialPiece, SpatialArcGeometry};
use crate::base::units::deg_from_rad;
use crate::base::{AxisId, AxisKind, AxisVector};
use crate::machine::Machine;

/// What a listing says about a curve; `None` for what is straight or stands.
pub(super) fn curve_text(machine: &Machine, kind: &MoveKind) -> Option<String> {
    match kind {
        MoveKind::Arc(arc) => Some(arc_text(machine, arc)),
        MoveKind::SpatialArc(arc) => Some(spatial_text(machine, arc)),
        MoveKind::Spline(geometry) | MoveKind::Polynomial(geometry) => {
            let pieces: Vec<String> = geometry.pieces.iter().map(|piece| piece_text(machine, piece)).collect();
            Some(pieces.join(" | "))
        }
        _ => None,
    }
}

fn arc_text(machine: &Machine, arc: &ArcGeometry) -> String {
    let name = |id: AxisId| machine.axis(id).name.as_str();
    let [first, second] = arc.plane;
    let [a, b] = arc.centre_mm.map(trimmed);
    let (radius, sweep) = (trimmed(arc.radius_mm), trimmed(deg_from_rad(arc.sweep_rad)));
    format!("{}{} C{a},{b} R{radius} sweep={sweep}", name(first), name(second))
}

fn spatial_text(machine: &Machine, arc: &SpatialArcGeometry) -> String {
    let linear: Vec<AxisId> = machine.axis_ids().filter(|id| machine.axis(*id).kind == AxisKind::Linear).collect();
    let components = |vector: &AxisVector| {
        let numbers: Vec<String> = linear.iter().map(|id| trimmed(vector[*id])).collect();
        numbers.join(",")
    };
    let [from, to] = &arc.directions;
    let (radius, sweep) = (trimmed(arc.radius_mm), trimmed(deg_from_rad(arc.sweep_rad)));
    let centre = components(&arc.centre_mm);
    format!("({})({}) C{centre} R{radius} sweep={sweep}", components(from), components(to))
}

fn piece_text(machine: &Machine, piece: &PolynomialPiece) -> String {
    let mut text = format!("p{}", trimmed(piece.parameter_end_ratio));
    let rational = piece.denominator_ratio[1..].iter().any(|coefficient| *coefficient != 0.0);
    for id in machine.axis_ids() {
        let axis = machine.axis(id);
        let rotary = axis.kind == AxisKind::Rotary;
        let own = piece.numerator_lu.each_ref().map(|row| if rotary { deg_from_rad(row[id]) } else { row[id] });
        if rational || own[1..].iter().any(|coefficient| *coefficient != 0.0) {
            text.push_str(&format!(" {}({})", axis.name, powers(&own)));
        }
    }
    if rational {
        text.push_str(&format!(" D({})", powers(&piece.denominator_ratio)));
    }
    text
}

/// Without the highest ones that are 0.
fn powers(coefficients: &[f64; 6]) -> String {
    let count = coefficients.iter().rposition(|coefficient| *coefficient != 0.0).map_or(1, |last| last + 1);
    let numbers: Vec<String> = coefficients[..count].iter().map(|coefficient| trimmed(*coefficient)).collect();
    numbers.join(",")
}
