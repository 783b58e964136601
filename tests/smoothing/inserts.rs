//! RND, RNDM, CHF, CHR: against closed forms and the table of models/arcs.md.

use super::support::*;
use sollwert::base::AxisId;
use sollwert::geometry::Curve;
use sollwert::interpreter::{ArcGeometry, CornerInsert, CornerShape, Feed, Move, MoveKind};
use sollwert::machine::PathMode;
use sollwert::smoothing::{ContourPiece, PieceKind};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI};

const Z: AxisId = AxisId::new(2);

fn with_corner(mut moved: Move, shape: CornerShape) -> Move {
    moved.corner = Some(Box::new(CornerInsert { shape, plane: [X, Y], directions: None, feed_mm_s: None }));
    moved
}

/// G64: nothing but the inserts changes the contour.
fn g64(points: &[Vec<f64>]) -> Vec<Move> {
    let mut moves = polyline(points);
    for moved in &mut moves {
        moved.modes.path_mode = PathMode::G64;
    }
    moves
}

fn curves(pieces: &[ContourPiece]) -> Vec<&Curve> {
    pieces.iter().filter_map(ContourPiece::curve).collect()
}

fn assert_tangential(pieces: &[ContourPiece]) {
    for pair in curves(pieces).windows(2) {
        assert_eq!(pair[0].end(), pair[1].start());
        let kink = (pair[0].at(f64::INFINITY).first - pair[1].at(0.0).first).norm();
        assert!(kink < 1e-9, "a kink of {kink}");
    }
}

fn fillet(radius_mm: f64) -> CornerShape {
    CornerShape::Fillet { radius_mm }
}

#[test]
fn a_fillet_between_lines_is_the_arc_that_touches_both() {
    for turn in [0.3, FRAC_PI_3, FRAC_PI_2, 2.5, -0.3, -FRAC_PI_2, -2.5] {
        let end = vec![50.0 + 50.0 * f64::cos(turn), 50.0 * f64::sin(turn)];
        let mut moves = g64(&[vec![50.0, 0.0], end]);
        moves[1].feed = Feed::Path { feed_lu_s: 20.0 };
        moves[0] = with_corner(moves[0].clone(), fillet(2.0));
        let pieces = contour(&moves);
        let [Curve::Line(before), Curve::Arc(arc), Curve::Line(after)] = curves(&pieces)[..] else {
            panic!("{pieces:?}")
        };
        let taken = 2.0 * f64::tan(turn.abs() / 2.0);
        close(before.length_lu(), 50.0 - taken, 1e-12, "first block");
        close(after.length_lu(), 50.0 - taken, 1e-12, "second block");
        close(arc.sweep_rad(), turn, 1e-12, "angle");
        close(arc.radius_mm(), 2.0, 0.0, "radius");
        close(arc.centre_mm()[0], 50.0 - taken, 1e-12, "centre");
        close(arc.centre_mm()[1], 2.0 * turn.signum(), 1e-12, "centre");
        assert_tangential(&pieces);
        assert_eq!(pieces.iter().map(|piece| piece.blocks_begun).collect::<Vec<_>>(), [1, 0, 1]);
        assert_eq!(pieces.iter().map(|piece| piece.block.number).collect::<Vec<_>>(), [1, 1, 2]);
        assert_eq!(pieces[1].feed, Feed::Path { feed_lu_s: 20.0 }, "that of the block that leads away");
    }
}

#[test]
fn frc_is_the_feed_of_the_corner() {
    let mut moves = g64(&[vec![10.0, 0.0], vec![10.0, 10.0]]);
    let insert = CornerInsert { shape: fillet(1.0), plane: [X, Y], directions: None, feed_mm_s: Some(3.0) };
    moves[0].corner = Some(Box::new(insert));
    assert_eq!(contour(&moves)[1].feed, Feed::Path { feed_lu_s: 3.0 });
}

#[test]
fn chamfers_are_as_long_as_programmed() {
    for turn in [0.4, FRAC_PI_2, -2.0] {
        let end = vec![50.0 + 50.0 * f64::cos(turn), 50.0 * f64::sin(turn)];
        for (shape, base, leg) in [
            (CornerShape::ChamferBase { length_mm: 3.0 }, 3.0, 1.5 / f64::cos(turn / 2.0)),
            (CornerShape::ChamferLeg { length_mm: 3.0 }, 6.0 * f64::cos(turn / 2.0), 3.0),
        ] {
            let mut moves = g64(&[vec![50.0, 0.0], end.clone()]);
            moves[0] = with_corner(moves[0].clone(), shape);
            let pieces = contour(&moves);
            let lengths: Vec<f64> = curves(&pieces).iter().map(|curve| curve.length_lu()).collect();
            for (length, wanted) in lengths.iter().zip([50.0 - leg, base, 50.0 - leg]) {
                close(*length, wanted, 1e-12, &format!("{shape:?} at {turn}"));
            }
        }
    }
}

