//! Contents of a recording: every field, unit, time and attachment; determinism; faults of the disk.

use crate::support::*;
use prost::Message as _;
use prost_types::field_descriptor_proto::Type;
use prost_types::{DescriptorProto, FileDescriptorSet};
use sollwert::base::{AxisId, AxisKind, Diagnostic, Tick};
use sollwert::interpreter::Event;
use sollwert::program::BlockRef;
use sollwert::recorder::schema::proto::foxglove::PoseInFrame;
use sollwert::recorder::schema::proto::sollwert::{LinearAxis, Path, RotaryAxis};
use sollwert::recorder::schema::{self, SchemaText};
use sollwert::recorder::*;
use std::num::NonZeroU32;
use std::time::{Duration, Instant};

/// 1.5 s and the start.
const RUN_TICKS: u64 = TICKS_PER_S * 3 / 2;

fn descriptor(schema: SchemaText) -> DescriptorProto {
    let set = FileDescriptorSet::decode(schema.descriptors).unwrap();
    let mut messages = set.file.iter().flat_map(|file| {
        let package = file.package().to_owned();
        file.message_type.iter().map(move |message| (format!("{package}.{}", message.name()), message))
    });
    messages.find(|(name, _)| name == schema.name).unwrap().1.clone()
}

#[test]
fn the_field_table_is_the_proto_file() {
    for (schema, kind) in [(schema::LINEAR_AXIS, AxisKind::Linear), (schema::ROTARY_AXIS, AxisKind::Rotary)] {
        let message = descriptor(schema);
        assert_eq!(message.field.len(), AXIS_FIELD_COUNT);
        for (i, (field, declared)) in AXIS_FIELDS.iter().zip(&message.field).enumerate() {
            assert_eq!((declared.name(), declared.number()), (field.name(kind), i as i32 + 1));
            assert!(declared.proto3_optional());
            let bits = [schema::FLAGS_FIELD, schema::MONITORING_FIELD].contains(&i);
            assert_eq!(declared.r#type(), if bits { Type::Uint32 } else { Type::Double });
        }
    }
    let path = descriptor(schema::PATH);
    assert!(path.field.iter().map(|field| field.name()).eq(PATH_FIELDS));
    assert!(path.field.iter().all(|field| field.proto3_optional()));
}

#[test]
fn axis_fields_are_those_of_the_contract_and_the_view_of_the_control() {
    let names = "position_setpoint_mm position_reference_mm position_actual_mm position_measured_mm control_deviation_mm \
        following_error_mm velocity_setpoint_mm_s acceleration_setpoint_mm_s2 jerk_setpoint_mm_s3 velocity_command_mm_s \
        velocity_feedforward_mm_s velocity_actual_mm_s motor_speed_reference_rad_s motor_speed_rad_s torque_reference_n_m \
        torque_feedforward_n_m friction_torque_n_m gravity_torque_n_m current_reference_a current_a current_mean_a voltage_v \
        flags contour_deviation_mm monitoring";
    assert!(AXIS_FIELDS.iter().map(|field| field.linear).eq(names.split_whitespace()));
    for field in &AXIS_FIELDS {
        assert_eq!(field.rotary, field.linear.replace("_mm", "_deg"));
    }
}

/// Each signal must come out in the field of its name: decoded by the generated types from bytes that the mcap crate read.
#[test]
fn every_signal_arrives_in_its_field() {
    let (machine, programs) = (machine(), programs());
    let bytes = recorded(&RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &programs), RUN_TICKS);
    let messages = seen(&bytes);
    let of = |topic: &str| messages.iter().filter(|m| m.topic == topic).cloned().collect::<Vec<_>>();

    for (k, message) in of("/axis/X").iter().enumerate() {
        let tick = Tick(k as u64 * POSITION_TICKS);
        assert_eq!((message.time_ns, message.sequence), (k as u64 * 1_000_000, k as u32));
        let read = LinearAxis::decode(&message.data[..]).unwrap();
        let x = |number| Some(signal(tick, AxisId::new(0), number));
        let expected = LinearAxis {
            position_setpoint_mm: x(0),
            position_reference_mm: x(1),
            position_actual_mm: x(2),
            position_measured_mm: x(3),
            control_deviation_mm: x(4),
            following_error_mm: x(5),
            velocity_setpoint_mm_s: x(6),
            acceleration_setpoint_mm_s2: x(7),
            jerk_setpoint_mm_s3: x(8),
            velocity_command_mm_s: x(9),
            velocity_feedforward_mm_s: x(10),
            velocity_actual_mm_s: x(11),
            motor_speed_reference_rad_s: x(12),
            motor_speed_rad_s: x(13),
            torque_reference_n_m: x(14),
            torque_feedforward_n_m: x(15),
            friction_torque_n_m: x(16),
            gravity_torque_n_m: x(17),
            current_reference_a: x(18),
            current_a: x(19),
            current_mean_a: x(20),
            voltage_v: x(21),
            flags: Some(k as u32 % 16),
            contour_deviation_mm: x(23),
            monitoring: Some(k as u32 % 32),
        };
        assert_eq!(read, expected, "at {tick:?}");
    }
    assert_eq!(of("/axis/X").len() as u64, RUN_TICKS / POSITION_TICKS + 1);

    let slow = of("/axis/C");
    assert_eq!(slow.len() as u64, RUN_TICKS / (2 * POSITION_TICKS) + 1);
    for (k, message) in slow.iter().enumerate() {
        let tick = Tick(k as u64 * 2 * POSITION_TICKS);
        let read = RotaryAxis::decode(&message.data[..]).unwrap();
        let degrees = |number| signal(tick, AxisId::new(2), number) * (180.0 / std::f64::consts::PI);
        assert_eq!(read.position_setpoint_deg, Some(degrees(0)));
        assert_eq!(read.jerk_setpoint_deg_s3, Some(degrees(8)));
        assert_eq!(read.velocity_actual_deg_s, Some(degrees(11)));
        assert_eq!(read.motor_speed_rad_s, Some(signal(tick, AxisId::new(2), 13)));
    }

    // Y has no drive: what only a drive makes is absent, not zero.
    let ideal = LinearAxis::decode(&of("/axis/Y")[1].data[..]).unwrap();
    assert_eq!(ideal.position_actual_mm, Some(signal(Tick(POSITION_TICKS), AxisId::new(1), 2)));
    assert_eq!((ideal.current_a, ideal.torque_reference_n_m, ideal.flags), (None, None, None));
}

