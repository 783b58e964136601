//! Variables, texts and system variables: values by the rules of the language, worked out by hand.
//!
//! In: programs that write what they compute into R parameters or messages. Out: nothing; asserts what comes out as messages.

use crate::nc_machine::xyz;
use sollwert::interpreter::{Event, Interpreter, MainRun, MoveKind, Setup};
use sollwert::program::{ProgramSource, SYSTEM_VARIABLES};

/// Messages of a program in order.
fn messages(text: &str) -> Vec<String> {
    messages_of(ProgramSource::from_bytes("test.mpf", text.as_bytes()).into())
}

fn messages_of(setup: Setup) -> Vec<String> {
    let mut interpreter = Interpreter::new(setup, &xyz());
    let mut found = Vec::new();
    loop {
        match interpreter.next_move() {
            Ok(Some(next)) => {
                for event in next.events {
                    if let Event::Message(text) = event {
                        found.push(text.to_string());
                    }
                }
            }
            Ok(None) => return found,
            Err(alarm) => panic!("{alarm:?}"),
        }
    }
}

/// The value of one expression as text.
fn shown(expression: &str) -> String {
    messages(&format!("MSG(\"\"<<({expression}))\n")).remove(0)
}

fn alarm(text: &str) -> &'static str {
    let mut interpreter = Interpreter::new(ProgramSource::from_bytes("test.mpf", text.as_bytes()), &xyz());
    loop {
        match interpreter.next_move() {
            Ok(Some(_)) => {}
            Ok(None) => panic!("no alarm in {text}"),
            Err(alarm) => return alarm.code,
        }
    }
}

#[test]
fn functions_of_texts() {
    for (expression, value) in [
        ("TOUPPER(\"aBc1\")", "ABC1"),
        ("TOLOWER(\"aBc1\")", "abc1"),
        ("STRLEN(\"\")", "0"),
        ("STRLEN(\"Soll\")", "4"),
        ("INDEX(\"abcabc\", \"b\")", "1"),
        ("RINDEX(\"abcabc\", \"b\")", "4"),
        ("INDEX(\"abc\", \"x\")", "-1"),
        ("MINDEX(\"A/B*C\", \"*+/\")", "1"),
        ("SUBSTR(\"Werkstueck\", 4)", "stueck"),
        ("SUBSTR(\"Werkstueck\", 0, 4)", "Werk"),
        ("SUBSTR(\"abc\", 9)", ""),
        ("NUMBER(\" -12.5 \")", "-12.5"),
        ("NUMBER(\"1.5EX2\")", "150"),
        ("ISNUMBER(\"12\")", "1"),
        ("ISNUMBER(\"12x\")", "0"),
        ("ISNUMBER(\"\")", "0"),
        ("AXSTRING(AXNAME(\"Y\"))", "Y"),
        ("ISAXIS(3)", "1"),
        ("ISAXIS(4)", "0"),
        ("ISVAR(\"R5\")", "1"),
        ("ISVAR(\"$P_EP[X]\")", "1"),
        ("ISVAR(\"NOWHERE\")", "0"),
        ("SPRINT(\"%6.2F|%-4D|%S\", 3.14159, 42, \"x\")", "  3.14|42  |x"),
        ("SPRINT(\"%X %B %E\", 255, 7, 12345.678)", "FF 1 1.234568e+04"),
        ("SPRINT(\"100%%\")", "100%"),
        ("X == X", "1"),
        ("X == Y", "0"),
    ] {
        assert_eq!(shown(expression), value, "{expression}");
    }
    for text in ["R1=NUMBER(\"ab\")", "R1=STRLEN(5.5)", "R1=X", "R1=SUBSTR(\"a\",-1)", "R1=AXNAME(\"Q\")"] {
        assert!(alarm(text).starts_with("E03") || alarm(text) == "E0204", "{text}");
    }
}

#[test]
fn characters_of_texts() {
    let text = "DEF STRING[10] NAME=\"Fraes\"\nDEF STRING[5] LIST[2]=(\"ab\",\"cd\")\nNAME[0]=\"G\"\nNAME[1]=82\nMSG(NAME)\nMSG(\"\"<<NAME[2])\n";
    // The list of values needs SET on the control as here.
    let text = text.replace("=(\"ab\",\"cd\")", "=SET(\"ab\",\"cd\")") + "MSG(\"\"<<LIST[1,1])\n";
    assert_eq!(messages(&text), ["GRaes", "a", "d"]);
    assert_eq!(alarm("DEF STRING[4] TXT=\"ab\"\nTXT[2]=\"c\"\n"), "E0307");
}

