//! Beds as tables for people: CSV with a row for each grain.
//!
//! Comments that begin with `#` come first: `# lower_m: X, Y, Z` and `# upper_m: X, Y, Z`, the corners of the box, and the recipe
//! of a bed that was packed. Then the names of the columns, in any order:
//!
//! | column | meaning |
//! |---|---|
//! | `x1_m`, `x2_m`, `x3_m` | centre of mass; from the lower corner of the box where no `lower_m` stands |
//! | `shape` | name of its shape; may be left out where all grains have the same |
//! | `size_factor` | factor on the size of its shape, 1 if left out |
//! | `q_w`, `q_x`, `q_y`, `q_z` | rotation from the principal axes of its shape as a quaternion, none if left out (those of a mesh need not be the axes it was drawn in) |
//! | `held` | 1 for a grain that is glued to the floor, 0 if left out |
//!
//! Numbers are written so that they are read back to the last bit.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use sazanami_numerics::{Quaternion, Real, Vector};

use super::{Bed, BedFileError, BedGrain, Recipe};
use crate::table::{fields, unquoted};
use crate::{input, replace_file};

const COLUMNS: [&str; 10] = ["shape", "size_factor", "x1_m", "x2_m", "x3_m", "q_w", "q_x", "q_y", "q_z", "held"];
const LOWER: &str = "lower_m";
const UPPER: &str = "upper_m";
const RECIPE: &str = "recipe";

/// Whether a bed of that name is a table.
pub(super) fn is_table(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"))
}

/// Writes the bed as a table.
pub(super) fn write(bed: &Bed, path: &Path) -> Result<(), BedFileError> {
    let refused = |source: std::io::Error| BedFileError::Path { path: path.to_owned(), source };
    let recipe = serde_json::to_string(&bed.recipe).map_err(|error| refused(error.into()))?;
    let [lower, upper] = [bed.lower, bed.upper].map(|corner| corner.to_array().map(|x| x.to_string()).join(", "));
    let mut text = format!("# {LOWER}: {lower}\n# {UPPER}: {upper}\n# {RECIPE}: {recipe}\n{}\n", COLUMNS.join(","));
    for BedGrain { shape, scale, position, orientation: q, held } in &bed.grains {
        let shape = bed.recipe.shapes.get(*shape as usize).map_or_else(|| shape.to_string(), |name| quoted(name));
        let Vector { x, y, z } = *position;
        let _ = writeln!(text, "{shape},{scale},{x},{y},{z},{},{},{},{},{}", q.w, q.x, q.y, q.z, u8::from(*held));
    }
    replace_file(path, |file| file.write_all(text.as_bytes())).map_err(refused)
}

