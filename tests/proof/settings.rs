//! Random machines: one to five axes, linear and rotary, one of them often ten times weaker than the others in one of its limits.
//!
//! In: random numbers. Out: [`Settings`], which print as the machine file that they are.

use crate::random::Random;
use sollwert::base::SourceText;
use sollwert::machine::{self, Machine};
use std::fmt::Write;

/// Which law plans the speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    SevenPhase,
    Continuous,
}

impl Law {
    pub fn word(self) -> &'static str {
        match self {
            Self::SevenPhase => "seven-phase",
            Self::Continuous => "continuous",
        }
    }
}

/// One axis, in customary units (m/min, m/s², m/s³; rpm, rot/s², rot/s³).
#[derive(Clone, Debug)]
pub struct Axis {
    pub name: &'static str,
    pub velocity_max: f64,
    pub acceleration_max: f64,
    pub jerk_max: f64,
    pub transition_jerk_max: Option<f64>,
    /// DRIVE: share of the velocity above which the acceleration is lower, and share of the acceleration that is taken off.
    pub reduction: Option<[f64; 2]>,
}

/// One machine.
#[derive(Clone, Debug)]
pub struct Settings {
    pub law: Law,
    pub quintic: bool,
    pub t_cyl_ms: f64,
    pub look_ahead_blocks: u32,
    pub axes: Vec<Axis>,
    /// `[kinematics]` as written; empty for most.
    pub kinematics: String,
}

/// Axes A, B and C are rotary.
const AXES: [&[&str]; 8] = [
    &["X"],
    &["X", "Y"],
    &["X", "Y", "Z"],
    &["X", "Y", "Z"],
    &["X", "C"],
    &["X", "Y", "C"],
    &["X", "Y", "Z", "A"],
    &["X", "Y", "Z", "B", "C"],
];

impl Settings {
    pub fn random(random: &mut Random, law: Law) -> Self {
        let names = AXES[random.below(AXES.len() as u32) as usize];
        let mut axes: Vec<Axis> = names.iter().map(|name| Axis::random(random, name)).collect();
        if random.below(2) == 0 {
            let weak = random.below(axes.len() as u32) as usize;
            let axis = &mut axes[weak];
            match random.below(4) {
                0 => axis.velocity_max *= 0.1,
                1 => axis.acceleration_max *= 0.1,
                2 => axis.jerk_max *= 0.1,
                _ => axis.transition_jerk_max = Some(0.1 * axis.transition_jerk_max.unwrap_or(axis.jerk_max)),
            }
        }
        Self {
            law,
            quintic: random.below(2) == 0,
            t_cyl_ms: [1.0, 2.0, 4.0][random.below(3) as usize],
            look_ahead_blocks: [1, 3, 10, 50, 50, 200][random.below(6) as usize],
            axes,
            kinematics: String::new(),
        }
    }

