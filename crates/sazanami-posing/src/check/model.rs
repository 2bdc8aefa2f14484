//! Cost of the parts of a run: time, memory, disk.

use sazanami_numerics::Real;

use super::pictures::PictureCost;

/// Cost of the parts of a run on one thread of an ordinary processor, and the memory they take.
///
/// The figures follow from the timings in `docs/performance.md`, where predictions stand beside measurements: they are
/// good to a factor of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostModel {
    /// Fluid pass, pressure included [s per cell], plus
    pub fluid: Real,
    /// [s per cell] with surface tension, plus
    pub tension: Real,
    /// \[s], however few the cells, plus
    pub pass: Real,
    /// [s per grain], plus
    pub fluid_grain: Real,
    /// [s per cell that grains fill]: friction on their surfaces, and iterations.
    pub fluid_filled: Real,
    /// Volume fractions, loads and room for the liquid [s per grain and fluid step], plus
    pub coupling_grain: Real,
    /// [s per cell that grains fill], plus
    pub coupling_filled: Real,
    /// the room of the liquid beside grains that move [s per cell of liquid and fluid step].
    pub room: Real,
    /// Sub-step of the grains [s per grain], plus
    pub substep_grain: Real,
    /// [s per contact sphere]: little, as the contacts cost, of which grains of few and of many spheres have as many.
    pub substep_sphere: Real,
    /// [s per contact sphere of a flat face]: of a body that rests on it all of these touch.
    pub substep_face: Real,
    /// Share of further threads that turns into speed.
    pub parallel_share: Real,
    /// Time to rest of a bed after the fall over that in which velocities fall to 1/e.
    pub packing_rest: Real,
    /// A file of results, until it is on the disk \[s]: 3 to 20 ms by the disk.
    pub file: Real,
    /// Memory [bytes per cell].
    pub memory_cell: Real,
    /// Memory [bytes per grain], plus
    pub memory_grain: Real,
    /// [bytes per contact sphere].
    pub memory_sphere: Real,
    /// Fields on disk [bytes per cell and output], after compression.
    pub disk_cell: Real,
    /// Step of moving particles, pressure and coupling included [s per fluid particle], plus
    pub fluid_particle: Real,
    /// [s per wall particle].
    pub wall_particle: Real,
    /// Memory [bytes per moving or wall particle].
    pub memory_particle: Real,
    /// Pictures of a flow on a grid.
    pub grid_pictures: PictureCost,
    /// Pictures of a tank of moving particles.
    pub tank_pictures: PictureCost,
    /// Moving particles, or grains that are points, on disk [bytes each and output], after compression.
    pub disk_point: Real,
}

impl CostModel {
    /// Speed on so many threads over that on one.
    pub(super) fn speed(&self, threads: usize) -> Real {
        1.0 + self.parallel_share * (threads as Real - 1.0)
    }
}

impl Default for CostModel {
    fn default() -> Self {
        Self {
            fluid: 2.2e-7,
            tension: 4e-7,
            pass: 2e-4,
            fluid_grain: 1.05e-5,
            fluid_filled: 2e-6,
            coupling_grain: 1e-5,
            coupling_filled: 1.5e-6,
            room: 4e-7,
            substep_grain: 2.2e-7,
            substep_sphere: 3e-9,
            substep_face: 7.5e-8,
            parallel_share: 0.85,
            packing_rest: 4.0,
            file: 1e-2,
            memory_cell: 320.0,
            memory_grain: 2.0e3,
            memory_sphere: 16.0,
            disk_cell: 12.0,
            fluid_particle: 7e-6,
            wall_particle: 2e-6,
            memory_particle: 3.0e3,
            disk_point: 40.0,
            grid_pictures: PictureCost::GRID,
            tank_pictures: PictureCost::TANK,
        }
    }
}
