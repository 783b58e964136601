//! The machine: from the file as written to a checked [`Machine`] in internal units.
//!
//! In: TOML text, `--set KEY=VALUE` overrides. Out: [`Loaded`]: the [`Machine`], immutable, every value inside its range, and the file
//! as used. Every key is a row of the catalogue ([`tables`]), from which the checks, the JSON Schema ([`schema`]) and the user's table
//! of keys are made. Does not know programs, paths or recordings.

mod axis;
mod axis_catalogue;
mod catalogue;
mod checked;
mod choices;
mod clock;
mod control;
mod document;
mod drive;
mod drive_catalogue;
mod drive_options;
mod error_table;
mod keys;
mod later;
mod listing;
mod load;
mod mechanics;
mod mechanics_catalogue;
mod overrides;
mod periods;
mod schema;
mod section;
mod shipped;
mod tools;
mod workshop;

pub use catalogue::tables;
pub use checked::*;
pub use choices::Choice;
pub use drive::POSITIONING_TIME_MAX_S;
pub use drive_options::{
    Balancing, CURRENT_FILTERS, DriveOptions, Filter, FilterShape, FrictionAdaptation, JerkFilter, JerkFilterKind,
    PositionSource,
};
pub use error_table::ErrorTable;
pub use keys::{Absent, Accepts, Key, MotorKind, Range, TableKeys};
pub use later::unsupported;
pub use listing::{
    AxisChoice, ImportOptions, Imported, ListingFile, Origin, Sourced, Unknown, export_feedforward, export_listing,
    import_listing,
};
pub use load::{LoadError, Loaded, load, parse};
pub use overrides::edited;
pub use schema::schema;
pub use shipped::{DEFAULT_MACHINE, shipped};
pub use tools::{EDGE_MAX, Tool, ToolEdge, ToolTable, Workshop, ZeroOffset};
pub use workshop::{load_workshop, read_workshop};
