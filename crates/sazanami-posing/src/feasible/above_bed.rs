//! Liquids and the grains below them: where a liquid is put above a bed that is known, and what it touches.

use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_observe::{BedView, Body, bed_profile};

use super::Search;
use super::placed::{Origin, Placed};
use crate::assembly::fluid;
use crate::case::amounts::{at_least, length};
use crate::case::meaning::{FluidName, LiquidRegion, Placement};

impl Search<'_> {
    /// Liquids must lie within the box, and must not touch grains unless that is allowed.
    ///
    /// Those above a bed that is packed in the run are left to the run.
    pub(super) fn liquids(&mut self, lying: &[Placed]) {
        let above = |liquid: &LiquidRegion| matches!(liquid.placement, Placement::AboveBed { .. });
        let case = self.case;
        let height = (!case.packs() && case.liquids.iter().any(above)).then(|| self.bed_height(lying));
        for (number, liquid) in case.liquids.iter().enumerate() {
            let origin = match (&liquid.placement, height) {
                (Placement::Absolute(position), _) => *position,
                (Placement::AboveBed { .. }, Some(height)) => fluid::origin_of(liquid, case.bed.axis, height),
                (Placement::AboveBed { .. }, None) => {
                    self.below_top(
                        number,
                        liquid,
                        fluid::origin_of(liquid, case.bed.axis, case.domain.lower.z),
                        None,
                        lying,
                    );
                    continue;
                }
            };
            if let (true, Some(height)) = (above(liquid), height) {
                self.below_top(number, liquid, origin, Some(height), lying);
            }
            // A bubble may surround grains.
            let bubble = liquid.fluid == FluidName::Gas;
            if !liquid.allow_touching_grains && !bubble {
                self.clear_of_grains(number, liquid, origin, lying);
            }
        }
    }

    /// Height of the highest node near the axis, H_s \[m]; the floor without grains there.
    pub(super) fn bed_height(&self, lying: &[Placed]) -> Real {
        let bodies: Vec<Body> = self.shapes.iter().map(Body::of).collect();
        let all = lying.iter();
        let body: Vec<u32> = all.clone().map(|grain| grain.population as u32).collect();
        let scale: Vec<Real> = all.clone().map(|grain| grain.factor).collect();
        let position: Vec<Vector> = all.clone().map(|grain| grain.position).collect();
        let orientation: Vec<Quaternion> = all.map(|grain| grain.orientation).collect();
        let view = BedView {
            bodies: &bodies,
            id: &(0..lying.len() as u64).collect::<Vec<u64>>(),
            held: &vec![false; lying.len()],
            body: &body,
            scale: &scale,
            mass: &vec![0.0; lying.len()],
            position: &position,
            orientation: &orientation,
            velocity: &vec![Vector::ZERO; lying.len()],
            last_contact: None,
            time: 0.0,
        };
        let bed = &self.case.bed;
        bed_profile::height_near(&view, &self.case.ground(), bed.axis, bed.height_radius)
            .unwrap_or(self.case.domain.lower.z)
    }

    /// A liquid above the `bed` of this height, or whatever bed is packed below it, must not reach out of the box.
    fn below_top(&mut self, number: usize, liquid: &LiquidRegion, origin: Vector, bed: Option<Real>, lying: &[Placed]) {
        let (floor, top) = (self.case.domain.lower.z, self.case.domain.upper.z);
        let height = origin.z + liquid.region.heights()[1];
        if !height.is_finite() || height <= top {
            return;
        }
        let place = |key: &str| self.loaded.places.of(&format!("liquid.{number}.{key}"));
        let span = place("above_bed").or_else(|| place("gap_above_bed")).unwrap_or(0..0);
        let title = format!("`{}` does not fit above the bed", liquid.name);
        let of_bed = bed.map_or("without any bed".to_owned(), |bed| format!("the bed H_s = {}", length(bed - floor)));
        let label =
            format!("it reaches {} above the floor, the box {}, {of_bed}", length(height - floor), length(top - floor));
        let least = at_least(height - top);
        let help = if bed.is_some() {
            format!("lower it by {least}, or make the box higher")
        } else {
            format!("lower it by {least} and the height of the bed, or make the box higher")
        };
        // A bed that relaxes first may sink.
        if lying.iter().any(|grain| grain.origin == (Origin::Bed { relaxes: true })) {
            self.report.warning(Some(span), title).label(label).help(help);
        } else {
            self.report.error(span, title).label(label).help(help);
        }
    }

    /// A liquid must not touch grains unless that is allowed.
    fn clear_of_grains(&mut self, number: usize, liquid: &LiquidRegion, origin: Vector, lying: &[Placed]) {
        let region = self.case.region_of(liquid, origin).geometry();
        // Where a bed relaxes first, the run tells.
        let stays = |grain: &&Placed| grain.origin != (Origin::Bed { relaxes: true });
        let Some(grain) = lying.iter().filter(stays).find(|grain| self.touches(&region, grain)) else { return };
        let (name, _) = self.name(grain);
        let span = self.loaded.places.at(&format!("liquid.{number}.region"));
        self.report
            .error(span, format!("`{}` touches grains", liquid.name))
            .label(format!("it reaches {name}"))
            .help("move it away, or write `allow_touching_grains = true` for a liquid that wets them");
    }
}
