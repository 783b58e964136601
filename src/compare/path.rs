//! Two paths in space: for every point of one, the place of the other that it belongs to.
//!
//! In: a track (points with times) and a reference line. Out: a [`Match`] for each point: nearest point on the segments of the line, found
//! by a window that moves along with the track, so that a crossing or a pass beside it does not catch the point, and O(n) in all. Where
//! the track leaves the line for good (another program, another start) it is found again by a search over all of it, more and more
//! rarely while that fails. Standing still with noise makes no way: points that differ by less than the noise are one vertex.
//! Does not align in time.

/// A line in space with time: vertices that differ by more than the noise.
#[derive(Clone, Debug, Default)]
pub struct Line {
    vertices: Vec<Vertex>,
}

/// One vertex of a [`Line`].
#[derive(Clone, Copy, Debug)]
struct Vertex {
    point_mm: [f64; 3],
    /// Way from the first vertex.
    s_mm: f64,
    /// When the track came here and when it left.
    arrived_s: f64,
    left_s: f64,
}

/// Where a point belongs on a [`Line`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Distance of the two.
    pub distance_mm: f64,
    /// From the place on the line to the point.
    pub error_mm: [f64; 3],
    /// Direction of the line there, a unit vector; zero on a line of one vertex.
    pub direction: [f64; 3],
    /// Way along the line.
    pub s_mm: f64,
    /// When the track of the line was there; where it stood still, when it came.
    pub time_s: f64,
    /// True where the point lies beyond an end of the line.
    pub beyond_end: bool,
}

/// Vertices to a block of the search over all.
const BLOCK: usize = 128;
/// Way that the window looks ahead at least, and back.
const REACH_MIN_MM: f64 = 0.05;
/// Two places are as near as each other within this share of the squared distance, and within this length.
const EQUAL_SHARE: f64 = 1.02;
const EQUAL_MM: f64 = 1e-4;
/// Farther away than this the track may have lost the line.
const LOST_MM: f64 = 0.5;
/// Beyond an end by more than this: the track is not on the line there.
const END_SLACK_MM: f64 = 0.1;

impl Line {
    /// The line through points; points nearer to the last vertex than `noise_mm` make no vertex. Points that are not finite are left out.
    pub fn new(points: impl Iterator<Item = (f64, [f64; 3])>, noise_mm: f64) -> Self {
        let mut vertices: Vec<Vertex> = Vec::new();
        for (time_s, point_mm) in points {
            if !point_mm.iter().all(|x| x.is_finite()) {
                continue;
            }
            match vertices.last_mut() {
                Some(last) => {
                    let step_mm = norm(minus(point_mm, last.point_mm));
                    if step_mm > noise_mm {
                        let s_mm = last.s_mm + step_mm;
                        vertices.push(Vertex { point_mm, s_mm, arrived_s: time_s, left_s: time_s });
                    } else {
                        last.left_s = time_s;
                    }
                }
                None => vertices.push(Vertex { point_mm, s_mm: 0.0, arrived_s: time_s, left_s: time_s }),
            }
        }
        Self { vertices }
    }

    /// Whether it has no vertex.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// Its length.
    pub fn length_mm(&self) -> f64 {
        self.vertices.last().map_or(0.0, |last| last.s_mm)
    }

