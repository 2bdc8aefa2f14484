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

/// An array that only one of the solvers has, with its values in the order of identifiers.
pub(crate) type OwnArray<'a> = (GrainArray, DataArray<'a>);

/// The grains of all ranks on rank 0, in the order of their identifiers; none on other ranks.
pub(crate) struct GrainStates {
    records: Vec<Record>,
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
        Self { records: domain.to_first_by((0..grains.owned()).map(record), |record| record.id) }
    }

    /// Whether there are no grains.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Writes a point for each grain, with the arrays that the case asks for.
    pub fn write_points(&self, case: &Case, own: &[OwnArray], clock: &Clock, path: &Path) -> Result<(), RecordError> {
        let arrays = self.arrays(case, own, true);
        let places: Vec<Vector> = self.records.iter().map(|record| record.position.into()).collect();
        let (time, frame) = (Some(clock.time()), Some(case.output.frame.word()));
        let file = PointFile { places: &places, time, arrays: &arrays, scalars: coloured(&arrays), frame };
        Ok(write_points(path, &file)?)
    }

    /// Writes the surface of each grain; each corner has the values of its grain.
    pub fn write_meshes(
        &self,
        case: &Case,
        own: &[OwnArray],
        shapes: &[Shape],
        clock: &Clock,
        path: &Path,
    ) -> Result<(), RecordError> {
        let arrays = self.arrays(case, own, false);
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
        let real =
            |array: GrainArray, of: fn(&Record) -> Real| Array::reals(array.word(), 1, self.records.iter().map(of));
        let vector = |array: GrainArray, of: fn(&Record) -> [Real; 3]| {
            Array::reals(array.word(), 3, self.records.iter().flat_map(of))
        };
        let whole = |array: GrainArray, of: fn(&Record) -> u32| Array::whole(array.word(), self.records.iter().map(of));
        vec![
            Array::long(GrainArray::Id.word(), self.records.iter().map(|r| r.id)),
            Array::reals("position", 3, self.records.iter().flat_map(|r| r.position)),
            Array::reals(GrainArray::Orientation.word(), 4, self.records.iter().flat_map(|r| w_first(r.orientation))),
            vector(GrainArray::Velocity, |r| r.velocity),
            vector(GrainArray::AngularVelocity, |r| r.angular_velocity),
            vector(GrainArray::ContactForce, |r| r.contact_force),
            vector(GrainArray::ContactTorque, |r| r.contact_torque),
            whole(GrainArray::Population, |r| r.population),
            whole(GrainArray::Material, |r| r.material),
            whole(GrainArray::TouchedGrains, |r| r.touched_grains as u32),
            real(GrainArray::Diameter, |r| r.diameter),
            real(GrainArray::Scale, |r| r.scale),
            real(GrainArray::Mass, |r| r.mass),
            real(GrainArray::TimeSinceContact, |r| r.time_since_contact),
        ]
    }

    /// The arrays that the case asks for. What turns and scales glyphs is for points alone.
    fn arrays<'a>(&'a self, case: &Case, own: &[OwnArray<'a>], points: bool) -> Vec<DataArray<'a>> {
        let mut arrays: Vec<DataArray> = Vec::new();
        for &array in &case.output.grain_arrays.0 {
            let is_own = own.iter().find(|(name, _)| *name == array);
            match is_own {
                Some((_, values)) => arrays.push(values.clone()),
                None if array == GrainArray::Orientation && !points => {}
                None => arrays.extend(self.array(array)),
            }
        }
        arrays
    }

    /// An array that both solvers have.
    fn array(&self, array: GrainArray) -> Option<DataArray<'static>> {
        let name = array.word();
        let whole = |of: fn(&Record) -> u32| Some(DataArray::whole(name, self.records.iter().map(of)));
        let real = |of: fn(&Record) -> Real| Some(DataArray::rounded(name, 1, self.records.iter().map(of)));
        let vector = |of: fn(&Record) -> [Real; 3]| Some(DataArray::rounded(name, 3, self.records.iter().flat_map(of)));
        match array {
            GrainArray::Id => Some(DataArray::long(name, self.records.iter().map(|record| record.id))),
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
                Some(DataArray::rounded(name, 4, self.records.iter().flat_map(|r| w_first(r.orientation))))
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

/// Writes the surface of a population at size factor 1 in its body frame: the source of its glyphs.
pub(super) fn write_glyph(shape: &Shape, path: &Path) -> Result<(), RecordError> {
    let pose = BodyPose { surface: 0, scale: 1.0, position: Vector::ZERO, orientation: Quaternion::IDENTITY };
    let bodies = Bodies { surfaces: &[surface(shape)], poses: &[pose] };
    Ok(write_bodies(path, &BodyFile { bodies, time: None, arrays: &[], scalars: None, frame: None })?)
}

fn surface(shape: &Shape) -> BodySurface<'_> {
    BodySurface { nodes: &shape.surface().nodes, triangles: &shape.surface().triangles }
}
