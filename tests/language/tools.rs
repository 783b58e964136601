//! Tools: which edge is active, what its length does to the axes, and what the workshop file says, by hand-derived positions.

use crate::nc_machine::{xyz, xyzbc};
use sollwert::base::diagnostics::SourceText;
use sollwert::base::{AxisId, Diagnostic};
use sollwert::interpreter::{Interpreter, Move, MoveKind, Setup};
use sollwert::kernel::{Kernel, Status};
use sollwert::machine::{Machine, Workshop, read_workshop};
use sollwert::program::ProgramSource;
use std::sync::Arc;

const TOOLS: &str = r#"
format = 1
[[tools]]
number = 1
name = "MILL_D10"
[[tools.edges]]
kind = 120
length_mm = [100.0, 20.0, 3.0]
radius_mm = 5.0
wear_length_mm = [-0.5]
wear_radius_mm = -0.01
[[tools.edges]]
length_mm = 60
[[tools]]
number = 2
[[tools.edges]]
length_mm = 40
base_length_mm = [10, 0, 0]
[[tools]]
name = "PROBE"
"#;

fn workshop(text: &str, machine: &Machine) -> Workshop {
    read_workshop(&SourceText::new("tools.toml", text), machine)
        .unwrap_or_else(|findings| panic!("{}", findings[0].render(false)))
}

fn setup(program: &str, tools: &str) -> Setup {
    let mut setup = Setup::from(ProgramSource::from_bytes("test.mpf", program.as_bytes()));
    setup.add_workshop(workshop(tools, &xyz()), &xyz());
    setup
}

fn moves(program: &str, tools: &str) -> (Vec<Move>, Vec<Diagnostic>, Option<Diagnostic>) {
    let mut interpreter = Interpreter::new(setup(program, tools), &xyz());
    let mut moves = Vec::new();
    let alarm = loop {
        match interpreter.next_move() {
            Ok(Some(next)) => moves.push(next),
            Ok(None) => break None,
            Err(alarm) => break Some(*alarm),
        }
    };
    (moves, interpreter.take_warnings(), alarm)
}

/// Tip and machine axes at the end.
fn places(program: &str) -> ([f64; 3], [f64; 3]) {
    let (moves, _, alarm) = moves(program, TOOLS);
    assert!(alarm.is_none(), "{program}: {}", alarm.unwrap().render(false));
    let last = moves.last().unwrap();
    let axis = |index| AxisId::new(index);
    let tip = [0, 1, 2].map(|index| last.end.0[axis(index)]);
    let length = |index| last.modes.tool.as_ref().map_or(0.0, |tool| tool.length[axis(index)]);
    (tip, [0, 1, 2].map(|index| tip[index] + length(index)))
}

#[test]
fn length_with_wear_and_adapter_belongs_to_the_axes_of_the_plane() {
    assert_eq!(places("T1 M6\nG0 X1 Y2 Z3"), ([1.0, 2.0, 3.0], [4.0, 22.0, 102.5]));
    assert_eq!(places("T1 M6\nG18\nG0 X1 Y2 Z3"), ([1.0, 2.0, 3.0], [21.0, 101.5, 6.0]));
    assert_eq!(places("G19\nT1 M6\nG0 X1 Y2 Z3"), ([1.0, 2.0, 3.0], [100.5, 5.0, 23.0]));
    assert_eq!(places("T2 M6\nG0 Z3"), ([0.0, 0.0, 3.0], [0.0, 0.0, 53.0]));
    assert_eq!(places("T=\"mill_d10\" M6 D2\nG0 Z3"), ([0.0, 0.0, 3.0], [0.0, 0.0, 63.0]));
}

#[test]
fn t_selects_and_m6_changes() {
    // Before M6 the spindle is empty.
    assert_eq!(places("T2\nG0 Z3").1[2], 3.0);
    assert_eq!(places("T2\nG0 Z3\nM6\nZ4").1[2], 54.0);
    assert_eq!(places("T2 M6\nD0\nG0 Z3").1[2], 3.0);
    assert_eq!(places("T2 M6\nG0 Z3\nT0 M6\nZ4").1[2], 4.0);
    let immediate =
        moves("T2\nG0 Z3", &format!("{TOOLS}\n").replacen("format = 1", "format = 1\nchange_with_m6 = false", 1));
    assert_eq!(immediate.0.last().unwrap().modes.tool.as_ref().unwrap().length[AxisId::new(2)], 50.0);
}

