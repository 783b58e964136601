//! What the language of a program takes from the machine: the names of its axes.
//!
//! In: [`Machine`]. Out: [`Dialect`], by which the parser knows an axis word. Does not keep limits or units.

use super::words::role;
use crate::base::{AxisId, Diagnostic};
use crate::machine::Machine;

/// Axis names of a machine.
#[derive(Clone, Debug)]
pub struct Dialect {
    /// Names in capitals.
    names: Vec<(String, AxisId)>,
    /// Axes with one letter, A to Z.
    letters: [Option<AxisId>; 26],
}

/// Axes whose name is a word of the language, as errors: a program could not name such an axis.
pub fn taken_axis_names(machine: &Machine) -> Vec<Diagnostic> {
    let taken = |name: &str| name.len() > 1 && role(name).is_some();
    let names = machine.axis_ids().map(|id| machine.axis(id).name.as_str());
    names
        .filter(|name| taken(name))
        .map(|name| {
            let message = format!("the axis name {name} is taken: it is a word of NC programs");
            Diagnostic::error("M0011", message).help("give the axis another name in the machine file")
        })
        .collect()
}

impl Dialect {
    /// Axis names of `machine`.
    pub fn new(machine: &Machine) -> Self {
        let names: Vec<_> = machine.axis_ids().map(|id| (machine.axis(id).name.to_ascii_uppercase(), id)).collect();
        let mut letters = [None; 26];
        for (name, id) in &names {
            if let [letter @ b'A'..=b'Z'] = name.as_bytes() {
                letters[usize::from(letter - b'A')] = Some(*id);
            }
        }
        Self { names, letters }
    }

    /// The axis with that letter, case-blind.
    pub fn letter(&self, letter: u8) -> Option<AxisId> {
        let index = letter.to_ascii_uppercase().checked_sub(b'A')?;
        self.letters.get(usize::from(index)).copied().flatten()
    }

    /// The axis of that name, case-blind.
    pub fn axis(&self, name: &str) -> Option<AxisId> {
        match name.as_bytes() {
            [letter] => self.letter(*letter),
            _ => self.names.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, id)| *id),
        }
    }

    /// Name of an axis, in capitals.
    pub fn name(&self, axis: AxisId) -> Option<&str> {
        self.names.iter().find(|(_, id)| *id == axis).map(|(name, _)| name.as_str())
    }

    /// Axis names for help texts: "X, Y, Z".
    pub fn axis_list(&self) -> String {
        self.names.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
    }
}
