//! Tuning two axes on three programs of ten seconds: courses tuned per second. The aim is under 5 s on two cores.

use criterion::{Criterion, criterion_group, criterion_main};
use sollwert::interpreter::Setup;
use sollwert::machine::load;
use sollwert::program::ProgramSource;
use sollwert::tune::{Course, Objective, TuneOptions, course_of_program, tune};
use std::hint::black_box;
use std::sync::Arc;

/// Ten seconds of circles and lines in X and Y.
fn program(number: u32) -> String {
    let radius = 6.0 + 3.0 * f64::from(number);
    let mut text = "G17 G642 CTOL=0.02\n".to_owned();
    for round in 0..200 {
        let feed = 3000 + 500 * (round % 5);
        text += &format!("G2 X0 Y0 I{radius} J0 F{feed}\nG1 X{radius} Y4\nX0 Y0\n");
    }
    text + "M30\n"
}

fn tuning(criterion: &mut Criterion) {
    let Ok(loaded) = load("spinner_mvc850", &[]) else { return };
    let machine = Arc::new(loaded.machine.clone());
    let courses: Vec<Course> = (0..3)
        .filter_map(|number| {
            let setup = Setup::from(ProgramSource::from_bytes("t.mpf", program(number).as_bytes()));
            course_of_program("t.mpf", setup, &machine, false, &mut |_| {}).ok().map(|course| course.beginning(10.0))
        })
        .collect();
    let mut group = criterion.benchmark_group("tune two axes on three programs of 10 s");
    group.sample_size(10);
    for (name, objective) in [("deviation", Objective::Deviation), ("contour", Objective::Contour)] {
        let options = TuneOptions { objective, ..TuneOptions::default() };
        group.bench_function(name, |bencher| {
            bencher.iter(|| black_box(tune(&machine, courses.clone(), &options, &mut |_| {}).is_ok()));
        });
    }
    group.finish();
}

criterion_group!(benches, tuning);
criterion_main!(benches);
