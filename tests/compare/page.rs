//! The page: what is packed is what was there, no peak is hidden, it stays small, and text stays text.

use crate::made::{grid, signal, smooth, steps, trace};
use crate::random::Random;
use serde_json::Value;
use sollwert::compare::{Series, examine, prepare};
use sollwert::report::{Rounding, Sheet, Steps, base64, escape, packed};

/// Standard base64, from its definition.
fn from_base64(text: &str) -> Vec<u8> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        other => panic!("{other}"),
    };
    let letters: Vec<u8> = text.bytes().filter(|c| *c != b'=').map(value).collect();
    let bits = |i: usize| (letters[i / 6] >> (5 - i % 6)) & 1;
    (0..letters.len() * 6 / 8).map(|byte| (0..8).fold(0, |sum, bit| sum << 1 | bits(8 * byte + bit))).collect()
}

/// As the page unpacks.
fn unpacked(packed: &Value) -> Vec<f64> {
    let number = |key: &str| packed[key].as_f64().expect("a number");
    let bytes = number("bytes") as usize;
    let raw = from_base64(packed["data"].as_str().expect("base64"));
    let code = |chunk: &[u8]| chunk.iter().rev().fold(0_u64, |sum, byte| sum << 8 | u64::from(*byte));
    let value = |code: u64| if code == 0 { f64::NAN } else { number("low") + (code - 1) as f64 * number("step") };
    raw.chunks(bytes).map(|chunk| value(code(chunk))).collect()
}

#[test]
fn base64_is_that_of_the_standard() {
    // RFC 4648, section 10.
    for (plain, coded) in [
        ("", ""),
        ("f", "Zg=="),
        ("fo", "Zm8="),
        ("foo", "Zm9v"),
        ("foob", "Zm9vYg=="),
        ("fooba", "Zm9vYmE="),
        ("foobar", "Zm9vYmFy"),
    ] {
        assert_eq!(base64(plain.as_bytes()), coded);
        assert_eq!(from_base64(coded), plain.as_bytes());
    }
}

#[test]
fn steps_round_as_they_say() {
    for seed in 1..=30 {
        let mut random = Random::new(seed);
        let size = 10_f64.powf(random.between(-6.0, 6.0));
        let mut values: Vec<f64> = (0..200).map(|_| random.between(-size, size)).collect();
        values[17] = f64::NAN;
        for bytes in 2..=4 {
            let steps = Steps::covering(values.iter(), bytes);
            for (rounding, low, high) in
                [(Rounding::Nearest, 0.5, 0.5), (Rounding::Down, 1.0, 0.0), (Rounding::Up, 0.0, 1.0)]
            {
                for (packed, value) in unpacked(&steps.pack(&values, rounding)).iter().zip(&values) {
                    let slack = 1e-5 * steps.step() + 1e-15 * size;
                    let inside = (value - packed) <= low * steps.step() + slack
                        && (packed - value) <= high * steps.step() + slack;
                    assert!(
                        inside || (packed.is_nan() && value.is_nan()),
                        "seed {seed}: {value} became {packed}, step {}",
                        steps.step()
                    );
                }
            }
        }
    }
    let constant = [3.25; 4];
    assert_eq!(unpacked(&Steps::covering(constant.iter(), 2).pack(&constant, Rounding::Nearest)), constant);
    let nothing = [f64::NAN; 3];
    assert!(unpacked(&Steps::covering(nothing.iter(), 2).pack(&nothing, Rounding::Nearest)).iter().all(|v| v.is_nan()));
}

