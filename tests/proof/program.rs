//! Random programs that can be taken apart: every block holds its way, not its end, so that what is left when blocks are dropped is a
//! program again, and the reverse of a program is one as well.
//!
//! In: random numbers, the axes of a machine. Out: [`Program`], which prints as NC text.

use crate::random::Random;
use crate::settings::Settings;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write;

/// One value an axis, in the machine's order; mm and degrees.
pub type Way = [f64; 5];

/// A program: its blocks, in order.
#[derive(Clone, Debug, Default)]
pub struct Program {
    pub blocks: Vec<Block>,
}

/// What stands in one line (a spline: in several).
#[derive(Clone, Debug)]
pub enum Block {
    /// Modes.
    Word(String),
    /// A motion with its F.
    Motion { feed: f64, motion: Motion },
    /// G4, seconds.
    Dwell(f64),
}

/// A motion from wherever the one before ended.
#[derive(Clone, Debug)]
pub enum Motion {
    Rapid(Way),
    Line(Way),
    /// In X and Y, the centre from the start; all other axes go along by `way`.
    Arc {
        centre: [f64; 2],
        sweep_rad: f64,
        way: Way,
    },
    /// ASPLINE, BSPLINE, CSPLINE through (or near) points.
    Spline {
        word: &'static str,
        ways: Vec<Way>,
    },
    /// POLY: the end, and coefficients of u² and u³.
    Poly {
        way: Way,
        bends: Way,
        twists: Way,
    },
}

/// Digits of the positions of lines.
const DECIMALS: i32 = 4;

/// Digits of the ends of arcs.
const ARC_DECIMALS: usize = 6;

fn rounded(value: f64) -> f64 {
    let grid = 10_f64.powi(DECIMALS);
    (value * grid).round() / grid
}

struct Maker<'a> {
    random: &'a mut Random,
    settings: &'a Settings,
    blocks: Vec<Block>,
    at: [f64; 3],
    heading_rad: f64,
    feed: f64,
    /// F changes in every block.
    restless: bool,
    /// Modes change on the way.
    mixed: bool,
}

impl Program {
    /// About `count` motions.
    pub fn random(random: &mut Random, settings: &Settings, count: usize) -> Self {
        let (restless, mixed) = (random.below(3) == 0, random.below(4) == 0);
        let mut maker = Maker {
            random,
            settings,
            blocks: Vec::new(),
            at: [0.0; 3],
            heading_rad: 1.0,
            feed: 3000.0,
            restless,
            mixed,
        };
        maker.mode();
        if maker.random.below(3) == 0 {
            maker.compressor();
        }
        while maker.blocks.len() < count {
            maker.block();
        }
        Self { blocks: maker.blocks }
    }

    /// Some programs without a limit of jerk, all along or on the way.
    pub fn accelerate(&mut self, random: &mut Random) {
        let word = |word: &str| Block::Word(word.to_owned());
        match random.below(8) {
            0 => self.blocks.insert(0, word("BRISK")),
            1 => self.blocks.insert(0, word("DRIVE")),
            2 => {
                let most = self.blocks.len() as u32;
                let mut places = [0; 2].map(|_| random.below(most) as usize);
                places.sort_unstable();
                self.blocks.insert(places[1], word("SOFT"));
                self.blocks.insert(places[0], word(["BRISK", "DRIVE"][random.below(2) as usize]));
            }
            _ => {}
        }
    }

    /// NC text.
    pub fn text(&self, settings: &Settings) -> String {
        self.text_from(settings, [0.0; 5], "").0
    }

    /// The same from a place that `opening` has gone to; and where it ends.
    pub fn text_from(&self, settings: &Settings, start: Way, opening: &str) -> (String, Way) {
        let mut printer = Printer { text: String::from("G17 G90 G71 G94 G1\n") + opening, at: start, settings };
        for block in &self.blocks {
            match block {
                Block::Word(word) => {
                    let _ = writeln!(printer.text, "{word}");
                }
                Block::Dwell(time_s) => {
                    let _ = writeln!(printer.text, "G4 F{time_s:.4}");
                }
                Block::Motion { feed, motion } => printer.motion(*feed, motion),
            }
        }
        (printer.text + "M30\n", printer.at)
    }

    /// The same path the other way; `None` where modes change on the way.
    pub fn reversed(&self) -> Option<Self> {
        // What a compressor makes of the points depends on where it begins.
        if self.compresses() {
            return None;
        }
        let modes = self.blocks.iter().take_while(|block| matches!(block, Block::Word(_))).count();
        let (modes, motions) = self.blocks.split_at(modes);
        let mut blocks = modes.to_vec();
        let reversed: Option<Vec<Block>> = motions.iter().rev().map(Block::reversed).collect();
        blocks.extend(reversed?);
        Some(Self { blocks })
    }

