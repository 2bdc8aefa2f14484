//! Warnings about tanks of moving particles that need more than the case file to be found.

use std::f64::consts::TAU;

use sazanami_numerics::Real;

use sazanami_mps::scheme::Turbulence;

use super::bed_flow::bed_flow;
use super::limits::swing_of_water;
use super::number;
use super::volumes::levelled;
use super::waves::tank;
use crate::case::meaning::{Case, LiquidRegion, ProbePlace, Solver, TankMotion};
use crate::case::units::rounded;
use crate::case::{Diagnostics, LoadedCase};

/// Amplification of waves from which on a tank is near resonance.
const RESONANT: Real = 4.0;

/// Warns of peaks of a recorded motion, of waves that linear theory or the particles cannot follow, and of probes on grains that may be taken away.
pub(crate) fn warn_of_tank(loaded: &LoadedCase, report: &mut Diagnostics) {
    warn_of_peaks(loaded, report);
    warn_of_levelled_probes(loaded, report);
    if loaded.case.solver == Solver::Mps {
        warn_of_waves(loaded, report);
        warn_of_turbulence(loaded, report);
    }
}

/// Reynolds numbers of a channel by its mean velocity and depth up to which it is laminar, and from which on it is turbulent
/// (Schlichting and Gersten 2017, sec. 15.2, for open channels).
const CHANNEL: [Real; 2] = [500.0, 2000.0];

/// The same of an oscillating flow by its largest speed and `sqrt(2 nu/omega)`, over smooth walls (Jensen, Sumer and Fredsoe 1989,
/// J. Fluid Mech. 206, 265); over grains it becomes turbulent between the two.
const SWING: [Real; 2] = [100.0, 550.0];

/// Flow over a bed that is turbulent without a mixing length, or laminar with one.
fn warn_of_turbulence(loaded: &LoadedCase, report: &mut Diagnostics) {
    let case: &Case = &loaded.case;
    let Some(particles) = &case.particles else { return };
    let viscosity = case.fluid.liquid.viscosity / case.fluid.liquid.density;
    if viscosity <= 0.0 || (case.grains.is_empty() && particles.turbulence == Turbulence::None) {
        return;
    }
    let channel = case.mean_flow().map(|flow| {
        let depth =
            case.liquids.iter().filter_map(LiquidRegion::top).fold(flow.above, Real::max).min(case.domain.upper.z)
                - flow.above;
        (flow.velocity.length() * depth / viscosity, CHANNEL, "its mean velocity and depth")
    });
    let swing = bed_flow(case).zip(swing_of_water(case)).map(|(bed, (_, frequency))| {
        let layer = (2.0 * viscosity / (TAU * frequency)).sqrt();
        (bed.orbital_speed * layer / viscosity, SWING, "the largest speed and sqrt(2 nu/omega)")
    });
    let Some((reynolds, [laminar, turbulent], by)) = channel.or(swing).filter(|(reynolds, ..)| *reynolds > 0.0) else {
        return;
    };
    let span = loaded.places.near("particles.turbulence");
    let by = format!("its Reynolds number by {by} is {}", number(reynolds, 0));
    if particles.turbulence == Turbulence::MixingLength && reynolds < laminar {
        report
            .warning(span, "a mixing length in laminar flow")
            .label(format!("{by}, laminar up to about {laminar}"))
            .help("leave `turbulence` out: eddies would bear stress that this flow does not have");
    } else if particles.turbulence == Turbulence::None && reynolds > turbulent {
        report
            .warning(span, "turbulence over the bed is not resolved: the bed bears less stress than under such a flow")
            .label(format!("{by}, turbulent from about {turbulent} on"))
            .help("write `turbulence = \"mixing_length\"` under `[particles]`");
    }
}

/// Acceleration of a record over that of its strongest harmonic from which on it is said to have a peak.
const PEAKED: Real = 4.0;

/// Peaks of a recorded motion, which a reading that is off makes.
fn warn_of_peaks(loaded: &LoadedCase, report: &mut Diagnostics) {
    let motion = loaded.case.frame.as_ref().and_then(|frame| frame.motion.as_ref());
    let Some(motion @ TankMotion::File { peaks: [_, peak], .. }) = motion else { return };
    // Less than a cycle has nothing beside which it is a peak.
    let Some((amplitude, frequency)) = motion.harmonic() else { return };
    let regular = amplitude.length() * (TAU * frequency).powi(2);
    if peak.value > PEAKED * regular {
        report
            .warning(loaded.places.near("frame.motion.file"), "the recorded motion has a peak")
            .label(format!(
                "{} m/s^2 at {} s, {} m/s^2 in its strongest harmonic",
                number(peak.value, 2),
                rounded(peak.time),
                number(regular, 2)
            ))
            .help("look for readings that are off there, or smooth the record: water and grains feel its acceleration");
    }
}

/// Waves that a shaken tank makes, and that linear theory or the particles cannot follow.
fn warn_of_waves(loaded: &LoadedCase, report: &mut Diagnostics) {
    let case: &Case = &loaded.case;
    let (Some(tank), Some(span)) = (tank(case), loaded.places.near("frame.motion")) else { return };
    let mut warn = |title: &str, label: String| {
        report.warning(Some(span.clone()), title).label(label);
    };
    if tank.amplification > RESONANT {
        warn(
            "the tank is near resonance",
            format!(
                "1/cos(kL/2) = {}: expect breaking waves and bores; with this depth and frequency L = {} mm \
                 and {} mm have 1",
                number(tank.amplification, 1),
                number(1e3 * tank.wavelength_m, 0),
                number(2e3 * tank.wavelength_m, 0)
            ),
        );
    }
    if tank.end_elevation > 1.0 {
        warn(
            "the tank dries at its ends",
            format!("by linear theory the water falls there by {} times its depth", number(tank.end_elevation, 2)),
        );
    }
    let particles = case.particles.as_ref().filter(|_| !case.grains.is_empty());
    if let Some(particles) = particles.filter(|particles| tank.stokes_layer_m < particles.spacing) {
        warn(
            "the boundary layer on the bed is thinner than a particle",
            format!(
                "{:.2} mm, the particle spacing {:.2} mm: near the bed the drag law carries the shear",
                1e3 * tank.stokes_layer_m,
                1e3 * particles.spacing
            ),
        );
    }
}

/// A grain that is taken away when its bed is levelled has nothing to be watched.
fn warn_of_levelled_probes(loaded: &LoadedCase, report: &mut Diagnostics) {
    let case = &loaded.case;
    for (number, probe) in case.probes.iter().enumerate() {
        let ProbePlace::Body { population: name, index } = &probe.place else { continue };
        let Some(population) = case.grains.iter().find(|population| population.name == *name) else { continue };
        let Some(left) = levelled(case, population).filter(|left| index >= left) else { continue };
        let span = loaded.places.near(&format!("probe.{number}.body"));
        report
            .warning(span, format!("grain {index} of `{name}` may be taken away when the bed is levelled"))
            .label("its rows would then be empty")
            .help(format!("about {left} grains stay, as a rule those of the smallest numbers"));
    }
}
