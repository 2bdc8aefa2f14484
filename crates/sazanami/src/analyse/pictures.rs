//! Sections and views of a run, drawn anew from the grains and fields that it wrote at their times.

use std::path::Path;
use std::sync::Arc;

use sazanami_dem::Motion;
use sazanami_io::vtk::LIQUID;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_observe::erosion::{CraterCourse, Erosion, InitialBed, Known};
use sazanami_observe::{BedColumns, Body};
use sazanami_posing::assembly::grains::population_of;
use serde_json::Value;

use super::output::{Output, undone};
use super::table::Table;
use crate::artist::{Figure, Scene};
use crate::case;
use crate::case::meaning::{Case, GrainPlacement, Population};
use crate::error::CommandError;
use crate::feasible;
use crate::recorder::{Drawn, LOOSEST, NEVER, bed_surface, drops, erosion_settings, scene};
use crate::results::{CASE, FIGURES, SERIES};
use crate::saved::{SavedTime, state, times};
use crate::state::{Array, State, Values, WaterState};

/// Relative difference of times that are the same: tables and files write them with different digits.
const SAME_TIME: Real = 1e-9;

/// Case, shapes and bed height, common to all pictures of a run.
struct Run<'a> {
    case: &'a Case,
    shapes: Arc<[Shape]>,
    /// Height of the bed before the impact, if there was one \[m].
    height: Option<Real>,
    /// Its observations.
    series: Option<Table>,
}

/// Whether a grain of a population, whose number within it may be known, is held or has a given motion at a time \[s]. Of those that a bed
/// file holds one by one that is not known.
fn is_held(population: &Population, number: Option<u64>, time: Real) -> bool {
    let own = match (&population.placement, number) {
        (GrainPlacement::List(list), Some(number)) => list.get(number as usize).map(|grain| grain.motion),
        _ => None,
    };
    // Files are written before the grains are let go.
    let waits = population.release.is_some_and(|release| time <= release * (1.0 + SAME_TIME));
    own.unwrap_or(population.motion) != Motion::Free || waits
}

/// The grains of a state of a case in the frame of the tank; `None` if an array was not written, but for the identifiers.
fn grains_of(case: &Case, shapes: &[Shape], state: &State) -> Option<BedColumns> {
    let [tank, drift] = case.to_written_frame(state.time);
    let array = |name: &str| state.grains.iter().find(|array| array.name == name);
    let reals = |name: &str| array(name).map(reals);
    let vectors = |name: &str| Some(reals(name)?.chunks_exact(3).map(Vector::from_slice).collect::<Vec<Vector>>());
    let last_contact = |since: Real| if since < NEVER { state.time - since } else { Real::NEG_INFINITY };
    let orientation = reals("orientation")?;
    let position = vectors("position")?;
    let body: Vec<u32> = reals("population")?.into_iter().map(|number| number as u32).collect();
    let drawn = |&body: &u32| shapes.get(body as usize).map_or(Quaternion::IDENTITY, Shape::drawn);
    let turns = orientation.chunks_exact(4).map(|q| Quaternion::from_xyzw(q[1], q[2], q[3], q[0]).normalize());
    let orientation = turns.zip(&body).map(|(turn, body)| turn * drawn(body)).collect();
    let id: Option<Vec<u64>> = reals("id").map(|ids| ids.into_iter().map(|id| id as u64).collect());
    let held = |(n, &body): (usize, &u32)| {
        let number = id.as_ref().and_then(|id| id.get(n)).map(|&id| population_of(id).1);
        case.grains.get(body as usize).is_some_and(|population| is_held(population, number, state.time))
    };
    Some(BedColumns {
        held: body.iter().enumerate().map(held).collect(),
        id: id.unwrap_or_else(|| (0..position.len() as u64).collect()),
        body,
        scale: reals("scale")?,
        mass: reals("mass")?,
        position: position.into_iter().map(|place| place - tank).collect(),
        orientation,
        velocity: vectors("velocity")?.into_iter().map(|velocity| velocity - drift).collect(),
        last_contact: reals("time_since_contact")?.into_iter().map(last_contact).collect(),
        time: state.time,
    })
}

/// The values of an array.
fn reals(array: &Array) -> Vec<Real> {
    match &array.values {
        Values::F64(values) => values.clone(),
        Values::F32(values) => values.iter().map(|&value| value.into()).collect(),
        Values::U64(values) => values.iter().map(|&value| value as Real).collect(),
        Values::U32(values) => values.iter().map(|&value| value.into()).collect(),
        Values::I32(values) => values.iter().map(|&value| value.into()).collect(),
    }
}

