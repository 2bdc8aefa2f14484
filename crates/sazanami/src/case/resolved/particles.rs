//! The part of the resolved copy about moving particles, their tank, and ripples.

use super::Writer;
use crate::case::meaning::{Case, Frame, TankMotion};

impl Writer {
    pub(super) fn motion(&mut self, frame: &Frame) {
        let Some(motion) = &frame.motion else { return };
        self.table("frame.motion");
        match motion {
            TankMotion::Formula { amplitude, frequency, phase, ramp } => {
                self.vector("amplitude", *amplitude, "m");
                self.quantity("frequency", *frequency, "Hz");
                self.quantity("phase", *phase, "rad");
                self.quantity("ramp", *ramp, "s");
            }
            TankMotion::File { file, axis, .. } => {
                self.path("file", file);
                self.word("axis", *axis);
            }
        }
        self.word("walls", frame.walls);
    }

    pub(super) fn particles(&mut self, case: &Case) {
        let Some(particles) = &case.particles else { return };
        self.table("particles");
        self.quantity("spacing", particles.spacing, "m");
        self.number("radius", particles.radius);
        self.word("weight", particles.weight);
        self.word("source", particles.source);
        self.word("laplacian", particles.laplacian);
        self.number("compensation", particles.compensation);
        self.number("relaxation", particles.relaxation);
        self.word("gradient", particles.gradient);
        self.word("stabilisation", particles.stabilisation);
        self.number("stabilisation_distance", particles.stabilisation_distance);
        self.number("shifting", particles.shifting);
        self.raw("reduced_pressure", &particles.reduced_pressure.to_string());
        self.number("courant", particles.courant);
        if let Some(dt) = particles.dt {
            self.quantity("dt", dt, "s");
        }
        self.quantity("dt_max", particles.dt_max, "s");
        self.number("tolerance", particles.tolerance);
        self.raw("pressure_iterations", &particles.pressure_iterations.to_string());
        let overlap = &particles.overlap;
        self.table("overlap");
        self.quantity("smoothing", overlap.smoothing, "m");
        self.number("least_void", overlap.least_void);
        self.word("pressure_force", overlap.pressure_force);
        self.number("kozeny", overlap.kozeny);
        if let Some(forchheimer) = overlap.forchheimer {
            self.number("forchheimer", forchheimer);
        }
        self.word("sphere_drag", overlap.sphere_drag);
        self.word("density_reference", overlap.density_reference);
        self.raw("blend", &format!("{:?}", overlap.blend));
        let preparation = &particles.preparation;
        self.table("preparation");
        self.raw("relax_steps", &preparation.relax_steps.to_string());
        self.number("damping", preparation.damping);
        self.number("strain", preparation.strain);
        self.quantity("speed", preparation.speed, "m/s");
        self.quantity("settle", preparation.settle, "s");
        if let Some(state) = &preparation.state {
            self.path("state", state);
        }
        self.raw("cache", &preparation.cache.to_string());
    }

    pub(super) fn ripples(&mut self, case: &Case) {
        let Some(ripples) = &case.ripples else { return };
        self.table("ripples");
        self.quantity("grain_size", ripples.grain_size, "m");
        self.quantity("layer_thickness", ripples.layer_thickness, "m");
        self.word("layers", ripples.layers);
        self.quantity("layer_length", ripples.layer_range[1] - ripples.layer_range[0], "m");
        self.quantity("margin", ripples.margin, "m");
        self.word("image_side", ripples.image_side);
        self.quantity("colour_speed", ripples.colour_speed, "m/s");
        self.number("colour_force", ripples.colour_force);
        for measured in &ripples.measured {
            self.element("ripples.measured");
            self.quantity("time", measured.time, "s");
            if let Some(file) = &measured.bed {
                self.path("bed", file);
            }
            if let Some(file) = &measured.water {
                self.path("water", file);
            }
        }
    }
}
