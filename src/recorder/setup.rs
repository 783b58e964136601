//! What a recording begins with: options, channels and metadata.
//!
//! In: machine, programs, options of the user. Out: [`RecordingSetup`], its metadata. Holds no path, host name or time of day:
//! equal inputs give equal bytes.

use super::choice::SignalChoice;
use super::schema::{AXIS_FIELDS, RECORDING_FORMAT, SPINDLE_FIELDS};
use crate::base::AxisKind;
use crate::machine::{Axis, Machine};
use crate::program::{OpenedProgram, ProgramText};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io;
use std::num::NonZeroU32;

/// Metadata record with version, machine and program.
pub const ABOUT_METADATA: &str = "sollwert";
/// Metadata record with the periods.
pub const CYCLE_METADATA: &str = "cycle";
/// Metadata record with the axes.
pub const AXES_METADATA: &str = "axes";
/// Metadata record with the unit of every field.
pub const UNITS_METADATA: &str = "units";
/// Metadata record with the sha256 of every input.
pub const INPUTS_METADATA: &str = "inputs";
/// Metadata record with the figures of the run: key by key, every value as JSON.
pub const SUMMARY_METADATA: &str = "summary";
/// Media type of an attached machine file.
pub const MACHINE_MEDIA_TYPE: &str = "application/toml";
/// Media type of an attached NC program.
pub const PROGRAM_MEDIA_TYPE: &str = "text/x-nc-program";

/// How chunks are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Compression {
    /// zstd, level 1.
    #[default]
    Zstd,
    /// Not at all: for readers without zstd.
    None,
}

/// What is recorded, and of what.
#[derive(Clone, Debug)]
pub struct RecordingSetup<'a> {
    /// Machine as used.
    pub machine: &'a Machine,
    /// Name of the machine file, without folders.
    pub machine_file_name: &'a str,
    /// Text of the machine file as used, `--set` applied.
    pub machine_text: &'a str,
    /// Main program and the sub-programs known by now; empty for a run that follows given set-points.
    pub programs: &'a [OpenedProgram],
    /// `--record`.
    pub signals: SignalChoice,
    /// `--record-precision`: mantissa bits to keep of axis, path and pose values; `None` keeps all 52.
    pub mantissa_bits: Option<u8>,
    /// Record every n-th sample of each axis and of the path; the last one is recorded in any case.
    pub decimation: NonZeroU32,
    /// With a topic for what the program asks of the path.
    pub programmed: bool,
    /// Packing of chunks.
    pub compression: Compression,
}

impl<'a> RecordingSetup<'a> {
    /// Records everything at full precision.
    pub fn new(
        machine: &'a Machine,
        machine_file_name: &'a str,
        machine_text: &'a str,
        programs: &'a [OpenedProgram],
    ) -> Self {
        Self {
            machine,
            machine_file_name,
            machine_text,
            programs,
            signals: SignalChoice::all(),
            mantissa_bits: None,
            decimation: NonZeroU32::MIN,
            programmed: false,
            compression: Compression::Zstd,
        }
    }

    /// The metadata records that stand before the first message, in order.
    pub(super) fn metadata(&self) -> io::Result<Vec<(&'static str, BTreeMap<String, String>)>> {
        let mut inputs = BTreeMap::new();
        inputs.insert(self.machine_file_name.to_owned(), hexadecimal(Sha256::digest(self.machine_text.as_bytes())));
        for program in self.programs {
            inputs.insert(program.name.to_string(), sha256(&program.bytes)?);
        }
        Ok(vec![
            (ABOUT_METADATA, self.about()),
            (CYCLE_METADATA, self.cycle()),
            (AXES_METADATA, self.axes()),
            (UNITS_METADATA, self.units()),
            (INPUTS_METADATA, inputs),
        ])
    }

    fn about(&self) -> BTreeMap<String, String> {
        let mut about = BTreeMap::new();
        let mut set = |key: &str, value: String| about.insert(key.to_owned(), value);
        set("format", RECORDING_FORMAT.to_string());
        set("version", env!("CARGO_PKG_VERSION").to_owned());
        set("machine", self.machine.name.clone());
        set("control", self.machine.control.clone());
        set("machine_file", self.machine_file_name.to_owned());
        if let Some(main) = self.programs.first() {
            set("program", main.name.to_string());
        }
        if let Some(bits) = self.mantissa_bits {
            set("mantissa_bits", bits.to_string());
        }
        set("decimation", self.decimation.to_string());
        set("record_rate", self.signals.rate().word().to_owned());
        about
    }

