//! Traces -> one self-contained HTML page with plots, path, tables and program.
//!
//! In: a [`Trace`](crate::trace::Trace) with its figures, or two with their comparison. Out: a page that needs no network, written whole or
//! not at all. Uses uPlot 1.6 (`vendor/`, MIT). Does not compute figures.

mod bands;
mod encode;
mod path_view;
mod plots;
mod sheet;
mod strip;
mod tables;

pub use bands::{Band, packed};
pub use encode::{Rounding, Steps, base64, escape};
pub use sheet::Sheet;

use crate::base::Diagnostic;
use crate::recorder::WholeFile;
use std::io::Write as _;
use std::path::Path;

/// Writes a page under its name when it is complete; returns its size in bytes.
pub fn write(sheet: &Sheet<'_>, path: &Path) -> Result<u64, Diagnostic> {
    let html = sheet.html();
    let (whole, mut target) = WholeFile::create(path)?;
    target.write_all(html.as_bytes()).map_err(|error| whole.fault(&error))?;
    whole.commit(target)
}
