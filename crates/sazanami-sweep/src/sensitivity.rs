//! Sensitivity to each key: elementary effects (Morris 1991) of the keys of a sweep on all that its runs found.
//!
//! A trajectory changes one key after the other; what a finding changes by, over the step in parts of the key's range, is an elementary
//! effect of that key there. Over many trajectories mu* (Campolongo, Cariboni and Saltelli 2007), the mean of their absolute values, says
//! how much a key matters, and sigma, their standard deviation, whether it acts on its own and in proportion.

use std::path::Path;

use sazanami_io::table::write_csv;

use crate::state::{Progressed, State};
use crate::table;

/// Name of the table of indices.
pub const SENSITIVITY: &str = "sensitivity.csv";

/// Indices of a key for a finding, in its unit over the whole range of the key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Indices {
    /// Mean of the absolute values of the effects.
    pub mu_star: f64,
    /// Standard error of it; `None` of a single effect.
    pub error: Option<f64>,
    /// Mean of the effects.
    pub mu: f64,
    /// Standard deviation of the effects; `None` of a single one.
    pub sigma: Option<f64>,
    /// Steps whose effect runs tell, with seeds their mean.
    pub effects: usize,
}

impl Indices {
    /// Of these effects; `None` if there are none.
    fn of(effects: &[f64]) -> Option<Self> {
        let absolute: Vec<f64> = effects.iter().map(|effect| effect.abs()).collect();
        let (mu, sigma) = moments(effects)?;
        let (mu_star, scatter) = moments(&absolute)?;
        let error = scatter.map(|scatter| scatter / (effects.len() as f64).sqrt());
        Some(Self { mu_star, error, mu, sigma, effects: effects.len() })
    }
}

/// Mean and standard deviation.
fn moments(values: &[f64]) -> Option<(f64, Option<f64>)> {
    let count = values.len() as f64;
    // A sum of negative zeros is one too, and is to be written as zero.
    let mean = values.iter().sum::<f64>() / count + 0.0;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let deviation = (values.len() > 1).then(|| (squares / (count - 1.0)).sqrt());
    (!values.is_empty()).then_some((mean, deviation))
}

/// Indices of each of the `keys` from the `places` of the trajectories in the unit cube, one after the other with a point more than keys,
/// and what was found there, `seeds` values for each place.
fn indices(places: &[Vec<f64>], values: &[Option<f64>], keys: usize, seeds: usize) -> Vec<Option<Indices>> {
    let mut effects: Vec<Vec<f64>> = vec![Vec::new(); keys];
    for (trajectory, places) in places.chunks(keys + 1).enumerate() {
        for (n, pair) in places.windows(2).enumerate() {
            let step = |d: usize| pair[1][d] - pair[0][d];
            let Some(key) = (0..keys).find(|&d| step(d) != 0.0) else { continue };
            let first = (trajectory * (keys + 1) + n) * seeds;
            let of_seed = |seed: usize| {
                let at = |point: usize| values.get(first + point * seeds + seed).copied().flatten();
                Some((at(1)? - at(0)?) / step(key))
            };
            // The seeds of a step are one place: its effect is their mean.
            let of_step: Vec<f64> = (0..seeds).filter_map(of_seed).collect();
            if let Some((mean, _)) = moments(&of_step) {
                effects[key].push(mean);
            }
        }
    }
    effects.iter().map(|effects| Indices::of(effects)).collect()
}

