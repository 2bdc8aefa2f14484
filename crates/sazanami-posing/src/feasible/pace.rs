//! Whether a run comes to its end: speeds that no fluid without sound has, steps without end, steps that are too long.

use std::ops::Range;

use sazanami_dem::impact::ImpactErrors;
use sazanami_dem::stability::USUAL_ERROR;
use sazanami_dem::{DEEP_OVERLAP, Damping, LARGEST_OVERLAP};
use sazanami_mics::stability::Limit;
use sazanami_numerics::{Real, Vector};

use super::Search;
use crate::assembly::grains::{self, smallest_sphere};
use crate::case::meaning::{Case, GrainPlacement, PairContact, Population, Solver, Substeps, WALL};
use crate::case::units::rounded;
use crate::check::{
    Cause, CostModel, LimitReport, OF_PASS, Pace, PopulationReport, ShapeFacts, SubstepCause, TankReport, fall_of,
    impact_errors, longest_substep, number, packing_substeps, population_reports, speeds, stiffest_contact, stiffness,
    strongest_force, substep_cause, tank,
};
use crate::steps::{SWING, fixed_step, longest_in_swing};

/// Speed of sound in water [m/s]: no liquid is as good as incompressible that moves faster.
const SOUND: Real = 1500.0;
/// Most steps of a run: years on any machine.
const MOST_STEPS: Real = 1e10;
/// Most sub-steps of the grains in a run.
const MOST_SUBSTEPS: Real = 1e12;
/// Weight of a bed on one contact over that on the contacts of a grain.
const SHARED_WEIGHT: Real = 5.0;
/// Passes of the fluid in a fixed step from which on it is said to be long.
const MANY_PASSES: usize = 10;

/// Mean error of impacts from which on sub-steps are said to be long: twice the usual one.
const COARSE_IMPACTS: Real = 2.0 * USUAL_ERROR;

/// Whether a value is larger than allowed, or no number for the size of what it comes from.
fn exceeds(value: Real, most: Real) -> bool {
    value.is_nan() || value > most
}

/// The least of some round errors of impacts that the sub-steps of a case can keep.
fn least_error_kept(case: &Case, populations: &[PopulationReport]) -> Option<Real> {
    [0.025, 0.03, 0.04, 0.05, 0.075, 0.1, 0.15, 0.2].into_iter().find(|&error| {
        let mut asked = case.clone();
        asked.dem.allowed_error = Some(error);
        longest_substep(&asked, populations, &grains::interactions(&asked)).is_some_and(|longest| longest.accurate)
    })
}

/// How deep the weight of the grains presses a contact, all of it on one, over the radius of the smallest contact sphere, and the softest of the
/// contacts that bear it.
fn pressed_by_weight<'case>(case: &'case Case, populations: &[PopulationReport]) -> Option<(Real, &'case PairContact)> {
    let gravity = case.resting_gravity().length();
    let is_there =
        |material: &str| material == WALL || case.grains.iter().any(|population| population.material == material);
    let pressed = case.grains.iter().zip(populations).filter_map(|(population, report)| {
        let (size, mass) = (report.size_m?, report.mass_kg?);
        let body = report.body.as_ref().filter(|_| population.has_free_grains())?;
        let piled = match population.placement {
            GrainPlacement::Packed(_) | GrainPlacement::Bed(_) => {
                let floor = case.domain.extent().x * case.domain.extent().y;
                (report.levelled.or(report.grains)? as Real * size * size / floor).max(1.0)
            }
            _ => 1.0,
        };
        let borne = |pair: &&PairContact| {
            [&pair.a, &pair.b].contains(&&population.material) && is_there(&pair.a) && is_there(&pair.b)
        };
        // Grains that liquid may be around weigh less.
        let density = case.material(&population.material)?.density;
        let lifted =
            if case.liquids.is_empty() || population.mass_override.is_some() { 0.0 } else { case.fluid.liquid.density };
        let weight = mass * gravity * (1.0 - lifted / density).max(0.0);
        let softness = |a: &&PairContact, b: &&PairContact| a.law.normal_stiffness.total_cmp(&b.law.normal_stiffness);
        let softest = case.contacts.iter().filter(borne).min_by(softness)?;
        let radius = smallest_sphere(body) * population.sizes().smallest();
        Some((piled * weight / (softest.law.normal_stiffness * radius), softest))
    });
    pressed.max_by(|(a, _), (b, _)| a.total_cmp(b))
}

