//! Writes Operate sessions with the nasty properties of real ones: attributes in any order, ids in any order, sparse records, two
//! clocks, several frames, with and without `_V20`.
//!
//! In: signals as functions of time. Out: the bytes of a session. Knows nothing of the importer.

use super::random::Random;

/// A signal of a session.
#[derive(Clone)]
pub struct Told {
    pub name: &'static str,
    pub servo: bool,
    pub whole: bool,
    /// Value in the unit of the control.
    pub value: fn(f64) -> f64,
}

/// A session.
#[derive(Clone)]
pub struct Session {
    pub seed: u64,
    pub v20: bool,
    /// Start of each frame by the clock of the control, and its length in servo cycles.
    pub frames: Vec<(&'static str, u32)>,
    pub signals: Vec<Told>,
    pub drop_outs: u32,
}

pub const SERVO_S: f64 = 0.002;

impl Session {
    pub fn new(signals: Vec<Told>) -> Self {
        Self { seed: 1, v20: true, frames: vec![("2026-06-03T17:57:40.613Z", 500)], signals, drop_outs: 0 }
    }

    pub fn text(&self) -> String {
        let mut random = Random::new(self.seed);
        // Ids of the columns: not in the order of the list.
        let mut ids: Vec<usize> = (1..=self.signals.len()).collect();
        for k in (1..ids.len()).rev() {
            ids.swap(k, random.below(k as u32 + 1) as usize);
        }
        let version = if self.v20 { "_V20" } else { "" };
        let mut text = String::from("<?xml version=\"1.0\" encoding=\"utf-8\" ?>\n<!-- <rec time=\"9\"/> -->\n");
        text += &format!("<traceSession version=\"01.00.03.02\">\n<traceCaptureSetup{version}>\n<sampleRateSettings ");
        text += &format!("servoSampleRate=\"{SERVO_S}\" ipo1SampleRate=\"0.004\"/>\n<signalSettings>\n");
        for told in &self.signals {
            let name = ("name", told.name.to_owned());
            text += &format!("<signal {}/>\n", shuffled(&mut random, vec![name, ("unitsType", "torque".into())]));
        }
        text += &format!("</signalSettings>\n</traceCaptureSetup{version}>\n");
        text += &format!("<traceData dataFrames=\"{}\">", self.frames.len());
        for (start, cycles) in &self.frames {
            text += &self.frame(&mut random, &ids, start, *cycles);
        }
        text + "</traceData>\n</traceSession>\n"
    }

    fn frame(&self, random: &mut Random, ids: &[usize], start: &str, cycles: u32) -> String {
        let mut text = String::from("<dataFrame>\n");
        let length_s = f64::from(cycles) * SERVO_S;
        let drop_outs = self.drop_outs.to_string();
        let header = vec![
            ("dropOuts", drop_outs),
            ("startTime", start.to_owned()),
            ("stopInc", format!("{length_s:.6}")),
            ("startTriggerInc", "0.000000".to_owned()),
        ];
        text += &format!("<frameHeader {}/>\n", shuffled(random, header));
        for (told, id) in self.signals.iter().zip(ids) {
            let points = if told.servo { cycles + 1 } else { cycles.div_ceil(2) };
            let attributes = vec![
                ("key", format!("s{}", id + 4)),
                ("id", format!("f{id}")),
                ("event", if told.servo { "255" } else { "1" }.to_owned()),
                ("interval", if told.servo { "0.002000" } else { "0.004000" }.to_owned()),
                ("datapointCount", points.to_string()),
                ("unitsType", "611DTime1".to_owned()),
                ("dataType", if told.whole { "uword" } else { "double" }.to_owned()),
                ("name", told.name.to_owned()),
                ("description", "a &lt; b &amp; c".to_owned()),
            ];
            text += &format!("<dataSignal {}/>\n", shuffled(random, attributes));
        }
        text += &self.records(random, ids, cycles);
        text + "</dataFrame>\n"
    }

    fn records(&self, random: &mut Random, ids: &[usize], cycles: u32) -> String {
        let mut text = String::new();
        let mut last = vec![String::new(); self.signals.len()];
        for cycle in 0..=cycles {
            let time_s = f64::from(cycle) * SERVO_S;
            let ends = cycle == 0 || cycle == cycles;
            let mut attributes = Vec::new();
            for ((told, id), last) in self.signals.iter().zip(ids).zip(&mut last) {
                let value = (told.value)(time_s);
                let shown = if told.whole { format!("{value:.0}") } else { format!("{value:.6}") };
                let due = if told.servo { ends || shown != *last } else { cycle % 2 == 1 };
                if due {
                    attributes.push((format!("f{id}"), shown.clone()));
                }
                *last = shown;
            }
            if !attributes.is_empty() {
                attributes.push(("time".to_owned(), format!("{time_s:.6}")));
                text += &format!("<rec {}/>\n", shuffled(random, attributes));
            }
        }
        text
    }
}

fn shuffled<K: AsRef<str>>(random: &mut Random, mut attributes: Vec<(K, String)>) -> String {
    for k in (1..attributes.len()).rev() {
        attributes.swap(k, random.below(k as u32 + 1) as usize);
    }
    let text: Vec<String> = attributes.iter().map(|(key, value)| format!("{}=\"{value}\"", key.as_ref())).collect();
    text.join(" ")
}

/// Stands, moves at 90 (mm or deg)/s from 0.2 s to 0.7 s, stands.
pub fn position(time_s: f64) -> f64 {
    -300.0 + 90.0 * (time_s.clamp(0.2, 0.7) - 0.2)
}

/// Speed of `position`, as an interpolator signal shows it.
pub fn speed_per_s(time_s: f64) -> f64 {
    if (0.2..0.7).contains(&time_s) { 90.0 } else { 0.0 }
}
