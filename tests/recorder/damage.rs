//! Damaged files: cut off at every border and anywhere, with wrong bytes, or not recordings at all. What is whole is rescued,
//! what is wrong is told, nothing panics.

use crate::support::*;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use sollwert::recorder::*;
use std::path::Path;
use std::sync::OnceLock;

/// 2.5 s in three chunks, with two attachments.
fn whole() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| {
        let (machine, programs) = (machine(), programs());
        recorded(&RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &programs), 5 * TICKS_PER_S / 2)
    })
}

fn whole_messages() -> &'static [Seen] {
    static MESSAGES: OnceLock<Vec<Seen>> = OnceLock::new();
    MESSAGES.get_or_init(|| seen(whole()))
}

/// Messages of the first so many chunks: chunks end with their seconds.
fn messages_before_second(second: usize) -> usize {
    whole_messages().iter().filter(|message| message.time_ns < second as u64 * 1_000_000_000).count()
}

/// Recovers bytes; the messages of the new file by the mcap crate, and our own reader must take it.
fn rescued(name: &str, bytes: &[u8]) -> Option<(RecoverReport, Vec<Seen>)> {
    let input = file(&format!("{name}.mcap"), bytes);
    let output = temporary(&format!("{name}-rescued.mcap"));
    let _ = std::fs::remove_file(&output);
    let report = recover(&input, &output);
    assert!(!temporary(&format!("{name}-rescued.mcap.partial")).exists());
    let Ok(report) = report else {
        assert!(!output.exists());
        return None;
    };
    let new = std::fs::read(&output).unwrap();
    assert_eq!(report.bytes, new.len() as u64);
    let messages = seen(&new);
    assert_eq!(report.messages, messages.len() as u64);
    let recording = Recording::open(&output).unwrap();
    assert_eq!(recording.messages().unwrap().filter(|message| message.is_ok()).count(), messages.len());
    assert!(mcap::Summary::read(&new).unwrap().is_some(), "it has an index");
    Some((report, messages))
}

#[test]
fn cut_off_at_any_record_the_chunks_before_are_rescued() {
    let bytes = whole();
    let frames = frames(bytes);
    assert_eq!(frames.iter().filter(|frame| frame.0 == mcap::records::op::CHUNK).count(), 3);
    for (_, start, _) in &frames {
        for cut in [*start, start + 5, start + 30] {
            let cut = cut.min(bytes.len() - 1);
            let chunks = frames.iter().filter(|frame| frame.0 == mcap::records::op::CHUNK && frame.2 <= cut).count();
            let part = &bytes[..cut];
            let path = file("cut-record.mcap", part);
            let refused = Recording::open(&path).unwrap_err();
            assert_eq!(refused.code, "R0013", "cut at {cut}");
            let Some((report, messages)) = rescued("cut-record", part) else {
                assert_eq!(chunks, 0, "cut at {cut}");
                continue;
            };
            assert_eq!(report.chunks, chunks as u64, "cut at {cut}");
            assert!(!report.was_whole);
            assert!(messages.len() >= messages_before_second(chunks), "cut at {cut}");
            assert_eq!(messages[..], whole_messages()[..messages.len()], "cut at {cut}");
        }
    }
}

#[test]
fn of_a_chunk_that_is_cut_off_the_readable_part_is_rescued() {
    let bytes = whole();
    let chunk = frames(bytes).into_iter().filter(|frame| frame.0 == mcap::records::op::CHUNK).nth(1).unwrap();
    let cut = chunk.1 + (chunk.2 - chunk.1) * 9 / 10;
    let (report, messages) = rescued("cut-chunk", &bytes[..cut]).unwrap();
    let (before, behind) = (messages_before_second(1), messages_before_second(2));
    assert!(messages.len() > before + (behind - before) / 4 && messages.len() < behind, "{report:?}");
    assert_eq!(report.messages_of_cut_chunk, (messages.len() - before) as u64);
    assert_eq!(messages[..], whole_messages()[..messages.len()]);
    let recording = Recording::open(&temporary("cut-chunk-rescued.mcap")).unwrap();
    assert_eq!(recording.programs().unwrap(), programs());
    assert_eq!(recording.machine_text().unwrap().unwrap().1, MACHINE_TEXT);
    assert_eq!(recording.metadata(RECOVERED_METADATA).unwrap()["messages"], messages.len().to_string());
    assert!(recording.summary().is_none(), "the run did not finish");
}

#[test]
fn a_whole_recording_is_rescued_whole() {
    let (report, messages) = rescued("whole", whole()).unwrap();
    assert!(report.was_whole && report.findings.is_empty() && report.left_out == 0);
    assert_eq!(messages[..], *whole_messages());
    assert!(std::fs::read(temporary("whole-rescued.mcap")).unwrap() == whole(), "byte for byte");
    // Nothing was lost, so nothing is added: the copy says what the file says.
    let [copy, original] =
        [temporary("whole-rescued.mcap"), file("whole.mcap", whole())].map(|path| Recording::open(&path).unwrap());
    assert_eq!(copy.topics(), original.topics());
    assert!(copy.metadata_names().eq(original.metadata_names()));
    assert!(original.metadata_names().all(|name| copy.metadata(name) == original.metadata(name)));
    assert_eq!(copy.programs().unwrap(), original.programs().unwrap());
    assert_eq!(copy.machine_text().unwrap(), original.machine_text().unwrap());
}

