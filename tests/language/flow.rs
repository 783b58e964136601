//! Jumps, repeated parts, skip levels.

use crate::nc_machine::{run, xyz};
use sollwert::interpreter::{Interpreter, Setup};
use sollwert::program::{ProgramSource, codes};

/// X of every motion.
fn xs(text: &str) -> Vec<f64> {
    let x = xyz().axis_by_name("X").unwrap();
    let done = run(text);
    assert!(done.alarm.is_none(), "{text}\n{}", done.alarm.unwrap().render(false));
    let moving =
        done.moves.iter().filter(|next| !matches!(next.kind, sollwert::interpreter::MoveKind::Function { .. }));
    moving.map(|next| next.end.0[x]).collect()
}

#[test]
fn jumps_to_labels_numbers_and_computed_targets() {
    for jump in [
        "GOTOF THERE",
        "GOTO THERE",
        "GOTOC THERE",
        "GOTOF N90",
        "GOTOF 90",
        "GOTOF :90",
        "GOTOF \"THE\"<<\"RE\"",
        "GOTOF \"there\"",
        "GOTOF \"N\"<<R5",
        "GOTOF LABEL",
        "GOTOF LABELS[1]",
        "GOTOF LABEL<<\"\"",
        "IF R5==90 GOTOF THERE",
        "IF R5==1 GOTOF ELSEWHERE IF R5==90 GOTOF THERE",
        "IF R5==1 GOTOF ELSEWHERE GOTOF THERE",
        "CASE R5 OF 1 GOTOF ELSEWHERE 90 GOTOF THERE DEFAULT GOTOF ELSEWHERE",
        "CASE R5 OF 1 GOTOF ELSEWHERE DEFAULT GOTOF THERE",
    ] {
        let text = format!(
            "DEF STRING[10] LABEL=\"THERE\", LABELS[2]=SET(\"X1\", \"THERE\")\nR5=90\nG0 X1\n{jump}\nX2\nELSEWHERE: X3\nN90 THERE: X4\nM30"
        );
        assert_eq!(xs(&text), [1.0, 4.0], "{jump}");
    }
    assert_eq!(xs("G0 X1\nGOTOC NOWHERE\nX2"), [1.0, 2.0]);
    assert_eq!(xs("R1=R1+1\nG0 X=R1\nIF R1<3 GOTOS\nX9"), [1.0, 2.0, 3.0, 9.0]);
    // A missing label is an alarm only where it is executed.
    assert_eq!(xs("G0 X1\nIF FALSE GOTOF NOWHERE\nX2"), [1.0, 2.0]);
    assert_eq!(run("G0 X1\nGOTOF NOWHERE").alarm().code, codes::NO_TARGET);
    // Of equal labels the nearest counts, in both directions.
    let twice = "GOTOF AA\nG0 X1\nAA: R1=R1+1 G0 X2\nIF R1>1 GOTOF FIN\nGOTOB AA\nAA: X4\nFIN: X5";
    assert_eq!(xs(twice), [2.0, 2.0, 5.0]);
}

#[test]
fn jumps_into_loops_and_out_of_them() {
    assert_eq!(xs("FOR R1=1 TO 5\nG0 X=R1\nIF R1==2 GOTOF OUT\nENDFOR\nOUT: X9"), [1.0, 2.0, 9.0]);
    // Into a loop: the counter is what it is.
    assert_eq!(xs("R1=2\nGOTOF IN\nFOR R1=1 TO 3\nG0 X0\nIN: G0 X=R1\nENDFOR"), [2.0, 0.0, 3.0]);
    let nested = "FOR R1=1 TO 2\nWHILE R2<R1\nR2=R2+1\nREPEAT\nR3=R3+1\nG0 X=R1*100+R2*10+R3\nUNTIL R3>=2\nR3=0\nENDWHILE\nR2=0\nENDFOR";
    assert_eq!(xs(nested), [111.0, 112.0, 211.0, 212.0, 221.0, 222.0]);
}

#[test]
fn parts_are_repeated() {
    // From the label to REPEAT: three passes more.
    assert_eq!(xs("G0 X0\nAA: R1=R1+1\nX=R1\nREPEAT AA P=3\nX9"), [0.0, 1.0, 2.0, 3.0, 4.0, 9.0]);
    assert_eq!(xs("G0 X0\nAA: R1=R1+1\nX=R1\nREPEAT AA P3\nX9"), [0.0, 1.0, 2.0, 3.0, 4.0, 9.0]);
    assert_eq!(xs("AA: R1=R1+1\nG0 X=R1\nREPEAT AA\nX9"), [1.0, 2.0, 9.0]);
    // To ENDLABEL, whose block belongs to it.
    assert_eq!(xs("AA: G0 X1\nENDLABEL: X2\nX3\nREPEAT AA P2"), [1.0, 2.0, 3.0, 1.0, 2.0, 1.0, 2.0]);
    // Between two labels, before REPEAT and behind it.
    assert_eq!(xs("AA: G0 X1\nBB: X2\nX3\nREPEAT AA BB"), [1.0, 2.0, 3.0, 1.0, 2.0]);
    assert_eq!(xs("G0 X0\nREPEAT AA BB P2\nM30\nAA: X1\nBB: X2\nX3"), [0.0, 1.0, 2.0, 1.0, 2.0]);
    // One block.
    assert_eq!(xs("AA: G91 G0 X1\nX10\nREPEATB AA P=2\nX100"), [1.0, 11.0, 12.0, 13.0, 113.0]);
    // Nested, and as often as a variable says.
    assert_eq!(xs("R5=1\nAA: G91 G0 X1\nREPEATB AA P=R5\nBB: X10\nREPEAT AA P=1"), [1.0, 2.0, 12.0, 13.0, 14.0, 24.0]);
    // A jump out of the part ends it: FIN is reached once.
    assert_eq!(xs("AA: R1=R1+1 G0 X=R1\nIF R1==3 GOTOF FIN\nREPEAT AA P9\nX50\nFIN: X9"), [1.0, 2.0, 3.0, 9.0]);
    assert_eq!(xs("AA: G0 X1\nREPEAT AA P=0\nX2"), [1.0, 2.0]);
    assert_eq!(run("G0 X1\nREPEAT NOWHERE").alarm().code, codes::NO_TARGET);
    assert_eq!(run("REPEAT AA\nM30\nAA: G0 X1").alarm().code, codes::NO_TARGET);
}

#[test]
fn skip_levels_are_active_when_asked_for() {
    let text = "G0 X1\n/X2\n/0 X3\n/3 X4\nN10 /X5\n/3 THIS IS NO BLOCK\nX6";
    let source = ProgramSource::from_bytes("a.mpf", text.as_bytes());
    let run = |skip_levels: u16| {
        let setup = Setup { skip_levels, ..Setup::from(source.clone()) };
        let mut interpreter = Interpreter::new(setup, &xyz());
        let x = xyz().axis_by_name("X").unwrap();
        let mut xs = Vec::new();
        while let Ok(Some(next)) = interpreter.next_move() {
            xs.push(next.end.0[x]);
        }
        xs
    };
    assert_eq!(run(0), [1.0, 2.0, 3.0, 4.0, 5.0]);
    assert_eq!(run(1 << 3), [1.0, 2.0, 3.0, 5.0, 6.0]);
    assert_eq!(run(1 | 1 << 3), [1.0, 6.0]);
}
