//! Bytes changed, cut and doubled at random: every importer ends, without a panic, with a trace or a finding; comparison and report too.

use super::operate::{linear, read};
use super::operate_session::Session;
use super::random::Random;
use sollwert::compare::{CompareOptions, compare, document, examine, prepare};
use sollwert::report::Sheet;
use sollwert::trace::{ImportOptions, Trace};

/// Small files of every format.
fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let session = Session { frames: vec![("2026-06-03T17:57:40.613Z", 40), ("", 20)], ..Session::new(linear()) };
    let csv: String = (0..40).map(|k| format!("{},{},a\n", f64::from(k) * 0.002, k)).collect();
    let scope: String = (0..40).map(|k| format!("{k}\t{k}.5\t{k}\t1\n")).collect();
    let scope =
        format!("Name\tp\nFile\tf\n\nName\tAxes.X.ActPos\tName\tb\nSampleTime[ms]\t1\tSampleTime[ms]\t1\n{scope}");
    let hal: String = (0..40).map(|k| format!("{k};1.5\n")).collect();
    let paired: String = (0..40).map(|k| format!("a +{k},5 joint.0.pos-cmd -{k},0 \n")).collect();
    let clock: String = (0..40).map(|k| format!("23:59:{:02};{k}\n", k + 19)).collect();
    let sampler: String = (0..40).map(|k| format!("{k} 1.5 2\n")).collect();
    let edge = "{\"Header\":{\"CycleTimeMs\":2,\"SignalListHFData\":[{\"Address\":\"CYCLE\"},{\"Address\":\"DES_POS|1\",\"Axis\":\"X1\"}],\
        \"SignalListLFData\":[{\"path\":\"/t\"}],\"Initial\":{\"Time\":\"2026-06-03T17:57:40.613Z\",\"HFProbeCounter\":0}},\n\
        \"Payload\":[{\"HFData\":[[1,2.5],[2,3.5],[3,1e-3]]},{\"HFBlockEvent\":{\"HFProbeCounter\":2,\"SeekOffset\":4,\"GCode\":\"G1\"}},\
        {\"HFCallEvent\":{\"HFProbeCounter\":3,\"Path\":\"/P\"}},\
        {\"LFData\":[{\"HFProbeCounter\":4,\"address\":\"/t\",\"value_type\":\"String\",\"value\":\"a\"}]},\
        {\"HFData\":[[4,2.5],[5,3.5]]}],\n\"Footer\":{}}\n";
    let measuring = "<ResponseTestCustom><float name=\"m_dProcessUpdateTime\">0.000125</float><object name=\"a\">\
        <NumericArray elementtype=\"double\" format=\"base85\"><raw name=\"m_pNumberArray\">..kLLiU.kLLiU.</raw></NumericArray>\
        <NumericArray format=\"base85\"><raw name=\"m_pNumberArray\"><![CDATA[\n..kLLiU.\n]]></raw></NumericArray>\
        <NumericArray format=\"CSV\"><raw name=\"m_pNumberArray\">1.5,-2e3,7</raw></NumericArray>\
        </object></ResponseTestCustom>";
    vec![
        ("xml", session.text().into_bytes()),
        ("csv", format!("time_s,X_mm,word\n{csv}").into_bytes()),
        ("twincat", scope.into_bytes()),
        ("halscope", format!("# Sampling period is 1000000 ns\njoint.0.pos-cmd;b\n{hal}").into_bytes()),
        ("halscope 2.8", format!("Sampling period is 100000 nSec \n\n{paired}").into_bytes()),
        ("clock", format!("Zeit;X_mm\n{clock}").into_bytes()),
        ("halsampler", sampler.into_bytes()),
        ("edge", edge.as_bytes().to_vec()),
        ("measuring", measuring.as_bytes().to_vec()),
    ]
}

/// Mutations of each file; `SOLLWERT_FUZZ_ROUNDS` asks for more.
fn rounds() -> u32 {
    std::env::var("SOLLWERT_FUZZ_ROUNDS").ok().and_then(|text| text.parse().ok()).unwrap_or(400)
}

fn mutated(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(6) {
        let at = random.below(bytes.len().max(1) as u32) as usize;
        match random.below(6) {
            0 => bytes.truncate(at),
            1 => bytes.insert(at.min(bytes.len()), random.below(256) as u8),
            2 if at < bytes.len() => bytes[at] = b"\"<>&=,;.-9{}[]\n\t\0 "[random.below(18) as usize],
            3 if at < bytes.len() => {
                bytes.remove(at);
            }
            4 => {
                let end = (at + random.below(200) as usize).min(bytes.len());
                let piece = bytes[at.min(end)..end].to_vec();
                let to = random.below(bytes.len().max(1) as u32) as usize;
                bytes.splice(to.min(bytes.len())..to.min(bytes.len()), piece);
            }
            _ if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            _ => {}
        }
    }
    bytes
}

/// Of so many mutants one is compared and drawn.
const COMPARED_EVERY: u32 = 8;

/// What reads traces ends well on whatever an importer lets through.
fn judge(trace: &mut Trace, original: &Trace) {
    prepare(trace);
    let side = examine(trace, None).expect("XY is a plane");
    let options = CompareOptions { budget: true, drift: true, ..CompareOptions::default() };
    for (a, b) in [(&*trace, original), (original, &*trace)] {
        if let Ok(comparison) = compare(a, b, &options) {
            assert!(document(&comparison).is_object());
            let sheet = Sheet { trace: a, side: &comparison.sides[0], reference: Some((b, &comparison)) };
            sollwert::report::write(&sheet, &super::recorded::temporary("mutant.html")).expect("a page");
        }
    }
    let sheet = Sheet { trace, side: &side, reference: None };
    sollwert::report::write(&sheet, &super::recorded::temporary("mutant.html")).expect("a page");
}

#[test]
fn no_importer_falls_over_damaged_bytes() {
    for (format, bytes) in samples() {
        let original = read(&format!("mutant_{format}"), &bytes, &ImportOptions::default());
        let mut original = original.unwrap_or_else(|finding| panic!("{format}: {finding:?}"));
        prepare(&mut original);
        let mut random = Random::new(7);
        for turn in 0..rounds() {
            let mutant = mutated(&bytes, &mut random);
            // A panic shows the turn: the seed is fixed.
            let read =
                std::panic::catch_unwind(|| read(&format!("mutant_{format}"), &mutant, &ImportOptions::default()));
            let Ok(read) = read else { panic!("{format}, turn {turn}: {:?}", String::from_utf8_lossy(&mutant)) };
            if let Ok(mut trace) = read {
                if turn.is_multiple_of(COMPARED_EVERY) {
                    let judged =
                        std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| judge(&mut trace, &original)));
                    assert!(judged.is_ok(), "{format}, turn {turn}: {:?}", String::from_utf8_lossy(&mutant));
                }
                for signal in &trace.signals {
                    assert_eq!(signal.times.len(), signal.values.len(), "{format}, turn {turn}: {}", signal.original);
                    let increasing = signal.times.iter().zip(signal.times.iter().skip(1)).all(|(one, next)| one < next);
                    assert!(increasing, "{format}, turn {turn}: {}", signal.original);
                }
            }
        }
    }
}
