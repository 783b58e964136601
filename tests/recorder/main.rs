//! The recorder from outside: what goes in comes out, by our own reader and by the mcap crate; equal runs give equal bytes; what
//! is damaged is told, and rescued.

mod choice;
mod damage;
mod export;
mod recording;
mod support;
