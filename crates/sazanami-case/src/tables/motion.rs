//! `[frame.motion]`: displacement of the tank.

use std::f64::consts::TAU;
use std::path::PathBuf;

use sazanami_case_derive::Keys;
use sazanami_io::readings::Readings;
use sazanami_numerics::spline::Spline;
use sazanami_numerics::{Real, Vector, choices};

use super::Direction;
use crate::read::{Context, Table};
use crate::units::rounded;

choices! {
    /// Frame of reference of the motion of a tank.
    pub enum WallMotion {
        /// From the tank: its walls are at rest, and the fluid feels the acceleration.
        AtRest = "at_rest",
        /// From the laboratory, for `solver = "mps"`: the walls move, and grains of prescribed motion have theirs against the laboratory.
        Moving = "moving",
    }
}

/// Displacement of the box, by formula or from a file.
#[derive(Clone, Debug, Keys)]
#[keys(check = Self::check)]
pub(super) struct MotionKeys {
    /// Amplitude A of the displacement `A r(t) sin(2 pi f t + phase)`; it may be negative.
    #[key(unit = "m")]
    amplitude: Option<Vector>,
    /// Frequency f.
    #[key(unit = "Hz", range = Positive)]
    frequency: Option<Real>,
    /// Phase.
    #[key(unit = "rad")]
    phase: Option<Real>,
    /// Rise from rest, `r = 3 s^2 - 2 s^3` with `s = t/ramp`. Without it water and grains begin with the speed they
    /// have against the box; velocities that are given are then those against the laboratory, grains that are held move with the box.
    #[key(unit = "s", range = NonNegative, says = "one period",
          paper_literal = (Tazaki, 0.0, "Tazaki et al. give the motion without a rise"))]
    ramp: Option<Real>,
    /// A table `t_s,x_m` instead of the formula, joined by a cubic spline: level at an end at which the record is at rest, without
    /// acceleration at one at which it moves. Where it moves at the start water and grains begin as without `ramp`. Steps and cycles go by
    /// the strongest harmonic of the whole record.
    file: Option<PathBuf>,
    /// Direction of the motion in that file.
    #[key(word, default = Direction::X1, omit_if = self.file.is_none())]
    axis: Direction,
    /// Frame of positions: that of the box, or of the laboratory, in which the walls move.
    #[key(word, default = WallMotion::AtRest)]
    pub(super) walls: WallMotion,
    #[key(skip = None)]
    curve: Option<Spline>,
}

impl MotionKeys {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        let formula = self.amplitude.is_some() || self.frequency.is_some();
        if formula == self.file.is_some() {
            cx.report
                .error(table.span(), "a motion is given by a formula or by a file")
                .label(if formula { "this has both" } else { "this has neither" })
                .help("give `amplitude = [\"-10 mm\", \"0 mm\", \"0 mm\"]` and `frequency = \"2 Hz\"`, or `file`");
            return;
        }
        let strangers: &[&str] = if formula { &["axis"] } else { &["ramp", "phase"] };
        for key in strangers.iter().filter(|key| table.has(key)) {
            let (of, help) = match formula {
                true => ("a motion by a formula", "`amplitude` has the direction of the motion"),
                false => ("a motion from a file", "the file has the motion as it is: begin it at rest"),
            };
            cx.report.error(table.place(key), format!("{of} has no `{key}`")).label("it would do nothing").help(help);
        }
        if formula {
            if self.frequency.is_none() {
                cx.missing(Some(table.span()), "frequency", "add `frequency = \"2 Hz\"`");
            }
            if self.amplitude.is_none() {
                let help = "add `amplitude = [\"0.52 mm\", \"0.52 mm\", \"0.52 mm\"]`";
                cx.missing(Some(table.span()), "amplitude", help);
            }
            return;
        }
        let Some(file) = &self.file else { return };
        match Readings::read(file, &["t_s", "x_m"], 2) {
            Ok(readings) => self.curve = Spline::through(readings.column(0), readings.column(1)),
            Err(problem) => {
                cx.report
                    .error(table.place("file"), "the motion of the tank cannot be read")
                    .label(problem.to_string())
                    .help("a CSV file with a line `t_s,x_m` and a row of numbers for each time, times increasing");
            }
        }
        if let Some(begin) = self.curve.as_ref().map(|curve| curve.range()[0]).filter(|begin| *begin > 0.0) {
            cx.report
                .error(table.place("file"), "the motion of the tank begins after the run")
                .label(format!("its first time is {} s", rounded(begin)))
                .help("add a row at time 0");
        }
    }

    pub(super) fn meaning(self, until: Real) -> Option<Motion> {
        if let Some(file) = self.file {
            return Some(Motion::recorded(file, self.axis, self.curve?, until));
        }
        let frequency = self.frequency?;
        Some(Motion::Formula {
            amplitude: self.amplitude?,
            frequency,
            phase: self.phase.unwrap_or(0.0),
            ramp: self.ramp.unwrap_or(1.0 / frequency),
        })
    }

    pub(super) fn of(motion: &Motion, walls: WallMotion) -> Self {
        let nothing = Self {
            amplitude: None,
            frequency: None,
            phase: None,
            ramp: None,
            file: None,
            axis: Direction::X1,
            walls,
            curve: None,
        };
        match motion {
            Motion::Formula { amplitude, frequency, phase, ramp } => Self {
                amplitude: Some(*amplitude),
                frequency: Some(*frequency),
                phase: Some(*phase),
                ramp: Some(*ramp),
                ..nothing
            },
            Motion::File { file, axis, .. } => Self { file: Some(file.clone()), axis: *axis, ..nothing },
        }
    }
}