    /// Vertices in order: way, point and the time when the track left it.
    pub fn vertices(&self) -> impl Iterator<Item = (f64, [f64; 3], f64)> + '_ {
        self.vertices.iter().map(|v| (v.s_mm, v.point_mm, v.left_s))
    }

    fn segments(&self) -> usize {
        self.vertices.len().saturating_sub(1).max(1)
    }

    /// Nearest point of segment `j`; the line has a vertex at least.
    fn on_segment(&self, j: usize, point_mm: [f64; 3]) -> (f64, f64) {
        let a = self.vertices[j].point_mm;
        let Some(end) = self.vertices.get(j + 1) else { return (square(minus(point_mm, a)), 0.0) };
        let ab = minus(end.point_mm, a);
        let ap = minus(point_mm, a);
        let length2 = square(ab);
        let share = if length2 > 0.0 { (dot(ap, ab) / length2).clamp(0.0, 1.0) } else { 0.0 };
        (square(minus(ap, ab.map(|x| x * share))), share)
    }

    /// Whether segment `j` leads back where a way comes from.
    fn opposes(&self, j: usize, way_mm: [f64; 3]) -> bool {
        let Some(end) = self.vertices.get(j + 1) else { return false };
        dot(minus(end.point_mm, self.vertices[j].point_mm), way_mm) < 0.0
    }

    fn matched(&self, j: usize, point_mm: [f64; 3]) -> Match {
        let (_, share) = self.on_segment(j, point_mm);
        let start = &self.vertices[j];
        let end = self.vertices.get(j + 1).unwrap_or(start);
        let ab = minus(end.point_mm, start.point_mm);
        let length_mm = norm(ab);
        let direction = if length_mm > 0.0 { ab.map(|x| x / length_mm) } else { [0.0; 3] };
        let place: [f64; 3] = std::array::from_fn(|i| start.point_mm[i] + share * ab[i]);
        let error_mm = minus(point_mm, place);
        let along_mm = dot(error_mm, direction);
        let first = j == 0 && share <= 0.0 && along_mm < -END_SLACK_MM;
        let last = j + 1 >= self.segments() && share >= 1.0 && along_mm > END_SLACK_MM;
        Match {
            distance_mm: norm(error_mm),
            error_mm,
            direction,
            s_mm: start.s_mm + share * length_mm,
            time_s: if share >= 1.0 {
                end.arrived_s
            } else if share <= 0.0 {
                start.arrived_s
            } else {
                start.left_s + share * (end.arrived_s - start.left_s)
            },
            beyond_end: first || last,
        }
    }
}

/// Goes along a [`Line`] with a track.
pub struct Follower<'a> {
    line: &'a Line,
    /// Centre and radius of each block of vertices.
    blocks: Vec<([f64; 3], f64)>,
    at: usize,
    /// Segments that may be matched, first and last.
    range: [usize; 2],
    last_point_mm: Option<[f64; 3]>,
    /// Points to let pass before the next search over all, and how many the one after lets pass.
    wait: u32,
    patience: u32,
}

impl<'a> Follower<'a> {
    /// Begins at the vertex where the line was at `time_s`. `None` for a line without vertices.
    pub fn new(line: &'a Line, time_s: f64) -> Option<Self> {
        let last = line.vertices.len().checked_sub(1)?;
        let blocks = line.vertices.chunks(BLOCK).enumerate().map(|(i, chunk)| {
            // The first vertex of the next block belongs to the last segment of this one.
            let tail = line.vertices.get((i + 1) * BLOCK);
            let points = || chunk.iter().chain(tail).map(|v| v.point_mm);
            let count = (chunk.len() + usize::from(tail.is_some())) as f64;
            let sum = points().fold([0.0; 3], |sum, p| std::array::from_fn(|i| sum[i] + p[i]));
            let centre = sum.map(|x| x / count);
            (centre, points().map(|p| norm(minus(p, centre))).fold(0.0, f64::max))
        });
        let at = line.vertices.partition_point(|v| v.arrived_s <= time_s).saturating_sub(1).min(last);
        Some(Self {
            line,
            blocks: blocks.collect(),
            at: at.min(line.segments() - 1),
            range: [0, line.segments() - 1],
            last_point_mm: None,
            wait: 0,
            patience: 1,
        })
    }

    /// From now on only the part of the line counts where its own clock shows `from_s` to `to_s`.
    pub fn restrict(&mut self, from_s: f64, to_s: f64) {
        let vertex = |time_s: f64| self.line.vertices.partition_point(|v| v.arrived_s <= time_s).saturating_sub(1);
        let last = self.line.segments() - 1;
        let from = vertex(from_s).min(last);
        self.range = [from, vertex(to_s).saturating_sub(1).clamp(from, last)];
        self.at = self.at.clamp(from, self.range[1]);
    }

