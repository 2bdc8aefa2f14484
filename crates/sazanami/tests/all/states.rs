//! States of a run: seen while it goes on, and read from its files.

use std::f64::consts::PI;
use std::path::Path;
use std::sync::{Arc, Mutex};

use sazanami::case::LoadedCase;
use sazanami::finished::Finished;
use sazanami::run::RunOptions;
use sazanami::saved;
use sazanami::state::{Array, Every, Onlooker, Showing, State, Values, WaterState};
use sazanami_numerics::Real;

use crate::support::{Left, On, Scratch, heard, load, ran};

const DROP: &str = include_str!("../cases/states-drop.toml");

#[derive(Debug, Default)]
struct Seen(Mutex<Vec<State>>);

impl Onlooker for Seen {
    fn see(&self, state: State) {
        self.0.lock().expect("nobody panicked").push(state);
    }
}

/// Runs a case into `folder`, looking at its states.
fn watched(case: &LoadedCase, folder: &Path, on: On, every: Every) -> Vec<State> {
    let seen = Arc::new(Seen::default());
    let showing = Some(Showing { every, to: Arc::clone(&seen) as Arc<dyn Onlooker> });
    let options = RunOptions { showing, ..on.options(Some(folder)) };
    heard(case, &options);
    std::mem::take(&mut *seen.0.lock().expect("nobody panicked"))
}

fn reals(arrays: &[Array], name: &str) -> Vec<Real> {
    match &arrays.iter().find(|array| array.name == name).expect("the array is there").values {
        Values::F64(values) => values.clone(),
        Values::F32(values) => values.iter().map(|&value| value.into()).collect(),
        other => panic!("{other:?}"),
    }
}

fn of_water(state: &State, name: &str) -> Vec<Real> {
    match &state.water {
        Some(WaterState::Grid { arrays, .. }) => reals(arrays, name),
        other => panic!("{other:?}"),
    }
}

#[test]
fn states_are_seen_as_they_are_written_and_change_nothing() {
    let scratch = Scratch::new("states");
    ran(DROP, &[], &scratch.join("alone"), On::threads(1));
    let states = watched(&load(DROP, &[]), &scratch.join("watched"), On::threads(2), Every::Steps(1));
    let steps: Vec<u64> = states.iter().filter_map(|state| state.step).collect();
    assert_eq!(steps, (0..steps.len() as u64).collect::<Vec<_>>());
    let hash = |name: &str| Finished::open(&scratch.join(name)).unwrap().summary["state_hash"].clone();
    assert_eq!(hash("alone"), hash("watched"));
    // What files hold is what was seen at that time, rounded.
    let finished = Finished::open(&scratch.join("watched")).unwrap();
    let times = saved::times(&finished.folder).unwrap();
    assert_eq!(times.len(), 3);
    for time in &times {
        let read = saved::state(time).unwrap();
        let seen = states.iter().find(|state| state.time == time.time).unwrap();
        let near = |a: &[Real], b: &[Real]| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-6 * (1.0 + b.abs()))
        };
        for name in ["position", "velocity", "orientation", "contact_force"] {
            assert!(near(&reals(&read.grains, name), &reals(&seen.grains, name)), "{name}");
        }
        for name in ["liquid_fraction", "velocity", "solid_fraction", "liquid_outside_grains"] {
            assert!(near(&of_water(&read, name), &of_water(seen, name)), "{name}");
        }
    }
    // Control: another time has another state.
    assert_ne!(of_water(&states[0], "velocity"), of_water(states.last().unwrap(), "velocity"));
}

#[test]
fn states_by_time_come_at_any_number_of_ranks() {
    let scratch = Scratch::new("states-ranks");
    let one = watched(&load(DROP, &[]), &scratch.join("one"), On::threads(1), Every::Time(0.2e-3));
    let two = watched(&load(DROP, &[]), &scratch.join("two"), On::ranks(2, 1), Every::Time(0.2e-3));
    // Steps are longer than half of that: the state at the end is the second that is due, and is seen once.
    assert_eq!(one.len(), 3);
    assert!((0.2e-3..0.4e-3).contains(&one[1].time) && (one[2].time - 0.5e-3).abs() < 1e-12);
    assert_eq!(one.len(), two.len());
    for (a, b) in one.iter().zip(&two) {
        let (a, b) = (of_water(a, "liquid_fraction"), of_water(b, "liquid_fraction"));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-6));
    }
}

/// Still water with a sphere in it that is held, six cells wide.
const HELD: &str = include_str!("../cases/states-held.toml");

