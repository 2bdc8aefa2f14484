//! Writing a default down changes nothing: a key is what it says, and no default hangs on whether another one is written.

use toml::Value;

use super::*;

/// Paths and values of all leaves of a resolved copy.
fn leaves(path: &str, value: &Value, found: &mut Vec<(String, String)>) {
    let under = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match value {
        // Times say together when something happens: `at = []` alone is never.
        Value::Table(_) if ["output.fields", "output.grains", "output.figures", "output.series"].contains(&path) => {
            found.push((path.to_owned(), value.to_string()));
        }
        Value::Table(table) => table.iter().for_each(|(key, value)| leaves(&under(&quoted(key)), value, found)),
        Value::Array(list) if list.iter().all(Value::is_table) && !list.is_empty() => {
            list.iter().enumerate().for_each(|(n, value)| leaves(&under(&n.to_string()), value, found));
        }
        leaf => found.push((path.to_owned(), leaf.to_string())),
    }
}

/// A key as it stands in a path.
fn quoted(key: &str) -> String {
    let bare = key.chars().all(|letter| letter.is_ascii_alphanumeric() || "_-".contains(letter));
    if bare { key.to_owned() } else { format!("\"{key}\"") }
}

/// Keys whose written-out default gives another case, as `path = value`.
fn that_change(file: &Path) -> Vec<String> {
    let own = case::load(file, &[]).unwrap_or_else(|error| panic!("{error}")).case;
    let copy = resolved::write(&own, Paths::AsGiven);
    let expected = resolved::write(&own, Paths::NameOnly);
    let mut found = Vec::new();
    leaves("", &Value::Table(copy.parse().expect("a copy is TOML")), &mut found);
    assert!(found.len() > 30, "{}: {found:?}", file.display());
    let differs = |(path, value): &(String, String)| {
        let row = format!("{path}={value}");
        match case::load(file, std::slice::from_ref(&row)) {
            Ok(loaded) if resolved::write(&loaded.case, Paths::NameOnly) == expected => None,
            Ok(_) => Some(format!("{row} changes the case")),
            // A value that the case gives in another form, or one of several that belong together.
            Err(error) => {
                let text = error.to_string();
                let known =
                    ["say the same thing twice", "has one viscosity", "is missing", "is given once", "two dashpots"];
                (!known.iter().any(|form| text.contains(form))).then(|| format!("{row} is refused: {text}"))
            }
        }
    };
    found.iter().filter_map(differs).collect()
}

#[test]
fn a_wall_differs_from_the_grains_in_what_it_gives() {
    let sand = "[material.sand]\ndensity = \"2650 kg/m^3\"\n[contact.\"sand/sand\"]\nnormal_stiffness = \"5e3 N/m\"\nfriction = 0.6\n";
    let laws = |more: &str| {
        let law = |pair: &sazanami_posing::case::meaning::PairContact| (pair.law.normal_stiffness, pair.law.friction);
        case_of(&format!("{SMALL}{sand}{more}"), &[]).contacts.iter().map(law).collect::<Vec<_>>()
    };
    assert_eq!(laws(""), [(5e3, 0.6), (5e3, 0.6)]);
    assert_eq!(laws("[contact.\"wall/sand\"]\nfriction = 0.1\n"), [(5e3, 0.6), (5e3, 0.1)]);
}

#[test]
fn defaults_of_shipped_cases_mean_the_same_when_they_are_written() {
    let mut wrong = Vec::new();
    for file in shipped() {
        wrong.extend(that_change(&file).into_iter().map(|row| format!("{}: {row}", file.display())));
    }
    assert!(wrong.is_empty(), "{} rows:\n{}", wrong.len(), wrong.join("\n"));
}
