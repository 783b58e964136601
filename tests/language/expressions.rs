//! Priorities, types and conversions of expressions.
//!
//! In: programs that show what they compute with MSG. Out: nothing; asserts. Priorities are judged by an evaluator of its own (a
//! shunting-yard on the table of the programming manual 12/2019, p. 444); conversions by the manual's table of type conversions.

use crate::nc_machine::xyz;
use crate::random::Random;
use sollwert::interpreter::{Event, Interpreter};
use sollwert::program::ProgramSource;

/// Messages up to the end or the alarm, and the code of that.
fn run(text: &str) -> (Vec<String>, Option<&'static str>) {
    let mut interpreter = Interpreter::new(ProgramSource::from_bytes("test.mpf", text.as_bytes()), &xyz());
    let mut found = Vec::new();
    loop {
        match interpreter.next_move() {
            Ok(Some(next)) => found.extend(next.events.into_iter().filter_map(|event| match event {
                Event::Message(text) => Some(text.to_string()),
                _ => None,
            })),
            Ok(None) => return (found, None),
            Err(alarm) => return (found, Some(alarm.code)),
        }
    }
}

/// Operators from tight to loose; the number is the manual's rank.
const OPERATORS: &[(&str, u8)] = &[
    ("*", 2),
    ("/", 2),
    ("DIV", 2),
    ("MOD", 2),
    ("+", 3),
    ("-", 3),
    ("B_AND", 4),
    ("B_XOR", 5),
    ("B_OR", 6),
    ("AND", 7),
    ("XOR", 8),
    ("OR", 9),
    ("==", 11),
    ("<>", 11),
    (">", 11),
    ("<", 11),
    (">=", 11),
    ("<=", 11),
];

/// `None`: division by zero.
fn apply(operator: &str, a: f64, b: f64) -> Option<f64> {
    let bits = |value: f64| value.round() as i32;
    let truth = |value: bool| f64::from(u8::from(value));
    let equal = (a - b).abs() <= 1e-12 * a.abs().max(b.abs());
    Some(match operator {
        "*" => a * b,
        "/" | "DIV" | "MOD" if b == 0.0 => return None,
        "/" => a / b,
        "DIV" => (a / b).trunc(),
        "MOD" => a % b,
        "+" => a + b,
        "-" => a - b,
        "B_AND" => f64::from(bits(a) & bits(b)),
        "B_XOR" => f64::from(bits(a) ^ bits(b)),
        "B_OR" => f64::from(bits(a) | bits(b)),
        "AND" => truth(a != 0.0 && b != 0.0),
        "XOR" => truth((a != 0.0) != (b != 0.0)),
        "OR" => truth(a != 0.0 || b != 0.0),
        "==" => truth(equal),
        "<>" => truth(!equal),
        ">" => truth(!equal && a > b),
        "<" => truth(!equal && a < b),
        ">=" => truth(equal || a > b),
        "<=" => truth(equal || a < b),
        other => panic!("{other}"),
    })
}

/// Operands and the operators between them, all of them left-associative.
fn shunting_yard(operands: &[f64], operators: &[(&str, u8)]) -> Option<f64> {
    let mut values = vec![operands[0]];
    let mut waiting: Vec<(&str, u8)> = Vec::new();
    let reduce = |values: &mut Vec<f64>, operator: &str| {
        let b = values.pop().expect("two operands");
        let a = values.pop().expect("two operands");
        values.push(apply(operator, a, b)?);
        Some(())
    };
    for (operand, (operator, rank)) in operands[1..].iter().zip(operators) {
        while let Some((last, last_rank)) = waiting.last().copied()
            && last_rank <= *rank
        {
            waiting.pop();
            reduce(&mut values, last)?;
        }
        waiting.push((operator, *rank));
        values.push(*operand);
    }
    while let Some((last, _)) = waiting.pop() {
        reduce(&mut values, last)?;
    }
    values.pop()
}

