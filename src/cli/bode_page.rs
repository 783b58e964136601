//! The page of `sollwert machine bode -o`: amplitude and phase of every loop.
//!
//! In: responses. Out: one HTML document, drawings inside it, light or dark as the reader's system is. Loads nothing, runs no script.

use super::bode::{AxisResponses, LEFT_OUT, peak, round, unwrapped_deg};
use crate::base::units::{US_PER_S, db_from_ratio};
use crate::drive::{LoopResponse, Point};

/// Size of one drawing in its own units.
const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 230.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 30.0;
/// What lies below is not drawn: nobody reads it.
const FLOOR_DB: f64 = -80.0;

const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#1b1f24;--paper:#fff;--grid:#d7dce1;--a:#0b61a4;--b:#c2410c;--c:#15803d}\
@media(prefers-color-scheme:dark){:root{--ink:#e6e8ea;--paper:#14171a;--grid:#343a40;--a:#6cb6ff;--b:#ff9d5c;--c:#6fd08c}}\
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:60rem;margin:2rem auto;padding:0 1rem}\
svg{width:100%;height:auto;display:block}svg text{fill:var(--ink);font:11px system-ui,sans-serif}\
.grid{stroke:var(--grid);stroke-width:1}.zero{stroke:var(--ink);stroke-width:.8;stroke-dasharray:4 3}\
.a,.b,.c{fill:none;stroke-width:1.8}.a{stroke:var(--a)}.b{stroke:var(--b)}.c{stroke:var(--c)}\
.key span{display:inline-block;margin-right:1.4rem}.key i{display:inline-block;width:1.4rem;height:.2rem;margin-right:.4rem;vertical-align:middle}\
table{border-collapse:collapse}td,th{padding:.1rem .9rem .1rem 0;text-align:left}";

/// A curve with its class and name.
struct Curve<'a> {
    class: &'static str,
    name: &'static str,
    points: &'a [Point],
}

/// The whole document.
pub(super) fn page(machine: &str, axes: &[AxisResponses]) -> String {
    let title = format!("{}: frequency responses", escaped(machine));
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>{title}</title>\n<style>{STYLE}</style></head>\n<body>\n<h1>{title}</h1>\n\
         <p>Loops of the discrete model, each at its own cycle and up to half its sampling frequency. Left out: {}.</p>\n",
        LEFT_OUT.join("; ")
    );
    for axis in axes {
        text += &format!("<h2>Axis {}</h2>\n", escaped(&axis.name));
        for (name, of_loop) in axis.loops() {
            text += &loop_section(name, of_loop);
        }
        let curves = [
            Curve { class: "a", name: "set-point to position", points: &axis.responses.setpoint },
            Curve { class: "c", name: "set-point to control deviation", points: &axis.responses.deviation },
        ];
        text += "<h3>With filters, balancing and feed-forward</h3>\n";
        text += &drawings(&curves);
    }
    text + "</body></html>\n"
}

fn loop_section(name: &str, of_loop: &LoopResponse) -> String {
    let mut text = format!("<h3>{} loop, cycle {} µs</h3>\n<table>", capital(name), round(of_loop.period_s * US_PER_S));
    let mut row = |what: &str, value: String| text += &format!("<tr><th>{what}</th><td>{value}</td></tr>");
    match &of_loop.phase_margin {
        Some(margin) => {
            row("phase margin", format!("{:.1}° at {} Hz", margin.margin_deg, round(margin.crossover_hz)));
        }
        None => row("phase margin", "the gain is never 1".to_owned()),
    }
    match &of_loop.gain_margin {
        Some(margin) => {
            let db = db_from_ratio(margin.margin_ratio);
            row("gain margin", format!("{db:.1} dB at {} Hz", round(margin.crossover_hz)));
        }
        None => row("gain margin", "none".to_owned()),
    }
    row("-3 dB", of_loop.bandwidth_hz.map_or("none".to_owned(), |hz| format!("{} Hz", round(hz))));
    row("peak", peak(of_loop));
    row("stable", if of_loop.spectral_radius_ratio < 1.0 { "yes" } else { "no" }.to_owned());
    text += "</table>\n";
    text + &drawings(&[
        Curve { class: "a", name: "open loop", points: &of_loop.open },
        Curve { class: "b", name: "closed loop", points: &of_loop.closed },
    ])
}