/// The heading and a row for each key and each finding that is not the same in all runs; the keys that matter most come first.
pub fn rows(keys: &[&str], places: &[Vec<f64>], states: &[Progressed]) -> Vec<Vec<String>> {
    let found: Vec<Vec<(String, String)>> = states.iter().map(table::findings).collect();
    let seeds = (states.len() / places.len().max(1)).max(1);
    let heading = ["finding", "key", "mu_star", "mu_star_error", "mu", "sigma", "effects"].map(str::to_owned).to_vec();
    let mut rows = vec![heading];
    for name in table::names(&found) {
        let value = |(own, state): (&Vec<(String, String)>, &Progressed)| {
            let text = own.iter().find(|(other, _)| other == name).map(|(_, text)| text)?;
            text.parse::<f64>().ok().filter(|value| value.is_finite() && state.state == State::Finished)
        };
        let values: Vec<Option<f64>> = found.iter().zip(states).map(value).collect();
        let of_keys = indices(places, &values, keys.len(), seeds);
        let mut known: Vec<(&str, Indices)> =
            keys.iter().zip(of_keys).filter_map(|(key, indices)| Some((*key, indices?))).collect();
        if known.iter().all(|(_, indices)| indices.mu_star == 0.0) {
            continue;
        }
        known.sort_by(|(_, a), (_, b)| b.mu_star.total_cmp(&a.mu_star));
        let cell = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.4e}"));
        rows.extend(known.into_iter().map(|(key, indices)| {
            let Indices { mu_star, error, mu, sigma, effects } = indices;
            let numbers = [Some(mu_star), error, Some(mu), sigma].map(cell);
            [vec![name.clone(), key.to_owned()], numbers.to_vec(), vec![effects.to_string()]].concat()
        }));
    }
    rows
}

