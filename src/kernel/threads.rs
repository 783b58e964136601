//! Preparation on a thread of its own, and the reading of the program on another one, joined to each other and to the cycle by bounded channels of
//! batches.
//!
//! In: a [`Preparation`], a [`Reading`]. Out: a [`PieceSource`] and a [`Reader`] that give the same pieces in the same order. The length of a channel only
//! decides how much memory is used and who waits: what is planned does not depend on it. Where the program asks for the time of the main run
//! (STOPRE), both threads wait until the cycle has come there and has told how long block ends waited.

use super::preparation::{Findings, PieceSource, Preparation};
use super::reading::{Reader, Reading, Step};
use crate::base::Diagnostic;
use crate::feed::PlannedPiece;
use crate::interpreter::MainRun;
use crate::smoothing::ContourPiece;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::collections::VecDeque;
use std::thread::JoinHandle;

/// Pieces a message: enough that the channel is not the cost.
const BATCH_PIECES: usize = 64;
/// Messages in flight.
const BATCHES: usize = 16;

enum Message {
    /// Each piece with the warnings of its preparation: what a run has to say after an alarm of a drive depends on the pieces that it
    /// reached, not on how far this thread was.
    Pieces(Vec<(PlannedPiece, Vec<Diagnostic>)>),
    /// Preparation goes on when it is told how long block ends have waited.
    Stopped,
    Ended(Findings),
}

/// The receiving end.
pub(super) struct PreparationThread {
    messages: Option<Receiver<Message>>,
    ready: VecDeque<(PlannedPiece, Vec<Diagnostic>)>,
    findings: Findings,
    waited_s: f64,
    answers: Option<Sender<f64>>,
    worker: Option<JoinHandle<()>>,
}

impl PreparationThread {
    /// Moves `preparation` to a new thread. Errors if the system gives no thread.
    pub(super) fn spawn<R: Reader + Send + 'static>(mut preparation: Preparation<R>) -> std::io::Result<Self> {
        let (send, messages) = bounded(BATCHES);
        let (answers, told) = bounded(1);
        let worker = std::thread::Builder::new().name("preparation".into()).spawn(move || {
            let mut ended = false;
            while !ended {
                let mut batch = Vec::with_capacity(BATCH_PIECES);
                while batch.len() < BATCH_PIECES && !ended {
                    match preparation.piece_ahead() {
                        Some(piece) => batch.push((piece, preparation.take_warnings())),
                        None => ended = true,
                    }
                }
                // A closed channel means that the cycle has given up (a drive alarm): stop preparing.
                if send.send(Message::Pieces(batch)).is_err() {
                    return;
                }
                if preparation.stopped() {
                    if send.send(Message::Stopped).is_err() {
                        return;
                    }
                    let Ok(waited_s) = told.recv() else { return };
                    preparation.waited(waited_s);
                    preparation.go_on();
                    ended = false;
                }
            }
            let _ = send.send(Message::Ended(preparation.take_findings()));
        })?;
        Ok(Self {
            messages: Some(messages),
            ready: VecDeque::new(),
            findings: Findings::default(),
            waited_s: 0.0,
            answers: Some(answers),
            worker: Some(worker),
        })
    }
}

impl PieceSource for PreparationThread {
    fn next_piece(&mut self) -> Option<PlannedPiece> {
        while self.ready.is_empty() {
            match self.messages.as_ref()?.recv() {
                Ok(Message::Pieces(batch)) => self.ready.extend(batch),
                Ok(Message::Stopped) => {
                    // A thread that is gone is noticed at the next message.
                    let _ = self.answers.as_ref()?.send(self.waited_s);
                }
                Ok(Message::Ended(findings)) => {
                    self.findings.warnings.extend(findings.warnings);
                    self.findings.alarm = findings.alarm;
                    self.messages = None;
                }
                Err(_) => {
                    self.findings.alarm = Some(broke_down());
                    self.messages = None;
                }
            }
        }
        let (piece, warnings) = self.ready.pop_front()?;
        self.findings.warnings.extend(warnings);
        Some(piece)
    }

