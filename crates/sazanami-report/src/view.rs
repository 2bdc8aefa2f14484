//! Contents of the three-dimensional view of a run: grains and water at the times written, small enough to mail.
//!
//! Places are in 16 bits of the box, orientations in three components of 15 bits and a sign; speeds, forces and sizes are as in the
//! files. Numbers that change little from time to time or from corner to corner are stored as differences; all is deflated.

use std::io::Write as _;
use std::path::Path;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use sazanami::artist::heights_coloured;
use sazanami::error::CommandError;
use sazanami::finished::Finished;
use sazanami::results::{FIELD_SERIES, GRAIN_SERIES, GRAINS, population_of};
use sazanami_io::vtk::{ReadError, SeriesEntry, Values, VtkFile, read_series};
use sazanami_numerics::Vector;
use sazanami_numerics::grid::Grid;
use sazanami_picture::Isosurface;
use serde_json::{Value, json};

use crate::mesh::Mesh;

/// Most bytes of the deflated data: 28 MB of the page, in base64.
const MOST_BYTES: usize = 21_000_000;
/// Most times of a run that are shown.
const MOST_TIMES: usize = 100;
/// Most triangles of all grains: what a common graphics chip draws 30 times a second.
const MOST_TRIANGLES: usize = 4_000_000;
/// Most triangles of a grain while the view turns on a machine that does not draw whole shapes 30 times a second.
const MOST_COARSE: usize = 24;
/// Bytes of a grain at a time before they are deflated.
const BYTES_OF_GRAIN: usize = 20;
/// Liquid fraction at the surface of the water, and how often it is smoothed, as in the pictures of a run.
const SURFACE: (f64, usize) = (0.3, 1);
/// Most particles of water at a time.
const MOST_PARTICLES: usize = 60_000;

/// The data of a view.
pub struct View {
    /// Head for the script.
    pub head: Value,
    /// The deflated arrays.
    pub bytes: Vec<u8>,
    /// Omissions, in words.
    pub left_out: Vec<String>,
}

/// The view of a run; `None` if it wrote neither grains nor water for ParaView.
///
/// # Errors
/// If a file of the run is damaged.
pub fn of(run: &Finished) -> Result<Option<View>, CommandError> {
    let source = Source::open(run).map_err(refused)?;
    let count = source.times.len();
    if count == 0 {
        return Ok(None);
    }
    let mut every = count.div_ceil(MOST_TIMES).max(count * source.grains * BYTES_OF_GRAIN / (3 * MOST_BYTES)).max(1);
    loop {
        let view = source.packed(every).map_err(refused)?;
        // Two times are the least that show what happened.
        if view.bytes.len() <= MOST_BYTES || every >= count {
            return Ok(Some(view));
        }
        every *= 2;
    }
}

fn refused(error: ReadError) -> CommandError {
    CommandError::input(error.to_string(), "the results are damaged: take them from a copy, or run the case again")
}

/// Files of a run at one time: grains, water.
struct Moment {
    time: f64,
    grains: Option<VtkPath>,
    water: Option<VtkPath>,
}

type VtkPath = std::path::PathBuf;

impl Moment {
    /// Number of its grains.
    fn count(&self) -> Result<usize, ReadError> {
        let Some(path) = &self.grains else { return Ok(0) };
        let [count] = VtkFile::beginning(path)?.numbers("Piece", "NumberOfPoints")?;
        Ok(count as usize)
    }
}

/// The number that is there most often, none only where there never is another; of several, the one that comes last.
fn most_frequent(counts: &[usize]) -> usize {
    let often = |count: &&usize| (**count > 0, counts.iter().filter(|other| other == count).count());
    counts.iter().max_by_key(often).copied().unwrap_or_default()
}

/// Results of a run for the view.
struct Source<'a> {
    run: &'a Finished,
    times: Vec<Moment>,
    /// Number of grains at these times.
    grains: usize,
    /// Number of times with another number of grains, which are not among them.
    others: usize,
    lower: Vector,
    upper: Vector,
}

