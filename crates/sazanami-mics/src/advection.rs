//! Transport of liquid and momentum with the same mass fluxes, one direction after the other.
//!
//! With the liquid flux `G` of [`crate::interface`], `c = u_f dt / dx` and all fluxes per cell
//! volume, a sweep is
//!
//! ```text
//! M   = rho_g c + (rho_l - rho_g) G                                  mass through a face
//! C   <- C - (G_+ - G_-) + c_c (c_+ - c_-)
//! rho <- rho - (M_+ - M_-) + rho(c_c) (c_+ - c_-)                     which is rho(C)
//! q_i <- q_i - (M_+ u_i,+ - M_- u_i,-) + rho(c_c) u_i^n (c_+ - c_-)   with u_i = q_i / rho after
//! ```
//!
//! (Rudman 1998; Pal, Fuster and Zaleski 2021). `u_i,+-` is the donor's value with a slope of third order;
//! it has no slope at the interface. `u^n` and `c_c` are those before the first sweep. The momentum
//! is updated by differences of velocities, which is the same and keeps a uniform velocity exactly.

use std::cell::RefCell;

use sazanami_numerics::Real;
use sazanami_numerics::choices;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::GHOSTS;
use sazanami_parallel::for_each_chunk;

use crate::boundary::{Boundary, Opening};
use crate::interface::{RESIDUE, Wetting, donated};
use crate::outside::place_on_side;
use crate::slopes::{Slope, ThirdOrder, VanLeer};

choices! {
    /// Convection of momentum.
    #[derive(Default)]
    pub enum Convection {
        /// Conservative, with the mass fluxes of liquid and gas.
        #[default]
        Consistent = "consistent",
        /// Velocity form, independent of the density: Yagyu et al. (2015), eq. (3).
        VelocityForm = "velocity_form",
        /// None: the velocity is prescribed.
        #[unlisted]
        Off = "off",
    }
}

/// Liquid fraction and velocity on all cells of a rank.
pub(crate) type State<'a> = [&'a [Real]; 4];
/// The same for writing.
pub(crate) type StateMut<'a> = [&'a mut [Real]; 4];

/// Storage of `C^n` and `u^n` during a sweep.
#[derive(Clone, Copy)]
pub(crate) enum Frozen<'a> {
    /// They are what the sweep reads.
    Read,
    /// In fields of their own.
    Kept(State<'a>),
    /// In the fields that the sweep writes.
    Overwritten,
}

/// Parameters of a sweep.
pub(crate) struct Sweep<'a> {
    pub domain: &'a Domain,
    pub direction: usize,
    /// Time step over the cell width in `direction` [s/m].
    pub dt_dx: Real,
    /// Normal velocity on the faces of `direction` [m/s].
    pub face_velocity: &'a [Real],
    pub wetting: Wetting,
    pub convection: Convection,
    /// Density is `density[0] + density[1] C` [kg/m^3].
    pub density: [Real; 2],
    /// Inflow conditions of the lower and the upper side of the box.
    pub openings: [Option<Opening>; 2],
    /// Liquid fraction of what stands outside each face of these sides; empty where it is that of their opening.
    pub outside: [&'a [Real]; 2],
}

/// Fluxes through a row of faces and the velocities they carry.
#[derive(Default)]
struct FaceRow {
    courant: Vec<Real>,
    liquid: Vec<Real>,
    velocity: [Vec<Real>; 3],
}

#[derive(Default)]
struct Scratch {
    rows: Vec<FaceRow>,
    cells: [Vec<Real>; 4],
}

