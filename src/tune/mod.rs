//! Feed-forward gains from programs or measured traces, offline.
//!
//! In: a checked machine, [`Course`]s (set-points of programs from the kernel, made once; or a trace with its measured error), what is to be
//! small. Out: [`Tuned`]: gains with their certainty, errors before and after on courses for tuning and on others, what friction leaves, what
//! ±10 % of inertia and friction do. Only drives are simulated, many parameter sets side by side ([`crate::drive::DriveBatch`]).
//!
//! Between stick events the errors are affine in the gains (models/drive.md section 10): Gauss-Newton passes from two starts side by side reach
//! the least RMS, points over the bounds show whether there is a better valley; a search without derivatives follows for the peak and for
//! friction compensation, which is not affine. What data cannot tell (the ridge of
//! section 7.3: velocity feed-forward and delay, seen from the position alone) is decided by a weak preference for what theory says
//! (weight 1, the inertia of the model, the delay of 7.2). Writes no files; knows no NC language.

mod apply;
mod certainty;
mod contour;
mod course;
mod document;
mod figures;
mod fit;
mod gains;
mod group;
mod landscape;
mod normal;
mod notes;
mod search;
mod simulate;

pub use apply::{machine_data, machine_text};
pub use course::{Course, course_of_program, course_of_trace};
pub use document::document;
pub use figures::{AxisFigures, CourseFigures, Pair, Sensitivity};
pub use gains::Gain;
pub use group::{Landscape, Tuned, TunedAxis, TunedGain, tune};
pub use landscape::Map;

/// What is to be small.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Objective {
    /// What the controller sees: reference minus measured.
    #[default]
    Deviation,
    /// Set-point minus actual, the whole lag.
    Following,
    /// Distance of the tool from the path: axes that interpolate together, with one delay for all.
    Contour,
}

/// How it is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Measure {
    /// Root of the mean square.
    #[default]
    Rms,
    /// Largest amount.
    Peak,
}

/// What to do.
#[derive(Clone, Debug)]
pub struct TuneOptions {
    /// What is to be small.
    pub objective: Objective,
    /// How it is measured.
    pub measure: Measure,
    /// Which gains may change.
    pub gains: Vec<Gain>,
    /// Lower and upper bounds other than the usual ones.
    pub bounds: Vec<(Gain, [f64; 2])>,
    /// Axes to tune; empty: all that have a drive and move.
    pub axes: Vec<String>,
    /// Maps of the objective around the optimum, for a page.
    pub landscape: bool,
}

impl Default for TuneOptions {
    fn default() -> Self {
        Self {
            objective: Objective::default(),
            measure: Measure::default(),
            gains: vec![Gain::Velocity, Gain::Torque, Gain::Delay],
            bounds: Vec::new(),
            axes: Vec::new(),
            landscape: false,
        }
    }
}
