//! Checkpoints come back to the bit, and no torn or damaged one passes for good.

use std::io;
use std::path::Path;

use sazanami_io::checkpoint::{CheckpointError, CheckpointFolder, CheckpointReader, CheckpointWriter, ElementType};
use sazanami_numerics::Vector;
use sazanami_numerics::snapshot::Snapshot;

struct State {
    fraction: Vec<f64>,
    pressure: Vec<f32>,
    ids: Vec<u32>,
    counters: Vec<u64>,
    signed: Vec<i64>,
}

fn state() -> State {
    State {
        fraction: (0..70_000).map(|i| (f64::from(i) * 1e-4).sin().max(0.0)).collect(),
        pressure: (0..333).map(|i| i as f32 * -1.5).collect(),
        ids: (0..5000_u32).map(|i| i.wrapping_mul(2_654_435_761)).collect(),
        counters: vec![u64::MAX, 0, 19_000],
        signed: vec![i64::MIN, -1, 7],
    }
}

fn writer(state: &State) -> CheckpointWriter<'_> {
    let mut writer = CheckpointWriter::new();
    let added = [
        writer.add("fraction", &state.fraction),
        writer.add("pressure", &state.pressure),
        writer.add("ids", &state.ids),
        writer.add("counters", &state.counters),
        writer.add("signed", &state.signed),
        writer.add::<f64>("nothing", &[]),
        writer.add_json("clock", &("step", 12, 1e-5)),
    ];
    assert!(added.iter().all(Result::is_ok));
    writer
}

/// Bits, so that NaN and -0 count.
fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

#[test]
fn every_array_comes_back_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ckpt");
    let mut state = state();
    state.fraction.extend([f64::NAN, -0.0, f64::INFINITY, f64::MIN_POSITIVE / 4.0]);
    writer(&state).write_atomic(&path).unwrap();
    let reader = CheckpointReader::open(&path).unwrap();
    assert_eq!(bits(&reader.get("fraction").unwrap()), bits(&state.fraction));
    assert_eq!(reader.get::<f32>("pressure").unwrap(), state.pressure);
    assert_eq!(reader.get::<u32>("ids").unwrap(), state.ids);
    assert_eq!(reader.get::<u64>("counters").unwrap(), state.counters);
    assert_eq!(reader.get::<i64>("signed").unwrap(), state.signed);
    assert!(reader.get::<f64>("nothing").unwrap().is_empty());
    assert_eq!(reader.get_json::<(String, u64, f64)>("clock").unwrap(), ("step".to_owned(), 12, 1e-5));
    assert_eq!(reader.sections().next(), Some(("fraction", ElementType::F64, state.fraction.len())));
}

#[test]
fn asking_for_the_wrong_thing_says_what_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ckpt");
    writer(&state()).write_atomic(&path).unwrap();
    let reader = CheckpointReader::open(&path).unwrap();
    assert!(
        matches!(reader.get::<f64>("velocity"), Err(CheckpointError::MissingSection { name, .. }) if name == "velocity")
    );
    let error = reader.get::<f32>("fraction").unwrap_err();
    assert!(matches!(error, CheckpointError::WrongElement { found: ElementType::F64, .. }), "{error}");
    assert!(matches!(reader.get_json::<u64>("clock"), Err(CheckpointError::WrongText { .. })));
    let mut twice = CheckpointWriter::new();
    twice.add("a", &[1_u8]).unwrap();
    assert!(matches!(twice.add("a", &[1.0]), Err(CheckpointError::DuplicateSection { .. })));
}

#[test]
fn a_snapshot_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ckpt");
    let mut snapshot = Snapshot::default();
    snapshot.put_bytes("text", b"sand".to_vec());
    snapshot.put_u32("partners", vec![1, 2, 3]);
    snapshot.put_u64("step", vec![19_000]);
    snapshot.put_vectors("position", &[Vector::new(0.1, -0.2, 0.3)]);
    let mut writer = CheckpointWriter::new();
    writer.add_snapshot(&snapshot).unwrap();
    writer.write_atomic(&path).unwrap();
    assert_eq!(CheckpointReader::open(&path).unwrap().snapshot().unwrap(), snapshot);
}

