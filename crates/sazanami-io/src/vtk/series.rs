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
    /// Time [s].
    pub time: f64,
    /// Path relative to the folder of the series.
    pub file: String,
}

/// The list of files that ParaView opens as one series. Add a file only when it is in place.
#[derive(Clone, Debug)]
pub struct PvdSeries {
    path: PathBuf,
    entries: Vec<SeriesEntry>,
}

impl PvdSeries {
    /// A series without files; nothing is written before the first one comes.
    #[must_use]
    pub fn create(path: &Path) -> Self {
        Self { path: path.to_owned(), entries: Vec::new() }
    }

    /// Goes on with a series after the state at `time` [s] was restored: files of later times leave the list.
    /// A series that does not exist is started.
    ///
    /// # Errors
    /// If the file cannot be read or understood.
    pub fn resume(path: &Path, time: f64) -> Result<Self, VtkError> {
        let text = match fs::read_to_string(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::create(path)),
            text => text.map_err(|source| VtkError::Write { path: path.to_owned(), source })?,
        };
        let mut entries = Vec::new();
        for (number, line) in text.lines().enumerate().filter(|(_, line)| line.contains("<DataSet")) {
            let entry = entry_of(line).ok_or_else(|| VtkError::NotASeries {
                path: path.to_owned(),
                line: number + 1,
                text: line.to_owned(),
            })?;
            entries.push(entry);
        }
        if !text.trim_end().ends_with("</VTKFile>") {
            let (line, text) = (text.lines().count(), text.lines().last().unwrap_or_default().to_owned());
            return Err(VtkError::NotASeries { path: path.to_owned(), line, text });
        }
        entries.retain(|entry| entry.time <= time);
        Ok(Self { path: path.to_owned(), entries })
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
    fn a_damaged_series_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fields.pvd");
        PvdSeries::create(&path).push(0.5, "a.vti").unwrap();
        let text = fs::read_to_string(&path).unwrap();
        for bad in [text.replace("5e-1", "soon"), text.replace(" file=", " fiel="), text[..text.len() - 5].to_owned()] {
            fs::write(&path, bad).unwrap();
            assert!(matches!(PvdSeries::resume(&path, 1.0), Err(VtkError::NotASeries { .. })));
        }
    }
}
