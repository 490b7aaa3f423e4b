//! Writes files whole or not at all.

#[cfg(unix)]
use std::os::unix::fs::FileTypeExt as _;
use std::{
    fmt::Display,
    fs,
    io::{self, BufWriter, ErrorKind, Write},
    path::{Path, PathBuf},
};

use serde::Serialize;
use tempfile::{NamedTempFile, TempPath};

#[cfg(unix)]
use crate::pipe::Pipe;
use crate::{
    Error,
    folders::{folder_of, is_folder, sync_folder_of},
};

/// Writes temporary files in the folder of the final file and renames them.
#[derive(Clone, Debug)]
pub struct Files {
    /// The prefix of the names of temporary files, by which those of a killed process can be found.
    temporary: String,
    /// The folder below which no links are followed, if any.
    owned: Option<PathBuf>,
    /// Whether to stop waiting for the reader of a pipe.
    is_stopped: Option<fn() -> bool>,
}

/// Temporary files are named `.bp-` and random characters.
impl Default for Files {
    fn default() -> Self {
        Self { temporary: Self::PREFIX.to_owned(), owned: None, is_stopped: None }
    }
}

impl Files {
    /// The prefix of the names of all temporary files.
    pub const PREFIX: &str = ".bp-";

    /// Files whose temporary names begin with [`Files::PREFIX`], `owner` and a hyphen.
    #[must_use]
    pub fn of(owner: &str) -> Self {
        Self { temporary: format!("{}{owner}-", Self::PREFIX), ..Self::default() }
    }

    /// The same, but below `folder` only regular files are written, and only folders are entered. A link there, which another
    /// user of the folder may have made, would otherwise replace a file elsewhere.
    #[must_use]
    pub fn owning(self, folder: &Path) -> Self {
        Self { owned: Some(folder.to_owned()), ..self }
    }

    /// The same, but a write to a named pipe, which waits for its reader, fails as soon as `is_stopped` says so.
    #[must_use]
    pub fn stopping(self, is_stopped: fn() -> bool) -> Self {
        Self { is_stopped: Some(is_stopped), ..self }
    }

    /// Fails if a path below [`Files::owning`] is anything but a regular file or nothing, in folders.
    ///
    /// # Errors
    /// [`Error::Write`], with the link or the other thing that is in the way.
    pub fn check_own(&self, path: &Path) -> Result<(), Error> {
        let Some(folder) = &self.owned else { return Ok(()) };
        let Ok(below) = path.strip_prefix(folder) else { return Ok(()) };
        let mut at = folder.clone();
        for part in below {
            at.push(part);
            // Where nothing is, nothing is below it either.
            let Ok(about) = at.symlink_metadata() else { break };
            if about.is_symlink() {
                return Err(Error::writing(&at, &"it is a link, which could lead out of the output folder; remove it"));
            }
            if at == path && !about.is_file() && !about.is_dir() {
                return Err(Error::writing(&at, &"it is not a regular file; remove it"));
            }
        }
        Ok(())
    }

    /// The prefix of the names of these temporary files.
    #[must_use]
    pub fn prefix(&self) -> &str {
        &self.temporary
    }

