//! Moves in, contour out: published corner, tolerance from outside, continuity, counting, streaming.

use super::support::*;
use sollwert::geometry::Curve;
use sollwert::interpreter::{ArcGeometry, Compressor, CornerInsert, CornerShape, Event, Feed, Modes, Move, MoveKind};
use sollwert::machine::PathMode;
use sollwert::smoothing::{ContourPiece, PieceKind, Smoother};
use std::f64::consts::{FRAC_PI_2, PI};

#[test]
fn spinner_corner_of_90_degrees() {
    // CONTRACT: 90 deg with 0.06 mm executed has T = 0.2263. X turns back, so that beta = 0.6 of 0.1 mm.
    let diagonal = 50.0 * f64::sqrt(0.5);
    let pieces = contour(&polyline(&[vec![diagonal, diagonal], vec![0.0, 2.0 * diagonal]]));
    assert_eq!(kinds(&pieces), "lbl|");
    let corner = corners(&pieces)[0];
    close(corner.angle_rad, FRAC_PI_2, 1e-15, "angle");
    close(corner.tolerance_mm, 0.06, 1e-15, "epsilon");
    close(corner.transition_length_mm, 0.2263, 5e-5, "T");
    // Without a reversal: beta = 0.8.
    let corner = corners(&contour(&polyline(&[vec![50.0, 0.0], vec![50.0, 50.0]])))[0];
    close(corner.tolerance_mm, 0.08, 1e-15, "epsilon");
    close(corner.transition_length_mm, 8.0 * 0.08 / (1.5 * f64::sqrt(2.0)), 1e-15, "T");
    assert_eq!(pieces.iter().map(|p| p.block.number).collect::<Vec<_>>(), [1, 1, 2]);
    assert_eq!(pieces.iter().map(|p| p.blocks_begun).collect::<Vec<_>>(), [1, 0, 1]);
}

#[test]
fn tolerance_is_kept_at_every_corner_of_random_polylines() {
    for dimensions in [2, 3] {
        for seed in 0..60 {
            let what = format!("{dimensions}D, seed {seed}");
            let mut random = Random(seed);
            let mut points = random.polyline(dimensions, 60);
            let rho = 10f64.powf(3.0 * random.unit() - 3.0);
            let mut moves = polyline(&points);
            for m in &mut moves {
                m.modes.contour_tolerance_mm = Some(rho);
            }
            let pieces = contour(&moves);
            check_contour(&moves, &pieces, &what);
            points.insert(0, vec![0.0; dimensions]);
            for piece in &pieces {
                let PieceKind::Blend(curve, corner) = &piece.kind else { continue };
                let i = piece.block.number as usize;
                let [a, p, b] = [i - 1, i, i + 1].map(|i| vector(&points[i]));
                let nearest = samples(curve).map(|q| (q - p).norm()).fold(f64::INFINITY, f64::min);
                assert!(nearest <= rho, "{what}: corner {i} missed by {nearest} > {rho}");
                let farthest = samples(curve)
                    .map(|q| distance_to_segment(q, a, p).min(distance_to_segment(q, p, b)))
                    .fold(0.0, f64::max);
                assert!(farthest <= rho, "{what}: contour left by {farthest} > {rho} at {i}");
                assert!(corner.tolerance_mm <= 0.8 * rho * (1.0 + 1e-12) + 1e-9, "{what}: {corner:?}");
                let half = 0.5 * (p - a).norm().min((b - p).norm());
                assert!(corner.transition_length_mm <= half + 1e-9, "{what}: {corner:?}, half {half}");
                assert!(corner.angle_rad >= 1e-3, "{what}: {corner:?}");
            }
            // Every corner that turns at all, and not back, has its blend.
            let turning = (1..moves.len()).filter(|i| {
                let [a, p, b] = [i - 1, *i, i + 1].map(|i| vector(&points[i]));
                let (u, v) = ((p - a) * (1.0 / (p - a).norm()), (b - p) * (1.0 / (b - p).norm()));
                let angle = 2.0 * (v - u).norm().atan2((v + u).norm());
                (2e-3..3.1).contains(&angle)
            });
            assert!(corners(&pieces).len() >= turning.count(), "{what}: corners left out");
        }
    }
}