/// The name of a loop as a heading has it.
fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

/// Key, amplitude and phase.
fn drawings(curves: &[Curve<'_>]) -> String {
    let keys: Vec<String> = curves
        .iter()
        .map(|curve| format!("<span><i style=\"background:var(--{})\"></i>{}</span>", curve.class, curve.name))
        .collect();
    let amplitude = |points: &[Point]| -> Vec<f64> {
        points.iter().map(|point| db_from_ratio(point.response.norm()).max(FLOOR_DB)).collect()
    };
    format!(
        "<p class=\"key\">{}</p>\n{}{}",
        keys.concat(),
        drawing(curves, "dB", 20.0, &amplitude),
        drawing(curves, "°", 90.0, &unwrapped_deg)
    )
}

/// One drawing over the logarithm of the frequency; `step` is the distance of the horizontal lines.
fn drawing(curves: &[Curve<'_>], unit: &str, step: f64, values: &dyn Fn(&[Point]) -> Vec<f64>) -> String {
    let drawn: Vec<(&Curve<'_>, Vec<f64>)> = curves.iter().map(|curve| (curve, values(curve.points))).collect();
    let finite = || drawn.iter().flat_map(|(_, values)| values).filter(|value| value.is_finite());
    let frequencies = || curves.iter().flat_map(|curve| curve.points).map(|point| point.frequency_hz);
    let (low_hz, high_hz) =
        frequencies().fold((f64::MAX, 1e-9), |(low, high): (f64, f64), hz| (low.min(hz), high.max(hz)));
    let (lowest, highest) = finite().fold((0.0_f64, 0.0_f64), |(low, high), value| (low.min(*value), high.max(*value)));
    let bottom = (lowest / step).floor() * step;
    let top = ((highest / step).ceil() * step).max(bottom + step);
    let x = |hz: f64| LEFT + (WIDTH - LEFT - RIGHT) * (hz / low_hz).ln() / (high_hz / low_hz).ln();
    let y = |value: f64| TOP + (HEIGHT - TOP - BOTTOM) * (top - value) / (top - bottom);

    let mut svg = format!("<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{unit} over Hz\">\n");
    let lines = ((top - bottom) / step).round().min(200.0) as u32;
    // At most ten labelled lines.
    let every = lines / 10 + 1;
    for n in (0..=lines).step_by(every as usize) {
        let value = bottom + step * f64::from(n);
        let class = if value == 0.0 { "zero" } else { "grid" };
        let (right, at) = (WIDTH - RIGHT, y(value));
        svg += &format!("<line class=\"{class}\" x1=\"{LEFT}\" x2=\"{right}\" y1=\"{at:.1}\" y2=\"{at:.1}\"/>");
        svg += &format!("<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{value} {unit}</text>\n", LEFT - 6.0, at + 4.0);
    }
    for decade in (low_hz.log10().ceil() as i32)..=(high_hz.log10().floor() as i32) {
        let (hz, foot) = (10f64.powi(decade), HEIGHT - BOTTOM);
        let at = x(hz);
        svg += &format!("<line class=\"grid\" x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{TOP}\" y2=\"{foot}\"/>");
        svg += &format!("<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{} Hz</text>\n", HEIGHT - 12.0, round(hz));
    }
    for (curve, values) in &drawn {
        let points: Vec<String> = curve
            .points
            .iter()
            .zip(values)
            .filter(|(_, value)| value.is_finite())
            .map(|(point, value)| format!("{:.1},{:.1}", x(point.frequency_hz), y(*value)))
            .collect();
        let (class, name) = (curve.class, curve.name);
        svg +=
            &format!("<polyline class=\"{class}\" points=\"{}\"><title>{name}</title></polyline>\n", points.join(" "));
    }
    svg + "</svg>\n"
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
