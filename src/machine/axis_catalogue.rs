//! Every key of `[axes.*]` and its dynamics sets: name, unit, range, default, machine data, meaning.
//!
//! In: nothing. Out: the rows that `catalogue` lists. Symbols in brackets are those of models/drive.md section 2.

use super::choices::words;
use super::keys::{Absent, Accepts, Key, Range};
use crate::base::AxisKind;
use Absent::{Means, No, Number as Value, Required, Word};
use Accepts::{Choice, Flag, Interval, Number, Text, Whole};

const POSITIVE: Accepts = Number(Range::Positive);
const ANY: Accepts = Number(Range::Any);

/// Most machine axes of a control (SINUMERIK 840D: 31).
const AXIS_INDEX_MAX: u32 = 31;

pub(super) const AXIS: &[Key] = &[
    Key::new("machine_axis", "", Text, Means("none"), "name of the machine axis in machine data and trace signals"),
    Key::new(
        "index",
        "",
        Whole(1, AXIS_INDEX_MAX),
        Means("place in the file"),
        "number of the machine axis; the axes are ordered by it",
    ),
    Key::new("kind", "", Choice(words::<AxisKind>), Word("linear"), "linear or rotary: decides the units of the axis")
        .md("MD30300"),
    Key::new("velocity_max_m_min", "m/min", POSITIVE, Required, "velocity limit")
        .linear("velocity_max_rpm")
        .md("MD32000"),
    Key::new("acceleration_max_m_s2", "m/s²", POSITIVE, Required, "acceleration limit")
        .linear("acceleration_max_rot_s2")
        .md("MD32300"),
    Key::new("jerk_max_m_s3", "m/s³", POSITIVE, Required, "jerk limit").linear("jerk_max_rot_s3").md("MD32431"),
    Key::new("transition_jerk_max_m_s3", "m/s³", POSITIVE, Means("the axis jerk"), "jerk limit inside a blend")
        .linear("transition_jerk_max_rot_s3")
        .md("MD32432"),
    Key::new("velocity_max_rpm", "rpm", POSITIVE, Required, "velocity limit")
        .rotary("velocity_max_m_min")
        .md("MD32000"),
    Key::new("acceleration_max_rot_s2", "rot/s²", POSITIVE, Required, "acceleration limit")
        .rotary("acceleration_max_m_s2")
        .md("MD32300"),
    Key::new("jerk_max_rot_s3", "rot/s³", POSITIVE, Required, "jerk limit").rotary("jerk_max_m_s3").md("MD32431"),
    Key::new("transition_jerk_max_rot_s3", "rot/s³", POSITIVE, Means("the axis jerk"), "jerk limit inside a blend")
        .rotary("transition_jerk_max_m_s3")
        .md("MD32432"),
    Key::new("follow_up_tolerance_mm", "mm", POSITIVE, Value(0.01), "e of the corner rule sqrt(8 A e)")
        .linear("follow_up_tolerance_deg"),
    Key::new("follow_up_tolerance_deg", "deg", POSITIVE, Value(0.01), "e of the corner rule sqrt(8 A e)")
        .rotary("follow_up_tolerance_mm"),
    Key::new("travel_mm", "mm", Interval, Means("no limit"), "software limits")
        .linear("travel_deg")
        .md("MD36110, MD36100"),
    Key::new("travel_deg", "deg", Interval, Means("no limit"), "software limits")
        .rotary("travel_mm")
        .md("MD36110, MD36100"),
    Key::new("home_mm", "mm", ANY, Value(0.0), "where the axis stands at program start").linear("home_deg"),
    Key::new("home_deg", "deg", ANY, Value(0.0), "where the axis stands at program start").rotary("home_mm"),
    Key::new(
        "acceleration_reduction_velocity_ratio",
        "",
        Number(Range::UpTo(0.0, 1.0)),
        Value(1.0),
        "DRIVE: share of the velocity limit above which the acceleration is lower",
    )
    .md("MD35220"),
    Key::new(
        "acceleration_reduction_ratio",
        "",
        Number(Range::Within(0.0, 0.95)),
        Value(0.0),
        "DRIVE: share of the acceleration that is taken off there",
    )
    .md("MD35230"),
    Key::new("modulo", "", Flag, No, "endless rotary axis, without travel").rotary("").md("MD30310"),
];

pub(super) const DYNAMICS: &[Key] = &[
    Key::new("velocity_max_m_min", "m/min", POSITIVE, Means("that of the axis"), "velocity limit")
        .linear("velocity_max_rpm")
        .md("MD32000"),
    Key::new("acceleration_max_m_s2", "m/s²", POSITIVE, Means("that of the axis"), "acceleration limit")
        .linear("acceleration_max_rot_s2")
        .md("MD32300"),
    Key::new("jerk_max_m_s3", "m/s³", POSITIVE, Means("that of the axis"), "jerk limit")
        .linear("jerk_max_rot_s3")
        .md("MD32431"),
    Key::new("transition_jerk_max_m_s3", "m/s³", POSITIVE, Means("that of the axis"), "jerk limit inside a blend")
        .linear("transition_jerk_max_rot_s3")
        .md("MD32432"),
    Key::new("velocity_max_rpm", "rpm", POSITIVE, Means("that of the axis"), "velocity limit")
        .rotary("velocity_max_m_min")
        .md("MD32000"),
    Key::new("acceleration_max_rot_s2", "rot/s²", POSITIVE, Means("that of the axis"), "acceleration limit")
        .rotary("acceleration_max_m_s2")
        .md("MD32300"),
    Key::new("jerk_max_rot_s3", "rot/s³", POSITIVE, Means("that of the axis"), "jerk limit")
        .rotary("jerk_max_m_s3")
        .md("MD32431"),
    Key::new("transition_jerk_max_rot_s3", "rot/s³", POSITIVE, Means("that of the axis"), "jerk limit inside a blend")
        .rotary("transition_jerk_max_m_s3")
        .md("MD32432"),
];