#[test]
fn transition_length_is_clamped_to_half_of_the_programmed_blocks() {
    // A staircase of 0.1 mm steps with a tolerance of 0.1 mm: both blends of a step want more than its half.
    let steps: Vec<Vec<f64>> = (1..=20).map(|i| vec![0.1 * f64::from((i + 1) / 2), 0.1 * f64::from(i / 2)]).collect();
    let moves = polyline(&steps);
    let pieces = contour(&moves);
    check_contour(&moves, &pieces, "staircase");
    for corner in corners(&pieces) {
        close(corner.transition_length_mm, 0.05, 1e-9, "T");
        close(corner.tolerance_mm, 0.05 * 1.5 * f64::sin(PI / 4.0) / 4.0, 1e-9, "epsilon");
    }
    // Only the halves at the path's ends are left of the blocks; the consumed ones begin with the blend that follows.
    assert_eq!(kinds(&pieces), format!("l{}l|", "b".repeat(19)));
    assert_eq!(pieces[0].blocks_begun, 1);
    assert_eq!(pieces[1].blocks_begun, 0);
    assert!(pieces[2..].iter().all(|piece| piece.blocks_begun == 1));
}

#[test]
fn events_of_a_consumed_block_go_to_the_blend_that_follows() {
    let mut moves = polyline(&[vec![10.0, 0.0], vec![10.0, 0.1], vec![20.0, 0.1]]);
    moves[1].events = vec![Event::MFunction(8)];
    let pieces = contour(&moves);
    assert_eq!(kinds(&pieces), "lbbl|");
    assert!(pieces[1].events.is_empty());
    assert_eq!(pieces[2].events, [Event::MFunction(8)]);
    assert_eq!((pieces[1].blocks_begun, pieces[2].blocks_begun), (0, 1));
    assert_eq!((pieces[1].block.number, pieces[2].block.number), (1, 2));
}

#[test]
fn path_mode_of_the_block_that_ends_decides() {
    let corner_with = |first: PathMode, second: PathMode| {
        let mut moves = polyline(&[vec![10.0, 0.0], vec![10.0, 10.0]]);
        moves[0].modes.path_mode = first;
        moves[1].modes.path_mode = second;
        kinds(&contour(&moves))
    };
    assert_eq!(corner_with(PathMode::ExactStop, PathMode::G642), "l|l|");
    assert_eq!(corner_with(PathMode::G64, PathMode::G642), "ll|");
    assert_eq!(corner_with(PathMode::G642, PathMode::ExactStop), "lbl|");
    // ADIS neither programmed nor in the machine file: as G64.
    assert_eq!(corner_with(PathMode::G641, PathMode::G642), "ll|");
}

#[test]
fn rounding_distance_is_where_the_blend_begins() {
    let with = |feeds: [Feed; 2], distances: [Option<f64>; 2]| {
        let mut moves = polyline(&[vec![10.0, 0.0], vec![10.0, 10.0]]);
        for (m, (feed, distance)) in moves.iter_mut().zip(feeds.into_iter().zip(distances)) {
            m.modes = Modes { rounding_distance_mm: distance, ..modes(PathMode::G641) };
            m.kind = if feed == Feed::Rapid { MoveKind::Rapid } else { MoveKind::Line };
            m.feed = feed;
        }
        let corners = corners(&contour(&moves));
        corners.first().map_or(0.0, |corner| corner.transition_length_mm)
    };
    let path = || Feed::Path { feed_lu_s: 10.0 };
    close(with([path(), path()], [Some(0.5), None]), 0.5, 0.0, "ADIS");
    close(with([path(), path()], [Some(50.0), None]), 5.0, 0.0, "half of a block");
    close(with([path(), path()], [Some(0.0), Some(0.5)]), 0.0, 0.0, "ADIS=0 is G64");
    close(with([Feed::Rapid, Feed::Rapid], [Some(2.0), Some(3.0)]), 2.0, 0.0, "ADISPOS between rapids");
    close(with([Feed::Rapid, path()], [Some(2.0), Some(0.5)]), 0.5, 0.0, "ADIS behind a rapid");
    close(with([path(), Feed::Rapid], [Some(0.5), Some(2.0)]), 0.5, 0.0, "ADIS before a rapid");
    let mut set = machine();
    set.smoothing.rounding_distance_mm = Some(0.4);
    let mut moves = polyline(&[vec![10.0, 0.0], vec![10.0, 10.0]]);
    moves[0].modes.path_mode = PathMode::G641;
    close(corners(&run(&set, &moves).0)[0].transition_length_mm, 0.4, 0.0, "the machine's distance");
}

#[test]
fn feed_of_a_blend_is_the_lower_one() {
    let feed_with = |first: Feed, second: Feed| {
        let mut moves = polyline(&[vec![10.0, 0.0], vec![10.0, 10.0]]);
        moves[0].feed = first;
        moves[1].feed = second;
        contour(&moves)[1].feed.clone()
    };
    let feed = |feed_lu_s: f64| Feed::Path { feed_lu_s };
    assert_eq!(feed_with(feed(10.0), feed(20.0)), feed(10.0));
    assert_eq!(feed_with(feed(20.0), feed(10.0)), feed(10.0));
    assert_eq!(feed_with(Feed::Rapid, feed(10.0)), feed(10.0));
    assert_eq!(feed_with(Feed::Rapid, Feed::Rapid), Feed::Rapid);
}

