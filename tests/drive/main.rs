//! The drive room from outside: closed forms of models/drive.md section 7, edge cases of section 8, an independent reference.

mod batch;
mod bode;
mod closed_forms;
mod friction;
mod limits;
mod linear;
mod monitoring;
mod odd;
mod options;
mod plant;
mod reference;
mod rig;
mod second_mass;
mod transmissions;
