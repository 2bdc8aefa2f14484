//! Time and memory that pictures take.

use sazanami_numerics::Real;

use super::{CostModel, PopulationReport};
use crate::case::meaning::{Case, GrainShape, Population, Solver};

/// Cost of the pictures of one time on one thread, measured over 1 to 21,780 grains of 12 to 5,120 triangles on 4,096 to
/// 2,097,152 cells, and over 2 to 8,000 grains among moving particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureCost {
    /// Canvas, axes, liquid and the file \[s], plus
    pub time: Real,
    /// [s per grain], plus
    pub time_grain: Real,
    /// [s per triangle of the grains' surfaces].
    pub time_triangle: Real,
    /// Canvas and letters \[bytes], plus
    pub memory: Real,
    /// the liquid of the pictures that wait to be drawn [bytes per cell], plus
    pub memory_cell: Real,
    /// [bytes per triangle].
    pub memory_triangle: Real,
}

impl PictureCost {
    /// Section (0.12 s without grains), liquid (0.1 s) and view (0.18 s) of a flow on a grid.
    pub const GRID: Self = Self {
        time: 0.4,
        time_grain: 2e-5,
        time_triangle: 6.5e-7,
        memory: 9.5e7,
        memory_cell: 48.0,
        memory_triangle: 40.0,
    };
    /// Side view (0.02 s without grains) and profiles (0.004 s) of a tank of moving particles: grains are discs.
    pub const TANK: Self =
        Self { time: 0.025, time_grain: 7e-6, time_triangle: 0.0, memory: 2e7, memory_cell: 0.0, memory_triangle: 0.0 };

    fn of(case: &Case, model: &CostModel) -> Self {
        if case.solver == Solver::Mps { model.tank_pictures } else { model.grid_pictures }
    }
}

/// Triangles of the surface of a grain, about as many as the tetrahedra of its mesh; of a mesh in a file an ordinary
/// number.
pub(super) fn triangles(population: &Population) -> Real {
    match population.shape {
        GrainShape::Sphere { refinement, .. } => 20.0 * 4.0_f64.powi(refinement.min(100) as i32),
        GrainShape::Spheroid { rings, segments, .. } => 2.0 * rings as Real * segments as Real,
        GrainShape::Cylinder { segments, .. } => 4.0 * segments as Real,
        GrainShape::Box { .. } => 12.0,
        GrainShape::Mesh { .. } => 500.0,
    }
}

/// Wall-clock time of the pictures of a run of so many steps of a length \[s].
pub(super) fn time(case: &Case, populations: &[PopulationReport], [steps, dt]: [Real; 2], model: &CostModel) -> Real {
    let times = case.output.figures.count(case.run.until.min(steps * dt), steps);
    if times <= 0.0 {
        return 0.0;
    }
    let cost = PictureCost::of(case, model);
    let of_grains = case.grains.iter().zip(populations).map(|(population, report)| {
        let grains = report.levelled.or(report.grains).unwrap_or(0) as Real;
        grains * (cost.time_grain + cost.time_triangle * triangles(population))
    });
    times * (cost.time + of_grains.sum::<Real>())
}

/// The cost of the pictures of a case, if it draws any.
fn drawn(case: &Case, model: &CostModel) -> Option<PictureCost> {
    (!case.output.figures.is_empty()).then(|| PictureCost::of(case, model))
}

/// Memory for the pictures without cells and grains \[bytes].
pub(super) fn memory(case: &Case, model: &CostModel) -> Real {
    drawn(case, model).map_or(0.0, |cost| cost.memory)
}

/// Memory for a cell in pictures \[bytes].
pub(super) fn memory_per_cell(case: &Case, model: &CostModel) -> Real {
    drawn(case, model).map_or(0.0, |cost| cost.memory_cell)
}

/// Memory for a grain in pictures \[bytes].
pub(super) fn memory_per_grain(case: &Case, population: &Population, model: &CostModel) -> Real {
    drawn(case, model).map_or(0.0, |cost| cost.memory_triangle * triangles(population))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::population_reports;
    use super::*;
    use crate::assembly::shapes::shape_of;

    const CASE: &str = "[domain]\nsize = [\"10 mm\", \"10 mm\", \"10 mm\"]\ncells = [32, 32, 32]\n[run]\nuntil = \"1 ms\"\n\
                        [material.stone]\ndensity = \"2650 kg/m^3\"\n[[grains]]\nshape.sphere = { diameter = \"0.3 mm\" }\n\
                        placement.lattice = { counts = [20, 20, 10] }\n[output]\nfigures = { at = [\"1 ms\"] }\n";

    /// Processor time of the pictures of one time \[s], measured.
    #[test]
    fn pictures_take_what_was_measured_to_a_factor_of_one_and_a_half() {
        let sphere = |refinement: usize| {
            format!("grains.0.shape={{ sphere = {{ diameter = \"0.3 mm\", refinement = {refinement} }} }}")
        };
        let counts = |counts: &str| format!("grains.0.placement.lattice.counts={counts}");
        for (change, measured) in [
            (counts("[1, 1, 1]"), 0.38),
            (sphere(2), 1.6),
            (counts("[33, 33, 20]"), 6.2),
            (sphere(4), 12.2),
            ("grains.0.shape={ spheroid = { diameter = \"0.2 mm\", length = \"0.4 mm\" } }".to_owned(), 0.62),
            ("grains.0.shape={ box = { size = [\"0.2 mm\", \"0.2 mm\", \"0.2 mm\"] } }".to_owned(), 0.56),
        ] {
            let case = crate::case::parse(Path::new("case.toml"), CASE, std::slice::from_ref(&change)).unwrap().case;
            let populations = population_reports(&case, &[]);
            let found = time(&case, &populations, [100.0, 1e-5], &CostModel::default());
            assert!((found / measured).ln().abs() < 1.5_f64.ln(), "{change}: {found} s, not {measured} s");
        }
    }
    /// Counted on the surfaces that pictures draw.
    #[test]
    fn grains_have_the_triangles_that_the_cost_of_pictures_assumes() {
        for shape in [
            "sphere = { diameter = \"0.3 mm\" }",
            "sphere = { diameter = \"0.3 mm\", refinement = 2 }",
            "sphere = { diameter = \"0.3 mm\", refinement = 3 }",
            "spheroid = { diameter = \"0.2 mm\", length = \"0.4 mm\" }",
            "spheroid = { diameter = \"0.2 mm\", length = \"0.4 mm\", rings = 12, segments = 20 }",
            "cylinder = { diameter = \"0.2 mm\", length = \"0.4 mm\", segments = 24 }",
            "box = { size = [\"0.2 mm\", \"0.2 mm\", \"0.2 mm\"] }",
        ] {
            let change = format!("grains.0.shape={{ {shape} }}");
            let case = crate::case::parse(Path::new("case.toml"), CASE, &[change]).unwrap().case;
            let counted = shape_of(&case.grains[0]).unwrap().surface().triangles.len() as Real;
            let found = triangles(&case.grains[0]);
            assert!((found / counted).ln().abs() < 1.5_f64.ln(), "{shape}: {found}, not {counted}");
        }
    }
}
