//! `--set`: one value of one run, in the machine and in the text that a recording attaches.

use crate::{MINIMAL, shown};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use sollwert::base::{Diagnostic, SourceText};
use sollwert::machine::{self, Loaded, PathMode};

fn set(text: &str, sets: &[&str]) -> Result<Loaded, Vec<Diagnostic>> {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    machine::parse(&SourceText::new("test.toml", text), &sets)
}

fn spinner(sets: &[&str]) -> Loaded {
    set(machine::shipped()[0].1, sets).unwrap_or_else(|found| panic!("{}", shown(&found)))
}

fn refused(sets: &[&str]) -> String {
    shown(&set(machine::shipped()[0].1, sets).expect_err("accepted"))
}

/// The text as used is a machine file of its own, and the same machine.
fn assert_text_is_the_machine(loaded: &Loaded) {
    let again =
        set(&loaded.text_as_used, &[]).unwrap_or_else(|found| panic!("{}\n{}", shown(&found), loaded.text_as_used));
    assert_eq!(again.machine, loaded.machine, "{}", loaded.text_as_used);
}

#[test]
fn a_value_is_replaced_and_its_comment_kept() {
    let loaded = spinner(&["axes.X.drive.velocity_feedforward=0.95"]);
    let drive = loaded.machine.axes[0].drive.as_ref().expect("a drive");
    assert_eq!(drive.velocity_feedforward_ratio, 0.95);
    assert!(
        loaded.text_as_used.contains("velocity_feedforward = 0.95  # --set, was 1.0; assumed"),
        "{}",
        loaded.text_as_used
    );
    assert_text_is_the_machine(&loaded);
    // Nothing else has changed.
    let before: Vec<&str> = machine::shipped()[0].1.lines().collect();
    let after: Vec<&str> = loaded.text_as_used.lines().collect();
    let changed = before.iter().zip(&after).filter(|(before, after)| before != after).count();
    assert_eq!((before.len(), changed), (after.len(), 1));
}

#[test]
fn without_set_the_text_is_the_file() {
    assert_eq!(spinner(&[]).text_as_used, machine::shipped()[0].1);
}

#[test]
fn words_need_no_quotes() {
    for argument in ["feed.default_path_mode=G641", "feed.default_path_mode=\"G641\"", "feed.default_path_mode = G641 "]
    {
        let loaded = spinner(&[argument]);
        assert_eq!(loaded.machine.feed.default_path_mode, PathMode::G641, "{argument}");
        assert_text_is_the_machine(&loaded);
    }
    let loaded = spinner(&["name=my own machine"]);
    assert_eq!(loaded.machine.name, "my own machine");
}

#[test]
fn keys_and_tables_that_the_file_leaves_out() {
    let loaded = spinner(&[
        "axes.X.mechanics.breakaway_friction_n_m=0.9",
        "smoothing.rounding_distance_mm=0.5",
        "axes.Y.dynamics.finish.jerk_max_m_s3=5",
        "axes.X.travel_mm=[-1, 1]",
    ]);
    let machine = &loaded.machine;
    assert_eq!(machine.axes[0].drive.as_ref().expect("a drive").mechanics.breakaway_friction_n_m, 0.9);
    assert_eq!(machine.smoothing.rounding_distance_mm, Some(0.5));
    assert_eq!(machine.axes[0].travel_lu, Some([-1.0, 1.0]));
    assert!(machine.axes[1].dynamics.get(machine::DynamicsMode::Finish).is_some());
    assert_text_is_the_machine(&loaded);
    let loaded = set(MINIMAL, &["look_ahead.blocks=7", "axes.X.home_mm=3"]).expect("a machine");
    assert_eq!((loaded.machine.look_ahead_blocks, loaded.machine.axes[0].home_lu), (7, 3.0));
    assert_text_is_the_machine(&loaded);
}

