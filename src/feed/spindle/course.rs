//! The motion of the master spindle over time: stretches of constant acceleration.
//!
//! In: a speed or a position to go to, and from when on. Out: the [`SpindlePhase`]s from there, the last of which goes on for ever. To a speed: one ramp.
//! To a position: a ramp to the speed of positioning in the sense in which it turns, on at that speed until what is left to the angle is the
//! way of braking, and brake; from rest a way from rest to rest. Without an acceleration all of it takes no time.
//! Does not know words, and no jerk: ramps of a spindle on the control have none.

use crate::feed::SpindlePhase;
use crate::interpreter::SpindleApproach;
use crate::machine::SpindleSettings;
use std::f64::consts::{PI, TAU};

/// Speeds below this share of that of positioning are rest.
const REST_RATIO: f64 = 1e-9;

/// Changes of the acceleration over one piece, at most.
const STEPS_MAX: f64 = 200_000.0;

/// Where the spindle is and will be.
#[derive(Clone, Debug)]
pub(super) struct Course {
    /// Times since the start of the program; never empty.
    phases: Vec<SpindlePhase>,
}

/// A position to go to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub angle_rad: f64,
    pub approach: SpindleApproach,
}

impl Course {
    /// At rest at 0.
    pub fn new() -> Self {
        Self { phases: vec![SpindlePhase::default()] }
    }

    /// All phases, times since the start of the program.
    pub fn phases(&self) -> &[SpindlePhase] {
        &self.phases
    }

    /// State at a time.
    pub fn at(&self, time_s: f64) -> SpindlePhase {
        SpindlePhase::of(&self.phases, time_s)
    }

    /// When it has come to the speed at which it stays.
    pub fn settled_s(&self) -> f64 {
        self.phases.last().map_or(0.0, |last| last.from_s)
    }

    /// At rest at an angle from then on.
    pub fn rest(&mut self, time_s: f64, angle_rad: f64) {
        self.phases = vec![SpindlePhase { from_s: time_s, angle_rad, ..SpindlePhase::default() }];
    }

    /// To a speed.
    pub fn turn(&mut self, time_s: f64, speed_rad_s: f64, acceleration_rad_s2: Option<f64>) {
        let now = self.at(time_s);
        self.phases = vec![SpindlePhase { acceleration_rad_s2: 0.0, ..now }];
        self.ramp(speed_rad_s, acceleration_rad_s2);
    }

    /// Along a speed that changes, from the start of a piece to its end.
    pub fn track(
        &mut self,
        start_s: f64,
        duration_s: f64,
        period_s: f64,
        limit_rad_s2: Option<f64>,
        wanted_rad_s: impl Fn(f64) -> f64,
    ) -> f64 {
        let steps = (duration_s / period_s).ceil().clamp(1.0, STEPS_MAX) as u32;
        let step_s = duration_s / f64::from(steps);
        let most_rad_s = limit_rad_s2.map_or(f64::INFINITY, |limit| limit * step_s);
        let mut now = SpindlePhase { acceleration_rad_s2: 0.0, ..self.at(start_s) };
        let mut off_share = 0.0_f64;
        self.phases.clear();
        for step in 1..=steps {
            let wanted = wanted_rad_s(f64::from(step) * step_s);
            let change_rad_s = (wanted - now.speed_rad_s).clamp(-most_rad_s, most_rad_s);
            now.acceleration_rad_s2 = change_rad_s / step_s;
            self.phases.push(now);
            now = SpindlePhase { acceleration_rad_s2: 0.0, ..now.at(start_s + f64::from(step) * step_s) };
            off_share = off_share.max((now.speed_rad_s / wanted - 1.0).abs());
        }
        self.phases.push(now);
        off_share
    }

    /// To a speed, behind all that is planned.
    pub fn turn_behind(&mut self, speed_rad_s: f64, acceleration_rad_s2: Option<f64>) {
        if acceleration_rad_s2.is_some() {
            self.ramp(speed_rad_s, acceleration_rad_s2);
        }
    }

