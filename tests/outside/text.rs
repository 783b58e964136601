//! Seeded random programs as NC text, with the places where planners go wrong.

pub use crate::random::Random;
use std::fmt::Write;

/// What a program may hold.
#[derive(Clone, Copy, PartialEq)]
pub enum Kind {
    /// Lines only, G642 and G641.
    Rounded,
    /// Everything in G64.
    Continuous,
    /// Everything, modes change.
    Mixed,
    /// Everything in G643, G644, G645.
    Smoothed,
}

struct Writer {
    text: String,
    random: Random,
    at: [f64; 3],
    heading: f64,
    rotary: Vec<&'static str>,
}

/// A program of about `blocks` motions that stays within a cube of 100 mm. `rotary`: names of rotary axes to move along.
pub fn program(seed: u64, kind: Kind, blocks: usize, rotary: &[&'static str]) -> String {
    let random = Random::new(seed);
    let mut writer = Writer { text: String::new(), random, at: [0.0; 3], heading: 1.0, rotary: rotary.to_vec() };
    writer.text += "G17 G90 G71\nG0 X0 Y0 Z20\n";
    writer.text += match kind {
        Kind::Rounded => "G642 CTOL=0.08\n",
        Kind::Continuous => "G64\n",
        Kind::Mixed => "G60\n",
        Kind::Smoothed => "G643 CTOL=0.05\n",
    };
    writer.text += "G1 Z10 F2000\n";
    writer.at = [0.0, 0.0, 10.0];
    for _ in 0..blocks {
        writer.block(kind);
    }
    writer.text += "G1 X1.5 Y-2.25 Z3.125\nM30\n";
    writer.text
}

impl Writer {
    fn say(&mut self, words: std::fmt::Arguments<'_>) {
        self.text.write_fmt(words).unwrap();
    }

    fn block(&mut self, kind: Kind) {
        let everything = kind != Kind::Rounded;
        match self.random.below(24) {
            0 => {
                let f = [300.0, 1500.0, 4000.0, 12000.0, 40000.0][self.random.below(5) as usize];
                self.say(format_args!("F{f}\n"));
            }
            1 if kind == Kind::Rounded => {
                let (tolerance, distance) = (self.random.between(0.005, 0.3), self.random.between(0.02, 2.0));
                match self.random.below(3) {
                    0 => self.say(format_args!("G641 ADIS={distance:.3}\n")),
                    _ => self.say(format_args!("G642 CTOL={tolerance:.4}\n")),
                }
            }
            1 if kind == Kind::Mixed => {
                let mode = ["G60", "G64", "G641 ADIS=0.4", "G642 CTOL=0.03"][self.random.below(4) as usize];
                self.say(format_args!("{mode}\n"));
            }
            1 if kind == Kind::Smoothed => {
                let mode = ["G643 CTOL=0.05", "G644", "G645 CTOL=0.03", "G642 CTOL=0.1"][self.random.below(4) as usize];
                self.say(format_args!("{mode}\n"));
            }
            2 if everything => {
                let time_s = self.random.between(0.001, 0.1);
                self.say(format_args!("G4 F{time_s:.4}\n"));
            }
            3 => {
                // No displacement at all.
                let [x, y, z] = self.at;
                self.say(format_args!("G1 X{x:.6} Y{y:.6} Z{z:.6}\n"));
            }
            4..=7 if everything => self.arc(),
            8 if everything => self.line("G0"),
            _ => self.line("G1"),
        }
    }

    fn line(&mut self, word: &str) {
        let length = (self.random.between(0.01_f64.ln(), 50_f64.ln())).exp();
        self.heading += match self.random.below(8) {
            0 => self.random.between(-3.1, 3.1),
            1 => std::f64::consts::PI,
            2 => std::f64::consts::PI - self.random.between(0.0, 0.03),
            3 => self.random.between(-1.5e-3, 1.5e-3),
            4 => std::f64::consts::FRAC_PI_2,
            5 => 0.0,
            _ => self.random.between(-0.4, 0.4),
        };
        let climb = if self.random.below(5) == 0 { self.random.between(-0.5, 0.5) } else { 0.0 };
        let mut next = [
            self.at[0] + length * self.heading.cos(),
            self.at[1] + length * self.heading.sin(),
            self.at[2] + length * climb,
        ];
        for (i, value) in next.iter_mut().enumerate() {
            if value.abs() > 50.0 {
                *value = if i == 2 { 10.0 } else { -0.5 * *value };
            }
            *value = (*value * 1e4).round() / 1e4;
        }
        self.at = next;
        let [x, y, z] = next;
        self.say(format_args!("{word} X{x:.4} Y{y:.4} Z{z:.4}"));
        self.turn(3);
        if self.random.below(8) == 0 && !self.rotary.is_empty() {
            // Alone.
            self.text += "\nG1";
            self.turn(1);
        }
        self.text.push('\n');
    }

    /// A word of a rotary axis, in one block of `every`.
    fn turn(&mut self, every: u32) {
        if !self.rotary.is_empty() && self.random.below(every) == 0 {
            let axis = self.rotary[self.random.below(self.rotary.len() as u32) as usize];
            let angle = self.random.between(-25.0, 80.0);
            self.say(format_args!(" {axis}{angle:.3}"));
        }
    }

    /// An arc, a full circle or a helix, tangential to the heading or not.
    fn arc(&mut self) {
        let radius = (self.random.between(0.1_f64.ln(), 15_f64.ln())).exp();
        let counter = self.random.below(2) == 0;
        if self.random.below(2) == 0 {
            self.heading = self.random.between(-3.1, 3.1);
        }
        let sense = if counter { 1.0 } else { -1.0 };
        let side = self.heading + sense * std::f64::consts::FRAC_PI_2;
        let [i, j] = [radius * side.cos(), radius * side.sin()].map(|v| (v * 1e6).round() / 1e6);
        let [x, y, z] = self.at;
        let sweep = if self.random.below(4) == 0 { 0.0 } else { self.random.between(0.05, 6.2) };
        let (sin, cos) = (sense * sweep).sin_cos();
        // The centre plus the turned radius.
        let (ex, ey) = (x + i - i * cos + j * sin, y + j - i * sin - j * cos);
        let climbs = self.random.below(4) == 0;
        let ez = if climbs { (z + self.random.between(-3.0, 3.0)).clamp(0.0, 40.0) } else { z };
        if ex.abs() > 60.0 || ey.abs() > 60.0 {
            return;
        }
        let [ex, ey] = if sweep == 0.0 { [x, y] } else { [ex, ey].map(|v| (v * 1e6).round() / 1e6) };
        let ez = (ez * 1e4).round() / 1e4;
        let word = if counter { "G3" } else { "G2" };
        self.say(format_args!("{word} X{ex:.6} Y{ey:.6} Z{ez:.4} I{i:.6} J{j:.6}"));
        self.turn(3);
        self.text.push('\n');
        self.at = [ex, ey, ez];
        self.heading += sense * sweep;
    }
}

/// 0.5 mm chords of a curve with tight and wide bends.
pub fn dense(mode: &str, feed: f64, points: u32) -> String {
    let mut text = format!("G17 G90 G71 {mode}\nG1 X0 Y0 Z0 F{feed}\n");
    let (mut x, mut y, mut heading) = (0.0_f64, 0.0_f64, 0.0_f64);
    for n in 1..=points {
        heading += 0.12 * (f64::from(n) * 0.05).sin() + if n % 97 == 0 { 0.6 } else { 0.0 };
        x += 0.5 * heading.cos();
        y += 0.5 * heading.sin();
        writeln!(text, "X{x:.4} Y{y:.4}").unwrap();
    }
    text + "M30\n"
}

/// Arcs in all planes, by centre and by radius, with extra turns and pitch, between lines.
pub fn planes() -> String {
    let mut text = String::from("G90 G71 G64 G1 X0 Y0 Z20 F4000\n");
    for plane in ["G17", "G18", "G19"] {
        let [first, second, third] = match plane {
            "G17" => ["X", "Y", "Z"],
            "G18" => ["Z", "X", "Y"],
            _ => ["Y", "Z", "X"],
        };
        let (i, j) = (centre_word(first), centre_word(second));
        text += &format!("{plane} G91\nG3 {first}10 {second}10 CR=10\nG2 {first}4 {second}-4 {j}-4 {third}1.5\n");
        text +=
            &format!("G2 {i}-3 TURN=2 {third}6\nG1 {first}5 {second}7 {third}-2\nG3 {first}0 {second}8 CR=-5\nG90\n");
    }
    text + "G1 X0 Y0 Z20\nM30\n"
}

fn centre_word(axis: &str) -> &'static str {
    match axis {
        "X" => "I",
        "Y" => "J",
        _ => "K",
    }
}