#[test]
fn a_single_sample_among_a_million_stays_visible_in_its_place() {
    let times = grid(0.001, 1_000_000);
    let mut one = signal("X.torque_reference_n_m", "N m", &times, |t| (0.01 * t).sin());
    one.values[654_321] = 17.5;
    one.values[111_111] = -9.25;
    let document = packed(&Series::of(&one), &|t| t, (0.0, 999.999), 40_000);
    assert_eq!(document["kind"], "band");
    let (low, high) = (unpacked(&document["lo"]), unpacked(&document["hi"]));
    let width = document["width"].as_f64().expect("a width");
    let place = |t: f64| (t / width) as usize;
    let step = document["step"].as_f64().expect("a step");
    assert!(
        (high[place(654.321)] - 17.5).abs() <= step && high[place(654.321)] >= 17.5 - 1e-9,
        "{}",
        high[place(654.321)]
    );
    assert!((low[place(111.111)] + 9.25).abs() <= step && low[place(111.111)] <= -9.25 + 1e-9);
    // Everywhere else the band holds the sine, and no more than its own stretch of it.
    for (i, (a, b)) in low.iter().zip(&high).enumerate() {
        if i != place(654.321) && i != place(111.111) {
            let (from, to) = (0.01 * i as f64 * width, 0.01 * (i + 1) as f64 * width);
            let wide = (to - from) + 2.0 * step;
            assert!(
                *a <= from.sin().max(to.sin()) + step && *b >= from.sin().min(to.sin()) - step && b - a <= wide,
                "{i}: {a} {b}"
            );
        }
    }
}

#[test]
fn what_fits_is_there_sample_by_sample() {
    let times = grid(0.002, 1000);
    let one = signal("X.position_actual_mm", "mm", &times, steps);
    let document = packed(&Series::of(&one), &|t| t + 1.0, (0.0, 3.0), 4000);
    assert_eq!((document["kind"].as_str(), document["start"].as_f64()), (Some("samples"), Some(1.0)));
    assert!((document["width"].as_f64().expect("a width") - 0.002).abs() < 1e-12);
    for (packed, value) in unpacked(&document["values"]).iter().zip(&one.values) {
        assert!((packed - value).abs() <= 0.5001 * document["step"].as_f64().expect("a step"));
    }
}

#[test]
fn a_million_samples_of_many_signals_make_a_page_below_three_megabytes() {
    let times = grid(0.001, 1_000_000);
    let mut random = Random::new(3);
    let mut signals = Vec::new();
    for axis in ["X", "Y"] {
        for (field, unit) in [
            ("position_setpoint_mm", "mm"),
            ("position_actual_mm", "mm"),
            ("torque_reference_n_m", "N m"),
            ("current_a", "A"),
        ] {
            let mut noise = 0.0;
            signals.push(signal(&format!("{axis}.{field}"), unit, &times, |t| {
                noise = 0.9 * noise + 1e-4 * random.between(-1.0, 1.0);
                100.0 * smooth(t / 900.0) * (0.05 * t).sin() + noise
            }));
        }
    }
    let mut line = signal("path.line", "", &times, |t| (t * 200.0).floor() + 1.0);
    line.discrete = true;
    signals.push(line);
    let mut made = trace(signals);
    made.name = "<script>alert(1)<b>".into();
    prepare(&mut made);
    let side = examine(&made, None).expect("figures");
    let html = Sheet { trace: &made, side: &side, reference: None }.html();
    assert!(html.len() < 3_000_000, "{}", html.len());
    assert!(!html.contains("<script>alert"), "text of a name became an element");
    assert!(html.contains("&lt;script&gt;alert(1)&lt;b&gt;"));
    // Nothing is fetched: the only addresses are in the licence comment of uPlot and in text.
    for tag in ["src=\"http", "href=\"http", "url(http", "@import"] {
        assert!(!html.contains(tag), "{tag}");
    }
    assert_eq!(html, Sheet { trace: &made, side: &side, reference: None }.html());
}

#[test]
fn escaped_text_has_no_markup() {
    assert_eq!(
        escape("<a href=\"x\" id='y'>&\u{1}</a>"),
        "&lt;a href=&quot;x&quot; id=&#39;y&#39;&gt;&amp;\u{fffd}&lt;/a&gt;"
    );
}
