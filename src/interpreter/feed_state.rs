//! What feed, spindle and positioning words have said: modal state.
//!
//! In: words, as `feed_words` and `positioning` hand them over. Out: [`FeedModes`]. No positions and no motion here.

use super::modal::ProgrammedFeed;
use crate::base::PerAxis;
use crate::base::units::{RAD_PER_REV, S_PER_MIN};
use crate::program::words::{FeedShape, FeedType};
use std::collections::BTreeMap;

/// Highest speed that is reckoned with where the cutting speed asks for more and neither LIMS nor G26 bounds it: near the axis of
/// rotation it would grow beyond all numbers.
const SPINDLE_SPEED_MAX_RPM: f64 = 100_000.0;

/// The spindle that the machine file describes.
pub const SIMULATED_SPINDLE: u32 = 1;

/// Unit of F.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum FeedBase {
    /// mm/min, deg/min: G94 and its kin.
    #[default]
    Minute,
    /// mm or deg a revolution of the spindle: G95 and its kin.
    Revolution,
    /// G93: 1/min, the inverse of the time of the block.
    InverseTime,
    /// G931: s, the time of the block.
    Time,
}

/// Modal state of feed, spindle and positioning axes.
#[derive(Clone, Debug)]
pub struct FeedModes {
    /// G function of group 15.
    pub feed_type: FeedType,
    /// Unit of F.
    pub base: FeedBase,
    /// G93, G931: time of a block by the last F.
    pub last_time_s: Option<f64>,
    /// FNORM, FLIN, FCUB.
    pub shape: FeedShape,
    /// F with which the last motion ended: where FLIN and FCUB begin.
    pub before: Option<ProgrammedFeed>,
    /// G96 and its kin: cutting speed; `None`: the spindle speed is constant.
    pub cutting_speed_mm_s: Option<f64>,
    /// G96 is on, with or without S.
    pub cutting: bool,
    /// LIMS.
    pub cutting_limit_rpm: Option<f64>,
    /// G25 S and G26 S.
    pub spindle_limits_rpm: [Option<f64>; 2],
    /// M3 or M4 was output last, and no M5.
    pub spindle_turns: bool,
    /// OVRA of the simulated spindle, and the switch of the control panel.
    pub spindle_override_ratio: [f64; 2],
    /// Highest speed of the simulated spindle (MD35100), and its share by VELOLIM.
    pub spindle_max_rpm: Option<f64>,
    /// VELOLIM of the simulated spindle.
    pub spindle_max_ratio: f64,
    /// SETMS.
    pub master_spindle: u32,
    /// The spindles that are not the master spindle: speed, and whether they turn.
    pub other_spindles: BTreeMap<u32, (f64, bool)>,
    /// RTLIOF.
    pub rapid_by_axis: bool,
    /// FA.
    pub positioning_feed_lu_s: PerAxis<Option<f64>>,
    /// OVRA.
    pub positioning_override_ratio: PerAxis<f64>,
    /// BRISKA, DRIVEA: no limit of jerk.
    pub positioning_brisk: PerAxis<bool>,
    /// POSA: still on their way, as far as the interpreter knows.
    pub positioning: PerAxis<bool>,
    /// Nothing above asks for more than a look at F: the fast path may be taken.
    pub plain: bool,
}

impl Default for FeedModes {
    fn default() -> Self {
        Self {
            feed_type: FeedType::PerMinute,
            base: FeedBase::Minute,
            last_time_s: None,
            shape: FeedShape::Constant,
            before: None,
            cutting_speed_mm_s: None,
            cutting: false,
            cutting_limit_rpm: None,
            spindle_limits_rpm: [None; 2],
            spindle_turns: false,
            spindle_override_ratio: [1.0; 2],
            spindle_max_rpm: None,
            spindle_max_ratio: 1.0,
            master_spindle: SIMULATED_SPINDLE,
            other_spindles: BTreeMap::new(),
            rapid_by_axis: false,
            positioning_feed_lu_s: PerAxis::splat(None),
            positioning_override_ratio: PerAxis::splat(1.0),
            positioning_brisk: PerAxis::splat(false),
            positioning: PerAxis::splat(false),
            plain: true,
        }
    }
}

impl FeedModes {
    /// After a change of anything that `plain` depends on.
    pub fn note_plain(&mut self) {
        let stands = self.positioning.as_slice().iter().all(|moves| !moves);
        self.plain = self.base == FeedBase::Minute
            && self.shape == FeedShape::Constant
            && !self.rapid_by_axis
            && stands
            && !self.cutting;
    }

