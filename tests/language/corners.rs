//! Words of corners and tolerances: what the moves carry, and what is refused.

use crate::nc_machine::{run, run_bytes, xyzbc};
use sollwert::base::AxisId;
use sollwert::interpreter::{Compressor, CornerShape, Modes, Move};
use sollwert::machine::{AccelerationMode, DynamicsMode, PathMode};

fn shapes(moves: &[Move]) -> Vec<Option<CornerShape>> {
    moves.iter().map(|shown| shown.corner.as_ref().map(|corner| corner.shape)).collect()
}

fn modes(text: &str) -> Modes {
    let result = run(text);
    assert!(result.alarm.is_none(), "{}", result.alarm().render(false));
    assert!(result.warnings.is_empty(), "{:?}", result.warnings);
    result.moves.last().expect("a move").modes.clone()
}

#[test]
fn a_corner_is_programmed_in_the_block_that_leads_to_it() {
    let text = "G1 F600 X10 RND=2\nY10\nRNDM=3\nX20\nY20 RND=0\nX30 CHF=1\nY30 CHR=2\nRNDM=0\nX0";
    let result = run(text);
    assert!(result.alarm.is_none(), "{}", result.alarm().render(false));
    let fillet = |radius_mm| Some(CornerShape::Fillet { radius_mm });
    let wanted = [
        fillet(2.0),
        None,
        fillet(3.0),
        None,
        Some(CornerShape::ChamferBase { length_mm: 1.0 }),
        Some(CornerShape::ChamferLeg { length_mm: 2.0 }),
        None,
    ];
    assert_eq!(shapes(&result.moves), wanted);
    assert!(result.listing.contains("1 line X10 Y0 Z0 F600 RND=2"), "{}", result.listing);
}

#[test]
fn the_feed_of_a_corner_is_that_of_its_block_else_the_modal_one() {
    let text = "FRCM=300\nG1 F600 X10 RND=2\nY10 RND=2 FRC=120\nX20 RND=2 FRC=0\nFRCM=0\nY20 RND=2\nG18 X0 RND=1";
    let corners: Vec<_> = run(text).moves.into_iter().map(|shown| *shown.corner.expect("a corner")).collect();
    let feeds: Vec<_> = corners.iter().map(|corner| corner.feed_mm_s).collect();
    assert_eq!(feeds, [Some(5.0), Some(2.0), None, None, None]);
    let [x, y, z] = [0, 1, 2].map(AxisId::new);
    assert_eq!((corners[0].plane, corners[4].plane), ([x, y], [z, x]));
}

#[test]
fn the_feed_of_a_corner_counts_in_the_unit_of_f() {
    let feed = |text: &str| run(text).moves.last().and_then(|shown| shown.corner.clone()).expect("a corner").feed_mm_s;
    assert_eq!(feed("G95 S600 M3\nG1 F0.1 X10 RND=1 FRC=0.05"), Some(0.5));
    assert_eq!(feed("G93\nG1 F2 X10 RND=1 FRC=0.05"), None);
    let inch = feed("G700 G1 F10 X1 RND=0.1 FRC=6").expect("6 inch/min");
    assert!((inch - 2.54).abs() < 1e-12, "{inch}");
}

#[test]
fn tolerances_stay_until_a_negative_value_deletes_them() {
    let text = "G1 F1 OTOL=0.5 ATOL[Z]=0.03 ATOL[B]=0.2 STOLF=4 X1\nOTOL=-1 ATOL[Z]=-1 X2\nSTOLF=-1 ATOL[B]=-1 X3";
    let result = run_bytes(text.as_bytes(), &xyzbc());
    assert!(result.alarm.is_none(), "{}", result.alarm().render(false));
    let said: Vec<_> = result.moves.iter().map(|shown| shown.modes.programmed.clone()).collect();
    let first = said[0].as_ref().expect("tolerances");
    assert_eq!(first.orientation_tolerance_rad, Some(0.5_f64.to_radians()));
    assert_eq!(first.axis_tolerance_lu[AxisId::new(2)], Some(0.03));
    assert_eq!(first.axis_tolerance_lu[AxisId::new(3)], Some(0.2_f64.to_radians()));
    assert_eq!(first.rapid_tolerance_ratio, Some(4.0));
    let second = said[1].as_ref().expect("tolerances");
    assert_eq!((second.orientation_tolerance_rad, second.axis_tolerance_lu[AxisId::new(2)]), (None, None));
    assert!(said[2].is_none());
    assert!(result.listing.contains("OTOL0.5 ATOL[Z]0.03 ATOL[B]0.2 STOLF4"), "{}", result.listing);
}

