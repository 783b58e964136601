//! Figures of the programmed feed by hand: FGROUP, OVR and OVRRAP in `cam_time_s` and `programmed_feed_share`; and a fillet that
//! `geometry::ArcCorner` has worked out, driven as RND.

use crate::support::test_machine_shipped;
use sollwert::base::AxisId;
use sollwert::geometry::{ArcCorner, PlaneArc, Sense};
use sollwert::kernel::{Kernel, Status};
use sollwert::program::ProgramSource;
use std::sync::Arc;

fn run(text: &str, each: &mut dyn FnMut([f64; 2])) -> Kernel {
    let machine = Arc::new(test_machine_shipped("spinner_mvc850"));
    let mut kernel = Kernel::new(machine, ProgramSource::from_bytes("part.mpf", text.as_bytes()), false);
    while kernel.cycle().unwrap() == Status::Running {
        if let Some(setpoint) = &kernel.output().setpoint {
            each([0, 1].map(|axis| setpoint.axes[AxisId::new(axis)].position_lu));
        }
    }
    assert!(kernel.take_findings().alarm.is_none(), "{text}");
    kernel
}

fn cam_time_s(text: &str) -> f64 {
    run(text, &mut |_| {}).figures().cam_time_s
}

/// F600 = 10 mm/s; rapids 333.3 mm/s.
#[test]
fn cam_time_counts_group_and_override() {
    let cases = [
        ("G60 G1 X10 F600\nM30\n", 1.0),
        ("G60 OVR=50\nG1 X10 F600\nM30\n", 2.0),
        ("G60 OVR=125\nG1 X10 F600\nM30\n", 0.8),
        // F holds for X: the path is 14.14 mm.
        ("G60 FGROUP(X)\nG1 X10 Y10 F600\nM30\n", 1.0),
        ("G60 FGROUP(X)\nOVR=50\nG1 X10 Y10 F600\nM30\n", 2.0),
        // No axis of the group moves: F holds along the path.
        ("G60 FGROUP(X)\nG1 Y10 F600\nM30\n", 1.0),
        ("G60 G0 X100\nM30\n", 0.3),
        ("G60 OVRRAP=50\nG0 X100\nM30\n", 0.6),
        ("G60 G1 X10 F600\nG4 F0.5\nM30\n", 1.5),
    ];
    for (text, expected_s) in cases {
        let time_s = cam_time_s(text);
        assert!((time_s - expected_s).abs() < 1e-9, "{text}: {time_s} for {expected_s}");
    }
    // A quarter of a circle of 10 mm: X moves by 10 mm, the path by 15.7 mm.
    let time_s = cam_time_s("G60 FGROUP(X)\nG17 G3 X-10 Y10 I-10 J0 F600\nM30\n");
    assert!((time_s - 1.0).abs() < 1e-3, "{time_s}");
}

/// At the feed of the group the programmed feed is reached.
#[test]
fn the_programmed_feed_of_a_group_is_reached() {
    let kernel = run("G60 FGROUP(X)\nG1 X100 Y100 F600\nM30\n", &mut |_| {});
    let figures = kernel.figures();
    assert!(figures.at_programmed_feed as f64 > 0.98 * figures.setpoints as f64, "{figures:?}");
    let halved = run("G60 OVR=50\nG1 X100 F600\nM30\n", &mut |_| {});
    assert_eq!(halved.figures().at_programmed_feed, 0);
}

/// The second published corner, moved to the home of the machine: RND with the radius found passes at the deviation asked for.
#[test]
fn a_fillet_driven_as_rnd_passes_at_its_deviation() {
    let [c, d, e] = [[0.0, 0.0], [57.85, 0.0], [133.81, -13.4]];
    let left = |from, to, radius| PlaneArc::new(from, to, radius, Sense::CounterClockwise).unwrap();
    let corner = ArcCorner::new(left(c, d, 45.0), left(d, e, 60.0)).unwrap();
    for deviation_mm in [0.213, 1.29] {
        let fillet = corner.fillet_with_deviation(deviation_mm).unwrap();
        let text =
            format!("G64 G17 G3 X57.85 Y0 CR=45 F500 RND={:.9}\nG3 X133.81 Y-13.4 CR=60\nM30\n", fillet.radius_mm);
        let (mut nearest_mm, mut touched) = (f64::INFINITY, [f64::INFINITY; 2]);
        run(&text, &mut |at| {
            let distance = |to: [f64; 2]| (at[0] - to[0]).hypot(at[1] - to[1]);
            nearest_mm = nearest_mm.min(distance(d));
            for (nearest, contact) in touched.iter_mut().zip(fillet.contacts_mm) {
                *nearest = nearest.min(distance(contact));
            }
        });
        // Set-points are 0.01 mm apart.
        assert!((nearest_mm - deviation_mm).abs() < 2e-4, "{nearest_mm} for {deviation_mm}");
        assert!(touched.iter().all(|nearest| *nearest < 0.01), "{touched:?}");
    }
}
