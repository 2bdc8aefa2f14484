//! The tables of a case file, one file each: keys with their units, ranges, defaults and meanings, what has to fit
//! together in them, and what the rest of the program asks of them.

mod boundary;
mod contact;
mod contact_spheres;
mod coupling;
mod dem;
mod domain;
mod fluid;
mod frame;
mod grain_shape;
mod grains;
mod liquid;
mod motion;
mod observed;
mod output;
mod overlap;
mod particles;
mod placement;
mod preparation;
mod probe;
mod region;
mod ripples;
mod run;
mod schedule;
mod size;
mod velocity_field;

pub use boundary::{BoundarySide, FluidName, SIDE_NAMES, Sides};
pub use contact::{Contacts, DampingKind, Material, Materials, PairContact, WALL};
pub use contact_spheres::{ContactSphereChoice, MOST_ON_SHELL};
pub use coupling::Coupling;
pub use dem::{DemOptions, Rolling, WallContact};
pub use domain::BoxDomain;
pub use fluid::{Fluid, FluidOptions, Projection, Step};
pub use frame::{Frame, Oscillation};
pub use grain_shape::GrainShape;
pub use grains::Population;
pub use liquid::{LiquidRegion, Placement};
pub use motion::{Axis, Motion as TankMotion, WallMotion};
pub use observed::{Bed, Erosion};
pub use output::{FieldPrecision, GrainArray, GrainArrays, GrainForm, OutputFrame, Outputs};
pub use overlap::{Overlap, PressureForce};
pub use particles::{Particles, StabilisationWeight};
pub use placement::{BedFile, Grain, GrainPlacement, LatticePlacement, Packing, PackingStop};
pub use preparation::Preparation;
pub use probe::{Probe, ProbePlace};
pub use region::Region;
pub use ripples::{COLOUR_FORCE, LayerReference, Measured, Ripples};
pub use run::{Checkpoints, RunLength};
pub use schedule::Schedule;
pub use size::{Share, SizeDistribution};
pub use velocity_field::{CarryingFlow, InitialVelocity};

pub(crate) use boundary::place_of_side;
pub(crate) use grains::check_names;
pub(crate) use overlap::SMOOTHING;

/// What a table means, where that is not what its keys say one by one: `$meaning` is read and written by way of
/// `$keys`, which it is made of and turned into.
macro_rules! read_by {
    ($meaning:ty, $keys:ty) => {
        impl crate::key::Keys for $meaning {
            fn docs() -> crate::key::TableDoc {
                <$keys as crate::key::Keys>::docs()
            }

            fn read(at: &crate::read::At<'_>, cx: &mut crate::read::Context<'_>) -> Option<Self> {
                <$keys as crate::key::Keys>::read(at, cx)?.meaning(cx)
            }

            fn write(&self, style: crate::write::Paths) -> crate::write::Written {
                crate::key::Keys::write(&<$keys>::of(self), style)
            }
        }
    };
}
use read_by;

/// A place in millimetres, for messages.
pub(crate) fn millimetres(x: sazanami_numerics::Vector) -> String {
    let short = |value: sazanami_numerics::Real| {
        let text = format!("{:.4}", value * 1e3);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    format!("({}, {}, {}) mm", short(x.x), short(x.y), short(x.z))
}
