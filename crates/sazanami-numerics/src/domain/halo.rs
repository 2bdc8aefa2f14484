//! Ghost layers: walls, periodic images and neighbouring ranks behind one verb.

use std::cmp::Ordering;

use bytemuck::Pod;
use sazanami_parallel::for_each_chunk;

use super::Domain;
use crate::Real;
use crate::grid::{Field, GHOSTS};

/// A number that may live on a field with ghosts.
pub trait Element: Pod + Send + Sync + std::ops::Sub<Output = Self> {
    /// The nearest value of this type.
    fn from_real(value: Real) -> Self;
}

impl Element for f64 {
    fn from_real(value: Real) -> Self {
        value
    }
}

impl Element for f32 {
    fn from_real(value: Real) -> Self {
        value as Self
    }
}

/// Position of the values of a field on the cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Location {
    /// In the centre.
    Cell,
    /// On the lower face normal to this direction.
    Face(usize),
}

/// Ghost value behind a side of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ghost {
    /// The mirror image: zero normal gradient. A value on the wall face itself is kept.
    Even,
    /// The mirror image with opposite deviation from `wall`: the wall value is `wall`, and a value
    /// on the wall face itself is set to it.
    Odd {
        /// Value on the wall.
        wall: Real,
    },
    /// The same value in every ghost layer; a value on the wall face itself is kept.
    Constant {
        /// Value behind the wall.
        value: Real,
    },
    /// The nearest interior value in every ghost layer (for a face: the value on the wall face).
    Nearest,
    /// Ghosts are left as they are.
    Kept,
}

/// Location of a field, and its ghosts at the six sides of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GhostRules {
    /// Position on the cell.
    pub location: Location,
    /// Rule at the lower and the upper side in each direction; not used in periodic directions.
    pub sides: [[Ghost; 2]; 3],
}

impl GhostRules {
    /// Cell values with zero normal gradient at all walls.
    pub const EVEN: Self = Self { location: Location::Cell, sides: [[Ghost::Even; 2]; 3] };
}

/// Bytes on their way to and from neighbours.
#[derive(Default)]
pub(super) struct Buffers {
    outgoing: Vec<u8>,
    incoming: Vec<u8>,
}

impl Domain {
    /// Fills all ghost layers of `fields`, edges and corners included.
    pub fn fill_halos<T: Element>(&self, fields: &mut [(&mut Field<T>, &GhostRules)]) {
        self.fill_halos_to(GHOSTS, fields);
    }

    /// Fills the first `depth` ghost layers of `fields`.
    pub fn fill_halos_to<T: Element>(&self, depth: usize, fields: &mut [(&mut Field<T>, &GhostRules)]) {
        for direction in 0..3 {
            let exchanged = if direction < 2 { self.exchange(direction, depth, fields) } else { [false; 2] };
            for (field, rules) in fields.iter_mut() {
                let n = field.cells()[direction] as isize;
                if direction == 2 && self.periodic[2] || self.wraps_alone(direction) {
                    fill(field, direction, wrapped(n, depth));
                    continue;
                }
                let on_face = rules.location == Location::Face(direction);
                let sides = (0..2).filter(|&side| !exchanged[side]);
                let behind = |side: usize| mirrored(n, side, on_face, rules.sides[direction][side], depth);
                fill(field, direction, sides.flat_map(behind));
            }
        }
    }

    /// Whether this rank is its own periodic neighbour in `direction`.
    #[must_use]
    pub fn wraps_alone(&self, direction: usize) -> bool {
        self.periodic[direction] && (direction == 2 || self.decomposition.parts()[direction] == 1)
    }

    /// Swaps layers with the neighbouring ranks in `direction`; returns on which sides there are any.
    fn exchange<T: Element>(
        &self,
        direction: usize,
        depth: usize,
        fields: &mut [(&mut Field<T>, &GhostRules)],
    ) -> [bool; 2] {
        let rank = self.communicator.rank();
        if self.decomposition.parts()[direction] == 1 {
            return [false; 2];
        }
        let neighbours: [Option<usize>; 2] =
            std::array::from_fn(|side| self.decomposition.neighbour(rank, direction, side, self.periodic[direction]));
        let mut buffers = self.buffers();
        let Buffers { outgoing, incoming } = &mut *buffers;
        let n = self.cells[direction] as isize;
        let depth = depth as isize;
        // Tags tell the direction of travel: with two periodic ranks both neighbours are the same.
        for (side, neighbour) in neighbours.iter().enumerate() {
            if let Some(to) = *neighbour {
                let first = if side == 0 { 0 } else { n - depth };
                outgoing.clear();
                for (field, _) in fields.iter() {
                    pack(field, direction, first, depth, outgoing);
                }
                self.communicator.send(to, (2 * direction + side) as u32, outgoing);
            }
        }
        for (side, neighbour) in neighbours.iter().enumerate() {
            if let Some(from) = *neighbour {
                let first = if side == 0 { -depth } else { n };
                self.communicator.receive(from, (2 * direction + 1 - side) as u32, incoming);
                let mut rest = &incoming[..];
                for (field, _) in fields.iter_mut() {
                    rest = unpack(field, direction, first, depth, rest);
                }
            }
        }
        neighbours.map(|neighbour| neighbour.is_some())
    }
}

