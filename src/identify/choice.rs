//! Which traces the mechanics of an axis rest on, where several are given.
//!
//! In: records of all traces. Out: those that are used, and why each of the others is not: one without torque or position, a sampled current beside means, one
//! that nothing can mend, one that the law of the others does not explain (another axis on the wire, the sign of the torque, an axis that something else moves).
//! A single trace is always used: what is wrong with it is for `friction` to say. Does not weigh traces.

use super::friction::unexplained;
use super::motion::Motion;
use super::record::AxisRecord;
use super::wire::TorqueSource;
use crate::base::AxisKind;

/// Records that are used with their motions, and the others with the reason.
pub(super) struct Chosen {
    pub(super) records: Vec<AxisRecord>,
    pub(super) motions: Vec<Motion>,
    pub(super) others: Vec<(AxisRecord, &'static str)>,
    /// The best source of the torque; `None` where no trace has one.
    pub(super) source: Option<TorqueSource>,
}

impl Chosen {
    /// Keeps what `holds`, if anything does.
    fn keep(&mut self, why: &'static str, holds: impl Fn(&AxisRecord) -> bool) {
        if self.records.iter().any(&holds) {
            let (kept, others): (Vec<AxisRecord>, Vec<AxisRecord>) = self.records.drain(..).partition(holds);
            self.records = kept;
            self.others.extend(others.into_iter().map(|record| (record, why)));
        }
    }
}

fn folded(record: &AxisRecord) -> Option<bool> {
    record.torque.as_ref().map(|torque| torque.source.is_folded())
}

fn rank(source: &TorqueSource) -> u8 {
    match source {
        TorqueSource::MeanCurrent => 0,
        TorqueSource::FineCurrent => 1,
        TorqueSource::Current => 2,
        TorqueSource::TorqueReference => 3,
    }
}

/// Chooses; `cycle_s` is the position cycle, `r` the transmission.
pub(super) fn chosen(records: &[AxisRecord], r: f64, kind: AxisKind, cycle_s: f64) -> Chosen {
    let mut chosen = Chosen { records: records.to_vec(), motions: Vec::new(), others: Vec::new(), source: None };
    let both = |record: &AxisRecord| record.torque.is_some() && record.position_lu.is_some();
    chosen.keep("it has no torque together with a position", both);
    let sources = chosen.records.iter().filter_map(|record| record.torque.as_ref()).map(|torque| torque.source);
    chosen.source = sources.min_by_key(rank);
    // Samples and means are not mixed: the best source of all traces counts.
    let best = chosen.source.map(TorqueSource::is_folded);
    chosen.keep("another trace has the mean of the current, this one samples", |record| folded(record) == best);
    if best == Some(true) {
        let mended =
            |record: &AxisRecord| record.setpoint_lu.is_some() && (record.period_s / cycle_s - 1.0).abs() < 1e-3;
        chosen.keep("without set-points at the position cycle samples of the current cannot be mended", mended);
    }
    let motions: Vec<Option<Motion>> = chosen.records.iter().map(|record| Motion::of(record, r)).collect();
    if motions.iter().all(Option::is_some) {
        let motions: Vec<Motion> = motions.into_iter().flatten().collect();
        let strange = unexplained(&motions, kind == AxisKind::Rotary);
        for ((record, motion), strange) in chosen.records.drain(..).zip(motions).zip(strange).collect::<Vec<_>>() {
            if strange {
                chosen.others.push((record, "a quarter of its torque and more is not what the other traces say"));
            } else {
                chosen.records.push(record);
                chosen.motions.push(motion);
            }
        }
    }
    chosen
}
