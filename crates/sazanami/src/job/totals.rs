//! Sums and extremes over a whole run, checkpoints included.

use std::collections::BTreeMap;

use sazanami_dem::ContactReport;
use sazanami_mics::solver::StepReport;
use sazanami_numerics::Real;
use serde::{Deserialize, Serialize};

/// Worst values met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Worst {
    /// Advective Courant number of a pass.
    pub cfl: Real,
    /// `|div u| dt` left by a projection.
    pub divergence: Real,
    /// Overlap over the smaller contact sphere's radius.
    pub overlap_relative: Real,
    /// Iterations of a pressure solve, all passes of a step.
    pub pressure_iterations: usize,
    /// Distance of a liquid fraction from the range 0 to 1 before it was tidied up.
    pub volume_fraction_excess: Real,
    /// Volume by which grains reached into each other's cells [m^3].
    pub overfull_volume: Real,
    /// Volume of grains outside the box [m^3].
    pub outside_volume: Real,
    /// Speed of a grain [m/s].
    pub grain_speed: Real,
}

/// What had to be tidied up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Tidied {
    /// Nearly empty or full cells given to the interface next to them.
    pub moved_cells: u64,
    /// Their volume [m^3].
    pub moved_volume: Real,
    /// Nearly empty or full cells that were cut.
    pub clipped_cells: u64,
    /// Volume that this added (negative: removed) [m^3].
    pub clipped_volume: Real,
    /// Cells out of range by more than 1e-9.
    pub out_of_range_cells: u64,
    /// Contacts that became deeper than 20 % of the smaller sphere's radius.
    pub deep_contacts: usize,
}

/// Sums and extremes since the start of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Totals {
    /// Wall-clock time [s].
    pub wall_s: Real,
    /// Wall-clock time by phase [s].
    pub phase_s: BTreeMap<String, Real>,
    /// Steps by the limit that ruled them.
    pub limiter: BTreeMap<String, u64>,
    /// Shortest stable length of a step since the last row of the series [s]; none if there was no step.
    #[serde(default)]
    pub least_stable_step: Option<Real>,
    /// Fluid passes.
    pub fluid_passes: u64,
    /// Contact sub-steps.
    pub grain_substeps: u64,
    /// Iterations of the pressure solver.
    pub pressure_iterations: u64,
    /// Worst values.
    pub worst: Worst,
    /// What had to be tidied up.
    pub tidied: Tidied,
    /// Liquid through open sides [m^3].
    pub liquid_through: Real,
    /// Contacts in the last step: pairs, touching spheres.
    pub contacts: [usize; 2],
    /// What happened to moving particles, where there are any.
    #[serde(default)]
    pub particles: Option<ParticleTotals>,
}

/// What happened to moving particles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ParticleTotals {
    /// Pairs that the dynamic stabilisation pushed apart.
    pub pushed_pairs: u64,
    /// Work of its pushes [J].
    pub push_work: Real,
    /// Pairs that bounced off each other.
    pub collisions: u64,
    /// Particles that were put back from a wall.
    pub clipped: u64,
    /// Particles whose void fraction was cut to the least.
    pub cut_voids: u64,
    /// Particles whose pressure gradient was not corrected.
    pub plain_gradients: u64,
    /// Wall particles with little water before them that would have pulled at it.
    #[serde(default)]
    pub released_walls: u64,
    /// Coefficients of the pressure equation that were cut to zero.
    pub cut_coefficients: u64,
    /// Rows beside the surface held to a whole side.
    #[serde(default)]
    pub held_rows: u64,
    /// Largest root mean square of the volume strain.
    pub worst_strain_rms: Real,
    /// Smallest void fraction before it was cut.
    pub least_void: Real,
    /// Largest speed of the fluid [m/s].
    pub fluid_speed: Real,
}

impl ParticleTotals {
    /// Observer a step.
    pub fn add(&mut self, report: &sazanami_mps::solver::StepReport) {
        if self.least_void == 0.0 {
            self.least_void = 1.0;
        }
        self.pushed_pairs += report.stabilised_pairs as u64;
        self.push_work += report.stabilisation_work;
        self.collisions += report.collisions as u64;
        self.clipped += report.clipped as u64;
        self.cut_voids += report.coupling.cut_voids as u64;
        self.plain_gradients += report.uncorrected_gradients as u64;
        self.released_walls += report.tensile_cutoffs as u64;
        self.cut_coefficients += report.pressure.cut_coefficients as u64;
        self.held_rows += report.pressure.limited_rows as u64;
        self.worst_strain_rms = self.worst_strain_rms.max(report.strain[1]);
        self.least_void = self.least_void.min(report.coupling.least_void);
        self.fluid_speed = self.fluid_speed.max(report.largest_speed);
    }
}

impl Totals {
    /// Observer which limit ruled a step.
    pub fn ruled_by(&mut self, limit: &str) {
        match self.limiter.get_mut(limit) {
            Some(steps) => *steps += 1,
            None => drop(self.limiter.insert(limit.to_owned(), 1)),
        }
    }

    /// Observer how long the stable length of a step was [s].
    pub fn note_stable_step(&mut self, length: Real) {
        self.least_stable_step = Some(self.least_stable_step.map_or(length, |least| least.min(length)));
    }

    /// Observer how deep contacts were and how fast grains.
    pub fn note_contacts(&mut self, contacts: &ContactReport) {
        self.tidied.deep_contacts += contacts.deep_contacts;
        let worst = &mut self.worst;
        worst.overlap_relative = worst.overlap_relative.max(contacts.largest_overlap);
        worst.grain_speed = worst.grain_speed.max(contacts.largest_speed);
    }

    /// Observer what a step of the flow did with whatever water: contacts, and iterations of the pressure solver.
    pub fn note_step(&mut self, contacts: &ContactReport, pressure_iterations: usize) {
        self.note_contacts(contacts);
        self.grain_substeps += contacts.substeps as u64;
        self.contacts = [contacts.pairs, contacts.contacts];
        self.pressure_iterations += pressure_iterations as u64;
        self.worst.pressure_iterations = self.worst.pressure_iterations.max(pressure_iterations);
    }

    /// Observer what a step on a grid did beside [`Self::note_step`].
    pub fn add(&mut self, report: &StepReport) {
        self.fluid_passes += report.fluid_passes as u64;
        let residue = &report.transport.residue;
        let worst = &mut self.worst;
        worst.cfl = worst.cfl.max(report.courant);
        worst.divergence = worst.divergence.max(report.pressure.divergence);
        worst.volume_fraction_excess = worst.volume_fraction_excess.max(residue.worst_excess);
        worst.overfull_volume = worst.overfull_volume.max(report.imprint.overfull_volume);
        worst.outside_volume = worst.outside_volume.max(report.imprint.outside_volume);
        let tidied = &mut self.tidied;
        tidied.moved_cells += residue.moved_cells;
        tidied.moved_volume += residue.moved_volume;
        tidied.clipped_cells += residue.clipped_cells;
        tidied.clipped_volume += residue.clipped_volume;
        tidied.out_of_range_cells += residue.out_of_range_cells;
        self.liquid_through += report.transport.volume_through.iter().flatten().sum::<Real>();
    }
}
