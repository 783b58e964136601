//! What real archives hold beside single data: five-axis transformations, drives of the 840D pl, units, ways of writing an index, text archives,
//! tables of compensation. Numbers are made up; signs and order of the vectors are those of a table machine whose cycles were read.

use super::listing::{assert_same_machine, codes, file, import};
use sollwert::base::Severity;
use sollwert::machine::{
    AxisChoice, ImportOptions, Imported, KinematicsSettings, ListingFile, Origin, RotaryJoint, export_listing,
    import_listing, load,
};

/// X, Y, Z, C (machine axis 4), A (machine axis 5).
const FIVE: &str = "\
METRIC
CHANDATA(1)
N20070 $MC_AXCONF_MACHAX_USED[0]=1
N20070 $MC_AXCONF_MACHAX_USED[1]=2
N20070 $MC_AXCONF_MACHAX_USED[2]=3
N20070 $MC_AXCONF_MACHAX_USED[3]=4
N20070 $MC_AXCONF_MACHAX_USED[4]=5
N20080 $MC_AXCONF_CHANAX_NAME_TAB[0]=\"X\"
N20080 $MC_AXCONF_CHANAX_NAME_TAB[1]=\"Y\"
N20080 $MC_AXCONF_CHANAX_NAME_TAB[2]=\"Z\"
N20080 $MC_AXCONF_CHANAX_NAME_TAB[3]=\"C\"
N20080 $MC_AXCONF_CHANAX_NAME_TAB[4]=\"A\"
N30300 $MA_IS_ROT_AX[AX1]=0
N30300 $MA_IS_ROT_AX[AX2]=0
N30300 $MA_IS_ROT_AX[AX3]=0
N30300 $MA_IS_ROT_AX[AX4]=1
N30300 $MA_IS_ROT_AX[AX5]=1
N24100 $MC_TRAFO_TYPE_1=512
N24310 $MC_TRAFO_AXES_IN_3[0]=1
N24310 $MC_TRAFO_AXES_IN_3[1]=2
N24310 $MC_TRAFO_AXES_IN_3[2]=3
N24310 $MC_TRAFO_AXES_IN_3[3]=5
N24310 $MC_TRAFO_AXES_IN_3[4]=4
";

fn vector(name: &str, value: [f64; 3]) -> String {
    (0..3).map(|part| format!("$MC_TRAFO5_{name}_1[{part}]={}\n", value[part])).collect()
}

/// A table: A turns about an axis at (500, -278, -300), C about one 50 below it.
fn table() -> String {
    [
        FIVE,
        "N24300 $MC_TRAFO_TYPE_3=40\n",
        &vector("BASE_TOOL", [500.0, -278.0, -300.0]),
        &vector("JOINT_OFFSET", [0.0, 0.0, -50.0]),
        &vector("PART_OFFSET", [-500.0, 278.0, 350.0]),
        &vector("AXIS1", [-1.0, 0.0, 0.0]),
        &vector("AXIS2", [0.0, 0.0, -1.0]),
    ]
    .concat()
}

/// Table and head.
fn chains(imported: &Imported) -> (Vec<RotaryJoint>, Vec<RotaryJoint>) {
    match &imported.loaded.machine.kinematics {
        KinematicsSettings::Rotary { table, head } => (table.clone(), head.clone()),
        KinematicsSettings::Cartesian => panic!("cartesian: {:?}", imported.warnings),
    }
}

fn joint(imported: &Imported, axis: &str, direction: [f64; 3], point_mm: [f64; 3]) -> RotaryJoint {
    RotaryJoint { axis: imported.loaded.machine.axis_by_name(axis).unwrap(), direction, point_mm }
}

fn said(imported: &Imported, words: &str) -> bool {
    imported.warnings.iter().any(|warning| warning.message.contains(words))
}

#[test]
fn a_table_comes_with_its_axes_and_points() {
    let imported = import(&table());
    let (table, head) = chains(&imported);
    let a = joint(&imported, "A", [-1.0, 0.0, 0.0], [500.0, -278.0, -300.0]);
    let c = joint(&imported, "C", [0.0, 0.0, -1.0], [500.0, -278.0, -350.0]);
    assert_eq!((table, head), (vec![a, c], vec![]));
    assert_eq!(imported.values["kinematics.rotary"].origin, Origin::Derived);
    assert!(said(&imported, "$MC_TRAFO_TYPE_1 = 512"), "TRACYL is said to be left out");
    assert!(!said(&imported, "is open by"), "{:?}", imported.warnings);
}

