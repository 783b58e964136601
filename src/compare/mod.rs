//! Trace against Trace -> figures: time offset, differences in time and along the path, contour error, circles, corners, limits. The method
//! of each figure stands in docs/compare.md.
//!
//! In: two [`Trace`](crate::trace::Trace)s. Out: [`Comparison`], its JSON document, checked limits. Does not read files and does not draw.

mod budget;
mod circle;
mod comparison;
mod contour;
mod corner;
mod document;
mod geometry;
mod heading;
mod limits;
mod lines;
mod offset;
mod pairs;
mod path;
mod programmed;
mod round;
mod rows;
mod series;
mod statistics;

pub use budget::{Budget, BudgetGround, Part, budget};
pub use circle::CircleFigures;
pub use comparison::{
    CompareOptions, Comparison, OwnContour, PairFigures, PathComparison, Side, compare, examine, prepare,
};
pub use contour::{Contour, Features, features, follow};
pub use corner::CornerFigures;
pub use document::{budget_json, document, side_json};
pub use geometry::{ACTUAL_STEMS, SETPOINT_STEMS, Track, machine_of, track};
pub use limits::{LimitCheck, LimitRule, check_limits, parse_limit};
pub use lines::{LineTimes, Lines, ProgramLine};
pub use offset::{Alignment, Channel, align, residual_delay};
pub use path::{Follower, Line, Match};
pub use round::fit_circle;
pub use rows::{Rows, arcs_remark, budget_rows, circle_rows, corner_rows, line_rows, pair_rows, significant, um};
pub use series::{Cursor, Series, noise_of};
pub use statistics::{Figures, Gathering};