impl Scratch {
    /// Makes room for `rows` rows of `width` faces.
    fn reserve(&mut self, rows: usize, width: usize) {
        let stale = self.cells[0].len() < width;
        if self.rows.len() < rows {
            self.rows.resize_with(rows, FaceRow::default);
        } else if !stale {
            return;
        }
        for row in &mut self.rows {
            for values in [&mut row.courant, &mut row.liquid].into_iter().chain(&mut row.velocity) {
                values.resize(width, 0.0);
            }
        }
        self.cells.iter_mut().for_each(|values| values.resize(width, 0.0));
    }
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Rows in x2 that are swept through x3 together, so that their fluxes stay in cache.
const BLOCK: usize = 16;

impl<'a> Sweep<'a> {
    /// Inflow conditions of the sides of the box in `direction` that this rank touches.
    pub fn openings_of(domain: &Domain, boundary: &Boundary, direction: usize) -> [Option<Opening>; 2] {
        std::array::from_fn(|side| boundary.opening(direction, side).filter(|_| domain.at_box_end(direction, side)))
    }

    /// Transports `from` into `to`; two ghost layers of `from` must be filled.
    pub fn run(&self, from: State<'_>, frozen: Frozen<'_>, to: StateMut<'_>) {
        let plane = self.domain.strides()[2] as usize;
        let n3 = self.domain.cells()[2];
        // A chunk of planes computes the fluxes through its lowest faces itself.
        let depth = if self.direction == 2 { 8 } else { 2 };
        let [c, u1, u2, u3] = to.map(|field| &mut field[GHOSTS * plane..(GHOSTS + n3) * plane]);
        for_each_chunk((c, u1, u2, u3), depth * plane, |number, (c, u1, u2, u3)| {
            let planes = number * depth..(number * depth + depth).min(n3);
            let origin = (planes.start + GHOSTS) * plane;
            let mut chunk = Chunk { sweep: self, from, frozen, to: [c, u1, u2, u3], origin };
            SCRATCH.with_borrow_mut(|scratch| chunk.run(planes, scratch));
        });
    }

    /// Place in memory of the first cell of a row.
    fn at(&self, j: usize, k: usize) -> usize {
        let [_, width, plane] = self.domain.strides().map(|s| s as usize);
        (k + GHOSTS) * plane + (j + GHOSTS) * width + GHOSTS
    }

    /// Fluxes through `len` faces from the lower face of the cell at `start` on.
    fn fluxes(&self, from: State<'_>, start: usize, len: usize, row: &mut FaceRow, weight: &mut [Real]) {
        let stride = self.domain.strides()[self.direction];
        let shifted = |field: usize, by: isize| &from[field][(start as isize + by * stride) as usize..][..len];
        let mixed = liquid_fluxes(
            [shifted(0, -2), shifted(0, -1), shifted(0, 0), shifted(0, 1)],
            &self.face_velocity[start..start + len],
            self.dt_dx,
            self.convection != Convection::Consistent,
            (&mut row.courant[..len], &mut row.liquid[..len], &mut weight[..len]),
        );
        if mixed {
            self.interface_fluxes(from[0], start, &row.courant[..len], &mut row.liquid[..len]);
        }
        for (i, values) in row.velocity.iter_mut().enumerate() {
            let cells = [shifted(1 + i, -2), shifted(1 + i, -1), shifted(1 + i, 0), shifted(1 + i, 1)];
            let (courant, weight, values) = (&row.courant[..len], &weight[..len], &mut values[..len]);
            match self.convection {
                Convection::Consistent => face_values(ThirdOrder, cells, courant, weight, values),
                Convection::VelocityForm => face_values(VanLeer, cells, courant, weight, values),
                Convection::Off => {}
            }
        }
    }

    /// Replaces the fluxes out of cells that hold an interface.
    fn interface_fluxes(&self, c: &[Real], start: usize, courant: &[Real], liquid: &mut [Real]) {
        let behind = self.domain.strides()[self.direction] as usize;
        for (i, (&courant, liquid)) in courant.iter().zip(liquid).enumerate() {
            let donor = if courant > 0.0 { start + i - behind } else { start + i };
            if c[donor] > 0.0 && c[donor] < 1.0 && courant != 0.0 {
                *liquid = donated(&self.wetting.neighbourhood(c, donor), self.direction, courant);
            }
        }
    }

