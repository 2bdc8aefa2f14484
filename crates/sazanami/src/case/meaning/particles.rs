//! Water as moving particles, the shaking of its tank, and ripples.

use std::f64::consts::TAU;
use std::path::PathBuf;

use sazanami_numerics::spline::Spline;
use sazanami_numerics::{Real, Vector};

use crate::case::written::choices;

choices! {
    /// Family of the weight function (Wendland 1995).
    Wendland {
        /// `(1-q)^4 (1+4q)`.
        C2 = "c2",
        /// `(1-q)^6 (1+6q+35q^2/3)`.
        C4 = "c4",
    }

    /// A form of higher order or the classical one.
    Order {
        /// HS or HL.
        HigherOrder = "higher_order",
        /// As Koshizuka and Oka (1996).
        Classical = "classical",
    }

    /// Gradient of the pressure.
    GradientForm {
        /// GC: exact for linear fields.
        Corrected = "corrected",
        /// Exact on a lattice only.
        Classical = "classical",
    }

    /// Dynamic stabilisation.
    KeepApart {
        /// Pairs count with their weight.
        Weighted = "weighted",
        /// Pairs count fully.
        Full = "full",
        /// None.
        Off = "off",
    }

    /// Pressure that grains feel.
    PressureForce {
        /// That of the same step: stable for light grains too.
        Implicit = "implicit",
        /// That of the step before.
        Lagged = "lagged",
    }

    /// Drag coefficient of a single sphere.
    SphereDrag {
        /// `24/Re (1 + 0.15 Re^0.687)` up to Re = 1000, then 0.44.
        SchillerNaumann = "schiller_naumann",
        /// `(0.63 + 4.8/sqrt(Re))^2`.
        DallaValle = "dalla_valle",
    }

    /// What the solid number density is counted from.
    DensityReference {
        /// Touching spheres on a simple cubic lattice.
        SimpleCubic = "simple_cubic",
        /// Close-packed spheres, 0.64.
        ClosePacked = "close_packed",
        /// Solid alone.
        Solid = "solid",
    }

    /// Where the motion of a tank is seen from.
    WallMotion {
        /// From the tank: its walls are at rest, and the fluid feels the acceleration.
        AtRest = "at_rest",
        /// From the laboratory: the walls move.
        Moving = "moving",
    }

    /// A direction.
    Axis {
        /// Along x1.
        X1 = "x1",
        /// Along x2.
        X2 = "x2",
        /// Along x3.
        X3 = "x3",
    }

    /// Where layers of a bed are counted from.
    LayerReference {
        /// From the floor, where grains and water are now.
        Floor = "floor",
        /// From the surface of the bed, where grains and water are now.
        Surface = "surface",
        /// From the floor, where each grain lay at the start.
        Initial = "initial",
    }

    /// Side of the tank that photographs are taken from.
    ImageSide {
        /// Side of smallest x2.
        Lower = "x2_lower",
        /// Side of largest x2.
        Upper = "x2_upper",
    }

    /// Frame that positions and velocities are written in.
    OutputFrame {
        /// That of the tank.
        Tank = "tank",
        /// That of the laboratory.
        Laboratory = "laboratory",
    }
}

/// Water as moving particles: scheme, coupling and what comes before the run.
#[derive(Clone, Debug, PartialEq)]
pub struct Particles {
    /// Particle spacing l0 [m].
    pub spacing: Real,
    /// Radius of influence over the spacing.
    pub radius: Real,
    /// Family of the weight function.
    pub weight: Wendland,
    /// HS or classical.
    pub source: Order,
    /// HL or classical.
    pub laplacian: Order,
    /// Factor of ECS.
    pub compensation: Real,
    /// Times of the flow over which an error of the number density relaxes; 0: it does not.
    pub relaxation: Real,
    /// GC or classical.
    pub gradient: GradientForm,
    /// DS.
    pub stabilisation: KeepApart,
    /// Distance below which DS acts, over the particle size.
    pub stabilisation_distance: Real,
    /// Part of (r_e/2)^2 by which particles are shifted in a time of the flow; 0: they are not.
    pub shifting: Real,
    /// Whether the pressure is solved for without its part at rest.
    pub reduced_pressure: bool,
    /// Way of the fastest particle in a step over its size.
    pub courant: Real,
    /// Fixed step [s].
    pub dt: Option<Real>,
    /// Longest step [s].
    pub dt_max: Real,
    /// Largest residual as a volume strain in a step.
    pub tolerance: Real,
    /// Most iterations.
    pub pressure_iterations: usize,
    /// Coupling with grains.
    pub overlap: Overlap,
    /// What comes before the run.
    pub preparation: Preparation,
}