#[test]
fn where_liquid_has_no_room_nothing_is_reported() {
    let scratch = Scratch::new("states-room");
    let run_with = |exchange: &str, ranks: usize| {
        let folder = scratch.join(&format!("{exchange}-{ranks}"));
        let case = load(HELD, &[&format!("coupling.exchange={exchange}")]);
        (watched(&case, &folder, On::ranks(ranks, 1), Every::Steps(1)).remove(0), Left::in_folder(&folder))
    };
    let first = |left: &Left, probe: &str, column: &str| left.probe(probe).column(column)[0];
    let close = |a: Real, b: Real| (a - b).abs() < 1e-9;
    for ranks in [1, 2] {
        let (state, left) = run_with("surface", ranks);
        let [share, outside, solid] =
            ["liquid_fraction", "liquid_outside_grains", "solid_fraction"].map(|name| of_water(&state, name));
        let covered = share.iter().filter(|share| share.is_nan()).count();
        // The cells wholly within the sphere, of which it has 113 in volume.
        assert!((30..113).contains(&covered), "{covered}");
        for ((share, outside), solid) in share.iter().zip(&outside).zip(&solid) {
            let expected = if share.is_nan() { 0.0 } else { share * (1.0 - solid) };
            assert!(close(*outside, expected), "{share} {outside} {solid}");
        }
        assert!(first(&left, "grain", "liquid_fraction").is_nan());
        assert!(close(first(&left, "water", "liquid_fraction"), 1.0));
        assert!(close(first(&left, "over", "water_level"), 5e-3), "{}", first(&left, "over", "water_level"));
        // The front lies within a cell: at 13.3 of them.
        assert!(close(left.column("front")[0], 6.65e-3), "{}", left.column("front")[0]);
    }
    // Control: liquid in whole cells is within grains too.
    let (state, left) = run_with("stress", 1);
    assert!(of_water(&state, "liquid_fraction").iter().all(|share| share.is_finite()));
    assert!(close(first(&left, "grain", "liquid_fraction"), 1.0));
    assert!(close(left.column("front")[0], 6.65e-3));
}

#[test]
fn the_liquid_of_a_file_is_that_outside_its_grains() {
    let scratch = Scratch::new("states-file");
    let ball = "liquid.0={ region.sphere = { diameter = \"5 mm\" }, position = [\"4 mm\", \"4 mm\", \"4 mm\"], allow_touching_grains = true }";
    let inside = "grains.0.placement.list=[{ position = [\"4 mm\", \"4 mm\", \"4 mm\"] }]";
    let fields = "output.fields={ at = [\"0 s\"] }";
    for exchange in ["surface", "stress"] {
        let folder = scratch.join(exchange);
        let chosen = format!("coupling.exchange={exchange}");
        ran(HELD, &[ball, inside, fields, &chosen], &folder, On::threads(1));
        let file = std::fs::read_dir(folder.join("fields")).unwrap().map(|file| file.unwrap().path()).min().unwrap();
        let text = format!(
            "[domain]\nsize = [\"8 mm\", \"8 mm\", \"8 mm\"]\ncells = [16, 16, 16]\n[run]\nuntil = \"10 us\"\n[[liquid]]\n\
             region.file.file = \"{}\"\nposition = [\"4 mm\", \"4 mm\", \"4 mm\"]\nvelocity = [\"0 m/s\", \"0 m/s\", \"-0.5 m/s\"]\n",
            file.display()
        );
        let left = ran(&text, &[], &scratch.join(&format!("{exchange}-taken")), On::threads(1));
        let volume = left.column("momentum_liquid_3")[0] / (-0.5 * 1000.0);
        // A ball of 5 mm around one of 3 mm, which with it has a fifth more.
        let exact = PI / 6.0 * (125.0 - 27.0) * 1e-9;
        assert!((volume / exact - 1.0).abs() < 0.01, "{exchange}: {volume} beside {exact}");
    }
}

/// A layer of held spheres of 1 mm, side by side, with liquid between 0.4 and 0.8 mm, and above them.
const SOAKED: &str = include_str!("../cases/states-soaked.toml");

#[test]
fn liquid_in_the_bed_is_that_below_its_first_surface() {
    let scratch = Scratch::new("states-soaked");
    // A slab of a sphere of radius 0.5, from 0.1 below its middle to 0.3 above [mm^3].
    let slab = PI * (0.25 * 0.4 - (0.3_f64.powi(3) + 0.1_f64.powi(3)) / 3.0);
    let exact = 36.0 * (0.4 - slab);
    for (exchange, ranks) in [("stress", 1), ("surface", 1), ("surface", 2)] {
        let folder = scratch.join(&format!("{exchange}-{ranks}"));
        let left = ran(SOAKED, &[&format!("coupling.exchange={exchange}")], &folder, On::ranks(ranks, 1));
        let found = |name: &str| left.summary["observables"]["soaked"][name].as_f64().unwrap();
        let [depth, volume] = ["wetted_depth", "soaked_volume"].map(|name| left.column(name)[0]);
        // The tops of the spheres, smoothed.
        assert!((0.8..=1.05).contains(&found("level_mm")), "{}", found("level_mm"));
        assert!((1e3 * depth - (found("level_mm") - 0.4)).abs() < 1e-6, "{depth}");
        assert!((1e9 * volume / exact - 1.0).abs() < 0.01, "{volume} beside {exact}");
        // Negative control: grains counted as liquid.
        assert!((36.0 * 0.4 / exact - 1.0).abs() > 0.5);
    }
    // Negative control: a bed without liquid in it.
    let above =
        "liquid=[{ region.box = { lower = [\"0 mm\", \"0 mm\", \"2 mm\"], upper = [\"6 mm\", \"6 mm\", \"3 mm\"] } }]";
    let left = ran(SOAKED, &[above], &scratch.join("dry"), On::threads(1));
    assert_eq!(["wetted_depth", "soaked_volume"].map(|name| left.column(name)[0]), [0.0, 0.0]);
}
