//! CIP, CT, AR, polar coordinates, splines and POLY: from text to moves. Curves are evaluated here on their own.

use crate::nc_machine::{Run, run, run_bytes, xyz, xyzbc};
use sollwert::base::{AxisId, PartPoint};
use sollwert::interpreter::{ArcGeometry, Move, MoveKind, PolynomialPiece};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const X: AxisId = AxisId::new(0);
const Y: AxisId = AxisId::new(1);
const Z: AxisId = AxisId::new(2);

fn ok(text: &str) -> Run {
    let result = run(text);
    assert!(result.alarm.is_none(), "{text}\n{}", result.alarm().render(false));
    result
}

fn refused(text: &str, code: &str) {
    let result = run(text);
    let alarm = result.alarm.unwrap_or_else(|| panic!("no alarm: {text}\n{}", result.listing));
    assert_eq!(alarm.code, code, "{text}\n{}", alarm.render(false));
}

fn near(found: f64, wanted: f64, what: &str) {
    assert!((found - wanted).abs() < 1e-9 * (1.0 + wanted.abs()), "{what}: {found}, expected {wanted}");
}

fn xy(point: &PartPoint) -> [f64; 2] {
    [point.0[X], point.0[Y]]
}

fn arc(shown: &Move) -> ArcGeometry {
    match &shown.kind {
        MoveKind::Arc(arc) => *arc,
        other => panic!("no arc: {other:?}"),
    }
}

fn pieces(shown: &Move) -> &[PolynomialPiece] {
    match &shown.kind {
        MoveKind::Spline(geometry) | MoveKind::Polynomial(geometry) => &geometry.pieces,
        other => panic!("no spline: {other:?} in line {}", shown.block.line),
    }
}