#[test]
fn the_axes_stand_while_the_edge_changes() {
    let (moves, _, _) = moves("G0 Z80\nT1 D2 M6\nX5\nG91 Z1\nG90 D0\nG0 X6", TOOLS);
    let z = AxisId::new(2);
    let machine_z: Vec<f64> =
        moves.iter().map(|next| next.end.0[z] + next.modes.tool.as_ref().map_or(0.0, |tool| tool.length[z])).collect();
    // Z stands at 80 until it has a word; G91 makes the length good: 80 + 1 of the tip, 60 of the tool. D0 leaves it there.
    // G0, M6, D2, X5, Z1, D0, X6.
    assert_eq!(machine_z, [80.0, 80.0, 80.0, 80.0, 141.0, 141.0, 141.0]);
    assert!(matches!(moves[1].kind, MoveKind::Function { stops: true }));
    assert_eq!(moves[1].end.0[z], 20.0, "the tip of the tool is 60 below");
}

#[test]
fn an_unknown_tool_is_an_alarm_with_a_table() {
    for (program, line, help) in [
        ("T7 M6", 1, "the table has MILL_D10, 2, PROBE"),
        ("T=\"MIL_D10\"", 1, "did you mean `MILL_D10`?"),
        ("T1 M6\nD3", 2, "it has D1, D2"),
    ] {
        let (_, _, alarm) = moves(program, TOOLS);
        let alarm = alarm.unwrap();
        assert_eq!((alarm.code, alarm.line(), alarm.help.as_deref()), ("E0512", line, Some(help)), "{program}");
    }
    let (_, warnings, alarm) = moves("T=\"PROBE\" M6\nG0 X1", TOOLS);
    assert!(alarm.is_none());
    assert_eq!(warnings[0].code, "W0004", "a tool without edges has no data");
}

#[test]
fn programs_read_and_write_tool_data() {
    let program = "R1=$TC_DP3[1,1] R2=$TC_DP12[1,1] R3=$TC_DP6[1,2]\n$TC_DP3[9,1]=70 $TC_DP6[9,1]=2\n\
                   T9 M6\nR4=$P_TOOLL[1] R5=$P_TOOLR R6=$P_TOOLNO R7=$P_TOOL\nG0 X=R1 Y=R2+R3 Z=R4+R5\nX=R6 Y=R7";
    let (moves, _, alarm) = moves(program, TOOLS);
    assert!(alarm.is_none(), "{}", alarm.unwrap().render(false));
    let end = |k: usize| [0, 1, 2].map(|index| moves[moves.len() - k].end.0[AxisId::new(index)]);
    assert_eq!(end(2), [100.0, -0.5, 72.0]);
    assert_eq!(end(1), [9.0, 1.0, 72.0]);
}

#[test]
fn zero_offsets_of_the_file_act_with_their_g_function() {
    let offsets = "format = 1\n[frames.G54]\ntranslation = { X_mm = 100, Y_mm = 50 }\nfine = { X_mm = 0.5 }\n\
                   rotation = { Z_deg = 90 }\n[frames.G505]\nmirror = [\"X\"]\nscale = { Y_ratio = 2 }\n[frames.basic]\ntranslation = { Z_mm = 1 }";
    let end = |program: &str| {
        let (moves, _, alarm) = moves(program, offsets);
        assert!(alarm.is_none(), "{program}: {}", alarm.unwrap().render(false));
        [0, 1, 2].map(|index| moves.last().unwrap().end.0[AxisId::new(index)])
    };
    assert_eq!(end("G0 X1 Y2 Z3"), [1.0, 2.0, 4.0]);
    assert_eq!(end("G54 G0 X1 Y2 Z3"), [98.5, 51.0, 4.0]);
    assert_eq!(end("G505\nG0 X1 Y2 Z3"), [-1.0, 4.0, 4.0]);
    assert_eq!(end("G54\nTRANS X10\nG0 X1 Y2 Z3"), [98.5, 61.0, 4.0]);
    assert_eq!(end("G54\nTRANS X10\nG53 G0 X1 Y2 Z3"), [1.0, 2.0, 4.0]);
    assert_eq!(end("G54\nTRANS X10\nSUPA G0 X1 Y2 Z3"), [1.0, 2.0, 3.0]);
    assert_eq!(end("G54 G0 X1 Y2 Z3\nG500 X1 Y2"), [1.0, 2.0, 4.0]);
    // Data management takes effect with the next G54; $P_IFRAME at once.
    assert_eq!(end("G54 G0 X1 Y2\n$P_UIFR[1,X,TR]=200\nX1 Y2\nG54 X1 Y2"), [198.5, 51.0, 0.0]);
    assert_eq!(end("G54\n$P_IFRAME=CTRANS(X,7)\nG0 X1 Y2"), [8.0, 2.0, 0.0]);
    assert_eq!(end("$P_UIFR[2]=CTRANS(X,10,Y,20):CROT(Z,90):CMIRROR(X)\nG55 G0 X1 Y2"), [8.0, 19.0, 0.0]);
    assert_eq!(
        end("DEF FRAME FF=CTRANS(X,10)\nFF[Y,TR]=5\nFF[Z,RT]=90\n$P_PFRAME=FF\nG0 X1 Y2 Z=$P_PFRAME[Z,RT]"),
        [8.0, 6.0, 91.0]
    );
    assert_eq!(
        end("DEF FRAME FF[2]\nFF[1]=CSCALE(X,2):CTRANS(X,3)\n$P_PFRAME=FF[1]\nG0 X1 Y=FF[1,X,SC]+$P_UIFRNUM"),
        [8.0, 2.0, 0.0]
    );
}

