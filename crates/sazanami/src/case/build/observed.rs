//! What is observed, written and kept.

use std::ops::Range;

use sazanami_numerics::{Real, Vector};

use super::grains::middle;
use super::liquids::millimetres;
use super::{Context, span_of};
use crate::case::meaning::{
    Bed, BoxDomain, Checkpoints, Erosion, FieldPrecision, GrainPlacement, OutputFrame, Outputs, Population, Probe,
    ProbePlace, Schedule,
};
use crate::case::schema::{BedText, CaseText, CheckpointText, OutputText, ProbeText, ScheduleText};
use crate::case::suggest::nearest;
use crate::case::units::{rounded, rounded_within};
use crate::case::value::Range1;
use crate::case::written::{At, Length, Quantity, Several, Text, Time, Whole};

/// Most points of a line that is watched: each has columns of its own in a table.
const MOST_POINTS: usize = 10_000;
/// How far a grain size that lengths of an evaluation are measured in may be from those of the grains.
const NEAR_SIZE: Real = 10.0;
/// Cells of an evaluation over the shortest edge of the box at least, where no size of grains is known.
const FINEST: Real = 1e-3;

/// Range of the grain size that lengths of an evaluation are measured in.
pub(super) fn range_of_grain_size(domain: &BoxDomain, grains: &[Population]) -> Range1 {
    let sizes = |factor: fn(&Population) -> Real| grains.iter().filter_map(move |p| Some(p.shape.size()? * factor(p)));
    let smallest = sizes(|p| p.size.smallest()).reduce(Real::min);
    let largest = sizes(|p| p.size.largest()).reduce(Real::max);
    let edge = domain.extent().min_element();
    // The size of a mesh is known with its file only.
    let known = grains.iter().all(|p| p.shape.size().is_some());
    match smallest.zip(largest) {
        Some((smallest, largest)) if known => Range1::Between(smallest / NEAR_SIZE, largest * NEAR_SIZE),
        _ => Range1::Between(FINEST * edge, edge),
    }
}

