//! The program that tells a control: every kind of block that something in the control may hold back.
//!
//! In: the machine. Out: one [`PlannedProgram`]: corners of all angles, tolerances and feeds, with Z too; G64 corners; arcs that touch; a straight line
//! in blocks so short that the look-ahead ends before the brake does. All of it near the middle of the travel. The trace of its set-points is what
//! `identify --smoothing` is best given. Does not run anything.

use super::plan::{Lines, PlannedProgram, Reach, closing, feed_word, word};
use crate::machine::{Axis, Machine};

/// Half of the room that the program takes at scale 1, to each side.
const HALF_MM: f64 = 30.0;
/// Turns of the corners, and lengths between them at scale 1.
const TURNS_DEG: [f64; 14] =
    [10.0, 70.0, 100.0, -60.0, 135.0, -120.0, 35.0, 90.0, -25.0, -90.0, 115.0, -145.0, 20.0, 160.0];
const LENGTHS_MM: [f64; 14] = [9.0, 6.0, 9.0, 7.0, 10.0, 6.0, 8.0, 5.0, 9.0, 10.0, 6.0, 8.0, 10.0, 5.0];
/// Turns of G64.
const G64_TURNS_DEG: [f64; 12] = [0.0, 3.0, 6.0, 10.0, 15.0, 22.0, -30.0, -4.0, -8.0, -13.0, 45.0, 90.0];
/// Tolerances, and feeds as shares of the highest velocity.
const CORNERS: [(f64, f64); 2] = [(0.08, 0.2), (0.02, 0.06)];
/// Blocks of the straight line, and their length at scale 1.
const SHORT: usize = 140;
const SHORT_MM: f64 = 0.3;
/// Way lost to ramps, as time for each stretch that begins or ends at rest.
const RAMP_S: f64 = 0.2;

/// In words of the program.
struct Pen<'a> {
    axes: [&'a Axis; 2],
    middle: [f64; 2],
    scale: f64,
    lines: Lines,
    feed: f64,
}

impl Pen<'_> {
    /// To a point of the plane, in mm at scale 1 from the middle.
    fn to(&mut self, before: &str, [x, y]: [f64; 2], after: &str) {
        let at = |k: usize, value: f64| word(self.axes[k], self.middle[k] + self.scale * value);
        let text = format!("{before} {} {} {after}", at(0, x), at(1, y));
        self.lines.line(text.trim());
        self.lines.seconds += 8.0 * self.scale / self.feed;
    }

    fn feed(&mut self, speed: f64) -> String {
        self.feed = speed;
        feed_word(speed)
    }

    /// A polyline from the middle, and back to it.
    fn polyline(&mut self, heading_deg: f64, turns_deg: &[f64], lengths_mm: impl Fn(usize) -> f64) {
        let (mut x, mut y, mut heading_deg) = (0.0, 0.0, heading_deg);
        for (place, turn_deg) in turns_deg.iter().enumerate() {
            heading_deg += turn_deg;
            let (sin, cos) = crate::base::units::rad_from_deg(heading_deg).sin_cos();
            let step = |from: f64, share: f64| {
                let to = from + lengths_mm(place) * share;
                // Back inside where it would leave the room.
                if to.abs() > HALF_MM - 5.0 { from - lengths_mm(place) * share } else { to }
            };
            (x, y) = (step(x, cos), step(y, sin));
            self.to("", [x, y], "");
        }
        self.to("", [0.0, 0.0], "");
    }

    /// Arcs that touch, in both senses, from the middle and back.
    fn arcs(&mut self, speed: f64) {
        let feed = self.feed(speed);
        self.lines.line(&format!("; arcs that touch\nG17 G642 CTOL=0.01 {feed}"));
        for (before, point, radius_mm) in [
            ("G1", [10.0, 0.0], 0.0),
            ("G3", [12.0, 2.0], 2.0),
            ("G2", [14.0, 4.0], 2.0),
            ("G1", [14.0, 8.0], 0.0),
            ("G3", [4.0, 18.0], 10.0),
            ("G2", [-1.0, 23.0], 5.0),
            ("G1", [-5.0, 23.0], 0.0),
            ("G3", [-5.8, 22.2], 0.8),
            ("G2", [-9.8, 18.2], 4.0),
            ("G1", [-15.0, 18.2], 0.0),
            ("G1", [0.0, 0.0], 0.0),
        ] {
            let radius = if radius_mm > 0.0 { format!("CR={:.4}", radius_mm * self.scale) } else { String::new() };
            self.to(before, point, &radius);
        }
    }

    /// A straight line in blocks that are shorter than the way to stop.
    fn straight(&mut self, speed: f64) {
        let feed = self.feed(speed);
        self.lines.line(&format!("; blocks that are shorter than the way to stop\nG64 {feed}"));
        let start = [-HALF_MM + 5.0, 0.0];
        self.to("", start, "");
        for k in 1..=SHORT {
            // A little aside, so that no control makes one block of them.
            let aside = if k % 2 == 0 { 0.0 } else { 1e-3 };
            self.lines.seconds -= 8.0 * self.scale / self.feed;
            self.to("", [start[0] + SHORT_MM * k as f64, aside], "");
        }
        self.to("", [0.0, 0.0], "");
    }
}