impl Search<'_> {
    /// Refuses runs that cannot come to their end, and warns of steps that are too long.
    pub(super) fn pace(&mut self, facts: &[ShapeFacts], model: &CostModel) {
        let case = self.case;
        let tank = tank(case);
        self.below_sound(tank.as_ref());
        if self.report.has_errors() || (case.run.packing_only && !case.packs()) {
            return;
        }
        let populations = population_reports(case, facts);
        self.accuracy(&populations);
        self.crushing(&populations);
        self.softening();
        self.springs_bear_the_weight(&populations);
        let pace = Pace::reached(case, &populations, tank.as_ref());
        self.substeps(&populations, &pace);
        if !case.run.packing_only {
            self.fixed_step(&pace);
            self.follows_oscillation(&pace);
            if exceeds(pace.steps, MOST_STEPS) {
                return self.without_end(&pace);
            }
        }
        let of_flow = if case.run.packing_only { 0.0 } else { pace.steps * pace.mean_substeps as Real };
        let substeps = of_flow + packing_substeps(case, &populations, model);
        if let Some(pair) = stiffest_contact(case).filter(|_| exceeds(substeps, MOST_SUBSTEPS)) {
            let cause = substep_cause(case, &populations);
            let (asks, help) = match cause {
                SubstepCause::Film => (
                    "the film between grains asks".to_owned(),
                    "take a larger `film_roughness`, or a liquid less viscous",
                ),
                SubstepCause::Face => (
                    "a face that comes to rest with all its contact spheres asks".to_owned(),
                    "take fewer contact spheres, a softer contact, or less damping",
                ),
                SubstepCause::Contact => (
                    format!("{:.1e} N/m ask", stiffness(pair)),
                    "take a softer contact: grains may overlap by a hundredth of their size",
                ),
            };
            let of_film = (cause == SubstepCause::Film).then(|| self.loaded.places.of("dem.film_roughness")).flatten();
            self.report
                .error_at(
                    of_film.or(self.span_of_contact(pair)),
                    "the grains need too many contact sub-steps to reach the end of this run",
                )
                .label(format!("{asks} for {} sub-steps", number(substeps, 0)))
                .help(help);
        }
    }

    /// Refuses to pack fine grains under coarse ones that press them flat.
    fn crushing(&mut self, populations: &[PopulationReport]) {
        let Some(fall) = fall_of(self.case, populations) else { return };
        let (needed, own) = (fall.softness.least(), grains::interactions(self.case).least_stiffness());
        if needed > own {
            let span = self.loaded.places.near("contact.default.normal_stiffness");
            self.report
                .error_at(span, "the coarse grains of this bed press the fine ones flat")
                .label(format!("{} N/m; the heaviest grain on three of the finest asks for {}", rounded(own), number(needed, 0)))
                .help("take stiffer contacts, or cut the distribution of sizes: `size.lognormal = { sigma = 1.0, lower = 0.3, upper = 3.0 }`");
        }
    }

    /// Refuses springs that are softened in vain.
    fn softening(&mut self) {
        let Some(softening) = self.case.dem.soften else { return };
        let near = |key: &str| self.loaded.places.near(&format!("dem.soften{key}"));
        if let Substeps::Fixed(count) = self.case.dem.substeps {
            self.report
                .error_at(near(""), "softer springs make sub-steps longer, and `substeps` gives their number")
                .label(format!("`substeps = {count}`"))
                .help("leave out one of them");
        } else if softening.from >= self.case.run.until {
            self.report
                .warning(near(".from"), "springs are softened after the end of the run")
                .label(format!("the run ends at {} s", rounded(self.case.run.until)))
                .help("soften them before, or leave out `soften`");
        }
    }

    /// Refuses springs, softened or not, that let the weight of the grains alone press them too deep by far, and warns of those that let it press
    /// them deep.
    fn springs_bear_the_weight(&mut self, populations: &[PopulationReport]) {
        let Some((deepest, pair)) = pressed_by_weight(self.case, populations) else { return };
        let by_radius = |part: Real| format!("{:.1} % of a contact sphere's radius", 1e2 * part);
        let softening = self.case.dem.soften.filter(|softening| softening.from < self.case.run.until);
        let (place, help, left, ends) = match softening {
            Some(soft) => {
                let place = self.loaded.places.near("dem.soften.stiffness");
                (place, "leave more of the stiffness", soft.stiffness, soft.largest_overlap)
            }
            None => (
                self.span_of_contact(pair),
                "take stiffer contacts: grains of sand are given 1e3 to 1e5 N/m",
                1.0,
                LARGEST_OVERLAP,
            ),
        };
        let deepest = deepest / left;
        if deepest > SHARED_WEIGHT * ends {
            self.report
                .error_at(place, "so soft springs let the weight of the grains alone press them too deep")
                .label(format!("by some {}, where {:.1} % end the run", by_radius(deepest), 1e2 * ends))
                .help(help);
        } else if deepest > SHARED_WEIGHT * DEEP_OVERLAP {
            self.report
                .warning(place, "so soft springs let the weight of the grains press them deep")
                .label(format!("by some {}, all of it on one contact", by_radius(deepest)))
                .help(help);
        }
    }

    /// Refuses errors of impacts that no sub-step keeps.
    fn accuracy(&mut self, populations: &[PopulationReport]) {
        let case = self.case;
        let Some(allowed) = case.dem.allowed_error else { return };
        let place = self.loaded.places.of("dem.allowed_error");
        if let Substeps::Fixed(count) = case.dem.substeps {
            self.report
                .error_at(
                    place,
                    "`allowed_error` chooses the length of the sub-steps, and `substeps` gives their number",
                )
                .label(format!("`substeps = {count}`"))
                .help("leave out one of them; `check` says the errors of impacts either way");
            return;
        }
        let interactions = grains::interactions(case);
        if let Some(longest) = longest_substep(case, populations, &interactions).filter(|longest| !longest.accurate) {
            let errors = impact_errors(case, populations, &interactions, longest.contact).unwrap_or_default();
            let larger = least_error_kept(case, populations);
            let larger = larger.map_or("a larger error".to_owned(), |error| format!("a larger error, {error} or more"));
            let help = format!(
                "allow {larger}; strong damping, `tension = true` and `tangential_force = \"published\"` cost accuracy"
            );
            self.report
                .error_at(
                    place,
                    format!(
                        "no length of the contact sub-steps keeps the error of impacts within {}",
                        rounded(allowed)
                    ),
                )
                .label(format!(
                    "the shortest, {} s, is off by {} in restitution and {} in spin",
                    rounded(longest.contact),
                    number(errors.restitution.mean, 6),
                    number(errors.spin.mean, 6)
                ))
                .help(help);
        }
    }

    /// Warns of sub-steps that are longer than the contacts bear, and of contacts that no usual sub-step resolves.
    fn substeps(&mut self, populations: &[PopulationReport], pace: &Pace) {
        let case = self.case;
        let interactions = grains::interactions(case);
        let Some(longest) = longest_substep(case, populations, &interactions) else { return };
        let of = |errors: ImpactErrors| {
            let [restitution, spin] = [errors.restitution, errors.spin].map(|error| number(error.mean, 3));
            format!("off by {restitution} in restitution and {spin} in spin over the tangential speed")
        };
        match case.dem.substeps {
            Substeps::Fixed(count) => {
                let substep = pace.dt / count as Real;
                let errors = impact_errors(case, populations, &interactions, substep).unwrap_or_default();
                let needed = (pace.dt / longest.shortest()).ceil();
                if !(needed > count as Real && errors.mean() > COARSE_IMPACTS) {
                    return;
                }
                self.report
                    .warning(
                        self.loaded.places.near("dem.substeps"),
                        "the contact sub-steps are too long for the contacts",
                    )
                    .label(format!("{count} in a step of {} s: impacts are {}", rounded(pace.dt), of(errors)))
                    .help(format!("write `substeps = \"auto\"`, which takes {}", number(needed, 0)));
            }
            Substeps::Auto if !longest.accurate && case.dem.allowed_error.is_none() => {
                let errors = impact_errors(case, populations, &interactions, longest.contact).unwrap_or_default();
                if errors.mean() <= COARSE_IMPACTS {
                    return;
                }
                let stiffest = stiffest_contact(case);
                let span = stiffest.and_then(|pair| self.span_of_contact(pair));
                // A coefficient of restitution is what the case wants; a dashpot may not be.
                let by_mass = stiffest.is_some_and(|pair| matches!(pair.law.damping, Damping::Literal { .. }));
                let write = if by_mass { "write `restitution = 0.5`, which suits grains of any mass, or " } else { "" };
                let help = match least_error_kept(case, populations) {
                    Some(error) => format!("{write}ask for an error: `dem.allowed_error = {error}`"),
                    None => format!("{write}take a weaker dashpot: no sub-step makes such impacts exact"),
                };
                self.report
                    .warning(span, "a dashpot damps the lightest grains too much for sub-steps of the usual length")
                    .label(format!("with {} s impacts are {}", rounded(longest.contact), of(errors)))
                    .help(help);
            }
            Substeps::Auto => {}
        }
    }

    /// Refuses speeds that fluids without sound do not have, and forces that make them.
    fn below_sound(&mut self, tank: Option<&TankReport>) {
        let case = self.case;
        let reach = case.domain.extent().max_element();
        let falls = (2.0 * strongest_force(case) * reach).sqrt();
        // A liquid that only a force makes as fast is told with the force.
        let by_force = |cause: &Cause| {
            exceeds(falls, SOUND)
                && matches!(cause, Cause::Liquid(n) if !exceeds(case.liquids[*n].velocity.length(), SOUND))
        };
        // What a force makes of the flow along periodic sides hangs on grains too.
        let mut known = speeds(case, tank);
        known.retain(|(cause, _)| !matches!(cause, Cause::Force));
        known.extend((0..case.grains.len()).map(|n| (Cause::Grains(n), Vector::X * fastest_turn(&case.grains[n]))));
        for (cause, speed) in known.iter().filter(|(of, speed)| exceeds(speed.length(), SOUND) && !by_force(of)) {
            self.report
                .error_at(self.span_of_cause(*cause), "this moves faster than sound in water")
                .label(format!("{} m/s can be expected; sound has {SOUND} m/s", number(speed.length(), 1)))
                .help("both fluids are incompressible: check the units, and lower the speed");
        }
        if exceeds(falls, SOUND) && !self.report.has_errors() {
            self.report
                .error_at(self.span_of_force(), "this body force is too strong for incompressible flow")
                .label(format!(
                    "{} m/s^2: what falls through the box gets to {} m/s",
                    number(strongest_force(case), 1),
                    number(falls, 1)
                ))
                .help("check the units of gravity, of the frame's acceleration and of that of the drive");
        }
    }

    /// Refuses steps without end.
    fn without_end(&mut self, pace: &Pace) {
        let rule = pace.limits.iter().find(|limit| limit.rules);
        let rule = rule.map_or(String::new(), |limit| format!("; `{}` rules the step: {}", limit.name, limit.rule));
        self.report
            .error_at(self.loaded.places.near("run.until"), "this run would not come to its end")
            .label(format!("about {} steps of {} s", number(pace.steps, 0), rounded(pace.mean)))
            .help(format!("end it sooner{rule}"));
    }

    /// Warns of a fixed step that is longer than the limits allow.
    fn fixed_step(&mut self, pace: &Pace) {
        if fixed_step(self.case).is_none() {
            return;
        }
        let on_grid = self.case.solver == Solver::Mics;
        let span = self.loaded.places.of(if on_grid { "fluid.dt" } else { "particles.dt" });
        // The fluid on a grid makes several passes where it has to.
        let in_passes = OF_PASS.map(Limit::name);
        let binding =
            |limit: &&LimitReport| !(limit.rules || limit.name == SWING || on_grid && in_passes.contains(&limit.name));
        if let Some(limit) = pace.limits.iter().find(binding).filter(|limit| limit.dt_s < pace.dt) {
            self.report
                .warning(span, "this fixed step is longer than the limits allow")
                .label(format!("`{}` allows {} s: {}", limit.name, rounded(limit.dt_s), limit.rule))
                .help("leave out `dt` for a step that adapts");
        } else if pace.passes > MANY_PASSES {
            self.report
                .warning(span, "this fixed step is long for the fluid")
                .label(format!("the fluid makes {} passes in each", number(pace.passes as Real, 0)))
                .help("leave out `dt` for a step that adapts");
        }
    }

    /// Warns of an oscillation that the steps cannot follow.
    fn follows_oscillation(&mut self, pace: &Pace) {
        let (Some(longest), Some(frequency)) = (longest_in_swing(self.case), self.case.swing_frequency()) else {
            return;
        };
        if pace.dt > longest * (1.0 + 1e-9) {
            let span = self.span_of_cause(Cause::Frame).or_else(|| self.loaded.places.of("drive.oscillation"));
            self.report
                .warning(span, "the steps are too long for this oscillation")
                .label(format!("a step of {} s is {} of its periods", rounded(pace.dt), rounded(pace.dt * frequency)))
                .help(format!("take steps of {} s at most, or check the frequency", rounded(longest)));
        }
    }

    /// Place of what makes a speed.
    fn span_of_cause(&self, cause: Cause) -> Option<Range<usize>> {
        let places = &self.loaded.places;
        match cause {
            Cause::Liquid(n) => places.of(&format!("liquid.{n}")),
            Cause::Side => places.of("boundary"),
            Cause::Frame => places.near("frame.motion"),
            Cause::InitialVelocity => places.near("fluid.initial_velocity"),
            Cause::CarryingFlow => places.near("fluid.carrying_flow"),
            Cause::Drive => places.near("drive.mean_velocity"),
            Cause::Force => self.span_of_force(),
            Cause::Grains(n) => Some(self.span(n)),
        }
    }

    /// Place of the body force: what drives the flow, the frame, or gravity.
    fn span_of_force(&self) -> Option<Range<usize>> {
        ["drive.acceleration", "drive.oscillation", "frame", "gravity"]
            .into_iter()
            .find_map(|key| self.loaded.places.of(key))
    }

    /// Place of the stiffness of a contact.
    fn span_of_contact(&self, pair: &PairContact) -> Option<Range<usize>> {
        let names = [format!("{}/{}", pair.a, pair.b), format!("{}/{}", pair.b, pair.a), "default".into()];
        let places = &self.loaded.places;
        let given = names.iter().find(|name| places.of(&format!("contact.{name}")).is_some())?;
        places.near(&format!("contact.{given}.normal_stiffness"))
    }
}

/// Largest speed that a turn gives to a point of the surface of a listed grain, by half of its largest extent [m/s].
fn fastest_turn(population: &Population) -> Real {
    let GrainPlacement::List(list) = &population.placement else { return 0.0 };
    let turns = list.iter().map(|grain| grain.factor * grain.angular_velocity.length());
    0.5 * population.shape.extent().unwrap_or(0.0) * turns.fold(0.0, Real::max)
}
