//! Atomic replacement of a file.

use std::fs::{File, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Name prefix of files being written; what a crash leaves behind starts with it.
pub(crate) const UNFINISHED: &str = ".unfinished-";

/// Writes a new file through `write` and puts it at `path` only when it is complete and on disk.
///
/// The file is made in the folder of `path`, synced, renamed over `path`, and the folder synced.
/// Whatever fails, `path` holds either its old content or all of the new one.
///
/// # Errors
/// Those of the file system and those of `write`.
pub fn replace_file<R>(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<R>) -> io::Result<R> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The operating system takes the umask off; the default of temporary files is 0600.
        builder.permissions(Permissions::from_mode(0o644));
    }
    let (file, unfinished) = builder.tempfile_in(folder)?.into_parts();
    let mut writer = BufWriter::with_capacity(1 << 20, file);
    let result = write(&mut writer)?;
    writer.flush()?;
    writer.get_ref().sync_all()?;
    drop(writer);
    unfinished.persist(path).map_err(|failure| failure.error)?;
    sync_folder(folder)?;
    Ok(result)
}

/// Removes what writes that were killed left behind in `folder` and in the folders directly within it. Nothing else may be
/// writing there.
pub fn remove_unfinished(folder: &Path) {
    let list = |folder: &Path| std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let folders = list(folder).filter(|path| path.is_dir()).chain([folder.to_owned()]);
    let files = folders.flat_map(|folder| list(&folder).collect::<Vec<_>>());
    for path in files.filter(|path| path.is_file()) {
        if path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(UNFINISHED)) {
            // What stays does no harm: nobody reads it.
            let _ = std::fs::remove_file(path);
        }
    }
}

/// Makes a rename in `folder` survive a power cut.
fn sync_folder(folder: &Path) -> io::Result<()> {
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        replace_file(&path, |file| file.write_all(b"old")).unwrap();
        let failure = replace_file(&path, |file| {
            file.write_all(b"half of the new")?;
            Err::<(), _>(io::Error::from(io::ErrorKind::StorageFull))
        });
        assert_eq!(failure.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn the_file_is_readable_by_others_as_far_as_the_umask_allows() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let plain = folder.path().join("plain");
        std::fs::write(&plain, b"x").unwrap();
        let path = folder.path().join("replaced");
        replace_file(&path, |file| file.write_all(b"x")).unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(&path), mode(&plain) & 0o644);
    }
}