    /// A machine with turning tables or heads and its chain.
    pub fn five_axes(random: &mut Random, law: Law) -> Self {
        let joint = |axis: &str, direction: &str, point: [f64; 3], carries: &str| {
            format!(
                "    {{ axis = \"{axis}\", direction = {direction}, point_mm = {point:?}, carries = \"{carries}\" }},\n"
            )
        };
        let mut point = || [0.0; 3].map(|_: f64| random.between(-100.0, 100.0).round());
        let (names, kind, joints): (&[&'static str], _, _) = match point()[0].abs() as u32 % 3 {
            0 => (
                &["X", "Y", "Z", "A", "C"],
                "table-table",
                joint("A", "[-1, 0, 0]", point(), "part") + &joint("C", "[0, 0, -1]", point(), "part"),
            ),
            1 => (
                &["X", "Y", "Z", "B", "C"],
                "head-table",
                joint("B", "[0, 1, 0]", point(), "tool") + &joint("C", "[0, 0, 1]", point(), "part"),
            ),
            _ => (
                &["X", "Y", "Z", "B", "C"],
                "table-table",
                joint("B", "[0, 0.6, 0.8]", point(), "part") + &joint("C", "[0, 0, 1]", point(), "part"),
            ),
        };
        let kinematics = format!("[kinematics]\ntype = \"{kind}\"\nrotary = [\n{joints}]\n");
        let axes = names.iter().map(|name| Axis::random(random, name)).collect();
        Self { axes, kinematics, ..Self::random(random, law) }
    }

    /// Some axes have less acceleration at high speed.
    pub fn reduce(&mut self, random: &mut Random) {
        for axis in &mut self.axes {
            if random.below(2) == 0 {
                axis.reduction = Some([round(random.between(0.1, 0.9)), round(random.between(0.1, 0.9))]);
            }
        }
    }

    /// The machine file.
    pub fn text(&self) -> String {
        let Self { law, quintic, t_cyl_ms, look_ahead_blocks, axes, kinematics } = self;
        let shape = if *quintic { "quintic" } else { "hermite3" };
        let mut text = format!(
            "format = 1\nname = \"proof\"\n[cycle]\nt_cyl_ms = {t_cyl_ms:?}\nf_s = 1.0\n\
             [look_ahead]\nblocks = {look_ahead_blocks}\n[feed]\ntime_law = \"{}\"\n[smoothing]\nshape = \"{shape}\"\n",
            law.word()
        );
        text += kinematics;
        for axis in axes {
            axis.write(&mut text);
        }
        text
    }

    pub fn machine(&self) -> Machine {
        let text = self.text();
        match machine::parse(&SourceText::new("proof.toml", text.clone()), &[]) {
            Ok(loaded) => loaded.machine,
            Err(findings) => panic!("{}\n{text}", findings[0].render(false)),
        }
    }

    /// Axes that move along a line in mm.
    pub fn linear_axes(&self) -> usize {
        self.axes.iter().filter(|axis| !axis.rotary()).count()
    }
}

impl Axis {
    fn random(random: &mut Random, name: &'static str) -> Self {
        let mut logarithmic = |low: f64, high: f64| round(random.between(low.ln(), high.ln()).exp());
        let (velocity_max, acceleration_max, jerk_max) = if name < "U" {
            (logarithmic(5.0, 60.0), logarithmic(0.5, 10.0), logarithmic(3.0, 200.0))
        } else {
            (logarithmic(8.0, 60.0), logarithmic(0.5, 10.0), logarithmic(5.0, 300.0))
        };
        let share = [None, Some(0.5), Some(1.0)][random.below(3) as usize];
        let transition_jerk_max = share.map(|share| round(share * jerk_max));
        Self { name, velocity_max, acceleration_max, jerk_max, transition_jerk_max, reduction: None }
    }

    pub fn rotary(&self) -> bool {
        self.name < "U"
    }

    fn write(&self, text: &mut String) {
        let [kind, v, a, j] =
            if self.rotary() { ["rotary", "rpm", "rot_s2", "rot_s3"] } else { ["linear", "m_min", "m_s2", "m_s3"] };
        let Self { name, velocity_max, acceleration_max, jerk_max, transition_jerk_max, reduction } = self;
        let _ = write!(
            text,
            "[axes.{name}]\nkind = \"{kind}\"\nvelocity_max_{v} = {velocity_max:?}\n\
             acceleration_max_{a} = {acceleration_max:?}\njerk_max_{j} = {jerk_max:?}\n"
        );
        if let Some(transition) = transition_jerk_max {
            let _ = writeln!(text, "transition_jerk_max_{j} = {transition:?}");
        }
        if let Some([velocity, acceleration]) = reduction {
            let _ = writeln!(
                text,
                "acceleration_reduction_velocity_ratio = {velocity:?}\nacceleration_reduction_ratio = {acceleration:?}"
            );
        }
    }
}

/// To three digits: what people write.
fn round(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap()
}
