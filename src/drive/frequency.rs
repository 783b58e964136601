//! Frequency responses of an axis' loops, from the discrete model: no simulation.
//!
//! In: drive data and clock. Out: [`FrequencyResponses`]: current, speed and position loop, open and closed, each at its own sampling
//! instants up to half its sampling frequency, with margins, bandwidth and peak; set-point to position with filters, balancing and
//! feed-forward; outside torque to position. A response is H(z) = C (z - A)⁻¹ B + D at z = exp(2π j f T) of [`LinearModel`], times
//! the responses of the set-point boxes.
//!
//! A sine of frequency f, sampled, and the samples of what it causes: that is the response here. Between the samples a real axis
//! carries the images of the held signals at 1/T ± f, too; they are no part of it. What is left out is listed in `linear_model`.

use super::feedforward::Feedforward;
use super::jerk_filter::JerkFilter;
use super::linear_model::{LinearModel, POSITION_INPUTS, StateSpace};
use crate::base::TimeBase;
use crate::base::units::RAD_PER_REV;
use crate::machine::DriveData;
use nalgebra::{Complex, DMatrix};

/// First grid, points a decade; a curve that turns faster is refined.
const POINTS_PER_DECADE: f64 = 60.0;
/// Two neighbours differ by at most this share of the larger ...
const STEP_MAX_SHARE: f64 = 0.08;
/// ... unless they are as near as this.
const SPACING_MIN_RATIO: f64 = 1.0002;
/// Rounds of refinement.
const ROUNDS_MAX: u32 = 7;
/// Lowest frequency where none is named.
pub const LOWEST_HZ: f64 = 0.1;
/// Bisections for a crossing: to the last bit.
const BISECTIONS: u32 = 60;

/// Row an output, column an input.
type Responses = DMatrix<Complex<f64>>;

/// A response at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Frequency.
    pub frequency_hz: f64,
    /// Amplitude and phase, as a complex number.
    pub response: Complex<f64>,
}

/// Frequency and margin of a stability limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseMargin {
    /// Where the open loop has gain 1.
    pub crossover_hz: f64,
    /// 180° and the phase there; negative: unstable.
    pub margin_deg: f64,
}

/// Frequency and margin of a stability limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainMargin {
    /// Where the open loop has phase -180°.
    pub crossover_hz: f64,
    /// By how much the gain may rise (above 1) or must not fall (below 1).
    pub margin_ratio: f64,
}

/// One loop at its own rate.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopResponse {
    /// Sampling time of the loop.
    pub period_s: f64,
    /// Cut at what is measured.
    pub open: Vec<Point>,
    /// From reference to actual value.
    pub closed: Vec<Point>,
    /// The smallest; `None`: the gain is never 1.
    pub phase_margin: Option<PhaseMargin>,
    /// The smallest above 1; `None`: the phase is never -180° with a gain below 1.
    pub gain_margin: Option<GainMargin>,
    /// The nearest below 1; `None`: no fall of the gain makes it unstable.
    pub gain_reduction: Option<GainMargin>,
    /// Where the closed loop falls below -3 dB for the first time.
    pub bandwidth_hz: Option<f64>,
    /// The largest amplitude of the closed loop.
    pub peak: Point,
    /// Largest magnitude of a pole; stable below 1.
    pub spectral_radius_ratio: f64,
}

/// All of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct FrequencyResponses {
    /// i_ref to i, at T_i.
    pub current: LoopResponse,
    /// w_ref to w, at T_v.
    pub speed: LoopResponse,
    /// x_ref to x_meas, at T_p (open loop with DSC: at T_v), without feed-forward.
    pub position: LoopResponse,
    /// x_set to x at T_p: with jerk filter, balancing and feed-forward.
    pub setpoint: Vec<Point>,
    /// x_set to x_ref - x_meas, the control deviation.
    pub deviation: Vec<Point>,
    /// Outside torque at the motor shaft to x, lu per N·m.
    pub compliance: Vec<Point>,
}