#[test]
fn a_sign_that_is_not_plus_turns_the_axis_and_an_open_chain_is_said() {
    let text = table() + "$MC_TRAFO5_ROT_SIGN_IS_PLUS_1[0]=0\n$MC_TRAFO5_ROT_SIGN_IS_PLUS_1[1]=1\n";
    let imported = import(&text.replace("PART_OFFSET_1[2]=350", "PART_OFFSET_1[2]=349"));
    assert_eq!(chains(&imported).0[0].direction, [1.0, 0.0, 0.0]);
    assert_eq!(chains(&imported).0[1].direction, [0.0, 0.0, -1.0]);
    assert!(said(&imported, "is open by [0.0, 0.0, -1.0] mm"), "{:?}", imported.warnings);
}

#[test]
fn a_head_and_a_head_with_a_table() {
    // From the mount 100 up to the second axis, 80 more to the first.
    let offsets = [
        vector("BASE_TOOL", [0.0, 0.0, 100.0]),
        vector("JOINT_OFFSET", [0.0, 0.0, 80.0]),
        vector("PART_OFFSET", [0.0, 0.0, -180.0]),
        vector("AXIS1", [0.0, 0.0, 1.0]),
        vector("AXIS2", [0.0, 1.0, 0.0]),
    ]
    .concat();
    let head_text = [FIVE, "$MC_TRAFO_TYPE_3=24\n", &offsets].concat();
    let imported =
        import(&head_text.replace("AXES_IN_3[3]=5", "AXES_IN_3[3]=4").replace("AXES_IN_3[4]=4", "AXES_IN_3[4]=5"));
    let (table, head) = chains(&imported);
    let first = joint(&imported, "C", [0.0, 0.0, 1.0], [0.0, 0.0, 180.0]);
    let second = joint(&imported, "A", [0.0, 1.0, 0.0], [0.0, 0.0, 100.0]);
    assert_eq!((table, head), (vec![], vec![first, second]));

    let mixed = [
        FIVE,
        "$MC_TRAFO_TYPE_3=56\n",
        &vector("BASE_TOOL", [100.0, 0.0, 195.0]),
        &vector("JOINT_OFFSET", [-100.0, 0.0, -195.0]),
        &vector("JOINT_OFFSET_PART", [500.0, -278.0, 0.0]),
        &vector("PART_OFFSET", [-500.0, 278.0, 0.0]),
        &vector("AXIS1", [0.0, 1.0, 1.0]),
        &vector("AXIS2", [0.0, 0.0, -1.0]),
    ]
    .concat();
    let imported = import(&mixed);
    let (table, head) = chains(&imported);
    let half = 0.5_f64.sqrt();
    assert_eq!((head.len(), table.len()), (1, 1));
    assert!(head[0].direction.iter().zip([0.0, half, half]).all(|(one, other)| (one - other).abs() < 1e-12));
    assert_eq!(head[0].point_mm, [100.0, 0.0, 195.0]);
    assert_eq!(table[0], joint(&imported, "C", [0.0, 0.0, -1.0], [500.0, -278.0, 0.0]));
}

#[test]
fn types_with_letters_turn_a_table_against_its_letter() {
    let imported = import(&[FIVE, "$MC_TRAFO_TYPE_3=33\n"].concat());
    let (table, _) = chains(&imported);
    let zero = [0.0; 3];
    assert_eq!(table, [joint(&imported, "A", [-1.0, 0.0, 0.0], zero), joint(&imported, "C", [0.0, 0.0, -1.0], zero)]);
}

#[test]
fn type_72_takes_its_vectors_from_the_tool_carrier() {
    let mut text = [FIVE, "$MC_TRAFO_TYPE_3=72\n$MC_TRAFO5_TCARR_NO_1=2\n"].concat();
    let values = [
        (4, 500.0),
        (5, -278.0),
        (6, -300.0),
        (7, -1.0),
        (12, -1.0),
        (17, -50.0),
        (18, -500.0),
        (19, 278.0),
        (20, 350.0),
    ];
    for (number, value) in values {
        text += &format!("$TC_CARR{number}[2]={value}\n");
    }
    text += "$TC_CARR21[2]=(X)\n$TC_CARR23[2]=\"P\"\n";
    assert_eq!(chains(&import(&text)), chains(&import(&table())));
    let without = import(&text.replace("$TC_CARR23[2]=\"P\"\n", ""));
    assert!(said(&without, "no kinematics of the tool carrier ($TC_CARR23[2])"));
    assert_eq!(without.loaded.machine.kinematics, KinematicsSettings::Cartesian);
}

