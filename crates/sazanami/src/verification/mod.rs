//! The verification cases.

mod at_rest;
mod impact;
mod settling;
mod tank;

use crate::verify::VerifyCase;

/// All cases.
pub const CASES: &[VerifyCase] = &[
    VerifyCase { name: "block-on-floor", about: "buoyancy", long: false, measure: at_rest::block_on_floor },
    VerifyCase { name: "drop-on-bed", about: "x", long: false, measure: impact::drop_on_bed },
    VerifyCase { name: "settling", about: "x", long: false, measure: settling::settling },
    VerifyCase { name: "settling-rest", about: "x", long: true, measure: settling::settling_rest },
    VerifyCase { name: "trace", about: "x", long: true, measure: || { settling::trace(6, sazanami_mics::grains::Exchange::Exact)?; settling::trace(6, sazanami_mics::grains::Exchange::Stress)?; Ok(vec![]) } },
];
