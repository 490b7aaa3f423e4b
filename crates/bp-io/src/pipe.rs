//! Writes to named pipes, which may have no reader, without waiting for one for ever.

use std::{
    fs::{File, OpenOptions},
    io::{self, ErrorKind, Write},
    os::unix::fs::OpenOptionsExt,
    path::Path,
    thread,
    time::Duration,
};

/// How soon a reader that comes, or a stop, is noticed.
const OPENING: Duration = Duration::from_millis(20);

/// How soon it is noticed that the reader has read.
const WRITING: Duration = Duration::from_millis(1);

/// A named pipe that is written until `is_stopped` says so.
pub(crate) struct Pipe {
    file: File,
    is_stopped: fn() -> bool,
}

impl Pipe {
    /// Waits for a reader.
    pub(crate) fn open(path: &Path, is_stopped: fn() -> bool) -> io::Result<Self> {
        loop {
            match OpenOptions::new().write(true).custom_flags(libc::O_NONBLOCK).open(path) {
                Err(error) if error.raw_os_error() == Some(libc::ENXIO) => wait(OPENING, is_stopped)?,
                opened => return opened.map(|file| Self { file, is_stopped }),
            }
        }
    }
}

impl Write for Pipe {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        loop {
            match self.file.write(bytes) {
                Err(error) if error.kind() == ErrorKind::WouldBlock => wait(WRITING, self.is_stopped)?,
                written => return written,
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

fn wait(time: Duration, is_stopped: fn() -> bool) -> io::Result<()> {
    if is_stopped() {
        return Err(io::Error::other("interrupted while nobody reads it"));
    }
    thread::sleep(time);
    Ok(())
}