/// Writes the table into `folder`; without a row below the heading there is none, nor one of an earlier time.
///
/// Returns whether there is one.
pub fn write(folder: &Path, rows: &[Vec<String>]) -> std::io::Result<bool> {
    let path = folder.join(SENSITIVITY);
    if rows.len() > 1 {
        write_csv(&path, rows)?;
        return Ok(true);
    }
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error),
        _ => Ok(false),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::points::morris;

    /// Indices of a function of the unit cube.
    fn of(keys: usize, trajectories: usize, function: impl Fn(&[f64]) -> f64) -> Vec<Indices> {
        let places = morris(keys, trajectories, 4, 5);
        let values: Vec<Option<f64>> = places.iter().map(|place| Some(function(place))).collect();
        indices(&places, &values, keys, 1).into_iter().map(Option::unwrap).collect()
    }

    #[test]
    fn a_linear_function_has_its_coefficients_and_an_inert_key_nothing() {
        let found = of(3, 6, |x| 3.0 * x[0] - 2.0 * x[1] + 7.0);
        for (indices, coefficient) in found.iter().zip([3.0_f64, -2.0, 0.0]) {
            assert!((indices.mu - coefficient).abs() < 1e-12 && (indices.mu_star - coefficient.abs()).abs() < 1e-12);
            assert!(indices.sigma.unwrap() < 1e-12 && indices.effects == 6, "{indices:?}");
        }
        assert_eq!([found[2].mu, found[2].mu_star, found[2].sigma.unwrap()], [0.0; 3]);
    }

    #[test]
    fn curvature_and_interaction_show_in_sigma_and_opposite_effects_in_mu_star_alone() {
        // On four levels a step of 2/3 begins at 0 or 1/3 (or ends there): the effects of x^2 are 2/3 and 4/3.
        let found = of(2, 400, |x| x[0] * x[0]);
        assert!((found[0].mu - 1.0).abs() < 0.05 && (found[0].sigma.unwrap() - 1.0 / 3.0).abs() < 0.01, "{found:?}");
        // Those of (x - 1/2)^2 are -1/3 and 1/3.
        let found = of(2, 400, |x| (x[0] - 0.5).powi(2));
        assert!(found[0].mu.abs() < 0.05 && (found[0].mu_star - 1.0 / 3.0).abs() < 1e-12, "{found:?}");
        // Those of x y are the levels of the other key: mean 1/2, variance 5/36.
        let found = of(2, 4000, |x| x[0] * x[1]);
        for indices in &found {
            assert!((indices.mu - 0.5).abs() < 0.02, "{found:?}");
            assert!((indices.sigma.unwrap() - (5.0_f64 / 36.0).sqrt()).abs() < 0.01, "{found:?}");
        }
    }

    #[test]
    fn keys_that_leap_have_the_effect_of_the_step_that_they_made() {
        let text = "case = \"a.toml\"\npoints = { morris = { trajectories = 12, seed = 1 } }\n[keys]\n\"a\" = [1, 3]\n\
                    \"b\" = { from = 1, to = 3, integers = true }\n\"c\" = [1, 2, 3]\n";
        let plan = crate::Plan::parse(Path::new("plan.toml"), text).unwrap();
        let number = |text: &str| text.parse::<f64>().unwrap();
        let values: Vec<Option<f64>> =
            plan.points().iter().map(|point| Some(point.iter().map(|key| number(&key.value)).sum())).collect();
        // Each goes from 1 to 3, and a finding that is their sum changes by 2 over the range of each.
        for found in indices(&plan.trajectories().unwrap(), &values, 3, 1) {
            let Indices { mu_star, mu, sigma, .. } = found.unwrap();
            assert!((mu_star - 2.0).abs() < 1e-12 && (mu - 2.0).abs() < 1e-12 && sigma.unwrap() < 1e-12, "{found:?}");
        }
        // Control: by the steps of the grid, of 2/3, a leap from end to end would count as 3.
        let by_grid = indices(&morris(3, 12, 4, 1), &values, 3, 1);
        assert!(by_grid.iter().flatten().all(|found| (found.mu_star - 2.0).abs() > 0.1), "{by_grid:?}");
    }

    #[test]
    fn a_table_of_an_earlier_time_goes_where_nothing_has_an_effect() {
        let folder = std::env::temp_dir().join(format!("sazanami_sensitivity_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let heading = vec![vec!["finding".to_owned()]];
        assert!(write(&folder, &[heading.clone(), heading.clone()].concat()).unwrap());
        assert!(folder.join(SENSITIVITY).exists());
        assert!(!write(&folder, &heading).unwrap() && !folder.join(SENSITIVITY).exists());
        assert!(!write(&folder, &heading).unwrap());
        std::fs::remove_dir_all(&folder).unwrap();
    }

    /// Eight keys of Sobol's g-function, whose order of importance is known: a smaller `a` matters more.
    #[test]
    fn the_keys_of_the_g_function_come_in_their_order() {
        let a = [0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0];
        let found = of(8, 500, |x| x.iter().zip(a).map(|(x, a)| ((4.0 * x - 2.0).abs() + a) / (1.0 + a)).product());
        assert!((0..4).all(|n| found[n].mu_star > 1.5 * found[n + 1].mu_star), "{found:?}");
        assert!(found[7].mu_star < 0.02 * found[0].mu_star);
    }

    #[test]
    fn the_table_has_what_finished_runs_tell() {
        let places = morris(2, 3, 4, 1);
        let seeds = 2;
        let mut states: Vec<Progressed> = places
            .iter()
            .flat_map(|place| (0..seeds).map(move |seed| (place, seed)))
            .map(|(place, seed)| {
                let v = 5.0 * place[1] + 100.0 * f64::from(seed);
                let summary =
                    json!({ "observables": { "erosion": { "volume_mm3": v, "mode": "surface" } }, "steps": 7 });
                Progressed { state: State::Finished, summary }
            })
            .collect();
        let rows = |states: &[Progressed]| super::rows(&["a", "b"], &places, states);
        let found = rows(&states);
        // `steps` is the same in all runs, and a word is no number.
        assert_eq!(found.len(), 3, "{found:?}");
        let numbers = |row: &[String]| row[2..].iter().map(|cell| cell.parse().unwrap()).collect::<Vec<f64>>();
        assert_eq!(found[1][..2], ["erosion.volume_mm3", "b"]);
        for (number, expected) in numbers(&found[1]).iter().zip([5.0, 0.0, 5.0, 0.0, 3.0]) {
            assert!((number - expected).abs() < 1e-12, "{found:?}");
        }
        assert_eq!(found[2], ["erosion.volume_mm3", "a", "0.0000e0", "0.0000e0", "0.0000e0", "0.0000e0", "3"]);
        // The seeds of a step are one effect. Where runs of all of them failed it takes the effects on both sides.
        states[2].state = State::Failed("x".into());
        assert_eq!(rows(&states)[1][6], "3", "the other seed tells them");
        states[3].state = State::Failed("x".into());
        let found = rows(&states);
        let effects: usize = found[1..].iter().map(|row| row[6].parse::<usize>().unwrap()).sum();
        assert_eq!(effects, 6 - 2, "{found:?}");
    }
}
