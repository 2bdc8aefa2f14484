//! Charts of a run: which columns stand together, in units that people read.

use sazanami::analyse::Table;
use serde_json::{Value, json};

use crate::amounts::{readable, rounded};
use crate::typeset::typeset;

/// Most rows of a table that a chart holds.
pub const MOST_ROWS: usize = 2000;

/// A curve: values of a column.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name.
    pub label: String,
    /// Whether it is shown at first.
    pub shown: bool,
    /// Values in SI units, NaN where there is none.
    pub values: Vec<f64>,
    /// Uncertainty to either side; empty if not known.
    pub bars: Vec<f64>,
}

impl Curve {
    /// A curve that is shown at first, without uncertainty.
    pub fn new(label: impl Into<String>, values: Vec<f64>) -> Self {
        Self { label: label.into(), shown: true, values, bars: Vec::new() }
    }
}

/// Curves over the same abscissae.
#[derive(Clone, Debug)]
pub struct Curves {
    /// Abscissae in SI units, ascending.
    pub x: Vec<f64>,
    /// Curves, each with a value for every abscissa.
    pub curves: Vec<Curve>,
}

/// Curves in one frame, with its axes.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Heading over the frame.
    pub title: String,
    /// Name and unit of the abscissa.
    pub x: (String, String),
    /// Unit of the curves.
    pub unit: String,
    /// The curves, by their abscissae.
    pub tables: Vec<Curves>,
    /// Whether points are marked and not joined.
    pub points: bool,
    /// Rows of a stretch of which those with the least and the greatest value of each curve are kept; 1 where all are.
    pub every: usize,
}

