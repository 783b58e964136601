//! placeholder
/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub enum Curve {}
