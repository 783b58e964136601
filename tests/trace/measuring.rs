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

/// As step responses and frequency measurements are written: the time in the object of the series, pairs beside their frequencies.
#[test]
fn a_series_has_the_time_of_its_object_and_a_response_is_pairs() {
    let raw = |name: &str, values: &[f64]| {
        let text = array(values);
        format!(
            "<NumericArray name=\"{name}\" elementtype=\"9\" format=\"base85\"><raw name=\"m_pNumberArray\">{text}</raw></NumericArray>"
        )
    };
    let series = |name: &str, end: f64, values: &[f64]| {
        let values = raw("m_ValueVector", values);
        format!("<TimeSeries name=\"{name}\">{values}<float name=\"m_TimeVector.end\">{end}</float></TimeSeries>")
    };
    let text = format!(
        "<ResponseTestCustom>{}{}<FrequencyResponseFunction name=\"m_pPlant\">{}{}</FrequencyResponseFunction></ResponseTestCustom>",
        series("m_Fast", 0.004, &[1.0, 2.0, 3.0, 4.0, 5.0]),
        series("m_Slow", 0.004, &[10.0, 20.0, 30.0]),
        raw("m_FrequencyVector", &[1.0, 10.0]),
        raw("m_ValueVector", &[0.5, -0.25, 0.125, -8.0]),
    );
    let trace = read("series.xml", text.as_bytes(), &ImportOptions::default()).unwrap();
    let fast = trace.signal("m_Fast.m_ValueVector").unwrap();
    assert_eq!((fast.times.period_s(), fast.values.as_slice()), (Some(0.001), &[1.0, 2.0, 3.0, 4.0, 5.0][..]));
    let slow = trace.signal("m_Slow.m_ValueVector").unwrap();
    assert_eq!(
        (slow.times.period_s(), slow.times.end_s(), slow.values.as_slice()),
        (Some(0.002), Some(0.004), &[10.0, 20.0, 30.0][..])
    );
    assert_eq!(trace.signal("m_pPlant.m_ValueVector.re").unwrap().values, [0.5, 0.125]);
    assert_eq!(trace.signal("m_pPlant.m_ValueVector.im").unwrap().values, [-0.25, -8.0]);
    assert!(!trace.notes.iter().any(|note| note.message.contains("is assumed")), "{:?}", trace.notes);
}

/// As auto servo tuning writes it (seen in a published file): CDATA over several lines, short arrays with commas, empty arrays, the same
/// name in many objects.
#[test]
fn a_file_of_auto_servo_tuning_has_cdata_and_arrays_with_commas() {
    let folded = |values: &[f64]| {
        let text: Vec<u8> = array(values).into_bytes();
        let lines: Vec<&str> = text.chunks(12).map(|line| std::str::from_utf8(line).unwrap()).collect();
        format!("<raw name=\"m_pNumberArray\"><![CDATA[\n{}\n]]></raw>", lines.join("\n"))
    };
    let plant: Vec<f64> = (0..40).map(|k| 0.1 / f64::from(k + 1) - f64::from(k % 3)).collect();
    let frequencies: Vec<f64> = (0..20).map(|k| 2.5 * f64::from(k + 1)).collect();
    let numeric = |name: &str, sort: &str, format: &str, raw: &str| {
        format!(
            "<NumericArray satclassid=\"4\" elementtype=\"{sort}\" format=\"{format}\" name=\"{name}\">\n\
             <unsigned_int name=\"m_length\">1</unsigned_int>\n{raw}\n</NumericArray>\n"
        )
    };
    let text = format!(
        "<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>\n<!-- 4.96.0.0.1 -->\n<DynamicModelAxisController satclassid=\"30\">\n\
         <float name=\"m_dKpGain\">3.5</float><Loop name=\"m_Inner\"><float name=\"m_dKpGain\">7.25</float></Loop>\n\
         {}{}<FrequencyResponseFunction name=\"m_pPlant\">{}{}</FrequencyResponseFunction></DynamicModelAxisController>\n",
        numeric("m_none", "int", "CSV", "<raw name=\"m_pNumberArray\"></raw>"),
        numeric("m_poles", "double", "CSV", "<raw name=\"m_pNumberArray\">59.061,1205.5,-1e-3</raw>"),
        numeric("m_ValueVector", "ComplexNumber", "base85", &folded(&plant)),
        numeric("m_FrequencyVector", "double", "base85", &folded(&frequencies)),
    );
    let trace = read("ast.xml", text.as_bytes(), &ImportOptions::default()).unwrap();
    assert_eq!(trace.origin.format, TraceFormat::MeasuringXml);
    assert_eq!(trace.signal("m_poles").unwrap().values, [59.061, 1205.5, -1e-3]);
    assert_eq!(trace.signal("m_pPlant.m_FrequencyVector").unwrap().values, frequencies);
    let of = |start: usize| plant.iter().skip(start).step_by(2).copied().collect::<Vec<f64>>();
    assert_eq!(trace.signal("m_pPlant.m_ValueVector.re").unwrap().values, of(0));
    assert_eq!(trace.signal("m_pPlant.m_ValueVector.im").unwrap().values, of(1));
    assert_eq!(trace.signals.len(), 4, "an array without numbers is no signal");
    let numbers = &trace.metadata["measuring"];
    assert_eq!((numbers["m_dKpGain"].as_str(), numbers["m_Inner.m_dKpGain"].as_str()), ("3.5", "7.25"));
    let other = text.replace("format=\"CSV\" name=\"m_poles\"", "format=\"hex\" name=\"m_poles\"");
    let refused = read("hex.xml", other.as_bytes(), &ImportOptions::default()).unwrap_err();
    assert!(refused.code == "T0004" && refused.message.contains("hex") && refused.place.is_some(), "{refused:?}");
}
