//! What a person should know of a tuning beside its figures.
//!
//! In: groups, the gains found. Out: notes and warnings. Decides nothing.

use super::contour::moves_tool;
use super::gains::{Gain, Gains};
use super::group::{Group, Slot};
use crate::base::units::MS_PER_S;
use crate::base::{AxisId, Diagnostic};
use crate::machine::Machine;

/// Gains of the machine that are outside bounds of the user.
pub(super) fn outside(group: &Group<'_>) -> Vec<Diagnostic> {
    let before = group.before();
    let of_slot = |slot: &Slot, member: usize| {
        let axis = group.machine.axis(group.members[member].axis);
        let own = before[member].get(slot.gain);
        (slot.binds && !(slot.range[0]..=slot.range[1]).contains(&own)).then(|| {
            let [own, low, high] = [own, slot.range[0], slot.range[1]].map(|one| slot.gain.shown(axis.kind, one));
            let key = slot.gain.key(axis.kind);
            let message = format!(
                "{}: the machine has {key} = {own}, outside the bounds {low}..{high} of --bound: brought inside before gains are compared",
                axis.name
            );
            Diagnostic::note("U0003", message).help("without --bound the gains of the machine may stay")
        })
    };
    let all = group.slots.iter().flat_map(|slot| slot.members.iter().filter_map(move |member| of_slot(slot, *member)));
    all.collect()
}

/// Axes that move the tool, were not tuned, and have another delay now than those that were: paths of both bend.
pub(super) fn apart(machine: &Machine, after: &[(AxisId, Gains)]) -> Option<Diagnostic> {
    const SAME_S: f64 = 20e-6;
    let (_, gains) = after.iter().find(|(axis, _)| moves_tool(machine, *axis))?;
    let delay_s = gains.get(Gain::Delay);
    let other = |axis: &AxisId| {
        let data = machine.axis(*axis).drive.as_ref();
        let differs = data.is_some_and(|data| (data.setpoint_delay_s - delay_s).abs() > SAME_S);
        moves_tool(machine, *axis) && differs && after.iter().all(|(tuned, _)| tuned != axis)
    };
    let names: Vec<&str> = machine.axis_ids().filter(other).map(|axis| machine.axis(axis).name.as_str()).collect();
    (!names.is_empty()).then(|| {
        let message = format!(
            "{}: not tuned, and the delay differs from the {:.3} ms of the axes that were: paths on which both move bend",
            names.join(", "),
            delay_s * MS_PER_S
        );
        let help = "tune on programs in which all axes of the tool move";
        Diagnostic::warning("U0007", message).help(help)
    })
}
