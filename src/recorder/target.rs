//! Where bytes go: a recording in place, or a file that appears whole or not at all.
//!
//! In: a path or any writer. Out: [`Target`], which counts, and [`WholeFile`], which is renamed into place when it is done.
//! A recording is written in place, because what a killed run leaves must be found under the name that the user gave.

use crate::base::Diagnostic;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Bytes gathered before a call to the operating system; chunks pass at once.
const BUFFER_BYTES: usize = 64 * 1024;

/// Any place for bytes, with a counter.
pub(crate) struct Target {
    sink: BufWriter<Box<dyn Write + Send>>,
    /// To wait for the disk in the end; `None` for pipes and writers in memory.
    file: Option<File>,
    bytes: u64,
}

impl Target {
    /// Creates or empties a file.
    pub(crate) fn file(path: &Path) -> io::Result<Self> {
        let file = File::create(path)?;
        let regular = file.metadata()?.is_file();
        let handle = if regular { Some(file.try_clone()?) } else { None };
        Ok(Self { sink: BufWriter::with_capacity(BUFFER_BYTES, Box::new(file)), file: handle, bytes: 0 })
    }

    /// Takes any writer.
    pub(crate) fn writer(writer: impl Write + Send + 'static) -> Self {
        Self { sink: BufWriter::with_capacity(BUFFER_BYTES, Box::new(writer)), file: None, bytes: 0 }
    }

    /// Bytes so far.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Pushes everything out and waits for the disk: some disks report only then that they are full.
    pub(crate) fn complete(&mut self) -> io::Result<()> {
        self.sink.flush()?;
        self.file.as_ref().map_or(Ok(()), File::sync_all)
    }
}

impl Write for Target {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        if std::thread::panicking() {
            // The MCAP writer finishes its file when it is dropped: a broken run must not look whole.
            return Err(io::Error::other("the recorder broke down"));
        }
        let written = self.sink.write(buffer)?;
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.sink.flush()
    }
}

/// A file that gets its name when it is complete. Dropped before, it leaves nothing behind.
pub(crate) struct WholeFile {
    shown: String,
    path: PathBuf,
    /// `None`: the path is a device or a pipe, which is written to directly.
    temporary: Option<PathBuf>,
}

impl WholeFile {
    /// Opens `NAME.partial` beside the path.
    pub(crate) fn create(path: &Path) -> Result<(Self, Target), Diagnostic> {
        let shown = path.display().to_string();
        let existing = fs::metadata(path).ok();
        if existing.as_ref().is_some_and(fs::Metadata::is_dir) {
            return Err(Diagnostic::error("R0004", format!("{shown} is a folder, not a file"))
                .help("give the name of a file in it"));
        }
        let temporary = existing.is_none_or(|data| data.is_file()).then(|| {
            let mut name = path.file_name().unwrap_or_default().to_owned();
            name.push(".partial");
            path.with_file_name(name)
        });
        let target = Target::file(temporary.as_deref().unwrap_or(path));
        let whole = Self { shown, path: path.to_owned(), temporary };
        match target {
            Ok(target) => Ok((whole, target)),
            Err(error) => Err(whole.fault(&error)),
        }
    }

    /// Nothing is under its name before it is complete: no device or pipe.
    pub(crate) fn is_replaced(&self) -> bool {
        self.temporary.is_some()
    }

    /// Completes the bytes and gives the file its name.
    pub(crate) fn commit(mut self, mut target: Target) -> Result<u64, Diagnostic> {
        target.complete().map_err(|error| self.fault(&error))?;
        let bytes = target.bytes();
        drop(target);
        if let Some(temporary) = &self.temporary {
            fs::rename(temporary, &self.path).map_err(|error| self.fault(&error))?;
        }
        self.temporary = None;
        Ok(bytes)
    }

    /// A fault of this file.
    pub(crate) fn fault(&self, error: &io::Error) -> Diagnostic {
        Diagnostic::error("R0004", format!("{} cannot be written: {error}", self.shown))
            .help("make room or choose another place; nothing was left behind")
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            // The fault that led here is what the user must know; a left-over file says itself what it is.
            let _ = fs::remove_file(temporary);
        }
    }
}