#[test]
fn a_file_that_is_not_right_is_refused_with_its_place() {
    let cases = [
        ("format = 1\n[[tools]]\nnumbr = 1", "M0003", 3, "did you mean `number`?"),
        ("format = 2", "M0006", 1, ""),
        ("[[tools]]\nnumber = 1", "M0004", 0, "format = 1"),
        ("format = 1\n[[tools]]\nnumber = 1\n[[tools.edges]]\nlength_mm = \"long\"", "M0005", 5, ""),
        ("format = 1\n[[tools]]\nnumber = 1\n[[tools.edges]]\nradius_mm = nan", "M0006", 5, ""),
        ("format = 1\n[[tools]]\nnumber = 1\n[[tools]]\nnumber = 1", "M0008", 4, ""),
        ("format = 1\n[frames.G58]", "M0003", 2, "G54 to G57"),
        ("format = 1\n[frames.G54]\ntranslation = { X = 1 }", "M0003", 3, "X_mm"),
        ("format = 1\n[frames.G54]\ntranslation = { W_mm = 1 }", "M0011", 3, "X, Y, Z"),
        ("format = 1\n[frames.G54]\nscale = { X_ratio = 0 }", "M0006", 3, ""),
        ("format = 1\n[frames.G54\n", "M0002", 2, ""),
    ];
    for (text, code, line, help) in cases {
        let findings = read_workshop(&SourceText::new("t.toml", text), &xyz()).unwrap_err();
        let finding = findings.iter().find(|finding| finding.code == code).unwrap_or(&findings[0]);
        assert_eq!(finding.code, code, "{text}: {}", finding.render(false));
        assert!(line == 0 || finding.line() == line, "{text}: {}", finding.render(false));
        assert!(finding.help.as_deref().unwrap_or_default().contains(help), "{text}: {}", finding.render(false));
    }
    let rotary = "format = 1\n[frames.G54]\nrotation = { C_deg = 1 }";
    assert_eq!(read_workshop(&SourceText::new("t.toml", rotary), &xyzbc()).unwrap_err()[0].code, "M0008");
}

#[test]
fn set_points_carry_the_length_and_the_tip_is_where_the_program_says() {
    let machine = Arc::new(xyz());
    let program = "G0 X10 Z50\nG1 F3000 X20\nT1 M6\nG0 X30\nZ20\nG1 X10 D2\nZ30\nM30";
    let mut kernel = Kernel::new(machine.clone(), setup(program, TOOLS), false);
    let (x, y, z) = (AxisId::new(0), AxisId::new(1), AxisId::new(2));
    let mut before: Option<[f64; 3]> = None;
    let mut last = ([0.0; 3], [0.0; 3]);
    while kernel.cycle().unwrap() == Status::Running {
        let setpoint = kernel.output().setpoint.unwrap();
        let axes_mm = [x, y, z].map(|axis| setpoint.axes[axis].position_lu);
        // No axis is faster than 20 m/min: a jump of the machine axes would be.
        let step_max_mm = 20_000.0 / 60.0 * machine.cycle.time_base.setpoint_period_s() * 1.001;
        if let Some(before) = before {
            for (now, then) in axes_mm.iter().zip(before) {
                assert!((now - then).abs() <= step_max_mm, "the axes jump from {before:?} to {axes_mm:?}");
            }
        }
        before = Some(axes_mm);
        last = (axes_mm, kernel.output().tool_setpoint.position_mm);
    }
    // At the end D2 (length 60): tip at X10 Y? Z30. Y never had a word, so that the axis stands at 0.
    assert!((last.0[0] - 10.0).abs() < 1e-9 && last.0[1] == 0.0 && (last.0[2] - 90.0).abs() < 1e-9, "{last:?}");
    assert!((last.1[2] - 30.0).abs() < 1e-9 && (last.1[0] - 10.0).abs() < 1e-9, "{last:?}");
}

#[test]
fn travel_is_that_of_the_machine_axes() {
    let limit_mm = xyz().axis(AxisId::new(2)).travel_lu.unwrap()[1];
    let inside = moves(&format!("T2 M6\nG0 Z{}", limit_mm - 50.0), TOOLS);
    assert!(inside.1.is_empty(), "{:?}", inside.1);
    let outside = moves(&format!("T2 M6\nG0 Z{}", limit_mm - 49.0), TOOLS);
    assert_eq!(outside.1[0].code, "W0002");
    assert!(outside.1[0].message.contains("1 mm beyond"), "{}", outside.1[0].message);
}
