//! Snapshot of fluid and walls as named arrays, sorted by identifier, for any number of ranks.
//!
//! Neighbour lists and ghosts are not part of it: they are rebuilt from positions and identifiers.

use sazanami_numerics::Vector;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::particles::ParticleColumns;
use sazanami_numerics::snapshot::{Snapshot, SnapshotError};

use crate::boundary::Tank;
use crate::grains::OverlappingGrains;
use crate::particles::ParticleRecord;
use crate::scheme::Turbulence;
use crate::solver::{ParticleSettings, SetupError, Solver};

const ID: &str = "fluid/id";
const FLAGS: &str = "fluid/flags";
const POSITION: &str = "fluid/position";
const VELOCITY: &str = "fluid/velocity";
const PRESSURE: &str = "fluid/pressure";
const GRADIENT: &str = "fluid/gradient";
const REFERENCE: &str = "fluid/reference";
const DRAG_RATE: &str = "fluid/drag_rate";
/// There only if grains were stepped without drag: it tells their rate of zero from that before the first step.
const WITHOUT_DRAG: &str = "fluid/without_drag";
/// There only with eddies: the largest viscosity of the last step, which limits the next.
const VISCOSITY: &str = "fluid/largest_viscosity";
/// Displacement and velocity of the walls.
const WALLS: &str = "fluid/walls";
/// Prefix of the sections of the grain engine.
pub const GRAINS: &str = "grains/";

/// A solver could not be restored from a snapshot.
#[derive(Clone, Debug, thiserror::Error)]
pub enum RestoreError {
    /// The snapshot belongs to another problem.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// Walls or periodic lengths do not fit.
    #[error(transparent)]
    Setup(#[from] SetupError),
}

impl Solver {
    /// State from which a run continues with the same bits. Collective; complete on rank 0.
    #[must_use]
    pub fn snapshot(&mut self) -> Snapshot {
        let mut snapshot = Snapshot::default();
        let Self { domain, grains, .. } = self;
        grains.engine_mut().snapshot(domain, GRAINS, &mut snapshot);
        let own = (0..self.particles.owned).map(|a| self.particles.record(a));
        let all: Vec<ParticleRecord> = self.domain.to_first_by(own, |record| record.id);
        snapshot.put_u64(ID, all.iter().map(|r| r.id).collect());
        snapshot.put_u64(FLAGS, all.iter().map(ParticleRecord::flags).collect());
        snapshot.put_reals(POSITION, all.iter().flat_map(|r| r.position).collect());
        snapshot.put_reals(VELOCITY, all.iter().flat_map(|r| r.velocity).collect());
        snapshot.put_reals(PRESSURE, all.iter().map(|r| r.pressure).collect());
        snapshot.put_reals(GRADIENT, all.iter().flat_map(|r| r.gradient).collect());
        snapshot.put_reals(REFERENCE, self.settings().reference.to_array().to_vec());
        snapshot.put_reals(DRAG_RATE, vec![self.grains.drag_rate()]);
        if self.grains.stepped_without_drag() {
            snapshot.put_u64(WITHOUT_DRAG, vec![1]);
        }
        if self.settings().scheme.turbulence != Turbulence::None {
            snapshot.put_reals(VISCOSITY, vec![self.largest_viscosity]);
        }
        if let Some(flow) = &self.mean_flow {
            flow.save(&mut snapshot);
        }
        let tank = self.tank();
        snapshot.put_reals(WALLS, [tank.displacement, tank.velocity].iter().flat_map(|v| v.to_array()).collect());
        snapshot
    }

    /// Restores a solver from a snapshot that every rank holds; `grains` are restored by their engine before. A mean velocity that
    /// was held is to be held again ([`Solver::hold_mean_flow`]).
    ///
    /// # Errors
    /// [`RestoreError`] if the snapshot belongs to another problem.
    pub fn restore(
        domain: Domain,
        settings: ParticleSettings,
        tank: Tank,
        grains: OverlappingGrains,
        snapshot: &Snapshot,
    ) -> Result<Self, RestoreError> {
        let id = snapshot.u64(ID)?;
        let count = id.len();
        let flags = snapshot.u64_of(FLAGS, count)?;
        let triple = |name: &str| snapshot.reals_of(name, 3 * count);
        let (position, velocity, gradient) = (triple(POSITION)?, triple(VELOCITY)?, triple(GRADIENT)?);
        let pressure = snapshot.reals_of(PRESSURE, count)?;
        let of = |values: &[f64], n: usize| [values[3 * n], values[3 * n + 1], values[3 * n + 2]];
        let records: Vec<ParticleRecord> = (0..count)
            .map(|n| {
                let [kind, role] = ParticleRecord::of_flags(flags[n]);
                let (position, velocity, gradient) = (of(position, n), of(velocity, n), of(gradient, n));
                ParticleRecord { id: id[n], kind, role, position, velocity, pressure: pressure[n], gradient }
            })
            .collect();
        // The reduced pressures refer to this point.
        let reference = snapshot.reals_of(REFERENCE, 3)?;
        let settings = ParticleSettings { reference: Vector::from_slice(reference), ..settings };
        // Older snapshots have no such section.
        let tank = match snapshot.reals_of(WALLS, 6) {
            Ok(walls) => Tank {
                displacement: Vector::from_slice(&walls[..3]),
                velocity: Vector::from_slice(&walls[3..]),
                ..tank
            },
            Err(_) => tank,
        };
        let mut solver = Self::from_records(domain, settings, tank, &records, grains)?;
        let rate = snapshot.reals_of(DRAG_RATE, 1)?[0];
        let stepped = rate > 0.0 || snapshot.u64_of(WITHOUT_DRAG, 1).is_ok();
        solver.grains.set_drag_rate(rate, stepped);
        if solver.settings().scheme.turbulence != Turbulence::None {
            solver.largest_viscosity = snapshot.reals_of(VISCOSITY, 1)?[0];
        }
        Ok(solver)
    }
}
