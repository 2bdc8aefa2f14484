//! Time series: `.pvd`, a list of files with their times.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::VtkError;
use super::appended::{escaped, unescaped};
use crate::replace_file;

/// A file of a series.
#[derive(Clone, Debug, PartialEq)]
pub struct SeriesEntry {
    /// Time \[s].
    pub time: f64,
    /// Path relative to the folder of the series.
    pub file: String,
}

/// The list of files that ParaView opens as one series. Add a file only when it is in place.
#[derive(Clone, Debug)]
pub struct PvdSeries {
    path: PathBuf,
    entries: Vec<SeriesEntry>,
    damage: Option<String>,
}

impl PvdSeries {
    /// A series without files; nothing is written before the first one comes.
    #[must_use]
    pub fn create(path: &Path) -> Self {
        Self { path: path.to_owned(), entries: Vec::new(), damage: None }
    }

    /// Goes on with a series after the state at `time` \[s] was restored: files of later times leave the list.
    /// A series that does not exist is started; of a damaged one the entries that can be read are kept, see
    /// [`Self::damage`].
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn resume(path: &Path, time: f64) -> Result<Self, VtkError> {
        let bytes = match fs::read(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::create(path)),
            bytes => bytes.map_err(|source| VtkError::Write { path: path.to_owned(), source })?,
        };
        let text = String::from_utf8_lossy(&bytes);
        let (mut entries, mut unreadable) = (Vec::new(), 0);
        for line in text.lines().filter(|line| line.contains("<DataSet")) {
            match entry_of(line) {
                Some(entry) => entries.push(entry),
                None => unreadable += 1,
            }
        }
        let is_whole = unreadable == 0 && text.trim_end().ends_with("</VTKFile>");
        entries.retain(|entry| entry.time <= time);
        let damage = (!is_whole).then(|| {
            format!(
                "{} was damaged: {} of its files stay listed; others are still in their folder",
                path.display(),
                entries.len()
            )
        });
        Ok(Self { path: path.to_owned(), entries, damage })
    }

    /// What was lost of a damaged series that is gone on with.
    #[must_use]
    pub fn damage(&self) -> Option<&str> {
        self.damage.as_deref()
    }

    /// Files so far, in the order of their times.
    #[must_use]
    pub fn entries(&self) -> &[SeriesEntry] {
        &self.entries
    }

    /// Adds a file (relative to the folder of the series) and rewrites the list at once. A file of the same name
    /// or time leaves it.
    ///
    /// # Errors
    /// If the file system refuses; the list on disk is then as before.
    pub fn push(&mut self, time: f64, file: &str) -> Result<(), VtkError> {
        self.entries.retain(|entry| entry.time.total_cmp(&time).is_ne() && entry.file != file);
        let place = self.entries.partition_point(|entry| entry.time < time);
        self.entries.insert(place, SeriesEntry { time, file: file.to_owned() });
        replace_file(&self.path, |out| {
            out.write_all(b"<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n  <Collection>\n")?;
            for SeriesEntry { time, file } in &self.entries {
                writeln!(out, "    <DataSet timestep=\"{time:e}\" part=\"0\" file=\"{}\"/>", escaped(file))?;
            }
            out.write_all(b"  </Collection>\n</VTKFile>\n")
        })
        .map_err(|source| VtkError::Write { path: self.path.clone(), source })
    }
}

fn entry_of(line: &str) -> Option<SeriesEntry> {
    let attribute = |name: &str| {
        let (_, rest) = line.split_once(&format!(" {name}=\""))?;
        Some(rest.split_once('"')?.0)
    };
    Some(SeriesEntry { time: attribute("timestep")?.parse().ok()?, file: unescaped(attribute("file")?) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resumed_series_forgets_what_came_later() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fields.pvd");
        let mut series = PvdSeries::resume(&path, 0.0).unwrap();
        for step in 0..5_u32 {
            series.push(f64::from(step) * 0.1, &format!("fields/a & b-{step}.vti")).unwrap();
        }
        let complete = fs::read(&path).unwrap();
        let mut resumed = PvdSeries::resume(&path, 2.0 * 0.1).unwrap();
        let times: Vec<_> = resumed.entries().iter().map(|entry| entry.time).collect();
        assert_eq!(times, [0.0, 0.1, 0.2]);
        assert_eq!(resumed.entries()[1].file, "fields/a & b-1.vti");
        for step in 2..5_u32 {
            resumed.push(f64::from(step) * 0.1, &format!("fields/a & b-{step}.vti")).unwrap();
        }
        assert_eq!(fs::read(&path).unwrap(), complete);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn of_a_damaged_series_what_can_be_read_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fields.pvd");
        let mut series = PvdSeries::create(&path);
        series.push(0.25, "a.vti").unwrap();
        series.push(0.5, "b.vti").unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(PvdSeries::resume(&path, 1.0).unwrap().damage(), None);
        let cut = text[..text.len() - 5].to_owned();
        for (bad, left) in [(text.replace("\"5e-1", "\"soon"), 1), (text.replace("\"b.vti", "b.vti"), 1), (cut, 2)] {
            fs::write(&path, bad).unwrap();
            let mut series = PvdSeries::resume(&path, 1.0).unwrap();
            assert!(series.damage().is_some() && series.entries().len() == left, "{series:?}");
            series.push(0.75, "c.vti").unwrap();
            assert_eq!(PvdSeries::resume(&path, 1.0).unwrap().damage(), None);
        }
        fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
        assert!(PvdSeries::resume(&path, 1.0).unwrap().damage().is_some());
    }
}
