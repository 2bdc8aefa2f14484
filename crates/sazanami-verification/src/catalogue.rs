//! The verification cases.

use crate::cases::{
    at_rest, beds, both, contact, free_grains, immersed, impact, moving_particles, reduced, ripples, settling,
    single_phase, transport, two_phase, volume_fractions,
};
use crate::measured::Measured;
use crate::verify::VerifyCase;

const fn case(name: &'static str, about: &'static str, measure: fn() -> Result<Vec<Measured>, String>) -> VerifyCase {
    VerifyCase { name, about, long: false, measure }
}

const fn long(name: &'static str, about: &'static str, measure: fn() -> Result<Vec<Measured>, String>) -> VerifyCase {
    VerifyCase { name, about, long: true, measure }
}

/// All cases, in the order of what builds on what.
pub const CASES: &[VerifyCase] = &[
    case("layers-at-rest", "air, water and air at rest in a closed box", single_phase::layers),
    case("block-on-floor", "a block carries its weight less its buoyancy", at_rest::block_on_floor),
    case("taylor-green", "decaying vortices: order in space and time", single_phase::taylor_green_vortices),
    case("channels", "plane Poiseuille flow, one fluid and two layers", single_phase::channels),
    case("lid-driven-cavity", "Re 100 and 1000 beside the tables of Ghia et al.", single_phase::lid_driven_cavity),
    case("projection", "random velocity, density jumps of 1000 cell by cell", single_phase::projection),
    case("slip-box-vortex", "the pressure on walls and the cells before them", single_phase::vortex_between_walls),
    case("carried-sphere", "a sphere carried along the diagonal", transport::carried_sphere),
    case("reversed-vortex", "a circle drawn to a thread and back", transport::vortex),
    case("deformation", "a sphere deformed and back in three dimensions", transport::deformed_sphere),
    case("falling-drop", "a drop in free flight keeps its momentum", two_phase::falling_drop),
    case("dam-break", "front and column of Martin and Moyce", two_phase::dam_break),
    case("restitution", "rebound of a ball", contact::restitution_of_a_ball),
    case("bouncing", "apexes of a bouncing ball", contact::bouncing),
    case("oblique-impact", "rebound angle and spin of Kharaz et al.", contact::oblique),
    case("slip-to-roll", "a sliding ball comes to roll", contact::slip_to_roll),
    case("incline", "rolling, sliding and sticking", contact::incline),
    case("free-rotation", "the spinning grain", free_grains::free_rotation),
    case("swarm", "momentum and energy of colliding grains", free_grains::swarm_budget),
    case("neighbour-lists", "forces from lists beside all pairs", free_grains::neighbour_lists),
    case("volume-fractions", "what part of a cell a shape covers", volume_fractions::evaluators),
    case("drop-on-bed", "where the momentum of a drop goes", impact::drop_on_bed),
    case("added-mass", "a sphere released in an inviscid liquid", immersed::added_mass),
    case("drag", "a fixed sphere, 8 cells to a diameter", immersed::drag_coarse),
    case("settling", "ten Cate et al., Re 4.1 and 31.9", settling::settling),
    case("friction-and-porosity", "rough grains pack loosely and lie down", beds::friction_and_porosity),
    case("crater-evaluation", "worked examples, a cap, a flat bed", beds::crater_evaluation),
    case("mps-operators", "sums over particles on and off a lattice", moving_particles::operators),
    long("mps-hydrostatics", "water of moving particles at rest", moving_particles::hydrostatics),
    case("mps-falling-block", "a block of moving particles in free fall", moving_particles::falling_block),
    case("mps-void-fraction", "void fractions of a lattice of grains", moving_particles::void_fraction),
    case("mps-settling-grain", "a grain falls as its drag law says", moving_particles::settling_grain),
    case("mps-packed-bed", "flow through a bed beside Ergun", moving_particles::packed_bed),
    long("mps-resting-bed", "a bed under water at rest", moving_particles::resting_bed),
    long("mps-repose", "a bed under water tilted until it slides", moving_particles::repose),
    case("mps-standing-wave", "periods of standing waves", moving_particles::standing_wave),
    long("mps-standing-wave-shallow", "the same in shallow water", moving_particles::standing_wave_shallow),
    long("mps-sloshing", "waves in a shaken tank", moving_particles::sloshing),
    long("mps-sloshing-resonance", "the length of a tank that answers most", moving_particles::sloshing_resonance),
    case("mps-viscous-walls", "Poiseuille flow, Stokes's second problem", moving_particles::viscous_walls),
    case("mps-dam-break", "both columns of Martin and Moyce", moving_particles::dam_break),
    long("mps-dam-break-lobovsky", "front and impact of Lobovsky et al.", moving_particles::dam_break_lobovsky),
    case("mps-taylor-green", "decaying vortices of moving particles", moving_particles::taylor_green),
    case("mps-rotating-square", "a square of water that turns in the air", moving_particles::rotating_square),
    long("mps-frames", "a shaken tank in two frames", moving_particles::frames),
    long("mps-frames-bed", "the same with a bed", moving_particles::frames_with_bed),
    case("both-dam-break", "one dam, a grid and moving particles", both::dam_break),
    long("both-settling-sphere", "one sphere, resolved and by a drag law", both::settling_sphere),
    long("ripples", "ripples on the bed of a shaken tank", ripples::ripples),
    long("drag-fine", "a fixed sphere, 16 cells to a diameter", immersed::drag_fine),
    long("settling-rest", "ten Cate et al., Re 1.5 and 11.6", settling::settling_rest),
    long("reduced-raindrop", "a quarter of the bed hit at 2.25 and 9 m/s", reduced::reduced_raindrop),
    long("paper-bed", "30,900 grains packed as in the paper", beds::paper_bed),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_has_a_name_of_its_own_and_a_description() {
        let mut names: Vec<&str> = CASES.iter().map(|case| case.name).collect();
        for name in &names {
            let page = format!("{}/../../verification/{name}/README.md", env!("CARGO_MANIFEST_DIR"));
            assert!(std::path::Path::new(&page).is_file(), "{page} is missing");
        }
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
    }

    /// The cheap ones; all others take longer than a test should.
    #[test]
    fn cheap_cases_meet_their_bands_with_names_of_their_own() {
        for name in ["block-on-floor", "restitution", "bouncing", "free-rotation", "crater-evaluation"] {
            let case = CASES.iter().find(|case| case.name == name).unwrap();
            let mut names = std::collections::BTreeSet::new();
            for row in (case.measure)().unwrap() {
                assert!(names.insert(row.quantity.clone()), "{name}: {} twice", row.quantity);
                let inside = row.band.is_none_or(|[low, high]| row.value >= low && row.value <= high);
                assert!(inside, "{name}: {} is {}", row.quantity, row.value);
            }
        }
    }
}