/// Responses of the loops of `data` from `lowest_hz` up.
pub fn frequency_responses(data: &DriveData, time_base: &TimeBase, lowest_hz: f64) -> FrequencyResponses {
    let model = LinearModel::new(data, time_base);
    let position_period_s = time_base.seconds(data.position_cycle_ticks);
    let speed_period_s = time_base.seconds(data.speed_cycle_ticks);
    let current_period_s = time_base.seconds(data.current_cycle_ticks);
    let current = loop_response(
        &Loop { system: &model.current_open(), period_s: current_period_s },
        &Loop { system: &model.current_closed(), period_s: current_period_s },
        lowest_hz,
        |system, z| response(system, z)[(0, 0)],
    );
    let speed = loop_response(
        &Loop { system: &model.speed_open(), period_s: speed_period_s },
        &Loop { system: &model.speed_closed(), period_s: speed_period_s },
        lowest_hz,
        |system, z| response(system, z)[(0, 0)],
    );
    let closed = model.position_closed();
    let open_period_s = if data.options.stiffness_control { speed_period_s } else { position_period_s };
    let position = loop_response(
        &Loop { system: &model.position_open(), period_s: open_period_s },
        &Loop { system: &closed, period_s: position_period_s },
        lowest_hz,
        |system, z| {
            let h = response(system, z);
            h[(1, 0)] + h[(1, 1)] / z
        },
    );
    let preparation = Preparation::new(data, position_period_s);
    let at = |pick: &dyn Fn(&Responses, Complex<f64>) -> Complex<f64>| {
        curve(lowest_hz, position_period_s, |z| pick(&response(&closed, z), z))
    };
    let whole = |h: &Responses, row: usize, z: Complex<f64>| {
        let [reference, v_ff, t_ff] = preparation.at(z.inv());
        reference * (h[(row, 0)] + h[(row, 1)] / z) + v_ff * h[(row, 2)] + t_ff * h[(row, 3)]
    };
    let setpoint = at(&|h, z| whole(h, 0, z));
    let deviation = at(&|h, z| whole(h, 2, z));
    let compliance = at(&|h, _| h[(0, POSITION_INPUTS - 1)]);
    FrequencyResponses { current, speed, position, setpoint, deviation, compliance }
}

/// Jerk filter, balancing and feed-forward: from x_set to x_ref, v_ff, t_ff.
struct Preparation {
    jerk_filter: JerkFilter,
    feedforward: Feedforward,
}

impl Preparation {
    fn new(data: &DriveData, period_s: f64) -> Self {
        Self {
            jerk_filter: JerkFilter::new(&data.options.jerk_filter, period_s, 0.0),
            feedforward: Feedforward::new(data, period_s, 0.0),
        }
    }

    /// `q` = 1/z.
    fn at(&self, q: Complex<f64>) -> [Complex<f64>; 3] {
        let filtered = self.jerk_filter.response(q);
        self.feedforward.responses(q).map(|response| response * filtered)
    }
}

/// A system and its sampling time.
struct Loop<'a> {
    system: &'a StateSpace,
    period_s: f64,
}

fn loop_response(
    open: &Loop<'_>,
    closed: &Loop<'_>,
    lowest_hz: f64,
    closed_at: impl Fn(&StateSpace, Complex<f64>) -> Complex<f64>,
) -> LoopResponse {
    let open_at = |z: Complex<f64>| response(open.system, z)[(0, 0)];
    let closed_at = |z: Complex<f64>| closed_at(closed.system, z);
    let open_points = curve(lowest_hz, open.period_s, open_at);
    let closed_points = curve(lowest_hz, closed.period_s, closed_at);
    let at_hz = |frequency_hz: f64| open_at(on_circle(frequency_hz, open.period_s));
    let first =
        closed_points.first().copied().unwrap_or(Point { frequency_hz: lowest_hz, response: Complex::new(0.0, 0.0) });
    let peak = closed_points
        .iter()
        .fold(first, |best, point| if point.response.norm() > best.response.norm() { *point } else { best });
    let (gain_margin, gain_reduction) = gain_margins(&open_points, &at_hz);
    LoopResponse {
        period_s: closed.period_s,
        phase_margin: phase_margin(&open_points, &at_hz),
        gain_margin,
        gain_reduction,
        bandwidth_hz: bandwidth_hz(&closed_points, &|frequency_hz| closed_at(on_circle(frequency_hz, closed.period_s))),
        peak,
        spectral_radius_ratio: spectral_radius_ratio(closed.system),
        open: open_points,
        closed: closed_points,
    }
}

/// z at a frequency.
fn on_circle(frequency_hz: f64, period_s: f64) -> Complex<f64> {
    Complex::from_polar(1.0, RAD_PER_REV * frequency_hz * period_s)
}

/// C (z - A)⁻¹ B + D; NaN where z is a pole.
fn response(system: &StateSpace, z: Complex<f64>) -> Responses {
    let complex = |matrix: &DMatrix<f64>| matrix.map(|value| Complex::new(value, 0.0));
    let order = system.a.nrows();
    let resolvent = DMatrix::from_diagonal_element(order, order, z) - complex(&system.a);
    let not_a_number = Complex::new(f64::NAN, f64::NAN);
    let states = resolvent
        .lu()
        .solve(&complex(&system.b))
        .unwrap_or_else(|| DMatrix::from_element(order, system.b.ncols(), not_a_number));
    complex(&system.c) * states + complex(&system.d)
}