/// The largest value of a motion within the run, and its time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peak {
    /// Largest magnitude, in SI units.
    pub value: Real,
    /// Its time \[s].
    pub time: Real,
}

/// Most times at which a motion is looked at for its harmonics, or for its peaks as it rises.
const MOST_SAMPLES: usize = 8192;
/// Times in the rise of a formula, and in each period of it, at which its peaks are looked for.
const SAMPLES_OF_RISE: Real = 64.0;

/// A motion of the tank, counted from where it is at the start.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// `A r(t) sin(2 pi f t + phase)`, `r = 3 s^2 - 2 s^3`, `s = min(1, t/ramp)`.
    Formula {
        /// Amplitude \[m].
        amplitude: Vector,
        /// Frequency \[Hz].
        frequency: Real,
        /// Phase \[rad].
        phase: Real,
        /// Time of the rise \[s].
        ramp: Real,
    },
    /// Positions along a direction, joined by cubic pieces with continuous acceleration.
    File {
        /// File of the positions.
        file: PathBuf,
        /// Direction.
        axis: Direction,
        /// The curve through them.
        curve: Spline,
        /// Amplitude \[m] and frequency \[Hz] of its strongest harmonic within the run, if it moves.
        harmonic: Option<(Vector, Real)>,
        /// Frequency \[Hz] of the strongest harmonic of the whole record, however long the run, if it moves.
        frequency: Option<Real>,
        /// Largest speed [m/s] and acceleration [m/s^2] within the run.
        peaks: [Peak; 2],
    },
}

impl Motion {
    /// Displacement from the start \[m], velocity [m/s] and acceleration [m/s^2] at `time` \[s].
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
                let along = axis.vector();
                let [x, v, a] = curve.at(time);
                let start = curve.at(0.0)[0];
                [along * (x - start), along * v, along * a]
            }
        }
    }

    /// Mean acceleration from one time to another \[s], by the velocities then; at it if they are the same [m/s^2].
    #[must_use]
    pub fn mean_acceleration(&self, [from, to]: [Real; 2]) -> Vector {
        if to > from { (self.at(to)[1] - self.at(from)[1]) / (to - from) } else { self.at(from)[2] }
    }

    /// The motion along a curve of positions, in a run until `until` \[s].
    #[must_use]
    pub fn recorded(file: PathBuf, axis: Direction, curve: Spline, until: Real) -> Self {
        let harmonic = strongest(&curve, until).map(|(amplitude, frequency)| (axis.vector() * amplitude, frequency));
        let is_whole = until >= curve.range()[1];
        let frequency = if is_whole {
            harmonic.map(|(_, frequency)| frequency)
        } else {
            strongest(&curve, Real::INFINITY).map(|(_, frequency)| frequency)
        };
        let peaks = [1, 2].map(|derivative| peak(&curve, until, derivative));
        Self::File { file, axis, curve, harmonic, frequency, peaks }
    }

    /// Amplitude \[m] and frequency \[Hz] of its strongest harmonic within the run; `None` without motion.
    #[must_use]
    pub fn harmonic(&self) -> Option<(Vector, Real)> {
        match self {
            Self::Formula { amplitude, frequency, .. } => {
                (*amplitude != Vector::ZERO).then_some((*amplitude, *frequency))
            }
            Self::File { harmonic, .. } => *harmonic,
        }
    }

    /// Largest speed [m/s] and acceleration [m/s^2] of a record within the run, or of a formula as it rises in a run until `until` \[s]:
    /// later it has those of its harmonic.
    #[must_use]
    pub fn peaks(&self, until: Real) -> [Peak; 2] {
        match self {
            Self::Formula { frequency, ramp, .. } => {
                let end = ramp.min(until).max(0.0);
                let samples = (SAMPLES_OF_RISE * (1.0 + frequency * end)).min(MOST_SAMPLES as Real).ceil() as usize;
                let times = (0..=samples).map(|n| end * n as Real / samples as Real);
                [1, 2].map(|derivative| {
                    largest(times.clone().map(|time| Peak { value: self.at(time)[derivative].length(), time }))
                })
            }
            Self::File { peaks, .. } => *peaks,
        }
    }

    /// Frequency of the motion \[Hz], if it has one: that of a record is that of its strongest harmonic, the same in a run that is lengthened.
    #[must_use]
    pub fn frequency(&self) -> Option<Real> {
        match self {
            Self::Formula { amplitude, frequency, .. } => (*amplitude != Vector::ZERO).then_some(*frequency),
            Self::File { frequency, .. } => *frequency,
        }
    }
}

