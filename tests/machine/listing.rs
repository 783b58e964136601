//! Machine data in and out: round trip of every shipped machine, a listing by hand with its values worked out by hand, archives, bad input.

use sollwert::base::Severity;
use sollwert::machine::{
    AxisChoice, ImportOptions, Imported, ListingFile, Loaded, Origin, export_listing, import_listing, load, shipped,
};
use std::f64::consts::TAU;

pub fn file(name: &str, text: &str) -> ListingFile {
    ListingFile { name: name.to_owned(), bytes: text.as_bytes().to_vec() }
}

pub fn import(text: &str) -> Imported {
    import_listing(&[file("data.ini", text)], &ImportOptions::default()).unwrap_or_else(|findings| {
        let shown: Vec<String> = findings.iter().map(|finding| finding.render(false)).collect();
        panic!("{}", shown.join("\n"))
    })
}

pub fn codes(text: &str) -> Vec<&'static str> {
    match import_listing(&[file("data.ini", text)], &ImportOptions::default()) {
        Ok(_) => Vec::new(),
        Err(findings) => findings.iter().map(|finding| finding.code).collect(),
    }
}

/// Both, without the file names.
pub fn assert_same_machine(one: &Loaded, other: &Loaded) {
    let texts = [one, other].map(|loaded| format!("{:#?}", loaded.machine));
    for (one_line, other_line) in texts[0].lines().zip(texts[1].lines()) {
        assert_eq!(one_line, other_line, "{}", one.name);
    }
    assert_eq!(one.machine, other.machine);
}

#[test]
fn every_shipped_machine_comes_back_to_the_last_bit() {
    for (name, _) in shipped() {
        let loaded = load(name, &[]).unwrap();
        let listing = export_listing(&loaded);
        assert_same_machine(&loaded, &import(&listing).loaded);
    }
}

#[test]
fn settings_that_share_a_datum_come_back_too() {
    // MD32650 holds the product of weight and inertia; MD32620 balancing, switch and kind at once; p0341 is not all the inertia there is.
    let sets = [
        "axes.X.drive.torque_feedforward=0.8",
        "axes.X.drive.feedforward_inertia_kg_m2=0.0123",
        "axes.Y.drive.velocity_feedforward=0",
        "axes.Z.drive.feedforward_balancing=pt1",
        "axes.Z.drive.setpoint_delay_ms=2.34567",
        "axes.Z.mechanics.gear_ratio=-1.5",
        "axes.Y.drive.speed_reset_time_ms=inf",
        "axes.X.drive.jerk_filter=moving_average",
        "axes.X.drive.friction_compensation_mm_s=1.25",
        "axes.Y.encoder.position_source=motor",
        "axes.Y.drive.current_filter_1=pt2",
        "axes.X.mechanics.backlash_um=3",
        "axes.X.dynamics.finish.jerk_max_m_s3=7",
    ]
    .map(str::to_owned);
    let loaded = load("spinner_mvc850", &sets).unwrap();
    assert_same_machine(&loaded, &import(&export_listing(&loaded)).loaded);
}