    fn cycle(&self) -> BTreeMap<String, String> {
        let cycle = &self.machine.cycle;
        let mut periods = BTreeMap::new();
        let mut set = |key: String, value: String| periods.insert(key, value);
        set("control_cycle_s".to_owned(), cycle.control_cycle_s.to_string());
        set("setpoint_period_s".to_owned(), cycle.time_base.setpoint_period_s().to_string());
        set("sampling_factor".to_owned(), cycle.sampling_ratio.to_string());
        set("tick_period_s".to_owned(), cycle.time_base.tick_period_s().to_string());
        set("look_ahead_blocks".to_owned(), self.machine.look_ahead_blocks.to_string());
        for axis in &self.machine.axes {
            let Some(drive) = &axis.drive else { continue };
            let seconds = |ticks: u64| cycle.time_base.seconds(ticks).to_string();
            set(format!("{}.position_cycle_s", axis.name), seconds(drive.position_cycle_ticks));
            set(format!("{}.speed_cycle_s", axis.name), seconds(drive.speed_cycle_ticks));
            set(format!("{}.current_cycle_s", axis.name), seconds(drive.current_cycle_ticks));
        }
        periods
    }

    fn axes(&self) -> BTreeMap<String, String> {
        let mut axes = BTreeMap::new();
        let names: Vec<&str> = self.machine.axes.iter().map(|axis| axis.name.as_str()).collect();
        axes.insert("order".to_owned(), names.join(","));
        for axis in &self.machine.axes {
            let mut set = |key: &str, value: String| axes.insert(format!("{}.{key}", axis.name), value);
            set("kind", kind_name(axis.kind).to_owned());
            set("index", axis.index.to_string());
            if let Some(machine_axis) = &axis.machine_axis {
                set("machine_axis", machine_axis.clone());
            }
            set("drive", drive_standing(axis).to_owned());
        }
        axes
    }

    fn units(&self) -> BTreeMap<String, String> {
        let mut units = BTreeMap::new();
        for kind in [AxisKind::Linear, AxisKind::Rotary] {
            if self.machine.axes.iter().any(|axis| axis.kind == kind) {
                for field in &AXIS_FIELDS {
                    units.insert(field.name(kind).to_owned(), field.unit_name(kind).to_owned());
                }
            }
        }
        let path = [
            ("s_mm", "mm"),
            ("feed_mm_min", "mm/min (deg/min where rotary_only)"),
            ("programmed_feed_mm_min", "mm/min (deg/min where rotary_only)"),
            ("acceleration_mm_s2", "mm/s^2 (deg/s^2 where rotary_only)"),
            ("jerk_mm_s3", "mm/s^3 (deg/s^3 where rotary_only)"),
            ("contour_error_mm", "mm"),
            ("pose", "m"),
            ("log_time", "ns of simulated time from 0"),
        ];
        units.extend(path.map(|(name, unit)| (name.to_owned(), unit.to_owned())));
        units
    }

    /// Metadata of the channel of an axis.
    pub(super) fn axis_channel(&self, axis: &Axis, fields: &[usize]) -> BTreeMap<String, String> {
        let names: Vec<&str> = fields.iter().map(|field| AXIS_FIELDS[*field].name(axis.kind)).collect();
        BTreeMap::from([
            ("axis".to_owned(), axis.name.clone()),
            ("kind".to_owned(), kind_name(axis.kind).to_owned()),
            ("fields".to_owned(), names.join(",")),
        ])
    }

    /// Metadata of the channel of the spindle; `fields`: bits of `SPINDLE_FIELDS`.
    pub(super) fn spindle_channel(fields: u32) -> BTreeMap<String, String> {
        let names = SPINDLE_FIELDS.iter().enumerate().filter(|(field, _)| fields & (1 << field) != 0);
        let names: Vec<&str> = names.map(|(_, name)| *name).collect();
        BTreeMap::from([("fields".to_owned(), names.join(","))])
    }
}

/// Metadata of a program that is opened while the run goes on.
pub(super) fn input_metadata(program: &OpenedProgram) -> io::Result<BTreeMap<String, String>> {
    Ok(BTreeMap::from([(program.name.to_string(), sha256(&program.bytes)?)]))
}

fn kind_name(kind: AxisKind) -> &'static str {
    match kind {
        AxisKind::Linear => "linear",
        AxisKind::Rotary => "rotary",
    }
}

/// What the figures of an axis rest on.
fn drive_standing(axis: &Axis) -> &'static str {
    match &axis.drive {
        None => "ideal",
        Some(drive) if drive.identified => "identified",
        Some(_) => "representative",
    }
}

/// Of a text that may be on the disk.
fn sha256(text: &ProgramText) -> io::Result<String> {
    let mut sum = Sha256::new();
    text.pass(0, |bytes| {
        sum.update(bytes);
        true
    })?;
    Ok(hexadecimal(sum.finalize()))
}

/// In lower case.
fn hexadecimal(bytes: impl IntoIterator<Item = u8>) -> String {
    bytes.into_iter().map(|byte| format!("{byte:02x}")).collect()
}