    /// With exact stops instead of corners that are passed, and without a compressor.
    pub fn with_stops(&self) -> Self {
        let stopped = |block: &Block| match block {
            Block::Word(word) if word.starts_with("G64") => Block::Word(String::from("G60")),
            Block::Word(word) if word.starts_with("COMP") => Block::Word(String::from("COMPOF")),
            block => block.clone(),
        };
        Self { blocks: self.blocks.iter().map(stopped).collect() }
    }

    /// A compressor is on somewhere.
    pub fn compresses(&self) -> bool {
        self.blocks.iter().any(|block| matches!(block, Block::Word(word) if word.starts_with("COMP")))
    }

    /// With block `index`, a line, in two; `None` if it is none, or short.
    pub fn split(&self, index: usize, share: f64) -> Option<Self> {
        let Block::Motion { feed, motion: Motion::Line(way) } = self.blocks.get(index)? else { return None };
        if way.iter().map(|x| x * x).sum::<f64>().sqrt() < 5.0 {
            return None;
        }
        let first = way.map(|x| x * share);
        let second: Way = std::array::from_fn(|i| way[i] - first[i]);
        let mut blocks = self.blocks.clone();
        let part = |way: Way| Block::Motion { feed: *feed, motion: Motion::Line(way) };
        blocks.splice(index..=index, [part(first), part(second)]);
        Some(Self { blocks })
    }

    /// Smaller programs: without some blocks, or with a spline that has fewer points; bold ones first.
    pub fn smaller(&self) -> impl Iterator<Item = Self> {
        let count = self.blocks.len();
        let sizes = std::iter::successors(Some(count / 2), |size| Some(size / 2)).take_while(|size| *size > 0);
        let without =
            sizes.flat_map(move |size| (0..count).step_by(size).map(move |from| (from, (from + size).min(count))));
        let dropped = without.map(|(from, to)| {
            let kept = self.blocks[..from].iter().chain(&self.blocks[to..]);
            Self { blocks: kept.cloned().collect() }
        });
        let thinner = (0..count).filter_map(|index| {
            let mut blocks = self.blocks.clone();
            match &mut blocks[index] {
                Block::Motion { motion: Motion::Spline { ways, .. }, .. } if ways.len() > 2 => ways.pop(),
                _ => return None,
            };
            Some(Self { blocks })
        });
        dropped.chain(thinner)
    }
}

impl Block {
    fn reversed(&self) -> Option<Self> {
        let back = |way: &Way| way.map(|x| -x);
        let (feed, motion) = match self {
            Self::Word(_) => return None,
            Self::Dwell(time_s) => return Some(Self::Dwell(*time_s)),
            Self::Motion { feed, motion } => (*feed, motion),
        };
        let motion = match motion {
            Motion::Rapid(way) => Motion::Rapid(back(way)),
            Motion::Line(way) => Motion::Line(back(way)),
            Motion::Arc { centre: [i, j], sweep_rad, way } => {
                let (sin, cos) = sweep_rad.sin_cos();
                Motion::Arc { centre: [i * cos - j * sin, i * sin + j * cos], sweep_rad: -sweep_rad, way: back(way) }
            }
            // The ends of a spline are not the same, and a polynomial would have to be expanded about its other end.
            Motion::Spline { .. } | Motion::Poly { .. } => return None,
        };
        Some(Self::Motion { feed, motion })
    }
}

struct Printer<'a> {
    text: String,
    at: Way,
    settings: &'a Settings,
}