#[test]
fn path_and_poses_are_in_customary_units() {
    let (machine, programs) = (machine(), programs());
    let bytes = recorded(&RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &programs), RUN_TICKS);
    let messages = seen(&bytes);
    let paths: Vec<Path> =
        messages.iter().filter(|m| m.topic == "/path").map(|m| Path::decode(&m.data[..]).unwrap()).collect();
    assert_eq!(paths.len() as u64, RUN_TICKS / TICKS_PER_SETPOINT + 1);
    for (k, path) in paths.iter().enumerate() {
        let degrees = if k % 4 == 3 { 180.0 / std::f64::consts::PI } else { 1.0 };
        assert_eq!(path.program.as_deref(), Some("main.mpf"));
        assert_eq!((path.line, path.block), (Some(k as u32 % 3 + 1), Some(k as u64 / 100 + 1)));
        assert_eq!(path.s_mm, Some(k as f64 * 0.1));
        assert_eq!(path.feed_mm_min, Some(50.0 * degrees * 60.0));
        assert_eq!(path.programmed_feed_mm_min, (k % 5 != 0).then_some(60.0 * degrees * 60.0));
        assert_eq!(path.acceleration_mm_s2, Some(1.0 / 3.0 * degrees));
        assert_eq!(path.limit_axis.as_deref(), (k % 2 == 0).then_some("C"));
        assert_eq!(path.limit_kind.as_deref(), Some("jerk"));
        assert_eq!((path.buffered_blocks, path.contour_error_mm), (Some(k as u32 % 9), Some(0.001)));
        assert_eq!(path.rotary_only, Some(k % 4 == 3));
    }
    let pose = messages.iter().rfind(|m| m.topic == "/tool/actual").unwrap();
    let read = PoseInFrame::decode(&pose.data[..]).unwrap();
    let time = read.timestamp.unwrap();
    assert_eq!((time.seconds, time.nanos, pose.time_ns), (1, 500_000_000, 1_500_000_000));
    let at = read.pose.unwrap();
    let position = at.position.unwrap();
    assert_eq!(
        (position.x, position.y, position.z),
        (Some((RUN_TICKS as f64 + 0.5) / 1000.0), Some(0.0), Some(-0.001))
    );
    assert_eq!(at.orientation.unwrap().w, Some(1.0));
}