/// Two axes as a control lists them, one more that is a spindle; the numbers are made up.
const BY_HAND: &str = "\
%_N_INITIAL_INI
METRIC
CHANDATA(1)
N10000 $MN_AXCONF_MACHAX_NAME_TAB[0]=\"X1\"
N10000 $MN_AXCONF_MACHAX_NAME_TAB[1]=\"C1\"
N10000 $MN_AXCONF_MACHAX_NAME_TAB[2]=\"SP1\"
N10061 $MN_POSCTRL_CYCLE_TIME=0.002
N10071 $MN_IPO_CYCLE_TIME=0.004 ; comment
N11660 $MN_NUM_EG=10
N11640 $MN_ENABLE_CHAN_AX_GAP='H1'
N20070 $MC_AXCONF_MACHAX_USED[0]=1
N20070 $MC_AXCONF_MACHAX_USED[1]=2
N20070 $MC_AXCONF_MACHAX_USED[2]=3
N20080 $MC_AXCONF_CHANAX_NAME_TAB[0]=\"X\"
N20080 $MC_AXCONF_CHANAX_NAME_TAB[1]=\"C\"
N20150 $MC_GCODE_RESET_VALUES[9]=4
N20602 $MC_CURV_EFFECT_ON_PATH_ACCEL[0]=0.8
N20603 $MC_CURV_EFFECT_ON_PATH_JERK[0]=0
N30300 $MA_IS_ROT_AX[AX1]=0
N30300 $MA_IS_ROT_AX[AX2]=1
N31030 $MA_LEADSCREW_PITCH[AX1]=20
N31050 $MA_DRIVE_AX_RATIO_DENOM[0,AX1]=30
N31060 $MA_DRIVE_AX_RATIO_NUMERA[0,AX1]=55
N31050 $MA_DRIVE_AX_RATIO_DENOM[0,AX2]=1
N31060 $MA_DRIVE_AX_RATIO_NUMERA[0,AX2]=90
N32000 $MA_MAX_AX_VELO[AX1]=40000
N32000 $MA_MAX_AX_VELO[AX2]=40
N32200 $MA_POSCTRL_GAIN[0,AX1]=3
N32200 $MA_POSCTRL_GAIN[0,AX2]=2
N32300 $MA_MAX_AX_ACCEL[0,AX1]=6
N32300 $MA_MAX_AX_ACCEL[4,AX1]=4
N32300 $MA_MAX_AX_ACCEL[0,AX2]=3.5
N32431 $MA_MAX_AX_JERK[0,AX1]=30
N32431 $MA_MAX_AX_JERK[0,AX2]=1.85EX1
N32500 $MA_FRICT_COMP_ENABLE[AX2]=1
N32520 $MA_FRICT_COMP_CONST_MAX[0,AX2]=0.5
N32610 $MA_VELO_FFW_WEIGHT[0,AX1]=1
N32620 $MA_FFW_MODE[AX1]=4
N32650 $MA_AX_INERTIA[AX1]=0.018
N32800 $MA_EQUIV_CURRCTRL_TIME[0,AX1]=0.001
N32810 $MA_EQUIV_SPEEDCTRL_TIME[0,AX1]=0.003
N35000 $MA_SPIND_ASSIGN_TO_MACHAX[AX3]=1
N36000 $MA_STOP_LIMIT_COARSE[AX1]=0.04
N36100 $MA_POS_LIMIT_MINUS[AX1]=-0.5
N36110 $MA_POS_LIMIT_PLUS[AX1]=935.5
N36100 $MA_POS_LIMIT_MINUS[AX2]=-100000000
N36110 $MA_POS_LIMIT_PLUS[AX2]=100000000
CHANDATA(2)
N20150 $MC_GCODE_RESET_VALUES[9]=1
M17
%_N_PS000011_TEA
[PARAMETER]
p115[0]=125
p115[1]=250
p199[0]=65
p199[1]=88
p199[2]=88
p199[3]=95
p199[4]=48
p199[5]=48
p210=600
p0316[0]=1.815
p0317[0]=115.5
p341[0]=0.00598
p342[0]=1
p350[0]=0.35
p356[0]=5.9
p640[0]=36
p1082[0]=5000
p1460[0]=5
p1462[0]=7.4
p1498[0]=0
p1715[0]=24.7
p1717[0]=0
";

