//! Several runs side by side: erosion volume against the momentum of the drop.

use sazanami_numerics::Real;

use crate::fit::line;

/// Drop and crater of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunResult {
    /// Name of the run.
    pub name: String,
    /// Momentum of the drop at the start [kg m/s].
    pub momentum: Real,
    /// Axis ratio of the drop, horizontal over vertical.
    pub axis_ratio: Real,
    /// Erosion volume [m^3].
    pub volume: Real,
    /// Its uncertainty [m^3].
    pub uncertainty: Real,
    /// Volume found before the impact [m^3].
    pub noise: Real,
    /// Volume below the plane of the rim [m^3].
    pub below_rim: Real,
    /// Its uncertainty [m^3].
    pub below_rim_uncertainty: Real,
    /// Depth of the crater below its rim \[m].
    pub depth: Real,
    /// Radius of the rim \[m].
    pub rim_radius: Real,
    /// Number of splashed grains.
    pub splashed: usize,
    /// Whether the rim lies in the outermost layer: the box is too small for the crater.
    pub rim_at_edge: bool,
    /// Relative change of the volume over the last tenth of the run; `None` if that is not known.
    pub late_change: Option<Real>,
}

/// A crater whose volume changes by less than this over the last tenth of its run has come to rest.
const AT_REST: Real = 0.05;

/// Why a run does not count for a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doubt {
    /// The volume is no larger than that of the same bed before the impact.
    BelowNoise,
    /// The rim lies at the edge of the box.
    RimAtEdge,
    /// The volume still changes at the end of the run, or nothing is known of that.
    NotAtRest,
}

impl Doubt {
    /// The reason in words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::BelowNoise => "V below its noise",
            Self::RimAtEdge => "rim at the edge",
            Self::NotAtRest => "V not at rest",
        }
    }
}

impl RunResult {
    /// Whether the volume stands clear of its noise floor.
    #[must_use]
    pub fn is_above_noise(&self) -> bool {
        self.volume > self.noise
    }

    /// Why the run does not count for a law, if it does not.
    #[must_use]
    pub fn doubt(&self) -> Option<Doubt> {
        if !self.is_above_noise() {
            Some(Doubt::BelowNoise)
        } else if self.rim_at_edge {
            Some(Doubt::RimAtEdge)
        } else if self.late_change.is_none_or(|change| change.abs() > AT_REST) {
            Some(Doubt::NotAtRest)
        } else {
            None
        }
    }
}

/// Relative spread of momenta below which they are one momentum, and no law goes through them.
const LEAST_SPREAD: Real = 0.02;

/// `volume = coefficient momentum^exponent`, fitted by least squares in logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// Fitted slope.
    pub exponent: Real,
    /// Standard error of the slope from the scatter of the points; `None` with two points.
    pub standard_error: Option<Real>,
    /// Volume at unit momentum.
    pub coefficient: Real,
    /// Number of points used.
    pub points: usize,
}

impl PowerLaw {
    /// Fits `(x, y)` points; those that are not positive are left out. `None` where all `x` are the same to 2 %.
    #[must_use]
    pub fn fit(points: impl IntoIterator<Item = (Real, Real)>) -> Option<Self> {
        let logs: Vec<(Real, Real)> =
            points.into_iter().filter(|&(x, y)| x > 0.0 && y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
        let line = line(&logs)?;
        if line.spread < line.points as Real * LEAST_SPREAD * LEAST_SPREAD {
            return None;
        }
        Some(Self {
            exponent: line.slope,
            standard_error: line.standard_error,
            coefficient: line.intercept.exp(),
            points: line.points,
        })
    }

    /// Value of the law.
    #[must_use]
    pub fn at(&self, x: Real) -> Real {
        self.coefficient * x.powf(self.exponent)
    }
}

/// Runs with one drop shape, and the law through them.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Axis ratio of the drop.
    pub axis_ratio: Real,
    /// Its runs by momentum.
    pub runs: Vec<RunResult>,
    /// Volume against momentum, from the runs without a [`Doubt`].
    pub law: Option<PowerLaw>,
}

/// Several runs, sorted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// One series per drop shape, by axis ratio.
    pub series: Vec<Series>,
}

