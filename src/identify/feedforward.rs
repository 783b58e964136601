//! Feed-forward constants, balancing delay and position gain from the recorded wires of the controller.
//!
//! In: [`AxisRecord`]s. Out: estimates in internal units. Two adjacent lags tell a gain and a delay that is no whole number of cycles:
//!
//! ```text
//! v_ff[k]          = c0 v_raw[k-n] + c1 v_raw[k-n-1]        kvff = c0 + c1       d_ff = (n + c1/kvff) T
//! t_ff[k]          = c0 a_raw[k-n] + c1 a_raw[k-n-1]        ktff J_ff / r = c0 + c1
//! x_ref[k] - x_set[k-n] = -f (x_set[k-n] - x_set[k-n-1]) + zero        d_pos = (n + f) T
//! v_cmd[k] - v_ff[k]    = Kv e_fol[k]                       without v_ff: its two lags are fitted along
//! ```
//! n is the lag that leaves the least over. Does not guess: what needs a signal that is not there is refused with its name. From position
//! alone kvff and d_pos are one number, kvff - Kv d_pos, as long as d_pos is at most a cycle.

use super::normal::{Blocks, Solution};
use super::record::AxisRecord;
use super::wire::{AxisResult, Estimate, Figure, Means, Parameter};
use crate::base::units::{MS_PER_S, percent_from_ratio};
use crate::machine::{Axis, DriveData};

/// Longest lag looked for.
const LAG_MAX_S: f64 = 40e-3;
/// Cycles of it at most.
const LAGS_MAX: usize = 64;
/// Rows of a block.
const BLOCK_S: f64 = 0.25;
/// Taps of a filter of the set-point that is looked for.
const TAPS: usize = 12;
/// Share of the signal that may be left over where a law is exact.
const LEFT_OVER_SHARE: f64 = 0.02;

/// The best of all lags: n, the solution, what is left over of the response (RMS shares).
struct Lagged {
    n: usize,
    solution: Solution,
    left_over_share: f64,
}

/// Lags behind the best one that are still tried: a motion that repeats would find itself again a whole period later.
const LAGS_BEYOND: usize = 8;

/// Fits `response(k, n)` to the rows that `regressors(k, n)` gives, for one lag n after another.
fn best_lag<const WIDTH: usize>(
    records: &[AxisRecord],
    response: impl Fn(&AxisRecord, usize, usize) -> f64,
    regressors: impl Fn(&AxisRecord, usize, usize) -> [f64; WIDTH],
) -> Option<Lagged> {
    let lags = records.first().map_or(1, |record| ((LAG_MAX_S / record.period_s) as usize).clamp(2, LAGS_MAX));
    let columns: [usize; WIDTH] = std::array::from_fn(|column| column);
    let mut square = 0.0;
    let mut best: Option<(f64, Lagged)> = None;
    for n in 0..=lags {
        let mut blocks = Blocks::new(WIDTH);
        for record in records {
            let per_block = ((BLOCK_S / record.period_s).round() as usize).max(1);
            // All lags begin where the longest does, so that what they leave over can be compared.
            for k in (lags + 3)..record.count {
                let (row, y) = (regressors(record, k, n), response(record, k, n));
                if y.is_finite() && row.iter().all(|value| value.is_finite()) {
                    blocks.push_in(k / per_block, &row, y);
                    square += if n == 0 { y * y } else { 0.0 };
                }
            }
            blocks.close();
        }
        let Some(solution) = blocks.solve(&columns) else { continue };
        let left = blocks.residual_square(&columns, &solution.theta);
        if best.as_ref().is_none_or(|(least, _)| left < *least) {
            let left_over_share = if square > 0.0 { (left / square).sqrt() } else { 0.0 };
            best = Some((left, Lagged { n, solution, left_over_share }));
        } else if best.as_ref().is_some_and(|(_, lagged)| n > lagged.n + LAGS_BEYOND) {
            break;
        }
    }
    best.map(|(_, lagged)| lagged)
}

/// v_raw at row k.
fn raw_velocity(record: &AxisRecord, k: usize) -> f64 {
    match (&record.setpoint_lu, k.checked_sub(1)) {
        (Some(x), Some(before)) if k < x.len() => (x[k] - x[before]) / record.period_s,
        _ => f64::NAN,
    }
}

