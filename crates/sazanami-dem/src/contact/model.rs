//! A contact law by itself: its springs and dashpots, and the limits that follow from them.
//!
//! With `n` from body i to body j, `v_r` the velocity of j relative to i at the contact point, `d_n` the overlap and
//! `d_t` the tangential displacement, the force on i is `h_n + h_t` with
//!
//! ```text
//! h_n = -K_n d_n n + D_n v_n,    h_t = K_t d_t + D_t v_t
//! ```
//!
//! A model gives `K_n`, `D_n`, `K_t` and `D_t`, which may depend on overlap and radii; `K_n` is a secant, the elastic
//! force over the overlap. Tension, friction, rotation of the displacement and rolling are the same for all models
//! ([`super::force`]).

use std::fmt::{Debug, Display};

use sazanami_numerics::Real;

use crate::lanes::Lanes;
use crate::material::ContactOptions;

/// Springs and dashpots of `W` contacts at their present overlap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Springs<const W: usize> {
    /// Secant stiffness `K_n` [N/m].
    pub normal_stiffness: Lanes<W>,
    /// `D_n` [N s/m].
    pub normal_damping: Lanes<W>,
    /// `K_t` [N/m].
    pub tangential_stiffness: Lanes<W>,
    /// `1/K_t`, 0 without a tangential spring [m/N].
    pub tangential_compliance: Lanes<W>,
    /// `D_t` [N s/m].
    pub tangential_damping: Lanes<W>,
}

/// A contact law of a pair of materials; the implementor holds its parameters, which `Display` says in a line for people.
///
/// The engine is compiled for each model: a model has no cost beyond its own formulas.
pub(crate) trait ContactModel: Copy + Display + 'static {
    /// Parameters of a pair of materials ready for evaluation.
    type Constants: Copy + Debug + Send + Sync;
    /// Those of `W` contacts.
    type Lanes<const W: usize>;

    /// Friction and the other parameters that all models have.
    fn options(&self) -> ContactOptions;

    /// Multiplies the friction coefficient.
    fn scale_friction(&mut self, factor: Real);

    /// Multiplies the stiffness and keeps the restitution.
    fn scale_stiffness(&mut self, factor: Real);

    /// Parameters ready for evaluation.
    fn constants(&self) -> Self::Constants;

    /// Whether dashpots are proportional to the square root of the reduced mass of the two grains.
    fn damped_by_mass(&self) -> bool;

    /// Constants by lane, each with a factor on its dashpots: the root of the reduced mass [kg^(1/2)] or 1.
    fn lanes<'a, const W: usize>(of: impl Fn(usize) -> (&'a Self::Constants, Real)) -> Self::Lanes<W>;

    /// Springs and dashpots at the overlaps \[m] of spheres of these `radii` \[m]; that of a wall is very large.
    fn springs<const W: usize>(lanes: &Self::Lanes<W>, overlap: Lanes<W>, radii: [Lanes<W>; 2]) -> Springs<W>;

    /// Elastic energy of the normal and of the tangential spring \[J]; `stretch` is the tangential displacement \[m].
    fn energy(constants: &Self::Constants, overlap: Real, stretch: Real, radii: [Real; 2]) -> [Real; 2];

    /// Largest normal and tangential stiffness of contacts of effective radius up to `radius` \[m], at any overlap that a
    /// run is meant to reach ([`super::pair::DEEP_OVERLAP`]) [N/m]: the contact sub-step must resolve it.
    fn stiffness(&self, radius: Real) -> [Real; 2];

    /// Largest normal and tangential dashpot of contacts of grains of reduced mass `mass` \[kg], at those overlaps [N s/m].
    fn damping(&self, mass: Real) -> [Real; 2];

    /// Coefficient of restitution of a central impact of two grains of reduced mass `mass` \[kg].
    fn restitution(&self, mass: Real) -> Real;
}