impl Context<'_> {
    pub(super) fn bed(&mut self, text: &CaseText, domain: &BoxDomain) -> Bed {
        let empty = BedText::default();
        let (written, span) = text.bed.as_ref().map_or((&empty, 0..0), |at| (&at.value, at.span.clone()));
        let values = &mut self.values;
        let floor = domain.lower.z;
        let lower = values.quantity::<Length>(written.porosity_lower.as_ref(), "porosity_lower", Range1::Any, floor);
        let upper = values.quantity::<Length>(
            written.porosity_upper.as_ref(),
            "porosity_upper",
            Range1::Any,
            (floor + 5e-3).min(domain.upper.z),
        );
        if lower >= upper || lower < domain.lower.z || upper > domain.upper.z {
            let place = written.porosity_upper.as_ref().or(written.porosity_lower.as_ref());
            let [from, to] = [lower, upper].map(|height| rounded(1e3 * height));
            let [floor, top] = rounded_within(1e3 * floor, 1e3 * domain.upper.z);
            values
                .report
                .error(
                    place.map_or(span, |q| q.item.span.clone()),
                    "the slab of the porosity has to lie within the box",
                )
                .label(format!("it reaches from {from} mm to {to} mm"))
                .help(format!(
                    "choose heights between {floor} mm and {top} mm, `porosity_lower` below `porosity_upper`"
                ));
        }
        Bed {
            porosity_slab: [lower, upper],
            height_radius: values.quantity::<Length>(
                written.height_radius.as_ref(),
                "height_radius",
                Range1::Positive,
                1e-3,
            ),
            axis: values.pair::<Length>(written.axis.as_ref(), "axis").unwrap_or(middle(domain)),
        }
    }

    pub(super) fn erosion(
        &mut self,
        text: &CaseText,
        domain: &BoxDomain,
        grains: &[Population],
        axis: [Real; 2],
    ) -> Option<Erosion> {
        let At { value, span } = text.erosion.as_ref()?;
        let sizes = range_of_grain_size(domain, grains);
        let given = self.values.optional::<Length>(value.grain_size.as_ref(), "grain_size", sizes);
        let grain_size = given.or_else(|| grains.first().and_then(|population| population.shape.size()));
        let Some(grain_size) = grain_size else {
            if text.grains.is_empty() {
                self.values.report.error(span.clone(), "there is nothing to erode").label("the case has no grains");
            } else if !grains.is_empty() {
                self.values.missing(
                    Some(span),
                    "grain_size",
                    "add `grain_size = \"0.52 mm\"`: a mesh does not tell it",
                );
            }
            return None;
        };
        let extent = domain.extent();
        let values = &mut self.values;
        let r_max =
            values.quantity::<Length>(value.r_max.as_ref(), "r_max", Range1::Positive, 0.45 * extent.x.min(extent.y));
        let cells = Range1::Between(grain_size / NEAR_SIZE, extent.max_element());
        let dx = values.quantity::<Length>(value.dx.as_ref(), "dx", cells, 2.5 * grain_size);
        let dr = values.quantity::<Length>(value.dr.as_ref(), "dr", cells, (2.5 * grain_size).min(r_max / 6.0));
        // The coarsest smoothing of the evaluation takes layers 1.6 times as thick, and two of them.
        if dr * 3.2 > r_max {
            values
                .report
                .error(span.clone(), "the layers of the crater are too thick")
                .label(format!("{:.4} mm each out to {:.4} mm", dr * 1e3, r_max * 1e3))
                .help("`r_max` has to be at least 3.2 times `dr`: lower `dr` or raise `r_max`");
        }
        Some(Erosion {
            dx,
            dr,
            r_max,
            mode: values.choice(value.mode.as_ref(), "mode", self.defaults.erosion_mode),
            axis: values.pair::<Length>(value.axis.as_ref(), "axis").unwrap_or(axis),
            grain_size,
        })
    }

    /// The probes; one that does not say when follows `series`.
    pub(super) fn probes(
        &mut self,
        text: &CaseText,
        domain: &BoxDomain,
        grains: &[Population],
        series: &Schedule,
    ) -> Vec<Probe> {
        let mut probes = Vec::new();
        let mut names: Vec<String> = Vec::new();
        for (number, at) in text.probe.iter().enumerate() {
            let name = self.probe_name(number, at, &names);
            names.push(name.clone());
            probes.extend(self.probe(name, at, domain, grains, series));
        }
        probes
    }

    /// Name of a probe: that of its table, so it has to be the name of a file and no other probe's.
    fn probe_name(&mut self, number: usize, at: &At<ProbeText>, before: &[String]) -> String {
        let written = at.value.name.as_ref();
        let name = self.values.text(written, "name").map_or_else(|| format!("probe {number}"), str::to_owned);
        let span = written.map_or(at.span.clone(), span_of);
        let report = &mut self.values.report;
        if name.trim().is_empty() || name.contains(|c: char| c == '/' || c == '\\' || c.is_control()) {
            report
                .error(span, "`name` cannot be the name of a file")
                .label("the probe is written to `probes/NAME.csv`")
                .help("take a name without `/` and `\\`, such as \"behind the step\"");
        } else if let Some(other) = before.iter().position(|other| *other == name) {
            report
                .error(span, format!("two probes have the name `{name}`"))
                .label(format!("that of probe {other}, counted from 0: both would be written to `probes/{name}.csv`"))
                .help("give each probe a name of its own");
        }
        name
    }

    fn probe(
        &mut self,
        name: String,
        at: &At<ProbeText>,
        domain: &BoxDomain,
        grains: &[Population],
        series: &Schedule,
    ) -> Option<Probe> {
        let At { value, span } = at;
        let is_unscheduled = value.every.is_none() && value.steps.is_none() && value.at.is_none();
        let schedule = match is_unscheduled {
            true => series.clone(),
            false => self.schedule_of(value.every.as_ref(), value.steps.as_ref(), value.at.as_ref()),
        };
        let mut places = Vec::new();
        if let Some(point) = self.values.vector::<Length>(value.point.as_ref(), "point") {
            places.push(ProbePlace::Point(point));
        }
        if let Some(At { value: line, span }) = &value.line {
            let from = self.values.required_vector::<Length>(line.from.as_ref(), span, "from");
            let to = self.values.required_vector::<Length>(line.to.as_ref(), span, "to");
            let points = self.values.whole_up_to(line.points.as_ref(), "points", 2, MOST_POINTS).unwrap_or(101);
            places.push(ProbePlace::Line { from, to, points });
        }
        if let Some(At { value: plane, span }) = &value.plane {
            let given: Vec<(usize, Real)> = [(&plane.x1, "x1"), (&plane.x2, "x2"), (&plane.x3, "x3")]
                .iter()
                .enumerate()
                .filter_map(|(d, (q, key))| Some((d, self.values.optional::<Length>(q.as_ref(), key, Range1::Any)?)))
                .collect();
            match given[..] {
                [(direction, position)] => places.push(ProbePlace::Plane { direction, position }),
                _ => {
                    self.values
                        .report
                        .error(span.clone(), "a plane is given by one coordinate")
                        .label("expected one of x1, x2, x3")
                        .help("for example `plane = { x2 = \"16.9 mm\" }`");
                }
            }
        }
        if let Some(gauge) = self.values.pair::<Length>(value.gauge.as_ref(), "gauge") {
            places.push(ProbePlace::Gauge(gauge));
        }
        if let Some(At { value: body, span }) = &value.body {
            places.extend(self.probed_body(body.population.as_ref(), body.index.as_ref(), span, grains));
        }
        let alternatives = usize::from(value.point.is_some())
            + usize::from(value.line.is_some())
            + usize::from(value.plane.is_some())
            + usize::from(value.gauge.is_some())
            + usize::from(value.body.is_some());
        if alternatives != 1 {
            self.values
                .report
                .error(span.clone(), "a probe watches one place")
                .label(format!("this one has {alternatives}"))
                .help("give one of `point`, `line`, `plane`, `gauge` and `body`");
            return None;
        }
        let place = places.pop()?;
        let points: Vec<Vector> = match &place {
            ProbePlace::Point(point) => vec![*point],
            ProbePlace::Line { from, to, .. } => vec![*from, *to],
            ProbePlace::Plane { direction, position } => {
                let mut point = 0.5 * (domain.lower + domain.upper);
                point[*direction] = *position;
                vec![point]
            }
            ProbePlace::Gauge([x, y]) => vec![Vector::new(*x, *y, domain.lower.z)],
            ProbePlace::Body { .. } => Vec::new(),
        };
        if points.iter().any(|p| p.cmplt(domain.lower).any() || p.cmpgt(domain.upper).any()) {
            let items = [value.point.as_ref().map(|point| &point.item), value.gauge.as_ref().map(|gauge| &gauge.item)];
            let tables = [value.line.as_ref().map(|at| &at.span), value.plane.as_ref().map(|at| &at.span)];
            let written = items.into_iter().flatten().map(|item| &item.span).chain(tables.into_iter().flatten()).next();
            self.values
                .report
                .error(written.unwrap_or(span).clone(), format!("`{name}` lies outside the box"))
                .label(format!("the box reaches from {} to {}", millimetres(domain.lower), millimetres(domain.upper)))
                .help("move it into the box; where the box begins is `lower` under `[domain]`");
        }
        Some(Probe { name, place, schedule })
    }

    fn probed_body(
        &mut self,
        population: Option<&Text>,
        index: Option<&Whole>,
        span: &Range<usize>,
        grains: &[Population],
    ) -> Option<ProbePlace> {
        let place = index.map_or(span.clone(), |Whole(at)| at.span.clone());
        let index = self.values.whole(index, "index", 0).unwrap_or(0);
        let name = self.values.text(population, "population");
        let found = match name {
            Some(name) => grains.iter().find(|p| p.name == name),
            None => grains.first(),
        };
        let Some(found) = found else {
            let place = population.map_or(span.clone(), span_of);
            let meant = name.and_then(|name| nearest(name, grains.iter().map(|p| p.name.as_str())));
            self.values
                .report
                .error(place, "there is no such population of grains")
                .label(meant.map_or("not a population of this case".into(), |m| format!("did you mean `{m}`?")))
                .help(match grains {
                    [] => "leave out the probe: the case has no grains".to_owned(),
                    grains => {
                        let known: Vec<String> = grains.iter().map(|p| format!("`{}`", p.name)).collect();
                        format!("known here: {}", known.join(", "))
                    }
                });
            return None;
        };
        if found.count.is_some_and(|count| index >= count) {
            self.values
                .report
                .error(place, format!("`{}` has no grain {index}", found.name))
                .label(format!("its grains are numbered from 0 to {}", found.count.unwrap_or(1) - 1))
                .help("take one of these numbers");
        }
        Some(ProbePlace::Body { population: found.name.clone(), index })
    }

    fn schedule_of(
        &mut self,
        every: Option<&Quantity<Time>>,
        steps: Option<&Whole>,
        at: Option<&Several<Time>>,
    ) -> Schedule {
        let every = self.values.optional::<Time>(every, "every", Range1::Positive);
        let steps = self.values.whole(steps, "steps", 1);
        let mut times = self.values.several::<Time>(at, "at").unwrap_or_default();
        if times.iter().any(|&t| t < 0.0)
            && let Some(written) = at
        {
            self.values
                .report
                .error(written.item.span.clone(), "a run begins at time zero")
                .label("no time before that")
                .help("leave out the times below zero");
        }
        times.sort_by(Real::total_cmp);
        times.dedup();
        Schedule { every, steps, at: times }
    }

    fn schedule(&mut self, written: Option<&At<ScheduleText>>, default: Schedule) -> Schedule {
        match written {
            Some(At { value, .. }) => self.schedule_of(value.every.as_ref(), value.steps.as_ref(), value.at.as_ref()),
            None => default,
        }
    }

    pub(super) fn outputs(&mut self, text: &CaseText, until: Real, grains: &[Population]) -> Outputs {
        let empty = OutputText::default();
        let written = text.output.as_ref().map_or(&empty, |at| &at.value);
        let ends = Schedule { every: None, steps: None, at: if until > 0.0 { vec![0.0, until] } else { vec![0.0] } };
        let each_step = Schedule { every: None, steps: Some(1), at: Vec::new() };
        let bed = self.path(written.bed.as_ref(), "bed");
        if let (Some(_), Some(text)) = (&bed, &written.bed)
            && !grains.iter().any(|p| matches!(p.placement, GrainPlacement::Packed(_)))
        {
            self.values
                .report
                .error(span_of(text), "no bed is packed in this run")
                .label("`output.bed` writes the bed that `placement.packed` makes");
        }
        Outputs {
            fields: self.schedule(written.fields.as_ref(), ends.clone()),
            grains: self.schedule(written.grains.as_ref(), ends.clone()),
            figures: self.schedule(written.figures.as_ref(), ends),
            series: self.schedule(written.series.as_ref(), each_step),
            precision: self.values.choice(written.precision.as_ref(), "precision", FieldPrecision::Single),
            frame: self.values.choice(written.frame.as_ref(), "frame", OutputFrame::Tank),
            bed,
        }
    }

    pub(super) fn checkpoints(&mut self, text: &CaseText) -> Checkpoints {
        let empty = CheckpointText::default();
        let written = text.checkpoint.as_ref().map_or(&empty, |at| &at.value);
        let values = &mut self.values;
        let every = values.optional::<Time>(written.every.as_ref(), "every", Range1::Positive);
        let every_wall = values.optional::<Time>(written.every_wall.as_ref(), "every_wall", Range1::Positive);
        let default_wall = if every.is_some() { None } else { Some(600.0) };
        Checkpoints {
            every_wall: every_wall.or(default_wall),
            every,
            keep: values.whole(written.keep.as_ref(), "keep", 1).unwrap_or(2),
        }
    }
}
