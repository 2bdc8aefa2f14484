//! The state of the fluid and of its coupling to the grains as named arrays.
//!
//! Cell fields span the whole box (x1 fastest) and are complete on rank 0. The state of the grains,
//! what the coupling keeps with them included, is saved by the discrete-element engine.

use std::sync::Arc;

use sazanami_dem::Engine;
use sazanami_numerics::domain::{Domain, Ghost, GhostRules, Location, Region};
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::grid::Field;
use sazanami_numerics::snapshot::{Snapshot, SnapshotError};
use sazanami_numerics::{Real, Vector};

use crate::boundary::Boundary;
use crate::flow::Flow;
use crate::grains::{Coupling, ResolvedGrains};
use crate::pressure::Projection;
use crate::solver::{GridSettings, Solver};
use crate::surface_tension::SurfaceTension;

const VOLUME_FRACTION: &str = "fluid/volume_fraction";
const OPEN_PART: &str = "fluid/open_part";
const WAITING: &str = "fluid/liquid_waiting";
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
const MEAN_GRADIENT: &str = "fluid/mean_gradient";
const RESPONSE: [&str; 3] = ["fluid/response_1", "fluid/response_2", "fluid/response_3"];
const JUMP: [&str; 3] = ["fluid/surface_tension_1", "fluid/surface_tension_2", "fluid/surface_tension_3"];
const LAST_JUMP: [&str; 3] =
    ["fluid/last_surface_tension_1", "fluid/last_surface_tension_2", "fluid/last_surface_tension_3"];
/// By the direction along walls and that of the walls; in a box of one cell between these the second is for the upper ones.
const LINES_OF_CONTACT: [[[&str; 2]; 3]; 3] = [
    [
        [""; 2],
        ["fluid/line_of_contact_1_2", "fluid/upper_line_of_contact_1_2"],
        ["fluid/line_of_contact_1_3", "fluid/upper_line_of_contact_1_3"],
    ],
    [
        ["fluid/line_of_contact_2_1", "fluid/upper_line_of_contact_2_1"],
        [""; 2],
        ["fluid/line_of_contact_2_3", "fluid/upper_line_of_contact_2_3"],
    ],
    [
        ["fluid/line_of_contact_3_1", "fluid/upper_line_of_contact_3_1"],
        ["fluid/line_of_contact_3_2", "fluid/upper_line_of_contact_3_2"],
        [""; 2],
    ],
];
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
        if let Some(room) = &self.room {
            snapshot.put_reals(OPEN_PART, domain.gather(room.open_field()));
            snapshot.put_reals(WAITING, domain.gather(room.waiting_field()));
        }
        snapshot.put_reals(PRESSURE, domain.gather(self.projection.pressure()));
        for d in 0..3 {
            snapshot.put_reals(VELOCITY[d], domain.gather(&self.flow.velocity[d]));
            let faces = &self.flow.face_velocity[d];
            snapshot.put_reals(FACE_VELOCITY[d], domain.gather(faces));
            snapshot.put_reals(LAST_FACES[d], last_faces(domain, faces, d));
        }
        if let Some((faces, dt)) = &self.flow.previous_faces {
            for d in 0..3 {
                snapshot.put_reals(EARLIER_FACES[d], domain.gather(&faces[d]));
                snapshot.put_reals(EARLIER_LAST_FACES[d], last_faces(domain, &faces[d], d));
            }
            snapshot.put_reals(EARLIER_STEP, vec![*dt]);
        }
        if let Some(tension) = &self.projection.tension {
            for (d, jump) in tension.jump().iter().enumerate() {
                snapshot.put_reals(JUMP[d], domain.gather(jump));
                snapshot.put_reals(LAST_JUMP[d], last_faces(domain, jump, d));
            }
            for ([d, wall, part], places) in tension.heights().pinned(domain) {
                snapshot.put_reals(LINES_OF_CONTACT[d][wall][part], domain.gather(&places));
            }
        }
        snapshot.put_u64(COUNTERS, vec![self.flow.transports]);
        snapshot.put_reals(GRAVITY, self.settings.gravity.to_array().to_vec());
        let by_pressure = self.projection.mean.acceleration();
        if by_pressure != Vector::ZERO {
            snapshot.put_reals(MEAN_GRADIENT, by_pressure.to_array().to_vec());
        }
        for (name, response) in RESPONSE.iter().zip(self.projection.mean.responses()) {
            if let Some(response) = response {
                snapshot.put_reals(*name, domain.gather(response));
            }
        }
        if let Some(flow) = &self.mean_flow {
            flow.save(&mut snapshot);
        }
        snapshot.put_reals(PREVIOUS_STEP, self.previous_step.into_iter().collect());
        snapshot
    }

    /// Continues from a snapshot, whose cell fields are read on rank 0 only, the rest on every rank. `flow` supplies fluids and schemes.
    /// A mean velocity that was held is to be held again ([`Solver::with_mean_flow`]).
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot does not fit this grid.
    #[allow(clippy::too_many_arguments, reason = "the parts of a solver, as in `Solver::new`, and the snapshot")]
    pub fn restore(
        domain: Domain,
        boundary: Boundary,
        settings: GridSettings,
        mut flow: Flow,
        engine: Engine,
        shapes: Arc<[Shape]>,
        coupling: Coupling,
        snapshot: &Snapshot,
    ) -> Result<Self, SnapshotError> {
        let scatter = |name: &str, field: &mut Field<Real>| scatter(&domain, snapshot, name, field);
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
        let by_pressure = snapshot.reals_of(MEAN_GRADIENT, 3).map_or(Vector::ZERO, Vector::from_slice);
        projection.mean.drive(by_pressure, flow.fluids.liquid_density);
        for (name, response) in RESPONSE.iter().zip(projection.mean.responses_mut()) {
            if domain.max(Real::from(u8::from(snapshot.reals(name).is_ok()))) > 0.0 {
                scatter(name, response.insert(domain.field(0.0)))?;
            }
        }
        projection.set_outside(&domain, boundary.gravity_outside(), &flow);
        projection.fill_ghosts(&domain, &flow, gravity);
        let grains = ResolvedGrains::new(&domain, &flow.fluids, engine, shapes, coupling);
        let mut solver = Self::assembled(domain, boundary, settings, flow, projection, grains);
        solver.previous_step = snapshot.reals(PREVIOUS_STEP)?.first().copied();
        let Self { domain, room, grains, .. } = &mut solver;
        if let Some(room) = room {
            self::scatter(domain, snapshot, OPEN_PART, room.open_mut())?;
            self::scatter(domain, snapshot, WAITING, room.waiting_mut())?;
            room.resume(domain, grains.covered_mut());
        }
        Ok(solver)
    }
}

