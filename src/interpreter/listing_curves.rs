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
    let denominator = powers(&piece.denominator_ratio);
    for id in machine.axis_ids() {
        let axis = machine.axis(id);
        let rotary = axis.kind == AxisKind::Rotary;
        let own =
            powers(&piece.numerator_lu.each_ref().map(|row| if rotary { deg_from_rad(row[id]) } else { row[id] }));
        // An axis that stands has no word, unless it is divided.
        if denominator.len() > 1 || own.len() > 1 {
            text.push_str(&format!(" {}({})", axis.name, own.join(",")));
        }
    }
    if denominator.len() > 1 {
        text.push_str(&format!(" D({})", denominator.join(",")));
    }
    text
}

/// As numbers of a listing, without the highest ones that are 0 there.
fn powers(coefficients: &[f64; 6]) -> Vec<String> {
    let mut numbers: Vec<String> = coefficients.iter().map(|coefficient| trimmed(*coefficient)).collect();
    while numbers.len() > 1 && numbers.last().is_some_and(|last| last == "0" || last == "-0") {
        numbers.pop();
    }
    numbers
}
