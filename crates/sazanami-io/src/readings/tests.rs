use std::path::Path;

use super::*;

const GOOD: &str = "\
# source: figure 2 of the paper
# A remark: with a colon in it, which declares nothing
# pixel_size_m = 1.5e-4
x_m,z_m,note

-0.02, 0.0101,1
0,9.8e-3,2
0.02,0.0103,3
";

fn parse(text: &str) -> Result<Readings, ReadingsError> {
    Readings::parse(Path::new("bed.csv"), text.as_bytes(), &["x_m", "z_m"], 3)
}

fn problem(text: &str) -> String {
    parse(text).expect_err("this is wrong").to_string()
}

#[test]
fn columns_are_read_by_name() {
    for text in [GOOD.to_owned(), GOOD.replace('\n', "\r\n"), format!("\u{feff}{GOOD}"), GOOD.trim_end().to_owned()] {
        let readings = parse(&text).expect("a good file");
        assert_eq!(readings.points(), [[-0.02, 0.0101], [0.0, 9.8e-3], [0.02, 0.0103]]);
        assert_eq!(readings.declared("source"), Some("figure 2 of the paper"));
        assert_eq!(readings.declared_number("pixel_size_m").expect("a number"), Some(1.5e-4));
        assert_eq!((readings.declared("A"), readings.declared_number("x0").expect("nothing")), (None, None));
    }
    let quoted =
        "\"x_m\",\"note\", \"z_m\"\n\"-0.02\",\"a, b\",\"0.0101\"\n0,\"\"\"c\"\"\",9.8e-3\n\"0.02\",,\"0.0103\"\n";
    assert_eq!(parse(quoted).expect("quoted fields").points(), [[-0.02, 0.0101], [0.0, 9.8e-3], [0.02, 0.0103]]);
    let turned = Readings::parse(Path::new("t"), b"z_m,x_m\n5,1\n4,2\n", &["x_m", "z_m"], 2).expect("a good file");
    assert_eq!((turned.column(0), turned.column(1)), (&[1.0, 2.0][..], &[5.0, 4.0][..]));
    let motion = Readings::parse(Path::new("m"), b"t_s,x_m\n0,0\n0.1,-0.01\n", &["t_s", "x_m"], 2);
    assert_eq!(motion.expect("a motion").points(), [[0.0, 0.0], [0.1, -0.01]]);
}

#[test]
fn troubles_name_file_line_and_what_was_expected() {
    assert_eq!(
        problem("x_mm,z_m\n1,2\n"),
        "bed.csv, line 1: the columns are `x_mm,z_m`; expected `x_m` among them, separated by commas, with that unit"
    );
    assert_eq!(
        problem("# made by hand\nx_m;z_m\n1;2\n"),
        "bed.csv, line 2: the columns are `x_m;z_m`; expected `x_m,z_m` among them, separated by commas, with that unit"
    );
    assert_eq!(
        problem("x_m,z_m\n0,1\n0.2,1\n0.1,1\n"),
        "bed.csv, line 4: x_m goes from 0.2 to 0.1; expected values that increase from row to row"
    );
    assert!(problem("x_m,z_m\n0,1\n0,1\n").contains("line 3: x_m goes from 0 to 0"));
    assert_eq!(
        problem("x_m,z_m\n0,1\n1,1\n\n"),
        "bed.csv, line 3: the file ends after 2 rows of numbers; expected at least 3"
    );
    assert_eq!(
        problem("x_m,z_m\n0,1\n1,high\n"),
        "bed.csv, line 3: `high` for z_m; expected a finite number such as -0.0125 or 1.5e-3"
    );
    for not_a_number in ["NaN", "inf", "", "1,5"] {
        assert!(problem(&format!("x_m,z_m\n0,{not_a_number}\n")).starts_with("bed.csv, line 2: "));
    }
    assert_eq!(problem("x_m,z_m\n0,1,2\n"), "bed.csv, line 2: 3 fields; expected 2, one for each column");
    assert!(problem("# nothing\n").starts_with("bed.csv, line 1: the file ends without a line of column names"));
    assert!(problem("").starts_with("bed.csv, line 1: "));
    assert!(problem("x_m,z_m,x_m\n").contains("two columns are called `x_m`"));
    let bytes = Readings::parse(Path::new("bed.csv"), b"x_m,z_m\n\xff\n", &["x_m", "z_m"], 3);
    assert_eq!(bytes.expect_err("not text").to_string(), "bed.csv, line 2: this is not UTF-8 text");
    let declared = parse(&GOOD.replace("1.5e-4", "small")).expect("good columns");
    assert!(
        declared
            .declared_number("pixel_size_m")
            .expect_err("a word")
            .to_string()
            .starts_with("bed.csv, line 3: `small`")
    );
}

#[test]
fn a_file_that_is_not_there_is_not_one_that_is_wrong() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bed.csv");
    assert_eq!(Readings::read_if_there(&path, &["x_m"], 1).expect("no file is no error"), None);
    assert!(matches!(Readings::read(&path, &["x_m"], 1), Err(ReadingsError::Read { .. })));
    std::fs::write(&path, "y_m\n").expect("a file");
    assert!(matches!(Readings::read_if_there(&path, &["x_m"], 1), Err(ReadingsError::Line { line: 1, .. })));
    std::fs::write(&path, GOOD).expect("a file");
    let there = Readings::read_if_there(&path, &["x_m", "z_m"], 3).expect("a good file").expect("it is there");
    assert_eq!(there.column(0).len(), 3);
}
