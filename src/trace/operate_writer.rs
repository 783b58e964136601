//! A trace -> SINUMERIK Operate trace session (XML), for the control's own viewers.
//!
//! In: a [`Trace`] in memory. Out: a session with one frame: servo signals written where they change, interpolator signals at every
//! sample, six decimals, speeds in mm/min and rev/min, as the control does. Signals that the control has no name for are left out,
//! and said. Gaps cannot be told in this form: values are held over them.

use super::export::{Written, output_fault};
use super::import::ImportOptions;
use super::naming::{AxisMark, operate_name, unit_and_factor};
use super::rows::stream_trace;
use super::signal_map::{Quantity, Rule, SIGNAL_MAP, rule_for};
use super::sink::{Head, Sink};
use super::wire::{Clock, Signal, Trace, TraceEvent, TraceFormat};
use crate::base::{AxisKind, Diagnostic};
use quick_xml::escape::escape;
use std::io::Write;

/// Start of a trace that has no start by the calendar: the same bytes every time.
const NO_START: &str = "2000-01-01T00:00:00.000Z";
const SERVO_PERIOD_S: f64 = 0.002;

/// A signal with all that its head in the file says.
struct Told {
    name: String,
    unit: &'static str,
    /// Value in the file = value * factor.
    factor: f64,
    servo: bool,
    period_s: f64,
    points: usize,
    whole: bool,
}

/// Writes a session.
pub(super) fn write_operate(
    trace: &Trace,
    options: &ImportOptions,
    output: &mut impl Write,
    notes: &mut Vec<Diagnostic>,
) -> Result<Written, Diagnostic> {
    let (mut kept, mut left_out) = (Trace::default(), Vec::new());
    let mut told = Vec::new();
    let span = trace.span_s().unwrap_or((0.0, 0.0));
    for signal in &trace.signals {
        match tell(signal, trace, options, span) {
            Some(entry) => {
                told.push(entry);
                kept.signals.push(signal.clone());
            }
            None => left_out.push(signal.shown_name().to_owned()),
        }
    }
    if told.is_empty() {
        let message = format!("{} has no signal that the control has a name for", trace.name);
        return Err(Diagnostic::error("T0020", message).help("docs/traces.md has the table of names"));
    }
    if !left_out.is_empty() {
        let message = format!("left out, because the control has no name for them: {}", left_out.join(", "));
        notes.push(Diagnostic::note("T0022", message));
    }
    if kept.signals.iter().any(|signal| signal.values.iter().any(|value| value.is_nan())) {
        let message = "gaps cannot be told in this form: values are held over them";
        notes.push(Diagnostic::warning("T0022", message));
    }
    let mut text = head(&told, trace, span.1 - span.0);
    output.write_all(text.as_bytes()).map_err(|error| output_fault(&error))?;
    let mut records = Records {
        bytes: text.len() as u64,
        output,
        last: vec![String::new(); told.len()],
        told: &told,
        span,
        line: String::new(),
        records: 0,
    };
    stream_trace(&kept, &mut records)?;
    let written = Written { rows: records.records, columns: told.len(), bytes: records.bytes };
    text.clear();
    text.push_str(" </dataFrame>\n</traceData>\n</traceSession>\n");
    output.write_all(text.as_bytes()).map_err(|error| output_fault(&error))?;
    Ok(written)
}

/// What the head of the file says of a signal; `None`: the control has no name for it.
fn tell(signal: &Signal, trace: &Trace, options: &ImportOptions, span: (f64, f64)) -> Option<Told> {
    if !signal.labels.is_empty() || signal.is_empty() {
        return None;
    }
    let (name, rule) = controller_name(signal, trace, options)?;
    let quantity = rule.map_or(Quantity::Unknown, |rule| rule.quantity);
    let rotary = signal.unit.starts_with("deg");
    let kind = if rotary { AxisKind::Rotary } else { AxisKind::Linear };
    let (_, factor) = unit_and_factor(quantity, kind);
    let servo = signal.clock != Clock::Interpolator;
    let period_s = signal.times.period_s().unwrap_or(SERVO_PERIOD_S);
    let all = ((span.1 - span.0) / period_s).round() as usize + 1;
    Some(Told {
        name,
        unit: units_type(quantity),
        factor: 1.0 / factor,
        servo,
        period_s,
        points: if servo { all } else { signal.len() },
        whole: signal.discrete,
    })
}

/// The name that the signal came with, or the control's name for ours.
fn controller_name(signal: &Signal, trace: &Trace, options: &ImportOptions) -> Option<(String, Option<&'static Rule>)> {
    if signal.original.contains("/!") {
        let rule = rule_for(TraceFormat::OperateXml, &operate_name(&signal.original).stem);
        return Some((signal.original.clone(), rule));
    }
    let own = signal.axis_signal()?;
    let rule = SIGNAL_MAP.iter().find(|rule| rule.format == TraceFormat::OperateXml && rule.ours == own.stem())?;
    let number = axis_number(own.axis, trace, options);
    let width = if rule.controller == "ActCurr" || rule.controller == "CmdTorque" { 32 } else { 64 };
    Some((format!("/Nck/!SD/nckServoData{}{width} [u1, {number}]", rule.controller), Some(rule)))
}

