//! The grains for ParaView: a point a grain, ready for glyphs, and surfaces in their true shape.

use std::path::Path;

use bytemuck::{Pod, Zeroable};
use sazanami_dem::Engine;
use sazanami_io::vtk::{BodyFile, DataArray, PointFile, write_bodies, write_points};
use sazanami_io::{Bodies, BodyPose, BodySurface};
use sazanami_numerics::choice::Choice;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::{Quaternion, Real, Vector};

use crate::case::meaning::{Case, GrainArray};
use crate::clock::Clock;
use crate::job::RecordError;
use crate::state::Array;

/// Time since the last contact of a grain that never touched any \[s].
pub(crate) const NEVER: Real = 1e9;

/// A grain on its way to rank 0.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Record {
    id: u64,
    population: u32,
    material: u32,
    touched_grains: u64,
    diameter: Real,
    scale: Real,
    mass: Real,
    position: [Real; 3],
    orientation: [Real; 4],
    velocity: [Real; 3],
    angular_velocity: [Real; 3],
    contact_force: [Real; 3],
    contact_torque: [Real; 3],
    time_since_contact: Real,
}

/// Where a place is in a tank that is displaced by `shift` \[m]: within it along its periodic directions, whose sides stay behind.
pub(crate) fn in_tank(domain: &Domain, mut place: Vector, shift: Vector) -> Vector {
    if shift == Vector::ZERO {
        return place;
    }
    place -= shift;
    let (lower, extent) = (domain.grid().lower, domain.grid().extent());
    for d in (0..3).filter(|&d| domain.periodic()[d]) {
        place[d] -= ((place[d] - lower[d]) / extent[d]).floor() * extent[d];
    }
    place
}

/// Arrays of a state beside the positions; what follows from these is left out.
const OF_STATE: [GrainArray; 13] = [
    GrainArray::Id,
    GrainArray::Orientation,
    GrainArray::Velocity,
    GrainArray::AngularVelocity,
    GrainArray::ContactForce,
    GrainArray::ContactTorque,
    GrainArray::Population,
    GrainArray::Material,
    GrainArray::TouchedGrains,
    GrainArray::Diameter,
    GrainArray::Scale,
    GrainArray::Mass,
    GrainArray::TimeSinceContact,
];

/// The grains of all ranks on rank 0, in the order of their identifiers; none on other ranks.
pub(crate) struct GrainStates {
    records: Vec<Record>,
    /// Rotation with which the grains of each population lie as their shape was given.
    drawn: Vec<Quaternion>,
}

impl GrainStates {
    /// Gathers the grains. Collective. `shift` and `drift` are the displacement \[m] and the velocity [m/s] of the frame that is written
    /// against that of the engine, `tank` is the displacement of the tank in the latter \[m].
    pub fn gather(domain: &Domain, engine: &Engine, tank: Vector, [shift, drift]: [Vector; 2]) -> Self {
        let grains = engine.grains();
        let record = |i: usize| {
            let volume = engine.bodies()[grains.shape[i] as usize].volume * grains.scale[i].powi(3);
            Record {
                id: grains.id[i],
                population: grains.shape[i],
                material: grains.material[i],
                touched_grains: engine.touched_grains(i) as u64,
                diameter: (6.0 / std::f64::consts::PI * volume).cbrt(),
                scale: grains.scale[i],
                mass: grains.mass[i],
                position: (in_tank(domain, grains.position[i], tank) - (shift - tank)).to_array(),
                orientation: grains.orientation[i].to_array(),
                velocity: (grains.velocity[i] - drift).to_array(),
                angular_velocity: grains.angular_velocity(i).to_array(),
                contact_force: grains.contact_force[i].to_array(),
                contact_torque: grains.contact_torque[i].to_array(),
                time_since_contact: (engine.time() - grains.last_contact[i]).min(NEVER),
            }
        };
        let records = domain.to_first_by((0..grains.owned()).map(record), |record| record.id);
        Self { records, drawn: engine.bodies().iter().map(|body| body.drawn).collect() }
    }

    /// Writes a point for each grain, with the arrays that the case asks for; `own` are those that only its solver has.
    pub fn write_points(&self, case: &Case, own: &[Array], clock: &Clock, path: &Path) -> Result<(), RecordError> {
        let asked = self.asked(case, own, true);
        let arrays: Vec<DataArray> = asked.iter().map(Array::rounded).collect();
        let places: Vec<Vector> = self.records.iter().map(|record| record.position.into()).collect();
        let (time, frame) = (Some(clock.time()), Some(case.output.frame.word()));
        let file =
            PointFile { places: &places, double: false, time, arrays: &arrays, scalars: coloured(&arrays), frame };
        Ok(write_points(path, &file)?)
    }

