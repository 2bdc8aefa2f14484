//! Time series: `.pvd`, a list of files with their times.

use std::collections::HashSet;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::VtkError;
use super::appended::{escaped, unescaped};
use super::read::{ReadError, VtkFile};
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

    /// As [`Self::resume`]. A series that is damaged, missing or shorter than it was is made anew from the files that are
    /// there: those of `folder`, relative to that of the series, whose names begin with `prefix`, with the times that
    /// stand in them. Files that are gone leave the list. [`Self::damage`] says what was done.
    ///
    /// # Errors
    /// If the list or the folder cannot be read, or the new list cannot be written.
    pub fn restore(path: &Path, folder: &str, prefix: &str, time: f64) -> Result<Self, VtkError> {
        let mut series = Self::resume(path, f64::INFINITY)?;
        let listed: HashSet<&str> = series.entries.iter().map(|entry| entry.file.as_str()).collect();
        let root = path.parent().unwrap_or(Path::new(""));
        let (mut left_out, mut unreadable) = (Vec::new(), 0);
        for file in files_in(&root.join(folder), prefix)?.iter().map(|name| format!("{folder}/{name}")) {
            if listed.contains(file.as_str()) {
                continue;
            }
            match VtkFile::time_in(&root.join(&file)).ok().flatten() {
                Some(of_file) if of_file <= time => left_out.push(SeriesEntry { time: of_file, file }),
                Some(_) => {}
                None => unreadable += 1,
            }
        }
        series.entries.retain(|entry| entry.time <= time);
        let before = series.entries.len();
        series.entries.retain(|entry| root.join(&entry.file).is_file());
        let gone = before - series.entries.len();
        if left_out.is_empty() && gone == 0 && series.damage.is_none() {
            return Ok(series);
        }
        let found = left_out.len();
        series.entries.extend(left_out);
        series.entries.sort_by(|a, b| a.time.total_cmp(&b.time));
        series.write()?;
        let counted = |count: usize, what: &str| if count > 0 { format!("; {what}: {count}") } else { String::new() };
        series.damage = Some(format!(
            "{} did not fit the files in {folder}: it lists {} now, {found} of them found there{}{}",
            path.display(),
            series.entries.len(),
            counted(gone, "listed before and gone"),
            counted(unreadable, "left out, since they cannot be read"),
        ));
        Ok(series)
    }

    /// Losses and repairs of a damaged series that is gone on with.
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
        self.write()
    }

    fn write(&self) -> Result<(), VtkError> {
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

/// Names of the files in `folder` that begin with `prefix` and belong to VTK, in alphabetic order; none without a folder.
fn files_in(folder: &Path, prefix: &str) -> Result<Vec<String>, VtkError> {
    let failed = |source| VtkError::Write { path: folder.to_owned(), source };
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(failed)?,
    };
    let mut names = Vec::new();
    for entry in entries {
        let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
        if name.starts_with(prefix) && [".vtp", ".vti"].iter().any(|ending| name.ends_with(ending)) {
            names.push(name);
        }
    }
    names.sort_unstable();
    Ok(names)
}

fn entry_of(line: &str) -> Option<SeriesEntry> {
    let attribute = |name: &str| {
        let (_, rest) = line.split_once(&format!(" {name}=\""))?;
        Some(rest.split_once('"')?.0)
    };
    Some(SeriesEntry { time: attribute("timestep")?.parse().ok()?, file: unescaped(attribute("file")?) })
}

/// Files of the series at `path` in the order of their times; none if there is no such series.
///
/// # Errors
/// If it cannot be read or is damaged.
pub fn read_series(path: &Path) -> Result<Vec<SeriesEntry>, ReadError> {
    let damaged = |what| ReadError::Damaged { path: path.to_owned(), what };
    match PvdSeries::resume(path, f64::INFINITY) {
        Ok(series) => match series.damage() {
            None => Ok(series.entries().to_vec()),
            Some(damage) => Err(damaged(damage.to_owned())),
        },
        Err(VtkError::Write { path, source }) => Err(ReadError::File { path, source }),
        Err(other) => Err(damaged(other.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use sazanami_numerics::Vector;

    use super::*;
    use crate::vtk::{PointFile, write_points};

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
        assert!(read_series(&path).is_err());
        assert!(read_series(&folder.path().join("absent.pvd")).unwrap().is_empty());
    }

    #[test]
    fn a_lost_or_damaged_list_is_made_anew_from_the_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("grains.pvd");
        fs::create_dir(folder.path().join("grains")).unwrap();
        let restore = |time: f64| PvdSeries::restore(&path, "grains", "grains-", time).unwrap();
        assert!(restore(1.0).entries().is_empty() && !path.exists(), "nothing to list, nothing written");
        let mut series = PvdSeries::create(&path);
        for step in 0..5_u32 {
            let (name, time) = (format!("grains/grains-{step:09}.vtp"), 0.1 * f64::from(step));
            let file = PointFile {
                places: &[Vector::ZERO],
                double: false,
                time: Some(time),
                arrays: &[],
                scalars: None,
                frame: None,
            };
            write_points(&folder.path().join(&name), &file).unwrap();
            series.push(time, &name).unwrap();
        }
        fs::write(folder.path().join("grains/shape-0.vtp"), "the glyph is no state").unwrap();
        let whole = fs::read(&path).unwrap();
        // Negative control: a whole list is left alone.
        assert_eq!(restore(1.0).damage(), None);
        fs::remove_file(&path).unwrap();
        let mended = restore(1.0);
        assert!(mended.damage().is_some_and(|text| text.contains("it lists 5 now, 5 of them found")), "{mended:?}");
        assert_eq!(fs::read(&path).unwrap(), whole);
        // A file is lost: nothing of it stays in the list.
        let lost = folder.path().join("grains/grains-000000001.vtp");
        let kept = fs::read(&lost).unwrap();
        fs::remove_file(&lost).unwrap();
        let mended = restore(1.0);
        assert!(mended.damage().is_some_and(|text| text.ends_with("; listed before and gone: 1")), "{mended:?}");
        assert_eq!(read_series(&path).unwrap().len(), 4);
        fs::write(&lost, kept).unwrap();
        restore(1.0);
        assert_eq!(fs::read(&path).unwrap(), whole);
        // Torn in the middle; a file of it is damaged too, and the run goes on from 0.3 s.
        fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        fs::write(folder.path().join("grains/grains-000000003.vtp"), "torn").unwrap();
        let mended = restore(0.3);
        let files: Vec<_> = mended.entries().iter().map(|entry| &entry.file[14..23]).collect();
        assert_eq!(files, ["000000000", "000000001", "000000002"], "{mended:?}");
        assert_eq!(PvdSeries::resume(&path, 1.0).unwrap().damage(), None);
    }
}
