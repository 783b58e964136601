//! Where the master spindle turns, and how long the path waits for it.
//!
//! In: `[spindle]` of the machine file, the events of pieces when they are pushed and when they begin. Out: whether the path must rest before a piece, when
//! the spindle is near its speed or at its position, its motion for the interpolator. As on the control a feed waits only after a change of the speed that
//! is programmed, and only where it begins: a spindle that slows down under load stops nothing. M5 is waited for where the machine file says so.
//! Does not know feeds a revolution: `ramping_feed` makes them follow the ramp.

mod course;

use super::planner::Ramp;
use super::{SpindleMotion, SpindlePhase};
use crate::base::units::rad_s_from_rpm;
use crate::interpreter::{Event, SpindlePositioning};
use crate::machine::SpindleSettings;
use course::{Course, Target};

/// M3, M4, M5, M19 and M70: axis mode, in which it stands.
const CLOCKWISE: u32 = 3;
const COUNTER_CLOCKWISE: u32 = 4;
const STOP: u32 = 5;
const POSITION: u32 = 19;
const AXIS_MODE: u32 = 70;

/// What S and M say.
#[derive(Clone, Copy, Debug, Default)]
struct Words {
    speed_rad_s: f64,
    sense_ratio: f64,
}

/// The master spindle.
#[derive(Clone, Debug)]
pub(super) struct Spindle {
    /// `None`: it is at its speed and position at once.
    settings: Option<SpindleSettings>,
    /// Accelerations of the machine, without ACC.
    accelerations_rad_s2: [f64; 2],
    /// Of the pieces that were pushed.
    pushed: Words,
    /// A change that no feed has waited for yet was pushed.
    changed: bool,
    /// Of the pieces that have begun.
    begun: Words,
    course: Course,
    /// When it is near the speed, or at the position, that was asked for last.
    ready_s: f64,
    /// The motion has changed since it was handed out.
    fresh: bool,
}

impl Words {
    fn target_rad_s(&self) -> f64 {
        self.sense_ratio * self.speed_rad_s
    }

    /// True if the speed that they ask for is another one than before.
    fn take(&mut self, events: &[Event]) -> bool {
        let before_rad_s = self.target_rad_s();
        for event in events {
            match event {
                Event::SpindleSpeed { speed_rpm } => self.speed_rad_s = rad_s_from_rpm(*speed_rpm),
                Event::MFunction(CLOCKWISE) => self.sense_ratio = 1.0,
                Event::MFunction(COUNTER_CLOCKWISE) => self.sense_ratio = -1.0,
                Event::MFunction(STOP | POSITION | AXIS_MODE) | Event::SpindlePosition(_) => self.sense_ratio = 0.0,
                _ => {}
            }
        }
        self.target_rad_s() != before_rad_s
    }
}

impl Spindle {
    /// At rest.
    pub fn new(settings: Option<SpindleSettings>) -> Self {
        let accelerations = |s: &SpindleSettings| [s.acceleration_rad_s2, s.positioning_acceleration_rad_s2];
        Self {
            settings,
            accelerations_rad_s2: settings.as_ref().map_or([0.0; 2], accelerations),
            pushed: Words::default(),
            changed: false,
            begun: Words::default(),
            course: Course::new(),
            ready_s: 0.0,
            fresh: false,
        }
    }

    /// Events of a piece that is pushed; true if it moves with a feed that has to wait.
    pub fn push(&mut self, events: &[Event], feeds: bool) -> bool {
        if !events.is_empty() {
            self.changed |= self.pushed.take(events);
        }
        let Some(settings) = &self.settings else { return false };
        let waits = self.changed && (settings.waits_for_stop || self.pushed.target_rad_s() != 0.0);
        if feeds {
            self.changed = false;
        }
        feeds && waits
    }

    /// Events of a piece that begins.
    pub fn begin(&mut self, events: &[Event], time_s: f64) {
        if events.is_empty() {
            return;
        }
        self.take_acceleration(events);
        // In their order: M3 behind SPOSA turns it, and not to the position.
        for event in events {
            let changes = self.begun.take(std::slice::from_ref(event));
            if let Event::SpindlePosition(positioning) = event {
                let SpindlePositioning { angle_rad, approach, .. } = **positioning;
                self.course.position(time_s, Target { angle_rad, approach }, self.settings.as_ref());
                (self.ready_s, self.fresh) = (self.course.settled_s(), true);
            } else if changes {
                self.turn(time_s);
            }
        }
    }

    /// ACC of the spindle.
    fn take_acceleration(&mut self, events: &[Event]) {
        let Some(settings) = &mut self.settings else { return };
        for event in events {
            if let Event::SpindleAcceleration { ratio } = event {
                let [speed_control, position_control] = self.accelerations_rad_s2.map(|limit| limit * ratio);
                settings.acceleration_rad_s2 = speed_control;
                settings.positioning_acceleration_rad_s2 = position_control;
            }
        }
    }