#[test]
fn what_makes_no_chain_stays_cartesian_and_says_why() {
    let cases = [
        (table().replace("$MA_IS_ROT_AX[AX4]=1", "$MA_IS_ROT_AX[AX4]=0"), "is no rotary axis here"),
        (table().replace("AXIS2_1[2]=-1", "AXIS2_1[2]=0"), "the vector of C (MD24570, MD24572) is 0"),
        (table() + "$MC_TRAFO5_ROT_AX_OFFSET_1[1]=90\n", "no such offset"),
        (table().replace("TRAFO_TYPE_3=40", "TRAFO_TYPE_3=0"), "its type (MD24100 ff.) is 0"),
        (table().replace("NAME_TAB[2]=\"Z\"", "NAME_TAB[2]=\"W\""), "there is no linear axis Z"),
    ];
    for (text, why) in cases {
        let imported = import(&text);
        assert_eq!(imported.loaded.machine.kinematics, KinematicsSettings::Cartesian, "{why}");
        assert!(said(&imported, why), "{why}: {:?}", imported.warnings);
    }
}

#[test]
fn a_chain_comes_back_from_the_data_alone() {
    for name in ["mikron_ucp710", "huron_kx8_five", "xyzbc"] {
        let loaded = load(name, &[]).unwrap();
        let KinematicsSettings::Rotary { table, head } = &loaded.machine.kinematics else { continue };
        let listing = export_listing(&loaded);
        let bare: String = listing
            .lines()
            .filter(|line| !line.contains("#sollwert kinematics"))
            .map(|line| format!("{line}\n"))
            .collect();
        assert!(listing.contains("$MC_TRAFO_TYPE_1=") && bare.len() < listing.len(), "{name}");
        let imported = import(&bare);
        let back = chains(&imported);
        for (one, other) in table.iter().chain(head).zip(back.0.iter().chain(&back.1)) {
            assert_eq!(one.axis, other.axis, "{name}");
            for part in 0..3 {
                assert!((one.direction[part] - other.direction[part]).abs() < 1e-9, "{name}: {one:?} {other:?}");
                assert!((one.point_mm[part] - other.point_mm[part]).abs() < 1e-9, "{name}: {one:?} {other:?}");
            }
        }
        // With the comment nothing is said; changed data win over it.
        assert!(!import(&listing).warnings.iter().any(|warning| warning.code == "M0308"), "{name}");
        let changed = listing.replace("$MC_TRAFO5_ROT_SIGN_IS_PLUS_1[0]=1", "$MC_TRAFO5_ROT_SIGN_IS_PLUS_1[0]=0");
        let changed = import(&changed);
        assert!(said(&changed, "kinematics.rotary") && changed.loaded.machine.kinematics != loaded.machine.kinematics);
    }
}

/// One axis with a drive of the 840D pl.
const DIGITAL: &str = "\
N10000 $MN_AXCONF_MACHAX_NAME_TAB[0]=\"X1\"
N30110 $MA_CTRLOUT_MODULE_NR[0,X1]=3
N31030 $MA_LEADSCREW_PITCH[X1]=10
N32200 $MA_POSCTRL_GAIN[0,X1]=3
N1000 $MD_CURRCTRL_CYCLE_TIME[DRIVE]=4
N1001 $MD_SPEEDCTRL_CYCLE_TIME[DRIVE]=8
N1104 $MD_MOTOR_MAX_CURRENT[DRIVE]=36
N1113 $MD_TORQUE_CURRENT_RATIO[DRIVE]=1.5
N1114 $MD_EMF_VOLTAGE[DRIVE]=95
N1115 $MD_ARMATURE_RESISTANCE[DRIVE]=0.4
N1116 $MD_ARMATURE_INDUCTANCE[DRIVE]=4.5
N1117 $MD_MOTOR_INERTIA[DRIVE]=0.0048
N1120 $MD_CURRCTRL_GAIN[DRIVE]=12
N1121 $MD_CURRCTRL_INTEGRATOR_TIME[DRIVE]=2000
N1407 $MD_SPEEDCTRL_GAIN_1[DRIVE]=2.5
N1409 $MD_SPEEDCTRL_INTEGRATOR_TIME_1[DRIVE]=8
N1414 $MD_SPEEDCTRL_REF_MODEL_FREQ[DRIVE]=120
N1500 $MD_NUM_SPEED_FILTERS[DRIVE]=0
";