/// Calls `body(start, stride, count)` for the lines of values that make up layer `layer` normal to
/// `direction`, ghosts of the other directions included.
fn for_layer(cells: [usize; 3], direction: usize, layer: isize, mut body: impl FnMut(usize, usize, usize)) {
    let width = cells.map(|n| n + 2 * GHOSTS);
    let (row, plane) = (width[0], width[0] * width[1]);
    let at = (layer + GHOSTS as isize) as usize;
    match direction {
        0 => (0..width[2]).for_each(|k| body(k * plane + at, row, width[1])),
        1 => (0..width[2]).for_each(|k| body(k * plane + at * row, 1, row)),
        _ => (0..width[1]).for_each(|j| body(at * plane + j * row, 1, row)),
    }
}

fn pack<T: Element>(field: &Field<T>, direction: usize, first: isize, depth: isize, bytes: &mut Vec<u8>) {
    for layer in first..first + depth {
        for_layer(field.cells(), direction, layer, |start, stride, count| {
            if stride == 1 {
                bytes.extend_from_slice(bytemuck::cast_slice(&field.data()[start..start + count]));
            } else {
                for value in field.data()[start..].iter().step_by(stride).take(count) {
                    bytes.extend_from_slice(bytemuck::bytes_of(value));
                }
            }
        });
    }
}

fn unpack<'b, T: Element>(
    field: &mut Field<T>,
    direction: usize,
    first: isize,
    depth: isize,
    mut bytes: &'b [u8],
) -> &'b [u8] {
    let size = std::mem::size_of::<T>();
    for layer in first..first + depth {
        for_layer(field.cells(), direction, layer, |start, stride, count| {
            let (line, rest) = bytes.split_at(count * size);
            bytes = rest;
            let targets = field.data_mut()[start..].iter_mut().step_by(stride);
            for (target, value) in targets.zip(line.chunks_exact(size)) {
                *target = bytemuck::pod_read_unaligned(value);
            }
        });
    }
    bytes
}

/// A layer of ghosts, or the wall face of a face quantity, and the layer that its values come from, by their numbers
/// in the direction that they are normal to.
#[derive(Clone, Copy)]
struct Layer<T> {
    to: isize,
    from: isize,
    image: Image<T>,
}

/// Value behind a wall, from one before it.
#[derive(Clone, Copy)]
enum Image<T> {
    Same,
    /// Twice the value on the wall, less the value.
    Opposite(T),
    Constant(T),
}

impl<T: Element> Image<T> {
    fn of(self, value: T) -> T {
        match self {
            Self::Same => value,
            Self::Opposite(twice) => twice - value,
            Self::Constant(constant) => constant,
        }
    }
}

/// The ghosts of a periodic direction of `n` cells.
fn wrapped<T: Element>(n: isize, depth: usize) -> impl Iterator<Item = Layer<T>> {
    let layer = move |to: isize| Layer { to, from: to.rem_euclid(n), image: Image::Same };
    (0..depth as isize).flat_map(move |number| [layer(n + number), layer(-1 - number)])
}

