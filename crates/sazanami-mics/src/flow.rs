//! Liquid and gas on the grid: the fields, the predicted face velocities, and sums over the fields.
//!
//! Cell centres hold the liquid fraction C of the fluid and the velocity u; faces hold the normal
//! velocity, divergence-free after the last projection. The density follows from C.

use sazanami_numerics::domain::{Domain, GhostRules, Row};
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};

use crate::advection::{State, StateMut};
use crate::boundary::Boundary;
use crate::interface::Collector;
use crate::schemes::Transposed;

pub use crate::fluids::Fluids;
pub use crate::schemes::{Carrier, DropVelocity, Schemes};

/// Number of scratch fields: two states for the sweeps, three vectors for the viscosity. From the viscous
/// step to the end of the pass the first three hold the change of the velocity by viscosity.
const WORK: usize = 9;
/// Default of [`Flow::viscous_tolerance`].
const VISCOUS_TOLERANCE: Real = 1e-5;

/// Fields of the two fluids on a rank's part of the grid.
pub struct Flow {
    /// Properties of the two fluids.
    pub fluids: Fluids,
    /// Numerical schemes.
    pub schemes: Schemes,
    /// Liquid fraction C of the fluid in each cell, inside grains too.
    pub volume_fraction: Field<Real>,
    /// Velocity in the cell centres [m/s].
    pub velocity: [Field<Real>; 3],
    /// Normal velocity on the lower faces in each direction [m/s].
    pub face_velocity: [Field<Real>; 3],
    /// Density of the fluid [kg/m^3].
    pub density: Field<Real>,
    /// Number of transports so far: determines the order of the sweeps.
    pub transports: u64,
    /// Face velocity one step ago [m/s] and the length of that step \[s], if the scheme needs them.
    pub previous_faces: Option<([Field<Real>; 3], Real)>,
    /// Bound of the error of the viscous solve in the velocity, relative to the velocity.
    pub viscous_tolerance: Real,
    pub(crate) transposed: Transposed,
    pub(crate) force_before: Vector,
    pub(crate) work: [Field<Real>; WORK],
    pub(crate) collector: Collector,
}

impl Flow {
    /// The box filled with gas at rest.
    #[must_use]
    pub fn new(domain: &Domain, fluids: Fluids, schemes: Schemes) -> Self {
        let three = || std::array::from_fn(|_| domain.field(0.0));
        Self {
            fluids,
            schemes,
            volume_fraction: domain.field(0.0),
            velocity: three(),
            face_velocity: three(),
            density: domain.field(fluids.gas_density),
            transports: 0,
            previous_faces: None,
            viscous_tolerance: VISCOUS_TOLERANCE,
            transposed: Transposed::default(),
            force_before: Vector::ZERO,
            work: std::array::from_fn(|_| domain.field(0.0)),
            collector: Collector::default(),
        }
    }

    /// Adds the liquid that fills the part `beta` of each cell, moving with the `velocity` at its centre [m/s].
    ///
    /// Cells keep at most their whole volume; what is there already keeps its velocity. The face
    /// velocities are not touched: predict and project them before the first step.
    pub fn add_liquid(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        beta: &Field<Real>,
        velocity: impl Fn(Vector) -> Vector + Sync,
        mode: DropVelocity,
    ) {
        let fluids = self.fluids;
        let Self { volume_fraction, velocity: [u1, u2, u3], .. } = self;
        let fields = (volume_fraction.data_mut(), u1.data_mut(), u2.data_mut(), u3.data_mut());
        domain.for_each_row(&domain.interior(), fields, |row, (c, u1, u2, u3)| {
            for (i, &beta) in beta.data()[row.shifted(0)].iter().enumerate() {
                let added = beta.min(1.0 - c[i]);
                if added > 0.0 {
                    let after = c[i] + added;
                    let weight = match mode {
                        DropVelocity::Mass => fluids.liquid_density * added / fluids.density(after),
                        DropVelocity::Beta => added,
                    };
                    c[i] = after;
                    let velocity = velocity(domain.centre(i as isize, row.j, row.k));
                    u1[i] += weight * (velocity.x - u1[i]);
                    u2[i] += weight * (velocity.y - u2[i]);
                    u3[i] += weight * (velocity.z - u3[i]);
                }
            }
        });
        self.fill_halos(domain, boundary);
    }

    /// Gives every cell the `velocity` at its centre [m/s]; [`Solver::new`](crate::solver::Solver::new) then makes the
    /// velocity on the faces divergence-free.
    pub fn set_velocity(&mut self, domain: &Domain, boundary: &Boundary, velocity: impl Fn(Vector) -> Vector + Sync) {
        for (d, u) in self.velocity.iter_mut().enumerate() {
            domain.set(u, |i, j, k| velocity(domain.centre(i, j, k))[d]);
        }
        self.fill_halos(domain, boundary);
    }

