//! The machines of tests and benches: made as users make theirs, from a machine file and `--set` arguments.
//!
//! In: the name of a shipped machine, or names of axes, and `--set` arguments. Out: a checked [`Machine`]. Does not build one field by
//! field: a test that needs what no machine file can say changes that field itself, where it can be seen.
#![allow(dead_code)]

use sollwert::base::SourceText;
use sollwert::machine::{self, Machine};

/// Clock and look-ahead of [Essid 2019, table 2]; all else is the default of the format.
const CONTROL: &str = "format = 1\nname = \"test\"\n[cycle]\nt_cyl_ms = 8.0\nf_s = 0.125\n[look_ahead]\nblocks = 8\n";

/// A linear axis of [Essid 2019, table 2].
const LINEAR: &str = "\
velocity_max_m_min = 20.0
acceleration_max_m_s2 = 1.0
jerk_max_m_s3 = 15.0
transition_jerk_max_m_s3 = 10.0
";

/// The tilting table A of the shipped Mikron UCP 710.
const ROTARY: &str = "\
kind = \"rotary\"
velocity_max_rpm = 15.0
acceleration_max_rot_s2 = 0.83
jerk_max_rot_s3 = 5.0
";

/// A shipped machine.
pub fn shipped(name: &str, sets: &[&str]) -> Machine {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    match machine::load(name, &sets) {
        Ok(loaded) => loaded.machine,
        Err(error) => panic!("{}", error.diagnostics()[0].render(false)),
    }
}

/// The control of the Spinner MVC 850 with these axes, in this order, all alike; A, B and C are rotary. Without travel, home or drives.
pub fn with_axes(axes: &[&str], sets: &[&str]) -> Machine {
    let table = |name: &&str| format!("[axes.{name}]\n{}", if *name < "U" { ROTARY } else { LINEAR });
    let text = CONTROL.to_owned() + &axes.iter().map(table).collect::<String>();
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    match machine::parse(&SourceText::new("test.toml", text), &sets) {
        Ok(loaded) => loaded.machine,
        Err(findings) => panic!("{}", findings[0].render(false)),
    }
}