    fn turn(&mut self, time_s: f64) {
        let target_rad_s = self.begun.target_rad_s();
        let way_rad_s = (target_rad_s - self.course.at(time_s).speed_rad_s).abs();
        let acceleration_rad_s2 = self.settings.map(|settings| settings.acceleration_rad_s2);
        self.course.turn(time_s, target_rad_s, acceleration_rad_s2);
        self.fresh = true;
        self.ready_s = match &self.settings {
            // What turns the other way has no feed.
            Some(SpindleSettings { starts_at_once: true, acceleration_rad_s2, .. }) if target_rad_s != 0.0 => {
                let speed_rad_s = self.course.at(time_s).speed_rad_s * self.begun.sense_ratio;
                time_s + (-speed_rad_s).max(0.0) / acceleration_rad_s2
            }
            Some(SpindleSettings { acceleration_rad_s2, tolerance_share, .. }) => {
                time_s + (way_rad_s - tolerance_share * target_rad_s.abs()).max(0.0) / acceleration_rad_s2
            }
            None => time_s,
        };
    }

    /// A constant cutting speed over a piece: `target_rad_s` is the speed that is asked for at a time of the piece, positive. Speed and acceleration
    /// change once in `period_s`; the acceleration stays within its limit. The highest share by which the speed is off.
    pub fn track(&mut self, start_s: f64, duration_s: f64, period_s: f64, target_rad_s: impl Fn(f64) -> f64) -> f64 {
        let sense = self.begun.sense_ratio;
        if sense == 0.0 || duration_s <= 0.0 {
            return 0.0;
        }
        let limit_rad_s2 = self.settings.map(|settings| settings.acceleration_rad_s2);
        let wanted = |time_s: f64| sense * target_rad_s(time_s);
        let off_share = self.course.track(start_s, duration_s, period_s, limit_rad_s2, wanted);
        // What G97 keeps, and from where S, M3 and M4 go on.
        self.begun.speed_rad_s = target_rad_s(duration_s);
        self.course.turn_behind(self.begun.target_rad_s(), limit_rad_s2);
        self.fresh = true;
        off_share
    }

    /// When it is near the speed, or at the position, that was asked for last.
    pub fn ready_s(&self) -> f64 {
        self.ready_s
    }

    /// When it has come to the speed at which it stays.
    pub fn settled_s(&self) -> f64 {
        self.course.settled_s()
    }

    /// The ramp that it is in at a time; `None`: it has its speed, stands, or still turns the other way.
    pub fn ramp(&self, time_s: f64) -> Option<Ramp> {
        let now = self.course.at(time_s);
        let target_rad_s = self.begun.target_rad_s();
        if self.course.settled_s() <= time_s || target_rad_s == 0.0 || now.acceleration_rad_s2 == 0.0 {
            return None;
        }
        let speed_rad_s = now.speed_rad_s * self.begun.sense_ratio;
        let acceleration_rad_s2 = now.acceleration_rad_s2.abs();
        let ramp = Ramp { speed_rad_s, target_rad_s: target_rad_s.abs(), acceleration_rad_s2, turned_rad: 0.0 };
        (speed_rad_s >= 0.0 && speed_rad_s != ramp.target_rad_s).then_some(ramp)
    }

    /// State at a time, as far as is known.
    pub fn at(&self, time_s: f64) -> SpindlePhase {
        self.course.at(time_s)
    }

    /// It is led through `way_rad` by the path, and rests from `end_s` on.
    pub fn follow(&mut self, end_s: f64, way_rad: f64) {
        let angle_rad = self.course.at(end_s).angle_rad;
        self.course.rest(end_s, angle_rad + way_rad);
        self.fresh = true;
    }

    /// Highest acceleration while it follows the path; `None`: no limit.
    pub fn following_acceleration_rad_s2(&self) -> Option<f64> {
        self.settings.map(|settings| settings.positioning_acceleration_rad_s2)
    }

    /// Its motion for a piece that begins at `start_s`, if it is another one than before.
    pub fn hand_out(&mut self, start_s: f64) -> Option<SpindleMotion> {
        std::mem::take(&mut self.fresh).then(|| self.motion(start_s))
    }

    /// Its motion, times from `start_s` on.
    pub fn motion(&self, start_s: f64) -> SpindleMotion {
        let relative = |phase: &SpindlePhase| SpindlePhase { from_s: phase.from_s - start_s, ..*phase };
        SpindleMotion { phases: self.course.phases().iter().map(relative).collect(), follows_rad_per_lu: None }
    }
}
