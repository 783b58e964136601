//! Maps of the objective around the optimum, simulated point by point.
//!
//! In: a group, its gains. Out: for each axis velocity feed-forward against each other gain that is free. Bounds are kept.

use super::gains::{Gain, Gains};
use super::group::{Group, Landscape, Slot};
use super::{Measure, Objective};
use crate::base::AxisKind;
use crate::base::units::deg_from_rad;

/// Points in a row of a map: odd, so that the optimum is one of them.
const POINTS: usize = 11;
/// Steps of a search to either side; the valley of velocity feed-forward is the narrowest.
const REACH_STEPS: f64 = 2.5;
const REACH_VELOCITY_STEPS: f64 = 1.0;

/// The objective over two gains.
#[derive(Clone, Debug)]
pub struct Map {
    /// Across and up.
    pub gains: [Gain; 2],
    /// Values of both, in the unit of their keys.
    pub values: [Vec<f64>; 2],
    /// Objective, row by row from the lowest value up: mm or deg.
    pub heights: Vec<Vec<f64>>,
    /// Unit of the heights.
    pub unit: &'static str,
}

/// Maps of every axis of the group.
pub(super) fn maps(group: &Group<'_>, gains: &[Gains]) -> Vec<Landscape> {
    let mut found = Vec::new();
    for (place, member) in group.members.iter().enumerate() {
        let mut of_axis: Vec<&Slot> = group.slots.iter().filter(|slot| slot.members.contains(&place)).collect();
        of_axis.sort_by_key(|slot| slot.gain as usize);
        let Some((across, others)) = of_axis.split_first() else { continue };
        for up in others {
            let axis = group.machine.axis(member.axis);
            let map = map(group, gains, [across, up], axis.kind);
            found.push(Landscape { axis: axis.name.clone(), map });
        }
    }
    found
}

fn map(group: &Group<'_>, gains: &[Gains], slots: [&Slot; 2], kind: AxisKind) -> Map {
    let line = |slot: &Slot| -> Vec<f64> {
        let steps = if slot.gain == Gain::Velocity { REACH_VELOCITY_STEPS } else { REACH_STEPS };
        let (centre, reach) = (group.value(gains, slot), steps * slot.gain.step(slot.range));
        let [low, high] = [(centre - reach).max(slot.range[0]), (centre + reach).min(slot.range[1])];
        (0..POINTS).map(|point| low + (high - low) * point as f64 / (POINTS - 1) as f64).collect()
    };
    let inside = slots.map(line);
    let mut candidates = Vec::with_capacity(POINTS * POINTS);
    for up in &inside[1] {
        for across in &inside[0] {
            let mut moved = gains.to_vec();
            group.put(&mut moved, slots[0], *across);
            group.put(&mut moved, slots[1], *up);
            candidates.push(moved);
        }
    }
    let angle = kind == AxisKind::Rotary && group.objective != Objective::Contour && group.members.len() == 1;
    // Row by row: the residuals of a whole map at once would take much room.
    let heights: Vec<Vec<f64>> = candidates
        .chunks(POINTS)
        .map(|row| {
            let scores = group.scores(row);
            let height = |score: &super::group::Score| match group.measure {
                Measure::Rms => score.mean_square.sqrt(),
                Measure::Peak => score.peak,
            };
            scores.iter().map(|score| if angle { deg_from_rad(height(score)) } else { height(score) }).collect()
        })
        .collect();
    let shown = |slot: &Slot, values: &[f64]| values.iter().map(|value| slot.gain.shown(kind, *value)).collect();
    Map {
        gains: [slots[0].gain, slots[1].gain],
        values: [shown(slots[0], &inside[0]), shown(slots[1], &inside[1])],
        heights,
        unit: if angle { "deg" } else { "mm" },
    }
}
