//! Turbulence below the particles, put in by name: an eddy viscosity by Prandtl's mixing length over a bed.
//!
//! `nu_t = l^2 sqrt(2 S:S)` with the rate of strain `S` of each particle's own velocity gradient. The length grows from floor and
//! bed upwards as `dl/dz = kappa max(1 - phi/phi_max, 0)` with the solid fraction `phi` (Li & Sawamoto 1995; Maurin et al. 2015,
//! Phys. Fluids 27, 113302, eq. (10)), so that it is `kappa z` above a bed and nothing in it, and is no more than `kappa` times
//! the distance from any other wall that holds the water.

use sazanami_numerics::{Matrix, Real, Vector};
use sazanami_parallel::{Reduction, Rows, for_each_chunk};

use crate::boundary::{Side, Tank, WallFriction};
use crate::context::Context;
use crate::ghosts::Ghosts;
use crate::grains::OverlappingGrains;
use crate::particles::{Kind, Particles, Role};
use crate::reductions::{largest, set_column};

/// Von Karman's constant.
pub const KARMAN: Real = 0.41;

/// Solid fraction from which on there are no eddies: that of a loose bed. With the densest packing, 0.61, in its place the length at
/// the top of a bed grows with the depth of the bed below.
pub const CROWDED: Real = 0.5;

/// Mixing lengths of the box in columns, and the eddy viscosity of the particles.
#[derive(Debug, Default)]
pub(crate) struct Eddies {
    /// Columns along x1 and x2, and layers.
    counts: [usize; 3],
    /// Lower corner of the box as it stands, of the domain along periodic directions \[m].
    lower: Vector,
    /// Size of a cell \[m].
    cell: Vector,
    /// Space for eddies of each layer, column by column; then its sum from the floor up, over `layers + 1` heights, over the height of
    /// a layer.
    open: Vec<Real>,
    /// Distance between floor and bed, and the height, over the height of a layer.
    depth: Vec<Real>,
    /// Eddy viscosity over that of the fluid, of each particle and ghost.
    pub relative: Vec<Real>,
    /// Mixing length of the largest eddies in the water \[m].
    pub longest: Real,
    /// Stress of the eddies over the density [m^2/s^2], the square of a friction velocity, mixing length \[m] and that viscosity of each.
    pub turbulence: Vec<Vector>,
}