#[test]
fn a_zero_is_written_and_read_back() {
    let machine = machine();
    let sink = Sink::default();
    let setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    let mut recorder = Recorder::to_writer(sink.clone(), &setup).unwrap();
    recorder.axis(Tick(0), AxisId::new(0), &Default::default(), &Default::default());
    recorder.finish("{}").unwrap();
    let message = &seen(&sink.bytes())[0];
    // 23 doubles of 9 or 10 bytes and two sets of bits: nothing is left out.
    assert_eq!(message.data.len(), 15 * 9 + 8 * 10 + 2 * 3);
    let recording = Recording::open(&file("zero.mcap", &sink.bytes())).unwrap();
    let Content::Axis(sample) = recording.messages().unwrap().next().unwrap().unwrap().content else { panic!() };
    assert!((0..AXIS_FIELD_COUNT).all(|field| sample.get(field) == Some(0.0)));
}

#[test]
fn our_reader_gives_what_the_mcap_crate_gives() {
    let (machine, programs) = (machine(), programs());
    let bytes = recorded(&RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &programs), RUN_TICKS);
    let recording = Recording::open(&file("reader.mcap", &bytes)).unwrap();
    let expected = seen(&bytes);
    assert_eq!(recording.message_count(), expected.len() as u64);
    let names: Vec<&str> = recording.topics().iter().map(|topic| topic.name.as_str()).collect();
    assert_eq!(names, ["/axis/X", "/axis/Y", "/axis/C", "/path", "/event", "/tool/setpoint", "/tool/actual"]);
    let ours: Vec<Message> = recording.messages().unwrap().map(Result::unwrap).collect();
    assert_eq!(ours.len(), expected.len());
    let position = axis_field("position_setpoint").unwrap();
    for (ours, theirs) in ours.iter().zip(&expected) {
        let topic = &recording.topics()[ours.topic];
        assert_eq!((&topic.name, ours.sequence, ours.time_ns), (&theirs.topic, theirs.sequence, theirs.time_ns));
        match &ours.content {
            Content::Axis(sample) if topic.schema == "sollwert.LinearAxis" => {
                let theirs = LinearAxis::decode(&theirs.data[..]).unwrap();
                assert_eq!(sample.get(position), theirs.position_setpoint_mm);
                assert_eq!(sample.get(axis_field("voltage_v").unwrap()), theirs.voltage_v);
            }
            Content::Axis(sample) => {
                let theirs = RotaryAxis::decode(&theirs.data[..]).unwrap();
                assert_eq!(sample.get(position), theirs.position_setpoint_deg);
            }
            Content::Path(path) => assert_eq!(**path, Path::decode(&theirs.data[..]).unwrap()),
            Content::Event(event) => assert_eq!(event.kind.as_deref(), Some("block_start")),
            Content::Pose(_, pose) => assert_eq!(**pose, PoseInFrame::decode(&theirs.data[..]).unwrap()),
            Content::Spindle(_) | Content::Programmed(_) | Content::Sample(_) | Content::Other(_) => {
                panic!("{}", topic.name)
            }
        }
    }
}

