//! Several runs side by side: erosion volume against the momentum of the drop.

use sazanami_numerics::Real;

use crate::fit::line;

/// A volume of the crater of one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Volume {
    /// The volume [m^3].
    pub volume: Real,
    /// Its uncertainty [m^3].
    pub uncertainty: Real,
    /// The same of the bed before the impact [m^3].
    pub noise: Real,
    /// What speaks against it, in words; empty where nothing does, and then it counts for a law.
    pub doubts: String,
}

/// Drop and crater of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunResult {
    /// Name of the run.
    pub name: String,
    /// Momentum of the drop at the start [kg m/s].
    pub momentum: Real,
    /// Axis ratio of the drop, horizontal over vertical.
    pub axis_ratio: Real,
    /// Volume below the plane of the rim.
    pub below_rim: Volume,
    /// Erosion volume V.
    pub cap: Volume,
    /// Depth of the crater below its rim \[m].
    pub depth: Real,
    /// Radius of the rim \[m].
    pub rim_radius: Real,
    /// Number of splashed grains.
    pub splashed: usize,
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
    /// Volume below the plane of the rim against momentum, from the runs without doubts of it.
    pub law_below_rim: Option<PowerLaw>,
    /// V against momentum, likewise.
    pub law_of_cap: Option<PowerLaw>,
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
    /// V of the runs without doubts of it, if there are two or more.
    pub cap: Option<Repeated>,
    /// The volume below the plane of the rim, likewise.
    pub below_rim: Option<Repeated>,
}

/// A volume of repeated runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeated {
    /// Mean volume [m^3].
    pub mean: Real,
    /// Standard deviation of a single run [m^3].
    pub deviation: Real,
    /// Number of runs.
    pub runs: usize,
}

impl Repeated {
    fn of<'a>(volumes: impl Iterator<Item = &'a Volume>) -> Option<Self> {
        let clear: Vec<Real> = volumes.filter(|volume| volume.doubts.is_empty()).map(|volume| volume.volume).collect();
        let mean = clear.iter().sum::<Real>() / clear.len() as Real;
        let squares: Real = clear.iter().map(|volume| (volume - mean).powi(2)).sum();
        let deviation = (squares / (clear.len() as Real - 1.0)).sqrt();
        (clear.len() > 1).then_some(Self { mean, deviation, runs: clear.len() })
    }
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
                _ => series.push(Series {
                    axis_ratio: run.axis_ratio,
                    runs: vec![run],
                    law_below_rim: None,
                    law_of_cap: None,
                }),
            }
        }
        for series in &mut series {
            series.runs.sort_by(|a, b| a.momentum.total_cmp(&b.momentum).then_with(|| a.name.cmp(&b.name)));
            let law = |of: fn(&RunResult) -> &Volume| {
                let clear = series.runs.iter().filter(|run| of(run).doubts.is_empty());
                PowerLaw::fit(clear.map(|run| (run.momentum, of(run).volume)))
            };
            (series.law_below_rim, series.law_of_cap) = (law(|run| &run.below_rim), law(|run| &run.cap));
        }
        Self { series }
    }

    /// Columns of the comparison: name with unit, and the text of a run in it.
    pub const COLUMNS: [(&'static str, RunText); 14] = [
        ("run", |run| run.name.clone()),
        ("axis_ratio", |run| format!("{:.3}", run.axis_ratio)),
        ("momentum_g_cm_s", |run| format!("{:.3}", run.momentum * 1e5)),
        ("volume_below_rim_mm3", |run| format!("{:.3}", run.below_rim.volume * 1e9)),
        ("below_rim_uncertainty_mm3", |run| format!("{:.3}", run.below_rim.uncertainty * 1e9)),
        ("below_rim_noise_mm3", |run| format!("{:.3}", run.below_rim.noise * 1e9)),
        ("volume_mm3", |run| format!("{:.3}", run.cap.volume * 1e9)),
        ("uncertainty_mm3", |run| format!("{:.3}", run.cap.uncertainty * 1e9)),
        ("noise_mm3", |run| format!("{:.3}", run.cap.noise * 1e9)),
        ("depth_mm", |run| format!("{:.4}", run.depth * 1e3)),
        ("rim_radius_mm", |run| format!("{:.4}", run.rim_radius * 1e3)),
        ("splashed_grains", |run| run.splashed.to_string()),
        ("below_rim_doubts", |run| run.below_rim.doubts.clone()),
        ("volume_doubts", |run| run.cap.doubts.clone()),
    ];

    /// One row of text per run, in the columns of [`Self::COLUMNS`].
    #[must_use]
    pub fn rows(&self) -> Vec<[String; 14]> {
        let runs = self.series.iter().flat_map(|series| &series.runs);
        runs.map(|run| Self::COLUMNS.map(|(_, text)| text(run))).collect()
    }
}

