//! Figures of ripples in a shaken tank, from a bed and water that are made up.

use std::f64::consts::{PI, TAU};

use sazanami::artist::{LayerHistory, RippleHistory, Surfaces};
use sazanami_numerics::Vector;
use sazanami_picture::{
    ColourMap, ColourScale, LayerFigure, Picture, ProfileFigure, SlabPanel, SlabView, VectorWindow, ripple_growth,
    sheet,
};

const X: [f64; 2] = [-0.075, 0.075];
const D: f64 = 1e-3;

fn bed(x: f64, height: f64) -> f64 {
    let envelope = (PI * x / 0.15).cos();
    0.010 + 0.5 * height * envelope * (TAU * x / 0.022 + 0.4).sin()
}

fn water(x: f64, phase: f64) -> f64 {
    0.020 + 4e-3 * (41.2 * x).sin() * phase.cos() + 0.8e-3 * (90.0 * x + phase).cos()
}

fn curve(height: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    (0..300).map(|n| X[0] + 0.5e-3 * (f64::from(n) + 0.5)).map(|x| [x, height(x)]).collect()
}

/// Numbers between 0 and 1 that look drawn by lot.
fn lot(n: usize) -> f64 {
    (n as f64 * 0.754_877_666 + 0.13).fract()
}

fn measured(height: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    curve(height).into_iter().enumerate().map(|(n, [x, z])| [x, z + 0.3e-3 * (lot(n) - 0.5)]).collect()
}

fn profiles(with_experiment: bool) -> Picture {
    let moment = |time: f64, own: f64, other: f64| Surfaces {
        title: format!("t = {time:.1} s"),
        bed: vec![
            ("L = 0.15 m, reference".to_owned(), curve(|x| bed(x, own))),
            ("half the friction".to_owned(), curve(|x| bed(x + 2e-3, 0.7 * own))),
        ],
        water: vec![
            ("L = 0.15 m, reference".to_owned(), curve(|x| water(x, time))),
            ("half the friction".to_owned(), curve(|x| water(x, time + 0.3))),
        ],
        other_beds: vec![("seen from the side".to_owned(), curve(|x| bed(x, own) + 4e-4))],
        first_bed: curve(|_| 0.01),
        first_water: curve(|_| 0.02),
        measured_bed: measured(|x| bed(x + 1e-3, other)),
        measured_water: if time > 5.0 { Vec::new() } else { measured(|x| 1.1 * water(x, time) - 0.002) },
    };
    let mut moments = [moment(3.0, 1.5e-3, 1.6e-3), moment(7.0, 2.6e-3, 4.0e-3)];
    if !with_experiment {
        for moment in &mut moments {
            moment.measured_bed.clear();
            moment.measured_water.clear();
        }
    }
    let figure = ProfileFigure { title: "Bed and water surface", moments: &moments, x_range: X };
    figure.draw().expect("profiles")
}

struct Bed {
    position: Vec<Vector>,
    speed: Vec<f64>,
    drag: Vec<f64>,
    pressure: Vec<f64>,
}

fn grains() -> Bed {
    let mut bed_of = Bed { position: vec![], speed: vec![], drag: vec![], pressure: vec![] };
    for n in 0..36_000 {
        let (i, j, k) = (n % 150, n / 150 % 20, n / 3000);
        let jitter = |c: usize| 0.5 * D * (lot(3 * n + c) - 0.5);
        let x = X[0] + D * (i as f64 + 0.5 + 0.5 * (k % 2) as f64) + jitter(0);
        let place = Vector::new(x, D * (j as f64 + 0.5) + jitter(1), D * (0.5 + 0.87 * k as f64) + 0.3 * jitter(2));
        let depth = bed(x, 3e-3) - place.z;
        if depth > 0.0 && x < X[1] {
            let near = (-depth / 2e-3).exp() * (PI * x / 0.15).cos();
            bed_of.position.push(place);
            bed_of.speed.push(0.11 * near * (0.7 + 0.3 * lot(n)));
            bed_of.drag.push(7e-6 * near * (0.5 + lot(n + 7)));
            bed_of.pressure.push(-1.2e-6 * (41.2 * x).cos() * (0.4 + 0.6 * (place.z / 0.01)));
        }
    }
    bed_of
}

fn section(slab: [f64; 2]) -> Picture {
    let grains = grains();
    let scales = [
        ColourScale { label: "speed of the grains [m/s]".to_owned(), range: [0.0, 0.1], map: ColourMap::Viridis },
        ColourScale::symmetric("drag f_{d,x} [N]", 8e-6),
        ColourScale::symmetric("pressure-gradient force f_{p,x} [N]", 2e-6),
    ];
    let values = [&grains.speed, &grains.drag, &grains.pressure];
    let panels: Vec<_> = scales.iter().zip(values).map(|(scale, values)| SlabPanel { values, scale }).collect();
    let vectors: Vec<_> = (0..441)
        .map(|n| [-0.010 + 1e-3 * f64::from(n % 21), 0.004 + 1e-3 * f64::from(n / 21)])
        .filter(|[x, z]| *z < water(*x, 3.0))
        .map(|[x, z]| {
            let outer = ((z - bed(x, 3e-3)) / 2e-3).clamp(-3.0, 2.0).exp().min(1.0);
            ([x, z], [0.2 * outer, 0.05 * outer * (TAU * x / 0.022).cos()])
        })
        .collect();
    let window = VectorWindow { x: [-0.010, 0.010], z: [0.004, 0.024], vectors: &vectors, reference: 0.2 };
    let diameter = vec![D; grains.position.len()];
    let surface = curve(|x| water(x, 3.0));
    let view = SlabView {
        title: "t = 3.0 s",
        note: "grains of the whole width",
        x: X,
        z: [0.0, 0.028],
        slab,
        position: &grains.position,
        diameter: &diameter,
        panels: &panels,
        water: &surface,
        vectors: Some(&window),
        width: 1000,
    };
    view.draw().expect("a section")
}

