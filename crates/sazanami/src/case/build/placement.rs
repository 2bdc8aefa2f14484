//! Where grains are put.

use sazanami_numerics::{Quaternion, Real, Vector};

use super::Context;
use super::liquids::millimetres;
use crate::case::meaning::{BedFile, BoxDomain, Grain, GrainPlacement, Lattice, LatticePlacement, Motion, Packing};
use crate::case::schema::{BedFileText, GrainText, LatticeText, PackingText, PlacementText};
use crate::case::value::Range1;
use crate::case::written::{Angle, AngularVelocity, At, Length, Time, Velocity};

impl Context<'_> {
    pub(super) fn grain_placement(
        &mut self,
        At { value, span }: &At<PlacementText>,
        motion: Motion,
        domain: &BoxDomain,
    ) -> Option<GrainPlacement> {
        Some(match value {
            PlacementText::Packed(packing) => GrainPlacement::Packed(self.packing(packing)),
            PlacementText::Bed(bed) => GrainPlacement::Bed(self.bed_file(bed, span)?),
            PlacementText::Lattice(lattice) => GrainPlacement::Lattice(self.lattice(lattice, span, domain)),
            PlacementText::List(list) => {
                if list.is_empty() {
                    self.values
                        .report
                        .error(span.clone(), "the list of grains is empty")
                        .label("expected at least one")
                        .help("for example `list = [{ position = [\"5 mm\", \"5 mm\", \"5 mm\"] }]`");
                }
                GrainPlacement::List(list.iter().map(|grain| self.grain(grain, motion, domain)).collect())
            }
        })
    }

    fn packing(&mut self, written: &PackingText) -> Packing {
        let stop = self.defaults.packing_stop;
        let values = &mut self.values;
        Packing {
            lattice: values.choice(written.lattice.as_ref(), "lattice", Lattice::Tall),
            spacing: values.number(written.spacing.as_ref(), "spacing", Range1::Between(0.1, 100.0), 1.05),
            jitter: values.number(written.jitter.as_ref(), "jitter", Range1::Between(0.0, 0.5), 0.02),
            level: values.optional::<Length>(written.level.as_ref(), "level", Range1::Positive),
            glued: values.optional::<Length>(written.glued.as_ref(), "glued", Range1::Positive),
            height: values.optional::<Length>(written.height.as_ref(), "height", Range1::Positive),
            fall_gravity: values.number(written.fall_gravity.as_ref(), "fall_gravity", Range1::Positive, 4.0),
            settle_time: values.quantity::<Time>(
                written.settle_time.as_ref(),
                "settle_time",
                Range1::NonNegative,
                5e-3,
            ),
            stop: values.choice(written.stop.as_ref(), "stop", stop),
            mean_speed: values.quantity::<Velocity>(written.mean_speed.as_ref(), "mean_speed", Range1::Positive, 2e-3),
            energy_ratio: values.number(written.energy_ratio.as_ref(), "energy_ratio", Range1::Positive, 1e-3),
            friction_scale: values.number(written.friction_scale.as_ref(), "friction_scale", Range1::NonNegative, 1.0),
            time_limit: values.quantity::<Time>(written.time_limit.as_ref(), "time_limit", Range1::Positive, 2.0),
        }
    }

    fn bed_file(&mut self, written: &BedFileText, span: &std::ops::Range<usize>) -> Option<BedFile> {
        let scale = self.values.number(written.scale.as_ref(), "scale", Range1::Positive, 1.0);
        let relax = self.values.flag(written.relax.as_ref(), "relax", false);
        let recipe = self.path(written.recipe.as_ref(), "recipe");
        let Some(file) = self.path(written.file.as_ref(), "file") else {
            if written.file.is_none() {
                self.values.missing(Some(span), "file", "add `file = \"beds/paper.bed\"`");
            }
            return None;
        };
        if !file.is_file()
            && let Some(text) = &written.file
        {
            let help = match &recipe {
                Some(recipe) => format!(
                    "make it with `sazanami run {} --set output.bed=\"{}\"`",
                    recipe.display(),
                    std::path::absolute(&file).unwrap_or_else(|_| file.clone()).display()
                ),
                None => "make it with a case that packs grains and names it under `output.bed`".into(),
            };
            self.values
                .report
                .error(text.0.span.clone(), format!("there is no bed file `{}`", file.display()))
                .label("file not found")
                .help(help);
        }
        Some(BedFile { file, scale, relax, recipe })
    }

    fn lattice(
        &mut self,
        written: &LatticeText,
        span: &std::ops::Range<usize>,
        domain: &BoxDomain,
    ) -> LatticePlacement {
        let values = &mut self.values;
        let lattice = LatticePlacement {
            lower: values.vector::<Length>(written.lower.as_ref(), "lower").unwrap_or(domain.lower),
            upper: values.vector::<Length>(written.upper.as_ref(), "upper").unwrap_or(domain.upper),
            counts: values.cells(written.counts.as_ref(), span, "counts"),
            jitter: values.number(written.jitter.as_ref(), "jitter", Range1::Between(0.0, 0.5), 0.0),
            random_orientation: values.flag(written.random_orientation.as_ref(), "random_orientation", false),
            velocity: values.vector::<Velocity>(written.velocity.as_ref(), "velocity").unwrap_or(Vector::ZERO),
        };
        if (lattice.upper - lattice.lower).min_element() <= 0.0 {
            values
                .report
                .error(span.clone(), "the block of the lattice has no extent")
                .label("`upper` has to lie above `lower` in x1, x2 and x3");
        }
        if lattice.lower.cmplt(domain.lower).any() || lattice.upper.cmpgt(domain.upper).any() {
            values
                .report
                .error(span.clone(), "the lattice reaches out of the box")
                .label(format!("the box reaches from {} to {}", millimetres(domain.lower), millimetres(domain.upper)))
                .help("leave out `lower` and `upper` to fill the box");
        }
        lattice
    }

    fn grain(&mut self, At { value, span }: &At<GrainText>, motion: Motion, domain: &BoxDomain) -> Grain {
        let position = self.values.required_vector::<Length>(value.position.as_ref(), span, "position");
        if position.cmplt(domain.lower).any() || position.cmpgt(domain.upper).any() {
            let place = value.position.as_ref().map_or(span.clone(), |p| p.item.span.clone());
            self.values
                .report
                .error(place, "this grain lies outside the box")
                .label(format!("the box reaches from {} to {}", millimetres(domain.lower), millimetres(domain.upper)))
                .help("move the grain, or enlarge the box");
        }
        let orientation = self.orientation(value, span);
        let values = &mut self.values;
        Grain {
            position,
            orientation,
            velocity: values.vector::<Velocity>(value.velocity.as_ref(), "velocity").unwrap_or(Vector::ZERO),
            angular_velocity: values
                .vector::<AngularVelocity>(value.angular_velocity.as_ref(), "angular_velocity")
                .unwrap_or(Vector::ZERO),
            motion: values.choice(value.motion.as_ref(), "motion", motion),
            factor: values.number(value.factor.as_ref(), "factor", Range1::Positive, 1.0),
        }
    }

    fn orientation(&mut self, value: &GrainText, span: &std::ops::Range<usize>) -> Quaternion {
        let axis = self.values.numbers::<3>(value.axis.as_ref(), "axis").map(Vector::from);
        let angle = self.values.optional::<Angle>(value.angle.as_ref(), "angle", Range1::Any);
        let quaternion = self.values.numbers::<4>(value.quaternion.as_ref(), "quaternion");
        let mut refuse = |title: &str, help: &str| {
            self.values.report.error(span.clone(), title).label("the orientation of this grain").help(help);
        };
        match (axis, angle, quaternion) {
            (None, None, None) => Quaternion::IDENTITY,
            (Some(axis), Some(angle), None) => {
                if axis.length() == 0.0 {
                    refuse("an axis needs a direction", "for example `axis = [0, 0, 1]`");
                }
                Quaternion::from_axis_angle(axis.normalize_or(Vector::Z), angle)
            }
            (None, None, Some([w, x, y, z])) => {
                let q = Quaternion::from_xyzw(x, y, z, w);
                let length: Real = q.length();
                if length == 0.0 {
                    refuse("a quaternion must not be zero", "`[1, 0, 0, 0]` is no rotation");
                }
                // A unit quaternion, as in a resolved case, is kept to the last bit.
                if (length - 1.0).abs() < 1e-15 { q } else { q.normalize() }
            }
            (_, _, Some(_)) => {
                refuse("an orientation is given once", "keep `quaternion`, or `axis` and `angle`");
                Quaternion::IDENTITY
            }
            (_, _, None) => {
                refuse("a rotation needs an axis and an angle", "add the one that is missing");
                Quaternion::IDENTITY
            }
        }
    }
}
