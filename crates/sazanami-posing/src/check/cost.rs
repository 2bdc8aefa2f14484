//! Predicted wall-clock time of a run.

use sazanami_numerics::Real;

use super::substeps::contact_step;
use super::{CostModel, ParticlesReport, PopulationReport, Size};
use crate::assembly::grains::{self, Fall, Kind, smallest_sphere};
use crate::case::meaning::{Case, PackingStop};

/// Work of a run: steps of each kind and their length.
pub(super) struct Work {
    /// Fluid steps.
    pub steps: Real,
    /// Longest step that the limits allow \[s].
    pub dt: Real,
    /// Fluid passes in a step.
    pub passes: usize,
    /// Sub-steps of the grains in a step.
    pub substeps: usize,
    /// Sub-steps of packing.
    pub packing: Real,
    /// Wall-clock time of the pictures \[s].
    pub pictures: Real,
    /// Files that are written while the run waits.
    pub files: Real,
    /// Whether the tank was prepared before.
    pub made_ready: bool,
}

/// Files of which fewer take no time to speak of.
const MANY_FILES: Real = 100.0;

/// Wall-clock time by part \[s].
pub(super) fn predict(
    case: &Case,
    populations: &[PopulationReport],
    size: &Size,
    work: &Work,
    particles: Option<&ParticlesReport>,
    threads: usize,
    model: &CostModel,
) -> Vec<(&'static str, Real)> {
    let speed = model.speed(threads);
    let of_grains = size.grains as Real * model.substep_grain + size.spheres as Real * model.substep_sphere;
    let substep = (of_grains + size.face_spheres * model.substep_face) / speed;
    let mut parts = if work.pictures > 0.0 { vec![("pictures", work.pictures)] } else { Vec::new() };
    if case.packs() && !work.made_ready {
        // Those too that are taken away when the bed is levelled.
        let packed: usize = populations.iter().filter_map(|population| population.grains).sum();
        let of_all = packed as Real / size.grains.max(1) as Real;
        parts.push(("packing", substep * of_all * work.packing));
    }
    if case.run.packing_only {
        return parts;
    }
    if work.files > MANY_FILES {
        parts.push(("files", work.files * model.file));
    }
    if let Some(particles) = particles.filter(|_| case.particles.is_some()) {
        let before = super::particles::preparation_steps(&case.preparation, work.dt);
        let before = if work.made_ready { 0.0 } else { before };
        let steps = work.steps + before;
        parts.push(("fluid", super::particles::predict(particles, steps, threads, model)));
        if size.grains > 0 {
            parts.push(("grains", steps * work.substeps as Real * substep));
        }
        return parts;
    }
    let has_jumps = case.fluid.surface_tension.is_some() || case.fluid.entry_pressure.is_some();
    let cell = model.fluid + if has_jumps { model.tension } else { 0.0 };
    let beside = size.grains as Real * model.fluid_grain + size.filled_cells * model.fluid_filled;
    let pass = model.pass + (size.cells as Real * cell + beside) / speed;
    parts.push(("fluid", work.steps * work.passes as Real * pass));
    if size.grains > 0 {
        parts.push(("grains", work.steps * work.substeps as Real * substep));
        let coupling = size.grains as Real * model.coupling_grain
            + size.filled_cells * model.coupling_filled
            + size.liquid_cells * model.room;
        parts.push(("coupling", work.steps * coupling / speed));
    }
    parts
}

/// Points of the fall at which the stiffness of springs is taken.
const POINTS: usize = 20;
/// Sub-steps in which a bed at rest is stiffened and finds its rest with its own springs, about.
const STIFFENED: Real = 2000.0;
/// Sub-steps between two halvings of the mass of fine grains that were made heavier.
const HALVING: Real = 100.0;

/// Sub-steps that packing takes: the fall from the lattice with springs that become stiffer, then the bounces until the bed rests
/// with the softest, the end with its own.
pub(crate) fn packing_substeps(case: &Case, populations: &[PopulationReport], model: &CostModel) -> Real {
    let (Some(fall), Some(time)) = (fall_of(case, populations), packing_time(case, populations, model)) else {
        return 0.0;
    };
    let own = grains::interactions(case);
    let Some(contact) = contact_step(case, populations, &own) else { return 0.0 };
    if fall.how.stop == PackingStop::TimeOnly {
        return time / contact;
    }
    let rate = |speed: Real| 1.0 / (contact * fall.softness.substep_factor(&own, speed));
    let falling = fall.time.min(time);
    let of_fall = (0..POINTS).map(|n| rate(fall.speed * (n as Real + 0.5) / POINTS as Real)).sum::<Real>();
    falling * of_fall / POINTS as Real + (time - falling) * rate(0.0) + STIFFENED + HALVING * fall.softness.halvings()
}

