//! Budgets of momentum and liquid volume.
//!
//! The fluid is counted in every cell, also inside grains; its momentum on the part that grains cover is subtracted:
//!
//! `P = sum rho_f u dV - (covered) + sum M_k v_k`
//!
//! changes only by the impulses of walls, gravity and open sides. The solver supplies both sides; their difference is the residual.
//! Where the covered part counts as the displaced mass `m_fk` at the velocity of its grain, the displaced-mass flux `- sum v_k dm_fk` is one of
//! the impulses, with the velocity before the step if the mass is that after it.
//!
//! Moving particles have a separate budget ([`FluidMomentumBudget`]): that fluid lies between the grains, and
//! acts on them by drag and pressure.

mod liquid;
mod momentum;
mod particles;
mod total;

pub use liquid::{LiquidBudget, LiquidVolume};
pub use momentum::MomentumBudget;
pub use particles::{FluidMomentumBudget, ParticleImpulses};
