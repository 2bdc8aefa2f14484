//! Points of a sweep from the choices of its keys.

use sazanami_numerics::Random;

use crate::keys::{Between, Choices, Design, Key, Setting};

/// Digits of values between two ends: of a range, and of points of a design, where they are arbitrary.
const DIGITS_OF_RANGE: usize = 12;
const DIGITS_OF_SAMPLE: usize = 6;

/// Number of points.
pub fn count(keys: &[Key], design: Design) -> usize {
    match design {
        Design::Product => keys.iter().fold(1, |product, key| usize::saturating_mul(product, key.choices.len())),
        Design::Zip => keys.first().map_or(0, |key| key.choices.len()),
        Design::LatinHypercube { .. } | Design::Sobol { .. } | Design::Morris { .. } => {
            design.count(keys.len()).unwrap_or_default()
        }
    }
}

/// The points, each with a value for each key.
pub fn of(keys: &[Key], design: Design) -> Vec<Vec<Setting>> {
    match design {
        Design::Product => {
            let mut points = vec![Vec::new()];
            for key in keys {
                let values = all(&key.choices);
                let with = |point: &Vec<Setting>| {
                    values.iter().map(|value| [point.as_slice(), std::slice::from_ref(value)].concat()).collect()
                };
                points = points.iter().flat_map(|point| -> Vec<Vec<Setting>> { with(point) }).collect();
            }
            points
        }
        Design::Zip => {
            let values: Vec<Vec<Setting>> = keys.iter().map(|key| all(&key.choices)).collect();
            (0..count(keys, design)).map(|n| values.iter().map(|list| list[n].clone()).collect()).collect()
        }
        Design::LatinHypercube { count, seed } => {
            let columns = latin_hypercube(keys.len(), count, seed);
            sampled(keys, count, |n, d| columns[d][n])
        }
        Design::Sobol { count, seed } => {
            sampled(keys, count, |n, d| f64::from(sobol_burley::sample(n as u32, d as u32, seed as u32)))
        }
        Design::Morris { trajectories, levels, seed } => {
            let places = morris(keys.len(), trajectories, levels, seed);
            sampled(keys, places.len(), |n, d| places[n][d])
        }
    }
}

/// Points of a design by its places in the unit cube.
fn sampled(keys: &[Key], count: usize, place: impl Fn(usize, usize) -> f64) -> Vec<Vec<Setting>> {
    let value = |key: &Key, part: f64| match &key.choices {
        Choices::Values(list) => list[entry(list.len(), part)].clone(),
        Choices::Between(between) => between.at(part, DIGITS_OF_SAMPLE),
    };
    (0..count).map(|n| keys.iter().enumerate().map(|(d, key)| value(key, place(n, d))).collect()).collect()
}

/// Columns of a Latin hypercube (McKay, Beckman and Conover, 1979): in each, one number in each of `count` equal parts
/// from 0 to 1, in random order.
fn latin_hypercube(dimensions: usize, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut random = Random::new(seed);
    let mut column = || {
        let mut parts: Vec<usize> = (0..count).collect();
        for last in (1..count).rev() {
            parts.swap(last, ((random.unit() * (last + 1) as f64) as usize).min(last));
        }
        parts.into_iter().map(|part| (part as f64 + random.unit()) / count as f64).collect()
    };
    (0..dimensions).map(|_| column()).collect()
}

/// Places in the unit cube of trajectories (Morris 1991), one after the other, each with one point more than keys: from a random point on
/// a grid of an even number of `levels` each key in random order goes a step of `levels / (2 (levels - 1))` to the only side where there is
/// room for it.
pub fn morris(keys: usize, trajectories: usize, levels: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut random = Random::new(seed);
    let mut below = |count: usize| ((random.unit() * count as f64) as usize).min(count - 1);
    let mut places = Vec::new();
    for _ in 0..trajectories {
        let mut at: Vec<usize> = (0..keys).map(|_| below(levels)).collect();
        let mut order: Vec<usize> = (0..keys).collect();
        (1..keys).rev().for_each(|last| order.swap(last, below(last + 1)));
        let place = |at: &[usize]| at.iter().map(|&level| level as f64 / (levels - 1) as f64).collect();
        places.push(place(&at));
        for key in order {
            at[key] = (at[key] + levels / 2) % levels;
            places.push(place(&at));
        }
    }
    places
}

