//! Whether particles can hold the liquids of a case.

use sazanami_numerics::{Real, Vector};

use super::{ROUNDED, Search};
use crate::assembly::fluid::origin_of;
use crate::assembly::particles::OFF;
use crate::case::amounts::{self, length};
use crate::case::meaning::{FluidName, LiquidRegion, Placement, Solver};
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

    /// Warns of bodies of liquid or gas narrower than a cell of the grid, within the box.
    pub(super) fn narrow(&mut self) {
        let domain = self.case.domain;
        if self.case.solver != Solver::Mics {
            return;
        }
        for (n, liquid) in self.case.liquids.iter().enumerate() {
            let origin = origin_of(liquid, self.case.bed.axis, domain.lower.z);
            let (low, high) = liquid.region.moved(origin).geometry().bounds();
            let width = |d: usize| {
                let is_cut = matches!(liquid.placement, Placement::Absolute(_)) && !self.case.periodic()[d];
                if is_cut { high[d].min(domain.upper[d]) - low[d].max(domain.lower[d]) } else { high[d] - low[d] }
            };
            let cells = |d: usize| width(d) / domain.spacing()[d];
            let across = (0..3).filter(|&d| domain.cells[d] > 1).min_by(|&a, &b| cells(a).total_cmp(&cells(b)));
            let Some(d) = across.filter(|&d| cells(d) > 0.0 && cells(d) < 1.0 - ROUNDED) else { continue };
            self.report
                .warning(
                    self.loaded.places.near(&format!("liquid.{n}.region")),
                    format!("`{}` is narrower than a cell: the grid has its volume, not its shape", liquid.name),
                )
                .label(format!("{} along x{}, a cell {}", length(width(d)), d + 1, length(domain.spacing()[d])))
                .help("check the unit; else take smaller cells, or leave it out");
        }
    }

    /// Warns of films thinner than a particle along gravity, whose surface no particle tells.
    pub(super) fn thin(&mut self) {
        let Some(particles) = self.case.particles.as_ref().filter(|_| self.case.solver == Solver::Mps) else { return };
        let pull = self.case.resting_gravity().abs();
        let Some(along) = (0..3).find(|&d| pull[d] > 0.0 && pull[d] == pull.max_element()) else { return };
        let (floor, top) = (self.case.domain.lower[along], self.case.domain.upper[along]);
        let bounds = |liquid: &LiquidRegion| {
            self.case.region_of(liquid, origin_of(liquid, self.case.bed.axis, floor)).geometry().bounds()
        };
        // Layers on one another are one liquid.
        let meets = |n: usize, (low, high): (Vector, Vector)| {
            self.case.liquids.iter().enumerate().any(|(other, liquid)| {
                let reach = ROUNDED * particles.spacing;
                let (lower, upper) = bounds(liquid);
                other != n
                    && liquid.fluid == FluidName::Liquid
                    && matches!(liquid.placement, Placement::Absolute(_))
                    && (0..3).all(|d| lower[d] <= high[d] + reach && low[d] <= upper[d] + reach)
            })
        };
        for (n, liquid) in self.case.liquids.iter().enumerate().filter(|(_, of)| of.fluid == FluidName::Liquid) {
            let (low, high) = bounds(liquid);
            let is_absolute = matches!(liquid.placement, Placement::Absolute(_));
            let thickness =
                if is_absolute { high[along].min(top) - low[along].max(floor) } else { high[along] - low[along] };
            if is_absolute && meets(n, (low, high)) {
                continue;
            }
            // What is as narrow has few particles, which is told.
            let is_wide = (0..3).filter(|&d| d != along).all(|d| high[d] - low[d] > particles.spacing);
            if thickness <= 0.0 || thickness > particles.spacing * (1.0 - ROUNDED) || !is_wide {
                continue;
            }
            self.report
                .warning(
                    self.loaded.places.near(&format!("liquid.{n}.region")),
                    format!("`{}` is thinner than a particle: its level is not that of the run", liquid.name),
                )
                .label(format!("{} along gravity, a particle {}", length(thickness), length(particles.spacing)))
                .help(format!(
                    "`particles.spacing = \"{} mm\"` or less has two layers in it",
                    rounded(500.0 * thickness)
                ));
        }
    }
}