/// Simulated time that packing takes \[s]: the fall from the lattice, then the bounces until the bed rests; `None` if the
/// case packs nothing.
pub(crate) fn packing_time(case: &Case, populations: &[PopulationReport], model: &CostModel) -> Option<Real> {
    let Fall { how, time, slowing, .. } = fall_of(case, populations)?;
    let rest = match how.stop {
        PackingStop::TimeOnly => how.settle_time,
        PackingStop::Settled => how.settle_time.max(model.packing_rest * slowing),
    };
    Some((time + rest).min(how.time_limit))
}

/// The fall of the grains that are packed.
pub(crate) fn fall_of<'c>(case: &'c Case, populations: &[PopulationReport]) -> Option<Fall<'c>> {
    grains::fall(case, |number| {
        let (shape, report) = (&case.grains[number].shape, &populations[number]);
        let thick = shape.size().or(report.size_m)?;
        let long = shape.extent().unwrap_or(thick);
        let volume = shape.volume().unwrap_or(long * thick * thick);
        let sphere = report.body.as_ref().map_or(0.5 * thick, smallest_sphere);
        Some(Kind { count: report.grains.unwrap_or(0), thick, long, volume, sphere })
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::{Known, ShapeFacts, check};
    use super::*;
    use crate::machine::Machine;

    /// The measurements of `docs/performance.md` \[s], of `reduced` without its packing.
    #[test]
    fn predictions_agree_with_measurements_to_a_factor_of_two() {
        let part_of_bed =
            ["domain.size=[\"6.76 mm\", \"6.76 mm\", \"25 mm\"]", "domain.cells=[16, 16, 56]", "grains.0.count=1236"];
        for (name, changes, threads, measured) in [
            ("quick", &["run={until=\"144 ms\"}"][..], 2, 143.0),
            ("reduced", &[][..], 2, 190.0),
            ("bed", &part_of_bed[..], 1, 33.9),
            ("paper", &["run.steps=74"][..], 2, 157.0),
            ("table3", &[][..], 2, 1640.0),
        ] {
            let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
            let file = format!("{}/../../cases/raindrop/{name}.toml", env!("CARGO_MANIFEST_DIR"));
            let loaded = crate::case::load(Path::new(&file), &changes).unwrap();
            let bed = ShapeFacts { grains: Some(30_900), ..ShapeFacts::default() };
            let report = check(
                &loaded.case,
                Known { shapes: &[bed], ..Known::default() },
                &Machine::this(),
                threads,
                &CostModel::default(),
            );
            let packing = report.predicted_s.iter().find(|(part, _)| name == "reduced" && *part == "packing");
            let predicted = report.predicted_total_s - packing.map_or(0.0, |(_, time)| *time);
            let ratio = predicted / measured;
            assert!((0.5..=2.0).contains(&ratio), "{name}: {predicted} s, not {measured} s");
        }
    }

    #[test]
    fn the_steps_of_drops_are_foretold() {
        let half = "domain.cells=[88, 92, 66]";
        for (speed, cells, made) in [
            (9.0, None, 2829.0),
            (2.25, None, 1122.0),
            (9.0, Some(half), 1044.0),
            (4.5, Some(half), 551.0),
            (2.25, Some(half), 392.0),
        ] {
            let mut changes = vec![
                "run.until=45 ms".to_owned(),
                format!("liquid.0.fall.speed={speed} m/s"),
                "output.series={ every = \"1 ms\" }".to_owned(),
            ];
            changes.extend(cells.map(str::to_owned));
            let file = format!("{}/../../cases/raindrop/paper.toml", env!("CARGO_MANIFEST_DIR"));
            let loaded = crate::case::load(Path::new(&file), &changes).unwrap();
            let report = check(&loaded.case, Known::default(), &Machine::this(), 2, &CostModel::default());
            let ratio = report.steps / made;
            assert!((0.8..1.25).contains(&ratio), "{speed} m/s, {cells:?}: {} steps, not {made}", report.steps);
        }
    }

    #[test]
    fn a_taller_lattice_takes_longer_to_pack() {
        let file = format!("{}/../../cases/raindrop/quick.toml", env!("CARGO_MANIFEST_DIR"));
        let packing = |change: &str| {
            let loaded = crate::case::load(Path::new(&file), &[change.to_owned()]).unwrap();
            let report = check(&loaded.case, Known::default(), &Machine::this(), 2, &CostModel::default());
            let time = packing_time(&loaded.case, &report.populations, &CostModel::default()).unwrap();
            (packing_substeps(&loaded.case, &report.populations, &CostModel::default()), time)
        };
        let low = packing("grains.0.placement.packed.lattice=low");
        let tall = packing("grains.0.placement.packed.lattice=tall");
        assert!(tall.0 > 1.2 * low.0 && tall.1 > low.1);
        // Sooner, but with its own springs.
        let timed = packing("grains.0.placement.packed.stop=time_only");
        assert!(timed.1 < 0.5 * low.1 && timed.0 > 0.5 * low.0, "{timed:?} {low:?}");
    }
}