    /// Where the next point of the track belongs; `None` for a point that is not finite.
    pub fn next(&mut self, point_mm: [f64; 3]) -> Option<Match> {
        if !point_mm.iter().all(|x| x.is_finite()) {
            return None;
        }
        let way_mm = self.last_point_mm.map_or([0.0; 3], |last| minus(point_mm, last));
        self.last_point_mm = Some(point_mm);
        let mut best = self.in_window(point_mm, way_mm);
        if best.0 > LOST_MM * LOST_MM {
            if self.wait == 0 {
                let found = self.anywhere(point_mm, best.0);
                let better = found.0 < 0.25 * best.0;
                if better {
                    best = found;
                }
                self.patience = if better { 1 } else { (2 * self.patience).min(4096) };
                self.wait = self.patience;
            }
            self.wait -= 1;
        } else {
            (self.wait, self.patience) = (0, 1);
        }
        self.at = best.1;
        Some(self.line.matched(best.1, point_mm))
    }

    /// Nearest segment a little way ahead and back: squared distance and number. Where the line runs back over itself both ways are as
    /// near: the one that leads where the track goes counts.
    fn in_window(&self, point_mm: [f64; 3], way_mm: [f64; 3]) -> (f64, usize) {
        let vertices = &self.line.vertices;
        let here = self.line.on_segment(self.at, point_mm).0;
        // A point that cuts a corner lies beside both legs: the nearest place jumps across by as much as the cut.
        let reach_mm = 3.0 * norm(way_mm) + REACH_MIN_MM + 4.0 * here.sqrt().min(LOST_MM);
        let mut best = (here, self.at);
        let mut along = (if self.line.opposes(self.at, way_mm) { f64::INFINITY } else { here }, self.at);
        let mut look = |j: usize| {
            let d = self.line.on_segment(j, point_mm).0;
            if d < best.0 {
                best = (d, j);
            }
            if d < along.0 && !self.line.opposes(j, way_mm) {
                along = (d, j);
            }
        };
        let from_mm = vertices[self.at].s_mm;
        for j in (self.range[0]..self.at).rev() {
            if from_mm - vertices[j + 1].s_mm > reach_mm {
                break;
            }
            look(j);
        }
        let from_mm = vertices.get(self.at + 1).map_or(from_mm, |v| v.s_mm);
        for (j, vertex) in vertices.iter().enumerate().take(self.range[1] + 1).skip(self.at + 1) {
            if vertex.s_mm - from_mm > reach_mm {
                break;
            }
            look(j);
        }
        if along.0 <= EQUAL_SHARE * best.0 + EQUAL_MM * EQUAL_MM { along } else { best }
    }

    /// Nearest segment of all; blocks that are too far away are passed over.
    fn anywhere(&self, point_mm: [f64; 3], bound2: f64) -> (f64, usize) {
        let mut best = (bound2, self.at);
        let [first, last] = self.range;
        for (i, (centre, radius_mm)) in self.blocks.iter().enumerate().take(last / BLOCK + 1).skip(first / BLOCK) {
            let least_mm = norm(minus(point_mm, *centre)) - radius_mm;
            if least_mm > 0.0 && least_mm * least_mm >= best.0 {
                continue;
            }
            for j in first.max(i * BLOCK)..((i + 1) * BLOCK).min(last + 1) {
                let d = self.line.on_segment(j, point_mm).0;
                if d < best.0 {
                    best = (d, j);
                }
            }
        }
        best
    }
}

pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn square(a: [f64; 3]) -> f64 {
    dot(a, a)
}

pub(super) fn norm(a: [f64; 3]) -> f64 {
    square(a).sqrt()
}