#[test]
fn inline_and_dotted_tables() {
    let inline = "format = 1\nname = \"x\"\ncycle = { t_cyl_ms = 2 }\n\
                  axes.X = { velocity_max_m_min = 1, acceleration_max_m_s2 = 1, jerk_max_m_s3 = 1 }\n";
    let dotted = "format = 1\nname = \"x\"\ncycle.t_cyl_ms = 2\naxes.X.velocity_max_m_min = 1\n\
                  axes.X.acceleration_max_m_s2 = 1\naxes.X.jerk_max_m_s3 = 1\n";
    for text in [inline, dotted] {
        let sets =
            ["cycle.f_s=0.5", "axes.X.home_mm=3", "axes.X.jerk_max_m_s3=2", "axes.X.dynamics.norm.jerk_max_m_s3=1"];
        let loaded = set(text, &sets).unwrap_or_else(|found| panic!("{}", shown(&found)));
        assert_eq!(loaded.machine.axes[0].limits.jerk_max_lu_s3, 2000.0);
        assert_text_is_the_machine(&loaded);
    }
}

#[test]
fn the_last_one_counts() {
    let loaded = spinner(&["look_ahead.blocks=7", "look_ahead.blocks=9"]);
    assert_eq!(loaded.machine.look_ahead_blocks, 9);
    assert_text_is_the_machine(&loaded);
}

#[test]
fn faults_are_shown_in_the_argument() {
    let message = refused(&["axes.X.drive.velocity_feedforwrd=0.95"]);
    assert_eq!(message.matches("error").count(), 1, "{message}");
    for words in ["--set:1:1", "axes.X.drive.velocity_feedforwrd", "did you mean velocity_feedforward?"] {
        assert!(message.contains(words), "{message}");
    }
    let cases = [
        ("axes.X.jerk_max_m_s3=-1", "axes.X.jerk_max_m_s3 = -1 m/s³"),
        ("axes.X.jerk_max_m_s3=fast", "expected a number, found the text \"fast\""),
        ("axes.Q.jerk_max_m_s3=1", "the machine has no axis Q"),
        ("axes.x.jerk_max_m_s3=1", "did you mean axes.X?"),
        ("axes.X.jerk_max_m_s3.x=1", "axes.X.jerk_max_m_s3 is the number 15.0, not a table"),
        ("axes.X=1", "axes.X must be a table"),
        ("jerk", "there is no ="),
        ("=1", "is no key"),
        ("a b=1", "is no key"),
        ("name=", "neither a value of TOML nor a word"),
        ("name=[", "neither a value of TOML nor a word"),
        ("name=1\nformat=2", "more than one line"),
        ("feed.time_lw=x", "did you mean time_law?"),
    ];
    for (argument, words) in cases {
        let message = refused(&[argument]);
        assert!(message.contains(words) && message.contains("--set"), "{argument}: {message}");
    }
    let deep = format!("{}=word", ["a"; 100_000].join("."));
    assert!(refused(&[&deep]).contains("is no key"));
    // All wrong arguments at once.
    let message = refused(&["jerk", "axes.Q.x=1"]);
    assert!(message.contains("there is no =") && message.contains("no axis Q"), "{message}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, rng_seed: RngSeed::Fixed(2), ..ProptestConfig::default() })]

    #[test]
    fn any_argument_is_answered(argument in prop_oneof![
        "\\PC{0,24}", "[a-zX.=\"\\[\\]{}0-9 ]{0,24}", "axes\\.X\\.[a-z_0-9]{1,12}=[-0-9.e\"]{0,5}",
    ]) {
        match set(machine::shipped()[0].1, &[&argument]) {
            Ok(loaded) => assert_text_is_the_machine(&loaded),
            Err(found) => { let _ = shown(&found); }
        }
    }

    #[test]
    fn any_key_of_the_file_can_be_set(line in 0..400_usize, factor in 0.5..2.0_f64) {
        let lines: Vec<&str> = machine::shipped()[0].1.lines().collect();
        let line = line % lines.len();
        let table = lines[..line].iter().rev().find_map(|line| line.strip_prefix('[')?.strip_suffix(']'));
        let Some((key, rest)) = lines[line].split_once(" = ") else { return Ok(()) };
        let Some(Ok(value)) = rest.split_whitespace().next().map(str::parse::<f64>) else { return Ok(()) };
        let path = table.map_or_else(|| key.to_owned(), |table| format!("{table}.{key}"));
        let argument = format!("{path}={}", value * factor);
        if let Ok(loaded) = set(machine::shipped()[0].1, &[&argument]) {
            assert_text_is_the_machine(&loaded);
        }
    }
}