/// A name that stands in one field whatever it holds.
fn quoted(name: &str) -> String {
    if name.contains([',', '"']) || name.starts_with('#') || name.trim() != name || name.is_empty() {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

/// Reads a table.
pub(super) fn read(path: &Path) -> Result<Bed, BedFileError> {
    let text = input::read_text(path).map_err(|source| BedFileError::Path { path: path.to_owned(), source })?;
    parse(&text).map_err(|(line, problem)| BedFileError::Table { path: path.to_owned(), line, problem })
}

/// Line and description of what is wrong with a table.
type Wrong = (usize, String);

fn parse(text: &str) -> Result<Bed, Wrong> {
    let (mut lower, mut upper, mut recipe) = (None, None, None);
    let mut head: Option<(Vec<Option<usize>>, usize)> = None;
    let mut grains = Vec::new();
    let mut shapes: Vec<String> = Vec::new();
    for (number, row) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = number + 1;
        if row.trim().is_empty() {
            continue;
        }
        if let Some((key, value)) =
            row.strip_prefix('#').map(|comment| comment.split_once(':').unwrap_or((comment, "")))
        {
            match key.trim() {
                LOWER => lower = Some(corner(value).map_err(|problem| (line, problem))?),
                UPPER => upper = Some(corner(value).map_err(|problem| (line, problem))?),
                RECIPE => {
                    let found: Recipe = serde_json::from_str(value.trim()).map_err(|error| {
                        (line, format!("this is no recipe of a bed ({error}); the line may be left out"))
                    })?;
                    shapes.clone_from(&found.shapes);
                    recipe = Some(found);
                }
                _ => {}
            }
            continue;
        }
        let fields: Vec<Cow<str>> = fields(row).map(unquoted).collect();
        match &head {
            None => head = Some((places(&fields).map_err(|problem| (line, problem))?, fields.len())),
            Some((places, width)) => {
                if fields.len() != *width {
                    return Err((line, format!("{} fields, the columns are {width}", fields.len())));
                }
                grains.push(grain(&fields, places, &mut shapes).map_err(|problem| (line, problem))?);
            }
        }
    }
    if head.is_none() {
        return Err((1, format!("no names of columns: expected `{}`", COLUMNS.join(","))));
    }
    let lower = lower.unwrap_or(Vector::ZERO);
    let upper = upper.unwrap_or_else(|| grains.iter().fold(lower, |upper, grain: &BedGrain| upper.max(grain.position)));
    let recipe = Recipe { shapes, ..recipe.unwrap_or_default() };
    Ok(Bed { lower, upper, recipe, grains })
}

/// Where each of [`COLUMNS`] stands.
fn places(head: &[Cow<str>]) -> Result<Vec<Option<usize>>, String> {
    if let Some(unknown) = head.iter().find(|name| !COLUMNS.contains(&name.trim())) {
        return Err(format!("there is no column `{}`: they are `{}`", unknown.trim(), COLUMNS.join(",")));
    }
    if let Some(twice) = COLUMNS.iter().find(|column| head.iter().filter(|name| name.trim() == **column).count() > 1) {
        return Err(format!("the column `{twice}` stands there twice"));
    }
    let places: Vec<Option<usize>> =
        COLUMNS.iter().map(|column| head.iter().position(|name| name.trim() == *column)).collect();
    let is_there = |name: &str| COLUMNS.iter().zip(&places).any(|(column, place)| *column == name && place.is_some());
    if let Some(missing) = ["x1_m", "x2_m", "x3_m"].into_iter().find(|name| !is_there(name)) {
        return Err(format!("the column `{missing}` is missing"));
    }
    let turns = ["q_w", "q_x", "q_y", "q_z"];
    match turns.into_iter().find(|name| !is_there(name)) {
        Some(missing) if turns.into_iter().any(is_there) => {
            Err(format!("the column `{missing}` is missing: a quaternion has all four of `q_w,q_x,q_y,q_z`, or none"))
        }
        _ => Ok(places),
    }
}

fn grain(fields: &[Cow<str>], places: &[Option<usize>], shapes: &mut Vec<String>) -> Result<BedGrain, String> {
    let number = |column: usize, missing: Real| match places[column] {
        None => Ok(missing),
        Some(place) => match fields[place].trim().parse::<Real>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(format!("`{}` is no number for `{}`", fields[place].trim(), COLUMNS[column])),
        },
    };
    let shape = match places[0] {
        None => 0,
        Some(place) => {
            let name = &fields[place];
            shapes.iter().position(|known| known == name).unwrap_or_else(|| {
                shapes.push(name.to_string());
                shapes.len() - 1
            })
        }
    };
    let scale = number(1, 1.0)?;
    if scale <= 0.0 {
        return Err(format!("a size factor of {scale}: it has to be above 0"));
    }
    let position = Vector::new(number(2, 0.0)?, number(3, 0.0)?, number(4, 0.0)?);
    let q = Quaternion::from_xyzw(number(6, 0.0)?, number(7, 0.0)?, number(8, 0.0)?, number(5, 1.0)?);
    if q.length() == 0.0 {
        return Err("a quaternion must not be zero: 1,0,0,0 is no rotation".into());
    }
    // A unit quaternion is kept to the last bit.
    let orientation = if (q.length() - 1.0).abs() < 1e-12 { q } else { q.normalize() };
    let held = match number(9, 0.0)? {
        0.0 => false,
        1.0 => true,
        other => return Err(format!("`held` is {other}: it is 0 or 1")),
    };
    Ok(BedGrain { shape: shape as u32, scale, position, orientation, held })
}

