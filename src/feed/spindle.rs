//! How fast the master spindle turns, and how long a feed waits for it.
//!
//! In: `[spindle]` of the machine file, the events of pieces when they are pushed and when they begin. Out: whether the path must rest before a piece, and when
//! the spindle is near its speed. Its speed goes with constant acceleration. As on the control a feed waits only after a change of the speed that is
//! programmed, and only where it begins: a spindle that slows down under load stops nothing. M5 is not waited for. Does not know feeds a revolution: they
//! count with the programmed speed, which the spindle then has but for the tolerance.

use crate::base::units::rad_s_from_rpm;
use crate::interpreter::Event;
use crate::machine::SpindleSettings;

/// M3, M4, M5 and M19.
const CLOCKWISE: u32 = 3;
const COUNTER_CLOCKWISE: u32 = 4;
const STOP: u32 = 5;
const POSITION: u32 = 19;

/// What S and M say.
#[derive(Clone, Copy, Debug, Default)]
struct Words {
    speed_rad_s: f64,
    sense_ratio: f64,
}

/// The master spindle.
#[derive(Clone, Debug)]
pub(super) struct Spindle {
    settings: SpindleSettings,
    /// Of the pieces that were pushed.
    pushed: Words,
    /// A change that no feed has waited for yet was pushed.
    changed: bool,
    /// Of the pieces that have begun.
    begun: Words,
    /// Speed and time when the words changed last.
    from_rad_s: f64,
    from_s: f64,
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
                Event::MFunction(STOP | POSITION) => self.sense_ratio = 0.0,
                _ => {}
            }
        }
        self.target_rad_s() != before_rad_s
    }
}

impl Spindle {
    /// At rest. `None`: nothing has to wait for it.
    pub fn new(settings: Option<SpindleSettings>) -> Option<Self> {
        let settings = settings.filter(|settings| settings.tolerance_share > 0.0)?;
        Some(Self {
            settings,
            pushed: Words::default(),
            changed: false,
            begun: Words::default(),
            from_rad_s: 0.0,
            from_s: 0.0,
        })
    }

    /// Events of a piece that is pushed; true if it moves with a feed that has to wait.
    pub fn push(&mut self, events: &[Event], feeds: bool) -> bool {
        self.changed |= self.pushed.take(events);
        self.changed &= self.pushed.target_rad_s() != 0.0;
        feeds && std::mem::take(&mut self.changed)
    }

    /// Events of a piece that begins.
    pub fn begin(&mut self, events: &[Event], time_s: f64) {
        let before = self.begun;
        if self.begun.take(events) {
            self.from_rad_s = self.speed_rad_s(&before, time_s);
            self.from_s = time_s;
        }
    }

    /// When it is near the speed that was asked for last.
    pub fn ready_s(&self) -> f64 {
        let target_rad_s = self.begun.target_rad_s();
        let SpindleSettings { acceleration_rad_s2, tolerance_share } = self.settings;
        let way_rad_s = (target_rad_s - self.from_rad_s).abs() - tolerance_share * target_rad_s.abs();
        self.from_s + way_rad_s.max(0.0) / acceleration_rad_s2
    }

    fn speed_rad_s(&self, words: &Words, time_s: f64) -> f64 {
        let most_rad_s = self.settings.acceleration_rad_s2 * (time_s - self.from_s).max(0.0);
        self.from_rad_s + (words.target_rad_s() - self.from_rad_s).clamp(-most_rad_s, most_rad_s)
    }
}