fn raw_acceleration(record: &AxisRecord, k: usize) -> f64 {
    k.checked_sub(1)
        .map_or(f64::NAN, |before| (raw_velocity(record, k) - raw_velocity(record, before)) / record.period_s)
}

fn at(values: &Option<Vec<f64>>, k: usize) -> f64 {
    values.as_ref().and_then(|values| values.get(k)).copied().unwrap_or(f64::NAN)
}

/// Largest of a signal over all records; 0 where it is not there.
fn largest(records: &[AxisRecord], of: impl Fn(&AxisRecord) -> &Option<Vec<f64>>) -> f64 {
    let all = records.iter().filter_map(|record| of(record).as_ref()).flatten().filter(|value| value.is_finite());
    all.fold(0.0_f64, |most, value| most.max(value.abs()))
}

/// Whether a record has the signal: those that do not have no rows of it.
fn have(records: &[AxisRecord], of: impl Fn(&AxisRecord) -> &Option<Vec<f64>>) -> bool {
    records.iter().any(|record| of(record).is_some())
}

/// Whether a record is one of the controllers at work: set-points that move, at the position cycle.
fn usable(record: &AxisRecord, cycle_s: f64) -> bool {
    moves(std::slice::from_ref(record)) && (record.period_s / cycle_s - 1.0).abs() <= 1e-3
}

/// Without those that have the feed-forward switched off, where it is on in another.
fn switched_on(records: &[AxisRecord], of: impl Fn(&AxisRecord) -> &Option<Vec<f64>> + Copy) -> Vec<AxisRecord> {
    let on = |record: &&AxisRecord| largest(std::slice::from_ref(*record), of) > 0.0;
    let all: Vec<AxisRecord> = records.iter().filter(on).cloned().collect();
    if all.is_empty() { records.to_vec() } else { all }
}

/// Everything about the controllers in front of the speed loop.
pub(super) fn controllers(
    records: &[AxisRecord],
    axis: &Axis,
    data: &DriveData,
    cycle_s: f64,
    result: &mut AxisResult,
) -> Vec<Estimate> {
    let mut found = Vec::new();
    let remedies = Remedies::of(cycle_s);
    if !have(records, |record| &record.setpoint_lu) {
        for (parameter, _) in CONTROLLER_PARAMETERS {
            result.refuse(parameter, "the trace has no position set-point", &remedies.setpoint);
        }
        return found;
    }
    if !moves(records) {
        for (parameter, _) in CONTROLLER_PARAMETERS {
            result.refuse(parameter, "the set-point of the axis does not move", &remedies.move_it);
        }
        return found;
    }
    let (records, others): (Vec<AxisRecord>, Vec<AxisRecord>) =
        records.iter().cloned().partition(|record| usable(record, cycle_s));
    if records.is_empty() {
        let record = others.iter().find(|record| moves(std::slice::from_ref(*record))).unwrap_or(&others[0]);
        let (period_ms, cycle_ms) = (record.period_s * MS_PER_S, cycle_s * MS_PER_S);
        let reason = format!("the trace has a sample every {period_ms:.3} ms, the position cycle is {cycle_ms:.3} ms");
        for (parameter, _) in CONTROLLER_PARAMETERS {
            result.refuse(parameter, reason.as_str(), &remedies.cycle);
        }
        return found;
    }
    left_out(&others, "it has no moving set-point at the position cycle", "its controllers", result);
    let records = records.as_slice();
    velocity_feedforward(&switched_on(records, |record| &record.velocity_feedforward_lu_s), &mut found, result);
    torque_feedforward(&switched_on(records, |record| &record.torque_feedforward_n_m), data, &mut found, result);
    setpoint_delay(records, &mut found, result);
    position_gain(records, data, &mut found, result);
    lags(records, axis, result);
    found
}

/// Says which traces are not used for something, and why.
pub(super) fn left_out(records: &[AxisRecord], why: &str, of: &str, result: &mut AxisResult) {
    for record in records {
        result.verdicts.push(format!("`{}` is left out for {of}: {why}", record.trace));
    }
}

