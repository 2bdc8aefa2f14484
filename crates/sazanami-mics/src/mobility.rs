//! Mobility of the faces of the cells under the pressure: grains close them in part.
//!
//! With the closed part of a face `chi = (alpha_L rho_L + alpha_R rho_R) / (rho_L + rho_R)`, the mean solid fraction
//! of its cells weighted by the mass of their fluid, the face velocity is
//!
//! ```text
//! u_f = (1 - chi) (u* - dt 2 (p_R - p_L) / ((rho_L + rho_R) dx))
//!     + chi (u_s + dt a + dt (grad p_old - grad p) / rho_s)
//! ```
//!
//! (where an acceleration has been carried through the viscous step (`acceleration.rs`), `grad p_old` is the gradient that gives it to
//! the fluid that is there now). `u_s + dt a` is the velocity that the grain has at the end of the step if its acceleration stays what it was, and
//! the last term the change of that acceleration by the change of the pressure: the projection moves the closed part
//! as a grain of density `rho_s` moves, in the same step. Fluid and grain are thus coupled implicitly (no lower limit
//! of the density ratio), the closed part of a fixed grain does not leak in steady flow, and the equation has no
//! closed pockets. Since `sum chi dV (-grad p)` over the faces is the force of the pressure on the grain
//! ([`crate::grains`]), the mean velocity of the closed parts is that of the grain. Face apertures in the pressure
//! equation: Ng, Min and Gibou, J. Comput. Phys. 228 (2009) 8807; a rigid body in it: Batty, Bertails and Bridson,
//! ACM Trans. Graph. 26 (2007) 100.

use sazanami_numerics::domain::{Domain, Row};
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::boundary::Boundary;
use crate::flow::Flow;

/// Least open part of a cell or a face that two grains share: a gap between them counts as at least so wide, in cells. What is narrower is
/// not sealed, since grains touch by their roughness.
pub(crate) const NARROWEST: Real = 0.05;

/// Mobility of the faces: acceleration by a pressure difference over that in fluid alone.
pub struct Mobility {
    faces: [Field<Real>; 3],
    /// Rows of faces beside covered cells, per direction.
    rows: [RowSet; 3],
    ones: Vec<Real>,
}

/// A set of rows of cells or faces, those of one ghost layer and of the last faces included.
#[derive(Default)]
pub(crate) struct RowSet {
    marked: Vec<bool>,
    width: usize,
}

impl RowSet {
    pub fn mark(&mut self, [n2, n3]: [usize; 2], marked: impl Fn(isize, isize) -> bool + Sync) {
        self.width = n2 + 2;
        self.marked.resize(self.width * (n3 + 2), false);
        for_each_chunk(&mut self.marked[..], self.width, |k, layer| {
            (-1..).zip(layer).for_each(|(j, row)| *row = marked(j, k as isize - 1));
        });
    }

    /// Whether the row with these local indices, from -1 on, is in the set.
    #[inline]
    pub fn holds(&self, j: isize, k: isize) -> bool {
        !self.marked.is_empty() && self.marked[(k + 1) as usize * self.width + (j + 1) as usize]
    }

    /// The rows of cells with a solid fraction, ghosts included: the first ghost layer of `alpha` must be filled, and
    /// `covered` tells of rows of the interior.
    pub fn covered(&mut self, domain: &Domain, alpha: &Field<Real>, covered: impl Fn(isize, isize) -> bool + Sync) {
        let [n1, n2, n3] = domain.cells();
        self.mark([n2, n3], |j, k| {
            if (0..n2 as isize).contains(&j) && (0..n3 as isize).contains(&k) && covered(j, k) {
                return true;
            }
            let start = alpha.at(-1, j, k);
            let inside = (0..n2 as isize).contains(&j) && (0..n3 as isize).contains(&k);
            let row = &alpha.data()[start..start + n1 + 2];
            if inside { row[0] > 0.0 || row[n1 + 1] > 0.0 } else { row.iter().any(|&alpha| alpha > 0.0) }
        });
    }

    /// The rows of this set and those beside them.
    pub fn and_beside(&mut self, domain: &Domain, of: &Self) {
        let [_, n2, n3] = domain.cells();
        let holds =
            |j: isize, k: isize| (-1..=n2 as isize).contains(&j) && (-1..=n3 as isize).contains(&k) && of.holds(j, k);
        self.mark([n2, n3], |j, k| [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)].iter().any(|(a, b)| holds(j + a, k + b)));
    }
}