#[test]
fn operators_bind_as_the_manual_says() {
    let mut random = Random::new(20_261_126);
    let mut divisions_by_zero = 0;
    for _ in 0..3000 {
        let count = 2 + random.below(6) as usize;
        let mut text = String::new();
        let (mut operands, mut operators) = (Vec::new(), Vec::new());
        for place in 0..count {
            if place > 0 {
                let operator = OPERATORS[random.below(OPERATORS.len() as u32) as usize];
                text += &format!(" {} ", operator.0);
                operators.push(operator);
            }
            let digit = random.below(8);
            // Signs and NOT bind tighter than everything else.
            let (written, value) = match random.below(5) {
                0 => (format!("NOT {digit}"), f64::from(u8::from(digit == 0))),
                1 => (format!("B_NOT {digit}"), f64::from(!(digit as i32))),
                2 => (format!("-{digit}"), -f64::from(digit)),
                _ => (digit.to_string(), f64::from(digit)),
            };
            text += &written;
            operands.push(value);
        }
        let program = format!("R1={text}\nMSG(\"\"<<R1)\n");
        match (shunting_yard(&operands, &operators), run(&program)) {
            (None, (_, code)) => {
                assert_eq!(code, Some("E0304"), "{text}");
                divisions_by_zero += 1;
            }
            (Some(value), (messages, None)) => {
                let shown: f64 = messages[0].parse().expect("a number");
                assert!((shown - value).abs() <= 1e-6, "{text}: {shown}, expected {value}");
            }
            (Some(value), (_, Some(code))) => panic!("{text}: alarm {code}, expected {value}"),
        }
    }
    assert!(divisions_by_zero > 10 && divisions_by_zero < 1500);
}

/// What is shown of a variable of that type after `NAME=value`, or the code of the alarm.
fn stored(variable_type: &str, value: &str) -> String {
    let program = format!("DEF {variable_type} NAME\nNAME={value}\nMSG(\"\"<<NAME)\n");
    let (mut messages, code) = run(&program);
    code.map_or_else(|| messages.remove(0), str::to_owned)
}

#[test]
fn types_are_converted_by_the_table() {
    for (variable_type, value, shown) in [
        // From REAL: a fraction of 0.5 and more is rounded up.
        ("INT", "2.5", "3"),
        ("INT", "2.49", "2"),
        ("INT", "3EX9", "E0306"),
        ("BOOL", "0.1", "1"),
        ("BOOL", "0.0", "0"),
        ("CHAR", "65.4", "A"),
        ("STRING[10]", "1.5", "E0303"),
        // From INT.
        ("REAL", "7", "7"),
        ("BOOL", "-3", "1"),
        ("CHAR", "65", "A"),
        ("CHAR", "256", "E0306"),
        ("CHAR", "'H41'", "A"),
        ("STRING[10]", "7", "E0303"),
        // From BOOL.
        ("REAL", "TRUE", "1"),
        ("INT", "TRUE", "1"),
        ("CHAR", "TRUE", "\u{1}"),
        ("STRING[10]", "TRUE", "1"),
        // From STRING: a CHAR of one character, a BOOL by the length.
        ("CHAR", "\"A\"", "A"),
        ("CHAR", "\"AB\"", "E0303"),
        ("BOOL", "\"\"", "0"),
        ("BOOL", "\"0\"", "1"),
        ("REAL", "\"5\"", "E0303"),
        ("INT", "\"5\"", "E0303"),
        ("STRING[2]", "\"ABC\"", "E0308"),
        // From AXIS.
        ("REAL", "X", "E0303"),
        ("AXIS", "5", "E0303"),
    ] {
        assert_eq!(stored(variable_type, value), shown, "{variable_type} = {value}");
    }
}

#[test]
fn a_char_is_a_number_and_a_character() {
    let text = "DEF CHAR ONE=\"A\", FEW[2]=SET(66,\"C\")\nDEF STRING[5] TXT\nR1=ONE+1\nTXT=ONE\n\
        MSG(\"\"<<R1<<\" \"<<ONE<<FEW[0]<<FEW[1]<<\" \"<<TXT)\nMSG(\"\"<<(ONE==\"A\")<<(ONE==65)<<(\"B\"==ONE)<<(ONE<FEW[0]))\n";
    assert_eq!(run(text), (vec!["66 ABC A".to_owned(), "1101".to_owned()], None));
}

#[test]
fn the_character_0_ends_a_text() {
    // The example of the programming manual (string operations); the place is that of the German text there.
    let text = "DEF STRING[20] STRG=\"axis . stationary\"\nSTRG[5]=\"X\"\nMSG(STRG)\nSTRG[5]=0\nMSG(STRG)\nMSG(\"\"<<STRLEN(STRG))\n";
    assert_eq!(run(text).0, ["axis X stationary", "axis ", "5"]);
}

