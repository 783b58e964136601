//! Blocks per second from text to moves, one core: what a CAM program is made of, the same with blocks that take the whole parser,
//! a loop with expressions, and a sub-program that is called again and again.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sollwert::interpreter::Interpreter;
use sollwert::machine::Machine;
use sollwert::program::ProgramSource;
use std::fmt::Write;
use std::hint::black_box;

#[path = "../tests/nc_machine/mod.rs"]
mod nc_machine;

const BLOCKS: u64 = 100_000;

fn moves(source: &ProgramSource, machine: &Machine) -> u64 {
    let mut interpreter = Interpreter::new(source.clone(), machine);
    let mut count = 0;
    while let Ok(Some(next)) = interpreter.next_move() {
        black_box(&next);
        count += 1;
    }
    count
}

fn program(block: impl Fn(u64, f64, &mut String)) -> ProgramSource {
    let mut text = String::from("N1 G90 G1 F2000\n");
    for number in 0..BLOCKS {
        block(number * 10 + 10, number as f64 * 0.001, &mut text);
    }
    ProgramSource::from_bytes("bench.mpf", text.into_bytes())
}

fn interpreter(criterion: &mut Criterion) {
    let machine = nc_machine::xyz();
    let cases = [
        (
            "plain",
            program(|n, s, text| _ = writeln!(text, "N{n} G1 X{:.3} Y{:.3} Z{:.3}", s, 100.0 - s, 10.0 + s / 7.0)),
        ),
        (
            "comments",
            program(|n, s, text| _ = writeln!(text, "N{n} G1 X{:.3} Y{:.3} Z{:.3} ;cut", s, 100.0 - s, 10.0 + s / 7.0)),
        ),
        ("expressions", program(|n, s, text| _ = writeln!(text, "N{n} R1={s:.3} X=R1*2 Y=SIN(R1)+10"))),
        (
            "loop",
            ProgramSource::from_bytes(
                "loop.mpf",
                format!("DEF INT COUNT\nG1 F2000\nFOR COUNT=1 TO {BLOCKS}\nX=COUNT/1000 Y=COUNT MOD 7\nENDFOR\nM30\n")
                    .into_bytes(),
            ),
        ),
        (
            "calls",
            ProgramSource::from_bytes(
                "calls.mpf",
                format!(
                    "%_N_CALLS_MPF\nG91 G1 F2000\nFOR R1=1 TO {BLOCKS}\nSTEP_UP\nENDFOR\nM30\n%_N_STEP_UP_SPF\nX0.001 Y=R1/1000\nRET\n"
                )
                .into_bytes(),
            ),
        ),
    ];
    let mut group = criterion.benchmark_group("interpreter");
    group.throughput(Throughput::Elements(BLOCKS));
    for (name, source) in &cases {
        assert!(moves(source, &machine) >= BLOCKS, "the program `{name}` runs to its end");
        group.bench_function(*name, |bencher| bencher.iter(|| moves(source, &machine)));
    }
    group.finish();
}

criterion_group!(benches, interpreter);
criterion_main!(benches);