    /// To a position.
    pub fn position(&mut self, time_s: f64, target: Target, settings: Option<&SpindleSettings>) {
        let now = self.at(time_s);
        let Some(settings) = settings else {
            let way_rad =
                if now.speed_rad_s == 0.0 { way_from_rest(now.angle_rad, target) } else { onward(&now, target) };
            return self.rest(time_s, now.angle_rad + way_rad);
        };
        let SpindleSettings { acceleration_rad_s2: a, positioning_speed_rad_s: v, .. } = *settings;
        let brake_a = settings.positioning_acceleration_rad_s2;
        self.phases = vec![SpindlePhase { acceleration_rad_s2: 0.0, ..now }];
        let sense = now.speed_rad_s.signum();
        let turns = now.speed_rad_s.abs() > REST_RATIO * v;
        let goes_on = match target.approach {
            SpindleApproach::Onward => true,
            SpindleApproach::Positive => sense > 0.0,
            SpindleApproach::Negative => sense < 0.0,
            SpindleApproach::By => false,
        };
        if !(turns && goes_on) {
            if turns {
                self.ramp(0.0, Some(a));
            }
            return self.way(target, v, brake_a);
        }
        self.ramp(sense * v, Some(a));
        let cruising = self.last();
        let braking_rad = v * v / (2.0 * brake_a);
        let to_angle_rad = (sense * (target.angle_rad - cruising.angle_rad) - braking_rad).rem_euclid(TAU);
        let end_rad = cruising.angle_rad + sense * (to_angle_rad + braking_rad);
        self.brake(to_angle_rad / v, brake_a, end_rad);
    }

    /// From rest to rest.
    fn way(&mut self, target: Target, v: f64, a: f64) {
        let start = self.last();
        let way_rad = way_from_rest(start.angle_rad, target);
        let (sense, length_rad) = (way_rad.signum(), way_rad.abs());
        if length_rad == 0.0 {
            return;
        }
        let peak = (a * length_rad).sqrt().min(v);
        self.ramp(sense * peak, Some(a));
        let cruise_rad = length_rad - peak * peak / a;
        self.brake(cruise_rad.max(0.0) / peak, a, start.angle_rad + way_rad);
    }

    /// On for a time, and then to rest, at exactly `end_rad`.
    fn brake(&mut self, cruise_s: f64, a: f64, end_rad: f64) {
        let last = self.last();
        let braking = last.at(last.from_s + cruise_s);
        let sense = last.speed_rad_s.signum();
        self.phases.push(SpindlePhase { acceleration_rad_s2: -sense * a, ..braking });
        let from_s = braking.from_s + last.speed_rad_s.abs() / a;
        self.phases.push(SpindlePhase { from_s, angle_rad: end_rad, ..SpindlePhase::default() });
    }

    /// A change of speed behind the last phase.
    fn ramp(&mut self, speed_rad_s: f64, acceleration_rad_s2: Option<f64>) {
        let start = self.last();
        let step_rad_s = speed_rad_s - start.speed_rad_s;
        if step_rad_s == 0.0 {
            return;
        }
        let Some(a) = acceleration_rad_s2 else {
            self.phases = vec![SpindlePhase { speed_rad_s, acceleration_rad_s2: 0.0, ..start }];
            return;
        };
        if let Some(last) = self.phases.last_mut() {
            last.acceleration_rad_s2 = a * step_rad_s.signum();
        }
        let time_s = step_rad_s.abs() / a;
        let angle_rad = start.angle_rad + (start.speed_rad_s + speed_rad_s) / 2.0 * time_s;
        let from_s = start.from_s + time_s;
        self.phases.push(SpindlePhase { from_s, angle_rad, speed_rad_s, acceleration_rad_s2: 0.0 });
    }

    fn last(&self) -> SpindlePhase {
        self.phases.last().copied().unwrap_or_default()
    }
}

/// From rest: the shorter way, or as asked for.
fn way_from_rest(angle_rad: f64, target: Target) -> f64 {
    let forward_rad = (target.angle_rad - angle_rad).rem_euclid(TAU);
    match target.approach {
        SpindleApproach::By => target.angle_rad,
        SpindleApproach::Positive => forward_rad,
        SpindleApproach::Negative => -(angle_rad - target.angle_rad).rem_euclid(TAU),
        SpindleApproach::Onward if forward_rad > PI => forward_rad - TAU,
        SpindleApproach::Onward => forward_rad,
    }
}

/// Without an acceleration: the next time that it passes the angle.
fn onward(now: &SpindlePhase, target: Target) -> f64 {
    let sense = match target.approach {
        SpindleApproach::By => return target.angle_rad,
        SpindleApproach::Positive => 1.0,
        SpindleApproach::Negative => -1.0,
        SpindleApproach::Onward => now.speed_rad_s.signum(),
    };
    sense * (sense * (target.angle_rad - now.angle_rad)).rem_euclid(TAU)
}