/// Largest magnitude of a derivative of a curve until `until` \[s]. The second has it at a point, and the first there or where
/// the second, which is straight between points, is zero.
fn peak(curve: &Spline, until: Real, derivative: usize) -> Peak {
    let [start, end] = curve.range();
    let (start, end) = (start.max(0.0), end.min(until));
    let points = || std::iter::once(start).chain(curve.abscissae_within([start, end]).iter().copied()).chain([end]);
    let between = points().zip(points().skip(1)).map(|(a, b)| {
        let [first, second] = [a, b].map(|x| curve.at(x)[2]);
        if first * second < 0.0 { a + (b - a) * first / (first - second) } else { a }
    });
    largest(points().chain(between).map(|time| Peak { value: curve.at(time)[derivative].abs(), time }))
}

fn largest(values: impl Iterator<Item = Peak>) -> Peak {
    values.fold(Peak::default(), |most, peak| if peak.value > most.value { peak } else { most })
}

/// Fewest cycles of a harmonic in the time that is looked at: of less than that neither its length nor its size is known.
const FEWEST_CYCLES: Real = 0.75;
/// Least part of the squares of the speeds that a harmonic has.
const LEAST_SHARE: Real = 0.01;

/// Amplitude \[m] and frequency \[Hz] of the strongest harmonic of a curve until `until` \[s]; `None` without motion, and without a cycle in it.
///
/// The sinusoid beside a constant speed that is nearest to the speeds by weighted least squares (Lomb 1976, generalised by Zechmeister and
/// Kurster 2009, doi:10.1051/0004-6361:200811296): exact for a sinusoid of any number of cycles, where a transform mixes it with its
/// mirror image and with the mean. The weights, Hann's window, keep harmonics apart.
fn strongest(curve: &Spline, until: Real) -> Option<(Real, Real)> {
    let [start, end] = curve.range();
    let (start, span) = (start.max(0.0), end.min(until) - start.max(0.0));
    if span <= 0.0 {
        return None;
    }
    // Twice as many samples as there are points in that time, so that none of its harmonics is taken for another.
    let samples = (2 * curve.abscissae_within([start, start + span]).len()).clamp(256, MOST_SAMPLES);
    let place = |n: usize| (n as Real + 0.5) / samples as Real;
    // Weights with a sum of one.
    let weights: Vec<Real> = (0..samples).map(|n| (1.0 - (TAU * place(n)).cos()) / samples as Real).collect();
    let mut speeds: Vec<Real> = (0..samples).map(|n| curve.at(start + span * place(n))[1]).collect();
    let mean: Real = weights.iter().zip(&speeds).map(|(weight, speed)| weight * speed).sum();
    speeds.iter_mut().for_each(|speed| *speed -= mean);
    let fit = |cycles: Real| nearest_sinusoid(&weights, &speeds, cycles);
    let next = |cycles: &Real| Some(cycles + if *cycles < 8.0 { 0.25 } else { 0.5 });
    let most = 0.5 * samples as Real - 1.0;
    let tried: Vec<[Real; 2]> = std::iter::successors(Some(FEWEST_CYCLES), next)
        .take_while(|cycles| *cycles < most)
        .map(|cycles| [cycles, fit(cycles)[0]])
        .collect();
    // At the end of what is tried there is no cycle but a trend.
    let peaks = tried.windows(3).filter(|three| three[1][1] >= three[0][1] && three[1][1] > three[2][1]);
    let nearest = peaks.map(|three| three[1]).max_by(|a, b| a[1].total_cmp(&b[1]))?[0];
    let cycles = highest(|cycles| fit(cycles)[0], [(nearest - 0.5).max(FEWEST_CYCLES), nearest + 0.5]);
    let [share, speed] = fit(cycles);
    let frequency = cycles / span;
    let all: Real = weights.iter().zip(&speeds).map(|(weight, speed)| weight * speed * speed).sum();
    // What is left of an even motion is round-off, and a push has a spectrum without a cycle in it.
    let fastest = speeds.iter().fold(mean.abs(), |most, speed| most.max(speed.abs()));
    (speed > 1e-9 * fastest && share > LEAST_SHARE * all).then(|| (speed / (TAU * frequency), frequency))
}

