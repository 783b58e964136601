//! What is found wrong with a run.

/// Sorts of findings. The first five are places in a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    Velocity,
    Acceleration,
    VelocityStep,
    Jerk,
    AccelerationStep,
    /// A set-point is not on the path.
    Path,
    /// A programmed point is missed by more than its tolerance.
    Tolerance,
    /// The programmed feed is exceeded.
    Feed,
    /// Start, end or exact stop is not at rest, or not where it is programmed.
    Rest,
    /// Cycle time and number of set-points differ.
    CycleTime,
    /// A split block changes the motion.
    Split,
    /// The reversed path takes another time.
    Reversed,
    /// With exact stops it would be far quicker.
    Creep,
    /// The program is refused, or the kernel panics.
    Alarm,
}

/// One finding.
#[derive(Clone, Debug)]
pub struct Finding {
    pub kind: Kind,
    /// What is over what may be.
    pub ratio: f64,
    pub text: String,
}
