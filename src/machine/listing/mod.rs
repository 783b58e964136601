//! SINUMERIK machine data in and out: listings, archives, drive parameters.
//!
//! In: the bytes of listings (`N32300 $MA_MAX_AX_ACCEL[0,AX1]=6`), of drive parameters (`p1460[0]=5`), or of an archive that holds both
//! ([`archive`]). Out: [`import_listing`] makes the text of a machine file, and says of every key where its value comes from; what is
//! assumed; which data have no counterpart, once each with their number. [`export_listing`] writes a listing of a machine. A key
//! without machine datum travels in a comment (`;#sollwert KEY = VALUE`), which a control passes over, so that nothing is lost on the
//! way out and in again. The five-axis transformation is read and written ([`five_axis`]); compiled drive data (ACX, BOT), compensation
//! tables and other transformations are not.

mod archive;
mod axes;
mod beyond;
mod data;
mod digital;
mod drives;
mod export;
mod export_axis;
mod five_axis;
mod import;
mod lines;
mod rows;
mod scalar;
mod special;
mod write;

pub use export::{export_feedforward, export_listing};
pub use import::{AxisChoice, ImportOptions, Imported, Origin, Sourced, Unknown, import_listing};

/// A file as the user named it.
#[derive(Clone, Debug)]
pub struct ListingFile {
    /// For messages.
    pub name: String,
    /// As on the disk.
    pub bytes: Vec<u8>,
}

/// Opens a comment that carries a key without machine datum.
const CARRIED: &str = ";#sollwert ";