    /// Writes a file that `write` fills. On failure, an existing file stays as it was.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn whole<E: Display>(
        &self,
        path: &Path,
        write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
    ) -> Result<(), Error> {
        self.staged(path, write)?.put()
    }

    /// Writes a file that `write` fills, but leaves what is at `path` until [`Staged::put`]. A pipe or a device is written
    /// at once.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn staged<E: Display>(
        &self,
        path: &Path,
        write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
    ) -> Result<Staged, Error> {
        self.check_own(path)?;
        if is_stream(path) {
            self.stream(path, write)?;
            return Ok(Staged { file: None, path: path.to_owned() });
        }
        let path = self.target(path);
        Ok(Staged { file: Some(self.filled_beside(&path, write)?), path })
    }

    fn stream<E: Display>(
        &self,
        path: &Path,
        write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
    ) -> Result<(), Error> {
        let failed = |error: &dyn Display| Error::writing(path, error);
        let mut file = BufWriter::new(self.opened_stream(path).map_err(|e| failed(&e))?);
        write(&mut file).map_err(|e| failed(&e))?;
        file.flush().map_err(|e| failed(&e))
    }

    fn opened_stream(&self, path: &Path) -> io::Result<Box<dyn Write>> {
        #[cfg(unix)]
        if let Some(is_stopped) = self.is_stopped
            && path.metadata()?.file_type().is_fifo()
        {
            return Ok(Box::new(Pipe::open(path, is_stopped)?));
        }
        Ok(Box::new(fs::OpenOptions::new().write(true).open(path)?))
    }

    /// Where a file is replaced: a symbolic link stays, but below [`Files::owning`] none is followed that came since the check.
    fn target(&self, path: &Path) -> PathBuf {
        let is_own = self.owned.as_ref().is_some_and(|folder| path.starts_with(folder));
        if is_own { path.to_owned() } else { path.canonicalize().unwrap_or_else(|_| path.to_owned()) }
    }

    /// Writes a text.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn text(&self, path: &Path, text: &str) -> Result<(), Error> {
        self.whole(path, |file| file.write_all(text.as_bytes()))
    }

    /// Writes a value as indented JSON.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn json(&self, path: &Path, value: &impl Serialize) -> Result<(), Error> {
        self.staged_json(path, value)?.put()
    }

    /// [`Files::json`] up to its last step, see [`Files::staged`].
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn staged_json(&self, path: &Path, value: &impl Serialize) -> Result<Staged, Error> {
        self.staged(path, |file| {
            serde_json::to_writer_pretty(&mut *file, value)?;
            file.write_all(b"\n").map_err(serde_json::Error::io)
        })
    }

    /// Writes a new file. An existing file stays as it was.
    ///
    /// # Errors
    /// [`Error::Write`], also if the file exists.
    pub fn new_file(&self, path: &Path, contents: impl AsRef<[u8]>) -> Result<(), Error> {
        let file = self.filled_beside(path, |file| file.write_all(contents.as_ref()))?;
        file.persist_noclobber(path).map_err(|failed| Error::writing(path, &failed.error))?;
        sync_folder_of(path)
    }

    /// Fails if no file can be written at `path`. A caller can report this before the work begins.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn check_writable(&self, path: &Path) -> Result<(), Error> {
        self.check_own(path)?;
        match path.metadata() {
            Ok(about) if about.is_dir() => return Err(Error::writing(path, &"it is a folder")),
            // A name that is too long, for example, or one with a NUL.
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(Error::writing(path, &error)),
            _ => {}
        }
        if is_stream(path) {
            return Ok(());
        }
        self.temporary_beside(path).map(drop)
    }

    /// Takes a file out of sight.
    pub(crate) fn hide(&self, path: &Path) -> Result<Hidden, Error> {
        self.check_own(path)?;
        let path = self.target(path);
        let temporary = self.temporary_beside(&path)?.into_temp_path();
        fs::rename(&path, &temporary).map_err(|error| Error::writing(&path, &error))?;
        let hidden = Hidden { temporary, path };
        match sync_folder_of(&hidden.path) {
            Ok(()) => Ok(hidden),
            Err(error) => {
                hidden.restore();
                Err(error)
            }
        }
    }

    /// A temporary file in the folder of `path`, filled and synced to disk. It is deleted unless it is persisted.
    fn filled_beside<E: Display>(
        &self,
        path: &Path,
        write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
    ) -> Result<NamedTempFile, Error> {
        let failed = |error: &dyn Display| Error::writing(path, error);
        let mut file = self.temporary_beside(path)?;
        let mut buffered = BufWriter::new(file.as_file_mut());
        write(&mut buffered).map_err(|e| failed(&e))?;
        buffered.flush().map_err(|e| failed(&e))?;
        drop(buffered);
        #[cfg(unix)]
        replaced::inherit(file.as_file(), path).map_err(|e| failed(&e))?;
        file.as_file().sync_all().map_err(|e| failed(&e))?;
        Ok(file)
    }

    fn temporary_beside(&self, path: &Path) -> Result<NamedTempFile, Error> {
        let folder = folder_of(path);
        if !is_folder(folder).map_err(|error| Error::writing(path, &error))? {
            return Err(Error::MissingFolder { path: path.to_owned(), folder: folder.to_owned() });
        }
        let mut builder = tempfile::Builder::new();
        // Temporary files are private by default. A new output follows the user's umask instead.
        #[cfg(unix)]
        builder.permissions(replaced::at_first(path));
        // The message goes on with the name of the temporary file.
        let failed = |error: std::io::Error| {
            let text = error.to_string();
            Error::writing(path, &text.split(" at path ").next().unwrap_or(&text))
        };
        builder.prefix(&self.temporary).tempfile_in(folder).map_err(failed)
    }
}

