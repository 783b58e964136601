//! `--record`: what the words choose, and what is said about words that choose nothing.

use crate::support::*;
use sollwert::base::AxisId;
use sollwert::recorder::*;

fn chosen(text: &str) -> Vec<(String, Vec<&'static str>)> {
    let machine = machine();
    let choice = SignalChoice::parse(text, &machine).unwrap();
    machine
        .axis_ids()
        .filter(|axis| choice.axis(*axis))
        .map(|axis| {
            let names = choice.fields(axis).map(|field| AXIS_FIELDS[field].name(machine.axis(axis).kind)).collect();
            (machine.axis(axis).name.clone(), names)
        })
        .collect()
}

fn names(chosen: &[(String, Vec<&'static str>)]) -> Vec<String> {
    chosen.iter().flat_map(|(axis, fields)| fields.iter().map(move |field| format!("{axis}.{field}"))).collect()
}

#[test]
fn words_choose_signals() {
    assert_eq!(names(&chosen("X.current")), ["X.current_a"]);
    assert_eq!(names(&chosen("x.current_a, C.Position_setpoint_deg")), ["X.current_a", "C.position_setpoint_deg"]);
    assert_eq!(names(&chosen("X.current*")), ["X.current_reference_a", "X.current_a", "X.current_mean_a"]);
    assert_eq!(names(&chosen("*.following_error")).len(), 3);
    assert_eq!(chosen("X.current,Y.*")[1].1.len(), 10, "Y is ideal: it has no motor");
    assert_eq!(chosen("C")[0].1.len(), AXIS_FIELD_COUNT);
    assert!(chosen("path,event,tool").is_empty());
    // What people look at: eight fields, of an ideal axis those that it has.
    let usual = chosen("Usual");
    assert_eq!(usual.iter().map(|(_, fields)| fields.len()).collect::<Vec<_>>(), [8, 6, 8]);
    assert!(usual[0].1.contains(&"current_a") && !usual[1].1.contains(&"current_a"));
    assert_eq!(chosen("usual,X.voltage")[0].1.len(), 9);
}

#[test]
fn a_word_says_how_often() {
    let machine = machine();
    let choice = SignalChoice::parse("X.*/10, X.current/3,X.current/7,X.voltage, C.flags / 2", &machine).unwrap();
    let (x, c) = (AxisId::new(0), AxisId::new(2));
    let bit = |name: &str| 1_u32 << axis_field(name).unwrap();
    let all = (1_u32 << AXIS_FIELD_COUNT) - 1;
    let mut groups = choice.groups(x);
    groups.sort_unstable();
    assert_eq!(groups, [(1, bit("voltage")), (3, bit("current")), (10, all & !bit("voltage") & !bit("current"))]);
    assert_eq!(choice.groups(c), [(2, bit("flags"))]);
    assert!(SignalChoice::parse("X.current/", &machine).unwrap_err().message.contains("number of samples"));
    assert!(SignalChoice::parse("X.current/70000", &machine).is_err());
}

#[test]
fn a_word_that_names_nothing_is_told_with_the_nearest() {
    let machine = machine();
    let refuse = |text: &str| SignalChoice::parse(text, &machine).unwrap_err();
    let fault = refuse("X.current,Y.positoin_actual");
    assert_eq!(fault.place.as_ref().map(|place| place.columns.clone()), Some(10..27));
    assert!(fault.help.unwrap().contains("position_actual"));
    assert!(refuse("Q.current").help.unwrap().contains("X, Y, C"));
    assert!(refuse("tol.actual").help.unwrap().contains("`tool`"));
    assert!(refuse("Y.current").message.contains("no drive"));
    assert!(refuse("X.current,,").message.contains("missing"));
    assert!(refuse("").message.contains("missing"));
    for odd in ["*", "*.*", "X.", ".", "X.*.*", "ä.ö", "X.****************z"] {
        let _ = SignalChoice::parse(odd, &machine);
    }
}

#[test]
fn only_what_is_chosen_is_in_the_file() {
    let machine = machine();
    let mut setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    setup.signals = SignalChoice::parse("X.current,C.flags,tool.actual", &machine).unwrap();
    let path = file("chosen.mcap", &recorded(&setup, TICKS_PER_S / 10));
    let recording = Recording::open(&path).unwrap();
    let topics: Vec<&str> = recording.topics().iter().map(|topic| topic.name.as_str()).collect();
    assert_eq!(topics, ["/axis/X", "/axis/C", "/path", "/event", "/tool/actual"]);
    let current = axis_field("current").unwrap();
    assert_eq!(recording.topics()[0].fields, [current]);
    for message in recording.messages().unwrap().map(Result::unwrap).filter(|message| message.topic == 0) {
        let Content::Axis(sample) = message.content else { panic!() };
        assert_eq!((0..AXIS_FIELD_COUNT).filter(|field| sample.get(*field).is_some()).collect::<Vec<_>>(), [current]);
    }
    let mut csv = Vec::new();
    export_csv(&recording, &mut csv).unwrap();
    let header = String::from_utf8(csv).unwrap();
    assert!(header.starts_with("time_s,X.current_a,C.flags,path.program,"), "{}", &header[..80]);
}

#[test]
fn without_drives_only_set_points_remain() {
    let machine = machine();
    let choice = SignalChoice::setpoints();
    let fields: Vec<&str> = choice.fields(AxisId::new(0)).map(|field| AXIS_FIELDS[field].stem).collect();
    assert_eq!(fields, ["position_setpoint", "velocity_setpoint", "acceleration_setpoint", "jerk_setpoint"]);
    assert!(choice.pose(ToolPose::Setpoint.index()) && !choice.pose(ToolPose::Actual.index()));
    let asked = SignalChoice::parse("X.*", &machine).unwrap();
    assert_eq!(choice.and(&asked).fields(AxisId::new(0)).count(), 4);
    assert!(!choice.and(&asked).axis(AxisId::new(2)));
}

#[test]
fn the_spindle_is_chosen_by_its_fields() {
    let without = machine();
    let with = sollwert::machine::Machine {
        spindle: sollwert::machine::load("spinner_mvc850", &[]).unwrap().machine.spindle,
        ..machine()
    };
    let spindle = |text: &str| SignalChoice::parse(text, &with).unwrap().on(&with).spindle();
    assert_eq!(SignalChoice::all().on(&with).spindle(), ((1 << SPINDLE_FIELDS.len()) - 1, 1));
    assert_eq!(SignalChoice::all().on(&without).spindle().0, 0);
    assert_eq!(spindle("X.current").0, 0, "only what is named");
    assert_eq!(spindle("spindle"), (0b11111, 1));
    assert_eq!(spindle("Spindle.*/10"), (0b11111, 10));
    assert_eq!(spindle("spindle.speed_actual,X"), (0b1000, 1));
    assert_eq!(spindle("spindle.speed_*/4,spindle.angle_setpoint_deg/2"), (0b1101, 2), "the most frequent counts");
    assert_eq!(spindle("spindle.acceleration_setpoint").0, 0b10000);
    let refused = SignalChoice::parse("X,spindle.torque", &with).unwrap_err().render(false);
    assert!(
        refused.contains(
            "fields of the spindle: angle_setpoint, angle_actual, speed_setpoint, speed_actual, acceleration_setpoint"
        ),
        "{refused}"
    );
    let refused = SignalChoice::parse("spindle", &without).unwrap_err().render(false);
    assert!(refused.contains("not simulated on this machine") && refused.contains("acceleration_rot_s2"), "{refused}");
}