#[test]
fn numbers_are_read_in_every_form() {
    for (written, value) in [
        ("1EX3", "1000"),
        ("-.1EX-3", "-0.0001"),
        ("2.5ex1", "25"),
        ("'HFF'", "255"),
        ("'hff'", "255"),
        ("'B101'", "5"),
        ("'D17'", "17"),
        ("'HFFFFFFFF'", "-1"),
        (".25", "0.25"),
        ("7.", "7"),
        ("TRUE", "1"),
        ("2147483647", "2147483647"),
        ("2147483647+1", "2147483648"),
    ] {
        assert_eq!(run(&format!("MSG(\"\"<<({written}))\n")).0, [value], "{written}");
    }
    for written in ["'H'", "'B2'", "'H1FFFFFFFF'", "'A1'", "'HFF"] {
        let code = run(&format!("R1={written}\n")).1;
        assert!(matches!(code, Some("E0102" | "E0103")), "{written}: {code:?}");
    }
}

#[test]
fn r_parameters_have_three_forms() {
    let text = "R1=2 R[2]=5 $R3=7\nR[R1+2]=$R1*10\n$R[R1*3]=1\nMSG(\"\"<<R1<<R2<<R3<<R4<<R[6]<<$R[2]<<R007)\n";
    assert_eq!(run(text).0, ["257201".to_owned() + "50"]);
    assert_eq!(run("R[-1]=1\n").1, Some("E0307"));
    assert_eq!(run("R1=R[40000]\n").1, Some("E0307"));
}

#[test]
fn names_have_at_most_31_characters() {
    let name = "A".repeat(31);
    assert_eq!(run(&format!("DEF INT {name}=3\nMSG(\"\"<<{name})\n")), (vec!["3".to_owned()], None));
    assert_eq!(run(&format!("DEF INT {name}B=3\n")).1, Some("E0302"));
    assert_eq!(run("DEF INT A1=3\n").1, Some("E0302"));
}

#[test]
fn arrays_are_filled_from_an_element_on() {
    let shown = |start: &str| {
        run(&format!(
            "DEF INT ARR[2,2,2]\n{start}\nMSG(\"\"<<ARR[0,0,0]<<ARR[0,0,1]<<ARR[0,1,0]<<ARR[0,1,1]<<ARR[1,0,0]<<ARR[1,0,1]<<ARR[1,1,0]<<ARR[1,1,1])\n"
        ))
        .0
    };
    assert_eq!(shown("ARR[0,0,0]=SET(1,2,3,4,5,6,7,8)"), ["12345678"]);
    // The last index runs fastest; a gap leaves its element alone.
    assert_eq!(shown("ARR[0,1,0]=SET(1,,3)"), ["00103000"]);
    assert_eq!(shown("ARR[0,1,1]=REP(7)"), ["00077777"]);
    assert_eq!(shown("ARR[0,1,1]=REP(7,2)"), ["00077000"]);
    // In a DEF, SET may be left out.
    assert_eq!(
        run("DEF INT ARR[2,2]=(1,2,,4), SUM[2]=(3+4)*2\nMSG(\"\"<<ARR[0,1]<<ARR[1,1]<<ARR[1,0]<<SUM[1])\n").0,
        ["24014"]
    );
    assert_eq!(run("DEF INT ARR[2]=SET(1,2,3)\n").1, Some("E0307"));
    assert_eq!(run("DEF REAL FAR[400,400,400]\n").1, Some("E0309"));
    assert_eq!(run("DEF REAL FAR[2,2,2,2]\n").1, Some("E0307"));
}

#[test]
fn a_program_raises_alarms() {
    assert_eq!(run("MSG(\"a\")\nSETAL(65000, \"no \"<<5)\nMSG(\"b\")\n"), (vec!["a".to_owned()], Some("E0601")));
    assert_eq!(run("SETAL(67001)\nMSG(\"b\")\n"), (vec!["b".to_owned()], None));
    assert_eq!(run("SETAL(500)\n").1, Some("E0306"));
    assert_eq!(run("SETAL()\n").1, Some("E0104"));
    let mut interpreter = Interpreter::new(
        ProgramSource::from_bytes("a.mpf", &b"SETAL(67001,\"low\")\nSETAL(67001,\"low\")\n"[..]),
        &xyz(),
    );
    while interpreter.next_move().expect("no alarm").is_some() {}
    let warnings = interpreter.take_warnings();
    assert_eq!(warnings.len(), 1, "once a number");
    assert!(warnings[0].code == "W0007" && warnings[0].message.contains("67001: low"), "{:?}", warnings[0]);
}