    /// Adds the `velocity` at its centre [m/s] to that of every cell, as [`Self::set_velocity`].
    pub fn add_velocity(&mut self, domain: &Domain, boundary: &Boundary, velocity: impl Fn(Vector) -> Vector + Sync) {
        for (d, u) in self.velocity.iter_mut().enumerate() {
            domain.for_each_row(&domain.interior(), u.data_mut(), |row, u| {
                u.iter_mut().zip(0..).for_each(|(u, i)| *u += velocity(domain.centre(i, row.j, row.k))[d]);
            });
        }
        self.fill_halos(domain, boundary);
    }

    /// Gives every cell the mean velocity of its opposite faces.
    pub(crate) fn take_faces(&mut self, domain: &Domain) {
        let ahead = domain.strides();
        for (d, (u, uf)) in self.velocity.iter_mut().zip(&self.face_velocity).enumerate() {
            let uf = uf.data();
            domain.for_each_row(&domain.interior(), u.data_mut(), |row, u| {
                let opposite = uf[row.shifted(0)].iter().zip(&uf[row.shifted(ahead[d])]);
                u.iter_mut().zip(opposite).for_each(|(u, (low, high))| *u = 0.5 * (low + high));
            });
        }
    }

    /// Fills the ghosts of all fields and sets the density from the volume fraction.
    pub fn fill_halos(&mut self, domain: &Domain, boundary: &Boundary) {
        let Self { volume_fraction, velocity: [u1, u2, u3], face_velocity, .. } = self;
        StateFields { c: volume_fraction, u: [u1, u2, u3] }.fill_halos(domain, boundary, true);
        let rules: [GhostRules; 3] = std::array::from_fn(|d| boundary.face_velocity_rules(d));
        let [f1, f2, f3] = face_velocity;
        domain.fill_halos(&mut [(f1, &rules[0]), (f2, &rules[1]), (f3, &rules[2])]);
        self.update_density(domain);
    }

    pub(crate) fn update_density(&mut self, domain: &Domain) {
        let (fluids, c) = (self.fluids, self.volume_fraction.data());
        domain.for_each_row(&domain.interior_and(2), self.density.data_mut(), |row, rho| {
            for (rho, &c) in rho.iter_mut().zip(&c[row.shifted(0)]) {
                *rho = fluids.density(c);
            }
        });
    }

    /// Predicts the face velocities: mass-weighted means of the cells on both sides, after a uniform
    /// `acceleration` [m/s^2] of all cells for `dt` \[s]; walls and inlets keep their velocity.
    pub fn predict_faces(&mut self, domain: &Domain, boundary: &Boundary, acceleration: Vector, dt: Real) {
        self.predict_faces_by(domain, boundary, |d, _, u| fall(u, acceleration[d] * dt), |_, _, _, _| {});
    }

    /// The same, where `change(d, row, u)` changes component `d` of the velocity in a row of cells first, and `correct(d, row, density, uf)`
    /// at last what comes of it on a row of faces.
    pub(crate) fn predict_faces_by(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        change: impl Fn(usize, &Row, &mut [Real]) + Sync,
        correct: impl Fn(usize, &Row, &[Real], &mut [Real]) + Sync,
    ) {
        let Self { velocity, face_velocity, density, .. } = self;
        let rho = density.data();
        for (d, (u, uf)) in velocity.iter_mut().zip(face_velocity.iter_mut()).enumerate() {
            domain.for_each_row(&domain.interior(), u.data_mut(), |row, u| change(d, &row, u));
            domain.fill_halos_to(1, &mut [(u, &boundary.velocity_rules(d))]);
            let behind = -domain.strides()[d];
            let u = u.data();
            domain.for_each_row(&domain.faces(d), uf.data_mut(), |row, uf| {
                let (rho_l, rho_r) = (&rho[row.shifted(behind)], &rho[row.shifted(0)]);
                let (u_l, u_r) = (&u[row.shifted(behind)], &u[row.shifted(0)]);
                for (i, uf) in uf[..row.len].iter_mut().enumerate() {
                    *uf = (rho_l[i] * u_l[i] + rho_r[i] * u_r[i]) / (rho_l[i] + rho_r[i]);
                }
                correct(d, &row, rho, uf);
            });
            domain.fill_halos_to(1, &mut [(uf, &boundary.face_velocity_rules(d))]);
        }
    }

