//! Sums and extremes over a whole run, checkpoints included.

use std::collections::BTreeMap;

use sazanami_dem::ContactReport;
use sazanami_mics::solver::StepReport;
use sazanami_numerics::Real;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::columns::{Field, quantity};

/// Declares sums of a run with unit and meaning, as checkpoints keep them, and the list of their fields in the summary.
macro_rules! summed {
    ($(#[$about:meta])* $name:ident, $list:ident { $($(#[$kept:meta])* $field:ident: $kind:ty, $unit:literal, $meaning:literal;)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub(crate) struct $name {
            $(#[doc = $meaning] $(#[$kept])* pub $field: $kind,)*
        }

        #[doc = concat!("Fields of [`", stringify!($name), "`] in the summary.")]
        pub(crate) const $list: &[Field<$name>] =
            &[$(quantity(stringify!($field), $unit, $meaning, |sums| json!(sums.$field))),*];
    };
}

summed! {
    /// Largest values met since the start of a run.
    Worst, WORST {
        cfl: Real, "", "advective Courant number of a pass; of moving particles largest speed against the tank times step over spacing";
        divergence: Real, "", "`abs(div u) dt` that a projection left; of moving particles the relative residual of the pressure";
        overlap_relative: Real, "", "overlap over the smaller contact sphere's radius, once the bed is packed";
        #[serde(default)]
        packing_overlap_relative: Real, "", "the same while the bed was packed, on the softer springs of the packing";
        pressure_iterations: usize, "", "iterations of the pressure solver, all passes of a step";
        volume_fraction_excess: Real, "", "distance of a liquid fraction from the range 0 to 1 before it was corrected";
        overfull_volume: Real, "m^3", "volume by which grains overlap within cells";
        outside_volume: Real, "m^3", "volume of grains outside the box";
        #[serde(default)]
        room_difference: Real, "m^3", "liquid in full cells beyond the volume that grains leave open, or open volume without liquid";
        #[serde(default)]
        unplaced_volume: Real, "m^3", "liquid displaced by grains, or the lack of it, that waits in cells without open volume, each cell without its sign";
        grain_speed: Real, "m/s", "speed of a grain, once the bed is packed";
    }
}

summed! {
    /// Corrections of the fluid on the grid, and deep contacts.
    Corrections, CORRECTIONS {
        moved_cells: u64, "", "nearly empty or full cells whose remnant was given to the interface";
        moved_volume: Real, "m^3", "volume of these remnants";
        clipped_cells: u64, "", "nearly empty or full cells that were clipped, for want of an interface";
        clipped_volume: Real, "m^3", "liquid volume that this added (negative: removed)";
        #[serde(default)]
        handed_on_volume: Real, "m^3", "liquid that grains displaced from full cells into neighbouring ones";
        out_of_range_cells: u64, "", "cells whose liquid fraction left the range 0 to 1 by more than 1e-9";
        deep_contacts: usize, "", "contacts that became deeper than 20 % of a contact sphere's radius, those of the packing included";
        #[serde(default)]
        contact_work: Real, "J", "energy that contacts gave the grains (negative: took from them)";
    }
}

summed! {
    /// Stabilisation, collisions and corrections of moving particles.
    ParticleTotals, PARTICLES {
        #[serde(alias = "pushed_pairs")]
        stabilised_pairs: u64, "", "pairs that the dynamic stabilisation pushed apart";
        #[serde(alias = "push_work")]
        stabilisation_work: Real, "J", "work of these pushes, or of the damping of the default scheme (negative: taken from the water)";
        #[serde(default)]
        shifting_work: Real, "J", "potential energy that shifting has added with the conjugate projection (negative: taken)";
        collisions: u64, "", "pairs that collided";
        clipped: u64, "", "particles put back from a wall";
        #[serde(default)]
        clipping_work: Real, "J", "energy that this gave them, kinetic and potential (negative: taken from the water)";
        #[serde(alias = "cut_voids")]
        limited_voids: u64, "", "particles whose void fraction was raised to the least allowed";
        #[serde(alias = "plain_gradients")]
        uncorrected_gradients: u64, "", "particles whose pressure gradient was not corrected";
        #[serde(default, alias = "released_walls")]
        tensile_cutoffs: u64, "", "wall particles at a film of water whose tension was cut off";
        cut_coefficients: u64, "", "coefficients of the pressure equation that were cut to zero";
        #[serde(default, alias = "held_rows")]
        limited_rows: u64, "", "particles beside the surface whose missing neighbours counted as half a neighbourhood at most in the pressure equation";
        #[serde(default)]
        grains_without_vorticity: u64, "", "wet grains without lift: too few particles around them for a velocity gradient";
        worst_strain_rms: Real, "", "largest root mean square of the volume strain";
        least_void: Real, "", "smallest void fraction before it was raised";
        fluid_speed: Real, "m/s", "largest speed of the fluid, against the tank";
    }
}

/// Sums and extremes since the start of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Totals {
    /// Wall-clock time \[s].
    pub wall_s: Real,
    /// Wall-clock time by phase \[s].
    pub phase_s: BTreeMap<String, Real>,
    /// Steps by the limit that ruled them.
    pub limiter: BTreeMap<String, u64>,
    /// Shortest stable length of a step since the last row of the series \[s]; none if there was no step.
    #[serde(default)]
    pub least_stable_step: Option<Real>,
    /// Passes of the fluid, one or more a step.
    pub fluid_passes: u64,
    /// Contact sub-steps of the grains.
    pub grain_substeps: u64,
    /// Largest values met.
    pub worst: Worst,
    /// Cells and contacts that had to be corrected.
    #[serde(alias = "tidied")]
    pub corrections: Corrections,
    /// Contacts in the last step: pairs, touching spheres.
    pub contacts: [usize; 2],
    /// Totals of moving particles, where there are any.
    #[serde(default)]
    pub particles: Option<ParticleTotals>,
}

