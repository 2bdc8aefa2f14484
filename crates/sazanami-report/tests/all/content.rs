//! Contents of reports, and refusals.

use std::fs;

use crate::support::{BAD, results, shaken_results};

#[test]
fn a_report_holds_all_it_shows_and_takes_no_text_for_markup() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 8, 2, [4, 4, 4]);
    let path = sazanami_report::of_run(folder.path()).unwrap();
    assert_eq!(path, folder.path().join("report.html"));
    let page = fs::read_to_string(path).unwrap();
    for expected in [
        "69 ± 12 mm³",
        "The momentum is not kept",
        "The volume of the liquid is kept to round-off",
        "fluid.cfl",
        "swept in a pass",
        "0.45",
        "sazanami run case.toml --threads 1 --ranks 1",
        "state hash abcdef",
        "2026-01-01T00:01:05Z",
        "at time 5.0000 × 10⁻³ s along x₃",
        "data-heading=\"value\">[30, 30, 30] mm<",
        "data-heading=\"value\">2650 kg/m³<",
        "default-src 'none'",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
    // Everything from outside is text: in the title, the machine, a warning and the case.
    assert!(!page.contains(BAD) && !page.contains("<img src=x"));
    assert!(page.matches("&lt;/script&gt;&lt;script&gt;").count() >= 4);
    // Nothing is loaded from anywhere.
    for from in ["src=\"http", "href=\"http", "url(http", "@import"] {
        assert!(!page.contains(from), "{from}");
    }
}

#[test]
fn how_to_repeat_a_run_promises_no_more_than_holds() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 8, 2, [4, 4, 4]);
    let path = folder.path().join("summary.json");
    let first: serde_json::Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    let page = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut summary = first.clone();
        change(&mut summary);
        fs::write(&path, summary.to_string()).unwrap();
        fs::read_to_string(sazanami_report::of_run(folder.path()).unwrap()).unwrap()
    };
    let stopped = page(&|summary| {
        summary["status"] = "stopped".into();
        summary["steps"] = 3.into();
    });
    assert!(stopped.contains("--ranks 1 --steps 3") && stopped.contains("state hash abcdef"));
    for (key, value, said) in [
        ("ranks", serde_json::json!([2, 1]), "was on several numbers of ranks: 2, then 1"),
        ("ends_s", serde_json::json!([0.004]), "was to end at 0.004 s before it was given a later end"),
    ] {
        let page = page(&|summary| summary["history"][key] = value.clone());
        assert!(page.contains(said) && !page.contains("state hash abcdef"), "{key}");
    }
    // Of a run that an earlier version began nothing is known.
    assert!(!page(&|summary| summary["history"] = serde_json::Value::Null).contains("state hash abcdef"));
    assert!(page(&|_| ()).contains("state hash abcdef"));
}

#[test]
fn a_run_without_liquid_tells_of_its_grains_alone() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 8, 2, [4, 4, 4]);
    let page = |change: serde_json::Value, height: &str| {
        let path = folder.path().join("summary.json");
        let mut summary: serde_json::Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        summary["conservation"] = serde_json::json!({ "liquid_volume_relative_change": change });
        summary["observables"] = serde_json::json!({});
        fs::write(path, summary.to_string()).unwrap();
        let series = "step,time [s],largest_grain_speed [m/s],largest_fluid_speed [m/s],kinetic_energy_grains [J]\n\
                      0,0,0.5,0,0\n1,0.02,0.25,0,4.5e-6\n";
        fs::write(folder.path().join("series.csv"), series).unwrap();
        let water = format!("step,time [s],x [m],z [m]\n0,0,0.01,{height}\n0,0,0.02,{height}\n");
        fs::write(folder.path().join("water.csv"), water).unwrap();
        fs::read_to_string(sazanami_report::of_run(folder.path()).unwrap()).unwrap()
    };
    let dry = page(serde_json::Value::Null, "");
    for expected in ["<dt>Grains</dt>", "<dd>250 mm/s</dd>", "<dd>4.5 µJ</dd>", "Zero at all times and not drawn: 1 of"]
    {
        assert!(dry.contains(expected), "{expected}");
    }
    for water in ["Surface of the water", "Largest speed of the liquid"] {
        assert!(!dry.contains(water), "{water}");
        // The control: with liquid it is there.
        assert!(page(0.0.into(), "1e-2").contains(water), "{water}");
    }
}

