//! Reference pages that are generated from the declarations in the code.

use crate::analyse::CYCLE_COLUMNS;
use crate::columns::page;
use crate::recorder::page as recorded;

/// `docs/guide/columns.md`: every column of the tables of a run and the fields of `observables` in its summary.
#[must_use]
pub fn columns() -> String {
    let cycles = page("Averages over cycles of the tank, written by `analyse` and at the end of a run:", CYCLE_COLUMNS);
    format!(
        "# Columns\n\nEvery column of the tables that a run writes, and the measured fields of its summary. The heading \
         in the file is `name [unit]`; every table but `cycles.csv` begins with the `step`. An empty cell means that \
         there was nothing to measure. This page is generated from the program.\n\n{}\n## `cycles.csv`\n\n{cycles}",
        recorded()
    )
}