/// The ghosts behind a wall at the lower (`side` 0) or upper (1) end of a direction of `n` cells.
fn mirrored<T: Element>(
    n: isize,
    side: usize,
    on_face: bool,
    rule: Ghost,
    depth: usize,
) -> impl Iterator<Item = Layer<T>> {
    // The wall face of a face quantity is its own mirror; cells lie half a cell away from it.
    let (wall, outward, first) = match (side, on_face) {
        (0, true) => (0, -1, 1),
        (0, false) => (-1, -1, 0),
        (_, true) => (n, 1, 1),
        (_, false) => (n, 1, 0),
    };
    let on_wall = match rule {
        Ghost::Odd { wall: value } if on_face => {
            Some(Layer { to: wall, from: wall, image: Image::Constant(T::from_real(value)) })
        }
        _ => None,
    };
    // The last ghost layer of a face quantity at the upper end is one nearer than that of cells.
    let layers = if on_face && side == 1 { depth as isize } else { depth as isize + first };
    let behind = (first..layers).filter_map(move |layer| {
        let to = wall + outward * layer;
        let opposite = if on_face { wall - outward * layer } else { wall - outward * (layer + 1) };
        let last = if on_face { n } else { n - 1 };
        let opposite = opposite.clamp(0, last);
        let (from, image) = match rule {
            Ghost::Even => (opposite, Image::Same),
            Ghost::Odd { wall } => (opposite, Image::Opposite(T::from_real(2.0 * wall))),
            Ghost::Constant { value } => (opposite, Image::Constant(T::from_real(value))),
            Ghost::Nearest => (if on_face { wall } else { wall - outward }, Image::Same),
            Ghost::Kept => return None,
        };
        Some(Layer { to, from, image })
    });
    on_wall.into_iter().chain(behind)
}

/// Values that one task of [`fill`] looks after, at least.
const TOGETHER: usize = 16_384;
/// Most layers of a direction: the ghosts and the wall face on both sides.
const LAYERS: usize = 2 * (GHOSTS + 1);

/// Fills `layers` normal to `direction`, one after the other, ghosts of the other directions included.
fn fill<T: Element>(field: &mut Field<T>, direction: usize, mut layers: impl Iterator<Item = Layer<T>>) {
    let list: [Option<Layer<T>>; LAYERS] = std::array::from_fn(|_| layers.next());
    debug_assert!(layers.next().is_none(), "there are at most {LAYERS} layers");
    let layers = || list.iter().flatten().copied();
    let width = field.cells().map(|n| n + 2 * GHOSTS);
    let (row, plane) = (width[0], width[0] * width[1]);
    let place = |layer: isize| (layer + GHOSTS as isize) as usize;
    if direction == 2 {
        layers()
            .for_each(|Layer { to, from, image }| fill_plane(field.data_mut(), plane, [to, from].map(place), image));
        return;
    }
    for_each_chunk(field.data_mut(), plane * TOGETHER.div_ceil(plane), |_, planes| {
        if direction == 0 {
            for row in planes.chunks_exact_mut(row) {
                layers().for_each(|Layer { to, from, image }| row[place(to)] = image.of(row[place(from)]));
            }
            return;
        }
        for plane in planes.chunks_exact_mut(plane) {
            for Layer { to, from, image } in layers() {
                let (to, from) = (place(to) * row, place(from) * row);
                (0..row).for_each(|i| plane[to + i] = image.of(plane[from + i]));
            }
        }
    });
}