#[test]
fn variables_of_axes() {
    let text =
        "DEF AXIS WHICH=Y, LIST[2]\nLIST[1]=X\nG0 X3 Y4\nMSG(AXSTRING(WHICH)<<AXSTRING(LIST[1])<<$P_EP[WHICH])\n";
    assert_eq!(messages(text), ["YX4"]);
    assert_eq!(alarm("DEF AXIS WHICH\nR1=$P_EP[WHICH]\n"), "E0303");
    assert_eq!(alarm("DEF AXIS WHICH=5\n"), "E0303");
}

#[test]
fn an_axis_word_may_be_computed() {
    let text = "DEF AXIS WHICH=Y\nG0 AX[WHICH]=7 AX[X]=IC(2)\nMSG(\"\"<<$P_EP[X]<<$P_EP[Y])\n";
    assert_eq!(messages(text), ["27"]);
    assert_eq!(alarm("G0 AX[5]=1\n"), "E0204");
    assert_eq!(alarm("G0 X1 AX[X]=1\n"), "E0205");
}

#[test]
fn the_priority_of_and_is_warned_of() {
    let warned = |text: &str| {
        let mut interpreter = Interpreter::new(ProgramSource::from_bytes("a.mpf", text.as_bytes()), &xyz());
        while interpreter.next_move().expect("no alarm").is_some() {}
        interpreter.take_warnings().iter().filter(|finding| finding.code == "W0005").count()
    };
    assert_eq!(warned("R1=10 R2=20\nIF R1==10 AND R2==20 GOTOF LAB\nLAB: M30\n"), 1);
    assert_eq!(warned("R1=10 R2=20\nIF (R1==10) AND (R2==20) GOTOF LAB\nLAB: M30\n"), 0);
    assert_eq!(warned("IF R1==(1 AND 0) GOTOF LAB\nLAB: M30\n"), 0);
    assert_eq!(warned("IF R1+R2*2>3 GOTOF LAB\nLAB: M30\n"), 0);
    // 10 AND 20 is TRUE, which is 1; R1 == 1 is FALSE; FALSE == 20 is FALSE.
    assert_eq!(messages("R1=10 R2=20\nIF R1==10 AND R2==20\nMSG(\"yes\")\nELSE\nMSG(\"no\")\nENDIF\n"), ["no"]);
}

#[test]
fn a_late_definition_is_warned_of() {
    let warned = |text: &str| {
        let mut interpreter = Interpreter::new(ProgramSource::from_bytes("a.mpf", text.as_bytes()), &xyz());
        while interpreter.next_move().expect("no alarm").is_some() {}
        let lines = interpreter.take_warnings().into_iter().filter(|finding| finding.code == "W0006");
        lines.map(|finding| finding.line()).collect::<Vec<_>>()
    };
    assert!(warned("; comment\nDEF REAL FIRST\nN10 DEF INT SECOND=3\nG0 X1\n").is_empty());
    assert_eq!(warned("DEF REAL FIRST\nG0 X1\nDEF INT SECOND\nDEF INT THIRD\n"), [3]);
    assert_eq!(warned("R1=5\nDEF INT SECOND\n"), [2]);
}

#[test]
fn global_variables_come_from_definition_files() {
    let source = |name: &str, text: &str| ProgramSource::from_bytes(name, text.as_bytes());
    let file = "%_N_UGUD_DEF\n;$PATH=/_N_DEF_DIR\nDEF NCK SYNR APW 3 REAL DEPTH=-12.5 LLI -20 ULI 0\nDEF CHAN INT COUNT[3]=SET(1,2,3)\nM17\n";
    let setup = Setup {
        definitions: vec![source("UGUD.DEF", file)],
        ..source("a.mpf", "MSG(\"\"<<DEPTH<<COUNT[2])\nCOUNT[2]=7\nMSG(\"\"<<COUNT[2])\n").into()
    };
    assert_eq!(messages_of(setup), ["-12.53", "7"]);
    let setup = Setup { definitions: vec![source("U.DEF", "G0 X1\n")], ..source("a.mpf", "M30\n").into() };
    let mut interpreter = Interpreter::new(setup, &xyz());
    let alarm = (0..3).find_map(|_| interpreter.next_move().err()).expect("an alarm");
    assert_eq!((alarm.code, &*alarm.place.expect("a place").file), ("E0207", "U.DEF"));
    assert_eq!(self::alarm("DEF CHAN REAL LOCAL_ONE\n"), "E0207");
}