#[test]
fn several_runs_are_compared_where_they_differ() {
    let [a, b, out] = std::array::from_fn(|_| tempfile::tempdir().unwrap());
    results(a.path(), 8, 1, [4, 4, 4]);
    results(b.path(), 8, 1, [4, 4, 4]);
    let case = fs::read_to_string(b.path().join("case.toml")).unwrap();
    fs::write(b.path().join("case.toml"), case.replace("cfl = 0.3", "cfl = 0.4")).unwrap();
    let folders = [a.path().to_owned(), b.path().to_owned()];
    let page = fs::read_to_string(sazanami_report::comparison(&folders, out.path()).unwrap()).unwrap();
    assert!(page.contains("Erosion volume V against fluid.cfl"), "no chart against the key that differs");
    assert!(!page.contains("against fluid.tol_div") && page.contains("crater depth"));
    // The negative control: equal cases have no such chart.
    let page =
        fs::read_to_string(sazanami_report::comparison(&[folders[0].clone(), folders[0].clone()], out.path()).unwrap());
    assert!(!page.unwrap().contains("Erosion volume V against"));
}

/// Columns of the first table of a report on several runs.
fn sides(page: &str) -> Vec<&str> {
    let (_, rest) = page.split_once("<thead>").expect("a table");
    let (head, _) = rest.split_once("</thead>").expect("its head");
    let cells = head.split("<th").skip(2).map(|cell| cell.split_once('>').expect("a tag").1);
    cells.map(|cell| cell.split_once('<').expect("its end").0).collect()
}

#[test]
fn runs_side_by_side_have_names_of_their_own() {
    let place = tempfile::tempdir().unwrap();
    let folders: Vec<_> = ["old/a/run", "new/a/run", "new/b/run", "other"].map(|name| place.path().join(name)).to_vec();
    for folder in &folders {
        fs::create_dir_all(folder).unwrap();
        results(folder, 8, 1, [4, 4, 4]);
    }
    let page = |folders: &[std::path::PathBuf]| {
        fs::read_to_string(sazanami_report::comparison(folders, &place.path().join("out")).unwrap()).unwrap()
    };
    assert_eq!(sides(&page(&folders)), ["old/a/run", "new/a/run", "b/run", "other"]);
    // The controls: names that differ stay short, and one run given twice is numbered.
    assert_eq!(sides(&page(&folders[2..])), ["run", "other"]);
    let twice = [folders[3].clone(), folders[0].clone(), folders[3].clone()];
    assert_eq!(sides(&page(&twice)), ["other (1)", "run", "other (2)"]);
}

#[test]
fn the_view_shows_the_number_of_grains_that_most_times_have() {
    let [full, fed] = std::array::from_fn(|_| tempfile::tempdir().unwrap());
    results(full.path(), 8, 4, [4, 4, 4]);
    results(fed.path(), 3, 4, [4, 4, 4]);
    let page = || fs::read_to_string(sazanami_report::of_run(full.path()).unwrap()).unwrap();
    // The control: one number at all times.
    assert!(page().contains("\"count\":8") && !page().contains("their number of grains"));
    let take = |n: usize| {
        let name = format!("grains/grains-{n:09}.vtp");
        fs::copy(fed.path().join(&name), full.path().join(&name)).unwrap();
    };
    take(0);
    let left_out = |page: &str, count: usize, times: usize| {
        page.contains(&format!("\"count\":{count}"))
            && page.contains(&format!("{times} of 4 times are left out: their number of grains is not {count}."))
    };
    assert!(left_out(&page(), 8, 1));
    // Two times each: what the run ends with.
    take(1);
    assert!(left_out(&page(), 8, 2));
    take(3);
    assert!(left_out(&page(), 3, 1));
}

