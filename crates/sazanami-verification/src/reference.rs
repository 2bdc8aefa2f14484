//! Reference data: the tables `verification/<case>/reference.csv`.

use sazanami_numerics::Real;

/// Values of `columns` in the rows whose first cell is `key` (all rows for an empty key), where none is missing.
#[must_use]
pub fn rows<const N: usize>(csv: &str, key: &str, columns: [&str; N]) -> Vec<[Real; N]> {
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let places = columns.map(|column| names.iter().position(|name| *name == column));
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let wanted = key.is_empty() || cells.first() == Some(&key);
        let value = |place: Option<usize>| cells.get(place?)?.parse::<Real>().ok();
        let values = places.map(value);
        (wanted && values.iter().all(Option::is_some)).then(|| values.map(Option::unwrap_or_default))
    };
    lines.filter_map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_read_whole() {
        let table = "# of somebody\nwhat,x,y\na,1,2\nb,3,4\na,5,6\na,7,\n";
        assert_eq!(rows(table, "a", ["x", "y"]), [[1.0, 2.0], [5.0, 6.0]]);
        assert_eq!(rows(table, "", ["x"]).len(), 4);
        // A column that is not there.
        assert!(rows(table, "", ["z"]).is_empty());
    }
}
