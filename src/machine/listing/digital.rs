//! Drive data of the 840D pl (SIMODRIVE 611D, `$MD_`) as the parameters of SINAMICS that mean the same.
//!
//! In: name of a datum and its value. Out: parameter, index, value in its unit. Cycles count in 31.25 µs, the integrator time of the current
//! controller is in µs, all other units agree. MD1000 (cycle of the
//! current controller), MD1401 (speed), MD1407 and MD1409 (ms; 0 is no integral part) were seen in descriptions of the 611D with these numbers, and MD1417, MD1418, MD1426,
//! MD1428 in the form `$MD_`; the other numbers, all names of the table and the remaining units are from memory and unverified: no archive of such a control was at hand. Boot files (BOT), which are compiled, are not read. Band-stops (MD1210 ff.) and speed filters are left out.

use crate::base::units::{MS_PER_S, US_PER_S};

/// MD1000, MD1001 count in these.
const TICK_US: f64 = 31.25;

/// A datum with its counterpart.
pub(super) struct Counterpart {
    pub number: u32,
    pub name: &'static str,
    pub parameter: (u32, u32),
    factor: f64,
}

const fn same(number: u32, name: &'static str, parameter: u32) -> Counterpart {
    Counterpart { number, name, parameter: (parameter, 0), factor: 1.0 }
}

const COUNTERPARTS: [Counterpart; 17] = [
    Counterpart { number: 1000, name: "CURRCTRL_CYCLE_TIME", parameter: (115, 0), factor: TICK_US },
    Counterpart { number: 1001, name: "SPEEDCTRL_CYCLE_TIME", parameter: (115, 1), factor: TICK_US },
    same(1104, "MOTOR_MAX_CURRENT", 640),
    same(1113, "TORQUE_CURRENT_RATIO", 316),
    same(1114, "EMF_VOLTAGE", 317),
    same(1115, "ARMATURE_RESISTANCE", 350),
    same(1116, "ARMATURE_INDUCTANCE", 356),
    same(1117, "MOTOR_INERTIA", 341),
    same(1120, "CURRCTRL_GAIN", 1715),
    Counterpart { number: 1121, name: "CURRCTRL_INTEGRATOR_TIME", parameter: (1717, 0), factor: MS_PER_S / US_PER_S },
    same(1202, "CURRENT_FILTER_1_FREQUENCY", 1658),
    same(1203, "CURRENT_FILTER_1_DAMPING", 1659),
    same(1401, "MOTOR_MAX_SPEED", 1082),
    same(1407, "SPEEDCTRL_GAIN_1", 1460),
    same(1409, "SPEEDCTRL_INTEGRATOR_TIME_1", 1462),
    same(1414, "SPEEDCTRL_REF_MODEL_FREQ", 1433),
    same(1415, "SPEEDCTRL_REF_MODEL_DAMPING", 1434),
];

/// Parameter, index and value; `number`: as it stands before the datum.
pub(super) fn counterpart(name: &str, number: Option<u32>, value: f64) -> Option<(u32, u32, f64)> {
    let found = COUNTERPARTS.iter().find(|known| known.name == name || (number == Some(known.number)))?;
    Some((found.parameter.0, found.parameter.1, value * found.factor))
}
