//! Tests of the room `feed`: closed forms, published figures, limits seen from outside.

mod profile;
mod published;
mod sampled;
mod support;
mod window;