#[test]
fn a_listing_by_hand_has_the_values_worked_out_by_hand() {
    let imported = import(BY_HAND);
    let near = |key: &str, wanted: f64| {
        let sourced = imported.values.get(key).unwrap_or_else(|| panic!("{key} is missing:\n{}", imported.text));
        let value: f64 = sourced.value.parse().unwrap();
        assert!((value - wanted).abs() <= 1e-9 * wanted.abs(), "{key}: {value}, wanted {wanted}");
    };
    near("cycle.t_cyl_ms", 4.0);
    near("axes.X.velocity_max_m_min", 40.0);
    near("axes.C.velocity_max_rpm", 40.0);
    near("axes.X.acceleration_max_m_s2", 6.0);
    near("axes.X.dynamics.finish.acceleration_max_m_s2", 4.0);
    near("axes.C.jerk_max_rot_s3", 18.5);
    // 1 (m/min)/mm = 16.667 1/s.
    near("axes.X.drive.position_gain_per_s", 50.0);
    near("axes.X.mechanics.gear_ratio", 55.0 / 30.0);
    near("axes.X.drive.setpoint_delay_ms", 1.0);
    near("axes.X.drive.torque_feedforward", 1.0);
    near("axes.X.drive.feedforward_inertia_kg_m2", 0.018);
    near("axes.X.drive.in_position_coarse_um", 40.0);
    near("axes.X.drive.speed_cycle_us", 250.0);
    near("axes.X.drive.current_cycle_us", 125.0);
    near("axes.X.drive.voltage_max_v", 600.0 / 6.0_f64.sqrt());
    // 115.5 V at 1000 rpm between lines: 1000 rpm = 104.72 rad/s.
    near("axes.X.motor.back_emf_v_s_per_rad", 115.5 / 3.0_f64.sqrt() / 104.719_755_119_66);
    // 5000 rpm through 55/30 and 20 mm.
    near("axes.X.drive.speed_setpoint_max_mm_s", 5000.0 / 60.0 * 30.0 / 55.0 * 20.0);
    // The drive has not been told the load: MD32650 is the better guess.
    near("axes.X.mechanics.inertia_kg_m2", 0.018);
    assert_eq!(imported.values["axes.X.mechanics.inertia_kg_m2"].origin, Origin::Derived);
    assert_eq!(imported.values["axes.X.drive.current_reset_time_ms"].value, "inf");
    assert_eq!(imported.values["feed.default_path_mode"].value, "\"G642\"", "channel 2 does not count");
    assert_eq!(imported.values["axes.X.travel_mm"].value, "[-0.5, 935.5]");
    assert!(!imported.values.contains_key("axes.C.travel_deg"), "1e8 is no limit");
    // No friction in any machine datum: assumed, and said.
    assert_eq!(imported.values["axes.X.mechanics.coulomb_friction_n_m"].origin, Origin::Assumed);
    // C has no drive parameters: ideal, and said. The spindle is no axis, and said.
    let machine = &imported.loaded.machine;
    assert!(machine.axis_by_name("C").is_some_and(|axis| machine.axis(axis).drive.is_none()));
    assert_eq!(machine.axes.len(), 2);
    let said = |words: &str| imported.warnings.iter().any(|warning| warning.message.contains(words));
    assert!(said("AX3 SP1: a spindle"), "{:?}", imported.warnings);
    assert!(said("no drive parameters (p1460 and so on) for C"));
    assert!(said("coulomb_friction_n_m = 0"));
    // MD20603 = 0 is a value that the file cannot hold.
    let refused = imported.warnings.iter().find(|warning| warning.code == "M0306").unwrap();
    assert!(
        refused.message.contains("radial_jerk_share")
            && refused.place.as_ref().is_some_and(|place| place.line_text.contains("N20603")),
        "{refused:?}"
    );
}

/// MD35100 and MD35130 limit the speed; MD35500 = 0, or no tolerance (MD35150 = 0), lets a feed start at once; without MD35500 nothing is known of waits.
#[test]
fn a_spindle_has_its_highest_speed_and_its_waits() {
    let spindle = "N35000 $MA_SPIND_ASSIGN_TO_MACHAX[AX3]=1\n";
    let with = |data: &str| {
        let data: String = data.split(' ').map(|datum| format!("N35 $MA_{datum}\n")).collect();
        import(&BY_HAND.replace(spindle, &format!("{spindle}{data}"))).loaded.machine
    };
    let ramp = "GEAR_STEP_SPEEDCTRL_ACCEL[1,AX3]=20 SPIND_VELO_LIMIT[AX3]=9000 GEAR_STEP_MAX_VELO_LIMIT[1,AX3]=8000";
    let machine = with(&format!("{ramp} SPIND_ON_SPEED_AT_IPO_START[AX3]=1 SPIND_DES_VELO_TOL[0,AX3]=0.05"));
    assert_eq!(machine.spindle_speed_max_rpm, Some(8000.0));
    let waits = machine.spindle.expect("a spindle");
    assert!((waits.acceleration_rad_s2 - 20.0 * TAU).abs() < 1e-12);
    assert!(!waits.starts_at_once && waits.tolerance_share == 0.05);
    for data in ["SPIND_ON_SPEED_AT_IPO_START[AX3]=0", "SPIND_ON_SPEED_AT_IPO_START[AX3]=1 SPIND_DES_VELO_TOL[0,AX3]=0"]
    {
        assert!(with(&format!("{ramp} {data}")).spindle.expect("a spindle").starts_at_once, "{data}");
    }
    assert!(with(ramp).spindle.is_none());
}

