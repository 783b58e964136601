//! Base-85 arrays, encoded here by the arithmetic of the format.

use super::operate::read;
use sollwert::trace::{ImportOptions, TraceFormat};

fn digits(word: u32) -> String {
    const ALPHABET: &[u8] = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ!#$`()*+-/:;=?@[]^_{|}~";
    if word == 0 {
        return ".".to_owned();
    }
    (0..5).rev().map(|power| char::from(ALPHABET[(word / 85_u32.pow(power) % 85) as usize])).collect()
}

fn array(values: &[f64]) -> String {
    values.iter().map(|value| digits((value.to_bits() >> 32) as u32) + &digits(value.to_bits() as u32)).collect()
}

fn file(root: &str, arrays: &[(&str, &str, Vec<f64>)]) -> String {
    let mut text =
        format!("<?xml version=\"1.0\"?>\n<{root}>\n<float name=\"m_dProcessUpdateTime\">0.000125</float>\n");
    for (name, kind, values) in arrays {
        text += &format!(
            "<object name=\"{name}\"><NumericArray elementtype=\"{kind}\" format=\"base85\"><raw name=\"m_pNumberArray\">\n{}\n</raw></NumericArray></object>\n",
            array(values)
        );
    }
    text + &format!("</{root}>\n")
}

#[test]
fn every_bit_of_an_array_is_read() {
    let values = vec![0.0, -0.0, 1.0, 1.0 / 3.0, -1e300, 5e-324, f64::MAX];
    let response = vec![1.0, -2.0, 0.5, 0.25];
    for root in ["DynamicModelAxisController", "ResponseTestCustom"] {
        let text = file(root, &[("m_Time", "double", values.clone()), ("m_Response", "complex", response.clone())]);
        let trace = read("measuring.xml", text.as_bytes(), &ImportOptions::default()).unwrap();
        assert_eq!(trace.origin.format, TraceFormat::MeasuringXml);
        let signal = trace.signal("m_Time").unwrap();
        assert_eq!(signal.times.period_s(), Some(125e-6));
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&signal.values), bits(&values));
        assert_eq!(trace.signal("m_Response.re").unwrap().values, [1.0, 0.5]);
        assert_eq!(trace.signal("m_Response.im").unwrap().values, [-2.0, 0.25]);
    }
    let odd = file("ResponseTestCustom", &[("a", "double", vec![1.5])]).replace("</raw>", "%</raw>");
    assert_eq!(read("odd_digits.xml", odd.as_bytes(), &ImportOptions::default()).unwrap_err().code, "T0004");
}