#[test]
fn the_content_hash_sees_values_and_names_but_not_order() {
    let hash = |sections: &[(&str, &[f64])]| {
        let mut writer = CheckpointWriter::new();
        sections.iter().for_each(|(name, values)| writer.add(name, values).unwrap());
        writer.content_hash(|name| name != "wall_time")
    };
    let reference = hash(&[("a", &[1.0]), ("b", &[2.0, 3.0])]);
    assert_eq!(reference, hash(&[("b", &[2.0, 3.0]), ("wall_time", &[9.0]), ("a", &[1.0])]));
    for other in [
        hash(&[("a", &[1.0]), ("c", &[2.0, 3.0])]),
        hash(&[("a", &[1.0]), ("b", &[2.0, 3.000_000_000_000_000_4])]),
        hash(&[("a", &[1.0, 2.0]), ("b", &[3.0])]),
        hash(&[("a", &[0.0]), ("b", &[-0.0])]),
    ] {
        assert_ne!(reference, other);
    }
    assert_ne!(hash(&[("a", &[0.0])]), hash(&[("a", &[-0.0])]));
}

/// Opens and, if that works, reads everything.
fn verdict(path: &Path) -> Result<(), CheckpointError> {
    let reader = CheckpointReader::open(path)?;
    reader.get::<f64>("fraction")?;
    reader.get::<u32>("ids").map(drop)
}

#[test]
fn a_file_cut_anywhere_is_torn() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ckpt");
    writer(&state()).write_atomic(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert!(verdict(&path).is_ok(), "the whole file is good");
    let torn = folder.path().join("torn.ckpt");
    let cuts = (0..100).chain((0..60).map(|part| bytes.len() * part / 60)).chain(bytes.len() - 2000..bytes.len());
    for length in cuts {
        std::fs::write(&torn, &bytes[..length]).unwrap();
        let result = verdict(&torn);
        assert!(
            matches!(result, Err(CheckpointError::Torn { found, .. }) if found == length as u64),
            "{length}: {result:?}"
        );
    }
    // A file system may also leave the right length and zeros.
    for length in [0, 10, 64, bytes.len() / 2, bytes.len() - 1] {
        let mut zeros = bytes.clone();
        zeros[length..].fill(0);
        std::fs::write(&torn, &zeros).unwrap();
        assert!(verdict(&torn).is_err(), "{length}");
    }
    let mut longer = bytes;
    longer.push(0);
    std::fs::write(&torn, longer).unwrap();
    assert!(matches!(verdict(&torn), Err(CheckpointError::Torn { .. })));
}

#[test]
fn a_flipped_bit_anywhere_is_found_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ckpt");
    let small = State { fraction: (0..40).map(|i| f64::from(i).sqrt()).collect(), ids: vec![1, 2, 3], ..state() };
    writer(&small).write_atomic(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let flipped = folder.path().join("flipped.ckpt");
    let mut damaged_sections = std::collections::BTreeSet::new();
    for byte in 0..bytes.len() {
        let mut copy = bytes.clone();
        copy[byte] ^= 1 << (byte % 8);
        std::fs::write(&flipped, copy).unwrap();
        match CheckpointReader::open(&flipped) {
            Err(CheckpointError::NotACheckpoint { .. }) => assert!(byte < 8),
            Err(CheckpointError::DamagedHeader { .. }) => assert!((8..64).contains(&byte)),
            Err(CheckpointError::DamagedSection { name, .. }) => drop(damaged_sections.insert(name)),
            Err(CheckpointError::DamagedIndex { .. }) => assert!(byte > 64),
            other => panic!("byte {byte}: {other:?}"),
        }
    }
    let named: Vec<_> = damaged_sections.iter().map(String::as_str).collect();
    assert_eq!(named, ["clock", "counters", "fraction", "ids", "pressure", "signed"]);
}

