//! Observation of ripples, and what was measured of them.

use sazanami_io::MeasuredProfile;
use sazanami_numerics::{Real, Vector};

use super::observed::range_of_grain_size;
use super::{Context, span_of};
use crate::case::meaning::{BoxDomain, COLOUR_FORCE, Frame, ImageSide, LayerReference, Measured, Population, Ripples};
use crate::case::schema::{CaseText, MeasuredText};
use crate::case::units::rounded;
use crate::case::value::Range1;
use crate::case::written::{At, Length, Text, Time, Velocity};

/// Distance from the end walls at which ripples are not measured [m], in tanks four times as long or longer.
const MARGIN: Real = 10e-3;
/// Largest such distance over the length of the tank: something has to be left in the middle.
const WIDEST_MARGIN: Real = 0.45;

impl Context<'_> {
    pub(super) fn ripples(
        &mut self,
        text: &CaseText,
        domain: &BoxDomain,
        grains: &[Population],
        frame: Option<&Frame>,
        until: Real,
    ) -> Option<Ripples> {
        let At { value, span } = text.ripples.as_ref()?;
        let sizes = range_of_grain_size(domain, grains);
        let given = self.values.optional::<Length>(value.grain_size.as_ref(), "grain_size", sizes);
        let Some(grain_size) = given.or_else(|| grains.first().and_then(|p| p.shape.size())) else {
            if text.grains.is_empty() {
                self.values.report.error(span.clone(), "there is nothing to ripple").label("the case has no grains");
            }
            return None;
        };
        let values = &mut self.values;
        let (extent, height) = (domain.extent().x, domain.extent().z);
        let margins = Range1::Between(0.0, WIDEST_MARGIN * extent);
        let length = values
            .quantity::<Length>(value.layer_length.as_ref(), "layer_length", Range1::Positive, extent)
            .min(extent);
        let middle = 0.5 * (domain.lower.x + domain.upper.x);
        Some(Ripples {
            grain_size,
            layer_thickness: values.quantity::<Length>(
                value.layer_thickness.as_ref(),
                "layer_thickness",
                Range1::Between(0.1 * grain_size, height),
                (5.0 * grain_size).min(height),
            ),
            layers: values.choice(value.layers.as_ref(), "layers", LayerReference::Floor),
            layer_range: [middle - 0.5 * length, middle + 0.5 * length],
            margin: values.quantity::<Length>(value.margin.as_ref(), "margin", margins, MARGIN.min(0.25 * extent)),
            image_side: values.choice(value.image_side.as_ref(), "image_side", ImageSide::Lower),
            colour_speed: values.quantity::<Velocity>(
                value.colour_speed.as_ref(),
                "colour_speed",
                Range1::Positive,
                0.1,
            ),
            colour_force: values.number(value.colour_force.as_ref(), "colour_force", Range1::Positive, COLOUR_FORCE),
            measured: self.all_measured(&value.measured, domain, frame, until),
        })
    }

    /// Measured profiles; tables of one time become one, unless both name the same surface.
    fn all_measured(
        &mut self,
        written: &[At<MeasuredText>],
        domain: &BoxDomain,
        frame: Option<&Frame>,
        until: Real,
    ) -> Vec<Measured> {
        let mut found: Vec<Measured> = Vec::new();
        for at in written {
            let Some(mut one) = self.measured(at, domain, frame, until) else { continue };
            match found.iter_mut().find(|other| other.can_take(&one)) {
                Some(other) => {
                    other.bed = other.bed.take().or(one.bed.take());
                    other.water = other.water.take().or(one.water.take());
                }
                None => found.push(one),
            }
        }
        found
    }

    fn measured(
        &mut self,
        At { value, span }: &At<MeasuredText>,
        domain: &BoxDomain,
        frame: Option<&Frame>,
        until: Real,
    ) -> Option<Measured> {
        let time = self.values.required_such_as::<Time>(value.time.as_ref(), span, "time", Range1::NonNegative, "3 s");
        if value.bed.is_none() && value.water.is_none() {
            self.values
                .report
                .error(span.clone(), "nothing was measured at this time")
                .label("it names no file")
                .help("name the file of a surface, `bed` or `water`");
            return None;
        }
        // A tank of which the case knows only how it is accelerated may be anywhere.
        let is_lost = frame.is_some_and(|frame| frame.oscillation.is_some());
        let motion = frame.and_then(|frame| frame.motion.as_ref());
        let displaced = motion.map_or(Vector::ZERO, |motion| motion.at(time)[0]);
        if time > until {
            let place = value.time.as_ref().map_or(span.clone(), |time| time.item.span.clone());
            self.values
                .report
                .warning(Some(place), "these profiles were measured after the end of the run")
                .label(format!("the run ends at {} s", rounded(until)));
        }
        let mut read = |written: Option<&Text>, key: &str| {
            let file = self.path(written, key)?;
            let text = written?;
            match MeasuredProfile::read_if_there(&file) {
                Ok(Some(profile)) if profile.is_of_laboratory() && is_lost => {
                    self.values
                        .report
                        .error(span_of(text), "a profile measured from the laboratory cannot be brought into this tank")
                        .label("the case gives the acceleration of the tank, not its place")
                        .help("give the profile in the coordinates of the tank, or the tank a `[frame.motion]`");
                }
                Ok(Some(profile)) => {
                    let profile = profile.in_tank([displaced.x, displaced.z]);
                    // Pixels and shakes of the camera: a fiftieth of the tank.
                    for d in [0, 2] {
                        let along = profile.points.iter().map(|point| point[d.min(1)]);
                        let [low, high] =
                            [along.clone().fold(Real::INFINITY, Real::min), along.fold(Real::MIN, Real::max)];
                        let [lower, upper] = [domain.lower[d], domain.upper[d]];
                        let beyond = 0.02 * (upper - lower);
                        if low >= lower - beyond && high <= upper + beyond {
                            continue;
                        }
                        self.values
                            .report
                            .error(span_of(text), format!("the measured profile reaches out of the tank along x{}", d + 1))
                            .label(format!(
                                "it reaches from {:.1} to {:.1} mm, the tank from {:.1} to {:.1} mm",
                                1e3 * low,
                                1e3 * high,
                                1e3 * lower,
                                1e3 * upper
                            ))
                            .help(
                                "columns are in metres in the coordinates of the tank: check the origin and the size of \
                                 a pixel",
                            );
                    }
                }
                Ok(None) => {
                    self.values
                        .report
                        .warning(Some(span_of(text)), format!("there is no file `{}`", file.display()))
                        .label("nothing is compared with it");
                }
                Err(problem) => {
                    self.values
                        .report
                        .error(span_of(text), "the measured profile cannot be read")
                        .label(problem.to_string())
                        .help(
                            "a CSV file with a line `x_m,z_m` and a row of numbers for each place, places increasing",
                        );
                }
            }
            Some(file)
        };
        let (bed, water) = (read(value.bed.as_ref(), "bed"), read(value.water.as_ref(), "water"));
        Some(Measured { time, bed, water })
    }
}
