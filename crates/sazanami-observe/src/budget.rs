//! Budgets of momentum and liquid volume.
//!
//! The fluid fills every cell, also inside grains; the part that grains displace moves with them and is
//! subtracted. With the deferred impulse `J` that the exchange gives the grains in the next step, the momentum
//!
//! `P = sum rho_f u dV + sum (M_k - m_fk) v_k + sum J_k`
//!
//! changes only by the impulses of walls, gravity and open sides, and by the displaced-mass flux
//! `- sum v_k dm_fk`. The solver supplies both sides; their difference is the residual. A solver
//! whose `J` uses the displaced mass `m_fk` after the step takes `- v_k dm_fk` with the velocity before
//! it, and the other way round: then the residual is round-off.
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
