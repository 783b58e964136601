//! The thread that packs chunks and writes the file, while the writer's thread encodes the next chunk.
//!
//! In: [`Piece`]s in the order of the file. Out: bytes; emptied chunks for another turn. Packing is the larger half of the work of a recording. One thread
//! packs all chunks in their order, and where a chunk ends is decided before, so that no byte depends on how many processors there are. When the
//! disk is slower than the run the writer waits for an empty chunk: memory stays bounded.

use super::mcap_file::{AttachmentHead, McapFile, RawChunk};
use super::setup::{INPUTS_METADATA, PROGRAM_MEDIA_TYPE, SUMMARY_METADATA, input_metadata};
use super::writer::{Fault, RecordingSummary, write_fault};
use crate::base::Diagnostic;
use crate::program::OpenedProgram;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::collections::BTreeMap;
use std::io;
use std::thread::JoinHandle;

/// Chunks on the way at most: one being filled, one waiting, one being packed.
const CHUNKS: usize = 3;

/// What comes next in the file.
pub(super) enum Piece {
    Chunk(RawChunk),
    /// A program that was opened at `time_ns`.
    Program {
        program: OpenedProgram,
        time_ns: u64,
    },
    /// The figures of the run; then the index. Without it the file stays unfinished.
    Finish(BTreeMap<String, String>),
}

/// The sending end.
pub(super) struct Packing {
    /// `None` once everything is sent.
    pieces: Option<Sender<Piece>>,
    empty: Receiver<RawChunk>,
    thread: Option<JoinHandle<Option<RecordingSummary>>>,
}

impl Packing {
    /// Moves `file` to a new thread. The first fault is put into `fault` at once, so that the cycle sees it.
    pub(super) fn start(file: McapFile, name: String, fault: Fault) -> Result<Self, Diagnostic> {
        let (pieces, pieces_out) = bounded(CHUNKS);
        let (emptied, empty) = bounded(CHUNKS);
        for _ in 1..CHUNKS {
            // Never full: it holds all chunks there are.
            let _ = emptied.try_send(RawChunk::default());
        }
        let thread = std::thread::Builder::new()
            .name("packer".to_owned())
            .spawn(move || work(file, &name, &pieces_out, &emptied, &fault))
            .map_err(|error| Diagnostic::error("R0002", format!("the recorder's thread does not start: {error}")))?;
        Ok(Self { pieces: Some(pieces), empty, thread: Some(thread) })
    }

    /// Sends a full chunk and takes an empty one for it.
    pub(super) fn swap(&mut self, chunk: &mut RawChunk) {
        // A thread that is gone is noticed by `finish`.
        let next = self.empty.recv().unwrap_or_default();
        self.send(Piece::Chunk(std::mem::replace(chunk, next)));
    }

    /// Sends anything.
    pub(super) fn send(&mut self, piece: Piece) {
        if let Some(pieces) = &self.pieces {
            let _ = pieces.send(piece);
        }
    }

    /// Waits for the thread. `None`: the file was not finished, for the fault that is told if there is one.
    pub(super) fn finish(&mut self) -> Option<RecordingSummary> {
        self.pieces = None;
        self.thread.take()?.join().ok()?
    }
}

impl Drop for Packing {
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

fn work(
    mut file: McapFile,
    name: &str,
    pieces: &Receiver<Piece>,
    emptied: &Sender<RawChunk>,
    fault: &Fault,
) -> Option<RecordingSummary> {
    while let Ok(piece) = pieces.recv() {
        let written = match piece {
            Piece::Chunk(mut chunk) => {
                let written = if fault.get().is_none() { file.write_chunk(&chunk) } else { Ok(()) };
                chunk.clear();
                // Nobody takes chunks back while the recorder is being finished.
                let _ = emptied.try_send(chunk);
                written
            }
            Piece::Program { program, time_ns } => attach_program(&mut file, &program, time_ns)
                .and_then(|()| file.write_metadata(INPUTS_METADATA, &input_metadata(&program)?)),
            Piece::Finish(summary) => {
                if fault.get().is_some() {
                    return None;
                }
                match finish(file, &summary) {
                    Ok(summary) => return Some(summary),
                    Err(error) => {
                        let _ = fault.set(write_fault(name, &error.into()));
                        return None;
                    }
                }
            }
        };
        if let Err(error) = written {
            // The only one who sets it is this thread.
            let _ = fault.set(write_fault(name, &error.into()));
        }
    }
    None
}

fn finish(mut file: McapFile, summary: &BTreeMap<String, String>) -> io::Result<RecordingSummary> {
    file.write_metadata(SUMMARY_METADATA, summary)?;
    let messages = file.messages();
    Ok(RecordingSummary { bytes: file.finish()?, messages })
}

/// Stretch by stretch: a program may be larger than the memory.
pub(super) fn attach_program(file: &mut McapFile, program: &OpenedProgram, time_ns: u64) -> io::Result<()> {
    let bytes = program.bytes.length() as u64;
    let head = AttachmentHead { time_ns, name: &program.name, media_type: PROGRAM_MEDIA_TYPE, bytes };
    file.attach(&head, |each| program.bytes.pass(0, each))
}