#[test]
fn a_recording_carries_its_inputs() {
    let (machine, programs) = (machine(), programs());
    let sink = Sink::default();
    let setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &programs);
    let mut recorder = Recorder::to_writer(sink.clone(), &setup).unwrap();
    record_tick(&mut recorder, &machine, Tick(0));
    let sub = program(1, "SUB.SPF", b"G1 X20\nM17\n");
    let block = BlockRef { line: 2, number: 7, ..BlockRef::default() };
    recorder.program_event(Tick(4), block, &Event::ProgramOpened(sub.clone()));
    recorder.program_event(Tick(4), block, &Event::SpindleSpeed { speed_rpm: 8000.0 });
    recorder.attach_program(Tick(8), &sub);
    let corner =
        EventRecord::Corner { angle_rad: 1.0, tolerance_mm: 0.06, transition_length_mm: 0.25, feed_mm_s: 5.97 };
    recorder.event(Tick(8), Some(block), corner);
    recorder.event(Tick(8), None, EventRecord::from(&Diagnostic::warning("W0001", "a word is not acted on")));
    let summary = recorder.finish(SUMMARY).unwrap();
    let recording = Recording::open(&file("inputs.mcap", &sink.bytes())).unwrap();
    assert_eq!(summary, RecordingSummary { bytes: sink.bytes().len() as u64, messages: recording.message_count() });

    assert_eq!(recording.programs().unwrap(), [programs[0].clone(), sub]);
    assert_eq!(recording.machine_text().unwrap(), Some(("test.toml".to_owned(), MACHINE_TEXT.to_owned())));
    let inputs = recording.metadata("inputs").unwrap();
    // By `sha256sum`.
    assert_eq!(inputs["SUB.SPF"], "5a99fddeefa30fde01162fc9a05329b864068a2e87c4ae81147723b6b6f430f4");
    assert_eq!(inputs.len(), 3);
    let about = recording.metadata("sollwert").unwrap();
    assert_eq!((about["format"].as_str(), about["program"].as_str()), ("1", "main.mpf"));
    assert_eq!(recording.metadata("cycle").unwrap()["setpoint_period_s"], "0.002");
    assert_eq!(recording.metadata("cycle").unwrap()["X.position_cycle_s"], "0.001");
    let axes = recording.metadata("axes").unwrap();
    assert_eq!(
        (axes["order"].as_str(), axes["Y.drive"].as_str(), axes["X.drive"].as_str()),
        ("X,Y,C", "ideal", "representative")
    );
    assert_eq!(recording.metadata("units").unwrap()["jerk_setpoint_deg_s3"], "deg/s^3");
    assert_eq!(
        recording.summary().unwrap(),
        serde_json::json!({"format": 1, "program": "main.mpf", "cycle_time_s": 0.1, "limits": {"feed": 0.25, "X.jerk": 0.75}})
    );

    let events: Vec<_> = recording
        .messages()
        .unwrap()
        .filter_map(|m| if let Content::Event(event) = m.unwrap().content { Some(event) } else { None })
        .collect();
    let kinds: Vec<&str> = events.iter().filter_map(|event| event.kind.as_deref()).collect();
    assert_eq!(kinds, ["block_start", "program", "s", "corner", "warning"]);
    assert_eq!((events[2].speed_rpm, events[2].line, events[2].block), (Some(8000.0), Some(2), Some(7)));
    assert_eq!((events[3].angle_deg, events[3].feed_mm_s), (Some(180.0 / std::f64::consts::PI), Some(5.97)));
    assert_eq!((events[4].code.as_deref(), events[4].line), (Some("W0001"), None));
}

#[test]
fn equal_runs_give_equal_bytes_from_any_folder_at_any_speed() {
    let (machine, programs) = (machine(), programs());
    let setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &programs);
    let fast = recorded(&setup, RUN_TICKS);
    let slow = Sink { delay: Duration::from_millis(20), ..Sink::default() };
    let mut recorder = Recorder::to_writer(slow.clone(), &setup).unwrap();
    record_run(&mut recorder, &machine, RUN_TICKS);
    recorder.finish(SUMMARY).unwrap();
    assert!(fast == slow.bytes());

    let folder = temporary("a folder with a name of its own");
    std::fs::create_dir_all(&folder).unwrap();
    let mut recorder = Recorder::to_file(&folder.join("run.mcap"), &setup).unwrap();
    record_run(&mut recorder, &machine, RUN_TICKS);
    recorder.finish(SUMMARY).unwrap();
    let written = std::fs::read(folder.join("run.mcap")).unwrap();
    assert!(fast == written);
    for secret in ["name of its own", "someone", "out.mcap"] {
        assert!(!written.windows(secret.len()).any(|window| window == secret.as_bytes()), "{secret}");
    }
}

