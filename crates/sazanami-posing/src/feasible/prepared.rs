//! Liquids that the preparation of a tank would move from where the case puts them.

use sazanami_numerics::Real;
use sazanami_numerics::geometry::Region;

use super::Search;
use super::placed::Placed;
use crate::assembly::fluid::origin_of;
use crate::case::meaning::{FluidName, GrainPlacement, LiquidRegion, Placement, Population, Solver};
use crate::check::bed_top;

impl Search<'_> {
    /// Refuses liquids that would fall while water and bed come to rest before the run.
    pub(super) fn prepared(&mut self, lying: &[Placed]) {
        let case = self.case;
        let preparation = &case.preparation;
        let is_prepared = preparation.is_needed() && preparation.state.is_none() && !case.run.packing_only;
        if case.solver != Solver::Mps || !is_prepared {
            return;
        }
        for (n, liquid) in case.liquids.iter().enumerate().filter(|(_, liquid)| liquid.fluid == FluidName::Liquid) {
            if !self.is_in_the_air(n, lying) {
                continue;
            }
            self.report
                .error(
                    self.loaded.places.at(&format!("liquid.{n}")),
                    format!("`{}` would fall before the run begins", liquid.name),
                )
                .label("it lies in the air, and the preparation lets water come to rest under gravity")
                .help(
                    "write `preparation = { relax_steps = 0, settle = \"0 s\" }`: the run then begins with the liquid as it is put",
                );
        }
    }

    /// Whether nothing bears a liquid: it lies more than a particle above floor and bed, and as far from grains and liquids that begin lower.
    fn is_in_the_air(&self, n: usize, lying: &[Placed]) -> bool {
        let case = self.case;
        let near = case.moving_particles().spacing;
        if case.resting_gravity().z >= 0.0 || case.periodic()[2] {
            return false;
        }
        let place = |liquid: &LiquidRegion| -> Region {
            case.region_of(liquid, origin_of(liquid, case.bed.axis, bed_top(case))).geometry()
        };
        let region = place(&case.liquids[n]);
        let (low, high) = region.bounds();
        let above_bed = match &case.liquids[n].placement {
            Placement::AboveBed { height, to_bottom: true, .. } => *height,
            Placement::AboveBed { height, .. } => height + case.liquids[n].region.heights()[0],
            Placement::Absolute(_) if case.has_bed() => low.z - self.top_of_packed(),
            Placement::Absolute(_) => Real::INFINITY,
        };
        let meets = |other: &LiquidRegion| {
            let (from, to) = place(other).bounds();
            from.z < low.z && (low - near).cmple(to).all() && from.cmple(high + near).all()
        };
        let others = case.liquids.iter().enumerate().filter(|(m, other)| *m != n && other.fluid == FluidName::Liquid);
        let touches = |grain: &Placed| {
            let reach = grain.factor * self.shapes[grain.population].bounding_radius();
            region.touches_ball(grain.position, reach + near)
        };
        low.z > case.domain.lower.z + near
            && above_bed > near
            && !others.map(|(_, other)| other).any(meets)
            && !lying.iter().any(touches)
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
