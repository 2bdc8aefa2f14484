//! The tables of a case file, one file each: keys with their units, ranges, defaults and meanings, what has to fit
//! together in them, and what the rest of the program asks of them.

mod boundary;
mod contact;
mod contact_angle;
mod contact_spheres;
mod coupling;
mod dem;
mod domain;
mod drive;
mod fluid;
mod frame;
mod gate;
mod grain_shape;
mod grains;
mod liquid;
mod liquid_file;
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

pub use boundary::*;
pub use contact::*;
pub use contact_angle::ContactAngles;
pub use contact_spheres::*;
pub use coupling::*;
pub use dem::*;
pub use domain::*;
pub use drive::Drive;
pub(crate) use drive::LONGEST_STEP;
pub use fluid::*;
pub use frame::*;
pub use gate::*;
pub use grain_shape::*;
pub use grains::*;
pub use liquid::*;
pub use liquid_file::*;
pub use motion::{Motion as TankMotion, Peak, WallMotion};
pub use observed::*;
pub use output::*;
pub use overlap::*;
pub use particles::*;
pub use placement::*;
pub use preparation::*;
pub use probe::*;
pub use region::*;
pub use ripples::*;
pub use run::*;
pub use schedule::*;
pub use size::*;
pub use velocity_field::*;

pub(crate) use boundary::place_of_side;
pub(crate) use grains::check_names;
pub(crate) use overlap::SMOOTHING;

/// Reading of a table by way of its keys, where its meaning is not what they say one by one: `$meaning` is made from
/// `$keys` and turned into them.
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