/// The minor arc of radius `r` from `a` to `b`, `sense` 1 = G3.
fn arc(number: u64, a: [f64; 2], b: [f64; 2], r: f64, sense: f64) -> Move {
    let chord = [b[0] - a[0], b[1] - a[1]];
    let length = f64::hypot(chord[0], chord[1]);
    let height = (r * r - 0.25 * length * length).sqrt();
    let centre_mm = [
        0.5 * (a[0] + b[0]) - sense * height * chord[1] / length,
        0.5 * (a[1] + b[1]) + sense * height * chord[0] / length,
    ];
    let sweep_rad = sense * 2.0 * (0.5 * length / r).asin();
    let mut moved = line(number, &b);
    moved.kind = MoveKind::Arc(ArcGeometry { plane: [X, Y], centre_mm, radius_mm: r, sweep_rad });
    moved.modes.path_mode = PathMode::G64;
    moved
}

#[test]
fn the_fillet_of_two_arcs_is_that_of_the_published_table() {
    // [Gassara 2013]: eps = 0.2 mm has R_c = 0.49 mm and a rounding distance of 0.48 mm.
    let (c, d, e) = ([10.0, 20.0], [46.36, 56.36], [109.54, 100.60]);
    let mut moves = g64(&[c.to_vec()]);
    moves.push(with_corner(arc(2, c, d, 40.0, 1.0), fillet(0.49)));
    moves.push(arc(3, d, e, 60.0, 1.0));
    let pieces = contour(&moves);
    let Curve::Arc(found) = curves(&pieces)[2] else { panic!("{pieces:?}") };
    close(found.radius_mm(), 0.49, 0.0, "R_c");
    let centre = found.centre_mm();
    close(f64::hypot(centre[0] - d[0], centre[1] - d[1]) - 0.49, 0.2, 5e-3, "eps");
    close(0.49 * (found.sweep_rad().abs() / 2.0).tan(), 0.48, 5e-3, "rounding distance");
    assert!(found.sweep_rad() < 0.0, "two arcs to the left that meet in a corner to the right");
    assert_tangential(&pieces[1..]);
}

#[test]
fn fillets_touch_lines_and_arcs_of_every_sense() {
    for (first, second) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        for end in [[30.0, 15.0], [25.0, -15.0]] {
            let mut moves = vec![with_corner(arc(1, [0.0, 0.0], [20.0, 0.0], 30.0, first), fillet(0.8))];
            moves.push(with_corner(arc(2, [20.0, 0.0], end, 25.0, second), fillet(0.5)));
            moves.push(line(3, &[60.0, 0.0]));
            let pieces = contour(&moves);
            assert_eq!(pieces.len(), 5, "{first} {second} {end:?}");
            assert_tangential(&pieces);
            let radii: Vec<f64> =
                [1, 3].map(|i| if let Curve::Arc(arc) = curves(&pieces)[i] { arc.radius_mm() } else { 0.0 }).to_vec();
            assert_eq!(radii, [0.8, 0.5]);
        }
    }
}

#[test]
fn other_axes_go_linearly_through_a_fillet() {
    let mut moves = g64(&[vec![10.0, 0.0, 5.0], vec![10.0, 10.0, 0.0]]);
    moves[0] = with_corner(moves[0].clone(), fillet(2.0));
    let pieces = contour(&moves);
    let Curve::Arc(arc) = curves(&pieces)[1] else { panic!("{pieces:?}") };
    // The blocks have risen to 4 and fallen to 4 where the fillet touches them.
    close(arc.start().0[Z], 4.0, 1e-12, "start");
    close(arc.end().0[Z], 4.0, 1e-12, "end");
    close(arc.at(arc.length_lu() / 2.0).position.0[Z], 4.0, 1e-12, "middle");
    assert_eq!(curves(&pieces)[0].end(), arc.start());
}

