//! Reference data: the tables `verification/<case>/reference.csv`.

use sazanami_numerics::Real;

/// Martin and Moyce (1952), a column twice as high as wide.
pub const DAM_BREAK: &str = include_str!("../verification/dam-break/reference.csv");
/// Martin and Moyce (1952), a column as high as wide.
pub const SQUARE_DAM: &str = include_str!("../verification/mps-dam-break/reference.csv");
/// Lobovsky et al. (2014).
pub const LOBOVSKY: &str = include_str!("../verification/mps-dam-break-lobovsky/reference.csv");
/// Zick and Homsy (1982).
pub const ARRAYS: &str = include_str!("../verification/grain-arrays/reference.csv");

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

/// Time and value of the rows of a quantity.
#[must_use]
pub fn history(csv: &str, quantity: &str) -> Vec<[Real; 2]> {
    rows(csv, quantity, ["dimensionless_time", "value"])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_read_whole() {
        assert_eq!((history(DAM_BREAK, "front").len(), history(DAM_BREAK, "column").len()), (15, 17));
        assert_eq!((history(SQUARE_DAM, "front").len(), history(LOBOVSKY, "front").len()), (16, 6));
        assert_eq!(rows(ARRAYS, "simple cubic", ["solid_fraction", "k"]).len(), 4);
        // A column that is not there.
        assert!(rows(ARRAYS, "", ["z"]).is_empty());
    }
}