#[test]
fn drives_of_the_840d_pl_are_read() {
    for drive in ["0,AX1", "0,X1", "AX1", "0,3", "DRIVE3", "0,DR3"] {
        let imported = import(&DIGITAL.replace("DRIVE", drive));
        let near = |key: &str, wanted: f64| {
            let sourced = imported.values.get(key).unwrap_or_else(|| panic!("{drive}: {key} is missing"));
            let value: f64 = sourced.value.parse().unwrap();
            assert!((value - wanted).abs() <= 1e-9 * wanted, "{drive}: {key} = {value}, wanted {wanted}");
            assert_eq!(sourced.origin, Origin::Datum, "{key}");
        };
        near("axes.X.drive.current_cycle_us", 125.0);
        near("axes.X.drive.speed_cycle_us", 250.0);
        near("axes.X.drive.current_max_a", 36.0);
        near("axes.X.motor.torque_constant_n_m_per_a", 1.5);
        near("axes.X.motor.back_emf_v_s_per_rad", 95.0 / 3.0_f64.sqrt() / (1000.0 * std::f64::consts::TAU / 60.0));
        near("axes.X.motor.inductance_mh", 4.5);
        near("axes.X.drive.current_reset_time_ms", 2.0);
        near("axes.X.drive.speed_gain_n_m_s_per_rad", 2.5);
        near("axes.X.drive.speed_reset_time_ms", 8.0);
        near("axes.X.drive.reference_model_frequency_hz", 120.0);
        assert!(imported.values["axes.X.drive.speed_gain_n_m_s_per_rad"].source.contains("MD_SPEEDCTRL_GAIN_1"));
        assert!(imported.unknown.iter().any(|unknown| unknown.datum == "$MD_NUM_SPEED_FILTERS"));
    }
    let other = import(&DIGITAL.replace("DRIVE", "0,4"));
    assert!(said(&other, "drives that belong to no axis"), "{:?}", other.warnings);
}

const PLAIN: &str = "\
N32000 $MA_MAX_AX_VELO[AX1]=40000
N32300 $MA_MAX_AX_ACCEL[0,AX1]=6
N32300 $MA_MAX_AX_ACCEL[4,AX1]=4
N32431 $MA_MAX_AX_JERK[0,AX1]=30
N32000 $MA_MAX_AX_VELO[AX2]=30000
N32300 $MA_MAX_AX_ACCEL[0,AX2]=5
N32431 $MA_MAX_AX_JERK[0,AX2]=20
N10000 $MN_AXCONF_MACHAX_NAME_TAB[0]=\"X1\"
N10000 $MN_AXCONF_MACHAX_NAME_TAB[1]=\"Y1\"
";

#[test]
fn an_axis_may_be_its_number_or_its_name() {
    let wanted = import(PLAIN);
    let by_name = PLAIN.replace("AX1]", "X1]").replace("AX2]", "Y1]");
    let by_number = PLAIN.replace("AX1]", "1]").replace("AX2]", "2]");
    let both = format!("{PLAIN}{}", PLAIN.lines().take(2).collect::<Vec<_>>().join("\n").replace("AX1", "X1"));
    let returned = PLAIN.replace('\n', "\r\n");
    for text in [by_name, by_number, both, returned] {
        let imported = import(&text);
        let values = |imported: &Imported| {
            imported.values.iter().map(|(key, one)| (key.clone(), one.value.clone())).collect::<Vec<_>>()
        };
        assert_eq!(values(&imported), values(&wanted), "{text}");
    }
    // Without MD10000 both ways of writing are one axis, and that is said.
    let bare: String =
        PLAIN.lines().filter(|line| !line.contains("NAME_TAB")).map(|line| format!("{line}\n")).collect();
    let imported = import(&(bare + "N32200 $MA_POSCTRL_GAIN[0,X1]=3\n"));
    assert_eq!(imported.loaded.machine.axes.len(), 2);
    assert!(said(&imported, "taken as one axis"), "{:?}", imported.warnings);
    let next = import("N32000 $MA_MAX_AX_VELO[AX2]=30000\nN32000 $MA_MAX_AX_VELO[Q1]=20000\n");
    assert_eq!(next.loaded.machine.axes.len(), 2, "Q1 gets a number that nobody has");
}