    fn waited(&mut self, waited_s: f64) {
        self.waited_s = waited_s;
    }

    fn take_findings(&mut self) -> Findings {
        std::mem::take(&mut self.findings)
    }
}

impl Drop for PreparationThread {
    fn drop(&mut self) {
        (self.messages, self.answers) = (None, None);
        if let Some(worker) = self.worker.take() {
            // A panic in preparation was printed by its own thread; here it must not become a second one.
            let _ = worker.join();
        }
    }
}

/// A thread is gone without its findings: half a program must not look like a whole one.
fn broke_down() -> Diagnostic {
    let message = "preparation broke down: the run ends here, and its figures are not those of the program";
    Diagnostic::error("K0005", message).help("please report this, with the program")
}

/// Blocks a message: few enough that what one thread has written the other still finds near its processor.
const BATCH_STEPS: usize = 32;

/// Blocks in order: how many of the pieces are theirs, and what they had to say, if anything.
struct Blocks {
    pieces: Vec<ContourPiece>,
    steps: Vec<(usize, Option<Box<Step>>)>,
}

/// The receiving end of a reader.
pub(super) struct ReadingThread {
    blocks: Option<Receiver<Blocks>>,
    pieces: std::vec::IntoIter<ContourPiece>,
    steps: std::vec::IntoIter<(usize, Option<Box<Step>>)>,
    answers: Option<Sender<MainRun>>,
    worker: Option<JoinHandle<()>>,
}

impl ReadingThread {
    /// Moves `reading` to a new thread. Errors if the system gives no thread.
    pub(super) fn spawn(mut reading: Reading) -> std::io::Result<Self> {
        let (send, blocks) = bounded(BATCHES);
        let (answers, told) = bounded(1);
        let worker = std::thread::Builder::new().name("reading".into()).spawn(move || {
            loop {
                // As many pieces as blocks, or a blend between each two of them.
                let (pieces, steps) = (Vec::with_capacity(2 * BATCH_STEPS), Vec::with_capacity(BATCH_STEPS));
                let mut batch = Blocks { pieces, steps };
                let (mut stops, mut ends) = (false, false);
                while batch.steps.len() < BATCH_STEPS && !stops && !ends {
                    let known = batch.pieces.len();
                    let step = reading.step(&mut |piece| batch.pieces.push(piece));
                    (stops, ends) = (step.stops, step.ends);
                    batch.steps.push((batch.pieces.len() - known, (!step.is_plain()).then(|| Box::new(step))));
                }
                // A closed channel means that preparation has given up.
                if send.send(batch).is_err() || ends {
                    return;
                }
                if stops {
                    let Ok(main_run) = told.recv() else { return };
                    reading.tell_main_run(main_run);
                }
            }
        })?;
        Ok(Self {
            blocks: Some(blocks),
            pieces: Vec::new().into_iter(),
            steps: Vec::new().into_iter(),
            answers: Some(answers),
            worker: Some(worker),
        })
    }
}

impl Reader for ReadingThread {
    fn step(&mut self, piece: &mut impl FnMut(ContourPiece)) -> Step {
        loop {
            if let Some((count, step)) = self.steps.next() {
                self.pieces.by_ref().take(count).for_each(piece);
                return step.map(|step| *step).unwrap_or_default();
            }
            match self.blocks.as_ref().and_then(|blocks| blocks.recv().ok()) {
                Some(next) => (self.pieces, self.steps) = (next.pieces.into_iter(), next.steps.into_iter()),
                None => return Step { alarm: Some(broke_down()), ends: true, ..Step::default() },
            }
        }
    }

    fn tell_main_run(&mut self, main_run: MainRun) {
        // A thread that is gone is noticed at the next step.
        let _ = self.answers.as_ref().map(|answers| answers.send(main_run));
    }
}

impl Drop for ReadingThread {
    fn drop(&mut self) {
        (self.blocks, self.answers) = (None, None);
        if let Some(worker) = self.worker.take() {
            // A panic was printed by its own thread; here it must not become a second one.
            let _ = worker.join();
        }
    }
}
