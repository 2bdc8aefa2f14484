//! The examples of the library do what they say.

#[path = "../../examples/settling_sphere.rs"]
mod settling_sphere;

#[test]
fn a_case_posed_in_code_runs_and_its_fields_can_be_read() {
    settling_sphere::run_example().unwrap_or_else(|error| panic!("{error}"));
}