#[test]
fn a_file_of_another_kind_is_not_a_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("step-000000001.ckpt");
    std::fs::write(&path, vec![b'x'; 1000]).unwrap();
    assert!(matches!(CheckpointReader::open(&path), Err(CheckpointError::NotACheckpoint { .. })));
    assert!(matches!(CheckpointReader::open(&folder.path().join("none")), Err(CheckpointError::Read { .. })));
}

#[test]
fn the_newest_good_checkpoint_is_taken_and_the_bad_ones_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let checkpoints = CheckpointFolder::new(folder.path().join("checkpoints"), 4);
    assert!(checkpoints.newest_good().unwrap().good.is_none(), "a folder that does not exist holds none");
    let mut expected = Vec::new();
    for step in [9, 100, 1_000, 1_000_000_000] {
        expected.push(step);
        let section = [step];
        let mut writer = CheckpointWriter::new();
        writer.add("step", &section).unwrap();
        checkpoints.write(step, &writer).unwrap();
    }
    assert_eq!(checkpoints.steps().unwrap(), expected);
    assert_eq!(checkpoints.path_of(100).file_name().unwrap(), "step-000000100.ckpt");

    let bytes = std::fs::read(checkpoints.path_of(1_000)).unwrap();
    std::fs::write(checkpoints.path_of(1_000), &bytes[..bytes.len() - 7]).unwrap();
    let mut bytes = std::fs::read(checkpoints.path_of(1_000_000_000)).unwrap();
    bytes[66] ^= 4;
    std::fs::write(checkpoints.path_of(1_000_000_000), bytes).unwrap();
    let newest = checkpoints.newest_good().unwrap();
    let (step, reader) = newest.good.unwrap();
    assert_eq!((step, reader.get::<u64>("step").unwrap()), (100, vec![100]));
    assert!(matches!(&newest.skipped[0], (path, CheckpointError::DamagedSection { name, .. })
        if *path == checkpoints.path_of(1_000_000_000) && name == "step"));
    assert!(matches!(&newest.skipped[1], (_, CheckpointError::Torn { .. })));
}

#[test]
fn only_the_last_few_are_kept_and_only_once_a_new_one_is_in_place() {
    let folder = tempfile::tempdir().unwrap();
    let checkpoints = CheckpointFolder::new(folder.path(), 2);
    let mut writer = CheckpointWriter::new();
    writer.add("a", &[1.0]).unwrap();
    for (step, left) in [(10, vec![10]), (20, vec![10, 20]), (30, vec![20, 30]), (40, vec![30, 40])] {
        std::fs::write(folder.path().join(".unfinished-abc"), b"left by a crash").unwrap();
        checkpoints.write(step, &writer).unwrap();
        assert_eq!(checkpoints.steps().unwrap(), left);
        assert!(!folder.path().join(".unfinished-abc").exists());
    }
    // After going back to step 30 because 40 was bad, 40 does not push 30 out.
    std::fs::write(checkpoints.path_of(40), b"torn").unwrap();
    checkpoints.write(35, &writer).unwrap();
    assert_eq!(checkpoints.steps().unwrap(), [30, 35, 40]);
    assert_eq!(checkpoints.newest_good().unwrap().good.unwrap().0, 35);

    // A write that fails removes nothing: here the new file's place is taken by a folder.
    std::fs::create_dir_all(checkpoints.path_of(50).join("in the way")).unwrap();
    let error = checkpoints.write(50, &writer).unwrap_err();
    assert!(matches!(&error, CheckpointError::Write { path, .. } if *path == checkpoints.path_of(50)), "{error}");
    assert_eq!(checkpoints.newest_good().unwrap().good.unwrap().0, 35);
    assert_eq!(checkpoints.steps().unwrap(), [30, 35, 40, 50]);
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error_that_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a file");
    std::fs::write(&file, b"").unwrap();
    let checkpoints = CheckpointFolder::new(file.join("checkpoints"), 2);
    let error = checkpoints.write(1, &CheckpointWriter::new()).unwrap_err();
    let CheckpointError::Write { path, source } = &error else { panic!("{error}") };
    assert_eq!(*path, checkpoints.path_of(1));
    assert_eq!(source.kind(), io::ErrorKind::NotADirectory);
    assert!(error.to_string().contains("what was there before is untouched"));
}