/// Text of a run in a column.
pub type RunText = fn(&RunResult) -> String;

impl Series {
    /// Mean and scatter of the volumes of runs whose momenta agree within 1 %; only groups of two or more.
    #[must_use]
    pub fn scatter(&self) -> Vec<Scatter> {
        // Each group by its first: a sweep in small steps is no repetition.
        let (mut groups, mut rest) = (Vec::new(), &self.runs[..]);
        while let Some(first) = rest.first() {
            let (group, others) =
                rest.split_at(rest.partition_point(|run| run.momentum <= 1.01 * first.momentum).max(1));
            groups.push(group);
            rest = others;
        }
        groups
            .into_iter()
            .filter(|group| group.len() > 1)
            .map(|group| Scatter {
                momentum: group.iter().map(|run| run.momentum).sum::<Real>() / group.len() as Real,
                cap: Repeated::of(group.iter().map(|run| &run.cap)),
                below_rim: Repeated::of(group.iter().map(|run| &run.below_rim)),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(name: &str, axis_ratio: Real, momentum: Real, volume: Real) -> RunResult {
        let of =
            |volume: Real, bar: Real| Volume { volume, uncertainty: bar * volume, noise: 1e-9, doubts: String::new() };
        RunResult {
            name: name.to_string(),
            momentum,
            axis_ratio,
            below_rim: of(0.6 * volume, 0.05),
            cap: of(volume, 0.1),
            depth: 2e-3,
            rim_radius: 5e-3,
            splashed: 7,
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
        let comparison =
            Comparison::of(vec![run("d", 1.6, 8e-4, 80e-9), run("b", 1.0, 8e-4, 100e-9), run("a", 1.0, 2e-4, 25e-9)]);
        let names: Vec<_> = comparison.rows().into_iter().map(|row| row[0].clone()).collect();
        assert_eq!(names, ["a", "b", "d"]);
        let law = comparison.series[0].law_of_cap.unwrap();
        assert!(law.points == 2 && (law.exponent - 1.0).abs() < 1e-12);
        assert_eq!((comparison.series[1].law_of_cap, comparison.series[1].law_below_rim), (None, None));
        assert_eq!(comparison.rows()[0][2..9], ["20.000", "15.000", "0.750", "1.000", "25.000", "2.500", "1.000"]);
    }

    #[test]
    fn what_is_doubted_counts_for_no_law_of_its_own() {
        let mut runs = vec![run("a", 1.0, 2e-4, 25e-9), run("b", 1.0, 4e-4, 50e-9), run("c", 1.0, 8e-4, 900e-9)];
        // Negative control: as they are, all three count.
        assert_eq!(Comparison::of(runs.clone()).series[0].law_of_cap.unwrap().points, 3);
        runs[2].cap.doubts = "the rim".into();
        let series = &Comparison::of(runs.clone()).series[0];
        let law = series.law_of_cap.unwrap();
        assert!(law.points == 2 && (law.exponent - 1.0).abs() < 1e-12);
        assert_eq!(series.law_below_rim.unwrap().points, 3);
        assert_eq!(Comparison::of(runs).rows()[2][12..], ["", "the rim"]);
    }

    #[test]
    fn seeds_give_a_scatter() {
        let runs = [9.0, 10.0, 11.0].map(|v| run("s", 1.0, 8e-4, v * 1e-9)).to_vec();
        let scatter = |runs: &[RunResult]| Comparison::of(runs.to_vec()).series[0].scatter()[0];
        let cap = scatter(&runs).cap.expect("three runs");
        assert!(cap.runs == 3 && (cap.mean - 10e-9).abs() < 1e-20 && (cap.deviation - 1e-9).abs() < 1e-20);
        // Those with doubts do not count, each volume by its own.
        let mut doubted = runs.clone();
        doubted[2].cap.doubts = "the rim".into();
        let found = scatter(&doubted);
        assert!(
            (found.cap.expect("two runs").mean - 9.5e-9).abs() < 1e-20 && found.below_rim.expect("three").runs == 3
        );
        doubted[1].cap.doubts = "the rim".into();
        assert_eq!(scatter(&doubted).cap, None);
    }

    #[test]
    fn a_sweep_in_small_steps_is_no_repetition() {
        let sizes = |momenta: &[Real]| {
            let runs = momenta.iter().map(|momentum| run("s", 1.0, momentum * 1e-4, 1e-9)).collect();
            let scatter = Comparison::of(runs).series[0].scatter();
            scatter.iter().map(|group| group.cap.map_or(0, |cap| cap.runs)).collect::<Vec<_>>()
        };
        assert_eq!(sizes(&[8.0, 8.07, 8.14, 8.21, 8.28]), [2, 2]);
        // Negative control: runs within 1 % of the first are repetitions.
        assert_eq!(sizes(&[8.0, 8.03, 8.07]), [3]);
    }
}