/// Value and first two derivatives of a piece without denominator, of one axis.
fn plain(piece: &PolynomialPiece, axis: AxisId, u: f64) -> [f64; 3] {
    assert_eq!(piece.denominator_ratio, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let c = piece.numerator_lu.map(|row| row[axis]);
    let sum = |factor: &dyn Fn(i32) -> f64, drop: i32| -> f64 {
        (drop..6).map(|i| factor(i) * c[i as usize] * u.powi(i - drop)).sum()
    };
    [sum(&|_| 1.0, 0), sum(&|i| f64::from(i), 1), sum(&|i| f64::from(i * (i - 1)), 2)]
}

fn value(piece: &PolynomialPiece, axis: AxisId, u: f64) -> f64 {
    let sum = |c: [f64; 6]| (0..6).map(|i| c[i] * u.powi(i as i32)).sum::<f64>();
    sum(piece.numerator_lu.map(|row| row[axis])) / sum(piece.denominator_ratio)
}

fn splines(result: &Run) -> Vec<&Move> {
    result.moves.iter().filter(|next| matches!(next.kind, MoveKind::Spline(_))).collect()
}

/// A program with one spline through points, from (0, 0).
fn through(words: &str, points: &[[f64; 2]], behind: &str) -> Run {
    let lines: String = points.iter().map(|[x, y]| format!("X{x} Y{y}\n")).collect();
    ok(&format!("G1 X0 Y0 F1000\n{words}\n{lines}{behind}\nM30"))
}

const POINTS: [[f64; 2]; 5] = [[10.0, 20.0], [30.0, 10.0], [40.0, 40.0], [70.0, 0.0], [75.0, 30.0]];

fn chord([a, b]: [[f64; 2]; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

fn with_start(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    [[0.0, 0.0]].iter().chain(points).copied().collect()
}

/// The natural cubic spline is the one that passes its points with continuous first and second derivatives to the chord, and ends
/// without curvature.
#[test]
fn cspline_is_the_natural_cubic_spline() {
    let result = through("CSPLINE", &POINTS, "");
    let found = splines(&result);
    assert_eq!(found.iter().map(|next| next.block.line).collect::<Vec<_>>(), [3, 4, 5, 6, 7]);
    let points = with_start(&POINTS);
    for (i, next) in found.iter().enumerate() {
        let [piece] = pieces(next) else { panic!("one piece a block") };
        let h = chord([points[i], points[i + 1]]);
        near(piece.parameter_end_ratio, h, "chord");
        for (axis, k) in [(X, 0), (Y, 1)] {
            let [start, end] = [plain(piece, axis, 0.0), plain(piece, axis, h)];
            near(start[0], points[i][k], "start");
            near(end[0], points[i + 1][k], "end");
            let second =
                if i == 0 { 0.0 } else { plain(&pieces(found[i - 1])[0], axis, chord([points[i - 1], points[i]]))[2] };
            near(start[2], second, "second derivative");
            if i > 0 {
                near(start[1], plain(&pieces(found[i - 1])[0], axis, chord([points[i - 1], points[i]]))[1], "first");
            }
            if i == 4 {
                near(end[2], 0.0, "natural end");
            }
        }
        assert_eq!(xy(&next.end), POINTS[i]);
    }
}

#[test]
fn cspline_ends_as_told() {
    // Tangential to a G1 along X before and along -Y behind.
    let text = "G1 X-10 Y0 F1000\nX0\nCSPLINE BTAN ETAN\nX10 Y20\nX30 Y10\nX40 Y40\nG1 Y10\nM30";
    let result = ok(text);
    let found = splines(&result);
    let (first, last) = (&pieces(found[0])[0], &pieces(found[2])[0]);
    near(plain(first, X, 0.0)[1], 1.0, "tangent at the start");
    near(plain(first, Y, 0.0)[1], 0.0, "tangent at the start");
    near(plain(last, X, last.parameter_end_ratio)[1], 0.0, "tangent at the end");
    near(plain(last, Y, last.parameter_end_ratio)[1], -1.0, "tangent at the end");
    // BAUTO, EAUTO: the first two blocks are one cubic, and so are the last two.
    let result = through("CSPLINE BAUTO EAUTO", &POINTS, "");
    let found = splines(&result);
    for (i, j) in [(0, 1), (3, 4)] {
        let [a, b] = [i, j].map(|k| pieces(found[k])[0].numerator_lu[3]);
        assert!((a - b).norm() < 1e-12, "third derivative: {a:?} {b:?}");
    }
    // Three points: one parabola. Two: a line.
    let result = through("CSPLINE BAUTO EAUTO", &POINTS[..2], "");
    assert!(splines(&result).iter().all(|next| pieces(next)[0].numerator_lu[3].norm() < 1e-12));
    let result = through("CSPLINE", &POINTS[..1], "");
    assert!(pieces(splines(&result)[0])[0].numerator_lu[2].norm() < 1e-12);
}

/// A spline of 500 blocks, made in windows, is the one that is solved at once: first and second derivatives go on to 1e-11 everywhere.
#[test]
fn long_csplines_are_solved_in_windows() {
    let points: Vec<[f64; 2]> = (1..=500)
        .map(|i| {
            let t = f64::from(i);
            [t * 1.0 + (t * 0.7).sin() * 0.4, 20.0 * (t * 0.05).sin() + (t * 1.3).cos()]
        })
        .collect();
    let result = through("CSPLINE", &points, "");
    let found = splines(&result);
    assert_eq!(found.len(), 500);
    for pair in found.windows(2) {
        let [a, b] = [&pieces(pair[0])[0], &pieces(pair[1])[0]];
        for axis in [X, Y] {
            let (end, start) = (plain(a, axis, a.parameter_end_ratio), plain(b, axis, 0.0));
            for order in 0..3 {
                assert!((end[order] - start[order]).abs() < 1e-11, "order {order} behind line {}", pair[0].block.line);
            }
        }
    }
}

/// Akima's tangents, written out for the plane.
#[test]
fn aspline_has_akimas_tangents() {
    let result = through("ASPLINE BAUTO EAUTO", &POINTS, "");
    let found = splines(&result);
    let points = with_start(&POINTS);
    let mut slopes: Vec<[f64; 2]> = points
        .windows(2)
        .map(|pair| {
            let h = chord([pair[0], pair[1]]);
            [(pair[1][0] - pair[0][0]) / h, (pair[1][1] - pair[0][1]) / h]
        })
        .collect();
    // Two more on either side, each as different from its neighbour as that from the next.
    let extended = |near: [f64; 2], far: [f64; 2]| [2.0 * near[0] - far[0], 2.0 * near[1] - far[1]];
    for _ in 0..2 {
        slopes.insert(0, extended(slopes[0], slopes[1]));
        slopes.push(extended(slopes[slopes.len() - 1], slopes[slopes.len() - 2]));
    }
    let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    for i in 0..points.len() {
        let [a, b, c, d] = [slopes[i], slopes[i + 1], slopes[i + 2], slopes[i + 3]];
        let (before, after) = (distance(a, b), distance(c, d));
        let wanted = [0, 1].map(|k| (after * b[k] + before * c[k]) / (before + after));
        for (axis, k) in [(X, 0), (Y, 1)] {
            if i > 0 {
                let piece = &pieces(found[i - 1])[0];
                near(plain(piece, axis, piece.parameter_end_ratio)[1], wanted[k], "tangent at the end");
                near(plain(piece, axis, piece.parameter_end_ratio)[0], points[i][k], "point");
            }
            if i + 1 < points.len() {
                near(plain(&pieces(found[i])[0], axis, 0.0)[1], wanted[k], "tangent at the start");
            }
        }
    }
    // BNAT: no curvature at the start.
    let result = through("ASPLINE BNAT ENAT", &POINTS, "");
    let found = splines(&result);
    let last = &pieces(found[4])[0];
    for axis in [X, Y] {
        near(plain(&pieces(found[0])[0], axis, 0.0)[2], 0.0, "BNAT");
        near(plain(last, axis, last.parameter_end_ratio)[2], 0.0, "ENAT");
    }
}

/// N_i,p(t) by the recursion of Cox and de Boor.
fn basis(i: usize, p: usize, t: f64, knots: &[f64]) -> f64 {
    if p == 0 {
        let last = knots[i + 1] == knots[knots.len() - 1] && t == knots[i + 1] && knots[i] < knots[i + 1];
        return if (knots[i] <= t && t < knots[i + 1]) || last { 1.0 } else { 0.0 };
    }
    let part = |numerator: f64, width: f64, value: f64| if width > 0.0 { numerator / width * value } else { 0.0 };
    part(t - knots[i], knots[i + p] - knots[i], basis(i, p - 1, t, knots))
        + part(knots[i + p + 1] - t, knots[i + p + 1] - knots[i + 1], basis(i + 1, p - 1, t, knots))
}

#[test]
fn bspline_is_the_rational_b_spline() {
    let weights = [1.0, 2.0, 1.0, 0.5, 1.0, 3.0, 1.0, 0.7];
    let intervals = [1.0, 1.0, 1.0, 2.0, 0.5, 1.0, 1.0, 1.0];
    let points: Vec<[f64; 2]> = vec![
        [0.0, 0.0],
        [10.0, 20.0],
        [30.0, 40.0],
        [50.0, 10.0],
        [60.0, 20.0],
        [80.0, 0.0],
        [90.0, 30.0],
        [95.0, 0.0],
    ];
    for degree in [2, 3] {
        let n = points.len() - 1;
        let mut knots = vec![0.0; degree + 1];
        for span in 0..=(n - degree) {
            // PL of block j + 2 is the length of span j.
            knots.push(knots[knots.len() - 1] + intervals[(span + 2).min(n)]);
        }
        let end = knots[knots.len() - 1];
        knots.extend(vec![end; degree]);
        let lines: String = (1..=n)
            .map(|i| format!("X{} Y{} PW={} PL={}\n", points[i][0], points[i][1], weights[i], intervals[i]))
            .collect();
        let result = ok(&format!("G1 X0 Y0 F1000\nBSPLINE SD={degree}\n{lines}G1 X100\nM30"));
        let found = splines(&result);
        assert_eq!(found.len(), n, "a share of the curve for every block");
        let mut t = 0.0;
        for next in &found {
            for piece in pieces(next) {
                for step in 0..=10 {
                    let u = piece.parameter_end_ratio * f64::from(step) / 10.0;
                    let at = (t + u).min(end);
                    let n_i: Vec<f64> = (0..=n).map(|i| weights[i] * basis(i, degree, at, &knots)).collect();
                    let sum: f64 = n_i.iter().sum();
                    for (axis, k) in [(X, 0), (Y, 1)] {
                        let wanted = (0..=n).map(|i| n_i[i] * points[i][k]).sum::<f64>() / sum;
                        near(
                            value(piece, axis, u),
                            wanted,
                            &format!("degree {degree} t {at} line {}", next.block.line),
                        );
                    }
                }
                t += piece.parameter_end_ratio;
            }
            let last = &pieces(next)[pieces(next).len() - 1];
            near(next.end.0[X], value(last, X, last.parameter_end_ratio), "end of the move");
        }
        near(t, end, "the whole range");
        assert_eq!(xy(&found[n - 1].end), points[n]);
    }
    // Few points: the degree is their number.
    let result = through("BSPLINE", &POINTS[..1], "");
    assert!(pieces(splines(&result)[0])[0].numerator_lu[2].norm() < 1e-12);
    let result = through("BSPLINE", &POINTS[..2], "");
    assert_eq!(splines(&result).len(), 2);
    // The first block may name the first control point, to give it a weight.
    let result = ok("G1 X0 Y0 F1000\nBSPLINE X0 Y0 PW=2\nX10 Y10\nX20 Y0\nX30 Y10\nM30");
    near(pieces(splines(&result)[0])[0].denominator_ratio[0], 2.0, "weight of the first point");
    refused("G1 X0 Y0 F1000\nBSPLINE\nX10 Y10\nX20 PW=0\nG1 X40\nX50\nM30", "E0513");
}

/// A place of the curve of a whole control polygon: x, y and weight of every control point, by de Boor's triangle of numbers.
fn de_boor(polygon: &[[f64; 3]], p: usize, knots: &[f64], t: f64) -> [f64; 2] {
    let k = (p..polygon.len()).rfind(|k| knots[*k] <= t && knots[*k] < knots[k + 1]).unwrap();
    let mut d: Vec<[f64; 3]> = polygon[k - p..=k].iter().map(|[x, y, w]| [x * w, y * w, *w]).collect();
    for level in 1..=p {
        for j in (level..=p).rev() {
            let i = k - p + j;
            let share = (t - knots[i]) / (knots[i + p + 1 - level] - knots[i]);
            d[j] = [0, 1, 2].map(|c| (1.0 - share) * d[j - 1][c] + share * d[j][c]);
        }
    }
    [d[p][0] / d[p][2], d[p][1] / d[p][2]]
}

/// Drives a BSPLINE from (0, 0) along `blocks` (x, y, PW) and compares every block of it with the polygon, repeats included.
fn drives_polygon(degree: usize, blocks: &[[f64; 3]]) -> Run {
    let polygon: Vec<[f64; 3]> = [[0.0, 0.0, 1.0]].iter().chain(blocks).copied().collect();
    let n = blocks.len();
    let knots: Vec<f64> = (0..=n + degree + 1).map(|i| i.clamp(degree, n + 1) as f64 - degree as f64).collect();
    let lines: String = blocks.iter().map(|[x, y, w]| format!("X{x} Y{y} PW={w}\n")).collect();
    let result = ok(&format!("G1 X0 Y0 F1000\nBSPLINE SD={degree}\n{lines}M30"));
    let found = splines(&result);
    let numbers: Vec<u32> = found.iter().map(|next| next.block.line).collect();
    assert_eq!(numbers, (3..3 + n as u32).collect::<Vec<_>>(), "a block of the path for every block: {blocks:?}");
    let mut t = 0.0;
    for next in &found {
        for piece in pieces(next) {
            for step in 0..=10 {
                let u = piece.parameter_end_ratio * f64::from(step) / 10.0;
                let wanted = de_boor(&polygon, degree, &knots, t + u);
                let what = format!("SD={degree}, t {}, line {}, {blocks:?}", t + u, next.block.line);
                near(value(piece, X, u), wanted[0], &what);
                near(value(piece, Y, u), wanted[1], &what);
            }
            t += piece.parameter_end_ratio;
        }
        let wanted = de_boor(&polygon, degree, &knots, t);
        near(next.end.0[X], wanted[0], "end of the block");
        near(next.end.0[Y], wanted[1], "end of the block");
    }
    near(t, knots[n + 1], "the whole range");
    result
}

#[test]
fn a_control_point_counts_as_often_as_it_is_programmed() {
    let point = |i: usize| [POINTS[i][0], POINTS[i][1], 1.0];
    for degree in [2, 3] {
        for repeated in 0..POINTS.len() {
            for times in 1..=5 {
                let blocks: Vec<[f64; 3]> =
                    (0..POINTS.len()).flat_map(|i| vec![point(i); if i == repeated { times } else { 1 }]).collect();
                drives_polygon(degree, &blocks);
                // Weights of the same point differ: it pulls with all of them.
                let weighted: Vec<[f64; 3]> =
                    blocks.iter().zip([1.0, 2.0, 0.5].into_iter().cycle()).map(|([x, y, _], w)| [*x, *y, w]).collect();
                drives_polygon(degree, &weighted);
            }
        }
        // Every point twice; and nothing but one point.
        let twice: Vec<[f64; 3]> = (0..POINTS.len()).flat_map(|i| [point(i); 2]).collect();
        drives_polygon(degree, &twice);
        drives_polygon(degree, &[point(0); 7]);
    }
}

#[test]
fn a_block_of_repeated_control_points_stands() {
    let blocks: Vec<[f64; 3]> =
        [0, 1, 1, 1, 1, 1, 2, 3].map(|i| [POINTS[i][0], POINTS[i][1], 1.0]).into_iter().collect();
    let result = drives_polygon(3, &blocks);
    // Three of five equal points draw the curve into the corner, the two that remain have no way.
    let found = splines(&result);
    let stands = |i: usize| (found[i].end.0 - found[i - 1].end.0).norm() < 1e-12;
    assert_eq!((1..found.len()).map(stands).collect::<Vec<_>>(), [false, false, true, true, false, false, false]);
    // With SD=2 two draw it there: the block of the first one ends in the corner, and that of a third one stands.
    for times in [2, 3] {
        let blocks: Vec<usize> = [0].into_iter().chain(vec![1; times]).chain([2, 3]).collect();
        let blocks: Vec<[f64; 3]> = blocks.into_iter().map(|i| [POINTS[i][0], POINTS[i][1], 1.0]).collect();
        let result = drives_polygon(2, &blocks);
        let found = splines(&result);
        for next in &found[1..times] {
            near(next.end.0[X], POINTS[1][0], "the corner");
            near(next.end.0[Y], POINTS[1][1], "the corner");
        }
        assert!((found[times].end.0 - found[times - 1].end.0).norm() > 1.0, "the last one leads away");
    }
    // A block that stands at the end leaves the direction in which the curve came: along the last leg of the polygon, here X.
    let result = ok("G1 X0 Y0 F1000\nBSPLINE X10 Y10\nX20 Y0\nX30 Y0\nX30\nX30\nX30\nX30\nCT X40 Y10\nM30");
    let circle = arc(&result.moves[result.moves.len() - 2]);
    near(circle.centre_mm[0], 30.0, "centre");
    near(circle.centre_mm[1], 10.0, "centre");
    // The start that the first block names is the first control point, once; named again it counts twice.
    let once = ok("G1 X0 Y0 F1000\nBSPLINE X0 Y0\nX10 Y10\nX20 Y0\nX30 Y10\nM30");
    assert_eq!(splines(&once).len(), 3);
    let slope = |result: &Run| plain(&pieces(splines(result)[0])[0], X, 0.0)[1];
    near(slope(&once), 30.0, "three points from the start: a Bezier cubic");
    let again = ok("G1 X0 Y0 F1000\nBSPLINE X0 Y0\nX0 Y0\nX10 Y10\nX20 Y0\nX30 Y10\nM30");
    assert_eq!(splines(&again).iter().map(|next| next.block.line).collect::<Vec<_>>(), [3, 4, 5, 6]);
    near(slope(&again), 0.0, "the first leg of the polygon has no length");
}

#[test]
fn splines_end_where_another_motion_or_a_stop_begins() {
    let result = ok("G1 X0 Y0 F1000\nCSPLINE X10 Y10\nX20 M7\nM8\nX30 Y10\nG4 F1\nX40\nX50 Y0\nG1 X60\nM30");
    let kinds: Vec<&str> = result.moves.iter().map(|next| sollwert::interpreter::kind_name(&next.kind)).collect();
    assert_eq!(
        kinds,
        ["line", "spline", "spline", "function", "spline", "dwell", "spline", "spline", "line", "function"],
        "{}",
        result.listing
    );
    // Every move keeps its line and its order.
    assert_eq!(result.moves.iter().map(|next| next.block.line).collect::<Vec<_>>(), [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
    let found = splines(&result);
    for axis in [X, Y] {
        let last = &pieces(found[2])[0];
        near(plain(last, axis, last.parameter_end_ratio)[2], 0.0, "the first spline ends at the dwell");
        near(plain(&pieces(found[3])[0], axis, 0.0)[2], 0.0, "the second one begins behind it");
    }
    // A point twice is one point; a program may end in a spline, or in an alarm.
    let result = ok("G1 X0 Y0 F1000\nASPLINE X10 Y10\nX10 Y10\nX20 Y0");
    assert_eq!(splines(&result).len(), 2);
    let result = run("G1 X0 Y0 F1000\nASPLINE X10 Y10\nX20 Y0\nX30 Q");
    assert!(result.alarm.is_some());
    assert_eq!(splines(&result).len(), 2);
}

#[test]
fn a_turned_frame_turns_the_spline() {
    let points = "X10 Y20\nX30 Y10\nX40 Y40\nX70 Y0\n";
    for word in ["ASPLINE", "CSPLINE", "BSPLINE"] {
        let straight = ok(&format!("G1 X0 Y0 F1000\n{word}\n{points}M30"));
        let turned = ok(&format!("ROT RPL=30\nG1 X0 Y0 F1000\n{word}\n{points}M30"));
        let (sin, cos) = (PI / 6.0).sin_cos();
        for (a, b) in splines(&straight).into_iter().zip(splines(&turned)) {
            for (p, q) in pieces(a).iter().zip(pieces(b)) {
                let u = 0.3 * p.parameter_end_ratio;
                let [x, y] = [value(p, X, u), value(p, Y, u)];
                near(value(q, X, u), x * cos - y * sin, word);
                near(value(q, Y, u), x * sin + y * cos, word);
            }
        }
    }
}

#[test]
fn poly_is_its_definition() {
    let result = ok("G1 X5 Y1 Z2 F1000\nPOLY PO[X]=(10, 2, -1) PO[Y]=(4, 0, 0, 3, 0.5) Z8 PL=2\nM30");
    let [piece] = pieces(&result.moves[1]) else { panic!() };
    near(piece.parameter_end_ratio, 2.0, "PL");
    // X: 5 + a1 p + 2 p² - p³ = 10 at 2: a1 = 2.5. Y: 1 + a1 p + 3 p⁴ + 0.5 p⁵ = 4 at 2: a1 = (3 - 48 - 16) / 2.
    for p in [0.0, 0.7, 2.0_f64] {
        near(value(piece, X, p), 5.0 + 2.5 * p + 2.0 * p * p - p.powi(3), "X");
        near(value(piece, Y, p), 1.0 - 30.5 * p + 3.0 * p.powi(4) + 0.5 * p.powi(5), "Y");
        near(value(piece, Z, p), 2.0 + 3.0 * p, "Z goes linearly");
    }
    // The quarter circle of the programming manual, translated.
    for (frame, [x0, y0]) in [("", [0.0, 0.0]), ("TRANS X5 Y-3\n", [5.0, -3.0])] {
        let result = ok(&format!("{frame}G1 X10 Y0 F1000\nPOLY PO[X]=(0,-10) PO[Y]=(10) PO[]=(2,1)\nM30"));
        let shown = &result.moves[1];
        let [piece] = pieces(shown) else { panic!() };
        for i in 0..=10 {
            let p = f64::from(i) / 10.0;
            let [x, y] = [value(piece, X, p) - x0, value(piece, Y, p) - y0];
            near(x.hypot(y), 10.0, "radius");
            near(x, 10.0 * (1.0 - p * p) / (1.0 + p * p), "x");
        }
        assert_eq!(xy(&shown.end), [x0, 10.0 + y0]);
    }
    refused("G1 X0 F1\nPOLY PO[X]=(1,2) PO[]=(-1)", "E0513");
    refused("G1 X0 F1\nPOLY PO[X]=(1,2) PL=0", "E0513");
    refused("G1 PO[X]=(1,2) F1", "E0207");
    refused("POLY F1 X1 PO[X]=(1,2)", "E0205");
    refused("POLY F1 PO[Q]=(1,2)", "E0204");
    let rotary = run_bytes(b"G1 X0 F1000\nPOLY PO[X]=(10,1) PO[C]=(90,30) PO[]=(2)\nM30", &xyzbc());
    let [piece] = pieces(&rotary.moves[1]) else { panic!() };
    let c = AxisId::new(4);
    near(piece.numerator_lu[1][c] + piece.numerator_lu[2][c], FRAC_PI_2, "a rotary axis is not divided");
}

#[test]
fn cip_goes_through_its_intermediate_point() {
    // A half circle about (5, 0), both ways; then one that is not in a plane of the axes.
    for (j, sweep) in [("5", -PI), ("-5", PI)] {
        let result = ok(&format!("G1 X0 Y0 F1\nCIP X10 Y0 I1=5 J1={j}"));
        let found = arc(&result.moves[1]);
        near(found.sweep_rad, sweep, "sweep");
        near(found.centre_mm[0], 5.0, "centre");
        near(found.radius_mm, 5.0, "radius");
    }
    // G91 counts I1 from the start too; TURN adds circles.
    let result = ok("G1 X3 Y4 F1\nG91 CIP X10 Y0 I1=5 J1=5 TURN=2");
    near(arc(&result.moves[1]).sweep_rad, -PI - 2.0 * TAU, "TURN");
    near(arc(&result.moves[1]).centre_mm[0], 8.0, "centre");
    // G18: in the plane of Z and X, whatever the plane says.
    let result = ok("G1 X10 Z0 F1\nCIP X0 Z10 I1=7.0710678118654755 K1=7.0710678118654755");
    let found = arc(&result.moves[1]);
    assert_eq!(found.plane, [Z, X]);
    near(found.sweep_rad, -FRAC_PI_2, "from X to Z");
    let result = ok("G1 X1 Y0 Z0 F1\nCIP X0 Y0 Z1 I1=0 J1=1 K1=0");
    let MoveKind::SpatialArc(found) = &result.moves[1].kind else { panic!("{}", result.listing) };
    // The circle through the three unit points: centre (1, 1, 1)/3, radius sqrt(2/3), two thirds of a turn.
    for axis in [X, Y, Z] {
        near(found.centre_mm[axis], 1.0 / 3.0, "centre");
    }
    near(found.radius_mm, (2.0_f64 / 3.0).sqrt(), "radius");
    near(found.sweep_rad, 2.0 * TAU / 3.0, "sweep");
    near(found.directions[0].dot(&found.directions[1]), 0.0, "right angle");
    refused("G1 X0 Y0 F1\nCIP X10 Y0 I1=5 J1=0", "E0513");
    refused("G1 X0 Y0 F1\nCIP X10 Y0", "E0513");
    refused("G1 X0 Y0 F1 I1=3", "E0207");
    refused("SCALE X2\nG1 X0 Y0 F1\nCIP X10 Y0 I1=5 J1=5", "E0509");
}

#[test]
fn ct_goes_on_where_the_block_before_ended() {
    // Along +X, then a half circle up to (10, 20): centre (10, 10).
    let result = ok("G1 X0 Y0 F1\nX10\nCT X10 Y20\nCT X10 Y40\nG1 X0\nCT X-10 Y50");
    let [first, second, third] = [2, 3, 5].map(|i| arc(&result.moves[i]));
    near(first.centre_mm[1], 10.0, "centre");
    near(first.sweep_rad, PI, "to the left");
    // It ends along -X: the next one bends to the right.
    near(second.sweep_rad, -PI, "to the right");
    near(second.centre_mm[1], 30.0, "centre");
    near(third.sweep_rad, -FRAC_PI_2, "a quarter to the right");
    near(third.radius_mm, 10.0, "radius");
    // Straight ahead it is a line; straight behind there is no circle.
    let result = ok("G1 X0 Y0 F1\nX10\nCT X30");
    assert_eq!(result.moves[2].kind, MoveKind::Line);
    refused("G1 X0 Y0 F1\nX10\nCT X5", "E0513");
    refused("G1 F1\nCT X5 Y5", "E0513");
    // Behind a spline: with its direction.
    let result = ok("G1 X-10 Y0 F1\nX0\nCSPLINE BTAN ENAT X10 Y0\nCT X20 Y10");
    near(arc(&result.moves[3]).radius_mm, 10.0, "behind a spline");
}

#[test]
fn opening_angles() {
    // With the end: the radius follows. With the centre: the end.
    let result = ok("G1 X10 Y0 F1\nG3 X0 Y10 AR=90\nG1 X10 Y0\nG2 X0 Y10 AR=270\nG1 X10 Y0\nG3 I-10 J0 AR=90");
    let [first, second, third] = [1, 3, 5].map(|i| arc(&result.moves[i]));
    near(first.sweep_rad, FRAC_PI_2, "AR=90");
    near(first.radius_mm, 10.0, "radius");
    near(first.centre_mm[0], 0.0, "centre");
    near(second.sweep_rad, -1.5 * PI, "AR=270");
    near(third.sweep_rad, FRAC_PI_2, "with a centre");
    near(result.moves[5].end.0[Y], 10.0, "its end");
    refused("G1 X10 F1\nG3 X0 Y10 I-10 J0 AR=90", "E0207");
    refused("G1 X10 F1\nG3 AR=90", "E0207");
    refused("G1 X10 F1\nG3 X10 AR=360", "E0513");
    refused("G1 X10 AR=20 F1", "E0207");
}

#[test]
fn polar_coordinates_count_from_their_pole() {
    let ends = |text: &str| ok(text).moves.iter().map(|next| xy(&next.end)).collect::<Vec<_>>();
    let near_points = |found: Vec<[f64; 2]>, wanted: &[[f64; 2]]| {
        assert_eq!(found.len(), wanted.len(), "{found:?}");
        for (a, b) in found.iter().zip(wanted) {
            assert!((a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9, "{found:?}, expected {wanted:?}");
        }
    };
    // The pole at (10, 5) of the workpiece; RP is modal; AP=IC adds.
    near_points(
        ends("G1 F1\nG111 X10 Y5\nG1 AP=0 RP=20\nAP=90\nAP=IC(90)\nRP=5\nAP=IC(-90)"),
        &[[30.0, 5.0], [10.0, 25.0], [-10.0, 5.0], [5.0, 5.0], [10.0, 10.0]],
    );
    // G110 from where the axes stand, G112 from the pole; a pole in polar coordinates.
    near_points(
        ends("G1 X10 Y0 F1\nG110 X5\nG1 RP=1 AP=90\nG112 Y2\nG1 RP=1 AP=180\nG110 RP=2 AP=0\nG1 RP=3 AP=0"),
        &[[10.0, 0.0], [15.0, 1.0], [14.0, 2.0], [19.0, 2.0]],
    );
    // A circle about the pole, in a turned frame.
    let result = ok("ROT RPL=90\nG111 X0 Y0\nG1 RP=10 AP=0 F1\nG3 AP=90\nM30");
    let found = arc(&result.moves[1]);
    near(found.sweep_rad, FRAC_PI_2, "sweep");
    near(found.radius_mm, 10.0, "radius");
    near(result.moves[1].end.0[X], -10.0, "end");
    refused("G1 X1 AP=20 RP=5 F1", "E0207");
    refused("G1 RP=-5 AP=0 F1", "E0306");
}

/// The listing and the counted numbers of the fast path go together with curves.
#[test]
fn listings_show_curves() {
    let result =
        ok("G1 X0 Y0 Z0 F600\nCSPLINE\nX10\nX20\nPOLY PO[X]=(30,1) PL=2\nCIP X31 Y1 Z1 I1=31 J1=0.5 K1=0\nM30");
    let lines: Vec<&str> = result.listing.lines().collect();
    assert_eq!(lines[1], "3 spline X10 Y0 Z0 F600 p10 X(0,1)");
    assert_eq!(lines[3], "5 polynomial X30 Y0 Z0 F600 p2 X(20,3,1)");
    assert!(lines[4].starts_with("6 arc X31 Y1 Z1 F600 ("), "{}", lines[4]);
    assert_eq!(xyz().axes.len(), 3);
}