/// A file that is complete, but not yet at its place. If it is dropped, what is there stays.
#[derive(Debug)]
#[must_use = "it is not at its place yet"]
pub struct Staged {
    /// `None` for a pipe or a device, which is already written.
    file: Option<NamedTempFile>,
    path: PathBuf,
}

impl Staged {
    /// Moves the file to its place, where it survives a loss of power from now on.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn put(self) -> Result<(), Error> {
        match self.moved()? {
            Some(path) => sync_folder_of(&path),
            None => Ok(()),
        }
    }

    /// Moves the file to its place, and returns that; `None` for a pipe or a device. A loss of power may still undo it.
    pub(crate) fn moved(self) -> Result<Option<PathBuf>, Error> {
        let Some(file) = self.file else { return Ok(None) };
        file.persist(&self.path).map_err(|failed| Error::writing(&self.path, &failed.error))?;
        Ok(Some(self.path))
    }
}

/// A file under a temporary name, which is removed when this is dropped.
#[derive(Debug)]
pub(crate) struct Hidden {
    temporary: TempPath,
    path: PathBuf,
}

impl Hidden {
    /// Puts the file back, if that is possible.
    pub(crate) fn restore(self) {
        drop(fs::rename(&self.temporary, &self.path));
    }
}

/// What a new file takes over from the one that it replaces.
#[cfg(unix)]
mod replaced {
    use std::{
        fs::{File, Metadata, Permissions},
        io,
        os::unix::fs::{MetadataExt, PermissionsExt, fchown},
        path::Path,
    };

    fn about(path: &Path) -> Option<Metadata> {
        path.symlink_metadata().ok().filter(Metadata::is_file)
    }

    /// The permissions while a file is written: those of its owner alone if it replaces another, which may be secret.
    pub(super) fn at_first(path: &Path) -> Permissions {
        Permissions::from_mode(about(path).map_or(0o666, |old| old.mode() & 0o700))
    }

    /// Gives `file` the permissions of the file at `path` and, if the system allows it, its owner and group. Without the group,
    /// the new one may do no more than everybody.
    pub(super) fn inherit(file: &File, path: &Path) -> io::Result<()> {
        let Some(old) = about(path) else { return Ok(()) };
        let owners = |about: &Metadata| (about.uid(), about.gid());
        if owners(&file.metadata()?) != owners(&old) {
            // Only the administrator may give files away, but members of a group may leave them to it.
            let _ = fchown(file, Some(old.uid()), Some(old.gid())).or_else(|_| fchown(file, None, Some(old.gid())));
        }
        let now = file.metadata()?;
        let mode = old.mode() & 0o777;
        let mode = if now.gid() == old.gid() { mode } else { mode & (0o707 | (mode & 0o007) << 3) };
        if now.mode() & 0o777 == mode { Ok(()) } else { file.set_permissions(Permissions::from_mode(mode)) }
    }
}

/// Whether `path` is neither a file nor a folder, such as `/dev/null` or a pipe. It is then written in place.
#[must_use]
pub fn is_stream(path: &Path) -> bool {
    path.metadata().is_ok_and(|about| !about.is_file() && !about.is_dir())
}

/// Fails if writing `output` would overwrite `other`. `what` is the reason for the message.
///
/// # Errors
/// [`Error::Request`].
pub fn check_distinct(other: &Path, output: &Path, what: &str) -> Result<(), Error> {
    if resolved(other) != resolved(output) {
        return Ok(());
    }
    Err(Error::request(output, &format!("it {what}; choose another output")))
}

/// The path of a file without symbolic links and `..`, if it exists, so that two names of one file become equal.
/// Otherwise its absolute path.
#[must_use]
pub fn resolved(path: &Path) -> PathBuf {
    path.canonicalize().or_else(|_| std::path::absolute(path)).unwrap_or(path.to_owned())
}

/// Fails if `path` exists, because [`Files::new_file`] would refuse it in the end.
///
/// # Errors
/// [`Error::Write`].
pub fn check_new(path: &Path) -> Result<(), Error> {
    match path.symlink_metadata() {
        Ok(_) => Err(Error::writing(path, &"it exists, and a record is never overwritten; choose another folder")),
        Err(_) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_there_stays_until_a_file_is_put() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let files = Files::default();
        files.text(&path, "old").unwrap();
        let staged = files.staged(&path, |file| file.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        drop(files.staged(&path, |file| file.write_all(b"dropped")).unwrap());
        let failed = files.staged(&path, |_| Err::<(), _>("a reason"));
        assert!(failed.unwrap_err().to_string().contains("a reason"));
        staged.put().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
