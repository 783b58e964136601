//! Tests of the room `feed`: closed forms, published figures, limits seen from outside.

mod circular_contours;
mod curves;
mod printed_loop;
mod profile;
mod published;
mod sampled;
mod support;
mod window;