/// Places in the unit cube of the values that keys really have at these places: entries of a list and integers are the
/// same over a part of the way, and then leap.
pub fn realised(keys: &[Key], places: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let part = |(key, part): (&Key, f64)| match &key.choices {
        Choices::Values(list) => entry(list.len(), part) as f64 / (list.len() - 1).max(1) as f64,
        Choices::Between(between) if between.is_integer => between.part_of_integer(part),
        Choices::Between(_) => part,
    };
    places.into_iter().map(|place| keys.iter().zip(place).map(part).collect()).collect()
}

/// Entry of a list of `count` at a part of the way through it.
fn entry(count: usize, part: f64) -> usize {
    ((part * count as f64) as usize).min(count - 1)
}

/// All values of a key.
fn all(choices: &Choices) -> Vec<Setting> {
    match choices {
        Choices::Values(list) => list.clone(),
        Choices::Between(between) => {
            let count = choices.len();
            (0..count).map(|n| between.at(n as f64 / (count - 1) as f64, DIGITS_OF_RANGE)).collect()
        }
    }
}

impl Between {
    /// The value at a part of the way from the lower end to the upper one.
    pub fn at(&self, part: f64, digits: usize) -> Setting {
        self.setting(self.between(part), digits)
    }

    /// The number at a part of the way.
    fn between(&self, part: f64) -> f64 {
        let [a, b] = self.ends;
        if self.is_logarithmic { a * (b / a).powf(part) } else { a + part * (b - a) }
    }

    /// Change of the number with the part of the way, whether or not it is rounded to an integer afterwards.
    pub fn slope(&self, part: f64) -> f64 {
        let [a, b] = self.ends;
        if self.is_logarithmic { self.between(part) * (b / a).ln() } else { b - a }
    }

    /// Part of the way at which the integer next to the number at `part` lies.
    fn part_of_integer(&self, part: f64) -> f64 {
        let ([a, b], value) = (self.ends, self.between(part).round());
        if self.is_logarithmic { (value / a).ln() / (b / a).ln() } else { (value - a) / (b - a) }
    }

