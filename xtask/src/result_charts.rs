//! Charts of results over what the runs differ by, written from their summaries.
//!
//! `docs/results/charts.toml` names them: for each a file and its panels, for each panel the entry of the summaries, its uncertainty, and the
//! runs of each line with their abscissas.

use std::path::Path;

use sazanami_verification::chart::figure;
use sazanami_verification::measured::Chart;
use serde::Deserialize;

use crate::results::{Problem, RUNS, number, read_summary, read_toml};

const CHARTS: &str = "docs/results/charts.toml";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Charts {
    chart: Vec<Figure>,
}

/// A file of charts.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Figure {
    file: String,
    panel: Vec<Panel>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Panel {
    title: String,
    axes: [String; 2],
    #[serde(default)]
    logarithmic: bool,
    /// Entries of the summaries.
    value: String,
    uncertainty: String,
    series: Vec<Line>,
}

/// A line, by its runs.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    name: String,
    runs: Vec<Point>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Point {
    run: String,
    at: f64,
}

impl Panel {
    fn chart(&self, root: &Path) -> Result<Chart, Problem> {
        let [x, y] = &self.axes;
        let mut chart = Chart { logarithmic: self.logarithmic, ..Chart::new(&self.title, x, y) };
        for line in &self.series {
            let (mut points, mut bars) = (Vec::new(), Vec::new());
            for point in &line.runs {
                let summary = read_summary(&root.join(RUNS).join(&point.run))?;
                let of = |path| number(&summary, path).map_err(|problem| format!("{}: {problem}", point.run));
                points.push([point.at, of(&self.value)?]);
                bars.push(of(&self.uncertainty)?);
            }
            chart = chart.results(&line.name, &points, &bars);
        }
        Ok(chart)
    }
}

/// Charts of results below `root`: path and SVG.
pub fn files(root: &Path) -> Result<Vec<(String, String)>, Problem> {
    let charts: Charts = read_toml(&root.join(CHARTS))?;
    let file = |drawn: Figure| {
        let panels: Result<Vec<Chart>, Problem> = drawn.panel.iter().map(|panel| panel.chart(root)).collect();
        Ok((drawn.file, figure(&panels?, &[])))
    };
    charts.chart.into_iter().map(file).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_has_a_mark_for_each_run() {
        let root = crate::root();
        let charts: Charts = read_toml(&root.join(CHARTS)).unwrap();
        for (drawn, (path, svg)) in charts.chart.iter().zip(files(&root).unwrap()) {
            let runs: usize = drawn.panel.iter().flat_map(|panel| &panel.series).map(|line| line.runs.len()).sum();
            assert_eq!((svg.matches("<circle").count(), path.as_str()), (runs, drawn.file.as_str()));
        }
    }

    #[test]
    fn a_run_without_the_entry_is_told() {
        let panel = r#"title = "t"
axes = ["x", "y"]
value = "observables.erosion.volume_mm3"
uncertainty = "none"
series = [{ name = "a", runs = [{ run = "quick", at = 1.0 }] }]"#;
        let panel: Panel = toml::from_str(panel).unwrap();
        assert!(panel.chart(&crate::root()).unwrap_err().starts_with("quick: "));
    }
}