impl Eddies {
    /// Mixing lengths where grains and walls are now; void fractions are placed. All ranks have all columns.
    pub fn measure(&mut self, step: &Context<'_>, tank: &Tank, grains: &OverlappingGrains) {
        let extent = tank.upper - tank.lower;
        // Along periodic directions grains and water are where the domain is, however far the walls have gone.
        let periodic = step.periods.length.cmpgt(Vector::ZERO);
        self.lower = tank.lower + Vector::select(periodic, Vector::ZERO, tank.displacement);
        let wide = grains.coupling().smoothing.max(step.settings.fluid.spacing);
        let sizes = [wide, wide, step.settings.fluid.spacing];
        self.counts =
            [0, 1, 2].map(|d| if grains.is_empty() && d < 2 { 1 } else { (extent[d] / sizes[d]).ceil() as usize });
        let [nx, ny, layers] = self.counts;
        self.cell = extent / Vector::new(nx as Real, ny as Real, layers as Real);
        self.open.resize(nx * ny * layers, 0.0);
        let (lower, cell, me) = (self.lower, self.cell, step.domain.communicator().rank());
        for_each_chunk(Rows { data: &mut self.open[..], width: layers }, 1, |column, open| {
            let [i, j] = [column % nx, column / nx];
            for (k, open) in open.data.iter_mut().enumerate() {
                let place = lower + Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real + 0.5) * cell;
                // One rank knows the grains of a place, and the others have nothing there: the sum is exact.
                let mine = step.domain.owner_of(place) == me;
                *open = if mine { (1.0 - (1.0 - grains.void_fraction(place)) / CROWDED).max(0.0) } else { 0.0 };
            }
        });
        step.domain.communicator().all_reduce(&mut self.open, Reduction::Sum);
        self.depth.resize(nx * ny * (layers + 1), 0.0);
        let open = &self.open[..];
        for_each_chunk(Rows { data: &mut self.depth[..], width: layers + 1 }, 1, |column, depth| {
            depth.data[0] = 0.0;
            for k in 0..layers {
                depth.data[k + 1] = depth.data[k] + open[column * layers + k];
            }
        });
    }

    /// Mixing length at a place in the box \[m].
    fn length(&self, tank: &Tank, place: Vector) -> Real {
        let [nx, ny, layers] = self.counts;
        let at = (place - self.lower) / self.cell;
        let extent = tank.upper - tank.lower;
        // Between the middles of columns, round a periodic box and level beyond the last ones of another.
        let between = |d: usize, n: usize| {
            let x = at[d] - 0.5;
            let floor = x.floor();
            let column = |i: Real| {
                let i = i as isize;
                let n = n as isize;
                (if tank.sides[d][0] == Side::Periodic { i.rem_euclid(n) } else { i.clamp(0, n - 1) }) as usize
            };
            ([column(floor), column(floor + 1.0)], x - floor)
        };
        let ([i0, i1], fx) = between(0, nx);
        let ([j0, j1], fy) = between(1, ny);
        let k = at.z.clamp(0.0, layers as Real);
        let layer = (k as usize).min(layers - 1);
        let fz = k - layer as Real;
        let depth = |i: usize, j: usize| {
            let column = &self.depth[(j * nx + i) * (layers + 1)..];
            column[layer] + fz * (column[layer + 1] - column[layer])
        };
        let along = |j: usize| (1.0 - fx) * depth(i0, j) + fx * depth(i1, j);
        let mut distance = self.cell.z * ((1.0 - fy) * along(j0) + fy * along(j1));
        for (d, side) in [(0, 0), (0, 1), (1, 0), (1, 1), (2, 1)] {
            if tank.sides[d][side] == Side::Wall && tank.friction[d][side] == WallFriction::NoSlip {
                let inside = place[d] - self.lower[d];
                distance = distance.min(if side == 0 { inside } else { extent[d] - inside }.max(0.0));
            }
        }
        KARMAN * distance
    }

    /// Sets the eddy viscosity of particles and ghosts over that of the fluid from their velocity gradients, none for spray; returns the largest
    /// viscosity of fluid and eddies together [m^2/s].
    pub fn set(
        &mut self,
        step: &Context<'_>,
        tank: &Tank,
        (particles, gradient): (&Particles, &[Matrix]),
        ghosts: &mut Ghosts,
    ) -> Real {
        let viscosity = step.settings.fluid.viscosity;
        let (mut relative, mut turbulence) = (std::mem::take(&mut self.relative), std::mem::take(&mut self.turbulence));
        let Particles { kind, role, position, owned, .. } = particles;
        set_column(&mut turbulence, particles.len(), |a| {
            if a >= *owned || kind[a] != Kind::Fluid || role[a] == Role::Inactive {
                return Vector::ZERO;
            }
            let (length, rate) = (self.length(tank, position[a]), rate_of_strain(&gradient[a]));
            Vector::new((length * rate).powi(2), length, length * length * rate / viscosity)
        });
        ghosts.refresh(step.domain, &mut turbulence);
        let eddies = &turbulence[..];
        set_column(&mut relative, particles.len(), |a| eddies[a].z);
        (self.relative, self.turbulence) = (relative, turbulence);
        let (relative, turbulence) = (&self.relative[..], &self.turbulence[..]);
        self.longest = step.domain.max(largest(*owned, |a| turbulence[a].y)).max(0.0);
        viscosity * (1.0 + step.domain.max(largest(*owned, |a| relative[a])).max(0.0))
    }
}

/// `sqrt(2 S:S)` [1/s]: the shear rate of a simple shear.
fn rate_of_strain(gradient: &Matrix) -> Real {
    let twice = *gradient + gradient.transpose();
    (0.5 * twice.to_cols_array().iter().map(|v| v * v).sum::<Real>()).sqrt()
}