#[test]
fn data_without_the_datum_that_switches_them_are_used_or_listed() {
    let with = |drop: &[&str], more: &str| {
        let lines = BY_HAND.lines().filter(|line| !drop.iter().any(|word| line.contains(word)));
        import(&(lines.collect::<Vec<_>>().join("\n") + "\n" + more))
    };
    let number = |imported: &Imported, key: &str| imported.values[key].value.parse::<f64>().unwrap();
    // Without p0341 what the control has been told is better than a guess; so is the load.
    let inertia = "axes.X.mechanics.inertia_kg_m2";
    let imported = with(&["p341", "p0341"], "");
    assert_eq!((number(&imported, inertia), imported.values[inertia].origin), (0.018, Origin::Derived));
    let imported = with(&["p341", "p0341", "AX_INERTIA", "p1498"], "p1498[0]=0.007\n");
    assert_eq!((number(&imported, inertia), imported.values[inertia].origin), (0.007, Origin::Derived));
    // Without MD32620: mode 3 as a machine file without the key, and said. The delay of the other modes is listed.
    let more = "N32800 $MA_EQUIV_CURRCTRL_TIME[0,AX1]=0.0007\nN32810 $MA_EQUIV_SPEEDCTRL_TIME[0,AX1]=0.0025\n";
    let imported = with(&["FFW_MODE", "EQUIV_"], more);
    assert_eq!(number(&imported, "axes.X.drive.setpoint_delay_ms"), 2.5);
    assert_eq!(number(&imported, "axes.X.drive.feedforward_inertia_kg_m2"), 0.018);
    assert_eq!(imported.values["axes.X.drive.feedforward_balancing"].origin, Origin::Assumed);
    assert!(imported.warnings.iter().any(|warning| warning.message.contains("no MD32620")), "{:?}", imported.warnings);
    assert!(imported.unknown.iter().any(|unknown| unknown.datum.contains("EQUIV_CURRCTRL_TIME")));
    assert!(imported.unknown.iter().all(|unknown| !unknown.datum.contains("EQUIV_SPEEDCTRL_TIME")));
}

#[test]
fn what_is_unknown_is_counted_once_a_datum() {
    let mut text = BY_HAND.to_owned();
    for place in 0..7 {
        text += &format!("N12345 $MN_SOMETHING_ELSE[{place}]=1\n");
    }
    let imported = import(&text);
    let first = imported.unknown.first().unwrap();
    assert_eq!((first.datum.as_str(), first.count), ("N12345 $MN_SOMETHING_ELSE", 7));
    assert!(imported.unknown.iter().any(|unknown| unknown.datum == "N11660 $MN_NUM_EG" && unknown.count == 1));
    assert!(!imported.unknown.iter().any(|unknown| unknown.datum.contains("MAX_AX_ACCEL")), "used data are known");
}

#[test]
fn another_machine_fills_gaps_and_the_user_names_axes_and_drives() {
    let base = load("spinner_mvc850", &[]).unwrap();
    let options = ImportOptions {
        axes: vec![AxisChoice { theirs: "C1".into(), ours: "Z".into() }],
        drives: vec![AxisChoice { theirs: "AXX_00".into(), ours: "Z".into() }],
        base: Some((base.name.to_string(), base.text_as_used)),
        ..ImportOptions::default()
    };
    // C1 as a linear axis named Z, so that the base has the rest of it.
    let text = BY_HAND.replace("$MA_IS_ROT_AX[AX2]=1", "$MA_IS_ROT_AX[AX2]=0");
    let imported = import_listing(&[file("data.ini", &text)], &options).unwrap_or_else(|findings| {
        let shown: Vec<String> = findings.iter().map(|finding| finding.render(false)).collect();
        panic!("{}", shown.join("\n"))
    });
    assert_eq!(imported.values["axes.Z.drive.speed_gain_n_m_s_per_rad"].value, "5.0");
    assert_eq!(imported.values["axes.Z.mechanics.coulomb_friction_n_m"].origin, Origin::Base);
    assert!(imported.loaded.machine.axis_by_name("Y").is_none(), "an axis that the control does not have");
    assert!(!imported.warnings.iter().any(|warning| warning.severity == Severity::Error));
}

