//! Which way a line goes, place by place: the ground for finding circles and corners.
//!
//! In: a [`Line`]. Out: [`Heading`]: points at equal ways, with the directions before and behind each. Does not judge.

use super::path::{Line, minus, norm};

/// A line at equal ways.
#[derive(Clone, Debug)]
pub struct Heading {
    /// Way between two points.
    pub step_mm: f64,
    /// Points, `[n]`.
    pub points_mm: Vec<[f64; 3]>,
}

/// Points at most; a longer line is looked at more coarsely.
const POINTS_MAX: f64 = 2e6;
/// Way between two points on lines that are short enough.
const STEP_MM: f64 = 0.05;

impl Heading {
    /// Points at equal ways along a line.
    pub fn new(line: &Line) -> Self {
        let length_mm = line.length_mm();
        let step_mm = STEP_MM.max(length_mm / POINTS_MAX);
        let count = (length_mm / step_mm).floor() as usize;
        let mut points_mm = Vec::with_capacity(count + 1);
        let mut last: Option<(f64, [f64; 3])> = None;
        for (s_mm, point_mm, _) in line.vertices() {
            if let Some((s0_mm, p0_mm)) = last {
                let along = minus(point_mm, p0_mm);
                while points_mm.len() as f64 * step_mm <= s_mm {
                    let share = (points_mm.len() as f64 * step_mm - s0_mm) / (s_mm - s0_mm);
                    points_mm.push(std::array::from_fn(|i| p0_mm[i] + share * along[i]));
                }
            } else {
                points_mm.push(point_mm);
            }
            last = Some((s_mm, point_mm));
        }
        Self { step_mm, points_mm }
    }

    /// Direction from point `from` to point `to`; `None` beyond the ends or where they are one.
    pub fn direction(&self, from: usize, to: usize) -> Option<[f64; 3]> {
        let way = minus(*self.points_mm.get(to)?, *self.points_mm.get(from)?);
        let length_mm = norm(way);
        (length_mm > 1e-9).then(|| way.map(|x| x / length_mm))
    }
}
