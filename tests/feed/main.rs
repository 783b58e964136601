//! Tests of the rooms `feed` and `interpolator`: closed forms, published figures, limits seen from outside.

mod blocked;
mod circular_contours;
mod continuous;
mod crept;
mod curves;
mod interpolator;
mod kinks;
mod overrides;
mod printed_loop;
mod profile;
mod programmed_time;
mod published;
mod revolutions;
mod sampled;
mod spindle;
mod support;
mod synchronised;
mod thread;
mod window;
