//! What the keys of a tank mean, what is refused and what is warned of.

use std::path::Path;

use sazanami::case::meaning::Solver;
use sazanami::case::resolved::{self, Paths};
use sazanami_mps::scheme::ParticleProjection;
use sazanami_numerics::Real;

use super::{FORMULA, TANK, recorded, warned};
use crate::support::{On, Scratch, load, ran, refusal};

#[test]
fn the_projection_suits_the_case_and_the_radius_the_projection() {
    let dam = include_str!("../../../../../cases/both/dam-break.toml");
    let of = |text: &str, change: &[&str]| {
        let case = load(text, change).case;
        // The copy of a case means the same, keys that have no effect left out.
        let again = load(&resolved::write(&case, Paths::AsGiven), &[]);
        assert_eq!(again.case, case, "{change:?}");
        assert!(!again.warnings.render(&again.source, false).contains("no effect"), "{change:?}");
        let Some(particles) = case.particles else { panic!("moving particles") };
        (particles.projection, particles.radius)
    };
    let (conjugate, enhanced) = (ParticleProjection::Conjugate, ParticleProjection::Enhanced);
    assert_eq!(of(dam, &[]), (conjugate, 2.6));
    assert_eq!(of(dam, &["particles.radius=3.1"]), (conjugate, 3.1));
    let alone = refusal(dam, &["particles.projection=enhanced"]);
    assert!(
        alone.contains("part of `preset = \"paper_literal\"`") && alone.contains("leave `projection` out"),
        "{alone}"
    );
    assert_eq!(of(&format!("preset = \"paper_literal\"\n{dam}"), &[]), (enhanced, 3.1));
    assert_eq!(of(TANK, &[]), (conjugate, 2.6));
    assert_eq!(of(&format!("preset = \"paper_literal\"\n{TANK}"), &[]), (enhanced, 3.1));
    // Between grains particles are up to half as large again, and so is the least width of a periodic tank.
    let short = refusal(&TANK.replace("\"8 mm\"", "\"7 mm\""), &[]);
    assert!(short.contains("too short along x2") && short.contains("7.7"), "{short}");
    for key in ["shifting=0.5", "stabilisation=off", "stabilisation_distance=0.9"] {
        let message = refusal(dam, &[&format!("particles.{key}")]);
        assert!(message.contains("is no longer a key") && message.contains("leave the key out"), "{message}");
    }
    let message = refusal(dam, &["particles.radius=2.1"]);
    assert!(message.contains("is below 2.6") && message.contains("`radius = 2.6` or more"), "{message}");
}

#[test]
fn the_cycles_of_a_case_are_those_of_all_that_swings() {
    let tunnel = include_str!("../../../../../cases/ripples/tunnel.toml");
    let of = |change: &[&str]| load(tunnel, change).case.period();
    assert_eq!(of(&[]), Some(1.0));
    let both = |frequency: &str| {
        let amplitude = "amplitude = [\"0.1 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]";
        of(&[&format!("frame.oscillation={{ {amplitude}, frequency = \"{frequency}\" }}")])
    };
    assert_eq!([both("2 Hz"), both("0.5 Hz"), both("0.7 Hz")], [Some(1.0), Some(2.0), None]);
    assert_eq!(load(TANK, &[]).case.period(), Some(0.2));
    // Control: a steady flow has none.
    assert_eq!(load(include_str!("../../../../../cases/ripples/channel.toml"), &[]).case.period(), None);
}

#[test]
fn resolved_tanks_mean_the_same() {
    let first = load(TANK, &["frame.motion.walls=moving", "particles.dt=0.1 ms", "overlap.forchheimer=0.55"]).case;
    assert_eq!(first.solver, Solver::Mps);
    let again = load(&resolved::write(&first, Paths::AsGiven), &[]).case;
    assert_eq!(first, again);
    assert_eq!(resolved::hash(&first), resolved::hash(&again));
    let literal = load(&format!("preset = \"paper_literal\"\n{TANK}"), &[]).case;
    assert_eq!(literal.overlap.blend, [0.4, 0.4]);
}

#[test]
fn defaults_written_out_mean_the_same() {
    let cases = [
        "cases/both/dam-break.toml",
        "cases/both/settling-sphere.toml",
        "cases/dam-over-bed.toml",
        "cases/ripples/quick.toml",
        "cases/ripples/tunnel.toml",
        "cases/templates/shaken_tank.toml",
    ];
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for name in cases {
        let text = std::fs::read_to_string(root.join(name)).expect("a shipped case");
        let case = load(&text, &[]).case;
        assert_eq!(
            case.particles.as_ref().map(|particles| particles.projection),
            Some(ParticleProjection::Conjugate),
            "{name}"
        );
        let whole: toml::Table = resolved::write(&case, Paths::AsGiven).parse().expect("the copy is TOML");
        let mut written = 0;
        for table in ["particles", "overlap"] {
            for (key, value) in whole.get(table).and_then(toml::Value::as_table).into_iter().flatten() {
                let again = load(&text, &[&format!("{table}.{key}={value}")]).case;
                assert_eq!(again, case, "{name}: {table}.{key} = {value}");
                written += 1;
            }
        }
        // Without grains the copy has no `[overlap]`.
        let least = if case.grains.is_empty() { 8 } else { 16 };
        assert!(written >= least, "{name}: {written} keys");
    }
}

