//! The state of the fluid and of its coupling to the grains as named arrays.
//!
//! Cell fields span the whole box (x1 fastest) and are complete on rank 0. The state of the grains,
//! what the coupling keeps with them included, is saved by the discrete-element engine.

use std::sync::Arc;

use sazanami_dem::Engine;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::grid::Field;
use sazanami_numerics::snapshot::{Snapshot, SnapshotError};
use sazanami_numerics::{Real, Vector};

use crate::acceleration::Acceleration;
use crate::boundary::Boundary;
use crate::flow::Flow;
use crate::forces::Forces;
use crate::grains::{Coupling, GrainPhase};
use crate::pressure::Projection;
use crate::solver::{Settings, Solver};

const VOLUME_FRACTION: &str = "fluid/volume_fraction";
const VELOCITY: [&str; 3] = ["fluid/velocity_1", "fluid/velocity_2", "fluid/velocity_3"];
const FACE_VELOCITY: [&str; 3] = ["fluid/face_velocity_1", "fluid/face_velocity_2", "fluid/face_velocity_3"];
const LAST_FACES: [&str; 3] = ["fluid/last_faces_1", "fluid/last_faces_2", "fluid/last_faces_3"];
const EARLIER_FACES: [&str; 3] = ["fluid/earlier_faces_1", "fluid/earlier_faces_2", "fluid/earlier_faces_3"];
const EARLIER_LAST_FACES: [&str; 3] =
    ["fluid/earlier_last_faces_1", "fluid/earlier_last_faces_2", "fluid/earlier_last_faces_3"];
const EARLIER_STEP: &str = "fluid/earlier_step";
const PRESSURE: &str = "fluid/pressure";
const COUNTERS: &str = "fluid/counters";
const PREVIOUS_STEP: &str = "fluid/previous_step";
const GRAVITY: &str = "fluid/gravity";
/// Prefix of what the engine of the grains writes.
pub const GRAINS: &str = "grains/";

impl Solver {
    /// Everything that a restart needs to continue bit for bit. Collective; complete on rank 0.
    #[must_use]
    pub fn snapshot(&mut self) -> Snapshot {
        let domain = &self.domain;
        let mut snapshot = Snapshot::default();
        self.grains.engine_mut().snapshot(domain, GRAINS, &mut snapshot);
        snapshot.put_reals(VOLUME_FRACTION, domain.gather(&self.flow.volume_fraction));
        snapshot.put_reals(PRESSURE, domain.gather(self.projection.pressure()));
        for d in 0..3 {
            snapshot.put_reals(VELOCITY[d], domain.gather(&self.flow.velocity[d]));
            let faces = &self.flow.face_velocity[d];
            snapshot.put_reals(FACE_VELOCITY[d], domain.gather(faces));
            snapshot.put_reals(LAST_FACES[d], domain.gather(&upper_faces(domain, faces, d)));
        }
        if let Some((faces, dt)) = &self.flow.previous_faces {
            for d in 0..3 {
                snapshot.put_reals(EARLIER_FACES[d], domain.gather(&faces[d]));
                snapshot.put_reals(EARLIER_LAST_FACES[d], domain.gather(&upper_faces(domain, &faces[d], d)));
            }
            snapshot.put_reals(EARLIER_STEP, vec![*dt]);
        }
        snapshot.put_u64(COUNTERS, vec![self.flow.transports]);
        snapshot.put_reals(GRAVITY, self.settings.gravity.to_array().to_vec());
        snapshot.put_reals(PREVIOUS_STEP, self.previous_step.into_iter().collect());
        snapshot
    }

    /// Continues from a snapshot, which every rank holds. `flow` supplies fluids and schemes.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot does not fit this grid.
    #[allow(clippy::too_many_arguments, reason = "the parts of a solver, as in `Solver::new`, and the snapshot")]
    pub fn restore(
        domain: Domain,
        boundary: Boundary,
        settings: Settings,
        mut flow: Flow,
        engine: Engine,
        shapes: Arc<[Shape]>,
        coupling: Coupling,
        snapshot: &Snapshot,
    ) -> Result<Self, SnapshotError> {
        let cells = domain.grid().len();
        let scatter = |name: &str, field: &mut Field<Real>| {
            domain.scatter(snapshot.reals_of(name, cells)?, field);
            Ok::<_, SnapshotError>(())
        };
        scatter(VOLUME_FRACTION, &mut flow.volume_fraction)?;
        for d in 0..3 {
            scatter(VELOCITY[d], &mut flow.velocity[d])?;
            flow.face_velocity[d] = faces(&domain, snapshot, FACE_VELOCITY[d], LAST_FACES[d], d)?;
        }
        if let Ok(&[dt]) = snapshot.reals_of(EARLIER_STEP, 1) {
            let earlier = |d: usize| faces(&domain, snapshot, EARLIER_FACES[d], EARLIER_LAST_FACES[d], d);
            flow.previous_faces = Some(([earlier(0)?, earlier(1)?, earlier(2)?], dt));
        }
        flow.transports = snapshot.u64(COUNTERS)?.first().copied().unwrap_or_default();
        flow.fill_halos(&domain, &boundary);
        let mut projection = Projection::new(&domain, boundary.pressure_sides());
        scatter(PRESSURE, projection.pressure_mut())?;
        // The first step starts from the old pressure, ghosts included.
        let gravity = Vector::from_slice(snapshot.reals_of(GRAVITY, 3)?);
        projection.fill_ghosts(&domain, &flow.density, gravity);
        let mut grains = GrainPhase::new(&domain, engine, shapes, coupling);
        grains.resume(&domain, &flow);
        let previous_step = snapshot.reals(PREVIOUS_STEP)?.first().copied();
        let (forces, acceleration) = (Forces::default(), Acceleration::beside(&domain, &grains, &mut flow));
        let carried = None;
        Ok(Self { domain, boundary, settings, flow, forces, projection, grains, acceleration, previous_step, carried })
    }
}

/// Reads face values: those on lower faces, and those on the upper faces of the last cells.
fn faces(
    domain: &Domain,
    snapshot: &Snapshot,
    lower: &str,
    last: &str,
    direction: usize,
) -> Result<Field<Real>, SnapshotError> {
    let cells = domain.grid().len();
    let (mut upper, mut faces) = (domain.field(0.0), domain.field(0.0));
    domain.scatter(snapshot.reals_of(last, cells)?, &mut upper);
    domain.scatter(snapshot.reals_of(lower, cells)?, &mut faces);
    set_last_faces(domain, &upper, &mut faces, direction);
    Ok(faces)
}

/// The upper faces of the cells in `direction` as a field of their lower neighbours.
fn upper_faces(domain: &Domain, faces: &Field<Real>, direction: usize) -> Field<Real> {
    let mut upper = domain.field(0.0);
    let ahead = faces.strides()[direction];
    domain.set(&mut upper, |i, j, k| faces.data()[faces.at(i, j, k) + ahead]);
    upper
}

/// Sets the upper faces of the last cells in `direction`, which no cell has as its lower face.
fn set_last_faces(domain: &Domain, upper: &Field<Real>, faces: &mut Field<Real>, direction: usize) {
    let ahead = faces.strides()[direction];
    let mut last = domain.interior();
    last[direction] = last[direction].end - 1..last[direction].end;
    for k in last[2].clone() {
        for j in last[1].clone() {
            for i in last[0].clone() {
                let at = faces.at(i, j, k);
                faces.data_mut()[at + ahead] = upper.data()[at];
            }
        }
    }
}