impl<'a> Source<'a> {
    fn open(run: &'a Finished) -> Result<Self, ReadError> {
        let series = |name: &str| read_series(&run.folder.join(name));
        let (grains, water) = (series(GRAIN_SERIES)?, series(FIELD_SERIES)?);
        let path = |entry: &SeriesEntry| run.folder.join(&entry.file);
        let moment = |entry: &SeriesEntry| Moment {
            time: entry.time,
            grains: grains.iter().find(|other| other.time == entry.time).map(path),
            water: water.iter().find(|other| other.time == entry.time).map(path),
        };
        let main = if grains.is_empty() { &water } else { &grains };
        let all: Vec<Moment> = main.iter().map(moment).collect();
        let counts = all.iter().map(Moment::count).collect::<Result<Vec<usize>, _>>()?;
        let (grains, every) = (most_frequent(&counts), all.len());
        let shown = all.into_iter().zip(counts).filter(|(_, count)| *count == grains);
        let times: Vec<Moment> = shown.map(|(moment, _)| moment).collect();
        let domain = &run.case.case.domain;
        Ok(Self { run, grains, others: every - times.len(), times, lower: domain.lower, upper: domain.upper })
    }

    /// The view of every `every`-th time and the last.
    fn packed(&self, every: usize) -> Result<View, ReadError> {
        let last = self.times.len() - 1;
        let kept =
            self.times.iter().enumerate().filter(|(n, _)| n % every == 0 || *n == last).map(|(_, moment)| moment);
        let (mut pack, mut times, mut left_out) = (Pack::default(), Vec::new(), Vec::new());
        let (mut before, mut shapes) = (None, Vec::new());
        for moment in kept {
            let mut entry = json!({ "time": moment.time });
            let [shift, _] = self.run.case.case.to_written_frame(moment.time);
            if let Some(path) = &moment.grains {
                let file = VtkFile::read(path)?;
                let state = self.state(&file, shift)?;
                if before.is_none() {
                    shapes = self.shapes(&file, &mut pack, &mut entry)?;
                }
                entry["grains"] = pack.grains(&state, before.as_ref());
                before = Some(state);
            }
            if let Some(path) = &moment.water {
                entry["water"] = self.water(path, shift, &mut pack, &mut left_out)?;
            }
            times.push(entry);
        }
        if every > 1 {
            left_out.push(format!("{} of {} times are shown.", times.len(), self.times.len()));
        }
        if self.others > 0 {
            let (others, grains) = (self.others, self.grains);
            let all = others + self.times.len();
            left_out.push(format!("{others} of {all} times are left out: their number of grains is not {grains}."));
        }
        left_out.dedup();
        let populations: Vec<&str> =
            self.run.case.case.grains.iter().map(|population| population.name.as_str()).collect();
        let head = json!({
            "lower": self.lower.to_array(), "upper": self.upper.to_array(), "count": self.grains, "shapes": shapes,
            "populations": populations, "times": times, "heights": self.heights(), "crater": self.has_crater(),
        });
        Ok(View { head, bytes: pack.deflated(), left_out })
    }

    /// Heights of the first and the last colour \[mm], as in the pictures of the run.
    fn heights(&self) -> [f64; 2] {
        let bed = self.run.number("observables.bed.height_mm").map(|height| self.lower.z + 1e-3 * height);
        heights_coloured([self.lower.z, self.upper.z], bed).map(|height| 1e3 * height)
    }

    /// Whether the run found a crater, into which the view then looks.
    fn has_crater(&self) -> bool {
        self.run.number("observables.erosion.volume_below_rim_mm3").is_some()
    }

    /// Shapes of the populations, and what does not change of the grains.
    fn shapes(&self, file: &VtkFile, pack: &mut Pack, entry: &mut Value) -> Result<Vec<Value>, ReadError> {
        let populations = self.run.case.case.grains.len().max(1);
        let most = (MOST_TRIANGLES / self.grains.max(1)).max(12);
        let mesh = |n: usize| {
            let path = self.run.folder.join(GRAINS).join(format!("shape-{n}.vtp"));
            let file = VtkFile::read(&path)?;
            let mesh = Mesh::new(&file.array("Points")?, &file.array("connectivity")?).reduced(most);
            let of =
                |mesh: &Mesh| json!({ "nodes": mesh.nodes.as_flattened(), "triangles": mesh.triangles.as_flattened() });
            let mut shape = of(&mesh);
            if mesh.triangles.len() > MOST_COARSE {
                shape["coarse"] = of(&mesh.reduced(MOST_COARSE));
            }
            Ok(shape)
        };
        let whole = |name: &str| -> Result<Vec<u32>, ReadError> {
            let numbers = if file.has(name) { file.array(name)? } else { (0..self.grains).map(|n| n as f32).collect() };
            Ok(numbers.into_iter().map(|value| value as u32).collect())
        };
        let population = if file.has("population") { whole("population")? } else { vec![0; self.grains] };
        let ones = || vec![1.0; self.grains];
        let real = |name: &str| if file.has(name) { file.array(name) } else { Ok(ones()) };
        entry["fixed"] = json!({
            "id": pack.push(&self.numbers(file)?), "population": pack.push(&population),
            "scale": pack.push(&real("scale")?), "diameter": pack.push(&real("diameter")?),
        });
        (0..populations).map(mesh).collect()
    }

