//! Tests of the room `smoothing`: corners, inserts, path modes, compressor.

mod along;
mod compressor;
mod compressor_kinds;
mod five;
mod inserts;
mod modes;
mod polylines;
mod quintic;
mod space;
mod support;
