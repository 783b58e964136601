//! Preparation on a thread of its own, joined to the cycle by a bounded channel of batches.
//!
//! In: a [`Preparation`]. Out: a [`PieceSource`] that gives the same pieces in the same order. The channel's length only decides how
//! much memory is used and who waits: what is planned does not depend on it. Where the program asks for the time of the main run
//! (STOPRE), the thread waits until the cycle has come there and has told how long block ends waited.

use super::preparation::{Findings, PieceSource, Preparation};
use crate::base::Diagnostic;
use crate::feed::PlannedPiece;
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
    pub(super) fn spawn(mut preparation: Preparation) -> std::io::Result<Self> {
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
                    // The thread is gone without its findings: half a program must not look like a whole one.
                    let message =
                        "preparation broke down: the run ends here, and its figures are not those of the program";
                    let alarm = Diagnostic::error("K0005", message).help("please report this, with the program");
                    self.findings.alarm = Some(alarm);
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
