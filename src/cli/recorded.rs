//! What goes into a recording, as `run` and `follow` are told it.
//!
//! In: `--record`, `--record-rate`, `--record-decimate`, `--record-precision`. Out: a [`SignalChoice`]. Does not record.

use super::failure::Failure;
use crate::machine::Loaded;
use crate::recorder::{RecordRate, SignalChoice};
use clap::Args;
use std::num::NonZeroU32;

/// Options of every command that records axes.
#[derive(Args)]
pub(super) struct Recorded {
    /// Signals to record, such as X.current_a,Y.*/10 (every tenth sample),path.*; default: all
    #[arg(long, value_name = "SIGNALS")]
    record: Option<String>,
    /// Rate of the axis signals: the cycle of the position, speed or current controller
    #[arg(long, value_name = "RATE", default_value = "position", value_parser = RecordRate::WORDS)]
    record_rate: String,
    /// Record every N-th sample of axes and path only
    #[arg(long, value_name = "N", default_value = "1")]
    record_decimate: NonZeroU32,
    /// Mantissa bits to keep in recorded values, 1 to 52: 36 keep 7e-9 mm and save a fifth of the size
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u8).range(1..=52))]
    pub(super) record_precision: Option<u8>,
}

impl Recorded {
    /// The choice on this machine. Errors: a word that names no signal.
    pub(super) fn signals(&self, machine: &Loaded) -> Result<SignalChoice, Failure> {
        let rate = RecordRate::from_word(&self.record_rate).unwrap_or_default();
        let signals = match &self.record {
            Some(text) => SignalChoice::parse(text, &machine.machine).map_err(Failure::unreadable)?,
            None => SignalChoice::all(),
        };
        Ok(signals.at_rate(rate).decimated(self.record_decimate))
    }
}