fn spectral_radius_ratio(system: &StateSpace) -> f64 {
    if system.a.iter().any(|value| !value.is_finite()) {
        return f64::NAN;
    }
    system.a.complex_eigenvalues().iter().map(|pole| pole.norm()).fold(0.0, f64::max)
}

/// Points from `lowest_hz` to half the sampling frequency, closer where the curve turns.
fn curve(lowest_hz: f64, period_s: f64, at: impl Fn(Complex<f64>) -> Complex<f64>) -> Vec<Point> {
    let highest_hz = 0.5 / period_s;
    let lowest_hz = lowest_hz.min(highest_hz * 0.5);
    let point = |frequency_hz: f64| Point { frequency_hz, response: at(on_circle(frequency_hz, period_s)) };
    let decades = (highest_hz / lowest_hz).log10();
    let count = (decades * POINTS_PER_DECADE).ceil().clamp(2.0, 4000.0);
    let mut points: Vec<Point> =
        (0..=count as u32).map(|n| point(lowest_hz * (highest_hz / lowest_hz).powf(f64::from(n) / count))).collect();
    for _ in 0..ROUNDS_MAX {
        let mut refined = Vec::with_capacity(points.len());
        for two in points.windows(2) {
            let (a, b) = (two[0], two[1]);
            refined.push(a);
            let step = (b.response - a.response).norm();
            let size = a.response.norm().max(b.response.norm());
            if step > STEP_MAX_SHARE * size && b.frequency_hz > SPACING_MIN_RATIO * a.frequency_hz {
                refined.push(point((a.frequency_hz * b.frequency_hz).sqrt()));
            }
        }
        refined.extend(points.last());
        if refined.len() == points.len() {
            break;
        }
        points = refined;
    }
    points
}

/// Where `value` changes its sign between two neighbours.
fn crossings(points: &[Point], at: &dyn Fn(f64) -> Complex<f64>, value: impl Fn(Complex<f64>) -> f64) -> Vec<f64> {
    let mut found = Vec::new();
    for two in points.windows(2) {
        let (mut low, mut high) = (two[0].frequency_hz, two[1].frequency_hz);
        let (start, end) = (value(two[0].response), value(two[1].response));
        if start == 0.0 || start * end >= 0.0 || (start * end).is_nan() {
            continue;
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if value(at(middle)) * start > 0.0 { low = middle } else { high = middle }
        }
        found.push(high);
    }
    found
}

fn phase_margin(open: &[Point], at: &dyn Fn(f64) -> Complex<f64>) -> Option<PhaseMargin> {
    let margins = crossings(open, at, |response| response.norm() - 1.0).into_iter().map(|crossover_hz| PhaseMargin {
        crossover_hz,
        // The angle from -1, as seen on the circle.
        margin_deg: crate::base::units::deg_from_rad((-at(crossover_hz)).arg()),
    });
    margins.min_by(|a, b| a.margin_deg.abs().total_cmp(&b.margin_deg.abs()))
}

/// The nearest margins above and below 1. Half the sampling frequency counts: there the response is real.
fn gain_margins(open: &[Point], at: &dyn Fn(f64) -> Complex<f64>) -> (Option<GainMargin>, Option<GainMargin>) {
    let last = open.last().map(|point| point.frequency_hz);
    let all = crossings(open, at, |response| response.im).into_iter().chain(last);
    let all: Vec<GainMargin> = all
        .filter(|frequency_hz| at(*frequency_hz).re < 0.0)
        .map(|crossover_hz| GainMargin { crossover_hz, margin_ratio: 1.0 / at(crossover_hz).norm() })
        .collect();
    let above = all.iter().filter(|margin| margin.margin_ratio >= 1.0);
    let below = all.iter().filter(|margin| margin.margin_ratio < 1.0);
    (
        above.min_by(|a, b| a.margin_ratio.total_cmp(&b.margin_ratio)).copied(),
        below.max_by(|a, b| a.margin_ratio.total_cmp(&b.margin_ratio)).copied(),
    )
}

fn bandwidth_hz(closed: &[Point], at: &dyn Fn(f64) -> Complex<f64>) -> Option<f64> {
    let half_power = |response: Complex<f64>| response.norm_sqr() - 0.5;
    let falling = |frequency_hz: &f64| half_power(at(0.999 * frequency_hz)) > 0.0;
    crossings(closed, at, half_power).into_iter().find(falling)
}