impl Printer<'_> {
    /// Words of the axes that have a way, that of the first axis if none has; moves there.
    fn go(&mut self, way: &Way, digits: usize) {
        for (i, axis) in self.settings.axes.iter().enumerate() {
            if way[i] != 0.0 || (i == 0 && way.iter().all(|x| *x == 0.0)) {
                let word = format!("{:.digits$}", self.at[i] + way[i]);
                self.at[i] = word.parse().unwrap();
                let _ = write!(self.text, " {}{word}", axis.name);
            }
        }
    }

    /// Behind an arc, which ends where it must, as many as there: a way that is rounded again would be another one on the way back.
    fn digits(&self) -> usize {
        if self.at.iter().all(|x| rounded(*x) == *x) { DECIMALS as usize } else { ARC_DECIMALS }
    }

    fn motion(&mut self, feed: f64, motion: &Motion) {
        match motion {
            Motion::Rapid(way) => {
                self.text += "G0";
                self.go(way, self.digits());
                self.text.push('\n');
                return;
            }
            Motion::Line(way) => {
                self.text += "G1";
                // A block that was split has more digits.
                let whole = way.iter().all(|x| rounded(*x) == *x);
                self.go(way, if whole { self.digits() } else { 12 });
            }
            Motion::Arc { centre: [i, j], sweep_rad, way } => {
                self.text += if *sweep_rad > 0.0 { "G3" } else { "G2" };
                let (sin, cos) = sweep_rad.sin_cos();
                let full = sweep_rad.abs() > TAU - 1e-3;
                let mut way = *way;
                way[0] = if full { 0.0 } else { i - i * cos + j * sin };
                way[1] = if full { 0.0 } else { j - i * sin - j * cos };
                self.go(&way, ARC_DECIMALS);
                let _ = write!(self.text, " I{i:.6} J{j:.6}");
            }
            Motion::Spline { word, ways } => {
                self.text += word;
                for (n, way) in ways.iter().enumerate() {
                    self.go(way, DECIMALS as usize);
                    if n == 0 {
                        let _ = write!(self.text, " F{feed:.0}");
                    }
                    self.text.push('\n');
                }
                self.text += "G1\n";
                return;
            }
            Motion::Poly { way, bends, twists } => {
                self.text += "POLY";
                for (i, axis) in self.settings.axes.iter().enumerate() {
                    let end = rounded(self.at[i] + way[i]);
                    self.at[i] = end;
                    let _ = write!(self.text, " PO[{}]=({end:.4},{:.4},{:.4})", axis.name, bends[i], twists[i]);
                }
                let _ = writeln!(self.text, " PL=1 F{feed:.0}\nG1");
                return;
            }
        }
        let _ = writeln!(self.text, " F{feed:.0}");
    }
}