const CONTROLLER_PARAMETERS: [(Parameter, ()); 5] = [
    (Parameter::PositionGain, ()),
    (Parameter::VelocityFeedforward, ()),
    (Parameter::TorqueFeedforward, ()),
    (Parameter::SetpointDelay, ()),
    (Parameter::FeedforwardDelay, ()),
];

struct Remedies {
    setpoint: String,
    move_it: String,
    cycle: String,
}

impl Remedies {
    fn of(cycle_s: f64) -> Self {
        Self {
            setpoint: "record the position set-point (Operate: CmdPos2ndEnc; Edge: DES_POS)".to_owned(),
            move_it: "record a program that moves this axis (`sollwert identify --plan`)".to_owned(),
            cycle: format!(
                "trace at the position cycle ({:.3} ms), or give the right position_cycle_ms with -m",
                cycle_s * MS_PER_S
            ),
        }
    }
}

/// Whether any set-point moves.
fn moves(records: &[AxisRecord]) -> bool {
    records.iter().filter_map(|record| record.setpoint_lu.as_ref()).any(|setpoint| {
        let finite = || setpoint.iter().copied().filter(|value| value.is_finite());
        finite().fold(f64::NEG_INFINITY, f64::max) > finite().fold(f64::INFINITY, f64::min)
    })
}

fn velocity_feedforward(records: &[AxisRecord], found: &mut Vec<Estimate>, result: &mut AxisResult) {
    const RECORD: &str =
        "record the velocity feed-forward (Edge: VEL_FFW), or the output of the position controller with its deviation";
    if !have(records, |record| &record.velocity_feedforward_lu_s) {
        return; // `position_gain` may find it together with Kv.
    }
    if largest(records, |record| &record.velocity_feedforward_lu_s) == 0.0 {
        found.push(Estimate::around(Parameter::VelocityFeedforward, 0.0, 0.0, Means::Lags));
        let reason = "the velocity feed-forward is off in this trace: nothing is delayed";
        result.refuse(Parameter::FeedforwardDelay, reason, "record with FFWON");
        return;
    }
    let response = |record: &AxisRecord, k: usize, _| at(&record.velocity_feedforward_lu_s, k);
    let regressors = |record: &AxisRecord, k: usize, n: usize| two_lags(record, k, n, raw_velocity);
    let Some(lagged) =
        best_lag(records, response, regressors).filter(|lagged| fits(lagged, "velocity feed-forward", result))
    else {
        for parameter in [Parameter::VelocityFeedforward, Parameter::FeedforwardDelay] {
            result.refuse(parameter, "the velocity feed-forward is not a delayed speed of the set-point: a filter of the set-point stands in front", RECORD);
        }
        return;
    };
    gain_and_delay(&lagged, records[0].period_s, Parameter::VelocityFeedforward, 1.0, found, result);
}

/// The two lags of a signal of the set-point.
fn two_lags(record: &AxisRecord, k: usize, n: usize, signal: fn(&AxisRecord, usize) -> f64) -> [f64; 2] {
    [k - n, k - n - 1].map(|k| signal(record, k))
}

/// Whether the law is exact but for rounding and noise.
fn fits(lagged: &Lagged, what: &str, result: &mut AxisResult) -> bool {
    let share = lagged.left_over_share;
    if share > LEFT_OVER_SHARE {
        let percent = percent_from_ratio(share);
        result.verdicts.push(format!("{what}: two lags of the set-point leave {percent:.1} % over"));
    }
    share <= LEFT_OVER_SHARE
}

/// Sum of two lags, and their centre of mass as a delay.
fn gain_and_delay(
    lagged: &Lagged,
    period_s: f64,
    gain: Parameter,
    scale: f64,
    found: &mut Vec<Estimate>,
    result: &mut AxisResult,
) {
    let (value, half) = lagged.solution.function(0, |theta| theta[0] + theta[1]);
    found.push(Estimate::around(gain, value, half, Means::Lags).scaled(scale));
    if value.abs() <= half {
        let reason = "the feed-forward is as good as none in this trace: nothing is delayed";
        result.refuse(Parameter::FeedforwardDelay, reason, "record with FFWON");
        return;
    }
    if found.iter().all(|known| known.parameter != Parameter::FeedforwardDelay) {
        let lag = lagged.n as f64;
        let (share, half) = lagged.solution.function(1, |theta| theta[1] / (theta[0] + theta[1]));
        // No delay is negative: a share of -1e-12 is none.
        let delay = Estimate::around(Parameter::FeedforwardDelay, (lag + share).max(0.0), half, Means::Lags);
        found.push(delay.scaled(period_s));
    }
}

