//! The machine file from outside: what is accepted, what comes out, and what a person is told.

mod archives;
mod catalogue;
mod drives;
mod listing;
mod overrides;
#[path = "../random/mod.rs"]
mod random;
mod rejected;
mod shipped;

use sollwert::base::{Diagnostic, SourceText};
use sollwert::machine::{self, Loaded};

/// The smallest machine file.
pub const MINIMAL: &str = "\
format = 1
name = \"smallest\"

[cycle]
t_cyl_ms = 2.0

[axes.X]
velocity_max_m_min = 30.0
acceleration_max_m_s2 = 3.0
jerk_max_m_s3 = 50.0
";

/// The example of the documentation: every table and, but for what excludes each other, every key.
pub const EXAMPLE: &str = include_str!("example.toml");

/// Parses a text as a file in a folder.
pub fn parse(text: &str) -> Result<Loaded, Vec<Diagnostic>> {
    machine::parse(&SourceText::new("some/folder/test.toml", text), &[])
}

/// `text` with one line replaced: `from` must occur in it.
pub fn with(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from:?} is not in the file");
    text.replacen(from, to, 1)
}

/// All findings as a person sees them.
pub fn shown(diagnostics: &[Diagnostic]) -> String {
    diagnostics.iter().map(|diagnostic| diagnostic.render(false) + "\n\n").collect()
}