#[test]
fn the_last_of_two_assignments_counts_and_latin_1_is_read() {
    let imported = import(&format!("{PLAIN}N32300 $MA_MAX_AX_ACCEL[0,AX1]=7\n"));
    assert_eq!(imported.values["axes.X.acceleration_max_m_s2"].value, "7.0");
    let mut bytes = b"; Beschleunigung f\xfcr X\n".to_vec();
    bytes.extend_from_slice(PLAIN.as_bytes());
    let imported = import_listing(&[ListingFile { name: "d.ini".into(), bytes }], &ImportOptions::default()).unwrap();
    assert_eq!(imported.values["axes.X.acceleration_max_m_s2"].value, "6.0");
}

#[test]
fn units_of_its_own_are_refused() {
    let own = |mask: &str, place: u32, factor: f64| {
        format!(
            "{PLAIN}N32200 $MA_POSCTRL_GAIN[0,AX1]=3\nN10220 $MN_SCALING_USER_DEF_MASK='{mask}'\nN10230 $MN_SCALING_FACTORS_USER_DEF[{place}]={factor}\n"
        )
    };
    assert_eq!(codes(&own("H10", 4, 0.001)), ["M0305"]);
    assert!(codes(&own("H10", 4, 1.0)).is_empty());
    // The drive is needed to see the gain.
    let drive = "[PARAMETER]\n;#sollwert drive X\np1460[0]=5\n";
    let gain = |text: &str| import(&format!("{text}{drive}")).values["axes.X.drive.position_gain_per_s"].value.clone();
    assert_eq!(gain(&own("H200", 9, 16.666_666_67)), "50.0", "as delivered");
    assert_eq!(gain(&own("H200", 9, 1.0)), "3.0", "in 1/s");
}

#[test]
fn inches_are_converted_and_said() {
    let values = |text: &str| -> Vec<(String, String)> {
        let imported = import(text);
        assert_eq!(
            said(&imported, "the listing is in inches"),
            text.contains("inch") || text.contains("INCH"),
            "{text}"
        );
        imported.values.iter().map(|(key, one)| (key.clone(), one.value.clone())).collect()
    };
    let more = "\
N30300 $MA_IS_ROT_AX[AX3]=1
N32000 $MA_MAX_AX_VELO[AX3]=20
N32300 $MA_MAX_AX_ACCEL[0,AX3]=5
N36100 $MA_POS_LIMIT_MINUS[AX1]=-254
N36110 $MA_POS_LIMIT_PLUS[AX1]=508
N42465 $SC_SMOOTH_CONTUR_TOL=0.0508
N33120 $MA_PATH_TRANS_POS_TOL[AX1]=0.0127
";
    let metric = format!("{PLAIN}{more}");
    // Written by hand: 40000 mm/min, 6 m/s², 30 m/s³ and so on in inches; nothing of the rotary axis changes.
    let imperial = [
        ("[AX1]=40000", "[AX1]=1574.8031496062993"),
        ("[AX2]=30000", "[AX2]=1181.1023622047244"),
        ("[0,AX1]=6\n", "[0,AX1]=236.22047244094488\n"),
        ("[4,AX1]=4\n", "[4,AX1]=157.48031496062993\n"),
        ("[0,AX1]=30\n", "[0,AX1]=1181.1023622047244\n"),
        ("[0,AX2]=5\n", "[0,AX2]=196.8503937007874\n"),
        ("[0,AX2]=20\n", "[0,AX2]=787.4015748031496\n"),
        ("[AX1]=-254", "[AX1]=-10"),
        ("[AX1]=508", "[AX1]=20"),
        ("=0.0508", "=0.002"),
        ("=0.0127", "=0.0005"),
    ]
    .iter()
    .fold(metric.clone(), |text, (from, to)| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    });
    let wanted = values(&metric);
    assert!(wanted.iter().any(|(key, value)| key == "axes.X.travel_mm" && value == "[-254.0, 508.0]"), "{wanted:?}");
    for head in
        ["INCH\n", "N10240 $MN_SCALING_SYSTEM_IS_METRIC=0 ; inch\n", "inch\nN10250 $MN_SCALING_VALUE_INCH=25.4\n"]
    {
        for ((key, wanted), (other, found)) in wanted.iter().zip(values(&format!("{head}{imperial}"))) {
            assert_eq!(*key, other);
            let numbers = |text: &str| -> Vec<f64> {
                text.trim_matches(['[', ']']).split(", ").filter_map(|one| one.parse().ok()).collect()
            };
            let near =
                numbers(wanted).iter().zip(numbers(&found)).all(|(one, other)| (one / other - 1.0).abs() < 1e-12);
            assert!(near && (numbers(wanted).len() == numbers(&found).len()), "{key}: {wanted} {found}");
        }
    }
    // A line METRIC says what the values are, whatever the control works in.
    assert_eq!(values(&format!("METRIC\nN10240 $MN_SCALING_SYSTEM_IS_METRIC=0\n{metric}")), wanted);
    assert_eq!(codes(&format!("INCH\nN10250 $MN_SCALING_VALUE_INCH=0\n{PLAIN}")), ["M0305"]);
}