#[test]
fn a_fillet_in_a_tilted_plane_is_a_circle_of_that_plane() {
    // The XY plane turned by 0.7 rad about Y.
    let (sin, cos) = f64::sin_cos(0.7);
    let directions = [vector(&[cos, 0.0, -sin]), vector(&[0.0, 1.0])];
    let place = |x: f64, y: f64| (directions[0] * x + directions[1] * y).as_slice()[..3].to_vec();
    let mut moves = g64(&[place(10.0, 0.0), place(10.0, 10.0), place(30.0, 10.0)]);
    for moved in &mut moves[..2] {
        let insert = CornerInsert { shape: fillet(2.0), plane: [X, Y], directions: Some(directions), feed_mm_s: None };
        moved.corner = Some(Box::new(insert));
    }
    let pieces = contour(&moves);
    assert_tangential(&pieces);
    for (index, centre) in [(1, place(8.0, 2.0)), (3, place(12.0, 8.0))] {
        let Curve::SpatialArc(arc) = curves(&pieces)[index] else { panic!("{pieces:?}") };
        close(arc.length_lu(), PI, 1e-9, "a quarter of a circle of 2 mm");
        for q in samples(curves(&pieces)[index]) {
            close((q - vector(&centre)).norm(), 2.0, 1e-9, "distance from the centre");
        }
    }
}

#[test]
fn short_blocks_get_smaller_fillets_and_it_is_said_once() {
    // Blocks of 4 mm at right angles with RNDM=3: every inner block is shared by two corners.
    let steps: Vec<Vec<f64>> = (1..=6).map(|i| vec![4.0 * f64::from((i + 1) / 2), 4.0 * f64::from(i / 2)]).collect();
    let moves: Vec<Move> = g64(&steps).into_iter().map(|moved| with_corner(moved, fillet(3.0))).collect();
    let (pieces, mut smoother) = run(&machine(), &moves);
    let radii: Vec<f64> = curves(&pieces)
        .iter()
        .filter_map(|curve| if let Curve::Arc(arc) = curve { Some(arc.radius_mm()) } else { None })
        .collect();
    assert_eq!(radii.len(), 5);
    for radius in &radii {
        assert!(*radius > 1.9 && *radius <= 3.0, "{radii:?}");
    }
    let begun: u32 = pieces.iter().map(|piece| piece.blocks_begun).sum();
    assert_eq!(begun, 6);
    assert_tangential(&pieces);
    let said: Vec<&str> = smoother.take_warnings().iter().map(|warning| warning.code).collect();
    // The last block leads nowhere: it ends in no corner, and nothing is said.
    assert_eq!(said, ["S0005"]);
}

#[test]
fn a_block_that_is_all_fillet_leaves_its_count_to_the_next() {
    let mut moves = g64(&[vec![1.0, 0.0], vec![1.0, 1.0], vec![1.0, 9.0]]);
    moves[0] = with_corner(moves[0].clone(), fillet(5.0));
    let pieces = contour(&moves);
    assert_eq!(pieces.iter().map(|piece| piece.blocks_begun).collect::<Vec<_>>(), [1, 2]);
    let [Curve::Arc(arc), Curve::Line(_)] = curves(&pieces)[..] else { panic!("{pieces:?}") };
    close(arc.radius_mm(), 1.0, 1e-9, "radius");
    close(arc.sweep_rad(), PI / 2.0, 1e-9, "angle");
}

/// RNDM holds on where the path ends, or rests before it goes straight on: there is no corner. The turn behind a rest is one.
#[test]
fn where_the_path_ends_there_is_no_corner() {
    let said = |ways: &[&[f64]], between: &[MoveKind]| {
        let mut moves = Vec::new();
        for (i, way) in ways.iter().enumerate() {
            let mut next = line(i as u64 + 1, way);
            next.modes.path_mode = PathMode::G64;
            let end = next.end;
            moves.push(with_corner(next, fillet(1.0)));
            for kind in between {
                let mut idle = line(i as u64 + 1, way);
                (idle.kind, idle.end) = (kind.clone(), end);
                moves.push(idle);
            }
        }
        let (_, mut smoother) = run(&machine(), &moves);
        let lines = smoother.take_warnings().into_iter().map(|warning| (warning.code, warning.message));
        lines.collect::<Vec<_>>()
    };
    let stop = MoveKind::Function { stops: true };
    let functions: Vec<MoveKind> = (0..5).map(|_| MoveKind::Function { stops: false }).collect();
    let (ahead, turn): ([&[f64]; 2], [&[f64]; 2]) = ([&[10.0, 0.0], &[20.0, 0.0]], [&[10.0, 0.0], &[10.0, 10.0]]);
    assert_eq!(said(&turn, &[]), []);
    assert_eq!(said(&turn[..1], std::slice::from_ref(&stop)), []);
    assert_eq!(said(&turn[..1], &functions), []);
    assert_eq!(said(&ahead, std::slice::from_ref(&stop)), []);
    let turned = said(&turn, &[stop]);
    assert!(turned.len() == 1 && turned[0].0 == "S0004" && turned[0].1.contains("line 1 "), "{turned:?}");
}