    /// A value of the range, written with its unit.
    pub fn setting(&self, value: f64, digits: usize) -> Setting {
        let value: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
        let value = if self.is_integer { value.round() } else { value };
        let is_whole = self.is_integer || (self.has_integer_ends && value.fract() == 0.0);
        let text = match self.unit.as_str() {
            "" if is_whole => format!("{value:.0}"),
            "" => format!("{value:?}"),
            unit => format!("\"{value} {unit}\""),
        };
        Setting { value: text, span: self.span.clone(), is_verbatim: false }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::Plan;
    use crate::keys::Between;

    fn values(text: &str) -> Vec<Vec<String>> {
        let plan = Plan::parse(Path::new("plan.toml"), &format!("case = \"a.toml\"\n{text}")).unwrap();
        plan.points().iter().map(|point| point.iter().map(|setting| setting.value.clone()).collect()).collect()
    }

    #[test]
    fn products_and_zips_are_in_order() {
        let keys = "[keys]\n\"b\" = [1, 2]\n\"a\" = [\"x\", \"y\"]\n";
        let [x, y] = ["\"x\"", "\"y\""];
        assert_eq!(values(keys), [["1", x], ["1", y], ["2", x], ["2", y]]);
        assert_eq!(values(&format!("points = \"zip\"\n{keys}")), [["1", x], ["2", y]]);
    }

    #[test]
    fn ranges_have_their_ends_and_units() {
        let of = |range: &str| values(&format!("[keys]\n\"a\" = {{ {range} }}\n")).concat();
        assert_eq!(of("from = \"1.5 mm\", to = \"3 mm\", count = 3"), ["\"1.5 mm\"", "\"2.25 mm\"", "\"3 mm\""]);
        assert_eq!(of("from = 0.1, to = 0.4, count = 4"), ["0.1", "0.2", "0.3", "0.4"]);
        assert_eq!(of("from = 0, to = 1, count = 3"), ["0", "0.5", "1"]);
        assert_eq!(of("from = 1e3, to = 1e5, count = 3, scale = \"logarithmic\""), ["1000.0", "10000.0", "100000.0"]);
        assert_eq!(of("from = 1, to = 4, count = 3, integers = true"), ["1", "3", "4"]);
        assert_eq!(of("from = \"1e-5 m\", to = \"3e-5 m\", count = 2"), ["\"0.00001 m\"", "\"0.00003 m\""]);
    }

    #[test]
    fn the_slope_of_a_range_is_that_before_it_is_rounded() {
        let between = |is_logarithmic, is_integer| Between {
            ends: [1000.0, 4000.0],
            unit: String::new(),
            count: None,
            is_logarithmic,
            is_integer,
            has_integer_ends: true,
            span: 0..0,
        };
        for part in [0.0, 0.3, 0.77, 1.0] {
            assert_eq!(between(false, true).slope(part), 3000.0);
            let logarithmic = between(true, true);
            let step = 1e-6;
            let by_step = (logarithmic.between(part + step) - logarithmic.between(part - step)) / (2.0 * step);
            assert!((logarithmic.slope(part) / by_step - 1.0).abs() < 1e-8);
        }
    }

    #[test]
    fn a_latin_hypercube_has_one_point_in_each_part_of_each_key() {
        let text = "points = { latin_hypercube = { count = 20, seed = 3 } }\n[keys]\n\"a\" = { from = 0.0, to = 20.0 }\n\
                    \"b\" = { from = 0.0, to = 20.0 }\n";
        let points = values(text);
        assert_eq!(points, values(text));
        assert_ne!(points, values(&text.replace("seed = 3", "seed = 4")));
        for d in 0..2 {
            let mut parts: Vec<usize> = points.iter().map(|point| point[d].parse::<f64>().unwrap() as usize).collect();
            assert_ne!(parts, (0..20).collect::<Vec<_>>());
            parts.sort_unstable();
            assert_eq!(parts, (0..20).collect::<Vec<_>>());
        }
    }

    #[test]
    fn trajectories_change_each_key_once_and_use_all_levels() {
        let places = super::morris(5, 40, 4, 2);
        assert_eq!(places, super::morris(5, 40, 4, 2));
        assert_ne!(places, super::morris(5, 40, 4, 3));
        let mut met = [0; 4];
        for trajectory in places.chunks(6) {
            let mut changed = [0; 5];
            for pair in trajectory.windows(2) {
                let steps: Vec<usize> = (0..5).filter(|&d| pair[0][d] != pair[1][d]).collect();
                assert!(steps.len() == 1 && ((pair[0][steps[0]] - pair[1][steps[0]]).abs() - 2.0 / 3.0).abs() < 1e-12);
                changed[steps[0]] += 1;
            }
            assert_eq!(changed, [1; 5]);
            trajectory.iter().flatten().for_each(|place| met[(3.0 * place).round() as usize] += 1);
        }
        assert!(met.iter().all(|&count| (200..400).contains(&count)), "{met:?}");
        let text = "points = { morris = { trajectories = 3 } }\n[keys]\n\"a\" = { from = \"1 mm\", to = \"4 mm\" }\n\
                    \"b\" = [true, false]\n";
        let points = values(text);
        assert_eq!(points.len(), 9);
        assert!(
            points.iter().all(|point| ["\"1 mm\"", "\"2 mm\"", "\"3 mm\"", "\"4 mm\""].contains(&point[0].as_str()))
        );
    }

    #[test]
    fn sobol_points_fill_the_square_and_more_of_them_keep_the_first() {
        let text = |count: usize| {
            format!(
                "points = {{ sobol = {{ count = {count} }} }}\n[keys]\n\"a\" = {{ from = 0.0, to = 1.0 }}\n\
                 \"b\" = [1, 2, 3, 4]\n"
            )
        };
        let points = values(&text(16));
        // A digital net: each quarter of one key meets each value of the other once.
        let mut met: Vec<(usize, String)> =
            points.iter().map(|point| ((4.0 * point[0].parse::<f64>().unwrap()) as usize, point[1].clone())).collect();
        met.sort();
        met.dedup();
        assert_eq!(met.len(), 16, "{points:?}");
        assert_eq!(values(&text(32))[..16], points);
    }
}