/// Number of the machine axis: as the user says, by the machine, by the name `AX7`, else its place in the trace.
fn axis_number(axis: &str, trace: &Trace, options: &ImportOptions) -> u32 {
    let given = options.axis_names.iter().find(|(_, name)| name == axis).map(|(number, _)| *number);
    let by_machine =
        || options.machine.and_then(|machine| machine.axes.iter().find(|a| a.name == axis)).map(|a| a.index);
    let by_name = || match operate_name(&format!("aa [u1, {}]", axis.strip_prefix("AX")?)).axis {
        AxisMark::Number(number) => Some(number),
        _ => None,
    };
    let by_place = || trace.axes().iter().position(|name| *name == axis).map(|place| place as u32 + 1);
    given.or_else(by_machine).or_else(by_name).or_else(by_place).unwrap_or(1)
}

fn units_type(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Position => "posn",
        Quantity::Velocity | Quantity::VelocityPerMinute => "velo",
        Quantity::Acceleration => "accel",
        Quantity::Torque => "torque",
        Quantity::Current => "current",
        Quantity::Percent => "percent",
        _ => "none",
    }
}

fn head(told: &[Told], trace: &Trace, length_s: f64) -> String {
    let period = |servo: bool, missing_s: f64| {
        let periods = told.iter().filter(|entry| entry.servo == servo).map(|entry| entry.period_s);
        periods.min_by(f64::total_cmp).unwrap_or(missing_s)
    };
    let servo_s = period(true, SERVO_PERIOD_S);
    let ipo_s = period(false, 2.0 * servo_s);
    let mut text = String::from(
        "<?xml version=\"1.0\" encoding=\"utf-8\" ?>\n<!--XML file generated by sollwert-->\n<traceSession version=\"01.00.03.02\">\n",
    );
    text += "<traceCaptureSetup_V20>\n <collectionSettings capacity=\"5.77853e+07\" powerOnStart=\"false\" atCapacity=\"discard\" \
             appendData=\"false\" timeLimit=\"996\" deferOffload=\"false\" autoRestart=\"false\" endless=\"false\"/>\n";
    let session = escape(trace.name.rsplit(['/', '\\']).next().unwrap_or("trace"));
    text += &format!(
        " <sessionSettings clientPrivilegeManage=\"exclusive\" archiveSetting=\"NCU\" sessionName=\"{session}\" \
         clientPrivilegeRead=\"password\" expirationPeriod=\"0\"/>\n"
    );
    text += &format!(
        " <sampleRateSettings servoSampleRate=\"{servo_s}\" ipo1SampleRate=\"{ipo_s}\" ipo2SampleRate=\"{ipo_s}\"/>\n <signalSettings>\n"
    );
    for (place, entry) in told.iter().enumerate() {
        text += &format!("  <signal key=\"s{}\" {}/>\n", place + 1, signal_attributes(entry));
    }
    text += " </signalSettings>\n</traceCaptureSetup_V20>\n<traceData dataFrames=\"1\">\n <dataFrame>\n";
    let start = trace.origin.start_utc.as_deref().unwrap_or(NO_START);
    text += &format!(
        "  <frameHeader dropOuts=\"0\" startTime=\"{}\" stopInc=\"{length_s:.6}\" startTriggerInc=\"0.000000\" \
         stopTriggerInc=\"0.000000\"/>\n",
        escape(start)
    );
    for (place, entry) in told.iter().enumerate() {
        let (id, points) = (place + 1, entry.points);
        text += &format!(
            "  <dataSignal key=\"s{id}\" id=\"f{id}\" interval=\"{:.6}\" datapointCount=\"{points}\" {}/>\n",
            entry.period_s,
            signal_attributes(entry)
        );
    }
    text
}

fn signal_attributes(entry: &Told) -> String {
    let event = if entry.servo { 255 } else { 1 };
    let (name, unit) = (escape(&entry.name), entry.unit);
    let data = if entry.whole { "dword" } else { "double" };
    format!(
        "domain=\"NCU_1\" event=\"{event}\" eventChannel=\"1\" name=\"{name}\" description=\"\" displayRes=\"5\" unitsType=\"{unit}\" \
         dataType=\"{data}\""
    )
}

/// Writes the records.
struct Records<'a, W> {
    output: &'a mut W,
    told: &'a [Told],
    /// Text of the last value of each signal.
    last: Vec<String>,
    span: (f64, f64),
    line: String,
    records: u64,
    bytes: u64,
}

impl<W: Write> Sink for Records<'_, W> {
    fn begin(&mut self, _: &[Head]) -> Result<(), Diagnostic> {
        Ok(())
    }

    fn word(&mut self, _: usize, _: &str) {}

    fn row(&mut self, time_s: f64, cells: &[(usize, f64)]) -> Result<(), Diagnostic> {
        let ends = time_s >= self.span.1 || self.records == 0;
        self.line.clear();
        for (place, value) in cells.iter().filter(|(_, value)| !value.is_nan()) {
            let (entry, last) = (&self.told[*place], &mut self.last[*place]);
            let scaled = value * entry.factor;
            let text = if entry.whole { format!("{scaled:.0}") } else { format!("{scaled:.6}") };
            if !entry.servo || ends || text != *last {
                self.line += &format!(" f{}=\"{text}\"", place + 1);
            }
            *last = text;
        }
        if self.line.is_empty() {
            return Ok(());
        }
        let text = format!("  <rec time=\"{:.6}\"{}/>\n", time_s - self.span.0, self.line);
        self.records += 1;
        self.bytes += text.len() as u64;
        self.output.write_all(text.as_bytes()).map_err(|error| output_fault(&error))
    }

    fn event(&mut self, _: TraceEvent) -> Result<(), Diagnostic> {
        Ok(())
    }
}
