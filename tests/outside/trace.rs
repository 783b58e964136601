//! A program run by the binary, and its recording read back into columns.

use sollwert::recorder::{AXIS_FIELDS, Content, Recording, TopicKind};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// One message of the path.
pub struct PathRow {
    pub time_ns: u64,
    pub block: u64,
    pub line: u32,
    pub feed_mm_min: f64,
    pub contour_error_mm: f64,
    pub limit_kind: String,
}

/// One event.
pub struct EventRow {
    pub time_ns: u64,
    pub kind: String,
    pub text: String,
    pub block: u64,
    pub line: u32,
    pub number: f64,
}

/// One pose: metres and x, y, z, w.
pub struct PoseRow {
    pub time_ns: u64,
    pub frame: String,
    pub position_m: [f64; 3],
    pub quaternion: [f64; 4],
}

/// Signals of an axis: times in ns, and one column a field, by the field's name without its unit.
type AxisColumns = (Vec<u64>, BTreeMap<&'static str, Vec<f64>>);

/// Everything that was recorded.
pub struct Trace {
    pub path: PathBuf,
    /// Per axis.
    pub axes: BTreeMap<String, AxisColumns>,
    pub rows: Vec<PathRow>,
    pub events: Vec<EventRow>,
    pub poses: [Vec<PoseRow>; 2],
    pub recording: Recording,
}

pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("outside").join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// `sollwert run part.mpf -o part.mcap ...` in a folder of its own.
pub fn run(name: &str, text: &str, words: &[&str]) -> PathBuf {
    let folder = folder(name);
    std::fs::write(folder.join("part.mpf"), text).unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_sollwert"))
        .args(["run", "part.mpf", "-o", "part.mcap", "--json"])
        .args(words)
        .current_dir(&folder)
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    folder.join("part.mcap")
}

pub fn trace(name: &str, text: &str, words: &[&str]) -> Trace {
    let path = run(name, text, words);
    let recording = Recording::open(&path).unwrap();
    let mut trace = Trace {
        path,
        axes: BTreeMap::new(),
        rows: Vec::new(),
        events: Vec::new(),
        poses: [Vec::new(), Vec::new()],
        recording,
    };
    let kinds: Vec<TopicKind> = trace.recording.topics().iter().map(|topic| topic.kind.clone()).collect();
    let poses = trace.recording.topics().iter().map(|topic| usize::from(topic.name.ends_with("actual")));
    let poses: Vec<usize> = poses.collect();
    for message in trace.recording.messages().unwrap() {
        let message = message.unwrap();
        let time_ns = message.time_ns;
        match (&kinds[message.topic], message.content) {
            (TopicKind::Axis { name, .. }, Content::Axis(sample)) => {
                let (times, columns) = trace.axes.entry(name.clone()).or_default();
                times.push(time_ns);
                for (place, field) in AXIS_FIELDS.iter().enumerate() {
                    if let Some(value) = sample.get(place) {
                        columns.entry(field.stem).or_default().push(value);
                    }
                }
            }
            (_, Content::Path(row)) => trace.rows.push(PathRow {
                time_ns,
                block: row.block.unwrap(),
                line: row.line.unwrap(),
                feed_mm_min: row.feed_mm_min.unwrap(),
                contour_error_mm: row.contour_error_mm.unwrap_or(0.0),
                limit_kind: row.limit_kind.clone().unwrap_or_default(),
            }),
            (_, Content::Event(event)) => trace.events.push(EventRow {
                time_ns,
                kind: event.kind.clone().unwrap(),
                text: event.text.clone().unwrap_or_default(),
                block: event.block.unwrap_or(0),
                line: event.line.unwrap_or(0),
                number: event.speed_rpm.or(event.m_function.map(f64::from)).or(event.feed_mm_s).unwrap_or(0.0),
            }),
            (_, Content::Pose(_, pose)) => {
                let inner = pose.pose.as_ref().unwrap();
                let (p, q) = (inner.position.as_ref().unwrap(), inner.orientation.as_ref().unwrap());
                trace.poses[poses[message.topic]].push(PoseRow {
                    time_ns,
                    frame: pose.frame_id.clone().unwrap(),
                    position_m: [p.x, p.y, p.z].map(Option::unwrap),
                    quaternion: [q.x, q.y, q.z, q.w].map(Option::unwrap),
                });
            }
            _ => {}
        }
    }
    trace
}

impl Trace {
    /// A column of an axis.
    pub fn column(&self, axis: &str, field: &str) -> &[f64] {
        &self.axes[axis].1[field]
    }
}