/// Coupling of overlapping particles and grains.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlap {
    /// Radius over which the void fraction is smoothed [m].
    pub smoothing: Real,
    /// Least void fraction.
    pub least_void: Real,
    /// Pressure that grains feel.
    pub pressure_force: PressureForce,
    /// Kozeny's constant.
    pub kozeny: Real,
    /// Constant F_ch; Ergun's where there is none.
    pub forchheimer: Option<Real>,
    /// Drag of a single sphere.
    pub sphere_drag: SphereDrag,
    /// What the solid number density is counted from.
    pub density_reference: DensityReference,
    /// Solid number densities between which the law goes over from single grains to a bed.
    pub blend: [Real; 2],
}

/// How a bed in water is made ready.
#[derive(Clone, Debug, PartialEq)]
pub struct Preparation {
    /// Most steps in which the water comes to rest between grains that are held.
    pub relax_steps: usize,
    /// What a step leaves of the velocity meanwhile.
    pub damping: Real,
    /// Root mean square of the volume strain of water at rest.
    pub strain: Real,
    /// Largest speed of water at rest [m/s].
    pub speed: Real,
    /// Time for which the grains are free in water at rest [s].
    pub settle: Real,
    /// A state made ready before.
    pub state: Option<PathBuf>,
    /// Whether the state is kept for later runs.
    pub cache: bool,
}

impl Preparation {
    /// Whether anything is done before the run.
    #[must_use]
    pub fn is_needed(&self) -> bool {
        self.relax_steps > 0 || self.settle > 0.0
    }
}

/// Most times at which a motion from a file is looked at for its harmonics.
const MOST_SAMPLES: usize = 8192;

impl Axis {
    fn direction(self) -> Vector {
        [Vector::X, Vector::Y, Vector::Z][self as usize]
    }
}

/// A motion of the tank, counted from where it is at the start.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// `A r(t) sin(2 pi f t + phase)`, `r = 3 s^2 - 2 s^3`, `s = min(1, t/ramp)`.
    Formula {
        /// Amplitude [m].
        amplitude: Vector,
        /// Frequency [Hz].
        frequency: Real,
        /// Phase [rad].
        phase: Real,
        /// Time of the rise [s].
        ramp: Real,
    },
    /// Positions along a direction, joined by cubic pieces with continuous acceleration.
    File {
        /// Where they come from.
        file: PathBuf,
        /// Direction.
        axis: Axis,
        /// The curve through them.
        curve: Spline,
        /// Amplitude [m] and frequency [Hz] of its strongest harmonic within the run, if it moves.
        harmonic: Option<(Vector, Real)>,
    },
}

impl Motion {
    /// Displacement from the start [m], velocity [m/s] and acceleration [m/s^2] at `time` [s].
    #[must_use]
    pub fn at(&self, time: Real) -> [Vector; 3] {
        match self {
            Self::Formula { amplitude, frequency, phase, ramp } => {
                let w = TAU * frequency;
                let (sin, cos) = (w * time + phase).sin_cos();
                let s = if *ramp > 0.0 { (time / ramp).min(1.0) } else { 1.0 };
                let [r, r1, r2] = if s < 1.0 {
                    [s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / ramp, (6.0 - 12.0 * s) / (ramp * ramp)]
                } else {
                    [1.0, 0.0, 0.0]
                };
                let start = if *ramp > 0.0 { 0.0 } else { phase.sin() };
                [
                    *amplitude * (r * sin - start),
                    *amplitude * (r1 * sin + r * w * cos),
                    *amplitude * (r2 * sin + 2.0 * w * r1 * cos - w * w * r * sin),
                ]
            }
            Self::File { axis, curve, .. } => {
                let along = axis.direction();
                let [x, v, a] = curve.at(time);
                let start = curve.at(0.0)[0];
                [along * (x - start), along * v, along * a]
            }
        }
    }

    /// The motion along a curve of positions, in a run until `until` [s].
    #[must_use]
    pub fn recorded(file: PathBuf, axis: Axis, curve: Spline, until: Real) -> Self {
        let harmonic = strongest(&curve, until).map(|(amplitude, frequency)| (axis.direction() * amplitude, frequency));
        Self::File { file, axis, curve, harmonic }
    }

