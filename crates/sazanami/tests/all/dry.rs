//! Grains in a tank of moving particles without water: they fall as grains do, and no step is paid for water.

use crate::support::{Left, On, Scratch, load, start};
use sazanami::check::{CostModel, Known, check};
use sazanami::machine::Machine;

/// A bead that falls for 20 ms.
const TANK: &str = include_str!("../cases/dry-tank.toml");

const WATER: &str =
    "[[liquid]]\nregion.box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"10 mm\", \"10 mm\", \"3 mm\"] }\n";

#[test]
fn dry_grains_fall_and_pay_for_no_water() {
    let folder = Scratch::new("dry");
    for (name, text) in [("dry", TANK.to_owned()), ("wet", format!("{TANK}{WATER}"))] {
        let is_dry = name == "dry";
        let loaded = load(&text, &[]);
        let told = check(&loaded.case, Known::default(), &Machine::this(), 1, &CostModel::default());
        let fluid = told.predicted_s.iter().find(|(part, _)| *part == "fluid").map(|(_, seconds)| *seconds);
        assert_eq!(fluid == Some(0.0), is_dry, "{:?}", told.predicted_s);
        start(&loaded, &folder.join(name), On::threads(1)).unwrap_or_else(|error| panic!("{error}"));
        let left = Left::in_folder(&folder.join(name));
        // The control: with water there is a pressure to solve for.
        assert_eq!(left.summary["phase_s"]["pressure"].as_f64().unwrap_or_default() == 0.0, is_dry, "{}", left.summary);
        let table = crate::support::Table::read(&folder.join(name).join("probes/bead.csv"));
        let (times, heights) = (table.column("time"), table.column("position_3"));
        let (time, height) = (times[times.len() - 1], heights[heights.len() - 1]);
        let fallen = 0.5 * 9.81 * time * time;
        assert!((10e-3 - height - fallen).abs() < 0.01 * fallen, "{name}: {height} after {time}");
    }
}