/// Mean and scatter of repeated runs, as over several bed seeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// Momentum of the drop [kg m/s].
    pub momentum: Real,
    /// Mean volume [m^3].
    pub mean: Real,
    /// Standard deviation of a single run [m^3].
    pub deviation: Real,
    /// Both of the volume below the plane of the rim [m^3].
    pub below_rim: [Real; 2],
    /// Number of runs.
    pub runs: usize,
}

impl Comparison {
    /// Sorts runs by drop shape (ratios within 2 % are one) and momentum, and fits each series.
    #[must_use]
    pub fn of(mut runs: Vec<RunResult>) -> Self {
        runs.sort_by(|a, b| a.axis_ratio.total_cmp(&b.axis_ratio).then_with(|| a.name.cmp(&b.name)));
        let mut series: Vec<Series> = Vec::new();
        for run in runs {
            match series.last_mut() {
                Some(last) if run.axis_ratio < 1.02 * last.axis_ratio => last.runs.push(run),
                _ => series.push(Series { axis_ratio: run.axis_ratio, runs: vec![run], law: None }),
            }
        }
        for series in &mut series {
            series.runs.sort_by(|a, b| a.momentum.total_cmp(&b.momentum).then_with(|| a.name.cmp(&b.name)));
            let clear = series.runs.iter().filter(|run| run.doubt().is_none());
            series.law = PowerLaw::fit(clear.map(|run| (run.momentum, run.volume)));
        }
        Self { series }
    }

