//! Files that people name: regular ones of a bounded length. A pipe without a writer would be waited for, and a device may
//! have no end.

use std::fs::{File, metadata};
use std::io::{Error, ErrorKind, Read as _, Result};
use std::path::Path;

/// Longest file that is read \[bytes].
const LONGEST: u64 = 1 << 30;

/// Refuses what is no regular file.
///
/// # Errors
/// If there is nothing at `path`, or a folder, a pipe or a device.
pub fn refuse_special(path: &Path) -> Result<()> {
    if metadata(path)?.is_file() {
        return Ok(());
    }
    Err(Error::new(ErrorKind::InvalidInput, "this is no regular file, but a folder, a pipe or a device"))
}

/// Contents of the file at `path`.
///
/// # Errors
/// If it cannot be read, is no regular file, or is longer than 1 GiB.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    read_up_to(path, LONGEST)
}

/// The same as text.
///
/// # Errors
/// As [`read`], and if it is not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read(path)?).map_err(|_| Error::new(ErrorKind::InvalidData, "this is not a text in UTF-8"))
}

fn read_up_to(path: &Path, longest: u64) -> Result<Vec<u8>> {
    refuse_special(path)?;
    let mut bytes = Vec::new();
    // Some files of the system have a length of zero and no end.
    File::open(path)?.take(longest + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > longest {
        return Err(Error::new(ErrorKind::FileTooLarge, format!("it is longer than {longest} bytes")));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_of_a_bounded_length_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text");
        std::fs::write(&path, "1234").unwrap();
        assert_eq!(read_text(&path).unwrap(), "1234");
        assert_eq!(read_up_to(&path, 4).unwrap(), b"1234");
        assert_eq!(read_up_to(&path, 3).unwrap_err().kind(), ErrorKind::FileTooLarge);
        std::fs::write(&path, [0xff, 0xfe]).unwrap();
        assert_eq!(read_text(&path).unwrap_err().kind(), ErrorKind::InvalidData);
        assert_eq!(read(folder.path()).unwrap_err().kind(), ErrorKind::InvalidInput);
        assert_eq!(read(&folder.path().join("absent")).unwrap_err().kind(), ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_refused_before_they_are_opened() {
        assert_eq!(read(Path::new("/dev/zero")).unwrap_err().kind(), ErrorKind::InvalidInput);
    }
}