    /// Number of each grain within its population, by its identifier; in order where the file has none.
    fn numbers(&self, file: &VtkFile) -> Result<Vec<u32>, ReadError> {
        if !file.has("id") {
            return Ok((0..self.grains as u32).collect());
        }
        Ok(match file.values("id")?.1 {
            Values::U64(ids) => ids.into_iter().map(|id| population_of(id).1 as u32).collect(),
            Values::U32(ids) => ids,
            _ => return Err(ReadError::Damaged { path: self.run.folder.join(GRAINS), what: "array `id`".to_owned() }),
        })
    }

    fn state(&self, file: &VtkFile, shift: Vector) -> Result<State, ReadError> {
        let places = file.doubles("Points")?;
        let count = places.len() / 3;
        let turned = file.has("orientation").then(|| file.array("orientation")).transpose()?;
        let length = |vectors: Vec<f32>| {
            vectors.as_chunks::<3>().0.iter().map(|v| v.iter().map(|x| x * x).sum::<f32>().sqrt()).collect()
        };
        let speed = if file.has("speed") { file.array("speed")? } else { length(file.array("velocity")?) };
        let force = if file.has("contact_force") { length(file.array("contact_force")?) } else { vec![0.0; count] };
        Ok(State {
            place: self.places(&places, shift),
            turn: turned.map_or_else(|| vec![0; 3 * count], |turned| turns(&turned)),
            speed,
            force,
        })
    }

    /// Places in 16 bits of a box that has moved by `shift` \[m], all x1, then all x2, then all x3. Beyond the box they stand at
    /// its side.
    fn places(&self, places: &[f64], shift: Vector) -> Vec<u16> {
        let (lower, size) = ((self.lower + shift).to_array(), (self.upper - self.lower).to_array());
        let part = |d: usize| places.iter().skip(d).step_by(3).map(move |&x| quantised((x - lower[d]) / size[d]));
        (0..3).flat_map(part).collect()
    }

    /// The water of a time: its surface from a grid, or its particles.
    fn water(
        &self,
        path: &Path,
        shift: Vector,
        pack: &mut Pack,
        left_out: &mut Vec<String>,
    ) -> Result<Value, ReadError> {
        let file = VtkFile::read(path)?;
        if path.extension().is_some_and(|kind| kind == "vtp") {
            let places = file.doubles("Points")?;
            let every = (places.len() / 3).div_ceil(MOST_PARTICLES).max(1);
            if every > 1 {
                left_out.push(format!("One of {every} particles of water is shown."));
            }
            let kept: Vec<f64> = places.as_chunks::<3>().0.iter().step_by(every).flatten().copied().collect();
            return Ok(json!({ "count": kept.len() / 3, "particles": pack.push(&self.places(&kept, shift)) }));
        }
        let Some(name) = file.liquid() else { return Ok(Value::Null) };
        let [x0, n1, y0, n2, z0, n3] = file.numbers::<6>("Piece", "Extent")?;
        let cells = [n1 - x0, n2 - y0, n3 - z0].map(|count| count as usize);
        let values: Vec<f64> = file.array(name)?.into_iter().map(f64::from).collect();
        let grid = Grid::new(cells, self.lower, self.upper);
        let Ok(surface) = Isosurface::new(&grid, &values, SURFACE.0, SURFACE.1) else {
            return Err(ReadError::Damaged { path: path.to_owned(), what: format!("array `{name}`") });
        };
        let nodes: Vec<f64> = surface.nodes.iter().flat_map(|node| node.to_array()).collect();
        let corners = surface.triangles.as_flattened();
        Ok(json!({
            "nodes": pack.push(&differences(&self.places(&nodes, Vector::ZERO), |a, b| a.wrapping_sub(b))),
            "triangles": pack.push(&differences(corners, |a, b| a.wrapping_sub(b))),
        }))
    }
}

