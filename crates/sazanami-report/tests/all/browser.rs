//! Reports in a real browser: Chromium without a screen, driven by `browser.py`. Skipped, loudly, where there is none.

use std::path::Path;
use std::process::Command;

use crate::support::{Lying, results, results_with};
use sazanami_io::vtk::VtkFile;
use serde_json::Value;

/// Names of the browser on Debian and others.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

fn can_run(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

/// Findings of the browser on a page: results of the steps, complaints; `None` where it is not installed.
fn met(page: &Path, width: &str, steps: &[&str]) -> Option<Value> {
    let Some(browser) = NAMES.into_iter().find(|name| can_run(name)).filter(|_| can_run("python3")) else {
        eprintln!("SKIPPED: no Chromium or no python3 here; `apt-get install chromium` and run this test again");
        return None;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser.py");
    let command = &mut Command::new("python3");
    let output = command.arg(script).arg(browser).arg(page).args([width, "-"]).args(steps).output();
    let output = output.expect("python3 can be started");
    let said = serde_json::from_slice(&output.stdout);
    Some(said.unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr))))
}

/// Results of the steps on a page about which the browser must not complain.
fn opened(page: &Path, width: &str, steps: &[&str]) -> Option<Vec<Value>> {
    let said = met(page, width, steps)?;
    assert_eq!(said["complaints"], Value::Array(Vec::new()), "errors in the console at {width} pixels");
    said["results"].as_array().cloned()
}

const READY: &str =
    "new Promise(done => { const wait = () => window.reportView ? done(1) : setTimeout(wait, 50); wait(); })";
/// Charts whose canvas holds something else than nothing.
const DRAWN: &str = "reportCharts.filter(chart => { const c = chart.figure.querySelector('canvas'); \
    return c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some(x => x); }).length + ' of ' + reportCharts.length";

/// Whether all cells of the table of keys lie within the window.
const ALL_READABLE: &str = "(cells => cells.length > 0 && cells.every(cell => cell.getBoundingClientRect().right <= innerWidth))([...document.querySelectorAll('.cells td, .cells tbody th')])";

#[test]
fn a_press_on_the_section_opens_it_in_full() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 0, 0, [4, 4, 4]);
    std::fs::create_dir(folder.path().join("figures")).unwrap();
    let drawn = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/pictures/quick-section.png");
    std::fs::copy(drawn, folder.path().join("figures/section-000000001.png")).unwrap();
    let page = sazanami_report::of_run(folder.path()).unwrap();
    let press = |of: &str| {
        format!(
            "(() => {{ const at = document.querySelector('#section-picture {of}'); at.scrollIntoView(); \
             const box = at.getBoundingClientRect(); return [box.left + 20, box.top + 10]; }})()"
        )
    };
    let [image, shut] = ["img", ".shut"].map(press);
    let full = "(() => { const i = document.querySelector('#section-picture img'); return i.width === i.naturalWidth && i.width > innerWidth; })()";
    let within = "document.documentElement.scrollWidth <= innerWidth";
    let steps = [full, &image, "@click result", "0", full, within, &shut, "@click result", "0", full];
    let Some(said) = opened(&page, "400", &steps) else { return };
    assert_eq!([&said[0], &said[4], &said[5], &said[9]], [false, true, true, false], "{said:?}");
}

#[test]
fn reports_open_without_errors_wide_and_narrow() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 40, 3, [12, 12, 12]);
    let page = sazanami_report::of_run(folder.path()).unwrap();
    for width in ["1280", "400"] {
        let steps = [
            READY,
            DRAWN,
            "document.documentElement.scrollWidth <= innerWidth",
            "reportView.calls.triangles",
            "document.title",
            ALL_READABLE,
            "Math.max(...reportView.corners()) <= 1",
            "reportRaised(String(-2.5e-13))",
        ];
        let Some(said) = opened(&page, width, &steps) else { return };
        assert_eq!(said[1], "1 of 1");
        assert_eq!(said[2], true, "the page is wider than the window of {width} pixels");
        // Forty octahedra, and water.
        assert!(said[3].as_f64().unwrap() > 320.0, "{said:?}");
        assert_eq!(said[4], crate::support::BAD);
        assert_eq!(said[5], true, "cells of the table of keys lie outside the window of {width} pixels");
        assert_eq!(said[6], true, "edges of the box leave the view at {width} pixels");
        assert_eq!(said[7], "-2.5 × 10⁻¹³");
    }
}

#[test]
fn a_grain_that_is_picked_has_the_numbers_of_its_file() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 40, 3, [12, 12, 12]);
    let page = sazanami_report::of_run(folder.path()).unwrap();
    let early = "(() => { document.getElementById('stage').scrollIntoView(); const t = document.getElementById('view-time'); \
                 t.value = 1; t.dispatchEvent(new Event('input')); return reportView.seen(17); })()";
    let read =
        "[reportView.picked, reportView.numbers(reportView.picked), document.getElementById('view-said').textContent]";
    let Some(said) = opened(&page, "1280", &[READY, early, "@click result", read]) else { return };
    let picked = said[3][0].as_i64().unwrap();
    assert!(picked >= 0, "no grain was hit");
    let n = usize::try_from(picked).unwrap();
    let file = VtkFile::read(&folder.path().join("grains/grains-000000001.vtp")).unwrap();
    let numbers = &said[3][1];
    let of = |name: &str, d: usize| f64::from(file.array(name).unwrap()[d]);
    assert_eq!(numbers["id"].as_f64(), Some(of("id", n)));
    assert_eq!(numbers["speed"].as_f64(), Some(of("speed", n)));
    let force = (0..3).map(|d| file.array("contact_force").unwrap()[3 * n + d].powi(2)).sum::<f32>().sqrt();
    assert_eq!(numbers["force"].as_f64(), Some(f64::from(force)));
    for d in 0..3 {
        let shown = numbers["position_mm"][d].as_f64().unwrap();
        // Half a step of 16 bits of a box of 30 mm.
        assert!((shown - 1e3 * of("Points", 3 * n + d)).abs() < 0.5 * 30.0 / 65535.0 + 1e-5, "{shown}");
    }
    assert!(said[3][2].as_str().unwrap().starts_with(&format!("Grain {} (sand)", of("id", n))), "{said:?}");
    // The control: the next time has other numbers.
    let other = VtkFile::read(&folder.path().join("grains/grains-000000002.vtp")).unwrap();
    assert_ne!(numbers["speed"].as_f64(), Some(f64::from(other.array("speed").unwrap()[n])));
}