#[test]
fn the_section_tells_of_a_crater_where_there_is_one() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 8, 2, [4, 4, 4]);
    fs::create_dir(folder.path().join("figures")).unwrap();
    fs::write(folder.path().join("figures/section-000000001.png"), "a picture").unwrap();
    let path = folder.path().join("summary.json");
    let first: serde_json::Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    for (erosion, said) in [
        (serde_json::Value::Null, "Bed and water, at the last"),
        (serde_json::json!({ "not_evaluated": "no grains" }), "Bed and water with the surface of the bed, at the last"),
        (
            serde_json::json!({ "volume_below_rim_mm3": 9.5 }),
            "Bed and water with rim radius L, depth H and the cap of V",
        ),
    ] {
        let mut summary = first.clone();
        summary["observables"]["erosion"] = erosion;
        fs::write(&path, summary.to_string()).unwrap();
        let page = fs::read_to_string(sazanami_report::of_run(folder.path()).unwrap()).unwrap();
        assert!(page.contains(said), "{said}");
        assert_eq!(page.matches("rim radius L, depth H").count(), if said.contains("rim") { 2 } else { 0 });
    }
}

#[test]
fn of_rest_the_report_says_what_is_known() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 8, 2, [4, 4, 4]);
    let path = folder.path().join("summary.json");
    let first: serde_json::Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    let page = |rest: serde_json::Value, doubts: &str| {
        let mut summary = first.clone();
        summary["observables"]["erosion"]["volume_below_rim_doubts"] = doubts.into();
        summary["observables"]["crater_rest"] = rest;
        fs::write(&path, summary.to_string()).unwrap();
        fs::read_to_string(sazanami_report::of_run(folder.path()).unwrap()).unwrap()
    };
    let moves = || serde_json::json!({ "at_rest": false });
    let unrest = "The crater has not come to rest at the end of the run";
    assert!(page(moves(), "").contains(unrest));
    // What is no crater does not come to rest, and of too few rows nothing is known.
    assert!(!page(moves(), sazanami::artist::NO_CRATER).contains(unrest));
    let unknown = page(serde_json::json!({ "not_evaluated": "in 7 rows" }), "");
    assert!(!unknown.contains(unrest) && unknown.contains("Whether the crater rests was not evaluated: in 7 rows."));
}

#[test]
fn damaged_files_are_refused_with_their_names() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 50, 2, [4, 4, 4]);
    for name in
        ["grains/grains-000000001.vtp", "fields/fields-000000000.vti", "grains/shape-0.vtp", "grains.pvd", "series.csv"]
    {
        let path = folder.path().join(name);
        let whole = fs::read(&path).unwrap();
        fs::write(&path, &whole[..whole.len() - 20]).unwrap();
        let error = sazanami_report::of_run(folder.path()).unwrap_err();
        assert_eq!(error.exit_code(), 2, "{name}: {error}");
        let text = error.to_string();
        assert!(text.contains(name) && text.contains("help: the results are damaged"), "{text}");
        fs::write(&path, &whole).unwrap();
    }
    assert!(sazanami_report::of_run(folder.path()).is_ok());
}

/// The bed of Yagyu et al. (2015) on their grid at twenty times.
#[test]
fn a_bed_of_30_900_grains_at_twenty_times_takes_at_most_30_megabytes() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 30_900, 20, [88, 92, 66]);
    let page = fs::read_to_string(sazanami_report::of_run(folder.path()).unwrap()).unwrap();
    println!("{:.1} MB", 1e-6 * page.len() as f64);
    assert!(page.len() <= 30_000_000, "{} bytes", page.len());
    assert!(!page.contains("times are shown"), "something was left out");
}

#[test]
fn what_does_not_fit_is_left_out_and_said() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 2, 103, [2, 2, 2]);
    let page = fs::read_to_string(sazanami_report::of_run(folder.path()).unwrap()).unwrap();
    assert!(page.contains("52 of 103 times are shown."));
}

#[test]
fn the_view_shows_grains_in_their_tank_wherever_it_is() {
    let view = |seen: bool| {
        let folder = tempfile::tempdir().unwrap();
        shaken_results(folder.path(), seen);
        let page = fs::read_to_string(sazanami_report::of_run(folder.path()).unwrap()).unwrap();
        let (_, rest) = page.split_once("type=\"application/octet-stream\"").expect("the view has its data");
        rest.split_once("</script>").expect("the data end").0.to_owned()
    };
    assert_eq!(view(true), view(false));
}