/// Grains that close faces: fields with one ghost layer filled, per cell the sums over the grains in it.
#[derive(Clone, Copy)]
pub(crate) struct Closing<'a> {
    /// Solid fraction alpha.
    pub fraction: &'a [Real],
    /// Solid mass per volume, sum of `alpha_k rho_k` [kg/m^3].
    pub density: &'a [Real],
    /// Sum of `alpha_k` times the velocity expected of the grain at the end of the step [m/s].
    pub velocity: [&'a [Real]; 3],
    /// The acceleration on the faces that the velocities of grains have already felt, and gravity in it [m/s^2]; else it is that of the
    /// last pressure.
    pub before: Option<(&'a [Field<Real>; 3], Vector)>,
    /// Part of an acceleration that friction leaves within the step, if the projection counts it.
    pub response: Option<&'a [Real]>,
    /// Whether the grains take the fluid that friction binds along.
    pub binding: bool,
    /// Rows with a fraction above zero.
    pub rows: &'a RowSet,
    /// Number of grains in each cell, where some hold more than one.
    pub shared: Option<&'a [Real]>,
    /// What all grains cover of the faces, for those beside such cells.
    pub cut: Option<&'a Cut<'a>>,
}

/// Sums over the grains on the lower faces in each direction: their part of the face, the volume that they carry through over its area
/// [m/s], and the part over their density [m^3/kg].
pub(crate) type Cut<'a> = dyn Fn(&mut [Field<Real>; 9]) + 'a;

impl Mobility {
    /// Faces that nothing closes.
    #[must_use]
    pub fn new(domain: &Domain) -> Self {
        Self {
            faces: std::array::from_fn(|_| Field::new([0; 3], 1.0)),
            rows: Default::default(),
            ones: vec![1.0; domain.cells()[0] + 1],
        }
    }

    /// Mobility of the lower faces in `direction` of a row of cells; of their upper faces with `upper`.
    #[inline]
    pub(crate) fn of(&self, direction: usize, row: &Row, upper: bool) -> &[Real] {
        let step = |d: usize| isize::from(upper && direction == d);
        if !self.rows[direction].holds(row.j + step(1), row.k + step(2)) {
            return &self.ones[..row.len];
        }
        let faces = &self.faces[direction];
        let start = row.start + if upper { faces.strides()[direction] } else { 0 };
        &faces.data()[start..start + row.len]
    }

    /// Closes the faces beside the grains: changes the predicted face velocities, and the mobility for a projection over
    /// `dt` \[s] after the one that gave `pressure`, with its jumps by surface tension.
    pub(crate) fn close(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        closing: Closing<'_>,
        (pressure, jump): (&Field<Real>, Option<&[Field<Real>; 3]>),
        flow: &mut Flow,
        dt: Real,
    ) {
        let Closing {
            fraction: alpha,
            density: solid,
            velocity,
            before,
            response,
            binding,
            rows: covered,
            shared,
            cut,
        } = closing;
        let cut = cut.filter(|_| shared.is_some());
        let [_, n2, n3] = domain.cells();
        let shared = cut.and(shared);
        let is_shared = |at: usize| shared.is_some_and(|count| count[at] > 1.0);
        let (p, rho) = (pressure.data(), flow.density.data());
        if let Some(cut) = cut {
            cut(&mut flow.work);
        }
        for (d, uf) in flow.face_velocity.iter_mut().enumerate() {
            let [sections, fluxes, light] = [0, 1, 2].map(|n| flow.work[3 * d + n].data());
            if self.faces[d].cells() != domain.cells() {
                self.faces[d] = domain.field(1.0);
            }
            let (a, b) = ([0, 1, 0][d], [0, 0, 1][d]);
            self.rows[d].mark([n2, n3], |j, k| {
                covered.holds(j, k) || (j + 1 >= a && k + 1 >= b && covered.holds(j - a, k - b))
            });
            let behind = domain.strides()[d] as usize;
            let (rows, velocity) = (&self.rows[d], velocity[d]);
            let jump = jump.map(|jump| jump[d].data());
            let scale = dt / domain.grid().spacing[d];
            let ends = [0, 1].map(|side| domain.at_box_end(d, side) && !domain.periodic()[d]);
            let last = domain.cells()[d] as isize;
            let on_side = |n: isize| (ends[0] && n == 0) || (ends[1] && n == last);
            domain.for_each_row(&domain.faces(d), (uf.data_mut(), self.faces[d].data_mut()), |row, (uf, mobility)| {
                if !rows.holds(row.j, row.k) {
                    return;
                }
                for (i, at) in row.shifted(0).enumerate() {
                    let index = [row.first + i as isize, row.j, row.k][d];
                    let (below, here) = (alpha[at - behind], alpha[at]);
                    let both = below + here;
                    if both == 0.0 || on_side(index) {
                        mobility[i] = 1.0;
                        continue;
                    }
                    let mass = rho[at - behind] + rho[at];
                    let (closed, held, lightness) = if is_shared(at - behind) || is_shared(at) {
                        let closed = sections[at].clamp(0.0, 1.0 - NARROWEST);
                        let lightness = if sections[at] > 0.0 { light[at] / sections[at] } else { 0.0 };
                        (closed, fluxes[at] - closed * uf[i], lightness)
                    } else {
                        let closed = (below.min(1.0) * rho[at - behind] + here.min(1.0) * rho[at]) / mass;
                        let rigid = (velocity[at - behind] + velocity[at]) / both;
                        (closed, closed * (rigid - uf[i]), both / (solid[at - behind] + solid[at]))
                    };
                    let response =
                        response.map_or(1.0, |b| (b[at - behind] * rho[at - behind] + b[at] * rho[at]) / mass);
                    let bound = if binding { closed + (1.0 - closed) * (1.0 - response) } else { closed };
                    let felt = match before {
                        Some((faces, gravity)) => 0.5 * mass * dt * (gravity[d] - faces[d].data()[at]),
                        None => scale * (p[at] - p[at - behind] - jump.map_or(0.0, |jump| jump[at])),
                    };
                    uf[i] += held + bound * lightness * felt;
                    mobility[i] = (1.0 - closed) * response + bound * lightness * 0.5 * mass;
                }
            });
            domain.fill_halos_to(1, &mut [(uf, &boundary.face_velocity_rules(d))]);
        }
    }
}