/// For machines with X and Y.
pub(super) fn control(machine: &Machine, plane: [&Axis; 2], vertical: Option<&Axis>) -> PlannedProgram {
    let reaches = plane.map(Reach::of);
    let scale = (reaches[0].half.min(reaches[1].half) / HALF_MM).min(1.0);
    let velocity = reaches[0].velocity.min(reaches[1].velocity);
    let purpose = "the control: corner smoothing, time law, look-ahead (identify --smoothing)".to_owned();
    let mut pen = Pen {
        axes: plane,
        middle: [reaches[0].middle, reaches[1].middle],
        scale,
        lines: Lines { text: opening(machine, &purpose), seconds: 0.0 },
        feed: 0.1 * velocity,
    };
    let slow = pen.feed(0.1 * velocity);
    pen.to("G1", [0.0, 0.0], &slow);
    let lift = vertical.map(|axis| (axis, Reach::of(axis)));
    if let Some((axis, reach)) = &lift {
        pen.lines.line(&format!("G1 {}", word(axis, reach.middle)));
    }
    pen.lines.rest(1.0);
    pen.lines.seconds = 0.0;
    pen.lines.line("$AN_SLTRACE=1");
    pen.lines.rest(0.5);
    for (place, (tolerance_mm, share)) in CORNERS.into_iter().enumerate() {
        let feed = pen.feed(share * velocity);
        pen.lines.line(&format!("G642 CTOL={tolerance_mm} G1 {feed}"));
        pen.polyline(40.0 * place as f64, &TURNS_DEG, |k| LENGTHS_MM[k]);
    }
    if let Some((axis, reach)) = &lift {
        let feed = pen.feed(0.15 * velocity);
        pen.lines.line(&format!("; corners with {}\nCTOL=0.05 {feed}", axis.name));
        let z = |share: f64| word(axis, reach.middle + share * scale.min(reach.half / HALF_MM) * 1.0);
        for (point, height) in [
            ([0.0, 0.0], 6.0),
            ([8.0, 0.0], 6.0),
            ([16.0, 0.0], 2.0),
            ([16.0, 0.0], 9.0),
            ([16.0, 7.0], 3.0),
            ([16.0, 14.0], 8.0),
            ([16.0, 14.0], 0.0),
            ([0.0, 0.0], 0.0),
        ] {
            pen.to("", point, &z(height));
        }
    }
    let feed = pen.feed(0.12 * velocity);
    pen.lines.line(&format!("; corners without rounding\nG64 {feed}"));
    pen.polyline(0.0, &G64_TURNS_DEG, |_| 5.0);
    pen.arcs(0.2 * velocity);
    pen.straight(0.8 * velocity);
    pen.lines.seconds += 10.0 * RAMP_S;
    pen.lines.rest(0.5);
    closing(&mut pen.lines);
    PlannedProgram {
        name: "identify_control.mpf".to_owned(),
        axes: plane.iter().copied().chain(vertical).map(|axis| axis.name.clone()).collect(),
        text: pen.lines.text,
        trace_s: pen.lines.seconds,
        purpose,
    }
}

fn opening(machine: &Machine, purpose: &str) -> String {
    format!(
        "; {purpose}, machine {}\n; written by sollwert identify --plan: check travel and clamping before you run it\n\
         ; trace the position set-points from $AN_SLTRACE=1 to =2\nG90 G94 G60 G601 SOFT\n",
        machine.name
    )
}
