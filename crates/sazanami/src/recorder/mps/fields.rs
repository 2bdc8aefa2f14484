//! Water for ParaView: a point per particle.

use sazanami_io::vtk::{DataArray, PointFile};
use sazanami_numerics::choice::Choice;
use sazanami_numerics::{Real, Vector};

use super::gathered::GatheredTank;
use crate::case::meaning::{FieldPrecision, GrainArray};
use crate::clock::Clock;
use crate::job::{Job, RecordError};
use crate::recorder::files::Files;
use crate::state::{Array, WaterState};

/// Writes the particles of a time.
pub(super) fn write(job: &Job, gathered: &GatheredTank, clock: &Clock, files: &mut Files) -> Result<(), RecordError> {
    let [shift, _] = job.case.to_written_frame(clock.time());
    let places: Vec<Vector> = gathered.water.position.iter().map(|&x| x + shift).collect();
    let values = values(job, gathered, clock);
    let arrays: Vec<DataArray> = values.iter().map(|array| array.in_file(files.precision)).collect();
    let double = files.precision == FieldPrecision::Double;
    let (time, frame) = (Some(clock.time()), Some(job.case.output.frame.word()));
    let file = PointFile { places: &places, double, time, arrays: &arrays, scalars: Some("pressure"), frame };
    files.fluid_points(clock, &file)
}

/// The particles of a time as arrays, by the names of their files.
pub(super) fn water_state(job: &Job, gathered: &GatheredTank, clock: &Clock) -> WaterState {
    let [shift, _] = job.case.to_written_frame(clock.time());
    let places = gathered.water.position.iter().flat_map(|&x| (x + shift).to_array());
    let mut arrays = vec![Array::reals("position", 3, places)];
    arrays.extend(values(job, gathered, clock));
    WaterState::Particles { arrays }
}

/// Values of the particles.
fn values(job: &Job, gathered: &GatheredTank, clock: &Clock) -> [Array; 4] {
    let water = &gathered.water;
    let [_, drift] = job.case.to_written_frame(clock.time());
    let body_force = job.case.effective_gravity([clock.time(); 2]);
    let volume = gathered.spacing.powi(3);
    [
        Array::reals("velocity", 3, water.velocity.iter().flat_map(|&v| (v + drift).to_array())),
        Array::reals("pressure", 1, (0..water.position.len()).map(|n| gathered.pressure(n, body_force))),
        Array::reals("void_fraction", 1, water.bulk_volume.iter().map(|bulk| volume / bulk)),
        Array::whole("surface", water.place.iter().copied()),
    ]
}

/// Values of the grains that the coupling gives.
pub(super) fn grain_state(gathered: &GatheredTank) -> Vec<Array> {
    let grains = &gathered.grains;
    let vector = |array: GrainArray, values: &[Vector]| {
        Array::reals(array.word(), 3, values.iter().flat_map(|value| value.to_array()))
    };
    let real = |array: GrainArray, values: &[Real]| Array::reals(array.word(), 1, values.iter().copied());
    vec![
        vector(GrainArray::Drag, &grains.drag),
        vector(GrainArray::PressureForce, &grains.pressure_force),
        vector(GrainArray::Lift, &grains.lift),
        vector(GrainArray::AddedMassForce, &grains.added_mass_force),
        real(GrainArray::VoidFraction, &grains.void_fraction),
        real(GrainArray::Wetness, &grains.wetness),
    ]
}