#[test]
fn wrong_tanks_are_refused_with_a_reason() {
    let scratch = Scratch::new("wrong");
    let size = |x: &str, y: &str| format!("domain.size=[\"{x}\",\"{y}\",\"14 mm\"]");
    for (changes, reason) in [
        (vec![size("14 mm", "6 mm")], "for the radius of influence"),
        (vec![size("14.5 mm", "8 mm")], "no lattice of wall particles fits"),
        (vec!["grains.0.shape.sphere.diameter=2.5 mm".into()], "too large for its tank"),
        (vec!["liquid.0.region.box.upper=[\"7 mm\",\"8 mm\",\"15 mm\"]".into()], "deeper than the tank"),
        (
            vec![
                "boundary.x3=periodic".into(),
                "boundary.x3_upper=periodic".into(),
                "boundary.x3_lower=periodic".into(),
            ],
            "needs a floor",
        ),
        (vec!["particles.radius=1.9".into()], "has to lie between 2.1 and 3.6"),
        (vec!["particles.radius=3.7".into()], "has to lie between 2.1 and 3.6"),
        (vec!["particles.radius=2.5".into()], "is below 2.6, the least of `projection = \"conjugate\"`"),
        (vec!["overlap.smoothing=1.05 mm".into()], "is below 2.1 spacings"),
        (vec!["overlap.reach=0.8".into()], "grains read the water within `overlap.smoothing`"),
        (
            vec!["preset=paper_literal".into(), "boundary.x1=slip".into()],
            "walls of the published scheme have one kind of friction",
        ),
        (
            vec!["boundary.x1_lower={ inflow = { velocity = [\"1 m/s\",\"0 m/s\",\"0 m/s\"] } }".into()],
            "cannot have the side x1_lower: it is `inflow`",
        ),
        (
            vec!["boundary.x3_upper={ moving = { velocity = [\"1 m/s\",\"0 m/s\",\"0 m/s\"] } }".into()],
            "cannot have the side x3_upper: it is `moving`",
        ),
        (vec!["overlap.blend=[0.5, 0.4]".into()], "a lower and an upper"),
        (vec!["overlap.pressure_force=implicit".into()], "`pressure_force` is no longer a key"),
        (vec!["overlap.added_mass=zubr".into()], "did you mean `zuber`?"),
        (
            vec!["overlap.added_mass=zuber".into(), "overlap.added_mass_coefficient=-0.5".into()],
            "has to lie between 0 and 10",
        ),
        (vec!["output.grain_arrays=[\"lift\"]".into()], "grains in this run have no `lift`"),
        (
            vec!["overlap.lift=mei".into(), "output.grain_arrays=[\"added_mass_force\"]".into()],
            "grains in this run have no `added_mass_force`",
        ),
        (vec!["preparation.state=nowhere.state".into()], "there is no file"),
        (vec!["solver=mics".into(), "domain.cells=[14,8,14]".into()], "ripples are observed with"),
        (vec!["particles.spacing=1 s".into()], "wrong unit"),
        (vec!["particles.spacng=1 mm".into()], "did you mean `spacing`?"),
    ] {
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let message = refusal(TANK, &changes);
        assert!(message.contains(reason), "{changes:?}: {message}");
    }
    let no_sphere =
        TANK.replace("shape.sphere = { diameter = \"1 mm\" }", "shape.box = { size = [\"1 mm\",\"1 mm\",\"1 mm\"] }");
    let boxes = refusal(&no_sphere, &[]);
    assert!(boxes.contains("is no sphere"), "{boxes}");
    let csv = scratch.join("bad.csv");
    let measured = format!("[[ripples.measured]]\ntime = \"0.1 s\"\nbed = \"{}\"\n[[probe]]", csv.display());
    let with_bed = TANK.replacen("[[probe]]", &measured, 1);
    let nothing = TANK.replacen("[[probe]]", "[[ripples.measured]]\ntime = \"0.1 s\"\n[[probe]]", 1);
    let moved = recorded(&csv);
    for (text, content, reason) in [
        (&nothing, "", "nothing was measured at this time"),
        (&with_bed, "x_m,y_m\n0,1\n", "z_m"),
        (&with_bed, "x_m,z_m\n0,1\n0.1,2\n0.05,1\n", "line 4"),
        (&with_bed, "x_m,z_m\n0,0.01\n0.05,0.01\n0.1,0.01\n", "reaches out of the tank"),
        (&with_bed, "x_m,z_m\n0.001,10\n0.005,10\n0.01,11\n", "reaches out of the tank"),
        (&moved, "t_s,x_mm\n0,0\n1,1\n", "x_m"),
        (&moved, "t_s,x_m\n0,0\n0.2,0\n0.1,0\n2,0\n", "line 4"),
        (&moved, "t_s,x_m\n0,0\n0.5,0.001\n", "ends before the run"),
        (&moved, "t_s,x_m\n0.1,0\n5,0.001\n", "begins after the run"),
    ] {
        std::fs::write(&csv, content).unwrap();
        let message = refusal(text, &[]);
        assert!(message.contains(reason), "{reason}: {message}");
    }
}

