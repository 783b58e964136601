//! JointPath -> the fastest motion: how much time the control leaves on the table.
//!
//! In: the pieces of a path as the control drove it ([`PlannedPiece`](crate::feed::PlannedPiece)), the machine. Out: [`Optimum`]: the
//! least time in which the same path can be driven under the same limits of every axis, with the speed along it. Offline: the whole path
//! between two rests at once, without a look-ahead window.
//!
//! Between two rests the time `∫ ds/√b` over the square of the speed `b(s) = v²` is least under, for every axis
//! (models/feed-planning.md section 1),
//!
//! ```text
//! b <= F²    |q'| v <= V    |q'' b + q' b'/2| <= A    |√b (q''' b + 3/2 q'' b' + 1/2 q' b'')| <= J
//! ```
//!
//! and the speeds that junctions allow; v and the acceleration along s are continuous everywhere. b is a cubic on each interval of a grid
//! (`grid`), with continuous b'. The last limit is not convex: each round (`round`) replaces J/√b by its tangent at the b of the round before,
//! which is below it, so that every round's result keeps the true limit; the rounds end where they gain nothing. A grid whose intervals
//! leave limits unused is refined (`section`). At a rest b goes with s^(4/3), a motion of constant jerk from v = a = 0.
//!
//! The limits hold at both ends and in the middle of every interval; what is missed between them is measured on a finer sampling. Where they
//! are exceeded there, the interval is solved again with less of them, and at last the whole motion is slowed by the little that is left, so
//! that the time is one in which the limits hold. Where the control is faster than that, its motion is the fastest that is known.
//!
//! Does not know how the control plans. Motions of single axes beside the path (POS) and dwells take the time that they took.

mod collect;
#[cfg(feature = "optimal")]
mod cone;
#[cfg(feature = "optimal")]
mod grid;
#[cfg(feature = "optimal")]
mod profile;
#[cfg(feature = "optimal")]
mod round;
#[cfg(feature = "optimal")]
mod section;
mod wire;

pub use collect::Collector;
pub use wire::*;
