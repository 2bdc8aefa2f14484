//! Report of a step.

use sazanami_dem::ContactReport;
use sazanami_numerics::Real;
use sazanami_numerics::mean_flow::MeanFlowReport;

use crate::free_surface::SurfaceReport;
use crate::grains::CouplingReport;
use crate::momentum::FluidImpulses;
use crate::motion::Clipped;
use crate::pressure::PressureReport;
use crate::stabilisation::StabilisationReport;

/// A phase of the step, for whoever measures it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Order, ghosts, lists.
    Neighbours,
    /// Sums over neighbours, motion.
    Fluid,
    /// Assembly and solution of the pressure equation.
    Pressure,
    /// Contacts and motion of the grains.
    Grains,
    /// Void fraction, drag.
    Coupling,
}

/// Energy that parts of a step of the conjugate projection add to the fluid \[J]; that of its damping is
/// [`StepReport::stabilisation_work`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyChanges {
    /// Kinetic energy relative to the walls by the pressure, never positive up to its residual.
    pub projection: Real,
    /// Kinetic energy by the relaxation of the number density.
    pub relaxation: Real,
    /// Potential energy by shifting.
    pub shifting: Real,
}

/// Report of a step, over all ranks.
#[derive(Clone, Debug, Default)]
pub struct StepReport {
    /// Solution of the pressure equation.
    pub pressure: PressureReport,
    /// Mean and root mean square of the volume strain away from the free surface, at the start of the step.
    pub strain: [Real; 2],
    /// Fluid particles at the free surface.
    pub surface: usize,
    /// Isolated fluid particles (spray).
    pub isolated: usize,
    /// Wall particles at which the tensile cut-off acted.
    pub tensile_cutoffs: usize,
    /// Particles with an uncorrected pressure gradient.
    pub uncorrected_gradients: usize,
    /// Pairs on which dynamic stabilisation acted.
    pub stabilised_pairs: usize,
    /// Work done by the stabilisation \[J].
    pub stabilisation_work: Real,
    /// Largest kinematic viscosity, fluid and eddies together [m^2/s]; 0 with the published scheme.
    pub largest_viscosity: Real,
    /// Largest displacement by shifting \[m].
    pub largest_shift: Real,
    /// Pairs that collided, fluid with fluid or fluid with wall.
    pub collisions: usize,
    /// Particles clipped to the box.
    pub clipped: usize,
    /// Energy that this gave them, kinetic and potential \[J].
    pub clipping_work: Real,
    /// Largest speed of the fluid relative to the walls [m/s].
    pub largest_speed: Real,
    /// Pairs in the neighbour lists.
    pub pairs: usize,
    /// Contacts between grains and with walls; the largest speed is that relative to the walls.
    pub contacts: ContactReport,
    /// Coupling with the grains.
    pub coupling: CouplingReport,
    /// External impulses on the fluid.
    pub impulses: FluidImpulses,
    /// Energy added by the conjugate projection; zero with the other one.
    pub energy: EnergyChanges,
    /// The mean velocity that is held, if one is, and the force that held it; its impulse is part of that of the body force.
    pub mean_flow: Option<MeanFlowReport>,
}

impl StepReport {
    pub(crate) fn set_surface(&mut self, found: &SurfaceReport) {
        (self.isolated, self.surface, self.strain) = (found.isolated, found.surface, found.strain);
    }

    pub(crate) fn set_clipped(&mut self, found: Clipped) {
        (self.clipped, self.clipping_work) = (found.count, found.work);
    }

    pub(crate) fn set_stabilisation(&mut self, found: StabilisationReport) {
        (self.stabilised_pairs, self.stabilisation_work) = (found.pairs, found.work);
    }
}