#[test]
fn sums_behind_lines_are_passed_over_and_said() {
    // MD11230 is delivered so that every line has one.
    let summed: String = PLAIN.lines().map(|line| format!("{line} '38c0\n")).collect();
    let (imported, plain) = (import(&summed), import(PLAIN));
    let values = |imported: &Imported| -> Vec<(String, String)> {
        imported.values.iter().map(|(key, one)| (key.clone(), one.value.clone())).collect()
    };
    assert_eq!(values(&imported), values(&plain));
    assert!(said(&imported, "9 lines carry a sum"), "{:?}", imported.warnings);
    // What only looks like one is none.
    assert_eq!(codes(&format!("{PLAIN}N32300 $MA_MAX_AX_ACCEL[0,AX1]=7 '38c0a\n")), ["M0304"]);
    let hexadecimal = import(&format!("{PLAIN}N32300 $MA_MAX_AX_ACCEL[0,AX1]='H7' 'ff\n"));
    assert_eq!(hexadecimal.values["axes.X.acceleration_max_m_s2"].value, "7.0");
}

#[test]
fn two_axes_in_one_bracket_are_no_address() {
    assert_eq!(codes(&format!("{PLAIN}N32300 $MA_MAX_AX_ACCEL[u1,AX1]=7\n")), ["M0304"]);
    assert_eq!(codes(&format!("{PLAIN}N32300 $MA_MAX_AX_ACCEL[0,AX1]=6 7\n")), ["M0304"]);
    assert_eq!(codes(&format!("{PLAIN}N32300 $MA_MAX_AX_ACCEL[0,AX1]=\n")), ["M0304"]);
    assert_eq!(codes(&format!("{PLAIN}N32300 $MA_MAX_AX_ACCEL[0,AX1] |= 7\n")), ["M0304"]);
    assert!(codes(&format!("{PLAIN}N32300 $MA_MAX_AX_ACCEL [ 0 , ax1 ] = 7\n")).is_empty());
}

#[test]
fn a_kinematic_chain_is_said_once() {
    let chain = "$NK_NAME[0]=\"ROOT\" '38c0\n$NK_NEXT[0]=\"X\"\n$NK_OFF_DIR[1,0]=1\n$NT_NAME[0]=\"TRAORI\"\n";
    let imported = import(&format!("{PLAIN}{chain}"));
    assert!(
        said(&imported, "a kinematic chain (3 data $NK_, 1 data $NT_) is not taken over"),
        "{:?}",
        imported.warnings
    );
    let about = imported.warnings.iter().filter(|warning| warning.message.contains("$NK_")).count();
    assert_eq!(about, 1);
    // Each datum is listed.
    for datum in ["$NK_NAME", "$NK_NEXT", "$NK_OFF_DIR", "$NT_NAME"] {
        assert!(imported.unknown.iter().any(|unknown| unknown.datum.ends_with(datum)), "{:?}", imported.unknown);
    }
}