#[test]
fn corners_without_place_stay_as_they_are() {
    let corner_after = |between: &[MoveKind]| {
        let mut moves = g64(&[vec![10.0, 0.0]]);
        moves[0] = with_corner(moves[0].clone(), fillet(1.0));
        for kind in between {
            let mut idle = line(2, &[10.0, 0.0]);
            idle.kind = kind.clone();
            moves.push(idle);
        }
        let mut last = line(9, &[10.0, 10.0]);
        last.modes.path_mode = PathMode::G64;
        moves.push(last);
        let (pieces, mut smoother) = run(&machine(), &moves);
        let inserted = pieces.iter().any(|piece| matches!(piece.kind, PieceKind::Block(Curve::Arc(_))));
        (inserted, smoother.take_warnings().len())
    };
    let function = || MoveKind::Function { stops: false };
    assert_eq!(corner_after(&[]), (true, 0));
    assert_eq!(corner_after(&[function(), function(), function()]), (true, 0));
    assert_eq!(corner_after(&[function(), function(), function(), function()]), (false, 1));
    assert_eq!(corner_after(&[MoveKind::Dwell { time_s: 1.0 }]), (false, 1));
    // Across the plane there is no corner of the plane.
    let mut moves = g64(&[vec![10.0, 0.0], vec![10.0, 0.0, 5.0]]);
    moves[0] = with_corner(moves[0].clone(), fillet(1.0));
    let (pieces, mut smoother) = run(&machine(), &moves);
    assert_eq!((pieces.len(), smoother.take_warnings()[0].code), (2, "S0004"));
    // Straight on there is none at all.
    let mut moves = g64(&[vec![10.0, 0.0], vec![20.0, 0.0]]);
    moves[0] = with_corner(moves[0].clone(), fillet(1.0));
    let (pieces, mut smoother) = run(&machine(), &moves);
    assert_eq!((pieces.len(), smoother.take_warnings().len()), (2, 0));
}

/// A line or an arc along `heading`, which starts at `from` or, backwards, ends there. `bend` is the curvature with its sense.
fn straight_or_bent(
    number: u64,
    from: [f64; 2],
    heading: f64,
    bend: f64,
    length: f64,
    backwards: bool,
) -> (Move, [f64; 2]) {
    let way = if backwards { -length } else { length };
    let turned = bend * way;
    let other = if bend == 0.0 {
        [from[0] + way * heading.cos(), from[1] + way * heading.sin()]
    } else {
        let (r, (sin, cos)) = (1.0 / bend, heading.sin_cos());
        let (sin_end, cos_end) = (heading + turned).sin_cos();
        [from[0] + r * (sin_end - sin), from[1] - r * (cos_end - cos)]
    };
    let end = if backwards { from } else { other };
    let mut moved = line(number, &end);
    moved.modes.path_mode = PathMode::G64;
    if bend != 0.0 {
        let centre_mm = [from[0] - heading.sin() / bend, from[1] + heading.cos() / bend];
        let geometry =
            ArcGeometry { plane: [X, Y], centre_mm, radius_mm: (1.0 / bend).abs(), sweep_rad: bend * length };
        moved.kind = MoveKind::Arc(geometry);
    }
    (moved, other)
}

/// Lines and arcs of both senses, up to more than half a circle, in corners of every angle to both sides.
fn corners_of_all_kinds() -> Vec<(String, Vec<Move>, f64)> {
    let mut cases = Vec::new();
    for first in [0.0, 0.05, -0.05, 0.3, -0.3] {
        for second in [0.0, 0.08, -0.08, 0.4, -0.4] {
            for degrees in [3.0, 40.0, 90.0, 135.0, 170.0] {
                for side in [1.0, -1.0] {
                    let turn = side * f64::to_radians(degrees);
                    let length = |bend: f64| if bend.abs() > 0.1 { 4.0 / bend.abs() } else { 15.0 };
                    let corner = [40.0, -10.0];
                    let (into, start) = straight_or_bent(2, corner, 0.7, first, length(first), true);
                    let (out, _) = straight_or_bent(3, corner, 0.7 + turn, second, length(second), false);
                    let mut lead = line(1, &start);
                    lead.modes.path_mode = PathMode::G64;
                    cases.push((format!("{first} {second} {degrees} {side}"), vec![lead, into, out], turn));
                }
            }
        }
    }
    cases
}

