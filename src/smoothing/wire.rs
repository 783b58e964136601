//! The wire out of smoothing: the contour, piece by piece.
//!
//! In: nothing (plain data). Out: [`ContourPiece`]. Does not know speed or machine space.

use crate::base::{PartPoint, PerAxis};
use crate::geometry::Curve;
use crate::interpreter::{Event, Feed, Modes};
use crate::program::BlockRef;

/// One curve of the contour with the block that it came from.
#[derive(Clone, Debug, PartialEq)]
pub struct ContourPiece {
    /// Block that this piece belongs to; for a blend the block that ends in the corner.
    pub block: BlockRef,
    /// What it is.
    pub kind: PieceKind,
    /// Programmed feed; for a blend the lower one of the two neighbours.
    pub feed: Feed,
    /// Modes in force; for a blend those of the block that ends in the corner.
    pub modes: Modes,
    /// What happens when the piece begins.
    pub events: Vec<Event>,
    /// Motion blocks that begin at the start of this piece: 1 for a block, 0 for a blend or a wait, more where a block was
    /// consumed whole by its blends. The look-ahead window and the `blocks` figure count these.
    pub blocks_begun: u32,
    /// Length of the block that this piece is one of several parts of; `None`: it is the whole block, or no part of one.
    pub block_length_lu: Option<f64>,
    /// The path must be at rest at the end of this piece.
    pub stop_at_end: bool,
}

/// What a piece is.
#[derive(Clone, Debug, PartialEq)]
pub enum PieceKind {
    /// A programmed block, trimmed where blends take its ends.
    Block(Curve),
    /// An inserted corner blend.
    Blend(Curve, Corner),
    /// Stands still until these axes have arrived that move on their own.
    WaitPositioned {
        /// Which axes.
        axes: PerAxis<bool>,
        /// Position, unchanged.
        at: PartPoint,
    },
    /// Stands still: a dwell, or a function block (0 s).
    Wait {
        /// Length of the wait.
        time_s: f64,
        /// Position, unchanged.
        at: PartPoint,
    },
}

/// A corner that was rounded: the geometry part of a `corners` entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Turning angle, 0 = straight.
    pub angle_rad: f64,
    /// epsilon as executed.
    pub tolerance_mm: f64,
    /// T.
    pub transition_length_mm: f64,
}

impl ContourPiece {
    /// The curve, unless the piece stands still.
    pub fn curve(&self) -> Option<&Curve> {
        match &self.kind {
            PieceKind::Block(curve) | PieceKind::Blend(curve, _) => Some(curve),
            PieceKind::Wait { .. } | PieceKind::WaitPositioned { .. } => None,
        }
    }
}