#[test]
fn data_of_transformations_that_turn_no_tool_are_listed_one_by_one() {
    let text = "$MC_TRAFO_TYPE_1=256\n$MC_TRAFO_TYPE_2=1024\n$MC_TRANSMIT_ROT_AX_OFFSET_1=30\n$MC_TRANSMIT_BASE_TOOL_1[0]=0\n$MC_TRAANG_ANGLE_2=45\n";
    let imported = import(&format!("{PLAIN}{text}"));
    assert!(said(&imported, "$MC_TRAFO_TYPE_1 = 256 (TRANSMIT)"), "{:?}", imported.warnings);
    assert!(said(&imported, "$MC_TRAFO_TYPE_2 = 1024 (TRAANG)"), "{:?}", imported.warnings);
    for datum in ["TRANSMIT_ROT_AX_OFFSET_1", "TRANSMIT_BASE_TOOL_1", "TRAANG_ANGLE_2"] {
        let listed = imported.unknown.iter().any(|unknown| unknown.datum.contains(datum) && unknown.count == 1);
        assert!(listed, "{datum}: {:?}", imported.unknown);
    }
}

/// A zip with stored members.
fn zipped(members: &[(&str, &[u8])]) -> Vec<u8> {
    use std::io::Write;
    let mut writer = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in members {
        writer.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

#[test]
fn a_zip_is_unpacked_and_a_damaged_one_refused() {
    let program = b"N10 $MA_MAX_AX_ACCEL[0,AX1]=99\nM30\n";
    let drive = "p0199[0]=88\np1460[0]=5\n";
    let bytes = zipped(&[
        ("NCU_NCU1/NCK_1/cfg/ncdata/initial.ini", PLAIN.as_bytes()),
        ("NCU_NCU1/NCK_1/mpf/test.mpf", program),
        ("NCU_NCU1/DRV_1/3/15/PS000003.TEA", drive.as_bytes()),
    ]);
    let read =
        |bytes: Vec<u8>| import_listing(&[ListingFile { name: "Backup.dsf".into(), bytes }], &ImportOptions::default());
    let imported = read(bytes.clone()).unwrap();
    assert_eq!(imported.values["axes.X.acceleration_max_m_s2"].value, "6.0");
    assert_eq!(imported.values["axes.X.drive.speed_gain_n_m_s_per_rad"].value, "5.0");
    for end in (0..bytes.len()).step_by(7) {
        let refused = read(bytes[..end].to_vec()).unwrap_err();
        let wanted = if end < 4 { ["M0301"] } else { ["M0302"] };
        assert_eq!(refused.iter().map(|finding| finding.code).collect::<Vec<_>>(), wanted, "cut at {end}");
    }
}

#[test]
fn marks_of_the_encoding_are_no_data() {
    let read = |bytes: Vec<u8>| {
        import_listing(&[ListingFile { name: "a.ini".into(), bytes }], &ImportOptions::default()).unwrap()
    };
    let with_mark = [b"\xef\xbb\xbf".as_slice(), PLAIN.as_bytes()].concat();
    let wide = |order: fn(u16) -> [u8; 2]| -> Vec<u8> {
        std::iter::once(0xfeff).chain(PLAIN.encode_utf16()).flat_map(order).collect()
    };
    for bytes in [with_mark, wide(u16::to_le_bytes), wide(u16::to_be_bytes)] {
        assert_eq!(read(bytes).values["axes.X.velocity_max_m_min"].value, "40.0");
    }
}

#[test]
fn programs_of_a_text_archive_set_no_data() {
    let program = "%_N_MILL_SPF\n;$PATH=/_N_SPF_DIR\nN10 $MA_MAX_AX_ACCEL[0,AX1]=99\nIF $MN_X==1 GOTOF E\n$MA_MAX_AX_ACCEL[0,AX1]=R5\nM17\n";
    let text = format!("{program}%_N_INITIAL_INI\n{PLAIN}M17\n{program}");
    assert_eq!(import(&text).values["axes.X.acceleration_max_m_s2"].value, "6.0");
}

#[test]
fn what_no_machine_file_says_is_said() {
    let more = "\
N32900 $MA_DYN_MATCH_ENABLE[AX1]=1
N32910 $MA_DYN_MATCH_TIME[0,AX1]=0.002
N32900 $MA_DYN_MATCH_ENABLE[AX2]=1
N32910 $MA_DYN_MATCH_TIME[0,AX2]=0
N32890 $MA_DESVAL_DELAY_ENABLE[AX2]=1
N32895 $MA_DESVAL_DELAY_TIME[AX2]=0.004
N32700 $MA_ENC_COMP_ENABLE[1,AX1]=1
$AA_ENC_COMP[1,0,AX1]=0.002
$AN_CEC_INPUT_AXIS[0]=(AX2)
N32490 $MA_FRICT_COMP_MODE[0,AX2]=2
N32500 $MA_FRICT_COMP_ENABLE[AX2]=1
";
    let imported = import(&format!("{PLAIN}{more}"));
    for words in
        ["X: MD32900", "Y: MD32890", "X: MD32700, MD32710: compensation tables are not taken over", "Y: MD32490 = 2"]
    {
        assert_eq!(imported.warnings.iter().filter(|one| one.message.contains(words)).count(), 1, "{words}");
    }
    assert!(!imported.warnings.iter().any(|warning| warning.severity == Severity::Error));
    assert!(import(PLAIN).warnings.iter().all(|warning| warning.code != "M0312"));
}

#[test]
fn every_datum_of_the_drive_comes_back_from_the_data_alone() {
    let sets = [
        "axes.X.drive.friction_compensation_mm_s=0.8",
        "axes.X.drive.friction_compensation_time_ms=20",
        "axes.X.drive.friction_adaptation=true",
        "axes.X.drive.friction_compensation_min_mm_s=0.5",
        "axes.X.drive.friction_acceleration_1_m_s2=0.03",
        "axes.X.drive.friction_acceleration_2_m_s2=0.2",
        "axes.X.drive.friction_acceleration_3_m_s2=0.5",
        "axes.X.drive.clamping_um=400",
        "axes.X.drive.speed_limit_time_ms=20",
        "axes.X.drive.emergency_stop_time_ms=70",
        "axes.X.drive.jerk_filter=fir_low_pass",
        "axes.X.drive.jerk_filter_time_ms=8",
        "axes.X.drive.jerk_filter_frequency_hz=30",
    ]
    .map(str::to_owned);
    let loaded = load("spinner_mvc850", &sets).unwrap();
    let listing = export_listing(&loaded);
    assert_same_machine(&loaded, &import(&listing).loaded);
    let imported = import(
        &listing
            .lines()
            .filter(|line| !line.starts_with(";#sollwert axes.X.drive."))
            .map(|line| format!("{line}\n"))
            .collect::<String>(),
    );
    for set in &sets {
        let (key, value) = set.split_once('=').unwrap();
        let found = &imported.values[key];
        assert_eq!(found.origin, Origin::Datum, "{key}");
        let same = match (value.parse::<f64>(), found.value.parse::<f64>()) {
            (Ok(one), Ok(other)) => (one - other).abs() <= 1e-9 * one.abs(),
            _ => found.value.trim_matches('"') == value,
        };
        assert!(same, "{key} = {}, wanted {value}", found.value);
    }
}

#[test]
fn a_spindle_taken_as_an_axis_and_a_gantry_left_out() {
    let text = format!(
        "{PLAIN}N10000 $MN_AXCONF_MACHAX_NAME_TAB[2]=\"SP1\"\nN10000 $MN_AXCONF_MACHAX_NAME_TAB[3]=\"XF1\"\n\
         N35000 $MA_SPIND_ASSIGN_TO_MACHAX[AX3]=1\nN30300 $MA_IS_ROT_AX[AX3]=1\nN32000 $MA_MAX_AX_VELO[AX3]=100\n\
         N37100 $MA_GANTRY_AXIS_TYPE[AX1]=1\nN37100 $MA_GANTRY_AXIS_TYPE[AX4]=11\n"
    );
    let imported = import(&text);
    assert!(said(&imported, "AX3 SP1: a spindle") && said(&imported, "AX4 XF1: a synchronous axis of a gantry"));
    assert_eq!(imported.loaded.machine.axes.len(), 2);
    let options =
        ImportOptions { axes: vec![AxisChoice { theirs: "SP1".into(), ours: "C".into() }], ..ImportOptions::default() };
    let imported = import_listing(&[file("d.ini", &text)], &options).unwrap();
    assert_eq!(imported.values["axes.C.velocity_max_rpm"].value, "100.0");
}

#[test]
fn places_that_a_listing_of_changes_leaves_out_have_the_axis_of_their_number() {
    let changed = |line: &&str| !line.contains("MACHAX_USED") || line.contains("[3]");
    let changes: String = FIVE.lines().filter(changed).map(|line| format!("{line}\n")).collect();
    assert_eq!(changes.lines().count() + 4, FIVE.lines().count());
    assert_same_machine(&import(FIVE).loaded, &import(&changes).loaded);
}
