//! The limits of a fastest motion, looked at between the places that it gives.
//!
//! In: an [`Optimum`] and the machine. Out: the largest share of each limit that it uses. v² is the cubic between two places that has
//! their values and slopes; the derivatives of the path are its own.

use sollwert::base::AxisId;
use sollwert::feed::{PathRules, PieceRules};
use sollwert::kinematics::JointState;
use sollwert::machine::Machine;
use sollwert::optimum::{OptimalMotion, Optimum};

/// Shares of limits that are used: 1 is all.
#[derive(Clone, Copy, Debug, Default)]
pub struct Used {
    pub velocity: f64,
    pub acceleration: f64,
    pub jerk: f64,
    /// Where the largest was found: line and place.
    pub at: (u32, f64),
}

impl Used {
    fn see(&mut self, [velocity, acceleration, jerk]: [f64; 3], line: u32, place: f64) {
        if [velocity, acceleration, jerk]
            .iter()
            .any(|share| *share > self.velocity.max(self.acceleration).max(self.jerk))
        {
            self.at = (line, place);
        }
        self.velocity = self.velocity.max(velocity);
        self.acceleration = self.acceleration.max(acceleration);
        self.jerk = self.jerk.max(jerk);
    }

    pub fn largest(&self) -> f64 {
        self.velocity.max(self.acceleration).max(self.jerk)
    }
}

/// The largest shares anywhere.
pub fn used(optimum: &Optimum, machine: &Machine) -> Used {
    let mut used = Used::default();
    for motion in &optimum.motions {
        look_along(motion, machine, &mut used);
    }
    used
}

fn look_along(motion: &OptimalMotion, machine: &Machine, used: &mut Used) {
    let mut rules = PathRules::new(machine);
    let mut begins = 0.0;
    for (number, path) in motion.path.iter().enumerate() {
        let piece = rules.piece(path).expect("a piece that moves");
        let line = path.contour.block.line;
        let (from, to) = (begins, begins + path.length_lu());
        if number > 0 {
            let speed = speed_at(motion, from)[0].sqrt();
            used.see([speed / piece.junction_lu_s, 0.0, 0.0], line, from);
        }
        for pair in motion.places.windows(2) {
            let (low, high) = (pair[0].place_lu.max(from), pair[1].place_lu.min(to));
            for i in 0..=40 {
                let s = low + (high - low) * f64::from(i) / 40.0;
                if high > low {
                    used.see(shares(&path.at(s - from), &piece, cubic(pair[0], pair[1], s)), line, s);
                }
            }
        }
        begins = to;
    }
}

/// v², d(v²)/ds, d²(v²)/ds² between two places.
fn cubic(a: sollwert::optimum::SpeedPlace, b: sollwert::optimum::SpeedPlace, s: f64) -> [f64; 3] {
    let h = b.place_lu - a.place_lu;
    let t = (s - a.place_lu) / h;
    let (y0, y1) = (a.velocity_lu_s.powi(2), b.velocity_lu_s.powi(2));
    let (m0, m1) = (2.0 * a.acceleration_lu_s2 * h, 2.0 * b.acceleration_lu_s2 * h);
    let (c2, c3) = (3.0 * (y1 - y0) - 2.0 * m0 - m1, 2.0 * (y0 - y1) + m0 + m1);
    [y0 + t * (m0 + t * (c2 + t * c3)), (m0 + t * (2.0 * c2 + t * 3.0 * c3)) / h, (2.0 * c2 + 6.0 * t * c3) / (h * h)]
}

fn speed_at(motion: &OptimalMotion, s: f64) -> [f64; 3] {
    let next = motion.places.partition_point(|place| place.place_lu < s).clamp(1, motion.places.len() - 1);
    cubic(motion.places[next - 1], motion.places[next], s)
}

fn shares(state: &JointState, piece: &PieceRules, [square, slope, bend]: [f64; 3]) -> [f64; 3] {
    let (v, a) = (square.sqrt(), slope / 2.0);
    let j = v * bend / 2.0;
    let mut most = [piece.feed_lu_s.map_or(0.0, |feed| v / feed), 0.0, 0.0];
    for (axis, caps) in AxisId::first(piece.axes.len()).zip(&piece.axes) {
        let (d1, d2, d3) = (state.first[axis], state.second[axis], state.third[axis]);
        let velocity = d1 * v;
        let acceleration = d2 * v * v + d1 * a;
        let jerk = d3 * v.powi(3) + 3.0 * d2 * v * a + d1 * j;
        let jerk = if piece.jerk_limited { jerk / caps.jerk_max_lu_s3 } else { 0.0 };
        let own = [velocity / caps.velocity_max_lu_s, acceleration / caps.acceleration_max_lu_s2, jerk];
        for (most, own) in most.iter_mut().zip(own) {
            *most = most.max(own.abs());
        }
    }
    most
}