/// One member of a container, written from the description in `src/machine/listing/archive.rs`.
fn member(name: &str, content: &[u8]) -> Vec<u8> {
    let mut header = vec![0_u8; 512];
    header[..name.len()].copy_from_slice(name.as_bytes());
    let size = content.len().to_string();
    header[124..124 + size.len()].copy_from_slice(size.as_bytes());
    header[136..146].copy_from_slice(b"1476518605");
    let sum: u32 = header.iter().map(|byte| u32::from(*byte)).sum();
    let sum = sum.to_string();
    header[148..148 + sum.len()].copy_from_slice(sum.as_bytes());
    header.extend_from_slice(content);
    header.resize(header.len().div_ceil(512) * 512, 0);
    header
}

#[test]
fn an_archive_gives_its_text_members_and_names_the_compiled_ones() {
    let (nc, drive) = BY_HAND.split_once("%_N_PS000011_TEA\n").unwrap();
    let mut bytes = member("@@MMCIBN.002", b";---creation stamp---\n");
    bytes.extend(member("_N_INITIAL_INI", nc.as_bytes()));
    bytes.extend(member("_N_MILL_SPF", b"R1=$MA_MAX_AX_ACCEL[0,AX1]\n$MA_MAX_AX_ACCEL[0,AX1]=99\n"));
    bytes.extend(member("_N_PS000011_TEA", drive.as_bytes()));
    bytes.extend(member("ps000012.acx", &[1, 0, 2, 0]));
    let archive = ListingFile { name: "NC.arc".into(), bytes };
    let imported = import_listing(std::slice::from_ref(&archive), &ImportOptions::default()).unwrap();
    assert_eq!(imported.values["axes.X.acceleration_max_m_s2"].value, "6.0", "a program sets no machine data");
    assert_eq!(imported.values["axes.X.drive.speed_gain_n_m_s_per_rad"].value, "5.0");
    assert!(
        imported.warnings.iter().any(|warning| warning.code == "M0307" && warning.message.contains("ps000012.acx"))
    );

    // A transfer as text makes one byte of two: every header after it is off.
    let mut damaged = archive.clone();
    let at = damaged.bytes.iter().position(|byte| *byte == b'\n').unwrap();
    damaged.bytes.insert(at, b'\r');
    let findings = import_listing(&[damaged], &ImportOptions::default()).unwrap_err();
    assert_eq!(findings[0].code, "M0302");
    let mut short = archive;
    short.bytes.truncate(2000);
    assert_eq!(import_listing(&[short], &ImportOptions::default()).unwrap_err()[0].code, "M0302");
}

#[test]
fn bad_input_is_refused_with_its_place() {
    assert_eq!(codes("G1 X10\nM30\n"), ["M0301"]);
    assert_eq!(codes(&BY_HAND.replace("METRIC", "INCH\nN10250 $MN_SCALING_VALUE_INCH=-1")), ["M0305"]);
    assert_eq!(codes(&BY_HAND.replace("AX_VELO[AX1]=40000", "AX_VELO[AX1]=forty")), ["M0304"]);
    assert_eq!(codes(&BY_HAND.replace("AX_VELO[AX1]=40000", "AX_VELO[AX1=40000")), ["M0304"]);
    let zip = ListingFile { name: "all.zip".into(), bytes: b"PK\x03\x04\0\0\0".to_vec() };
    assert_eq!(import_listing(&[zip], &ImportOptions::default()).unwrap_err()[0].code, "M0302");
    let findings =
        import_listing(&[file("data.ini", &BY_HAND.replace("[0,AX1]=6", "[0,AX1]=six"))], &ImportOptions::default())
            .unwrap_err();
    let place = findings[0].place.as_ref().unwrap();
    let line = BY_HAND.lines().position(|line| line.ends_with("[0,AX1]=6")).unwrap() as u32 + 1;
    assert_eq!((place.line, place.line_text.as_str()), (line, "N32300 $MA_MAX_AX_ACCEL[0,AX1]=six"));
}

#[test]
fn no_cut_or_flipped_byte_of_an_import_panics() {
    let listing = export_listing(&load("mikron_ucp710", &[]).unwrap());
    let mut random = crate::random::Random::new(7);
    for _ in 0..60 {
        let mut bytes = listing.as_bytes().to_vec();
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len() as u32) as usize;
            bytes[at] = random.below(256) as u8;
        }
        bytes.truncate(bytes.len() - random.below(bytes.len() as u32 / 2) as usize);
        let _ = import_listing(&[ListingFile { name: "x".into(), bytes }], &ImportOptions::default());
    }
}
