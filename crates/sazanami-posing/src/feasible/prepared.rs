//! Liquids that the preparation of a tank would move from where the case puts them, and velocities that it takes away.

use sazanami_dem::Motion;
use sazanami_numerics::{Real, Vector};

use super::Search;
use super::placed::{Origin, Placed};
use crate::assembly::fluid::origin_of;
use crate::assembly::wetted::hangs;
use crate::case::meaning::{FluidName, GrainPlacement, Placement, Population, Solver};
use crate::check::{ShapeFacts, bed_top};

/// Distance of grains that bear one another, over the sum of their radii.
const NEAR: Real = 1.1;
/// What lets a run begin with its liquids as they are put.
const AS_PUT: &str = "write `preparation = { relax_steps = 0, settle = \"0 s\" }`";

impl Search<'_> {
    /// Refuses liquids above the bed, and moving ones, that would fall while water and bed come to rest before the run. Warns of others in
    /// the air, which may be meant to come down, and of velocities that are lost.
    pub(super) fn prepared(&mut self, lying: &[Placed], facts: &[ShapeFacts]) {
        let case = self.case;
        if case.solver != Solver::Mps {
            return;
        }
        let preparation = &case.preparation;
        let is_prepared = preparation.is_needed() && preparation.state.is_none() && !case.run.packing_only;
        let above = |placement: &Placement| matches!(placement, Placement::AboveBed { .. });
        let bed = if case.packs() {
            bed_top(case, facts)
        } else if is_prepared && case.liquids.iter().any(|liquid| above(&liquid.placement)) {
            self.bed_height(lying)
        } else {
            case.domain.lower.z
        };
        for (n, liquid) in case.liquids.iter().enumerate().filter(|(_, liquid)| liquid.fluid == FluidName::Liquid) {
            let is_put = liquid.velocity != Vector::ZERO || above(&liquid.placement);
            let falls = is_prepared && self.is_in_the_air(n, bed, lying);
            if falls {
                let span = self.loaded.places.at(&format!("liquid.{n}"));
                let title = format!("`{}` would fall before the run begins", liquid.name);
                let label = "it lies in the air, and the preparation lets water come to rest under gravity";
                if is_put {
                    let help = format!("{AS_PUT}: the run then begins with the liquid as it is put");
                    self.report.error(span, title).label(label).help(help);
                } else {
                    let help = format!("leave it so if it is to come down and rest first; else {AS_PUT}");
                    self.report.warning(Some(span), title).label(label).help(help);
                }
            }
            if preparation.is_needed() && case.sets_in_motion(liquid) && !(falls && is_put) {
                let span = self.loaded.places.near(&format!("liquid.{n}.velocity"));
                self.report
                    .warning(span, format!("`{}` does not begin with its velocity", liquid.name))
                    .label(if preparation.relax_steps > 0 {
                        "the preparation brings the water to rest first"
                    } else {
                        "it moves on for the time of `preparation.settle` before the run begins"
                    })
                    .help(format!("{AS_PUT}, or hold a mean velocity with `drive.mean_velocity`"));
            }
        }
    }

    /// Refuses grains with a velocity that forces would take from them while a bed comes to rest before the run, and warns of single ones that
    /// nothing bears, which move meanwhile. Grains whose motion is prescribed wait.
    pub(super) fn moving_grains(&mut self, lying: &[Placed]) {
        let case = self.case;
        let settles = case.solver == Solver::Mps && case.preparation.settle > 0.0;
        if case.run.packing_only || !(settles || case.relaxes()) {
            return;
        }
        let mut ways = Vec::new();
        if settles {
            ways.push(AS_PUT);
        }
        if case.relaxes() {
            ways.push("leave out `placement.bed.relax`");
        }
        let way_out = ways.join(" and ");
        let of_bed = |grain: &&Placed| matches!(grain.origin, Origin::Bed { .. });
        let reach = |grain: &Placed| grain.factor * self.shapes[grain.population].bounding_radius();
        let tops = lying.iter().filter(of_bed).map(|grain| grain.position.z + reach(grain));
        let bed = tops.fold(self.top_of_packed(), Real::max);
        let falls = case.resting_gravity().z < 0.0;
        let mut found = Vec::new();
        for (n, population) in case.grains.iter().enumerate() {
            let is_free = |motion: Motion| motion == Motion::Free && population.release.is_none();
            let moving = match &population.placement {
                GrainPlacement::List(list) => list
                    .iter()
                    .position(|grain| {
                        is_free(grain.motion) && [grain.velocity, grain.angular_velocity] != [Vector::ZERO; 2]
                    })
                    .map(|index| format!("grains.{n}.placement.list.{index}")),
                GrainPlacement::Lattice(lattice) => (is_free(population.motion) && lattice.velocity != Vector::ZERO)
                    .then(|| format!("grains.{n}.placement.lattice.velocity")),
                _ => continue,
            };
            if let Some(path) = moving {
                found.push((true, path, format!("`{}` would not begin with its velocity", population.name)));
                continue;
            }
            let GrainPlacement::List(list) = &population.placement else { continue };
            let is_borne = |grain: &Placed| {
                lying.iter().any(|other| {
                    (other.population, other.index) != (grain.population, grain.index)
                        && other.position.distance(grain.position) < NEAR * (reach(grain) + reach(other))
                })
            };
            let hangs = |grain: &&Placed| {
                grain.population == n
                    && is_free(list[grain.index].motion)
                    && self.lowest(grain) > bed + reach(grain)
                    && !is_borne(grain)
            };
            let mut in_the_air = lying.iter().filter(hangs);
            let Some(first) = in_the_air.next().filter(|_| falls) else { continue };
            let (name, others) = (self.name(first).0, in_the_air.count());
            let which = if others > 0 { format!("{name} and {others} more move") } else { format!("{name} moves") };
            let path = format!("grains.{n}.placement.list.{}.position", first.index);
            found.push((false, path, format!("{which} before the run begins")));
        }
        for (refused, path, title) in found {
            let span = self.loaded.places.at(&path);
            if refused {
                self.report
                    .error(span, title)
                    .label("it moves, and loses it, while the bed comes to rest before the run")
                    .help(format!("{way_out}: the run then begins with all grains as they are put"));
            } else {
                self.report
                    .warning(Some(span), title)
                    .label("neither floor, bed nor grains bear it, and the bed comes to rest before the run")
                    .help(format!("leave it so if it is to come down first; else {way_out}"));
            }
        }
    }

    /// Whether nothing bears a liquid, of a case whose bed is `bed` \[m] high: neither floor, bed nor liquids that begin lower, nor grains
    /// whose places are known.
    fn is_in_the_air(&self, n: usize, bed: Real, lying: &[Placed]) -> bool {
        let case = self.case;
        if !hangs(case, n, bed, self.top_of_packed()) {
            return false;
        }
        let liquid = &case.liquids[n];
        let region = case.region_of(liquid, origin_of(liquid, case.bed.axis, bed)).geometry();
        let touches = |grain: &Placed| {
            let reach = grain.factor * self.shapes[grain.population].bounding_radius();
            region.touches_ball(grain.position, reach + case.moving_particles().spacing)
        };
        !lying.iter().any(touches)
    }

    /// Height up to which packed beds may reach \[m]; the floor where there are none.
    pub(super) fn top_of_packed(&self) -> Real {
        let floor = self.case.domain.lower.z;
        let top = |population: &Population| match &population.placement {
            GrainPlacement::Packed(how) => Some(floor + how.highest_level().unwrap_or_else(|| self.highest_bed())),
            _ => None,
        };
        self.case.grains.iter().filter_map(top).fold(floor, Real::max)
    }
}