    /// G function of group 15: unit of F, and whether the cutting speed is constant. "As before" keeps the unit of F, mm/min where it
    /// was a time.
    pub fn select(&mut self, feed_type: FeedType) {
        self.feed_type = feed_type;
        let kept = if self.base == FeedBase::Revolution { FeedBase::Revolution } else { FeedBase::Minute };
        (self.base, self.cutting) = match feed_type {
            FeedType::InverseTime => (FeedBase::InverseTime, false),
            FeedType::Time => (FeedBase::Time, false),
            FeedType::PerMinute | FeedType::PerMinuteKept | FeedType::SpeedPerMinute => (FeedBase::Minute, false),
            FeedType::PerRevolution
            | FeedType::PerRevolutionKept
            | FeedType::SpeedPerRevolution
            | FeedType::SpeedPerRevolutionFree => (FeedBase::Revolution, false),
            FeedType::CuttingSpeedPerRevolution => (FeedBase::Revolution, true),
            FeedType::CuttingSpeedPerMinute => (FeedBase::Minute, true),
            FeedType::CuttingSpeed => (kept, true),
            FeedType::Speed => (kept, false),
        };
        self.note_plain();
    }

    /// The speed that the master spindle gets for an S: with the overrides, within G25 S, G26 S and the limit of the machine.
    pub fn limited_rpm(&self, speed_rpm: f64) -> f64 {
        self.within_limits_rpm(speed_rpm * self.override_ratio())
    }

    /// The same where the overrides do not act: tapping.
    pub fn within_limits_rpm(&self, speed_rpm: f64) -> f64 {
        let [low_rpm, high_rpm] = self.spindle_limits_rpm;
        let raised_rpm = if speed_rpm > 0.0 { speed_rpm.max(low_rpm.unwrap_or(0.0)) } else { speed_rpm };
        raised_rpm.min(high_rpm.unwrap_or(f64::INFINITY)).min(self.highest_rpm().unwrap_or(f64::INFINITY))
    }

    /// The master spindle is the one that the machine file describes.
    pub fn master_is_simulated(&self) -> bool {
        self.master_spindle == SIMULATED_SPINDLE
    }

    /// Of the master spindle.
    pub fn override_ratio(&self) -> f64 {
        if self.master_is_simulated() { self.spindle_override_ratio.iter().product() } else { 1.0 }
    }

    /// What the machine and VELOLIM allow the master spindle.
    pub fn highest_rpm(&self) -> Option<f64> {
        Some(self.spindle_max_rpm? * self.spindle_max_ratio).filter(|_| self.master_is_simulated())
    }

    /// Behind SAVE: what is no G function stays as the sub-program left it.
    pub fn keep_spindles(&mut self, left: Self) {
        self.spindle_turns = left.spindle_turns;
        self.spindle_override_ratio = left.spindle_override_ratio;
        self.spindle_max_ratio = left.spindle_max_ratio;
        self.master_spindle = left.master_spindle;
        self.other_spindles = left.other_spindles;
        self.spindle_limits_rpm = left.spindle_limits_rpm;
        self.cutting_limit_rpm = left.cutting_limit_rpm;
    }

    /// Lowest and highest speed under a constant cutting speed.
    pub fn cutting_limits_rpm(&self) -> [f64; 2] {
        let [low_rpm, high_rpm] = self.spindle_limits_rpm;
        let limit_rpm = self.cutting_limit_rpm.unwrap_or(SPINDLE_SPEED_MAX_RPM).min(SPINDLE_SPEED_MAX_RPM);
        let limit_rpm = limit_rpm.min(self.highest_rpm().unwrap_or(f64::INFINITY));
        [low_rpm.unwrap_or(0.0), high_rpm.unwrap_or(f64::INFINITY).min(limit_rpm)]
    }

    /// Speed of the master spindle where the transverse axis is `radius_mm` from the axis of rotation: S = v / (2 pi r), at most LIMS.
    pub fn cutting_rpm(&self, cutting_speed_mm_s: f64, radius_mm: f64) -> f64 {
        let speed_rpm = cutting_speed_mm_s / (RAD_PER_REV * radius_mm.abs()) * S_PER_MIN;
        let limit_rpm = self.cutting_limit_rpm.unwrap_or(SPINDLE_SPEED_MAX_RPM);
        self.limited_rpm(speed_rpm.min(SPINDLE_SPEED_MAX_RPM)).min(limit_rpm)
    }
}