/// What part of the weighted squares of `speeds`, evenly spaced and without a mean, the nearest sinusoid of so many cycles beside a constant
/// takes up [m^2/s^2], and its amplitude [m/s]. The weights have a sum of one.
fn nearest_sinusoid(weights: &[Real], speeds: &[Real], cycles: Real) -> [Real; 2] {
    // The angle of the next sample by the addition theorems.
    let turn = TAU * cycles / weights.len() as Real;
    let (turn_sine, turn_cosine) = turn.sin_cos();
    let (mut s, mut c) = (0.5 * turn).sin_cos();
    let ([mut mean_c, mut mean_s], [mut cc, mut cs, mut ss], [mut vc, mut vs]) = ([0.0; 2], [0.0; 3], [0.0; 2]);
    for (weight, speed) in weights.iter().zip(speeds) {
        let [wc, ws] = [weight * c, weight * s];
        (mean_c, mean_s) = (mean_c + wc, mean_s + ws);
        (cc, cs, ss) = (cc + wc * c, cs + wc * s, ss + ws * s);
        (vc, vs) = (vc + wc * speed, vs + ws * speed);
        (s, c) = (s * turn_cosine + c * turn_sine, c * turn_cosine - s * turn_sine);
    }
    let [cc, cs, ss] = [cc - mean_c * mean_c, cs - mean_c * mean_s, ss - mean_s * mean_s];
    let determinant = cc * ss - cs * cs;
    let [a, b] = [(ss * vc - cs * vs) / determinant, (cc * vs - cs * vc) / determinant];
    [a * vc + b * vs, a.hypot(b)]
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

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

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
    fn the_peaks_of_a_record_are_those_of_its_curve() {
        let t: Vec<Real> = (0..=400).map(|n| 0.005 * n as Real).collect();
        let x: Vec<Real> = t.iter().map(|t| 0.01 * (TAU * 2.0 * t).sin()).collect();
        let recorded = |x: &[Real], until| {
            Motion::recorded(PathBuf::new(), Direction::X1, Spline::through(&t, x).unwrap(), until).peaks(until)
        };
        let w = TAU * 2.0;
        let [speed, acceleration] = recorded(&x, 2.0);
        assert!((speed.value / (0.01 * w) - 1.0).abs() < 1e-3, "{speed:?}");
        assert!((acceleration.value / (0.01 * w * w) - 1.0).abs() < 1e-2, "{acceleration:?}");
        // One reading 1 mm off: a peak of about 6 d/h^2, which a run that ends before it does not see.
        let mut off = x.clone();
        off[300] += 1e-3;
        let [_, peak] = recorded(&off, 2.0);
        assert!(peak.value > 100.0 && (peak.time - 1.5).abs() < 1e-9, "{peak:?}");
        assert!(recorded(&off, 1.0)[1].value < 1.1 * 0.01 * w * w);
    }

    #[test]
    fn the_peaks_of_a_formula_are_those_of_its_rise() {
        let motion = |ramp: Real| Motion::Formula { amplitude: Vector::X, frequency: 2.0, phase: FRAC_PI_2, ramp };
        // From rest at the far end: 6 A/ramp^2 as it begins.
        let [speed, acceleration] = motion(1e-3).peaks(1.0);
        assert!((acceleration.value / 6e6 - 1.0).abs() < 1e-3 && acceleration.time == 0.0, "{acceleration:?}");
        assert!((speed.value / 1.5e3 - 1.0).abs() < 1e-2, "{speed:?}");
        // Negative controls: a long rise has no more than the harmonic, and a run may end before the peak.
        let [_, acceleration] = motion(100.0).peaks(200.0);
        assert!((acceleration.value / (2.0 * TAU).powi(2) - 1.0).abs() < 1e-2, "{acceleration:?}");
        assert!(motion(100.0).peaks(10.0)[1].value < 0.1 * (2.0 * TAU).powi(2));
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
        let (amplitude, frequency) = motion(Direction::X2, curve, 7.0).harmonic().unwrap();
        assert!((frequency - 2.0).abs() < 0.02, "{frequency}");
        assert!((amplitude - Vector::new(0.0, 0.01, 0.0)).length() < 3e-4, "{amplitude}");
        // A long record of which the run sees the beginning, and one of 600 cycles.
        let t: Vec<Real> = (0..=12_000).map(|n| 0.025 * n as Real).collect();
        let record = |at: &dyn Fn(Real) -> Real, until| {
            let x: Vec<Real> = t.iter().map(|&t| at(t)).collect();
            motion(Direction::X1, Spline::through(&t, &x).unwrap(), until)
        };
        let soon_still = record(&|t| if t < 5.0 { 0.01 * (TAU * 2.0 * t).sin() } else { 0.0 }, 5.0);
        let (amplitude, frequency) = soon_still.harmonic().unwrap();
        assert!((frequency - 2.0).abs() < 0.02 && (amplitude.x - 0.01).abs() < 3e-4, "{frequency} {amplitude}");
        let (_, frequency) = record(&|t| 0.01 * (TAU * 2.0 * t).sin(), 300.0).harmonic().unwrap();
        assert!((frequency - 2.0).abs() < 0.01, "{frequency}");
        let still = Spline::through(&[0.0, 1.0], &[0.3, 0.3]).unwrap();
        assert_eq!(motion(Direction::X1, still, 1.0).harmonic(), None);
        let even = Spline::through(&[0.0, 0.5, 1.0], &[0.3, 0.35, 0.4]).unwrap();
        assert_eq!(motion(Direction::X1, even, 1.0).harmonic(), None);
        // Beside a strong trend, and a push without a cycle in it.
        let t: Vec<Real> = (0..=1000).map(|n| 1e-3 * n as Real).collect();
        let one = |at: &dyn Fn(Real) -> Real| {
            let x: Vec<Real> = t.iter().map(|&t| at(t)).collect();
            motion(Direction::X1, Spline::through(&t, &x).unwrap(), 1.0).harmonic()
        };
        let (amplitude, frequency) = one(&|t| 2.5 * t * t - (TAU * 10.0 * t).cos() / (TAU * 10.0)).unwrap();
        assert!(
            (frequency - 10.0).abs() < 0.1 && (amplitude.x * TAU * 10.0 - 1.0).abs() < 0.1,
            "{frequency} {amplitude}"
        );
        assert_eq!(one(&|t| -(PI * t).cos()), None);
    }

    #[test]
    fn few_cycles_of_a_record_have_their_frequency_and_amplitude() {
        let record = |cycles: Real, phase: Real, until: Real| {
            let t: Vec<Real> = (0..=400).map(|n| 0.2 * cycles * n as Real / 400.0).collect();
            let x: Vec<Real> = t.iter().map(|t| 0.002 * (TAU * 5.0 * t + phase).sin()).collect();
            Motion::recorded(PathBuf::new(), Direction::X2, Spline::through(&t, &x).unwrap(), until)
        };
        for (cycles, quarter) in [1.0, 1.5, 2.0, 3.0].into_iter().flat_map(|cycles| (0..4).map(move |q| (cycles, q))) {
            let motion = record(cycles, FRAC_PI_2 * f64::from(quarter), 10.0);
            let (amplitude, frequency) = motion.harmonic().unwrap();
            assert!((frequency / 5.0 - 1.0).abs() < 0.01, "{cycles} cycles, {quarter} quarters: {frequency}");
            assert!((amplitude.y / 0.002 - 1.0).abs() < 0.01, "{cycles} cycles, {quarter} quarters: {amplitude}");
        }
        // A half of a cycle tells neither, and the frequency is that of the whole record however long the run.
        assert_eq!(record(0.5, 0.3, 10.0).harmonic(), None);
        let short = record(4.0, 0.3, 0.1);
        assert_eq!((short.harmonic(), short.frequency()), (None, record(4.0, 0.3, 0.8).frequency()));
        assert!((short.frequency().unwrap() / 5.0 - 1.0).abs() < 0.01);
    }
}