/// Columns of `series.csv` that stand in one chart: title, columns.
type Group = (&'static str, &'static [&'static str]);

/// Charts of `series.csv` in the order of the page; columns that a run has not are left out.
const GROUPS: &[Group] = &[
    ("Crater", &["crater_depth", "rim_radius"]),
    ("Volume of the crater", &["erosion_volume_below_rim", "erosion_volume", "erosion_volume_excavated"]),
    ("Heights of mound and ripples", &["mound_height", "ripple_crest_height", "bed_relief"]),
    ("Lengths of mound and ripples", &["mound_wavelength", "ripple_crest_spacing"]),
    ("Crests of ripples", &["ripple_crests"]),
    ("Level of the water", &["water_level_mean", "water_level_highest", "water_level_lowest"]),
    ("Splashed grains", &["splashed_grains", "suspended_grains"]),
    ("Fastest", &["largest_grain_speed", "largest_fluid_speed"]),
    ("Energy", &["kinetic_energy_fluid", "kinetic_energy_grains", "potential_energy"]),
    (
        "Momentum along x₃",
        &[
            "momentum_liquid_3",
            "momentum_grains_3",
            "momentum_gas_3",
            "impulse_walls_on_fluid_3",
            "impulse_walls_on_grains_3",
            "impulse_gravity_3",
            "impulse_displaced_mass_flux_3",
            "impulse_open_sides_3",
            "impulse_held_grains_3",
            "impulse_residue_3",
            "momentum_residual_3",
        ],
    ),
    ("Momentum", &["momentum_1", "momentum_2", "momentum_3"]),
    (
        "Residual of the water's momentum",
        &["fluid_momentum_residual_1", "fluid_momentum_residual_2", "fluid_momentum_residual_3"],
    ),
    ("Change of the liquid volume", &["liquid_volume_relative_change", "bulk_volume_relative_change"]),
    ("Contacts", &["contact_pairs", "contacts", "deep_contacts"]),
    ("Length of the time step", &["dt", "stable_dt", "least_stable_dt"]),
    ("Iterations and sub-steps", &["pressure_iterations", "grain_substeps", "fluid_passes"]),
];

/// Columns of a series that have values, all of them zero.
pub fn zero_columns(series: &Table) -> Vec<&str> {
    let is_zero = |name: &str| {
        let values = series.column(name);
        let mut known = values.iter().filter(|value| value.is_finite()).peekable();
        known.peek().is_some() && known.all(|value| *value == 0.0)
    };
    series.headings().map(|(name, _)| name).filter(|name| !["step", "time"].contains(name) && is_zero(name)).collect()
}

/// Charts of a series over the time: the known groups, then what is left by units. Columns that are zero at all times are left out.
pub fn of_series(series: &Table) -> Vec<Chart> {
    let zero = zero_columns(series);
    let known: Vec<&str> = GROUPS.iter().flat_map(|(_, columns)| *columns).copied().collect();
    let grouped = GROUPS.iter().filter_map(|(title, columns)| {
        let drawn: Vec<&str> = columns.iter().copied().filter(|name| !zero.contains(name)).collect();
        of_columns(series, title, &drawn, drawn.len())
    });
    let mut charts: Vec<Chart> = grouped.collect();
    let mut units: Vec<&str> = Vec::new();
    for (name, unit) in series.headings() {
        if !known.contains(&name) && !["step", "time"].contains(&name) && !units.contains(&unit) {
            units.push(unit);
        }
    }
    for unit in units {
        let left = series.headings().filter(|(name, of)| *of == unit && !known.contains(name));
        let left = left.map(|(name, _)| name).filter(|name| !["step", "time"].contains(name) && !zero.contains(name));
        let chart = of_columns(series, "Other numbers", &left.collect::<Vec<_>>(), 1);
        charts.extend(chart.map(|mut chart| {
            if !unit.is_empty() {
                chart.title = format!("Other quantities in {}", chart.drawn_unit().0);
            }
            chart
        }));
    }
    charts
}

/// A chart of columns of a series; the first `shown` of them are shown at first. Nothing where there is no value.
pub fn of_columns(series: &Table, title: &str, columns: &[&str], shown: usize) -> Option<Chart> {
    let unit_of = |name: &str| series.headings().find(|(column, _)| *column == name).map(|(_, unit)| unit.to_owned());
    let unit = columns.iter().find_map(|name| unit_of(name))?;
    let curves = columns
        .iter()
        .filter(|name| unit_of(name).is_some_and(|own| own == unit))
        .map(|name| Curve::new(plain(name), series.column(name)));
    let mut curves: Vec<Curve> = curves.filter(|curve| curve.values.iter().any(|value| value.is_finite())).collect();
    curves.iter_mut().skip(shown).for_each(|curve| curve.shown = false);
    if curves.is_empty() {
        return None;
    }
    let (rows, every) = kept_rows(&curves, series.len());
    let thinned = |values: &[f64]| rows.iter().map(|&row| values[row]).collect::<Vec<f64>>();
    curves.iter_mut().for_each(|curve| curve.values = thinned(&curve.values));
    let tables = vec![Curves { x: thinned(&series.column("time")), curves }];
    Some(Chart { every, ..Chart::new(title, ["time", "s"], &unit, tables) })
}

/// Rows of `count` that a chart keeps, and how many lie in a stretch: of each stretch those in which a curve is least and greatest, and the first
/// in which it has no value; the first and the last row, and the last value of each curve.
fn kept_rows(curves: &[Curve], count: usize) -> (Vec<usize>, usize) {
    if count <= MOST_ROWS {
        return ((0..count).collect(), 1);
    }
    let last_value = |curve: &Curve| curve.values.iter().rposition(|value| value.is_finite());
    let ends: Vec<usize> = curves.iter().filter_map(last_value).chain([0, count - 1]).collect();
    let mut every = (2 * count).div_ceil(MOST_ROWS);
    loop {
        let mut rows = ends.clone();
        for curve in curves {
            for (number, stretch) in curve.values.chunks(every).enumerate() {
                let known = || stretch.iter().enumerate().filter(|(_, value)| value.is_finite());
                let least = known().min_by(|a, b| a.1.total_cmp(b.1));
                let greatest = known().max_by(|a, b| a.1.total_cmp(b.1));
                let missing = stretch.iter().position(|value| !value.is_finite());
                let found = [least.map(|(row, _)| row), greatest.map(|(row, _)| row), missing];
                rows.extend(found.into_iter().flatten().map(|row| number * every + row));
            }
        }
        rows.sort_unstable();
        rows.dedup();
        if rows.len() <= MOST_ROWS || every >= count {
            return (rows, every);
        }
        every += every.div_ceil(2);
    }
}

/// Heights of a bed against `x` at the first, some middle and the last of their times; nothing where there is no height.
pub fn of_profiles(title: &str, x: &str, profiles: Vec<(f64, Vec<f64>, Vec<f64>)>) -> Option<Chart> {
    const SHOWN: usize = 5;
    if profiles.iter().all(|(_, _, heights)| heights.iter().all(|height| !height.is_finite())) {
        return None;
    }
    let last = profiles.len().checked_sub(1)?;
    let mut chosen: Vec<usize> = (0..SHOWN).map(|n| n * last / (SHOWN - 1)).collect();
    chosen.dedup();
    let table = |&n: &usize| {
        let (time, places, heights) = &profiles[n];
        let curve = Curve::new(format!("t = {} ms", rounded(1e3 * time)), heights.clone());
        Curves { x: places.clone(), curves: vec![curve] }
    };
    Some(Chart::new(title, [x, "m"], "m", chosen.iter().map(table).collect()))
}

/// Surfaces of a crater: a row a time, a column a layer about the axis.
pub fn crater_profiles(profiles: &Table) -> Option<Chart> {
    let first = profiles.headings().position(|(name, _)| name == "height_0")?;
    let (times, widths) = (profiles.column("time"), profiles.column("layer"));
    let row = |n: usize| {
        let heights: Vec<f64> = profiles.row(n).skip(first).collect();
        let places = (0..heights.len()).map(|layer| (layer as f64 + 0.5) * widths[n]).collect();
        (times[n], places, heights)
    };
    of_profiles("Surface of the bed about the axis", "radius", (0..profiles.len()).map(row).collect())
}

/// Surfaces along a tank: a row a time and a place.
pub fn tank_profiles(title: &str, table: &Table, height: &str) -> Option<Chart> {
    let (times, places, heights) = (table.column("time"), table.column("x"), table.column(height));
    let mut profiles: Vec<(f64, Vec<f64>, Vec<f64>)> = Vec::new();
    for ((time, x), z) in times.into_iter().zip(places).zip(heights) {
        match profiles.last_mut().filter(|(of, ..)| *of == time) {
            Some((_, xs, zs)) => {
                xs.push(x);
                zs.push(z);
            }
            None => profiles.push((time, vec![x], vec![z])),
        }
    }
    of_profiles(title, "x₁", profiles)
}

/// Averages over the layers of a bed against the time.
pub fn of_layers(table: &Table) -> Vec<Chart> {
    let (times, layers) = (table.column("time"), table.words("layer"));
    let of = |(title, columns, unit): (&str, [&str; 2], &str)| {
        let curves = |layer: &str| {
            let rows: Vec<usize> = (0..table.len()).filter(|&row| layers[row] == layer).collect();
            let pick = |values: &[f64]| rows.iter().map(|&row| values[row]).collect::<Vec<f64>>();
            let curve =
                |name: &&str| Curve::new(format!("{} of the {layer} layer", plain(name)), pick(&table.column(name)));
            Curves { x: pick(&times), curves: columns.iter().map(curve).collect() }
        };
        Chart::new(title, ["time", "s"], unit, ["upper", "lower"].map(curves).into())
    };
    [
        ("Velocities in the layers of the bed", ["water_velocity_1", "grain_velocity_1"], "m/s"),
        ("Forces on a grain in the layers of the bed", ["drag_1", "pressure_force_1"], "N"),
    ]
    .map(of)
    .into()
}

impl Chart {
    /// Lines over an abscissa with its unit, from all rows.
    pub fn new(title: &str, [x, x_unit]: [&str; 2], unit: &str, tables: Vec<Curves>) -> Self {
        let x = (x.to_owned(), x_unit.to_owned());
        Self { title: title.to_owned(), x, unit: unit.to_owned(), tables, points: false, every: 1 }
    }

    /// The same with all curves called `name`.
    pub fn named(mut self, name: &str) -> Self {
        self.tables.iter_mut().flat_map(|table| &mut table.curves).for_each(|curve| name.clone_into(&mut curve.label));
        self
    }

    /// The same with the `points` of a surface that was measured at `time` \[s].
    pub fn with_measured(mut self, time: f64, points: &[[f64; 2]]) -> Self {
        let [x, values] = [0, 1].map(|d| points.iter().map(|point| point[d]).collect());
        let curve = Curve::new(format!("experiment, t = {} ms", rounded(1e3 * time)), values);
        self.tables.push(Curves { x, curves: vec![curve] });
        self
    }

    /// The unit that its curves are drawn in, and the factor to it.
    pub fn drawn_unit(&self) -> (String, f64) {
        let curves = self.tables.iter().flat_map(|table| &table.curves);
        readable(&self.unit, &curves.flat_map(|curve| curve.values.clone()).collect::<Vec<f64>>())
    }

    /// The chart for the script of the page, in units that fit its values.
    pub fn json(&self) -> Value {
        let all = |of: fn(&Curves) -> Vec<f64>| self.tables.iter().flat_map(of).collect::<Vec<f64>>();
        let (x_unit, x_factor) = readable(&self.x.1, &all(|table| table.x.clone()));
        let (unit, factor) = self.drawn_unit();
        let scaled =
            |values: &[f64], factor: f64| values.iter().map(|value| number(value * factor)).collect::<Vec<_>>();
        let table = |table: &Curves| {
            let curve = |curve: &Curve| {
                json!({ "label": curve.label, "shown": curve.shown, "y": scaled(&curve.values, factor),
                        "bars": scaled(&curve.bars, factor) })
            };
            json!({ "x": scaled(&table.x, x_factor), "curves": table.curves.iter().map(curve).collect::<Vec<_>>() })
        };
        json!({
            "title": self.title, "x": self.x.0, "xUnit": x_unit, "unit": unit, "points": self.points,
            "tables": self.tables.iter().map(table).collect::<Vec<_>>(),
        })
    }

    /// Least, greatest and last value of each curve, for those who read no charts.
    pub fn summary(&self) -> Vec<Vec<String>> {
        let curves = || self.tables.iter().flat_map(|table| &table.curves);
        let (unit, factor) = self.drawn_unit();
        let row = |curve: &Curve| {
            let known = || curve.values.iter().copied().filter(|value| value.is_finite());
            let cell = |value: Option<f64>| value.map_or("–".into(), |value| rounded(factor * value));
            vec![
                curve.label.clone(),
                unit.clone(),
                cell(known().reduce(f64::min)),
                cell(known().reduce(f64::max)),
                cell(known().next_back()),
            ]
        };
        curves().map(row).collect()
    }
}

/// A number for the script: seven digits, `null` where there is none.
fn number(value: f64) -> Value {
    format!("{value:.6e}")
        .parse::<f64>()
        .ok()
        .filter(|value| value.is_finite())
        .map_or(Value::Null, |value| json!(value))
}

/// The name of a column as a title.
pub fn capitalised(name: &str) -> String {
    let words = plain(name);
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// The name of a column as words.
pub fn plain(name: &str) -> String {
    ["_1", "_2", "_3"]
        .iter()
        .fold(name.to_owned(), |name, end| match name.strip_suffix(end) {
            Some(front) => format!("{front}, {}", typeset(&format!("x{}", &end[1..]))),
            None => name,
        })
        .replace('_', " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Table {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        std::fs::write(&path, text).unwrap();
        Table::read(&path).unwrap().unwrap()
    }

    #[test]
    fn every_column_with_values_is_in_one_chart() {
        let series = table(
            "step,time [s],crater_depth [m],dt [s],new [Pa],limiter\n0,0,,1e-5,2,cfl\n1,0.02,1.7e-3,2e-5,3,cfl\n",
        );
        let charts = of_series(&series);
        let titles: Vec<&str> = charts.iter().map(|chart| chart.title.as_str()).collect();
        assert_eq!(titles, ["Crater", "Length of the time step", "Other quantities in Pa"]);
        let json = charts[0].json();
        assert_eq!((&json["unit"], &json["xUnit"]), (&json!("mm"), &json!("ms")));
        assert_eq!(json["tables"][0]["x"], json!([0.0, 20.0]));
        assert_eq!(json["tables"][0]["curves"][0]["y"], json!([null, 1.7]));
        assert_eq!(charts[0].summary()[0], ["crater depth", "mm", "1.7", "1.7", "1.7"]);
    }

    #[test]
    fn what_is_zero_at_all_times_is_left_out_and_titles_have_the_unit_that_is_drawn() {
        let series = |soaked: &str| {
            table(&format!(
                "step,time [s],overfull_volume [m^3],soaked_volume [m^3],contacts,deep_contacts,new [m],limiter\n\
                 0,0,0,{soaked},3,,,cfl\n1,1,0,{soaked},4,0,,cfl\n"
            ))
        };
        let wet = series("2e-9");
        let charts = of_series(&wet);
        let titles: Vec<&str> = charts.iter().map(|chart| chart.title.as_str()).collect();
        assert_eq!(titles, ["Contacts", "Other quantities in mm³"]);
        assert!(charts.iter().all(|chart| chart.tables[0].curves.len() == 1 && chart.tables[0].curves[0].shown));
        assert_eq!(charts[1].json()["unit"], "mm³");
        assert_eq!(zero_columns(&wet), ["overfull_volume", "deep_contacts"]);
        assert_eq!(zero_columns(&series("0")).len(), 3);
    }

    #[test]
    fn a_surface_without_heights_has_no_chart() {
        let water = |z: &str| tank_profiles("water", &table(&format!("step,time [s],x [m],z [m]\n0,0,0,{z}\n")), "z");
        assert!(water("").is_none() && water("1e-2").is_some());
    }

    #[test]
    fn directions_are_set_as_indices() {
        assert_eq!(plain("momentum_liquid_3"), "momentum liquid, x₃");
        assert_eq!(plain("x_10"), "x 10");
    }

    #[test]
    fn a_bed_without_ripples_has_no_wavelength_of_ripples() {
        let titles = |spacing: &str| {
            let charts = of_series(&table(&format!(
                "step,time [s],mound_height [m],ripple_crest_spacing [m]\n0,0,3e-3,\n1,0.5,3e-3,{spacing}\n"
            )));
            charts.into_iter().map(|chart| chart.title).collect::<Vec<_>>()
        };
        let [heights, lengths] = ["Heights of mound and ripples", "Lengths of mound and ripples"];
        assert_eq!(titles(""), [heights]);
        // Control: with ripples there are both.
        assert_eq!(titles("1e-2"), [heights, lengths]);
    }

    #[test]
    fn measured_surfaces_stand_beside_those_of_the_run() {
        let bed = table("step,time [s],x [m],z [m]\n0,0,0,1e-2\n0,0,1e-2,2e-2\n");
        let chart = tank_profiles("bed", &bed, "z").unwrap();
        let with = chart.clone().with_measured(2.5, &[[1e-3, 3e-2], [4e-3, 5e-2], [9e-3, 4e-2]]).json();
        assert_eq!((chart.tables.len(), with["tables"][0].clone()), (1, chart.json()["tables"][0].clone()));
        let measured = &with["tables"][1];
        assert_eq!(
            (&measured["x"], &measured["curves"][0]["y"]),
            (&json!([1.0, 4.0, 9.0]), &json!([30.0, 50.0, 40.0]))
        );
        assert_eq!(measured["curves"][0]["label"], "experiment, t = 2500 ms");
    }

    #[test]
    fn long_tables_keep_the_range_of_their_values() {
        // A peak and a trough of one row each, in two curves, one of which ends before the other.
        let value = |n: usize| if n == 3334 { 1030.67 } else { (n % 7) as f64 };
        let other = |n: usize| match n {
            4001.. => String::new(),
            1235 => "-50".into(),
            _ => format!("{}", 1.0 + n as f64),
        };
        let rows: String = (0..5001).map(|n| format!("{n},{n},{},{}\n", value(n), other(n))).collect();
        let text = format!("step,time [s],crater_depth [m],rim_radius [m]\n{rows}");
        let chart = &of_series(&table(&text))[0];
        let Curves { x, curves } = &chart.tables[0];
        assert!(x.len() <= MOST_ROWS && chart.every >= 6, "{} {}", x.len(), chart.every);
        assert_eq!((x[0], x.last()), (0.0, Some(&5000.0)));
        assert!(x.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(chart.summary()[0][2..], ["0", "1031", "2"]);
        assert_eq!(chart.summary()[1][2..], ["-50", "4001", "4001"]);
        // The values stand at their own times, and a curve that has ended is not drawn on.
        let at = |time: f64| x.iter().position(|x| *x == time).unwrap();
        assert_eq!((curves[0].values[at(3334.0)], curves[1].values[at(1235.0)]), (1030.67, -50.0));
        assert!(curves[1].values[at(5000.0)].is_nan());
        // Negative control: of a short table all rows are kept.
        let short: String = text.lines().take(1 + MOST_ROWS).map(|line| format!("{line}\n")).collect();
        let chart = &of_series(&table(&short))[0];
        assert_eq!((chart.tables[0].x.len(), chart.every), (MOST_ROWS, 1));
    }
}