fn layers(names: &[&str]) -> Picture {
    let run = |number: usize, name: &&str| {
        let time: Vec<f64> = (0..=140).map(|n| 0.05 * f64::from(n)).collect();
        let growth = |t: f64| (t / 0.5).min(1.0) * (1.0 - 0.2 * number as f64);
        let series = |amplitude: f64, lag: f64| -> Vec<f64> {
            time.iter().map(|&t| amplitude * growth(t) * (TAU * (2.0 * t - lag)).sin()).collect()
        };
        let quantities = |part: f64| {
            [series(0.05 * part, 0.0), series(0.03 * part * part, 0.05), series(4e-6 * part, 0.02), series(9e-7, 0.3)]
        };
        let (upper, lower) = (quantities(1.0), quantities(0.1));
        LayerHistory { label: (*name).to_owned(), time, upper, lower }
    };
    let runs: Vec<_> = names.iter().enumerate().map(|(number, name)| run(number, name)).collect();
    let figure = LayerFigure {
        title: "Averages over the layers of the bed",
        runs: &runs,
        layers: ["upper layer, 5 ≤ z/d < 10", "lower layer, 0 ≤ z/d < 5"],
        time_range: if names.len() > 1 { Some([5.0, 7.0]) } else { None },
        ranges: [Some([-0.06, 0.06]), Some([-0.04, 0.04]), None, None],
        submerged_weight: (names.len() > 1).then_some(8.475e-6),
    };
    figure.draw().expect("layers")
}

fn growth(log: bool) -> Picture {
    let times = || (1..=140).map(|n| 0.05 * f64::from(n));
    let run = |label: &str, rate: f64, length: f64| RippleHistory {
        label: label.to_owned(),
        height: times().map(|t| [t, 3.2e-3 / (1.0 + 30.0 * (-rate * t).exp())]).collect(),
        wavelength: times().filter(|t| *t > 1.0).map(|t| [t, length * (1.0 - 0.4 * (-t).exp())]).collect(),
        measured: false,
    };
    let experiment = RippleHistory {
        label: "experiment".to_owned(),
        height: vec![[3.0, 1.6e-3], [7.0, 4e-3]],
        wavelength: vec![[3.0, 19e-3], [7.0, 22e-3]],
        measured: true,
    };
    let runs =
        [run("L = 0.15 m", 0.9, 21e-3), run("L = 0.20 m", 0.7, 24e-3), run("L = 0.30 m", 0.4, 18e-3), experiment];
    ripple_growth("Growth of the ripples", &runs, log).expect("growth")
}

fn differences(a: &Picture, b: &Picture) -> usize {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()));
    a.pixels().iter().zip(b.pixels()).filter(|(a, b)| a != b).count()
}

fn pixels_of(picture: &Picture, colour: [u8; 3]) -> usize {
    picture.pixels().iter().filter(|&&pixel| pixel == colour).count()
}

const FIRST: [u8; 3] = [0, 90, 160];
const SECOND: [u8; 3] = [213, 94, 0];

#[test]
fn profiles_show_every_run_and_the_experiment_where_there_is_one() {
    let (both, none) = (profiles(true), profiles(false));
    assert!(pixels_of(&both, FIRST) > 3000 && pixels_of(&both, SECOND) > 3000);
    let black = |picture: &Picture| pixels_of(picture, [20, 20, 22]);
    assert!(black(&both) > black(&none) + 2000, "{} {}", black(&both), black(&none));
    assert_eq!(differences(&both, &profiles(true)), 0, "the same input gives the same pixels");
}

#[test]
fn water_without_a_bed_has_one_panel() {
    let draw = |bed: Vec<[f64; 2]>| {
        let moment = Surfaces {
            title: "t = 1 s".into(),
            bed: vec![("bed".into(), bed)],
            water: vec![(String::new(), curve(|x| water(x, 1.0)))],
            ..Surfaces::default()
        };
        ProfileFigure { title: "Water", moments: &[moment], x_range: X }.draw().expect("profiles")
    };
    let (alone, over_bed) = (draw(Vec::new()), draw(curve(|x| bed(x, 2e-3))));
    assert!(over_bed.height() > alone.height() + 250, "{} {}", over_bed.height(), alone.height());
    assert!(pixels_of(&alone, FIRST) > 1000);
}

#[test]
fn a_slab_colours_its_own_grains() {
    let (slab, whole) = (section([0.0085, 0.0115]), section([0.0, 0.02]));
    assert_eq!(differences(&slab, &section([0.0085, 0.0115])), 0);
    assert!(differences(&slab, &whole) > 50_000);
    // Three panels, and a window beside them as high as they are.
    assert!(slab.width() > 1900 && slab.height() > 700, "{slab:?}");
    let two = sheet("Two times", &[vec![slab.clone()], vec![whole]]);
    assert!(two.height() > 2 * slab.height() && two.width() == slab.width());
}

#[test]
fn layers_are_told_apart_by_their_lines() {
    let (one, two) = (layers(&[""]), layers(&["L = 0.15 m", "L = 0.20 m"]));
    assert!(pixels_of(&one, FIRST) > 5000 && pixels_of(&one, SECOND) == 0);
    assert!(pixels_of(&two, SECOND) > 2000);
}

#[test]
fn growth_is_drawn_on_both_axes() {
    let (linear, log) = (growth(false), growth(true));
    assert!(differences(&linear, &log) > 1000);
    for picture in [linear, log] {
        assert!(pixels_of(&picture, FIRST) > 1500 && pixels_of(&picture, SECOND) > 1500);
    }
}