#[test]
fn straight_on_has_no_blend_and_back_stops() {
    let turned = |angle: f64| {
        let moves = polyline(&[vec![10.0, 0.0], vec![10.0 + 10.0 * angle.cos(), 10.0 * angle.sin()]]);
        let pieces = contour(&moves);
        check_contour(&moves, &pieces, &format!("angle {angle}"));
        kinds(&pieces)
    };
    assert_eq!(turned(0.0), "ll|");
    assert_eq!(turned(0.9e-3), "ll|");
    assert_eq!(turned(1.1e-3), "lbl|");
    assert_eq!(turned(f64::to_radians(178.5)), "lbl|");
    assert_eq!(turned(f64::to_radians(179.5)), "l|l|");
    assert_eq!(turned(PI), "l|l|");
}

#[test]
fn waits_stop_the_path_and_carry_their_events() {
    let mut moves = polyline(&[vec![10.0, 0.0], vec![10.0, 0.0], vec![10.0, 10.0], vec![10.0, 10.0], vec![0.0, 10.0]]);
    moves[1].kind = MoveKind::Function { stops: true };
    moves[1].events = vec![Event::MFunction(0)];
    moves[3].kind = MoveKind::Dwell { time_s: 0.5 };
    let pieces = contour(&moves);
    assert_eq!(kinds(&pieces), "l|wl|wl|");
    assert_eq!(pieces[1].events, [Event::MFunction(0)]);
    assert_eq!(pieces[1].kind, PieceKind::Wait { time_s: 0.0, at: point(&[10.0, 0.0]) });
    assert_eq!(pieces[3].kind, PieceKind::Wait { time_s: 0.5, at: point(&[10.0, 10.0]) });
    check_contour(&moves, &pieces, "waits");
}

#[test]
fn functions_that_do_not_stop_go_to_the_next_block() {
    let mut moves = polyline(&[vec![10.0, 0.0], vec![10.0, 0.0], vec![10.0, 10.0], vec![10.0, 10.0]]);
    for (i, m) in [(1, 8), (3, 9)] {
        moves[i].kind = MoveKind::Function { stops: false };
        moves[i].events = vec![Event::MFunction(m)];
    }
    moves[2].events = vec![Event::SpindleSpeed { speed_rpm: 1000.0 }];
    let pieces = contour(&moves);
    assert_eq!(kinds(&pieces), "lbl|w");
    assert_eq!(pieces[2].events, [Event::MFunction(8), Event::SpindleSpeed { speed_rpm: 1000.0 }]);
    assert_eq!(pieces[3].events, [Event::MFunction(9)]);
    assert_eq!(pieces[3].block.number, 4);
    check_contour(&moves, &pieces, "functions");
}

#[test]
fn moves_without_displacement_make_no_junction() {
    let mut moves = polyline(&[vec![10.0, 0.0], vec![10.0, 0.0], vec![10.0, 10.0], vec![10.0, 10.0 + 1e-13]]);
    moves[1].events = vec![Event::MFunction(8)];
    let pieces = contour(&moves);
    assert_eq!(kinds(&pieces), "lbl|w");
    assert_eq!(pieces[2].events, [Event::MFunction(8)]);
    assert_eq!(pieces.iter().map(|p| p.blocks_begun).collect::<Vec<_>>(), [1, 0, 2, 1]);
    // G9 in such a block still stops.
    moves[1].modes.path_mode = PathMode::ExactStop;
    assert_eq!(kinds(&contour(&moves)), "l|l|w");
    // Tiny steps are not lost: a thousand of them are a motion.
    let steps: Vec<Vec<f64>> = (1..=3000).map(|i| vec![f64::from(i) * 0.7e-9]).collect();
    let pieces = contour(&polyline(&steps));
    let curves: Vec<&Curve> = pieces.iter().filter_map(ContourPiece::curve).collect();
    let end = curves.last().expect("motion").end();
    close(end.0[X], 3000.0 * 0.7e-9, 1e-9, "the end");
}

