//! From what is written to what is meant: SI units, defaults, and everything that has to fit together.

mod flow;
mod grains;
mod liquids;
mod observed;
mod particles;
mod placement;
mod ripples;
mod sizes;

use std::ops::Range;
use std::path::{Path, PathBuf};

use sazanami_numerics::{Real, Vector};

use super::diagnostics::Diagnostics;
use super::meaning::{BoxDomain, Case, Preset, RunLength, Solver};
use super::presets::Defaults;
use super::read::Reading;
use super::schema::{CaseText, DomainText};
use super::value::{Range1, Values};
use super::written::{At, Text};

/// What every part of the build needs to know.
pub(super) struct Context<'a> {
    pub(super) values: Values<'a>,
    pub(super) defaults: Defaults,
    pub(super) folder: &'a Path,
    /// Whether liquid and grains overlap: so they do for moving particles.
    pub(super) overlaps: bool,
}

impl Context<'_> {
    /// A file name of the case, relative to the case file.
    pub(super) fn path(&mut self, written: Option<&Text>, key: &str) -> Option<PathBuf> {
        self.values.text(written, key).map(|name| self.folder.join(name))
    }
}

/// Place of a text, for findings.
pub(super) fn span_of(text: &Text) -> Range<usize> {
    text.0.span.clone()
}

/// Gives the reading its meaning; `name` is used where the file gives none. Findings go to `report`; the
/// case is good if none of them is an error.
pub(super) fn build(reading: &Reading, name: &str, folder: &Path, report: &mut Diagnostics) -> Case {
    let text = &reading.text;
    let mut values = Values { report, forgiven: reading.forgiven.clone() };
    let preset = values.choice(text.preset.as_ref(), "preset", Preset::Recommended);
    let solver = values.choice(text.solver.as_ref(), "solver", Solver::Mics);
    let defaults = Defaults::of(preset, solver);
    let context = &mut Context { values, defaults, folder, overlaps: solver == Solver::Mps };
    let name = context.values.text(text.name.as_ref(), "name").unwrap_or(name).to_owned();
    if (name.is_empty() || name.contains(['/', '\\', '\0']))
        && let Some(written) = &text.name
    {
        context
            .values
            .report
            .error(span_of(written), "`name` cannot be the name of a folder")
            .label("used for the results");
    }
    let title = context.values.text(text.title.as_ref(), "title").unwrap_or_default().to_owned();
    let mut domain = domain(context, text.domain.as_ref(), solver);
    let boundary = context.boundary(text, &domain);
    let run = run_length(context, text);
    let (gravity, frame) = context.gravity(text, run.until);
    let fluids = context.fluids(text);
    let fluid = context.fluid_options(text, &domain, gravity);
    let coupling = context.coupling(text);
    let dem = context.dem(text, &boundary);
    let (materials, contacts) = context.materials(text);
    let grains = context.populations(text, &domain, &materials);
    let particles = context.particles(text, solver, &mut domain, &grains);
    let bed = context.bed(text, &domain);
    let liquids = context.liquids(text, &domain, &grains, bed.axis);
    let erosion = context.erosion(text, &domain, &grains, bed.axis);
    let ripples = context.ripples(text, &domain, &grains, frame.as_ref(), run.until);
    let output = context.outputs(text, run.until, &grains);
    let probes = context.probes(text, &domain, &grains, &output.series);
    let checkpoint = context.checkpoints(text);
    let case = Case {
        name,
        title,
        preset,
        solver,
        domain,
        boundary,
        gravity,
        frame,
        fluids,
        fluid,
        coupling,
        particles,
        liquids,
        dem,
        materials,
        contacts,
        grains,
        bed,
        erosion,
        ripples,
        probes,
        output,
        checkpoint,
        run,
    };
    context.cross_check(text, &case);
    context.check_particles(text, &case);
    case
}

fn domain(context: &mut Context<'_>, written: Option<&At<DomainText>>, solver: Solver) -> BoxDomain {
    let nothing = BoxDomain { lower: Vector::NAN, upper: Vector::NAN, cells: [0; 3] };
    let Some(At { value, span }) = written else {
        context.values.missing(
            None,
            "domain",
            "add `[domain]` with `size = [\"33.8 mm\", \"33.8 mm\", \"25 mm\"]` and `cells = [88, 92, 66]`",
        );
        return nothing;
    };
    use super::written::Length;
    let values = &mut context.values;
    let lower = values.vector::<Length>(value.lower.as_ref(), "lower").unwrap_or(Vector::ZERO);
    let size = values.vector::<Length>(value.size.as_ref(), "size");
    let upper = values.vector::<Length>(value.upper.as_ref(), "upper");
    // Moving particles need no cells: `particles` fills them in.
    let cells = match (&value.cells, solver) {
        (None, Solver::Mps) => [0; 3],
        _ => values.cells(value.cells.as_ref(), span, "cells"),
    };
    let upper = match (upper, size) {
        (Some(_), Some(_)) => {
            values
                .report
                .error(span.clone(), "`upper` and `size` say the same thing twice")
                .label("this box has both")
                .help("keep one of the two");
            Vector::NAN
        }
        (Some(upper), None) => upper,
        (None, Some(size)) => lower + size,
        (None, None) => {
            values.missing(Some(span), "size", "add `size = [\"33.8 mm\", \"33.8 mm\", \"25 mm\"]`, or `upper`");
            Vector::NAN
        }
    };
    if (upper - lower).min_element() <= 0.0 {
        let place = value.size.as_ref().or(value.upper.as_ref()).map_or(span.clone(), |v| v.item.span.clone());
        values
            .report
            .error(place, "the box has no extent")
            .label("every edge has to be above zero")
            .help("`upper` lies above `lower` in x1, x2 and x3");
    }
    BoxDomain { lower, upper, cells }
}

fn run_length(context: &mut Context<'_>, text: &CaseText) -> RunLength {
    use super::written::Time;
    let values = &mut context.values;
    let Some(At { value, span }) = &text.run else {
        values.missing(None, "run", "add `[run]` with `until = \"0.02 s\"`");
        return RunLength { until: Real::NAN, steps: None, packing_only: false };
    };
    let packing_only = values.flag(value.packing_only.as_ref(), "packing_only", false);
    let until = if packing_only && value.until.is_none() {
        0.0
    } else {
        values.required_such_as::<Time>(value.until.as_ref(), span, "until", Range1::NonNegative, "0.02 s")
    };
    RunLength { until, steps: values.whole(value.steps.as_ref(), "steps", 1), packing_only }
}