    /// Columns of the comparison: name with unit, and the text of a run in it.
    pub const COLUMNS: [(&'static str, RunText); 12] = [
        ("run", |run| run.name.clone()),
        ("axis_ratio", |run| format!("{:.3}", run.axis_ratio)),
        ("momentum_g_cm_s", |run| format!("{:.3}", run.momentum * 1e5)),
        ("volume_below_rim_mm3", |run| format!("{:.3}", run.below_rim * 1e9)),
        ("below_rim_uncertainty_mm3", |run| format!("{:.3}", run.below_rim_uncertainty * 1e9)),
        ("volume_mm3", |run| format!("{:.3}", run.volume * 1e9)),
        ("uncertainty_mm3", |run| format!("{:.3}", run.uncertainty * 1e9)),
        ("noise_mm3", |run| format!("{:.3}", run.noise * 1e9)),
        ("depth_mm", |run| format!("{:.4}", run.depth * 1e3)),
        ("rim_radius_mm", |run| format!("{:.4}", run.rim_radius * 1e3)),
        ("splashed_grains", |run| run.splashed.to_string()),
        ("in_law", |run| run.doubt().map_or_else(|| "yes".to_owned(), |doubt| format!("no: {}", doubt.words()))),
    ];

    /// One row of text per run, in the columns of [`Self::COLUMNS`].
    #[must_use]
    pub fn rows(&self) -> Vec<[String; 12]> {
        let runs = self.series.iter().flat_map(|series| &series.runs);
        runs.map(|run| Self::COLUMNS.map(|(_, text)| text(run))).collect()
    }
}

/// Text of a run in a column.
pub type RunText = fn(&RunResult) -> String;

impl Series {
    /// Mean and scatter of runs whose momenta agree within 1 %; only groups of two or more.
    #[must_use]
    pub fn scatter(&self) -> Vec<Scatter> {
        let same = |a: &RunResult, b: &RunResult| b.momentum <= 1.01 * a.momentum;
        let groups = self.runs.chunk_by(same).filter(|group| group.len() > 1);
        groups
            .map(|group| {
                let count = group.len() as Real;
                let mean_and_deviation = |of: fn(&RunResult) -> Real| {
                    let mean = group.iter().map(of).sum::<Real>() / count;
                    let squares: Real = group.iter().map(|run| (of(run) - mean).powi(2)).sum();
                    [mean, (squares / (count - 1.0)).sqrt()]
                };
                let [mean, deviation] = mean_and_deviation(|run| run.volume);
                let below_rim = mean_and_deviation(|run| run.below_rim);
                let momentum = group.iter().map(|run| run.momentum).sum::<Real>() / count;
                Scatter { momentum, mean, deviation, below_rim, runs: group.len() }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(name: &str, axis_ratio: Real, momentum: Real, volume: Real) -> RunResult {
        RunResult {
            name: name.to_string(),
            momentum,
            axis_ratio,
            volume,
            uncertainty: 0.1 * volume,
            noise: 1e-9,
            below_rim: 0.6 * volume,
            below_rim_uncertainty: 0.05 * volume,
            depth: 2e-3,
            rim_radius: 5e-3,
            splashed: 7,
            rim_at_edge: false,
            late_change: Some(0.01),
        }
    }

    #[test]
    fn a_power_law_is_recovered() {
        let law = PowerLaw::fit([20.0, 40.0, 60.0, 80.0].map(|x: Real| (x, 3.0 * x.powf(1.2)))).unwrap();
        assert!((law.exponent - 1.2).abs() < 1e-12 && (law.coefficient - 3.0).abs() < 1e-10);
        assert!(law.standard_error.unwrap() < 1e-12 && (law.at(50.0) - 3.0 * 50.0_f64.powf(1.2)).abs() < 1e-9);
        // Scatter shows in the error.
        let scattered = PowerLaw::fit([(1.0, 1.0), (2.0, 2.5), (4.0, 3.5), (8.0, 8.5)]).unwrap();
        assert!(scattered.standard_error.unwrap() > 0.05);
    }

    #[test]
    fn no_law_without_two_momenta() {
        assert_eq!(PowerLaw::fit([(20.0, 1.0), (20.0, 2.0)]), None);
        // Beds of another height change the drop's momentum by less than anyone would call another momentum.
        assert_eq!(PowerLaw::fit([(20.0, 1.0), (20.01, 2.0)]), None);
        assert_eq!(PowerLaw::fit([(20.0, 1.0), (40.0, 0.0)]), None);
        assert_eq!(PowerLaw::fit([(1.0, 1.0), (2.0, 4.0)]).unwrap().standard_error, None);
    }

    #[test]
    fn runs_are_sorted_by_shape_and_momentum() {
        let comparison = Comparison::of(vec![
            run("d", 1.6, 8e-4, 80e-9),
            run("b", 1.0, 8e-4, 100e-9),
            run("a", 1.0, 2e-4, 25e-9),
            run("quiet", 1.0, 1e-4, 0.5e-9),
        ]);
        let names: Vec<_> = comparison.rows().into_iter().map(|row| row[0].clone()).collect();
        assert_eq!(names, ["quiet", "a", "b", "d"]);
        let law = comparison.series[0].law.unwrap();
        assert_eq!(law.points, 2, "the run below its noise does not count");
        assert!((law.exponent - 1.0).abs() < 1e-12);
        assert_eq!(comparison.series[1].law, None);
        assert_eq!(comparison.rows()[1][2..7], ["20.000", "15.000", "1.250", "25.000", "2.500"]);
        assert_eq!(comparison.rows()[0][11], "no: V below its noise");
    }

    #[test]
    fn no_law_goes_through_craters_at_an_edge_or_still_moving() {
        let mut runs = vec![run("a", 1.0, 2e-4, 25e-9), run("b", 1.0, 4e-4, 50e-9), run("c", 1.0, 8e-4, 900e-9)];
        // Negative control: as they are, all three count.
        assert_eq!(Comparison::of(runs.clone()).series[0].law.unwrap().points, 3);
        runs[2].rim_at_edge = true;
        let law = Comparison::of(runs.clone()).series[0].law.unwrap();
        assert!(law.points == 2 && (law.exponent - 1.0).abs() < 1e-12);
        for change in [None, Some(0.2), Some(-0.2)] {
            runs[1].late_change = change;
            assert_eq!(runs[1].doubt(), Some(Doubt::NotAtRest));
            assert_eq!(Comparison::of(runs.clone()).series[0].law, None);
        }
    }

    #[test]
    fn seeds_give_a_scatter() {
        let runs = [9.0, 10.0, 11.0].map(|v| run("s", 1.0, 8e-4, v * 1e-9)).to_vec();
        let scatter = Comparison::of(runs).series[0].scatter();
        assert_eq!((scatter.len(), scatter[0].runs), (1, 3));
        assert!((scatter[0].mean - 10e-9).abs() < 1e-20 && (scatter[0].deviation - 1e-9).abs() < 1e-20);
    }
}