/// Grains at a time.
struct State {
    place: Vec<u16>,
    turn: Vec<u16>,
    speed: Vec<f32>,
    force: Vec<f32>,
}

/// A part of the whole in 16 bits.
fn quantised(part: f64) -> u16 {
    (part.clamp(0.0, 1.0) * f64::from(u16::MAX)).round() as u16
}

/// Orientations (w, x, y, z) by their x, y, z with the sign that makes w positive, all x first.
fn turns(quaternions: &[f32]) -> Vec<u16> {
    let all = quaternions.as_chunks::<4>().0;
    let part = |d: usize| all.iter().map(move |q| (q[d] * q[0].signum() * f32::from(i16::MAX)).round() as i16 as u16);
    (1..4).flat_map(part).collect()
}

/// Each value less the one before it.
fn differences<T: Copy + Default>(values: &[T], less: impl Fn(T, T) -> T) -> Vec<T> {
    let before = std::iter::once(T::default()).chain(values.iter().copied());
    values.iter().zip(before).map(|(&value, before)| less(value, before)).collect()
}

/// Arrays one after the other.
#[derive(Default)]
struct Pack {
    bytes: Vec<u8>,
}

/// A number of the pack, in the order of bytes of browsers.
trait Number: Copy {
    /// Name of its array in scripts.
    const ARRAY: &'static str;
    fn push(self, bytes: &mut Vec<u8>);
}

macro_rules! numbers {
    ($($kind:ty, $array:literal;)*) => {$(
        impl Number for $kind {
            const ARRAY: &'static str = $array;
            fn push(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}

numbers! { u16, "Uint16Array"; u32, "Uint32Array"; f32, "Float32Array"; }

impl Pack {
    /// Adds an array; returns where it is.
    fn push<T: Number>(&mut self, values: &[T]) -> Value {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let at = self.bytes.len();
        values.iter().for_each(|value| value.push(&mut self.bytes));
        json!({ "at": at, "length": values.len(), "kind": T::ARRAY })
    }

    /// Adds grains at a time, places and turns less those of the time `before`.
    fn grains(&mut self, state: &State, before: Option<&State>) -> Value {
        let moved = |now: &[u16], then: Option<&Vec<u16>>| -> Vec<u16> {
            match then {
                Some(then) => now.iter().zip(then).map(|(a, b)| a.wrapping_sub(*b)).collect(),
                None => now.to_vec(),
            }
        };
        json!({
            "place": self.push(&moved(&state.place, before.map(|before| &before.place))),
            "turn": self.push(&moved(&state.turn, before.map(|before| &before.turn))),
            "speed": self.push(&state.speed), "force": self.push(&state.force),
        })
    }

    fn deflated(&self) -> Vec<u8> {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(6));
        encoder.write_all(&self.bytes).and_then(|()| encoder.finish()).expect("memory takes all bytes")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantised_places_and_turns_are_near_what_they_were() {
        let places = [0.0_f64, 0.123_456, 0.5, 1.0];
        for part in places {
            assert!((f64::from(quantised(part)) / 65535.0 - part).abs() < 0.5 / 65535.0 + 1e-12);
        }
        assert_eq!((quantised(-1.0), quantised(2.0)), (0, u16::MAX));
        // The opposite quaternion is the same turn.
        let q = [-0.5_f32, 0.5, -0.5, 0.5];
        assert_eq!(turns(&q), turns(&q.map(|x| -x)));
        assert_eq!(turns(&q)[0] as i16, -16384);
    }

    #[test]
    fn differences_add_up_to_the_values() {
        let values = [3_u16, 65535, 0, 7];
        let mut sum = 0_u16;
        let back: Vec<u16> = differences(&values, |a, b| a.wrapping_sub(b))
            .into_iter()
            .map(|d| {
                sum = sum.wrapping_add(d);
                sum
            })
            .collect();
        assert_eq!(back, values);
    }
}