fn corner(value: &str) -> Result<Vector, String> {
    let numbers: Vec<Real> = value.split(',').map(|number| number.trim().parse().unwrap_or(Real::NAN)).collect();
    match numbers[..] {
        [x, y, z] if x.is_finite() && y.is_finite() && z.is_finite() => Ok(Vector::new(x, y, z)),
        _ => Err(format!("`{}` is no corner of a box: expected three numbers in metres", value.trim())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_and_columns_that_do_not_fit_are_refused() {
        let refused = |text: &str| parse(text).is_err();
        assert!(refused("# lower_m: 1, junk, 0, 0\nx1_m,x2_m,x3_m\n"));
        assert!(refused("# lower_m: 0, nan, 0\nx1_m,x2_m,x3_m\n"));
        assert!(refused("x1_m,x2_m,x3_m,x1_m\n0,0,0,0\n"));
        assert!(!refused("# lower_m: 0, 0, 0\nx1_m,x2_m,x3_m\n0,0,0\n"));
        assert_eq!(quoted("#1 sand"), "\"#1 sand\"");
    }

    #[test]
    fn a_table_made_by_hand_needs_places_alone() {
        let bed = parse("x3_m, x1_m,x2_m\n0.003,0.001,0.002\n").unwrap();
        let [grain] = bed.grains[..] else { panic!("one grain") };
        assert_eq!((grain.position, grain.scale, grain.held), (Vector::new(0.001, 0.002, 0.003), 1.0, false));
        assert_eq!((bed.lower, grain.orientation), (Vector::ZERO, Quaternion::IDENTITY));
        let turned = parse("x1_m,x2_m,x3_m,q_w,q_x,q_y,q_z\n0,0,0,2,0,0,0\n").unwrap();
        assert_eq!(turned.grains[0].orientation, Quaternion::IDENTITY);
        let quoted_all = parse("\"x3_m\",\"x1_m\",\"x2_m\"\n\"0.003\",\"0.001\", \"0.002\"\n").unwrap();
        assert_eq!(quoted_all.grains[0].position, grain.position);
        let named = parse("shape,x1_m,x2_m,x3_m\n\"a, b\",0,0,0\nc,0,0,0\n\"a, b\",1,0,0\n").unwrap();
        assert_eq!(named.recipe.shapes, ["a, b", "c"]);
        assert_eq!(named.grains.iter().map(|grain| grain.shape).collect::<Vec<_>>(), [0, 1, 0]);
        assert_eq!(fields(&quoted("a \"b\", c")).map(unquoted).collect::<Vec<_>>(), ["a \"b\", c"]);
    }

    #[test]
    fn wrong_tables_are_refused_with_their_line() {
        for (text, line, words) in [
            ("", 1, "no names of columns"),
            ("x1_m,x2_m\n", 1, "`x3_m` is missing"),
            ("x1_m,x2_m,x3_m,q_w\n", 1, "`q_x` is missing"),
            ("x1,x2_m,x3_m\n", 1, "no column `x1`"),
            ("# lower_m: 1, 2\n", 1, "no corner"),
            ("# recipe: {}\n", 1, "no recipe"),
            ("x1_m,x2_m,x3_m\n0,0,0\n0,zero,0\n", 3, "`zero` is no number for `x2_m`"),
            ("x1_m,x2_m,x3_m\n0,nan,0\n", 2, "no number"),
            ("x1_m,x2_m,x3_m\n0,0\n", 2, "2 fields"),
            ("x1_m,x2_m,x3_m,size_factor\n0,0,0,0\n", 2, "above 0"),
            ("x1_m,x2_m,x3_m,held\n0,0,0,2\n", 2, "0 or 1"),
            ("x1_m,x2_m,x3_m,q_w,q_x,q_y,q_z\n0,0,0,0,0,0,0\n", 2, "must not be zero"),
        ] {
            let (at, problem) = parse(text).expect_err(text);
            assert!(at == line && problem.contains(words), "{text}: {at} {problem}");
        }
    }
}