#[test]
fn a_chunk_ends_with_its_second_or_at_one_mebibyte() {
    let machine = machine();
    let setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    let bytes = recorded(&setup, 4 * TICKS_PER_S + 3);
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let seconds: Vec<u64> =
        summary.chunk_indexes.iter().map(|chunk| chunk.message_start_time / 1_000_000_000).collect();
    assert_eq!(seconds, [0, 1, 2, 3, 4]);
    for chunk in &summary.chunk_indexes {
        assert_eq!(chunk.message_start_time / 1_000_000_000, chunk.message_end_time / 1_000_000_000);
    }
    // Every tick of 0.25 ms: more than a mebibyte a second. The first chunk has the declarations besides.
    let sink = Sink::default();
    let mut recorder = Recorder::to_writer(sink.clone(), &setup).unwrap();
    for tick in 0..TICKS_PER_S {
        for axis in [0, 2].map(AxisId::new) {
            recorder.axis(Tick(tick), axis, &setpoint(Tick(tick), axis), &signals(Tick(tick), axis));
        }
    }
    recorder.finish("{}").unwrap();
    let chunks = mcap::Summary::read(&sink.bytes()).unwrap().unwrap().chunk_indexes;
    assert_eq!(chunks.len(), 2);
    assert!((1_048_576..1_070_000).contains(&chunks[0].uncompressed_size), "{}", chunks[0].uncompressed_size);
}

#[test]
fn without_compression_the_messages_are_the_same() {
    let machine = machine();
    let mut setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    let packed = seen(&recorded(&setup, RUN_TICKS));
    setup.compression = Compression::None;
    let bytes = recorded(&setup, RUN_TICKS);
    assert!(seen(&bytes) == packed);
    let recording = Recording::open(&file("unpacked.mcap", &bytes)).unwrap();
    assert_eq!(recording.messages().unwrap().map(Result::unwrap).count(), packed.len());
}

/// Polls until `done`, for writer threads that work meanwhile.
fn wait_until(done: impl Fn() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < Duration::from_secs(30), "the writer does not come along");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_finished_second_and_an_alarm_are_on_the_disk_at_once() {
    let machine = machine();
    let sink = Sink::default();
    let setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    let mut recorder = Recorder::to_writer(sink.clone(), &setup).unwrap();
    let chunks = || {
        let bytes = sink.bytes();
        frames(&bytes)
            .iter()
            .filter(|(opcode, _, end)| *opcode == mcap::records::op::CHUNK && *end <= bytes.len())
            .count()
    };
    // One tick into second 2: seconds 0 and 1 must be there, although the recorder still holds the rest.
    record_run(&mut recorder, &machine, 2 * TICKS_PER_S);
    wait_until(|| chunks() == 2);
    let alarm = EventRecord::Alarm { code: "A0001", message: "the axis is past its limit".into() };
    recorder.event(Tick(2 * TICKS_PER_S), None, alarm);
    wait_until(|| chunks() == 3);
    let killed = file("killed.mcap", &sink.bytes());
    let rescued = temporary("killed-rescued.mcap");
    recover(&killed, &rescued).unwrap();
    let last = seen(&std::fs::read(&rescued).unwrap()).pop().unwrap();
    assert_eq!((last.topic.as_str(), last.time_ns), ("/event", 2_000_000_000));
    recorder.finish("{}").unwrap();
}