fn torque_feedforward(records: &[AxisRecord], data: &DriveData, found: &mut Vec<Estimate>, result: &mut AxisResult) {
    const RECORD: &str = "record the torque feed-forward (Edge: TORQUE_FFW) with FFWON";
    if !have(records, |record| &record.torque_feedforward_n_m) {
        result.refuse(Parameter::TorqueFeedforward, "the trace has no torque feed-forward", RECORD);
        return;
    }
    if largest(records, |record| &record.torque_feedforward_n_m) == 0.0 {
        found.push(Estimate::around(Parameter::TorqueFeedforward, 0.0, 0.0, Means::Lags));
        return;
    }
    let response = |record: &AxisRecord, k: usize, _| at(&record.torque_feedforward_n_m, k);
    let regressors = |record: &AxisRecord, k: usize, n: usize| two_lags(record, k, n, raw_acceleration);
    let inertia = data.feedforward_inertia_kg_m2;
    match best_lag(records, response, regressors).filter(|lagged| fits(lagged, "torque feed-forward", result)) {
        Some(lagged) if inertia > 0.0 => {
            let scale = data.mechanics.transmission_lu_per_rad / inertia;
            gain_and_delay(&lagged, records[0].period_s, Parameter::TorqueFeedforward, scale, found, result);
            result.verdicts.push(format!(
                "torque feed-forward: the trace tells weight times inertia; the weight is given for the inertia {inertia} of the machine file"
            ));
        }
        Some(_) => result.refuse(
            Parameter::TorqueFeedforward,
            "the machine file gives no inertia for it: only their product is in the trace",
            "give drive.feedforward_inertia_kg_m2 (MD32650)",
        ),
        None => result.refuse(
            Parameter::TorqueFeedforward,
            "the torque feed-forward is not a delayed acceleration of the set-point: a filter of the set-point stands in front",
            RECORD,
        ),
    }
}

/// A set-point delay whose interval is wider to each side is none.
const DELAY_WIDE_CYCLES: f64 = 0.5;

fn setpoint_delay(records: &[AxisRecord], found: &mut Vec<Estimate>, result: &mut AxisResult) {
    if !have(records, |record| &record.reference_lu) {
        result.refuse(
            Parameter::SetpointDelay,
            "from position alone the delay and the velocity feed-forward are one number: only kvff - Kv d_pos is in the motion",
            "record the control deviation (Operate: CtrlDev; Edge: CTRL_DIFF) or the position behind the balancing (Edge: CTRL_POS)",
        );
        return;
    }
    let setpoint = |record: &AxisRecord, k: usize| at(&record.setpoint_lu, k);
    let response = |record: &AxisRecord, k: usize, n: usize| at(&record.reference_lu, k) - setpoint(record, k - n);
    let regressors =
        |record: &AxisRecord, k: usize, n: usize| [setpoint(record, k - n) - setpoint(record, k - n - 1), 1.0];
    let Some(lagged) = best_lag(records, response, regressors) else {
        result.refuse(
            Parameter::SetpointDelay,
            "the set-point does not move enough",
            "record a program that moves this axis",
        );
        return;
    };
    let step = rms_step(records);
    let (share, half) = lagged.solution.function(0, |theta| -theta[0]);
    let period_s = records[0].period_s;
    if half > DELAY_WIDE_CYCLES {
        let reason =
            format!("the reference hardly follows the set-point: the delay is known to ±{half:.1} cycles only");
        result.refuse(Parameter::SetpointDelay, reason, "record a longer motion with the control deviation");
        return;
    }
    let delay = Estimate::around(Parameter::SetpointDelay, (lagged.n as f64 + share).max(0.0), half, Means::Lags);
    found.push(delay.scaled(period_s));
    // What a wrong shape leaves over is some share of the way of a cycle.
    if lagged.solution.rms > 0.1 * step {
        let percent = percent_from_ratio(lagged.solution.rms / step);
        result.verdicts.push(format!(
            "the reference is not the set-point delayed: {percent:.0} % of the way of a cycle is left over, as a filter of the set-point or \
             a balancing of first order (feedforward_balancing = \"pt1\") leaves it; the delay given is the best dead time"
        ));
    }
}