    /// Volume of the liquid, inside grains too, over all ranks [m^3].
    #[must_use]
    pub fn liquid_volume(&self, domain: &Domain) -> Real {
        let c = self.volume_fraction.data();
        let sum = domain.sum_rows(&domain.interior(), |row| [c[row.shifted(0)].iter().sum()]);
        domain.sum(sum)[0] * domain.grid().cell_volume()
    }

    /// Mass of liquid and gas, over all ranks \[kg].
    #[must_use]
    pub fn mass(&self, domain: &Domain) -> Real {
        let rho = self.density.data();
        let sum = domain.sum_rows(&domain.interior(), |row| [rho[row.shifted(0)].iter().sum()]);
        domain.sum(sum)[0] * domain.grid().cell_volume()
    }

    /// Momentum of the liquid and of the gas, over all ranks [N s].
    #[must_use]
    pub fn momentum(&self, domain: &Domain) -> [Vector; 2] {
        let (c, u) = (self.volume_fraction.data(), self.velocity.each_ref().map(Field::data));
        let sum = domain.sum(domain.sum_rows(&domain.interior(), |row| {
            let mut sum = [0.0; 6];
            for at in row.shifted(0) {
                let (liquid, gas) = (self.fluids.liquid_density * c[at], self.fluids.gas_density * (1.0 - c[at]));
                for d in 0..3 {
                    sum[d] += liquid * u[d][at];
                    sum[3 + d] += gas * u[d][at];
                }
            }
            sum
        }));
        [Vector::from_slice(&sum[..3]), Vector::from_slice(&sum[3..])].map(|p| p * domain.grid().cell_volume())
    }

    /// Kinetic energy of liquid and gas, over all ranks \[J].
    #[must_use]
    pub fn kinetic_energy(&self, domain: &Domain) -> Real {
        let (rho, u) = (self.density.data(), self.velocity.each_ref().map(Field::data));
        let sum = domain.sum_rows(&domain.interior(), |row| {
            [row.shifted(0).map(|at| rho[at] * (0..3).map(|d| u[d][at] * u[d][at]).sum::<Real>()).sum()]
        });
        0.5 * domain.sum(sum)[0] * domain.grid().cell_volume()
    }

    /// Largest sum over the directions of `|u_f| / dx` of a cell, over all ranks [1/s]: the time
    /// step times this must stay below 1/2 for split transport.
    #[must_use]
    pub fn advective_rate(&self, domain: &Domain) -> Real {
        let uf = self.face_velocity.each_ref().map(Field::data);
        let spacing = domain.grid().spacing;
        domain.max(domain.max_rows(&domain.interior(), |row| {
            let faces =
                std::array::from_fn::<_, 3, _>(|d| (&uf[d][row.shifted(0)], &uf[d][row.shifted(domain.strides()[d])]));
            let rate =
                |i: usize| (0..3).map(|d| faces[d].0[i].abs().max(faces[d].1[i].abs()) / spacing[d]).sum::<Real>();
            let max = |a: Real, b: Real| sazanami_parallel::Reduction::Max.combine(a, b);
            (0..row.len).map(rate).fold(0.0, max)
        }))
    }
}

/// Adds `gain` [m/s] to a component of the velocity in a row of cells.
pub(crate) fn fall(u: &mut [Real], gain: Real) {
    if gain != 0.0 {
        u.iter_mut().for_each(|u| *u += gain);
    }
}

/// A volume fraction and a velocity at the same stage of the sweeps.
pub(crate) struct StateFields<'a> {
    pub c: &'a mut Field<Real>,
    pub u: [&'a mut Field<Real>; 3],
}

impl StateFields<'_> {
    pub fn read(&self) -> State<'_> {
        let [u1, u2, u3] = self.u.each_ref();
        [self.c.data(), u1.data(), u2.data(), u3.data()]
    }

    pub fn write(&mut self) -> StateMut<'_> {
        let [u1, u2, u3] = self.u.each_mut();
        [self.c.data_mut(), u1.data_mut(), u2.data_mut(), u3.data_mut()]
    }

    /// Fills the ghosts of the volume fraction, and of the velocity if `velocity`.
    pub fn fill_halos(&mut self, domain: &Domain, boundary: &Boundary, velocity: bool) {
        let rules: [GhostRules; 3] = std::array::from_fn(|d| boundary.velocity_rules(d));
        let c_rules = boundary.volume_fraction_rules();
        let [u1, u2, u3] = self.u.each_mut();
        if velocity {
            let fields = &mut [(&mut *self.c, &c_rules), (u1, &rules[0]), (u2, &rules[1]), (u3, &rules[2])];
            domain.fill_halos(fields);
        } else {
            domain.fill_halos(&mut [(&mut *self.c, &c_rules)]);
        }
    }
}
