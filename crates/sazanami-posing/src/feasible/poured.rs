//! Whether particles can hold the liquids of a case.

use sazanami_numerics::Real;

use super::Search;
use crate::amounts;
use crate::assembly::particles::OFF;
use crate::case::meaning::{FluidName, Solver};
use crate::case::units::rounded;
use crate::check::{taken, volume_within};

/// Particles that hold any shape well.
const WELL: Real = 64.0;

impl Search<'_> {
    /// Refuses liquids that are less than a particle of water, and warns of those that a few particles hold.
    pub(super) fn poured(&mut self) {
        let Some(particles) = self.case.particles.as_ref().filter(|_| self.case.solver == Solver::Mps) else { return };
        let size = particles.spacing.powi(3);
        for (n, (liquid, taken)) in self.case.liquids.iter().zip(taken(self.case)).enumerate() {
            let Some(volume) = volume_within(self.case, liquid).filter(|_| liquid.fluid == FluidName::Liquid) else {
                continue;
            };
            let volume = volume * (1.0 - taken);
            let (wanted, count) = (volume / size, (volume / size).round());
            if volume <= 0.0 || (count - wanted).abs() <= OFF * wanted {
                continue;
            }
            let span = self.loaded.places.near(&format!("liquid.{n}.region"));
            let label = format!("{}, a particle {}", amounts::volume(volume), amounts::volume(size));
            let help =
                format!("`particles.spacing = \"{} mm\"` or less holds it", rounded(1e3 * (volume / WELL).cbrt()));
            if count == 0.0 {
                let title = format!("`{}` is less than half a particle of water: nothing would be poured", liquid.name);
                self.report.error_at(span, title).label(label).help(help);
            } else {
                let (more, off) = (if count > wanted { "more" } else { "less" }, 1e2 * (count / wanted - 1.0).abs());
                let title = format!("`{}` is poured with {off:.0} % {more} volume than asked for", liquid.name);
                self.report.warning(span, title).label(format!("{count} particles; {label}")).help(help);
            }
        }
    }
}
