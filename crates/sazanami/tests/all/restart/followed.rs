//! A box that falls with its liquid, and the liquid of such a run in another one.

use super::*;

/// A quarter of a drop that falls from rest.
const FALLING: &str = include_str!("../../cases/followed-drop.toml");

#[test]
fn a_box_falls_with_its_drop_to_the_same_bits_and_hands_it_on() {
    let scratch = Scratch::new("followed");
    let whole = scratch.join("whole");
    let left = ran(FALLING, &[], &whole, On::ranks(1, 1));
    let [time, speed, held] = ["time", "box_velocity_3", "mean_velocity_3"].map(|name| left.column(name));
    let last = time.len() - 1;
    // The gas bears a thousandth of the weight at these speeds.
    assert!((speed[last] / (-9.81 * time[last]) - 1.0).abs() < 0.02, "{} at {}", speed[last], time[last]);
    assert!(held[1..].iter().all(|u| u.abs() < 0.02 * speed[last].abs()), "{held:?}");
    // Negative control: a box that stands still is left behind.
    let fallen = ran(FALLING, &["frame={}"], &scratch.join("still"), On::ranks(1, 1)).column("momentum_liquid_3");
    let carried = left.column("momentum_liquid_3");
    assert!(carried[last].abs() < 0.02 * fallen[last].abs(), "{} of {}", carried[last], fallen[last]);

    let broken = scratch.join("broken");
    ran(FALLING, &[], &broken, On::ranks(2, 1).steps(STEPS));
    let (second, _) = go_on(&broken, On::ranks(2, 1));
    assert_eq!(second.expect("the case is sound").status, Status::Finished);
    let two = scratch.join("two");
    let on_two = ran(FALLING, &[], &two, On::ranks(2, 1)).column("box_velocity_3");
    assert_same(&broken, &two, "a box that follows its liquid");
    assert!(on_two.iter().zip(&speed).skip(1).all(|(a, b)| (a - b).abs() < 1e-6), "{on_two:?} {speed:?}");

    let fields = std::fs::read_dir(whole.join("fields")).unwrap().map(|file| file.unwrap().path()).max().unwrap();
    let region = format!(
        "region.file={{ file = \"{}\", mirrored_in = \"x1_x2\", axis = [0, 1, 0], angle = \"90 deg\" }}",
        fields.display()
    );
    let changes = [
        "domain={ size = [\"3 mm\", \"3 mm\", \"3 mm\"], cells = [12, 12, 12] }",
        "boundary={ all = \"slip\", x3_upper = \"outflow\" }",
        "frame={}",
        "run.until=1 ms",
        &format!(
            "liquid.0={{ name = \"drop\", {}, position = [\"1.5 mm\", \"1.5 mm\", \"1.5 mm\"], velocity = [\"0 m/s\", \"0 m/s\", \"-0.5 m/s\"] }}",
            region.replacen('=', " = ", 1)
        ),
    ];
    let taken = scratch.join("taken");
    let drop = ran(FALLING, &changes, &taken, On::ranks(1, 1));
    let volume = std::f64::consts::PI / 6.0 * 2.2 * 2.2 * 1.7 * 1e-9;
    let momentum = drop.column("momentum_liquid_3")[0] + drop.column("momentum_gas_3")[0];
    assert!((momentum / (-0.5 * 998.2 * volume) - 1.0).abs() < 0.02, "{momentum}");

    // Where it would reach over the edge of the box it is refused.
    let over = changes.map(|change| change.replace("position = [\"1.5 mm\"", "position = [\"0.5 mm\""));
    let over = findings(FALLING, &over.each_ref().map(String::as_str));
    assert_eq!(over, ["`drop`, from a file, does not fit into the box"]);

    // Lengthened, moved and lengthened again: its own copy of the file goes with it.
    let longer = |folder: &Path, time: f64| {
        let options = RunOptions { until: Some(time), ..On::threads(1).options(None) };
        go_on_with(folder, &options).0
    };
    std::fs::remove_dir_all(&whole).unwrap();
    assert_eq!(longer(&taken, 1.1e-3).unwrap().status, Status::Finished);
    let moved = scratch.join("moved");
    std::fs::rename(&taken, &moved).unwrap();
    assert_eq!(longer(&moved, 1.2e-3).unwrap().status, Status::Finished);
}
