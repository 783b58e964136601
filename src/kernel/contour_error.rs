//! Contour error of the running kernel: distance of the actual tool point from the path of the set-points, in the part frame.
//!
//! In: per cycle the tool point of the newest set-point and of the actual posture, mm. Out: the distance, mm. The path is the polyline
//! of the last [`HISTORY`] set-points: the actual position lags by far less. Does not use the programmed geometry: deviations by
//! smoothing are no contour error of the drives.

/// Set-points kept. At 1 ms and a lag of v/Kv with Kv = 16.7 1/s (60 ms) the nearest point is 60 set-points back.
const HISTORY: usize = 512;

/// Measures cycle by cycle; fixed memory.
#[derive(Clone)]
pub(super) struct ContourErrorMeter {
    ring: Box<[[f64; 3]; HISTORY]>,
    /// Set-points seen so far; number n stands at `ring[n % HISTORY]`.
    seen: u64,
    /// Number of the set-point at which the nearest segment of the last cycle began.
    nearest: u64,
}

impl ContourErrorMeter {
    pub(super) fn new() -> Self {
        Self { ring: Box::new([[0.0; 3]; HISTORY]), seen: 0, nearest: 0 }
    }

    /// Appends the next set-point of the path.
    pub(super) fn push(&mut self, setpoint_mm: [f64; 3]) {
        self.ring[(self.seen % HISTORY as u64) as usize] = setpoint_mm;
        self.seen += 1;
    }

    /// Distance of `actual_mm` to the polyline; `None` before the first set-point.
    pub(super) fn distance_mm(&mut self, actual_mm: [f64; 3]) -> Option<f64> {
        let newest = self.seen.checked_sub(1)?;
        let oldest = self.seen.saturating_sub(HISTORY as u64);
        // The actual position moves on along the path, or swings back a little: a few segments of slack behind the last nearest one.
        let from = self.nearest.saturating_sub(8).max(oldest);
        let at = |n: u64| self.ring[(n % HISTORY as u64) as usize];
        let mut best = (square_distance_mm2(at(newest), at(newest), actual_mm), newest);
        for n in from..newest {
            let distance_mm2 = square_distance_mm2(at(n), at(n + 1), actual_mm);
            if distance_mm2 < best.0 {
                best = (distance_mm2, n);
            }
        }
        self.nearest = best.1;
        Some(best.0.sqrt())
    }
}

/// Squared distance of point p from the segment a-b.
fn square_distance_mm2(a: [f64; 3], b: [f64; 3], p: [f64; 3]) -> f64 {
    let ab: [f64; 3] = std::array::from_fn(|i| b[i] - a[i]);
    let ap: [f64; 3] = std::array::from_fn(|i| p[i] - a[i]);
    let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let length_mm2 = dot(ab, ab);
    let share = if length_mm2 > 0.0 { (dot(ap, ab) / length_mm2).clamp(0.0, 1.0) } else { 0.0 };
    let gap: [f64; 3] = std::array::from_fn(|i| ap[i] - share * ab[i]);
    dot(gap, gap)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pure_lag_along_a_line_is_no_contour_error_and_a_sideways_offset_is() {
        let mut meter = ContourErrorMeter::new();
        for n in 0..2000 {
            let x = f64::from(n) * 0.05;
            meter.push([x, 2.0 * x, 0.0]);
            let lag = (x - 1.3).max(0.0);
            let exact = meter.distance_mm([lag, 2.0 * lag, 0.0]).unwrap();
            assert!(exact < 1e-12, "{exact}");
        }
        // The line has direction (1, 2)/sqrt 5: an offset of 0.01 along (2, -1)/sqrt 5 is the distance itself.
        let offset = 0.01 / 5.0_f64.sqrt();
        let seen = meter.distance_mm([99.0 + 2.0 * offset, 198.0 - offset, 0.0]).unwrap();
        assert!((seen - 0.01).abs() < 1e-12, "{seen}");
    }
}
