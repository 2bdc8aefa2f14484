//! The cases that run with the tests: every module of the physics at least once, in a few minutes.

use sazanami::progress::{Progress, StepLine};
use sazanami::stop::Stop;
use sazanami_verification::catalogue::CASES;
use sazanami_verification::verify::{Choice, table, verify};

/// Shows which case is being run.
struct Printed;

impl Progress for Printed {
    fn step(&mut self, _: &StepLine) {}

    fn message(&mut self, text: &str) {
        println!("{text}");
    }
}

#[test]
fn nothing_in_the_subset_is_worse_than_recorded() {
    let choice = Choice { subset: true, ..Choice::default() };
    let found = verify(CASES, &choice, &mut Printed, &Stop::new()).unwrap();
    assert!(found.len() > 15, "{} cases", found.len());
    let rows: Vec<_> = found.into_iter().flat_map(|case| case.rows).collect();
    assert!(rows.iter().all(|row| !row.verdict.is_bad()), "{}", table(&rows));
}