    /// Amplitude [m] and frequency [Hz] of its strongest harmonic within the run; `None` without motion.
    #[must_use]
    pub fn harmonic(&self) -> Option<(Vector, Real)> {
        match self {
            Self::Formula { amplitude, frequency, .. } => {
                (*amplitude != Vector::ZERO).then_some((*amplitude, *frequency))
            }
            Self::File { harmonic, .. } => *harmonic,
        }
    }

    /// Period of the motion [s], if it has one: that of a record is that of its strongest harmonic.
    #[must_use]
    pub fn period(&self) -> Option<Real> {
        match self {
            Self::Formula { frequency, .. } => Some(1.0 / frequency),
            Self::File { .. } => self.harmonic().map(|(_, frequency)| frequency.recip()),
        }
    }
}

/// Amplitude [m] and frequency [Hz] of the strongest harmonic of a curve until `until` [s]; `None` without motion.
fn strongest(curve: &Spline, until: Real) -> Option<(Real, Real)> {
    // The velocity has no trend to speak of; Hann's window keeps harmonics apart.
    let [start, end] = curve.range();
    let (start, span) = (start.max(0.0), end.min(until) - start.max(0.0));
    if span <= 0.0 {
        return None;
    }
    // Twice as many samples as there are points in that time, so that none of its harmonics is taken for another.
    let samples = (2 * curve.points_within([start, start + span])).clamp(256, MOST_SAMPLES);
    let place = |n: usize| (n as Real + 0.5) / samples as Real;
    let window = |n: usize| 1.0 - (TAU * place(n)).cos();
    let speeds: Vec<Real> = (0..samples).map(|n| window(n) * curve.at(start + span * place(n))[1]).collect();
    let amplitude = |cycles: Real| {
        // The angle of the next sample by the addition theorems.
        let (turn_sine, turn_cosine) = (TAU * cycles / samples as Real).sin_cos();
        let (mut s, mut c) = (0.5 * TAU * cycles / samples as Real).sin_cos();
        let (mut cosine, mut sine) = (0.0, 0.0);
        for speed in &speeds {
            cosine += speed * c;
            sine += speed * s;
            (s, c) = (s * turn_cosine + c * turn_sine, c * turn_cosine - s * turn_sine);
        }
        2.0 * cosine.hypot(sine) / samples as Real
    };
    let tried = (2..samples).map(|n| 0.5 * n as Real);
    let (cycles, speed) = tried.map(|cycles| (cycles, amplitude(cycles))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let cycles = highest(amplitude, [cycles - 0.5, cycles + 0.5]);
    let frequency = cycles / span;
    (speed > 0.0).then(|| (speed / (TAU * frequency), frequency))
}

/// Place of the maximum of a function that has one between the ends, by golden section.
fn highest(value: impl Fn(Real) -> Real, [mut low, mut high]: [Real; 2]) -> Real {
    const PART: Real = 0.618_033_988_749_894_9;
    while high - low > 1e-4 {
        let [left, right] = [high - PART * (high - low), low + PART * (high - low)];
        if value(left) > value(right) { high = right } else { low = left }
    }
    0.5 * (low + high)
}

/// Force at the ends of the colours, over the submerged weight of a grain, where a case says nothing.
pub const COLOUR_FORCE: Real = 0.3;

/// Observation of ripples.
#[derive(Clone, Debug, PartialEq)]
pub struct Ripples {
    /// Grain size d [m].
    pub grain_size: Real,
    /// Thickness of the two layers [m].
    pub layer_thickness: Real,
    /// Where they are counted from.
    pub layers: LayerReference,
    /// Part of x1 that is averaged over [m].
    pub layer_range: [Real; 2],
    /// Distance from the end walls at which ripples are not measured [m].
    pub margin: Real,
    /// Side that photographs were taken from.
    pub image_side: ImageSide,
    /// Speed at the upper end of the colours [m/s].
    pub colour_speed: Real,
    /// Force at the ends of the colours, over the submerged weight of a grain.
    pub colour_force: Real,
    /// Profiles that were measured.
    pub measured: Vec<Measured>,
}

/// Measured profiles of a time.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Time [s].
    pub time: Real,
    /// Surface of the bed.
    pub bed: Option<PathBuf>,
    /// Surface of the water.
    pub water: Option<PathBuf>,
}