#[test]
fn a_damaged_chunk_is_left_out_and_the_others_are_rescued() {
    let bytes = whole();
    let chunks: Vec<_> = frames(bytes).into_iter().filter(|frame| frame.0 == mcap::records::op::CHUNK).collect();
    for (i, chunk) in chunks.iter().enumerate() {
        let others = |message: &&Seen| message.time_ns / 1_000_000_000 != i as u64;
        let expected: Vec<Seen> = whole_messages().iter().filter(others).cloned().collect();
        let mut damaged = bytes.to_vec();
        damaged[(chunk.1 + chunk.2) / 2] ^= 0x10;
        let (report, messages) = rescued("damaged-chunk", &damaged).unwrap();
        assert!(messages == expected && report.left_out == 1 && report.findings.len() == 1, "chunk {i}: {report:?}");
        // In the length of the record: only the index knows then where the next one begins. The chunk itself is good.
        for place in 2..=8 {
            let mut damaged = bytes.to_vec();
            damaged[chunk.1 + place] ^= 0xff;
            let (report, messages) = rescued("damaged-length", &damaged).unwrap();
            let kept: Vec<Seen> = messages.iter().filter(others).cloned().collect();
            assert!(kept == expected, "chunk {i}, byte {place} of its length: {report:?}");
            assert!(!report.findings.is_empty() && messages.iter().all(|message| whole_messages().contains(message)));
        }
    }
}

#[test]
fn files_that_are_no_recordings_are_told_in_plain_words() {
    let open = |path: &Path| Recording::open(path).unwrap_err();
    assert!(open(&temporary("not there.mcap")).message.contains("not there.mcap cannot be read"));
    assert!(open(&file("empty.mcap", b"")).message.contains("is empty"));
    assert!(open(&file("text.mcap", b"N10 G1 X10\nM30\n")).message.contains("is not an MCAP file"));
    assert!(open(&file("short.mcap", &mcap::MAGIC[..5])).message.contains("is not an MCAP file"));
    assert!(open(&temporary("")).message.contains("is a folder"));
    let bytes = whole();
    let cut = open(&file("cut.mcap", &bytes[..bytes.len() * 2 / 3]));
    assert!(cut.message.contains("is not a whole recording") && cut.message.contains("at byte"), "{}", cut.message);
    let help = cut.help.unwrap();
    assert!(help.contains("1 complete chunk with 0.999 s"), "{help}");
    assert!(help.contains("sollwert recover") && help.contains("cut.mcap"), "{help}");
    for (name, garbage) in [("garbage-empty", &b""[..]), ("garbage-text", b"hello"), ("garbage-magic", mcap::MAGIC)] {
        assert!(rescued(name, garbage).is_none());
    }
}

#[test]
fn the_input_is_never_written_over() {
    let path = file("itself.mcap", &whole()[..whole().len() / 2]);
    assert_eq!(recover(&path, &path).unwrap_err().code, "R0015");
    let roundabout = path.parent().unwrap().join("..").join("recorder").join("itself.mcap");
    assert_eq!(recover(&path, &roundabout).unwrap_err().code, "R0015");
    assert!(std::fs::read(&path).unwrap() == whole()[..whole().len() / 2]);
}

/// Reads all that can be read; only panics count.
fn read_everything(path: &Path) {
    let Ok(recording) = Recording::open(path) else { return };
    let _ = recording.messages().map(|messages| messages.filter(Result::is_ok).count());
    let _ = (recording.programs(), recording.machine_text(), recording.summary());
    let _ = export_csv(&recording, &mut std::io::sink());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, rng_seed: RngSeed::Fixed(850), ..ProptestConfig::default() })]

    #[test]
    fn cut_off_anywhere_a_prefix_is_rescued(share in 0.0..1.0_f64) {
        let bytes = whole();
        let cut = (share * bytes.len() as f64) as usize;
        if let Some((_, messages)) = rescued("cut-anywhere", &bytes[..cut]) {
            prop_assert!(messages[..] == whole_messages()[..messages.len()]);
        }
    }

    #[test]
    fn one_wrong_byte_never_makes_a_wrong_message(share in 0.0..1.0_f64, flipped in 1..=255_u8) {
        let mut bytes = whole().to_vec();
        let place = (share * bytes.len() as f64) as usize;
        bytes[place] ^= flipped;
        let path = file("wrong-byte.mcap", &bytes);
        read_everything(&path);
        if let Some((_, messages)) = rescued("wrong-byte", &bytes) {
            let mut all = whole_messages().iter();
            prop_assert!(messages.iter().all(|message| all.any(|whole| whole == message)), "byte {place}");
        }
    }

    #[test]
    fn many_wrong_bytes_never_panic(seed in any::<u64>(), wrong in 1..400_usize, small in any::<bool>()) {
        let mut bytes = whole().to_vec();
        if small {
            // Attachments, metadata and heads, where the lengths are.
            bytes.truncate(6000);
        }
        let mut state = seed | 1;
        for _ in 0..wrong {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let place = (state >> 33) as usize % bytes.len();
            if place >= mcap::MAGIC.len() {
                bytes[place] = (state >> 20) as u8;
            }
        }
        let path = file("wrong-bytes.mcap", &bytes);
        read_everything(&path);
        let _ = recover(&path, &temporary("wrong-bytes-rescued.mcap"));
    }
}
