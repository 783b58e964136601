//! The page of `sollwert identify --smoothing --report`: settings with their intervals, agreement, feed over the path.
//!
//! In: a result and the names of its programs. Out: one HTML document, drawings inside it, light or dark as the reader's system is. Loads nothing,
//! runs no script.

use super::identify_control::control_text;
use super::identify_page::{BOTTOM, LEFT, MARGIN, WIDTH, label_below, whole};
use crate::base::units::mm_min_from_mm_s;
use crate::identify::{ControlResult, FeedOverPath};
use crate::report::escape;

/// Height of a drawing in its own units.
const HEIGHT: f64 = 220.0;

const OF_CONTROL: &str = "\
pre{overflow-x:auto;border:1px solid var(--grid);padding:.6rem;font-size:12px}polyline{fill:none}\
.traced{stroke:var(--a);stroke-width:2.4;opacity:.55}.before{stroke:var(--c);stroke-width:1;stroke-dasharray:4 3}\
.after{stroke:var(--b);stroke-width:1}";

/// The whole document.
pub(super) fn page(machine: &str, result: &ControlResult, files: &[String]) -> String {
    let title = format!("{}: control calibrated", escape(machine));
    let mut text = format!("<pre>{}</pre>\n", escape(&control_text(result, files)));
    text += "<h2>Feed over the path</h2>\n<p>Broad: traced. Dashed: planned with the machine file as it was. Thin: planned as calibrated.</p>\n";
    for (place, (feeds, file)) in result.feeds.iter().zip(files).enumerate() {
        let used = if place < result.fitted { "used for the fit" } else { "not used for the fit" };
        text += &format!("<h3>{} ({used})</h3>\n{}", escape(file), drawing(feeds));
    }
    whole(&title, OF_CONTROL, &text)
}

fn drawing(feeds: &FeedOverPath) -> String {
    let curves = [("before", &feeds.before_mm_s), ("traced", &feeds.traced_mm_s), ("after", &feeds.after_mm_s)];
    let highest = curves.iter().flat_map(|(_, values)| values.iter()).copied().fold(0.0, f64::max).max(1e-9);
    let (width, height) = (WIDTH - LEFT - MARGIN, HEIGHT - MARGIN - BOTTOM);
    let mut svg = format!("<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"feed over the path\">\n");
    for share in [0.0, 0.5, 1.0] {
        let y = MARGIN + height * (1.0 - share);
        svg += &format!("<line class=\"grid\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>", WIDTH - MARGIN);
        let feed = mm_min_from_mm_s(share * highest);
        svg += &format!("<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{feed:.0}</text>\n", LEFT - 6.0, y + 4.0);
        let (x, anchor) = label_below(LEFT + width * share);
        svg += &format!(
            "<text x=\"{x:.1}\" y=\"{}\" text-anchor=\"{anchor}\">{:.1} mm</text>\n",
            HEIGHT - 14.0,
            share * feeds.length_mm
        );
    }
    svg += &format!("<text x=\"{LEFT}\" y=\"11\">mm/min</text>\n");
    for (class, values) in curves {
        let last = values.len().saturating_sub(1).max(1) as f64;
        let point = |(k, feed): (usize, &f64)| {
            let (x, y) = (LEFT + width * k as f64 / last, MARGIN + height * (1.0 - feed / highest));
            format!("{x:.1},{y:.1}")
        };
        let points: Vec<String> = values.iter().enumerate().map(point).collect();
        svg += &format!("<polyline class=\"{class}\" points=\"{}\"/>\n", points.join(" "));
    }
    svg + "</svg>\n"
}
