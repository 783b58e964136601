//! Alignment, figures and contour errors against closed forms: known shifts, lags, radii and noise.
//!
//! In: traces made here by formula, seeded noise. Out: what the comparison says of them, held against the formula.

mod budget;
mod command;
mod contour;
mod figures;
mod made;
mod offset;
mod page;
#[path = "../random/mod.rs"]
mod random;