#[test]
fn charts_and_view_come_out_in_print() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 40, 3, [12, 12, 12]);
    let page = sazanami_report::of_run(folder.path()).unwrap();
    // Control: without what stands for the canvases their paper is blank.
    let blank = "HTMLCanvasElement.prototype.after = () => {}; 0";
    let steps = [READY, "@print", "document.querySelectorAll('.printed').length", blank, "@print"];
    let Some(said) = opened(&page, "1280", &steps) else { return };
    let [printed, blank] = [1, 4].map(|step| said[step].as_u64().unwrap());
    // The view and the chart; what is transparent makes two images.
    assert!(printed >= blank + 2, "{printed} images on paper, {blank} without the canvases");
    assert_eq!(said[2], 0);
}

/// Results of a view's frames: drawn grains, part of the picture that is missed, a frame of whole shapes, and a coarse one.
const FRAMES: &str = "(() => { document.getElementById('stage').scrollIntoView(); const n = reportView.head.count > 25000 ? 5 : 1, missed = reportView.missed(); \
    const drawn = reportView.drawn[0], all = reportView.all(n); \
    return { drawn, missed, all, whole: reportView.frames(n, false), coarse: reportView.frames(n, true) }; })()";

#[test]
fn grains_that_others_hide_are_not_drawn_and_are_not_missed() {
    let met = |grains: usize, lying: Lying| {
        let folder = tempfile::tempdir().unwrap();
        results_with(folder.path(), grains, 2, [12, 12, 12], lying);
        opened(&sazanami_report::of_run(folder.path()).unwrap(), "1280", &[READY, FRAMES]).map(|said| said[1].clone())
    };
    let Some(bed) = met(20_000, Lying::Bed) else { return };
    println!("{bed}");
    assert!(bed["drawn"].as_f64().unwrap() < 0.8 * 20_000.0, "{bed}");
    assert!(bed["missed"].as_f64().unwrap() < 2e-3, "{bed}");
    let triangles = |of: &str| bed[of]["triangles"].as_f64().unwrap();
    assert!(triangles("coarse") < 0.3 * triangles("all") && triangles("whole") < 0.8 * triangles("all"), "{bed}");
    // The control: where grains lie apart none is hidden.
    let Some(loose) = met(500, Lying::Anywhere) else { return };
    assert_eq!(loose["drawn"].as_f64(), Some(500.0), "{loose}");
}

/// The figures of `docs/guide/report.md`: on a quiet machine, `cargo test --release -p sazanami-report --test all browser -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement"]
fn frames_of_30_900_grains_at_twenty_times() {
    let folder = tempfile::tempdir().unwrap();
    results_with(folder.path(), 30_900, 20, [88, 92, 66], Lying::Bed);
    let page = sazanami_report::of_run(folder.path()).unwrap();
    let Some(said) = met(&page, "1280", &[READY, FRAMES]) else { return };
    println!(
        "{:.1} MB, opened in {}: {}",
        1e-6 * std::fs::metadata(&page).unwrap().len() as f64,
        said["opened_s"],
        said["results"][1]
    );
}

#[test]
fn charts_answer_to_the_keyboard() {
    let folder = tempfile::tempdir().unwrap();
    results(folder.path(), 0, 0, [4, 4, 4]);
    let page = sazanami_report::of_run(folder.path()).unwrap();
    let focus = "document.querySelector('.plot').focus()";
    let read = "document.querySelector('.read').textContent";
    let zoom = "(() => { const { min, max } = reportCharts[0].plot.scales.x; return max - min; })()";
    let off =
        "(() => { document.querySelector('.keys input').click(); return reportCharts[0].plot.series[1].show; })()";
    let steps = [
        focus,
        zoom,
        "@key ArrowRight",
        "@key ArrowRight",
        read,
        "@key +",
        "new Promise(d => setTimeout(d, 100))",
        zoom,
        off,
    ];
    let Some(said) = opened(&page, "1280", &steps) else { return };
    assert_eq!(said[4], "time 1 ms: crater depth 0.1 mm, rim radius 5 mm");
    assert!(said[7].as_f64().unwrap() < 0.6 * said[1].as_f64().unwrap(), "{said:?}");
    assert_eq!(said[8], false);
}

/// The control of the others: what must not be is noticed.
#[test]
fn the_browser_complains_of_errors_and_of_what_is_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("broken.html");
    for broken in [
        "<script>throw new Error('control')</script>",
        "<img src='https://localhost:1/a.png'>",
        "<script>console.error('x')</script>",
    ] {
        std::fs::write(&page, broken).unwrap();
        let Some(said) = met(&page, "1280", &["new Promise(done => setTimeout(done, 300))"]) else { return };
        assert_ne!(said["complaints"], Value::Array(Vec::new()), "{broken}");
    }
}