    /// Replaces what flows in through faces `range` of a row on `side` of the box.
    fn open(&self, side: usize, [j, k]: [usize; 2], range: std::ops::Range<usize>, row: &mut FaceRow) {
        if let Some(opening) = self.openings[side] {
            let outside = self.outside[side].get(place_on_side(self.domain, self.direction, [j, k])..).unwrap_or(&[]);
            for (n, i) in range.enumerate() {
                let courant = row.courant[i];
                if (side == 0 && courant > 0.0) || (side == 1 && courant < 0.0) {
                    row.liquid[i] = courant * outside.get(n).copied().unwrap_or(opening.volume_fraction);
                    if let Some(velocity) = opening.velocity {
                        (0..3).for_each(|d| row.velocity[d][i] = velocity[d]);
                    }
                }
            }
        }
    }

    /// Liquid [cells] and momentum [kg/m^3 m/s cells] that enter through `side` of the box.
    pub fn entered(&self, from: State<'_>, side: usize, density: [Real; 2]) -> [Real; 4] {
        if self.openings[side].is_none() {
            return [0.0; 4];
        }
        let d = self.direction;
        let mut range = self.domain.interior();
        range[d] = if side == 0 { 0..1 } else { range[d].end..range[d].end + 1 };
        self.domain.sum_rows(&range, |row| {
            SCRATCH.with_borrow_mut(|scratch| {
                scratch.reserve(BLOCK + 1, self.domain.cells()[0] + 1);
                let Scratch { rows, cells: [weight, ..] } = scratch;
                let faces = &mut rows[0];
                self.fluxes(from, row.start, row.len, faces, weight);
                self.open(side, [row.j, row.k].map(|n| n as usize), 0..row.len, faces);
                let inward = if side == 0 { 1.0 } else { -1.0 };
                let mut sum = [0.0; 4];
                for i in 0..row.len {
                    let mass = density[0] * faces.courant[i] + density[1] * faces.liquid[i];
                    sum[0] += inward * faces.liquid[i];
                    (0..3).for_each(|d| sum[1 + d] += inward * mass * faces.velocity[d][i]);
                }
                sum
            })
        })
    }
}

/// Fluxes of pure donors; returns whether some donor holds an interface.
///
/// `weight` becomes `(1 - |c|) / 2`, the place where the donor's slope is read off, or zero where
/// the donor or a neighbour holds an interface or the interface lies on a face. Mixed-cell residue,
/// collected after the last sweep only, does not count: round-off must not decide about slopes.
fn liquid_fluxes(
    [c_ll, c_l, c_r, c_rr]: [&[Real]; 4],
    face_velocity: &[Real],
    dt_dx: Real,
    ignore_interface: bool,
    (courant, liquid, weight): (&mut [Real], &mut [Real], &mut [Real]),
) -> bool {
    let n = courant.len();
    let (c_ll, c_l, c_r, c_rr) = (&c_ll[..n], &c_l[..n], &c_r[..n], &c_rr[..n]);
    let (face_velocity, liquid, weight) = (&face_velocity[..n], &mut liquid[..n], &mut weight[..n]);
    let mut mixed = 0_u64;
    for i in 0..n {
        let c = face_velocity[i] * dt_dx;
        let forward = c > 0.0;
        let behind = if forward { c_ll[i] } else { c_rr[i] };
        let donor = if forward { c_l[i] } else { c_r[i] };
        let ahead = if forward { c_r[i] } else { c_l[i] };
        let inside = (donor > 0.0) & (donor < 1.0);
        mixed |= u64::from(inside);
        let pure = (donor <= RESIDUE) | (donor >= 1.0 - RESIDUE);
        let alike = ((behind - donor).abs() <= RESIDUE) & ((ahead - donor).abs() <= RESIDUE);
        let smooth = ignore_interface | (alike & pure);
        courant[i] = c;
        liquid[i] = c * donor.clamp(0.0, 1.0);
        weight[i] = if smooth { 0.5 * (1.0 - c.abs()) } else { 0.0 };
    }
    mixed != 0
}

/// Upwind values on the faces.
fn face_values(
    slope: impl Slope,
    [u_ll, u_l, u_r, u_rr]: [&[Real]; 4],
    courant: &[Real],
    weight: &[Real],
    value: &mut [Real],
) {
    let n = value.len();
    let (u_ll, u_l, u_r, u_rr) = (&u_ll[..n], &u_l[..n], &u_r[..n], &u_rr[..n]);
    let (courant, weight) = (&courant[..n], &weight[..n]);
    for i in 0..n {
        let forward = courant[i] > 0.0;
        let behind = if forward { u_ll[i] } else { u_rr[i] };
        let donor = if forward { u_l[i] } else { u_r[i] };
        let ahead = if forward { u_r[i] } else { u_l[i] };
        value[i] = donor + slope.gain(weight[i], donor - behind, ahead - donor);
    }
}

/// Some planes of a sweep.
struct Chunk<'s, 'd> {
    sweep: &'s Sweep<'d>,
    from: State<'s>,
    frozen: Frozen<'s>,
    to: StateMut<'s>,
    /// Place in the whole fields of the first value of `to`.
    origin: usize,
}

impl Chunk<'_, '_> {
    fn run(&mut self, planes: std::ops::Range<usize>, scratch: &mut Scratch) {
        let [n1, n2, n3] = self.sweep.domain.cells();
        scratch.reserve(BLOCK + 1, n1 + 1);
        let Scratch { rows, cells } = scratch;
        let (sweep, from) = (self.sweep, self.from);
        match sweep.direction {
            0 => {
                for k in planes {
                    for j in 0..n2 {
                        let row = &mut rows[0];
                        sweep.fluxes(from, sweep.at(j, k), n1 + 1, row, &mut cells[0]);
                        sweep.open(0, [j, k], 0..1, row);
                        sweep.open(1, [j, k], n1..n1 + 1, row);
                        self.update(sweep.at(j, k), (row, 0), (row, 1), cells);
                    }
                }
            }
            1 => {
                let (lower, upper) = rows.split_at_mut(1);
                let (mut lower, mut upper) = (&mut lower[0], &mut upper[0]);
                for k in planes {
                    sweep.fluxes(from, sweep.at(0, k), n1, lower, &mut cells[0]);
                    sweep.open(0, [0, k], 0..n1, lower);
                    for j in 0..n2 {
                        sweep.fluxes(from, sweep.at(j + 1, k), n1, upper, &mut cells[0]);
                        if j + 1 == n2 {
                            sweep.open(1, [j, k], 0..n1, upper);
                        }
                        self.update(sweep.at(j, k), (lower, 0), (upper, 0), cells);
                        std::mem::swap(&mut lower, &mut upper);
                    }
                }
            }
            _ => {
                let (upper, lowers) = rows.split_at_mut(1);
                let upper = &mut upper[0];
                for first in (0..n2).step_by(BLOCK) {
                    let block = first..(first + BLOCK).min(n2);
                    for (j, lower) in block.clone().zip(&mut *lowers) {
                        sweep.fluxes(from, sweep.at(j, planes.start), n1, lower, &mut cells[0]);
                        if planes.start == 0 {
                            sweep.open(0, [j, planes.start], 0..n1, lower);
                        }
                    }
                    for k in planes.clone() {
                        for (j, lower) in block.clone().zip(&mut *lowers) {
                            sweep.fluxes(from, sweep.at(j, k + 1), n1, upper, &mut cells[0]);
                            if k + 1 == n3 {
                                sweep.open(1, [j, k], 0..n1, upper);
                            }
                            self.update(sweep.at(j, k), (lower, 0), (upper, 0), cells);
                            std::mem::swap(lower, upper);
                        }
                    }
                }
            }
        }
    }