    /// Writes the surface of each grain; each corner has the values of its grain.
    pub fn write_meshes(
        &self,
        case: &Case,
        own: &[Array],
        shapes: &[Shape],
        clock: &Clock,
        path: &Path,
    ) -> Result<(), RecordError> {
        let asked = self.asked(case, own, false);
        let arrays: Vec<DataArray> = asked.iter().map(Array::rounded).collect();
        let pose = |record: &Record| BodyPose {
            surface: record.population,
            scale: record.scale,
            position: record.position.into(),
            orientation: Quaternion::from_array(record.orientation),
        };
        let surfaces: Vec<BodySurface> = shapes.iter().map(surface).collect();
        let poses: Vec<BodyPose> = self.records.iter().map(pose).collect();
        let bodies = Bodies { surfaces: &surfaces, poses: &poses };
        let (time, frame) = (Some(clock.time()), Some(case.output.frame.word()));
        let file = BodyFile { bodies, time, arrays: &arrays, scalars: coloured(&arrays), frame };
        Ok(write_bodies(path, &file)?)
    }

    /// Everything that both solvers know of grains, by the names of their files.
    pub fn arrays_of_state(&self) -> Vec<Array> {
        let position = Array::reals("position", 3, self.records.iter().flat_map(|record| record.position));
        let [first, further @ ..] = &OF_STATE;
        let further = further.iter().filter_map(|&array| self.array(array));
        self.array(*first).into_iter().chain([position]).chain(further).collect()
    }

    /// The arrays that the case asks for. What turns and scales glyphs is for points alone.
    fn asked(&self, case: &Case, own: &[Array], points: bool) -> Vec<Array> {
        let asked = case.output.grain_arrays.0.iter().filter(|array| points || **array != GrainArray::Orientation);
        let is_own = |array: GrainArray| own.iter().find(|own| own.name == array.word()).cloned();
        asked.filter_map(|&array| is_own(array).or_else(|| self.array(array))).collect()
    }

    /// Rotation of a grain from its shape as it was given.
    fn turn(&self, record: &Record) -> Quaternion {
        Quaternion::from_array(record.orientation) * self.drawn[record.population as usize].conjugate()
    }

    /// An array that both solvers have.
    fn array(&self, array: GrainArray) -> Option<Array> {
        let name = array.word();
        let whole = |of: fn(&Record) -> u32| Some(Array::whole(name, self.records.iter().map(of)));
        let real = |of: fn(&Record) -> Real| Some(Array::reals(name, 1, self.records.iter().map(of)));
        let vector = |of: fn(&Record) -> [Real; 3]| Some(Array::reals(name, 3, self.records.iter().flat_map(of)));
        match array {
            GrainArray::Id => Some(Array::long(name, self.records.iter().map(|record| record.id))),
            GrainArray::Population => whole(|r| r.population),
            GrainArray::Material => whole(|r| r.material),
            GrainArray::TouchedGrains => whole(|r| r.touched_grains as u32),
            GrainArray::Diameter => real(|r| r.diameter),
            GrainArray::Scale => real(|r| r.scale),
            GrainArray::Mass => real(|r| r.mass),
            GrainArray::Speed => real(|r| Vector::from(r.velocity).length()),
            GrainArray::Height => real(|r| r.position[2]),
            GrainArray::TimeSinceContact => real(|r| r.time_since_contact),
            GrainArray::Velocity => vector(|r| r.velocity),
            GrainArray::AngularVelocity => vector(|r| r.angular_velocity),
            GrainArray::ContactForce => vector(|r| r.contact_force),
            GrainArray::ContactTorque => vector(|r| r.contact_torque),
            // Glyphs of VTK take w, x, y, z.
            GrainArray::Orientation => {
                Some(Array::reals(name, 4, self.records.iter().flat_map(|r| w_first(self.turn(r).to_array()))))
            }
            GrainArray::Drag
            | GrainArray::PressureForce
            | GrainArray::Lift
            | GrainArray::AddedMassForce
            | GrainArray::VoidFraction
            | GrainArray::Wetness => None,
        }
    }
}

/// A quaternion as glyphs take it, from x, y, z, w.
fn w_first([x, y, z, w]: [Real; 4]) -> [Real; 4] {
    [w, x, y, z]
}

/// Array by which ParaView colours at first.
fn coloured(arrays: &[DataArray]) -> Option<&'static str> {
    ["speed", "velocity"].into_iter().find(|name| arrays.iter().any(|array| array.name() == *name))
}

/// Writes the surface of a population at size factor 1 as it was given, about its centre of mass: the source of its glyphs.
pub(super) fn write_glyph(shape: &Shape, path: &Path) -> Result<(), RecordError> {
    let pose = BodyPose { surface: 0, scale: 1.0, position: Vector::ZERO, orientation: shape.drawn() };
    let bodies = Bodies { surfaces: &[surface(shape)], poses: &[pose] };
    Ok(write_bodies(path, &BodyFile { bodies, time: None, arrays: &[], scalars: None, frame: None })?)
}

fn surface(shape: &Shape) -> BodySurface<'_> {
    BodySurface { nodes: &shape.surface().nodes, triangles: &shape.surface().triangles }
}