#[test]
fn cycle832_sets_the_modes_of_its_machining_type() {
    for (call, dynamics, compressor, tolerance_mm, orientation_deg) in [
        ("CYCLE832(0.02,1,1)", DynamicsMode::Finish, Compressor::Cad, Some(0.02), None),
        ("CYCLE832(0.05,_SEMIFIN,1)", DynamicsMode::SemiFinish, Compressor::Cad, Some(0.05), None),
        ("CYCLE832(0.1,3)", DynamicsMode::Rough, Compressor::Cad, Some(0.1), None),
        ("CYCLE832(0.01,_ORI_FINISH,0.8)", DynamicsMode::Finish, Compressor::Cad, Some(0.01), Some(0.8)),
        ("CYCLE832(0.01,11,0.5)", DynamicsMode::Finish, Compressor::Cad, Some(0.01), Some(0.5)),
        ("CYCLE832(0.1,_TOP_SURFACE_SMOOTH_ON+_ROUGH,1)", DynamicsMode::Rough, Compressor::Surface, Some(0.1), None),
    ] {
        let modes = modes(&format!("BRISK\n{call}\nG1 F1 X1"));
        assert_eq!((modes.dynamics, modes.compressor), (dynamics, compressor), "{call}");
        assert_eq!((modes.acceleration_mode, modes.path_mode), (AccelerationMode::Soft, PathMode::G645), "{call}");
        assert_eq!(modes.contour_tolerance_mm, tolerance_mm, "{call}");
        let said = modes.programmed.and_then(|limits| limits.orientation_tolerance_rad);
        assert_eq!(said, orientation_deg.map(f64::to_radians), "{call}");
    }
    for off in ["CYCLE832()", "CYCLE832(0,0,1)", "CYCLE832(0,_OFF,1)", "CYCLE832"] {
        let modes = modes(&format!("CYCLE832(0.02,12,0.5)\n{off}\nG1 F1 X1"));
        assert_eq!((modes.dynamics, modes.contour_tolerance_mm), (DynamicsMode::Norm, None), "{off}");
        assert!(modes.programmed.is_none(), "{off}");
    }
}

#[test]
fn what_makes_no_corner_is_refused() {
    for (text, code) in [
        ("G1 F1 X1 RND=1 CHF=1", "E0207"),
        ("G1 F1 X1\nRND=1", "E0207"),
        ("G1 F1 X1 RND=-1", "E0306"),
        ("G1 F1 X1 FRC=-3", "E0502"),
        ("G1 F1 ATOL[Q]=1 X1", "E0204"),
        ("G1 F1 ATOL[3]=1 X1", "E0204"),
        ("CYCLE832(0.1,7,1)", "E0306"),
        ("CYCLE832(0.1,_FINE,1)", "E0301"),
    ] {
        assert_eq!(run(text).alarm().code, code, "{text}");
    }
}

#[test]
fn frames_turn_and_scale_what_stands_in_a_corner() {
    let corner = |frame: &str| {
        let result = run(&format!("{frame}\nG1 F600 X10 Y0 RND=2\nY10"));
        assert!(result.alarm.is_none(), "{}", result.alarm().render(false));
        *result.moves[0].corner.clone().expect("a corner")
    };
    let [x, y, z] = [0, 1, 2].map(AxisId::new);
    let plain = corner("");
    assert_eq!((plain.plane, plain.directions), ([x, y], None));
    // In the plane nothing changes, and a quarter turn leads to another plane of the axes.
    assert_eq!((corner("ROT Z30").plane, corner("ROT Z30").directions), ([x, y], None));
    assert_eq!((corner("ROT X90").plane, corner("ROT X90").directions), ([z, x], None));
    let tilted = corner("ROT X30").directions.expect("a tilted plane");
    let (sin, cos) = 30.0_f64.to_radians().sin_cos();
    for (axis, [first, second]) in [(x, [1.0, 0.0]), (y, [0.0, cos]), (z, [0.0, sin])] {
        assert!((tilted[0][axis] - first).abs() < 1e-12 && (tilted[1][axis] - second).abs() < 1e-12, "{tilted:?}");
    }
    assert_eq!(corner("SCALE X3 Y3").shape, CornerShape::Fillet { radius_mm: 6.0 });
}
