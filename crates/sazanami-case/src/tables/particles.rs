//! `[particles]`: water as moving particles, for `solver = "mps"`.

use sazanami_case_derive::Keys;
use sazanami_mps::pressure::Tolerance;
use sazanami_mps::scheme::{CONJUGATE_RADIUS, ENHANCED_RADIUS, ParticleProjection, Turbulence};
use sazanami_mps::stability::StepLimits;
use sazanami_numerics::Real;

/// Range of the radius of influence over the particle spacing in which the lattice sums are what they should be.
const RADII: [Real; 2] = [2.1, 3.6];

/// Water as moving particles, for `solver = "mps"`. Sides may be `no_slip`, `slip`, `periodic` and open
/// (`outflow`, or `fixed_pressure` of gas at 0 Pa). Edges of the box between walls are multiples of the spacing to 2 %,
/// periodic ones are multiples of it.
#[derive(Clone, Debug, PartialEq, Keys)]
pub struct Particles {
    /// Particle spacing l0. Edges of the box are multiples of it, to 2 %.
    #[key(unit = "m", range = Positive, example = "1 mm")]
    pub spacing: Real,
    /// Projection of the velocities to zero divergence; see docs/decisions/0018-scheme-of-moving-particles.md.
    #[key(word, default = ParticleProjection::Conjugate,
          paper_literal = (Tazaki, ParticleProjection::Enhanced, "MPS-HS-HL-ECS-GC-DS is theirs"))]
    pub projection: ParticleProjection,
    /// Radius of influence r_e over the spacing; 2.6 at least with `conjugate`.
    #[key(range = Between(RADII[0], RADII[1]), default = suited_radius(projection),
          says = "2.6; 3.1 with `enhanced`")]
    pub radius: Real,
    /// Turbulence that the particles do not resolve. `mixing_length` is for turbulent flow over beds: an eddy viscosity
    /// `l^2 sqrt(2 S:S)` with a length that grows by 0.41 of the way from the bed and from walls that hold the water; laminar flows go
    /// without.
    #[key(word, default)]
    pub turbulence: Turbulence,
    /// Way of the fastest particle or grain in a step over its size.
    #[key(range = Between(1e-3, 0.5), default = StepLimits::default().courant)]
    pub courant: Real,
    /// Fixed time step; steps longer than what the limits allow are counted as `fixed_beyond_limits` under `limiter` in
    /// summary.json.
    #[key(unit = "s", range = Positive, says = "adaptive")]
    pub dt: Option<Real>,
    /// Longest time step.
    #[key(unit = "s", range = Positive, default = StepLimits::default().longest)]
    pub dt_max: Real,
    /// Largest residual of the pressure equation, as a volume strain in a step. Where the fastest particle or grain goes less than
    /// 1e-3 of a spacing in a step as much less is wanted, down to 1e-10.
    #[key(range = Between(1e-15, 1e-2), default = Tolerance::default().strain)]
    pub tolerance: Real,
    /// Most iterations of the pressure solver.
    #[key(least = 1, default = Tolerance::default().most_iterations)]
    pub pressure_iterations: usize,
}

fn suited_radius(projection: ParticleProjection) -> Real {
    match projection {
        ParticleProjection::Enhanced => ENHANCED_RADIUS,
        ParticleProjection::Conjugate => CONJUGATE_RADIUS,
    }
}