/// Distance of a point from a programmed block.
fn off(curve: &Curve, q: sollwert::base::AxisVector) -> f64 {
    let away = |s: f64| (curve.at(s).position.0 - q).norm();
    let step = curve.length_lu() / 2000.0;
    let nearest =
        (0..=2000).map(|i| f64::from(i) * step).min_by(|a, b| away(*a).total_cmp(&away(*b))).expect("samples");
    let (mut low, mut high) = ((nearest - step).max(0.0), (nearest + step).min(curve.length_lu()));
    for _ in 0..60 {
        let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
        if away(a) < away(b) { high = b } else { low = a }
    }
    away(low)
}

#[test]
fn fillets_of_lines_and_arcs_touch_both_blocks_in_corners_of_every_angle() {
    for (what, mut moves, turn) in corners_of_all_kinds() {
        let bare = contour(&moves);
        let [programmed_in, programmed_out] = [1, 2].map(|i| curves(&bare)[i].clone());
        for radius in [0.001, 0.05, 0.4] {
            // Between arcs that bend towards each other a sharp corner has no place for more.
            if radius > [0.4, 0.05, 0.001][usize::from(turn.abs() > 2.0) + usize::from(turn.abs() > 2.5)] {
                continue;
            }
            moves[1] = with_corner(moves[1].clone(), fillet(radius));
            let (pieces, mut smoother) = run(&machine(), &moves);
            let what = format!("{what}, RND={radius}");
            assert!(smoother.take_warnings().is_empty(), "{what}");
            let [_, before, Curve::Arc(arc), after] = curves(&pieces)[..] else { panic!("{what}: {pieces:?}") };
            assert_tangential(&pieces[1..]);
            close(arc.radius_mm(), radius, 0.0, &what);
            // Turns to the side of the corner, and less than half a circle.
            assert!(arc.sweep_rad().signum() == turn.signum() && arc.sweep_rad().abs() < PI, "{what}");
            // All of its points have their distance from its centre; what is left of the blocks is where it was programmed.
            let centre = vector(&arc.centre_mm());
            for q in samples(curves(&pieces)[2]) {
                close((q - centre).norm(), radius, 1e-9, &what);
            }
            for (part, whole) in [(before, &programmed_in), (after, &programmed_out)] {
                assert!(part.length_lu() < whole.length_lu(), "{what}");
                for share in [0.0, 0.4, 1.0] {
                    close(off(whole, part.at(share * part.length_lu()).position.0), 0.0, 1e-9, &what);
                }
            }
            // Nearest to the corner of the circles that touch both: the blocks lose what a corner of lines would, up to their bend.
            let cut = radius * (turn.abs() / 2.0).tan();
            for (part, whole) in [(before, &programmed_in), (after, &programmed_out)] {
                let lost = whole.length_lu() - part.length_lu();
                let usual = if cut < 0.2 { 0.4 * cut..2.5 * cut } else { 0.0..whole.length_lu() };
                assert!(usual.contains(&lost), "{what}: {lost} of {cut}");
            }
        }
    }
}

#[test]
fn chamfers_of_lines_and_arcs_are_as_long_as_programmed_in_corners_of_every_angle() {
    for (what, mut moves, _) in corners_of_all_kinds() {
        let bare = contour(&moves);
        let wholes = [1, 2].map(|i| curves(&bare)[i].length_lu());
        for (shape, leg) in
            [(CornerShape::ChamferLeg { length_mm: 0.3 }, true), (CornerShape::ChamferBase { length_mm: 0.3 }, false)]
        {
            moves[1] = with_corner(moves[1].clone(), shape);
            let (pieces, mut smoother) = run(&machine(), &moves);
            let warned = smoother.take_warnings();
            let found = curves(&pieces);
            assert_eq!(found.len(), 4, "{what}");
            let lost = [wholes[0] - found[1].length_lu(), wholes[1] - found[3].length_lu()];
            close(lost[0], lost[1], 1e-9, &what);
            let Curve::Line(chamfer) = found[2] else { panic!("{what}") };
            if leg {
                assert!(warned.is_empty(), "{what}");
                close(lost[0], 0.3, 1e-9, &what);
            } else if warned.is_empty() {
                close(chamfer.length_lu(), 0.3, 1e-9, &what);
            } else {
                // The chord never gets that long: all of the shorter block is taken.
                assert!(chamfer.length_lu() < 0.3, "{what}");
            }
            for pair in found[1..].windows(2) {
                assert_eq!(pair[0].end(), pair[1].start(), "{what}");
            }
        }
    }
}
