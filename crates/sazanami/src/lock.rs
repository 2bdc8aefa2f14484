//! A folder of results belongs to one run at a time.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::error::CommandError;

/// Name of the lock's file within the folder of results.
const LOCK: &str = ".sazanami-lock";

/// Holds a folder of results for the run that writes to it. The lock is one of the operating system on an open file: it
/// ends with the process, however that ends. The file itself is removed when the lock is given back.
#[derive(Debug)]
pub(crate) struct FolderLock {
    path: PathBuf,
    /// Open as long as the folder is held; absent where the file system knows no locks.
    file: Option<File>,
}

impl FolderLock {
    /// Takes `folder` for this process, and removes what a run that was killed left unfinished in it.
    ///
    /// # Errors
    /// If a run that is still alive holds it, or nothing can be written to it.
    pub fn take(folder: &Path) -> Result<Self, CommandError> {
        let path = folder.join(LOCK);
        let unwritable = |error: std::io::Error| {
            CommandError::input(
                format!("nothing can be written to `{}`: {error}", folder.display()),
                "make it writable, or work on a copy of it",
            )
        };
        let file = loop {
            let open = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
            let mut file = open.map_err(unwritable)?;
            match file.try_lock() {
                // Whoever gave the lock back meanwhile has removed the file that was opened here.
                Ok(()) if !is_at(&file, &path) => {}
                Ok(()) => {
                    let text = owner();
                    let written =
                        file.set_len(0).and_then(|()| file.rewind()).and_then(|()| file.write_all(text.as_bytes()));
                    written.map_err(unwritable)?;
                    break Some(file);
                }
                Err(TryLockError::WouldBlock) => return Err(in_use(folder, &path)),
                // Some network file systems know no locks.
                Err(TryLockError::Error(_)) => break None,
            }
        };
        let lock = Self { path, file };
        if lock.file.is_some() {
            sazanami_io::remove_unfinished(folder);
        }
        Ok(lock)
    }

    /// Refuses `folder` if a run that is still alive holds it; touches nothing.
    ///
    /// # Errors
    /// If it is held.
    pub fn refuse_held(folder: &Path) -> Result<(), CommandError> {
        let path = folder.join(LOCK);
        match File::open(&path).map(|file| file.try_lock_shared()) {
            Ok(Err(TryLockError::WouldBlock)) => Err(in_use(folder, &path)),
            _ => Ok(()),
        }
    }

    /// Whether the file system keeps other runs off.
    pub const fn is_kept(&self) -> bool {
        self.file.is_some()
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // First the file, then the lock: nobody can take a lock on a file that is about to go. A file that stays does
        // no harm, its lock is gone.
        if self.file.is_some() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Text of the lock's file: process and time of the start.
fn owner() -> String {
    format!("process {}, since {}\n", std::process::id(), humantime::format_rfc3339_seconds(SystemTime::now()))
}

fn in_use(folder: &Path, path: &Path) -> CommandError {
    let owner = fs::read_to_string(path).unwrap_or_default();
    let owner = if owner.trim().is_empty() { "another process" } else { owner.trim() };
    CommandError::input(
        format!("`{}` is in use by a run that has not ended ({owner})", folder.display()),
        "wait for its end, stop it with `kill` and its number, or choose another folder with --out",
    )
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    match (file.metadata(), fs::metadata(path)) {
        (Ok(open), Ok(named)) => (open.dev(), open.ino()) == (named.dev(), named.ino()),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_held_by_one_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let held = FolderLock::take(folder.path()).unwrap();
        let refused = FolderLock::take(folder.path()).unwrap_err();
        assert_eq!(refused.exit_code(), crate::error::exit::WRONG_INPUT);
        assert!(FolderLock::refuse_held(folder.path()).is_err());
        let text = refused.to_string();
        assert!(
            text.contains("is in use") && text.contains(&format!("process {}, since 20", std::process::id())),
            "{text}"
        );
        drop(held);
        assert!(FolderLock::refuse_held(folder.path()).is_ok());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        // What a process that was killed leaves behind is no lock.
        fs::write(folder.path().join(LOCK), "process 1, since yesterday\n").unwrap();
        fs::create_dir(folder.path().join("checkpoints")).unwrap();
        let torn = folder.path().join("checkpoints/.unfinished-a1b2c3");
        fs::write(&torn, "half").unwrap();
        fs::write(folder.path().join("series.csv"), "kept").unwrap();
        let held = FolderLock::take(folder.path()).unwrap();
        assert!(held.is_kept() && !torn.exists() && folder.path().join("series.csv").is_file());
    }
}