/// RMS of the way of the set-point in a cycle.
fn rms_step(records: &[AxisRecord]) -> f64 {
    let steps =
        records.iter().flat_map(|record| (1..record.count).map(move |k| raw_velocity(record, k) * record.period_s));
    let (mut square, mut count) = (0.0, 0.0);
    for step in steps.filter(|step| step.is_finite() && *step != 0.0) {
        square += step * step;
        count += 1.0;
    }
    (square / f64::max(count, 1.0)).sqrt()
}

fn position_gain(records: &[AxisRecord], data: &DriveData, found: &mut Vec<Estimate>, result: &mut AxisResult) {
    const RECORD: &str = "record the output of the position controller (velocity command, or the speed set-point of the drive) with the control deviation";
    let with_command = have(records, |record| &record.velocity_command_lu_s);
    let with_deviation = have(records, |record| &record.deviation_lu);
    let with_feedforward = have(records, |record| &record.velocity_feedforward_lu_s);
    if !(with_command && with_deviation) {
        let missing = match (with_command, with_deviation) {
            (false, false) => "the trace has neither the control deviation nor the output of the position controller",
            (false, true) => "the trace has no output of the position controller",
            _ => "the trace has no control deviation",
        };
        result.refuse(Parameter::PositionGain, missing, RECORD);
        if !with_feedforward {
            for parameter in [Parameter::VelocityFeedforward, Parameter::FeedforwardDelay] {
                result.refuse(
                    parameter,
                    "the trace has no velocity feed-forward, and from position alone it is not told from the set-point delay",
                    "record the velocity feed-forward (Edge: VEL_FFW), or the output of the position controller with its deviation",
                );
            }
        }
        return;
    }
    let clamp_lu_s = 0.999 * data.speed_setpoint_max_lu_s;
    let command = |record: &AxisRecord, k: usize| {
        let value = at(&record.velocity_command_lu_s, k);
        if value.abs() < clamp_lu_s { value } else { f64::NAN }
    };
    if with_feedforward {
        let mut blocks = Blocks::new(1);
        for record in records {
            let per_block = ((BLOCK_S / record.period_s).round() as usize).max(1);
            for k in 0..record.count {
                let (e, y) =
                    (at(&record.deviation_lu, k), command(record, k) - at(&record.velocity_feedforward_lu_s, k));
                if e.is_finite() && y.is_finite() {
                    blocks.push_in(k / per_block, &[e], y);
                }
            }
            blocks.close();
        }
        push_gain(blocks.solve(&[0]).as_ref(), found, result);
        return;
    }
    let response = |record: &AxisRecord, k: usize, _| command(record, k);
    let regressors = |record: &AxisRecord, k: usize, n: usize| {
        let [newer, older] = [k - n, k - n - 1].map(|k| raw_velocity(record, k));
        [newer, older, at(&record.deviation_lu, k)]
    };
    let lagged = best_lag(records, response, regressors);
    if let Some(lagged) = &lagged {
        gain_and_delay(lagged, records[0].period_s, Parameter::VelocityFeedforward, 1.0, found, result);
        let mut solution = lagged.solution.clone();
        // The gain stands in the third column here.
        solution.theta = solution.theta.rows(2, 1).into_owned();
        solution.without.iter_mut().for_each(|theta| *theta = theta.rows(2, 1).into_owned());
        solution.stretches = solution.stretches.split_off(2);
        push_gain(Some(&solution), found, result);
    } else {
        push_gain(None, found, result);
    }
}