impl SurfaceTension {
    /// Continues with the jumps of a snapshot, which is read on rank 0; one of a run without surface tension has none. Collective.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot does not fit this grid.
    pub fn restore(mut self, domain: &Domain, snapshot: &Snapshot) -> Result<Self, SnapshotError> {
        if domain.max(Real::from(u8::from(snapshot.reals(JUMP[0]).is_ok()))) > 0.0 {
            for (d, jump) in self.jump_mut().iter_mut().enumerate() {
                *jump = faces(domain, snapshot, JUMP[d], LAST_JUMP[d], d)?;
            }
            self.jump_is_set(domain);
            self.heights_mut().pin(domain, |[d, wall, part]| {
                let (name, mut places) = (LINES_OF_CONTACT[d][wall][part], domain.field(0.0));
                if domain.max(Real::from(u8::from(snapshot.reals(name).is_ok()))) == 0.0 {
                    return Ok::<_, SnapshotError>(None);
                }
                scatter(domain, snapshot, name, &mut places)?;
                Ok(Some(places))
            })?;
        }
        Ok(self)
    }
}

/// Whether section `name` is a field of the cells: complete, and needed, on rank 0 only.
#[must_use]
pub fn is_of_cells(name: &str) -> bool {
    let fields = [VELOCITY, FACE_VELOCITY, LAST_FACES, EARLIER_FACES, EARLIER_LAST_FACES, RESPONSE, JUMP, LAST_JUMP];
    [VOLUME_FRACTION, OPEN_PART, WAITING, PRESSURE].contains(&name)
        || fields.iter().flatten().chain(LINES_OF_CONTACT.as_flattened().as_flattened()).any(|&field| field == name)
}

/// Reads a field of the cells on rank 0 and gives each rank its part.
fn scatter(domain: &Domain, snapshot: &Snapshot, name: &str, field: &mut Field<Real>) -> Result<(), SnapshotError> {
    let all = on_first(domain, || snapshot.reals_of(name, domain.grid().len()))?;
    domain.scatter(all, field);
    Ok(())
}

/// Values read on rank 0; nothing on the others. An error is one on all.
fn on_first<'a>(
    domain: &Domain,
    read: impl FnOnce() -> Result<&'a [Real], SnapshotError>,
) -> Result<&'a [Real], SnapshotError> {
    domain.agree(if domain.communicator().rank() == 0 { read() } else { Ok(&[]) })
}

/// The last cells in `direction`.
fn last_cells(domain: &Domain, direction: usize) -> Region {
    let mut layer = domain.whole();
    layer[direction] = layer[direction].end - 1..layer[direction].end;
    layer
}

/// The upper faces of the last cells in `direction`, which no cell has as its lower face.
fn last_faces(domain: &Domain, faces: &Field<Real>, direction: usize) -> Vec<Real> {
    domain.gather_within(&last_cells(domain, direction), &upper_faces(domain, faces, direction))
}

/// Reads face values: those on lower faces, and those on the upper faces of the last cells.
fn faces(
    domain: &Domain,
    snapshot: &Snapshot,
    lower: &str,
    last: &str,
    direction: usize,
) -> Result<Field<Real>, SnapshotError> {
    let (mut upper, mut faces) = (domain.field(0.0), domain.field(0.0));
    scatter(domain, snapshot, lower, &mut faces)?;
    let layer = last_cells(domain, direction);
    let expected: usize = layer.iter().map(ExactSizeIterator::len).product();
    // Earlier snapshots hold the upper faces of all cells.
    let is_layer = domain.max(Real::from(u8::from(snapshot.reals(last).is_ok_and(|all| all.len() == expected)))) > 0.0;
    if is_layer {
        let all = on_first(domain, || snapshot.reals_of(last, expected))?;
        domain.scatter_within(&layer, all, &mut upper);
    } else {
        scatter(domain, snapshot, last, &mut upper)?;
    }
    // Between ranks the upper face of the last cells is the lower one of the first cells beyond.
    let shared = GhostRules { location: Location::Face(direction), sides: [[Ghost::Kept; 2]; 3] };
    domain.fill_halos_to(1, &mut [(&mut faces, &shared)]);
    if domain.at_box_end(direction, 1) {
        set_last_faces(domain, &upper, &mut faces, direction);
    }
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