impl Measured {
    /// Times closer than this are the same [s].
    const SAME_TIME: Real = 1e-9;

    /// Whether it was measured at `time` [s].
    #[must_use]
    pub fn is_of(&self, time: Real) -> bool {
        (self.time - time).abs() < Self::SAME_TIME
    }

    /// Whether `other` is of the same time and of surfaces that this one lacks.
    #[must_use]
    pub fn can_take(&self, other: &Self) -> bool {
        let both = |a: &Option<PathBuf>, b: &Option<PathBuf>| a.is_some() && b.is_some();
        self.is_of(other.time) && !both(&self.bed, &other.bed) && !both(&self.water, &other.water)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_and_acceleration_are_the_derivatives_of_the_displacement() {
        let motion = Motion::Formula { amplitude: Vector::X, frequency: 2.0, phase: 0.3, ramp: 0.5 };
        let h = 1e-5;
        for time in [0.1, 0.3, 0.49, 0.7] {
            let [before, now, after] = [-h, 0.0, h].map(|shift| motion.at(time + shift));
            assert!((0.5 * (after[0] - before[0]) / h - now[1]).length() < 1e-6);
            assert!((0.5 * (after[1] - before[1]) / h - now[2]).length() < 1e-4);
        }
        assert_eq!(motion.at(0.0)[0], Vector::ZERO);
        assert_eq!(motion.at(0.0)[1], Vector::ZERO);
    }

    #[test]
    fn without_a_rise_the_motion_begins_at_its_speed() {
        let motion = Motion::Formula { amplitude: -0.01 * Vector::X, frequency: 2.0, phase: 0.0, ramp: 0.0 };
        let speed = -0.01 * 4.0 * std::f64::consts::PI;
        assert_eq!(motion.at(0.0)[0], Vector::ZERO);
        assert!((motion.at(0.0)[1].x - speed).abs() < 1e-12);
    }

    #[test]
    fn a_maximum_is_found_between_ends() {
        assert!((highest(|x| -(x - 3.3) * (x - 3.3), [3.0, 4.0]) - 3.3).abs() < 1e-4);
    }

    #[test]
    fn the_strongest_harmonic_of_a_record_is_found() {
        let t: Vec<Real> = (0..=700).map(|n| 0.01 * n as Real).collect();
        // A rise in half a second, a slow drift, and a third harmonic.
        let at =
            |t: Real| (t / 0.5).min(1.0) * (-0.01 * (TAU * 2.0 * t).sin() + 0.001 * (TAU * 6.0 * t).sin()) + 1e-3 * t;
        let x: Vec<Real> = t.iter().map(|&t| at(t)).collect();
        let curve = Spline::through(&t, &x).unwrap();
        let motion = |axis, curve, until| Motion::recorded(PathBuf::new(), axis, curve, until);
        let (amplitude, frequency) = motion(Axis::X2, curve, 7.0).harmonic().unwrap();
        assert!((frequency - 2.0).abs() < 0.02, "{frequency}");
        assert!((amplitude - Vector::new(0.0, 0.01, 0.0)).length() < 3e-4, "{amplitude}");
        // A long record of which the run sees the beginning, and one of 600 cycles.
        let t: Vec<Real> = (0..=12_000).map(|n| 0.025 * n as Real).collect();
        let record = |at: &dyn Fn(Real) -> Real, until| {
            let x: Vec<Real> = t.iter().map(|&t| at(t)).collect();
            motion(Axis::X1, Spline::through(&t, &x).unwrap(), until)
        };
        let soon_still = record(&|t| if t < 5.0 { 0.01 * (TAU * 2.0 * t).sin() } else { 0.0 }, 5.0);
        let (amplitude, frequency) = soon_still.harmonic().unwrap();
        assert!((frequency - 2.0).abs() < 0.02 && (amplitude.x - 0.01).abs() < 3e-4, "{frequency} {amplitude}");
        let (_, frequency) = record(&|t| 0.01 * (TAU * 2.0 * t).sin(), 300.0).harmonic().unwrap();
        assert!((frequency - 2.0).abs() < 0.01, "{frequency}");
        let still = Spline::through(&[0.0, 1.0], &[0.3, 0.3]).unwrap();
        assert_eq!(motion(Axis::X1, still, 1.0).harmonic(), None);
    }
}