fn push_gain(solution: Option<&Solution>, found: &mut Vec<Estimate>, result: &mut AxisResult) {
    let estimate = solution.map(|solution| {
        let (value, half) = solution.value(0);
        Estimate::around(Parameter::PositionGain, value, half, Means::ControlLaw)
    });
    match estimate {
        Some(estimate) if estimate.value > 0.0 && estimate.half() < 0.3 * estimate.value => found.push(estimate),
        _ => result.refuse(
            Parameter::PositionGain,
            "the deviation hardly moves the output of the position controller in this trace",
            "record jerk-limited moves, or some of them with FFWOF",
        ),
    }
}

/// The whole lag at constant speed, and the filter of the set-point where the trace shows it.
fn lags(records: &[AxisRecord], axis: &Axis, result: &mut AxisResult) {
    if have(records, |record| &record.filtered_velocity_lu_s) {
        let response = |record: &AxisRecord, k: usize| at(&record.filtered_velocity_lu_s, k);
        // A difference of two set-points is half a cycle late itself; what is no later than that is no filter.
        let late = |(gain, taps_s, share): (f64, f64, f64)| (gain, taps_s + records[0].period_s / 2.0, share);
        let filter = taps(records, response).map(late).filter(|filter| filter.1 > FILTER_MIN_S);
        if let Some((gain, delay_s, share)) = filter {
            result.figures.push(Figure {
                key: "setpoint_filter_delay_ms",
                title: "delay of the set-point speed at the controller's input behind the set-point (a filter)"
                    .to_owned(),
                value: delay_s * MS_PER_S,
                unit: "ms",
            });
            result.verdicts.push(format!(
                "the set-point speed at the input of the controller is the speed of the set-point behind a filter of {:.2} ms and gain {gain:.4} \
                 (left over: {:.2} %): part of the lag is that filter, and no position gain",
                delay_s * MS_PER_S,
                percent_from_ratio(share)
            ));
        }
    }
    let following = |record: &AxisRecord, k: usize| match (&record.following_lu, &record.position_lu) {
        (Some(_), _) => at(&record.following_lu, k),
        (None, Some(_)) if !axis.modulo => at(&record.setpoint_lu, k) - at(&record.position_lu, k),
        _ => f64::NAN,
    };
    let mut blocks = Blocks::new(3);
    for record in records {
        for k in 2..record.count {
            let (v, a, e) = (raw_velocity(record, k), raw_acceleration(record, k), following(record, k));
            if v.is_finite() && a.is_finite() && e.is_finite() {
                blocks.push_in(k / 256, &[v, a, 1.0], e);
            }
        }
        blocks.close();
    }
    if let Some(solution) = blocks.solve(&[0, 1, 2]) {
        let title = "lag of the position behind the set-point at constant speed: (1 - kvff)/Kv and all delays together";
        let value = solution.theta[0] * MS_PER_S;
        result.figures.push(Figure { key: "position_lag_ms", title: title.to_owned(), value, unit: "ms" });
    }
}

/// A shorter delay is none.
const FILTER_MIN_S: f64 = 5e-5;

/// A filter of the set-point speed as taps: gain, mean delay, share left over.
fn taps(records: &[AxisRecord], response: impl Fn(&AxisRecord, usize) -> f64) -> Option<(f64, f64, f64)> {
    let period_s = records.first()?.period_s;
    let mut blocks = Blocks::new(TAPS);
    let mut square = 0.0;
    for record in records {
        for k in TAPS..record.count {
            let row: [f64; TAPS] = std::array::from_fn(|lag| raw_velocity(record, k - lag));
            let y = response(record, k);
            if y.is_finite() && row.iter().all(|value| value.is_finite()) {
                blocks.push_in(k / 512, &row, y);
                square += y * y;
            }
        }
        blocks.close();
    }
    let columns: Vec<usize> = (0..TAPS).collect();
    let solution = blocks.solve(&columns)?;
    let gain: f64 = solution.theta.iter().sum();
    let moment: f64 = solution.theta.iter().enumerate().map(|(lag, tap)| lag as f64 * tap).sum();
    let share = (blocks.residual_square(&columns, &solution.theta) / square).sqrt();
    (gain.abs() > 0.1 && share < 0.05).then_some((gain, moment / gain * period_s, share))
}