#[test]
fn waves_that_a_tank_will_make_are_expected_on_either_axis_and_from_a_record() {
    let told = |text: &str, change: &[&str], what: &str| warned(text, change).iter().any(|w| w.contains(what));
    let (resonant, dry, thin) = ("near resonance", "dries at its ends", "thinner than a particle");
    // 4 mm of water at 5 Hz: half a wave is 19.8 mm.
    let longer = [
        "domain.lower=[\"-10 mm\",\"0 mm\",\"0 mm\"]",
        "domain.size=[\"20 mm\",\"8 mm\",\"14 mm\"]",
        "liquid.0.region.box.lower=[\"-10 mm\",\"0 mm\",\"0 mm\"]",
        "liquid.0.region.box.upper=[\"10 mm\",\"8 mm\",\"7 mm\"]",
    ];
    assert!(told(TANK, &longer, resonant) && told(TANK, &longer, dry) && told(TANK, &longer, thin));
    assert!(!told(TANK, &[], resonant) && !told(TANK, &[], dry));
    let thick = ["fluid.liquid.density=1000 kg/m^3", "fluid.liquid.kinematic_viscosity=1e-4 m^2/s"];
    assert!(!told(TANK, &thick, thin));
    // The same motion as a record.
    let scratch = Scratch::new("record");
    let csv = scratch.join("record.csv");
    let at = |t: Real| -2e-3 * (t / 0.02).min(1.0) * (10.0 * std::f64::consts::PI * t).sin();
    let rows = (0..=1000).map(|n| 2e-3 * Real::from(n)).map(|t| format!("{t},{}\n", at(t)));
    std::fs::write(&csv, format!("t_s,x_m\n{}", rows.collect::<String>())).unwrap();
    let recorded = recorded(&csv);
    assert!(told(&recorded, &longer, resonant) && !told(&recorded, &[], resonant));
    // And along x2, between walls there.
    let across = TANK
        .replace("x2 = \"periodic\"", "x1 = \"periodic\"")
        .replace("amplitude = [\"-2 mm\", \"0 mm\", \"0 mm\"]", "amplitude = [\"0 mm\", \"-2 mm\", \"0 mm\"]");
    let wider =
        ["domain.size=[\"14 mm\",\"20 mm\",\"14 mm\"]", "liquid.0.region.box.upper=[\"7 mm\",\"20 mm\",\"7 mm\"]"];
    assert!(told(&across, &wider, resonant) && !told(&across, &[], resonant));
    // In a frame that oscillates: 2 mm at 5 Hz.
    let formula = format!("[frame.motion]\n{FORMULA}");
    let shaken = "[frame.oscillation]\namplitude = [\"1.97 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]\nfrequency = \"5 Hz\"";
    let oscillating = TANK.replace(&formula, shaken);
    assert!(told(&oscillating, &longer, resonant) && !told(&oscillating, &[], resonant));
}

#[test]
fn without_grains_no_particle_is_short_of_room() {
    let scratch = Scratch::new("least-void");
    let alone = "solver = \"mps\"\ndomain.size = [\"14 mm\", \"8 mm\", \"14 mm\"]\nparticles.spacing = \"1 mm\"\nrun.until = \"1 s\"\n\
                 output = { figures = { at = [] }, fields = { at = [] }, series = { steps = 1 } }\n\
                 [[liquid]]\nregion.half_space.point = [\"0 mm\", \"0 mm\", \"7 mm\"]\n";
    let left = ran(alone, &["run.until=1 ms"], &scratch.join("run"), On::threads(1));
    assert!(left.column("least_void_fraction").iter().skip(1).all(|least| *least == 1.0));
    assert_eq!(left.summary["particles"]["least_void"].as_f64(), Some(1.0));
    // Negative control: between grains there is less.
    let left = ran(TANK, &["probe=[]", "run.until=1 ms"], &scratch.join("grains"), On::threads(1));
    assert!(left.column("least_void_fraction").iter().skip(1).all(|least| *least < 0.9));
}
