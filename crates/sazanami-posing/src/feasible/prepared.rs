//! Liquids that the preparation of a tank would move from where the case puts them, and velocities that it takes away.

use sazanami_numerics::{Real, Vector};

use super::Search;
use super::placed::Placed;
use crate::assembly::fluid::origin_of;
use crate::assembly::wetted::hangs;
use crate::case::meaning::{FluidName, GrainPlacement, Placement, Population, Solver};
use crate::check::{ShapeFacts, bed_top};

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
            if preparation.relax_steps > 0 && case.sets_in_motion(liquid) && !(falls && is_put) {
                let span = self.loaded.places.near(&format!("liquid.{n}.velocity"));
                self.report
                    .warning(span, format!("`{}` does not begin with its velocity", liquid.name))
                    .label("the preparation brings the water to rest first")
                    .help(format!("{AS_PUT}, or hold a mean velocity with `drive.mean_velocity`"));
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
    fn top_of_packed(&self) -> Real {
        let floor = self.case.domain.lower.z;
        let top = |population: &Population| match &population.placement {
            GrainPlacement::Packed(how) => Some(floor + how.highest_level().unwrap_or_else(|| self.highest_bed())),
            _ => None,
        };
        self.case.grains.iter().filter_map(top).fold(floor, Real::max)
    }
}