impl ParticleTotals {
    /// Adds a step of moving particles.
    pub fn add(&mut self, report: &sazanami_mps::solver::StepReport) {
        if self.least_void == 0.0 {
            self.least_void = 1.0;
        }
        self.stabilised_pairs += report.stabilised_pairs as u64;
        self.stabilisation_work += report.stabilisation_work;
        self.shifting_work += report.energy.shifting;
        self.collisions += report.collisions as u64;
        self.clipped += report.clipped as u64;
        self.clipping_work += report.clipping_work;
        self.limited_voids += report.coupling.limited_voids as u64;
        self.grains_without_vorticity += report.coupling.without_vorticity as u64;
        self.uncorrected_gradients += report.uncorrected_gradients as u64;
        self.tensile_cutoffs += report.tensile_cutoffs as u64;
        self.cut_coefficients += report.pressure.cut_coefficients as u64;
        self.limited_rows += report.pressure.limited_rows as u64;
        self.worst_strain_rms = self.worst_strain_rms.max(report.strain[1]);
        self.least_void = self.least_void.min(report.coupling.least_void);
        self.fluid_speed = self.fluid_speed.max(report.largest_speed);
    }
}

impl Totals {
    /// Counts which limit ruled a step.
    pub fn ruled_by(&mut self, limit: &str) {
        match self.limiter.get_mut(limit) {
            Some(steps) => *steps += 1,
            None => drop(self.limiter.insert(limit.to_owned(), 1)),
        }
    }

    /// Notes how long the stable length of a step was \[s].
    pub fn note_stable_step(&mut self, length: Real) {
        self.least_stable_step = Some(self.least_stable_step.map_or(length, |least| least.min(length)));
    }

    /// Notes how deep contacts were in a step of the packing.
    pub fn note_packing(&mut self, contacts: &ContactReport) {
        self.corrections.deep_contacts += contacts.deep_contacts;
        let deepest = &mut self.worst.packing_overlap_relative;
        *deepest = deepest.max(contacts.largest_overlap);
        self.contacts = [contacts.pairs, contacts.contacts];
    }

    /// Adds what a step of the flow did with whatever water: contacts, and iterations of the pressure solver.
    pub fn note_step(&mut self, contacts: &ContactReport, pressure_iterations: usize) {
        self.corrections.deep_contacts += contacts.deep_contacts;
        let worst = &mut self.worst;
        worst.overlap_relative = worst.overlap_relative.max(contacts.largest_overlap);
        worst.grain_speed = worst.grain_speed.max(contacts.largest_speed);
        self.grain_substeps += contacts.substeps as u64;
        self.corrections.contact_work += contacts.contact_work.unwrap_or(0.0);
        self.contacts = [contacts.pairs, contacts.contacts];
        self.worst.pressure_iterations = self.worst.pressure_iterations.max(pressure_iterations);
    }

    /// Adds what a step on a grid did beside [`Self::note_step`].
    pub fn add(&mut self, report: &StepReport) {
        self.fluid_passes += report.fluid_passes as u64;
        let residue = &report.transport.residue;
        let worst = &mut self.worst;
        worst.cfl = worst.cfl.max(report.courant);
        worst.divergence = worst.divergence.max(report.pressure.divergence);
        worst.volume_fraction_excess = worst.volume_fraction_excess.max(residue.worst_excess);
        worst.overfull_volume = worst.overfull_volume.max(report.imprint.overfull_volume);
        worst.outside_volume = worst.outside_volume.max(report.imprint.outside_volume);
        let settled = &report.transport.settled;
        worst.room_difference = worst.room_difference.max(settled.left_volume);
        worst.unplaced_volume = worst.unplaced_volume.max(settled.waiting_volume);
        let corrections = &mut self.corrections;
        corrections.moved_cells += residue.moved_cells;
        corrections.moved_volume += residue.moved_volume;
        corrections.clipped_cells += residue.clipped_cells;
        corrections.clipped_volume += residue.clipped_volume;
        corrections.handed_on_volume += settled.moved_volume;
        corrections.out_of_range_cells += residue.out_of_range_cells;
    }
}