#[test]
fn a_dropped_recorder_leaves_an_unfinished_file_with_all_it_had() {
    let machine = machine();
    let path = temporary("dropped.mcap");
    let setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    let mut recorder = Recorder::to_file(&path, &setup).unwrap();
    record_run(&mut recorder, &machine, TICKS_PER_S);
    drop(recorder);
    let refused = Recording::open(&path).unwrap_err();
    assert_eq!(refused.code, "R0013");
    assert!(refused.help.unwrap().contains("sollwert recover"));
    let rescued = temporary("dropped-rescued.mcap");
    recover(&path, &rescued).unwrap();
    assert_eq!(seen(&std::fs::read(&rescued).unwrap()).last().unwrap().time_ns, 1_000_000_000);
}

#[test]
fn a_full_disk_is_told_and_leaves_no_file_that_looks_whole() {
    let machine = machine();
    let setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    let whole = recorded(&setup, 20 * TICKS_PER_S);
    for room in [whole.len() / 3, whole.len() - 100, whole.len() - 20_000] {
        let sink = Sink { room: Some(room), ..Sink::default() };
        let mut recorder = Recorder::to_writer(sink.clone(), &setup).unwrap();
        record_run(&mut recorder, &machine, 20 * TICKS_PER_S);
        if room < whole.len() / 2 {
            wait_until(|| recorder.check().is_err());
        }
        let fault = recorder.finish(SUMMARY).unwrap_err();
        assert_eq!(fault.code, "R0002");
        assert!(fault.message.contains("no storage space"), "{}", fault.message);
        let left = sink.bytes();
        assert!(left.len() <= room && !left.ends_with(mcap::MAGIC));
        assert_eq!(Recording::open(&file("full.mcap", &left)).unwrap_err().code, "R0013");
    }
    let nowhere = temporary("no such folder").join("run.mcap");
    let fault = Recorder::to_file(&nowhere, &setup).err().unwrap();
    assert!(fault.message.contains("no such folder"), "{}", fault.message);
}

#[test]
fn precision_keeps_so_many_mantissa_bits() {
    let machine = machine();
    let mut setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    let exact = recorded(&setup, RUN_TICKS);
    setup.mantissa_bits = Some(36);
    let rounded = recorded(&setup, RUN_TICKS);
    assert!(rounded.len() < exact.len());
    for (rounded, exact) in seen(&rounded).iter().zip(seen(&exact)).filter(|(m, _)| m.topic == "/axis/X") {
        let rounded = LinearAxis::decode(&rounded.data[..]).unwrap();
        let exact = LinearAxis::decode(&exact.data[..]).unwrap();
        let (rounded, exact) = (rounded.voltage_v.unwrap(), exact.voltage_v.unwrap());
        assert_eq!(rounded.to_bits() & 0xffff, 0);
        assert!((rounded - exact).abs() <= exact.abs() * 2.0_f64.powi(-37));
    }
    for bits in [0, 53] {
        setup.mantissa_bits = Some(bits);
        assert_eq!(Recorder::to_writer(Sink::default(), &setup).err().unwrap().code, "R0021");
    }
}

#[test]
fn decimation_keeps_the_first_and_the_last_sample() {
    let machine = machine();
    let mut setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    setup.decimation = NonZeroU32::new(10).unwrap();
    let messages = seen(&recorded(&setup, 25 * POSITION_TICKS));
    let times = |topic: &str| -> Vec<u64> {
        messages.iter().filter(|m| m.topic == topic).map(|m| m.time_ns / 1_000_000).collect()
    };
    assert_eq!(times("/axis/X"), [0, 10, 20, 25]);
    assert_eq!(times("/axis/C"), [0, 20, 24]);
    assert_eq!(times("/path"), [0, 20, 24]);
}

/// For the independent readers, until the command can run a program: `cargo test --test recorder -- --ignored`, then
/// `tests/readers/read_python.py target/tmp/recorder/readers.mcap`.
#[test]
#[ignore = "writes a file for other programs"]
fn write_a_recording_for_other_readers() {
    let (machine, programs) = (machine(), programs());
    let bytes = recorded(&RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &programs), 3 * TICKS_PER_S);
    let path = file("readers.mcap", &bytes);
    export(&Recording::open(&path).unwrap(), &temporary("readers.csv")).unwrap();
}