#[test]
fn corners_of_arcs_and_rotary_axes_are_rounded() {
    let mut moves = polyline(&[
        vec![10.0],
        vec![20.0],
        vec![30.0, 0.0, 0.0, 0.2],
        vec![30.0, 10.0, 0.0, 0.2],
        vec![30.0, 20.0, 0.0, 0.4],
    ]);
    moves[1].kind =
        MoveKind::Arc(ArcGeometry { plane: [X, Y], centre_mm: [15.0, 0.0], radius_mm: 5.0, sweep_rad: -PI });
    let (pieces, mut smoother) = run(&machine(), &moves);
    // The last corner is one of the rotary axis alone.
    assert_eq!(kinds(&pieces), "lblblblbl|");
    check_contour(&moves, &pieces, "arcs");
    assert_eq!(smoother.take_warnings(), []);
    // Tangent on both sides: nothing to do.
    let mut moves = polyline(&[vec![10.0, 0.0], vec![15.0, 5.0], vec![15.0, 15.0]]);
    moves[1].kind =
        MoveKind::Arc(ArcGeometry { plane: [X, Y], centre_mm: [10.0, 5.0], radius_mm: 5.0, sweep_rad: FRAC_PI_2 });
    let (pieces, mut smoother) = run(&machine(), &moves);
    assert_eq!(kinds(&pieces), "lll|");
    assert_eq!(smoother.take_warnings(), []);
}

#[test]
fn path_rests_where_its_unit_changes() {
    let moves = polyline(&[vec![10.0], vec![10.0, 0.0, 0.0, 1.0], vec![10.0, 0.0, 0.0, 2.0], vec![0.0, 0.0, 0.0, 2.0]]);
    let pieces = contour(&moves);
    assert_eq!(kinds(&pieces), "l|ll|l|");
    assert!(pieces[1].curve().is_some_and(Curve::rotary_only));
}

#[test]
fn one_block_is_held_back_and_a_snapshot_goes_on_alike() {
    let mut random = Random(7);
    let moves = polyline(&random.polyline(3, 200));
    let whole = contour(&moves);
    let mut smoother = Smoother::new(&machine());
    let mut streamed = Vec::new();
    for (i, next) in moves.iter().enumerate() {
        smoother.push(next.clone(), &mut |piece| streamed.push(piece));
        let begun: u32 = streamed.iter().map(|piece: &ContourPiece| piece.blocks_begun).sum();
        assert_eq!(begun as usize, i, "{} blocks in", i + 1);
        if i == 100 {
            smoother = smoother.clone();
        }
    }
    smoother.finish(&mut |piece| streamed.push(piece));
    assert_eq!(streamed, whole);
    smoother.finish(&mut |piece| panic!("finished twice: {piece:?}"));
}

#[test]
fn contour_begins_at_the_home_position() {
    let mut set = machine();
    set.axes[0].home_lu = -12.5;
    let (pieces, _) = run(&set, &polyline(&[vec![10.0, 5.0]]));
    assert_eq!(pieces[0].curve().map(Curve::start), Some(point(&[-12.5])));
    assert!(run(&set, &[]).0.is_empty());
}

#[test]
fn degenerate_moves_never_panic() {
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308, -1e308, 1e-308, 0.0, 5.0, -0.0];
    let mut random = Random(3);
    for _ in 0..2000 {
        let mut pick = || bad[(random.unit() * bad.len() as f64) as usize];
        let moves: Vec<Move> = (0..6)
            .map(|i| {
                let mut m = line(i, &[pick(), pick(), pick(), pick()]);
                m.modes.contour_tolerance_mm = Some(pick());
                m.modes.rounding_distance_mm = Some(pick());
                use PathMode::{G641, G642, G643, G644, G645};
                m.modes.path_mode = [G641, G642, G643, G644, G645][(pick().abs() as usize) % 5];
                if pick() > 1.0 {
                    let shape = CornerShape::Fillet { radius_mm: pick().abs() };
                    m.corner = Some(Box::new(CornerInsert { shape, plane: [X, Y], directions: None, feed_mm_s: None }));
                }
                m.modes.compressor = if pick() > 1.0 { Compressor::Cad } else { Compressor::Off };
                if pick() > 1.0 {
                    let centre_mm = [pick(), pick()];
                    m.kind =
                        MoveKind::Arc(ArcGeometry { plane: [X, Y], centre_mm, radius_mm: pick(), sweep_rad: pick() });
                }
                m
            })
            .collect();
        let kinematics = sollwert::kinematics::Kinematics::new(&machine());
        let mut planner = sollwert::feed::Planner::new(&machine());
        let mut refused = false;
        for piece in contour(&moves) {
            if let Some(curve) = piece.curve() {
                // A length that is no number is not left out: feed refuses it, and whoever plans stops there.
                let length_lu = curve.length_lu();
                assert!(length_lu != 0.0, "{moves:?}");
                let _ = curve.at(0.5 * length_lu);
                refused |= planner.push(kinematics.to_joint(piece)).is_err();
                assert!(refused || length_lu.is_finite() && length_lu > 0.0, "{moves:?}");
            }
            if refused {
                break;
            }
        }
        planner.finish();
        while let Some(planned) = planner.pop() {
            assert!(!planned.law.duration_s().is_nan(), "{moves:?}");
        }
    }
}