/// Fills plane `to` of `data` from plane `from`.
fn fill_plane<T: Element>(data: &mut [T], plane: usize, [to, from]: [usize; 2], image: Image<T>) {
    let (below, above) = data.split_at_mut(plane * to.max(from));
    match to.cmp(&from) {
        Ordering::Equal => for_each_chunk(&mut above[..plane], TOGETHER, |_, values| {
            values.iter_mut().for_each(|value| *value = image.of(*value));
        }),
        order => {
            let (target, source) = match order {
                Ordering::Greater => (above, &below[plane * from..]),
                _ => (&mut below[plane * to..], &*above),
            };
            for_each_chunk(&mut target[..plane], TOGETHER, |number, values| {
                let images = &source[number * TOGETHER..];
                values.iter_mut().zip(images).for_each(|(value, &other)| *value = image.of(other));
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vector;
    use crate::grid::Grid;
    use sazanami_parallel::run_ranks;

    fn grid(cells: [usize; 3]) -> Grid {
        Grid::new(cells, Vector::ZERO, Vector::ONE)
    }

    /// A value that tells its global indices.
    fn label(i: isize, j: isize, k: isize) -> f64 {
        (i * 10_000 + j * 100 + k) as f64
    }

    fn labelled(domain: &Domain) -> Field<f64> {
        let mut field = domain.field(f64::NAN);
        let [n1, n2, n3] = domain.cells().map(|n| n as isize);
        let [a, b, _] = domain.start().map(|n| n as isize);
        for k in 0..n3 {
            for j in 0..n2 {
                for i in 0..n1 {
                    field[[i, j, k]] = label(i + a, j + b, k);
                }
            }
        }
        field
    }

    #[test]
    fn periodic_ghosts_hold_the_image_on_any_number_of_ranks() {
        let cells = [12, 8, 3];
        for ranks in [1, 2, 3, 4, 6] {
            run_ranks(ranks, 1, |c| {
                let domain = Domain::new(grid(cells), [true; 3], c).unwrap();
                let mut field = labelled(&domain);
                domain.fill_halos(&mut [(&mut field, &GhostRules::EVEN)]);
                let [n1, n2, n3] = domain.cells().map(|n| n as isize);
                let [a, b, _] = domain.start().map(|n| n as isize);
                for k in -2..n3 + 2 {
                    for j in -2..n2 + 2 {
                        for i in -2..n1 + 2 {
                            let expected = label((i + a).rem_euclid(12), (j + b).rem_euclid(8), k.rem_euclid(3));
                            assert_eq!(field[[i, j, k]], expected, "{ranks} ranks, cell {i} {j} {k}");
                        }
                    }
                }
            })
            .unwrap();
        }
    }

    #[test]
    fn walls_mirror_cells_and_faces() {
        let domain = Domain::solo(grid([4, 4, 4]), [false; 3]);
        let odd = GhostRules { location: Location::Cell, sides: [[Ghost::Odd { wall: 3.0 }; 2]; 3] };
        let mut u = labelled(&domain);
        domain.fill_halos(&mut [(&mut u, &odd)]);
        assert_eq!(u[[-1, 1, 2]], 6.0 - label(0, 1, 2));
        assert_eq!(u[[1, 1, 5]], 6.0 - label(1, 1, 2));
        let face = GhostRules { location: Location::Face(0), ..odd };
        let mut uf = labelled(&domain);
        domain.fill_halos(&mut [(&mut uf, &face)]);
        assert_eq!(uf[[0, 1, 1]], 3.0);
        assert_eq!(uf[[4, 1, 1]], 3.0);
        assert_eq!(uf[[-1, 1, 1]], 6.0 - label(1, 1, 1));
        assert_eq!(uf[[5, 1, 1]], 6.0 - label(3, 1, 1));
        assert_eq!(uf[[1, -1, 1]], 6.0 - label(1, 0, 1), "tangential faces mirror like cells");
        assert!(uf.data().iter().all(|v| v.is_finite()));
    }

    #[test]
    fn large_planes_are_shared_among_threads() {
        let fill = |threads: usize| {
            sazanami_parallel::with_threads(threads, || {
                let domain = Domain::solo(grid([190, 170, 4]), [false; 3]);
                let rules = [Ghost::Odd { wall: 3.0 }, Ghost::Even, Ghost::Nearest];
                let rules = GhostRules { location: Location::Cell, sides: rules.map(|rule| [rule; 2]) };
                let mut cells = labelled(&domain);
                domain.fill_halos(&mut [(&mut cells, &rules)]);
                let odd = GhostRules { location: Location::Face(2), sides: [[Ghost::Odd { wall: 2.0 }; 2]; 3] };
                let mut faces = labelled(&domain);
                domain.fill_halos(&mut [(&mut faces, &odd)]);
                (cells, faces)
            })
        };
        let (cells, faces) = fill(1).unwrap();
        // The place is beyond what one task fills.
        assert_eq!([-1, 5].map(|k| cells[[180, 160, k]]), [label(180, 160, 0), label(180, 160, 3)]);
        assert_eq!(cells[[-2, 160, 2]], 6.0 - label(1, 160, 2));
        assert_eq!(cells[[180, 171, 2]], label(180, 168, 2));
        assert_eq!([0, -1].map(|k| faces[[180, 160, k]]), [2.0, 4.0 - label(180, 160, 1)]);
        let bits = |field: &Field<f64>| field.data().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        let (again, other) = fill(4).unwrap();
        assert!(bits(&again) == bits(&cells) && bits(&other) == bits(&faces));
    }

    #[test]
    fn one_cell_thick_boxes_have_ghosts_too() {
        let domain = Domain::solo(grid([4, 1, 4]), [false, true, false]);
        let mut u = labelled(&domain);
        domain.fill_halos(&mut [(&mut u, &GhostRules::EVEN)]);
        assert_eq!(u[[2, -2, 3]], label(2, 0, 3));
        assert_eq!(u[[2, 2, 3]], label(2, 0, 3));
    }
}