    /// Updates the row of cells from `at` on with the fluxes through its lower and upper faces.
    fn update(
        &mut self,
        at: usize,
        (lower, l): (&FaceRow, usize),
        (upper, u): (&FaceRow, usize),
        [gain, loss, dilatation, kept]: &mut [Vec<Real>; 4],
    ) {
        let n = self.sweep.domain.cells()[0];
        let place = at - self.origin;
        let old = |field: usize, kept: &mut [Real], to: &[Real]| match self.frozen {
            Frozen::Read => kept.copy_from_slice(&self.from[field][at..at + n]),
            Frozen::Kept(old) => kept.copy_from_slice(&old[field][at..at + n]),
            Frozen::Overwritten => kept.copy_from_slice(to),
        };
        let (gain, loss, dilatation, kept) = (&mut gain[..n], &mut loss[..n], &mut dilatation[..n], &mut kept[..n]);
        let [c_to, u_to @ ..] = &mut self.to;
        let c_to = &mut c_to[place..place + n];
        old(0, kept, c_to);
        let c = &self.from[0][at..at + n];
        update_liquid(
            c,
            kept,
            [&lower.courant[l..l + n], &upper.courant[u..u + n]],
            [&lower.liquid[l..l + n], &upper.liquid[u..u + n]],
            self.sweep.density,
            (&mut *c_to, &mut *gain, &mut *loss, &mut *dilatation),
        );
        if self.sweep.convection == Convection::Off {
            return;
        }
        for (d, to) in u_to.iter_mut().enumerate() {
            let to = &mut to[place..place + n];
            old(1 + d, kept, to);
            let faces = [&lower.velocity[d][l..l + n], &upper.velocity[d][u..u + n]];
            update_velocity(&self.from[1 + d][at..at + n], kept, faces, [gain, loss, dilatation], to);
        }
    }
}

/// Updates a row of liquid fractions. `gain`, `loss` and `dilatation` become the mass that enters
/// through the lower faces, leaves through the upper ones, and that of the dilatation, over the new
/// mass of the cell.
fn update_liquid(
    c: &[Real],
    c_old: &[Real],
    [c_in, c_out]: [&[Real]; 2],
    [g_in, g_out]: [&[Real]; 2],
    [rho_g, rho_d]: [Real; 2],
    (to, gain, loss, dilatation): (&mut [Real], &mut [Real], &mut [Real], &mut [Real]),
) {
    let n = to.len();
    let (c, c_old, c_in, c_out, g_in, g_out) = (&c[..n], &c_old[..n], &c_in[..n], &c_out[..n], &g_in[..n], &g_out[..n]);
    let (gain, loss, dilatation) = (&mut gain[..n], &mut loss[..n], &mut dilatation[..n]);
    for i in 0..n {
        let full = if c_old[i] > 0.5 { 1.0 } else { 0.0 };
        let widening = c_out[i] - c_in[i];
        let c_new = c[i] + (full * widening - (g_out[i] - g_in[i]));
        let specific_volume = 1.0 / (rho_g + rho_d * c_new);
        to[i] = c_new;
        gain[i] = (rho_g * c_in[i] + rho_d * g_in[i]) * specific_volume;
        loss[i] = (rho_g * c_out[i] + rho_d * g_out[i]) * specific_volume;
        dilatation[i] = (rho_g + rho_d * full) * widening * specific_volume;
    }
}

/// Updates a row of one velocity component.
fn update_velocity(
    v: &[Real],
    v_old: &[Real],
    [v_in, v_out]: [&[Real]; 2],
    [gain, loss, dilatation]: [&[Real]; 3],
    to: &mut [Real],
) {
    let n = to.len();
    let (v, v_old, v_in, v_out) = (&v[..n], &v_old[..n], &v_in[..n], &v_out[..n]);
    let (gain, loss, dilatation) = (&gain[..n], &loss[..n], &dilatation[..n]);
    for i in 0..n {
        let change = gain[i] * (v_in[i] - v[i]) - loss[i] * (v_out[i] - v[i]) + dilatation[i] * (v_old[i] - v[i]);
        to[i] = v[i] + change;
    }
}
