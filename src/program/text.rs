//! Bytes of a program file: small ones in memory, large ones on the disk.
//!
//! In: a path, or bytes. Out: [`ProgramText`], which reads any stretch of them. A large file is never held as a whole: memory does
//! not grow with the length of the program. A file that changes while it is read is an error, because its lines would no longer
//! be where they were found. Does not know characters or lines.

use std::fs::{File, Metadata};
use std::io;
use std::path::Path;
use std::sync::Arc;

/// Longest file that is held in memory.
const HELD_BYTES_MAX: u64 = 4 * 1024 * 1024;
/// Bytes read at a time in a pass over a whole file.
const PASS_BYTES: usize = 256 * 1024;

/// Bytes of a program as they are on the disk. Cheap to clone.
#[derive(Clone, Debug)]
pub enum ProgramText {
    /// In memory.
    Held(Arc<[u8]>),
    /// On the disk.
    Streamed(Arc<StreamedFile>),
}

/// An open file of a stated length.
#[derive(Debug)]
pub struct StreamedFile {
    file: File,
    length: usize,
    /// As it was opened.
    metadata: Metadata,
}

impl ProgramText {
    /// Opens a file; reads it if it is small.
    pub fn open(path: &Path) -> io::Result<Self> {
        Self::open_holding(path, HELD_BYTES_MAX)
    }

    /// As [`Self::open`], with another length up to which a file is held in memory.
    pub fn open_holding(path: &Path, held_bytes_max: u64) -> io::Result<Self> {
        let file = File::open(path)?;
        let metadata = file.metadata()?;
        // A pipe has no length, and cannot be read twice.
        if !metadata.is_file() || metadata.len() <= held_bytes_max {
            return std::fs::read(path).map(|bytes| Self::Held(bytes.into()));
        }
        let length = usize::try_from(metadata.len()).map_err(|_| io::Error::other("the file is too large"))?;
        Ok(Self::Streamed(Arc::new(StreamedFile { file, length, metadata })))
    }

    /// Number of bytes.
    pub fn length(&self) -> usize {
        match self {
            Self::Held(bytes) => bytes.len(),
            Self::Streamed(streamed) => streamed.length,
        }
    }

    /// The bytes of a text that is held in memory.
    pub fn held(&self) -> Option<&Arc<[u8]>> {
        match self {
            Self::Held(bytes) => Some(bytes),
            Self::Streamed(_) => None,
        }
    }

    /// At most `length` bytes from `offset` on; fewer at the end only. A held text hands out all it has, from 0: the second value
    /// is the offset of the first byte.
    pub(super) fn stretch(&self, offset: usize, length: usize) -> io::Result<(Arc<[u8]>, usize)> {
        match self {
            Self::Held(bytes) => Ok((bytes.clone(), 0)),
            Self::Streamed(streamed) => streamed.read(offset, length).map(|bytes| (bytes.into(), offset)),
        }
    }

    /// Hands out the text from `start` on, stretch by stretch, until `use_it` returns false.
    pub fn pass(&self, start: usize, mut use_it: impl FnMut(&[u8]) -> bool) -> io::Result<()> {
        match self {
            Self::Held(bytes) => {
                use_it(bytes.get(start..).unwrap_or_default());
            }
            Self::Streamed(streamed) => {
                let mut offset = start;
                while offset < streamed.length {
                    let bytes = streamed.read(offset, PASS_BYTES)?;
                    offset += bytes.len();
                    if !use_it(&bytes) {
                        break;
                    }
                }
            }
        }
        Ok(())
    }
}

impl StreamedFile {
    fn read(&self, offset: usize, length: usize) -> io::Result<Vec<u8>> {
        let metadata = self.file.metadata()?;
        if metadata.len() != self.length as u64 || metadata.modified().ok() != self.metadata.modified().ok() {
            return Err(io::Error::other("it was changed while it was being read"));
        }
        let mut bytes = vec![0; length.min(self.length.saturating_sub(offset))];
        let mut done = 0;
        while done < bytes.len() {
            match read_at(&self.file, &mut bytes[done..], (offset + done) as u64) {
                Ok(0) => return Err(io::Error::other("it was changed while it was being read")),
                Ok(count) => done += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(bytes)
    }
}

#[cfg(unix)]
fn read_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, bytes, offset)
}

#[cfg(windows)]
fn read_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, bytes, offset)
}

impl PartialEq for ProgramText {
    /// Equal bytes, as far as they are at hand; a file on the disk equals itself only.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Held(one), Self::Held(other)) => one == other,
            (Self::Streamed(one), Self::Streamed(other)) => Arc::ptr_eq(one, other),
            _ => false,
        }
    }
}

impl Eq for ProgramText {}

impl<T: Into<Arc<[u8]>>> From<T> for ProgramText {
    fn from(bytes: T) -> Self {
        Self::Held(bytes.into())
    }
}