impl Maker<'_> {
    fn mode(&mut self) {
        let (tolerance, distance) = (self.random.between(0.002, 0.2), self.random.between(0.05, 2.0));
        let word = match self.random.below(9) {
            0 => String::from("G60"),
            1 | 2 => String::from("G64"),
            3 => format!("G641 ADIS={distance:.2}"),
            4 | 5 => format!("G642 CTOL={tolerance:.3}"),
            6 => format!("G643 CTOL={tolerance:.3}"),
            7 => String::from("G644"),
            _ => format!("G645 CTOL={tolerance:.3}"),
        };
        self.blocks.push(Block::Word(word));
    }

    fn compressor(&mut self) {
        let word = ["COMPON", "COMPCURV", "COMPCAD", "COMPSURF"][self.random.below(4) as usize];
        self.blocks.push(Block::Word(word.to_owned()));
    }

    fn block(&mut self) {
        let plane = self.settings.linear_axes() >= 2;
        match self.random.below(20) {
            0 if self.mixed => self.mode(),
            1 if self.random.below(4) == 0 => {
                let time_s = self.random.between(0.001, 0.05);
                self.blocks.push(Block::Dwell(time_s));
            }
            2 => self.push(Motion::Line([0.0; 5])),
            3..=6 if plane => self.arc(),
            7 => self.rapid(),
            8 if plane => self.spline(),
            9 if plane && self.random.below(2) == 0 => self.poly(),
            10 if plane => self.chords(),
            11 if self.settings.linear_axes() < self.settings.axes.len() => self.turn_alone(),
            _ => {
                let way = self.line();
                self.push(Motion::Line(way));
            }
        }
    }

    fn push(&mut self, motion: Motion) {
        if self.restless || self.random.below(6) == 0 {
            self.feed = self.random.between(150_f64.ln(), 40_000_f64.ln()).exp().round();
        }
        self.blocks.push(Block::Motion { feed: self.feed, motion });
    }

    fn rapid(&mut self) {
        let way = self.line();
        self.push(Motion::Rapid(way));
    }

    /// The way of rotary axes beside a linear one of `length`, in one block of three: mostly some degrees a millimetre.
    fn turn(&mut self, way: &mut Way, length: f64) {
        let (from, to) = (self.settings.linear_axes(), self.settings.axes.len());
        for way in &mut way[from..to] {
            if self.random.below(3) == 0 {
                let most = if self.random.below(12) == 0 { 90.0 } else { (6.0 * length).min(45.0) };
                *way = rounded(self.random.between(-most, most));
            }
        }
    }

    fn turn_alone(&mut self) {
        let mut way = [0.0; 5];
        self.turn(&mut way, 50.0);
        self.push(Motion::Line(way));
    }

    /// Moves on by `length` along the heading; kept within 60 mm of the origin.
    fn ahead(&mut self, length: f64, climb: f64) -> Way {
        let linear = self.settings.linear_axes();
        let mut way = [0.0; 5];
        if linear == 1 {
            way[0] = length * if self.heading_rad.cos() < 0.0 { -1.0 } else { 1.0 };
        } else {
            way[0] = length * self.heading_rad.cos();
            way[1] = length * self.heading_rad.sin();
        }
        if linear > 2 {
            way[2] = length * climb;
        }
        for (at, way) in self.at.iter_mut().zip(&mut way).take(linear) {
            if (*at + *way).abs() > 60.0 {
                *way = -*way;
                self.heading_rad += FRAC_PI_2;
            }
            *way = rounded(*way);
            *at += *way;
        }
        way
    }

    fn line(&mut self) -> Way {
        let length = self.random.between(0.01_f64.ln(), 50_f64.ln()).exp();
        self.heading_rad += match self.random.below(8) {
            0 => self.random.between(-3.1, 3.1),
            1 => PI,
            2 => PI - self.random.between(0.0, 0.03),
            3 => self.random.between(-1.5e-3, 1.5e-3),
            4 => FRAC_PI_2,
            5 => 0.0,
            _ => self.random.between(-0.4, 0.4),
        };
        let climb = if self.random.below(5) == 0 { self.random.between(-0.5, 0.5) } else { 0.0 };
        let mut way = self.ahead(length, climb);
        self.turn(&mut way, length);
        way
    }

    /// Tangential to the heading or not; now and then a full circle or a helix.
    fn arc(&mut self) {
        let radius = self.random.between(0.1_f64.ln(), 15_f64.ln()).exp();
        let sense = if self.random.below(2) == 0 { 1.0 } else { -1.0 };
        if self.random.below(2) == 0 {
            self.heading_rad = self.random.between(-3.1, 3.1);
        }
        let side = self.heading_rad + sense * FRAC_PI_2;
        let sweep = if self.random.below(6) == 0 { 2.0 * PI } else { self.random.between(0.05, 6.2) };
        let centre = [radius * side.cos(), radius * side.sin()].map(|v| (v * 1e6).round() / 1e6);
        let mut way = [0.0; 5];
        if self.settings.linear_axes() > 2 && self.random.below(4) == 0 {
            way[2] = rounded(self.random.between(-3.0, 3.0));
        }
        self.turn(&mut way, radius * sweep);
        let (sin, cos) = (sense * sweep).sin_cos();
        self.at[0] += centre[0] - centre[0] * cos + centre[1] * sin;
        self.at[1] += centre[1] - centre[0] * sin - centre[1] * cos;
        self.heading_rad += sense * sweep;
        self.push(Motion::Arc { centre, sweep_rad: sense * sweep, way });
    }

    fn spline(&mut self) {
        let word = ["ASPLINE", "BSPLINE", "CSPLINE"][self.random.below(3) as usize];
        let count = 3 + self.random.below(8);
        let step = self.random.between(0.3_f64.ln(), 15_f64.ln()).exp();
        let ways = (0..count).map(|_| {
            self.heading_rad += self.random.between(-0.8, 0.8);
            let length = step * self.random.between(0.4, 1.6);
            self.ahead(length, 0.1)
        });
        let ways = ways.collect();
        self.push(Motion::Spline { word, ways });
    }

    fn poly(&mut self) {
        let length = self.random.between(2.0, 30.0);
        let way = self.ahead(length, 0.0);
        let linear = self.settings.linear_axes();
        let mut some = |size: f64| -> Way {
            std::array::from_fn(|i| if i < linear { rounded(self.random.between(-size, size) * length) } else { 0.0 })
        };
        let (bends, twists) = (some(0.4), some(0.2));
        self.push(Motion::Poly { way, bends, twists });
    }

    /// Short chords of a curve: what mould programs are made of.
    fn chords(&mut self) {
        let step = self.random.between(0.03_f64.ln(), 0.6_f64.ln()).exp();
        let (size, period) = (self.random.between(0.01, 0.25), self.random.between(4.0, 40.0));
        for n in 0..5 + self.random.below(30) {
            self.heading_rad += size * (f64::from(n) / period).sin();
            let way = self.ahead(step, 0.05);
            self.push(Motion::Line(way));
        }
    }
}