/// Draws the pictures of a run on a grid again at the times of which it wrote grains and fields too.
pub(super) fn draw_pictures(folder: &Path, summary: &Value, output: &mut Output) -> Result<(), CommandError> {
    let figures = folder.join(FIGURES);
    if output.artist.is_none() || summary["status"] == "running" || !figures.is_dir() {
        return Ok(());
    }
    let loaded = case::load(&folder.join(CASE), &[])?;
    let shapes: Arc<[Shape]> = feasible::shapes_alone(&loaded)?.into();
    let found = |key: &str| summary["observables"]["bed"][key].as_f64();
    let height = found("height_mm").filter(|_| found("porosity").is_some_and(|porosity| porosity < LOOSEST));
    let series = Table::read(&folder.join(SERIES))?;
    let run = Run { case: &loaded.case, shapes, height: height.map(|height| 1e-3 * height), series };
    let mut initial = None;
    let saved = times(folder)?;
    let mut drawable = saved.iter().filter(|saved| step_of(saved).is_some()).peekable();
    if loaded.case.erosion.is_some() && drawable.peek().is_some() && !drawable.any(|saved| saved.time == 0.0) {
        output.message(
            "the pictures stay as they are: grains and a field at 0 s, by which the crater is told from the bed before the impact, \
             were not written",
        );
        return Ok(());
    }
    for saved in saved {
        let Some(step) = step_of(&saved) else { continue };
        let [section, liquid, view] =
            ["section", "liquid", "view"].map(|kind| figures.join(format!("{kind}-{step}.png")));
        if !section.is_file() && saved.time > 0.0 {
            continue;
        }
        let Some(scene) = scene_of(&run, &saved, &mut initial)? else {
            output
                .message(&format!("{}: too few of the grains' arrays were written to draw it anew", section.display()));
            continue;
        };
        for (figure, path) in
            [(Figure::Section(&scene), section), (Figure::Liquid(&scene), liquid), (Figure::View(&scene), view)]
        {
            if path.is_file() {
                output.draw(&figure, &path)?;
            }
        }
    }
    Ok(())
}

/// The number of the step as file names have it, where there are grains and a field.
fn step_of(saved: &SavedTime) -> Option<&str> {
    saved.water.as_ref()?;
    saved.grains.as_ref()?.file_stem()?.to_str()?.strip_prefix("grains-")
}

/// Scene of the pictures of a time; the surface of the first bed is kept in `initial`.
fn scene_of(run: &Run, saved: &SavedTime, initial: &mut Option<InitialBed>) -> Result<Option<Scene>, CommandError> {
    let Run { case, shapes, height, series } = run;
    let state = state(saved)?;
    let (Some(grains), Some(WaterState::Grid { grid, arrays })) = (grains_of(case, shapes, &state), &state.water)
    else {
        return Ok(None);
    };
    if grains.body.iter().any(|&population| population as usize >= shapes.len()) {
        return Err(undone(format!("the grains at {} s are not those of the case", state.time)));
    }
    let array = |name: &str| arrays.iter().find(|array| array.name == name);
    let Some(liquid) = LIQUID.into_iter().find_map(array) else { return Ok(None) };
    let bodies: Vec<Body> = shapes.iter().map(Body::of).collect();
    let bed = grains.view(&bodies);
    let surface = erosion_settings(case).map(|settings| {
        let now = Erosion::of(&bed, &settings, initial.as_ref()).ok();
        if saved.time == 0.0 {
            *initial = now.as_ref().map(Erosion::as_initial);
        }
        let course = series.as_ref().map(|series| course_until(series, saved.time)).unwrap_or_default();
        let rest = now.as_ref().and_then(|now| course.rest(now).ok());
        let known = Known { at_rest: rest.map(|rest| rest.at_rest), drops: drops(case) };
        bed_surface(&settings, initial.as_ref(), now.as_ref(), known)
    });
    let [tank, _] = case.to_written_frame(state.time);
    let grid = Grid { lower: grid.lower - tank, ..*grid };
    let drawn = Drawn { shapes: Arc::clone(shapes), grid, liquid: reals(liquid), surface };
    Ok(Some(scene(case, state.time, &bed, *height, drawn)))
}

/// The crater in the rows of a series up to a time \[s].
fn course_until(series: &Table, end: Real) -> CraterCourse {
    let mut course = CraterCourse::default();
    let [time, cap, below_rim] =
        ["time", "erosion_volume", "erosion_volume_below_rim"].map(|name| series.column(name).into_iter());
    let rows =
        time.zip(cap.zip(below_rim)).filter(|(time, (cap, _))| *time <= end * (1.0 + SAME_TIME) && cap.is_finite());
    rows.for_each(|(time, (cap, below_rim))| course.add(time, [cap, below_rim]));
    course
}