#[test]
fn system_variables_of_the_preparation() {
    let text = "G17 G64 G500\nTRANS X10\nG1 X5 Y2 F1200\nMSG(\"\"<<$P_F)\nMSG(\"\"<<$P_EP[X]<<\"/\"<<$P_EPM[X])\n\
                MSG(\"\"<<$P_GG[6]<<$P_GG[10]<<$P_GG[14])\nMSG(AXSTRING($P_AXN3))\nMSG(\"\"<<$P_SIM<<$P_SEARCH)\n";
    assert_eq!(messages(text), ["1200", "5/15", "121", "Z", "10"]);
    assert_eq!(alarm("R1=$P_NOTHING\n"), "E0310");
    assert_eq!(alarm("$P_F=5\n"), "E0305");
    assert_eq!(alarm("R1=$P_EP[5]\n"), "E0204");
}

#[test]
fn machine_data_are_in_the_units_of_the_control() {
    let machine = sollwert::machine::load("mikron_ucp710", &[]).expect("shipped").machine;
    let text = "MSG(\"\"<<$MA_MAX_AX_VELO[X]<<\" \"<<$MA_MAX_AX_VELO[C]<<\" \"<<$MA_MAX_AX_ACCEL[0,Y]<<\" \"<<$MA_POSCTRL_GAIN[X])\n";
    let mut interpreter = Interpreter::new(ProgramSource::from_bytes("a.mpf", text.as_bytes()), &machine);
    let first = interpreter.next_move().expect("no alarm").expect("a move");
    let message =
        first.events.iter().find_map(|event| if let Event::Message(text) = event { Some(text) } else { None });
    // models/machines.md: 30 m/min, 20 rpm, 3 m/s², Kv 50 1/s = 3 (m/min)/mm.
    assert_eq!(message.map(|text| &**text), Some("30000 20 3 3"));
}

#[test]
fn the_main_run_is_asked_at_rest_and_once() {
    let text = "G1 X10 F1000\nR1=R1+1 R2=$AA_IM[X]\nMSG(\"\"<<R1<<\"/\"<<R2<<\"/\"<<$AC_CYCLE_TIME)\nM30\n";
    let mut interpreter = Interpreter::new(ProgramSource::from_bytes("a.mpf", text.as_bytes()), &xyz());
    let mut kinds = Vec::new();
    let mut told = 0.0;
    while let Some(next) = interpreter.next_move().expect("no alarm") {
        if next.kind == MoveKind::StopPreparation {
            told += 1.5;
            interpreter.tell_main_run(MainRun { time_s: told, cutting_time_s: 0.0 });
        }
        kinds.extend(next.events.iter().filter_map(|event| match event {
            Event::Message(text) => Some(text.to_string()),
            _ => None,
        }));
    }
    assert_eq!(kinds, ["1/10/3"]);
}

#[test]
fn traces_markers_and_clocks() {
    let text = "$AN_SLTRACE=1\nG1 X1 F100\n$AN_SLTRACE=2\n$AC_MARKER[3]=7\n$AC_PARAM[0]=2.5\nMSG(\"\"<<$AC_MARKER[3]+$AC_PARAM[0])\n$AC_TIMER[1]=5\nMSG(\"\"<<$AC_TIMER[1])\n";
    assert_eq!(messages(text), ["9.5", "5"]);
    let mut interpreter = Interpreter::new(ProgramSource::from_bytes("a.mpf", text.as_bytes()), &xyz());
    let mut traces = Vec::new();
    while let Some(next) = interpreter.next_move().expect("no alarm") {
        traces.extend(next.events.into_iter().filter(|event| matches!(event, Event::Trace(_))));
    }
    assert_eq!(traces, [Event::Trace(true), Event::Trace(false)]);
    assert_eq!(alarm("$AN_SLTRACE=5\n"), "E0306");
}

#[test]
fn the_documentation_lists_every_system_variable() {
    let text = include_str!("../../docs/system-variables.md");
    for variable in SYSTEM_VARIABLES {
        let access = if variable.writable { "read, write" } else { "read" };
        let stop = if variable.main_run { "yes" } else { "no" };
        let row = format!("| `{}` | {access} | {stop} | {} |", variable.name, variable.meaning.replace('|', "\\|"));
        assert!(text.contains(&row), "docs/system-variables.md lacks: {row}");
    }
    let rows = text.lines().filter(|line| line.starts_with("| `$")).count();
    assert_eq!(rows, SYSTEM_VARIABLES.len());
}