#[test]
fn match_finds_a_text_in_a_text() {
    assert_eq!(run("MSG(\"\"<<MATCH(\"Werkstueck\",\"stue\")<<MATCH(\"abc\",\"x\"))\n").0, ["4-1"]);
}

#[test]
fn what_a_plc_would_set_is_kept_and_reported() {
    let text = "$A_DBB[3]=200\n$A_OUTA[1]=2.5\n$AC_ACTUAL_PARTS=$AC_ACTUAL_PARTS+1\nMSG(\"\"<<$A_DBB[3]<<\" \"<<$A_OUTA[1]<<\" \"<<$AC_ACTUAL_PARTS<<\" \"<<$A_DBW[9])\n";
    let mut interpreter = Interpreter::new(ProgramSource::from_bytes("a.mpf", text.as_bytes()), &xyz());
    let mut messages = Vec::new();
    while let Some(next) = interpreter.next_move().expect("no alarm") {
        messages.extend(next.events.into_iter().filter_map(|event| match event {
            Event::Message(text) => Some(text.to_string()),
            _ => None,
        }));
    }
    assert_eq!(messages, ["200 2.5 1 0"]);
    let warnings = interpreter.take_warnings();
    assert_eq!(warnings.iter().map(|warning| warning.code).collect::<Vec<_>>(), ["W0001"]);
    assert_eq!(run("$A_DBB[0]=256\n").1, Some("E0306"));
    // Reading alone is reported too.
    let mut interpreter = Interpreter::new(ProgramSource::from_bytes("a.mpf", &b"R1=$A_IN[1]\n"[..]), &xyz());
    while interpreter.next_move().expect("no alarm").is_some() {}
    assert_eq!(interpreter.take_warnings().len(), 1);
}

#[test]
fn a_datum_that_is_not_in_the_machine_file_is_named() {
    for name in ["$MA_BACKLASH[0,X]", "$MN_INT_INCR_PER_MM", "$SA_SPIND_S[1]"] {
        assert_eq!(run(&format!("R1={name}\n")).1, Some("E0310"), "{name}");
    }
    assert_eq!(run("MSG($MC_AXCONF_GEOAX_NAME_TAB[1]<<$MC_MM_NUM_R_PARAM)\n").0, ["Y32535"]);
    assert_eq!(run("MSG(\"\"<<$P_OTOL)\nOTOL=0.5\nMSG(\"\"<<$P_OTOL)\n").0, ["-1", "0.5"]);
}

#[test]
fn the_feed_is_told_in_its_unit() {
    for (text, shown) in [
        ("F500\n", "500"),
        ("G95 F0.2 S1000 M3\n", "0.2"),
        ("G93 F2\n", "2"),
        ("G931 F3\n", "3"),
        ("G700 F20\n", "20"),
        ("G1 X1 F250\n", "250"),
    ] {
        assert_eq!(run(&format!("{text}MSG(\"\"<<$P_F)\n")).0, [shown], "{text}");
    }
}

#[test]
fn g_functions_are_told_by_their_number() {
    // Programming manual, list of G functions: place of each in its group.
    for (text, group, number) in [
        ("G0 X0", 1, 1),
        ("G18", 6, 2),
        ("G55", 8, 3),
        ("G505", 8, 6),
        ("G64", 10, 2),
        ("G602", 12, 2),
        ("G70", 13, 1),
        ("G91", 14, 2),
        ("G95", 15, 3),
        ("SOFT", 21, 2),
        ("FFWOF", 24, 1),
        ("COMPCAD", 30, 4),
        ("FLIN", 37, 2),
        ("RTLIOF", 55, 2),
        ("DYNFINISH", 59, 5),
    ] {
        assert_eq!(run(&format!("{text}\nMSG(\"\"<<$P_GG[{group}])\n")).0, [number.to_string()], "{text}");
    }
    assert_eq!(run("R1=$P_GG[99]\n").1, Some("E0307"));
}

#[test]
fn a_sub_program_knows_its_level_and_what_it_was_given() {
    let text = "%_N_MAIN_MPF\nEXTERN SUB(INT, INT)\nSUB(5)\nMSG(\"\"<<$P_STACK)\nM30\n%_N_SUB_SPF\nPROC SUB(INT AAA, INT BBB)\n\
        MSG(\"\"<<$P_STACK<<$P_SUBPAR[1]<<$P_SUBPAR[2]<<$P_SUBPAR[0])\nRET\n";
    assert_eq!(run(text), (vec!["1100".to_owned(), "0".to_owned()], None));
}
