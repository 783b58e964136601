//! The gains found, as a machine file and as machine data.
//!
//! In: the machine as loaded, [`Tuned`]. Out: its text with the gains in it, comments and order kept; a listing for a SINUMERIK with the
//! data of the tuned axes and nothing else.

use super::group::Tuned;
use crate::base::{Diagnostic, SourceText};
use crate::machine::{Loaded, edited, export_feedforward, parse};

/// The machine file. Errors: the text does not take the values, which checked text does.
pub fn machine_text(loaded: &Loaded, tuned: &Tuned) -> Result<String, Vec<Diagnostic>> {
    let mut sets = Vec::new();
    for axis in &tuned.axes {
        for gain in axis.gains.iter().filter(|gain| gain.value != gain.before) {
            sets.push(format!("axes.{}.drive.{}={}", axis.name, gain.gain.key(axis.kind), tidy(gain.value)));
        }
    }
    edited(&loaded.text_as_used, &sets, "tuned")
}

/// A number with a point, without digits that only rounding made.
fn tidy(value: f64) -> String {
    let text = format!("{value:.6}");
    let short = text.trim_end_matches('0');
    if short.ends_with('.') { format!("{short}0") } else { short.to_owned() }
}

/// `N32610 $MA_VELO_FFW_WEIGHT[0,AX1]=...`.
pub fn machine_data(text: &str, name: &str, tuned: &Tuned) -> Result<String, Vec<Diagnostic>> {
    let after = parse(&SourceText::new(name, text), &[])?;
    let axes: Vec<&str> = tuned.axes.iter().map(|axis| axis.name.as_str()).collect();
    Ok(export_feedforward(&after, &axes))
}
