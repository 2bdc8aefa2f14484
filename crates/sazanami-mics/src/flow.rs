//! Liquid and gas on the grid: the fields, their transport, and the predicted face velocities.
//!
//! Cell centres hold the liquid fraction C of the fluid and the velocity u; faces hold the normal
//! velocity, divergence-free after the last projection. The density follows from C.

use sazanami_numerics::choices;
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};

use crate::advection::{Convection, Dilatation, Frozen, Limiter, State, StateMut, Sweep};
use crate::boundary::Boundary;
use crate::interface::{Collector, InterfaceScheme, ResidueReport};
use crate::viscosity::{TOLERANCE, ViscosityScheme};

pub use crate::viscosity::DiffusionReport;

/// Properties of the two fluids.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluids {
    /// Density of the liquid [kg/m^3].
    pub liquid_density: Real,
    /// Density of the gas [kg/m^3].
    pub gas_density: Real,
    /// Dynamic viscosity of the liquid [Pa s].
    pub liquid_viscosity: Real,
    /// Dynamic viscosity of the gas [Pa s].
    pub gas_viscosity: Real,
}

impl Fluids {
    /// Density of a mixture with liquid fraction `c` [kg/m^3].
    #[inline]
    #[must_use]
    pub fn density(&self, c: Real) -> Real {
        self.gas_density + (self.liquid_density - self.gas_density) * c
    }

    /// Constant and slope of the density as a function of C [kg/m^3].
    pub(crate) fn density_line(&self) -> [Real; 2] {
        [self.gas_density, self.liquid_density - self.gas_density]
    }
}

/// Numerical schemes of the fluid phase; the default is recommended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Schemes {
    /// Reconstruction of the interface.
    pub interface: InterfaceScheme,
    /// Convection of momentum.
    pub convection: Convection,
    /// Slope limiter of the velocity.
    pub limiter: Limiter,
    /// Time integration of the viscous stress.
    pub viscosity: ViscosityScheme,
    /// Dilatation term of the sweeps.
    pub dilatation: Dilatation,
    /// Convecting face velocity.
    pub carrier: Carrier,
}

/// Time level of the convecting face velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Carrier {
    /// Start of the step.
    #[default]
    Start,
    /// Middle of the step, by extrapolation from the last two: second order in time.
    Middle,
}

choices! {
    /// Initial velocity of cells that a liquid region fills in part.
    #[derive(Default)]
    pub enum DropVelocity {
        /// Mass-averaged: the momentum is that of the liquid.
        #[default]
        Mass = "mass",
        /// The volume fraction times the velocity, as in Yagyu et al. (2015): the momentum of a drop
        /// of 29 cells in diameter comes out 3 % too small.
        Beta = "beta",
    }
}

/// Diagnostics of a transport: inflow through open sides, and mixed-cell residue.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TransportReport {
    /// Liquid that came in through each side of the box (negative: went out) [m^3].
    pub volume_through: [[Real; 2]; 3],
    /// Momentum convected in through all sides [N s].
    pub momentum_through: Vector,
    /// Mixed-cell residue: fractions out of range or nearly pure.
    pub residue: ResidueReport,
}

impl std::ops::AddAssign for TransportReport {
    fn add_assign(&mut self, other: Self) {
        for d in 0..3 {
            (0..2).for_each(|side| self.volume_through[d][side] += other.volume_through[d][side]);
        }
        self.momentum_through += other.momentum_through;
        self.residue = self.residue.and(other.residue);
    }
}

/// Orders of the three sweeps, each followed by its reverse.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [2, 1, 0], [1, 2, 0], [0, 2, 1], [2, 0, 1], [1, 0, 2]];

/// Number of scratch fields: two states for the sweeps, three vectors for the viscosity.
const WORK: usize = 9;

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
    /// Face velocity one step ago [m/s] and the length of that step [s], if the scheme needs them.
    pub previous_faces: Option<([Field<Real>; 3], Real)>,
    /// Bound of the error of the viscous solve in the velocity, relative to the velocity.
    pub viscous_tolerance: Real,
    pub(crate) force_before: Vector,
    pub(crate) work: [Field<Real>; WORK],
    collector: Collector,
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
            viscous_tolerance: TOLERANCE,
            force_before: Vector::ZERO,
            work: std::array::from_fn(|_| domain.field(0.0)),
            collector: Collector::default(),
        }
    }

    /// Adds the liquid that fills the part `beta` of each cell, moving with `velocity` [m/s].
    ///
    /// Cells keep at most their whole volume; what is there already keeps its velocity. The face
    /// velocities are not touched: predict and project them before the first step.
    pub fn add_liquid(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        beta: &Field<Real>,
        velocity: Vector,
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
                    u1[i] += weight * (velocity.x - u1[i]);
                    u2[i] += weight * (velocity.y - u2[i]);
                    u3[i] += weight * (velocity.z - u3[i]);
                }
            }
        });
        self.fill_halos(domain, boundary);
    }

    /// Fills the ghosts of all fields and sets the density from the volume fraction.
    pub fn fill_halos(&mut self, domain: &Domain, boundary: &Boundary) {
        let Self { volume_fraction, velocity: [u1, u2, u3], face_velocity, .. } = self;
        Set { c: volume_fraction, u: [u1, u2, u3] }.fill_halos(domain, boundary, true);
        let rules: [GhostRules; 3] = std::array::from_fn(|d| boundary.face_velocity_rules(d));
        let [f1, f2, f3] = face_velocity;
        domain.fill_halos(&mut [(f1, &rules[0]), (f2, &rules[1]), (f3, &rules[2])]);
        self.update_density(domain);
    }

    fn update_density(&mut self, domain: &Domain) {
        let (fluids, c) = (self.fluids, self.volume_fraction.data());
        domain.for_each_row(&domain.interior_and(2), self.density.data_mut(), |row, rho| {
            for (rho, &c) in rho.iter_mut().zip(&c[row.shifted(0)]) {
                *rho = fluids.density(c);
            }
        });
    }

    /// Convects liquid and velocity with the face velocities for `dt` [s].
    ///
    /// Afterwards the ghosts of volume fraction and density are filled, those of the velocity are not.
    pub fn transport(&mut self, domain: &Domain, boundary: &Boundary, dt: Real) -> TransportReport {
        if self.schemes.viscosity == ViscosityScheme::CrankNicolson {
            self.diffuse_before(domain, boundary, 0.5 * dt);
        }
        if self.schemes.carrier == Carrier::Middle {
            self.move_faces_to_middle(domain, dt);
        }
        let mut report = TransportReport::default();
        let order = ORDERS[(self.transports % 6) as usize];
        self.transports += 1;
        let Self { volume_fraction, velocity: [u1, u2, u3], face_velocity, work, schemes, fluids, .. } = self;
        let [a0, a1, a2, a3, b0, b1, b2, b3, _] = work;
        let mut now = Set { c: volume_fraction, u: [u1, u2, u3] };
        let mut a = Set { c: a0, u: [a1, a2, a3] };
        let mut b = Set { c: b0, u: [b1, b2, b3] };
        now.fill_halos(domain, boundary, true);
        let rules: [GhostRules; 3] = std::array::from_fn(|d| boundary.face_velocity_rules(d));
        let [f1, f2, f3] = face_velocity;
        domain.fill_halos_to(1, &mut [(f1, &rules[0]), (f2, &rules[1]), (f3, &rules[2])]);
        let moves_velocity = schemes.convection != Convection::Off;
        let mass_density = fluids.density_line();
        let density = if schemes.convection == Convection::VelocityForm { [1.0, 0.0] } else { mass_density };
        for (number, &direction) in order.iter().enumerate() {
            let sweep = Sweep {
                domain,
                direction,
                dt_dx: dt / domain.grid().spacing[direction],
                face_velocity: [&*f1, &*f2, &*f3][direction].data(),
                interface: schemes.interface,
                convection: schemes.convection,
                density,
                openings: Sweep::openings_of(domain, boundary, direction),
            };
            let frozen_in = |kept| if schemes.dilatation == Dilatation::Frozen { kept } else { Frozen::Read };
            let from = [&now, &a, &b][number].read();
            let entered = [0, 1].map(|side| sweep.entered(schemes.limiter, from, side, mass_density));
            report.add_inflow(domain, direction, entered);
            let moved = match number {
                0 => {
                    sweep.run(schemes.limiter, now.read(), Frozen::Read, a.write());
                    &mut a
                }
                1 => {
                    sweep.run(schemes.limiter, a.read(), frozen_in(Frozen::Kept(now.read())), b.write());
                    &mut b
                }
                _ => {
                    sweep.run(schemes.limiter, b.read(), frozen_in(Frozen::Overwritten), now.write());
                    &mut now
                }
            };
            moved.fill_halos(domain, boundary, moves_velocity);
        }
        if boundary.has_openings() {
            report.sum_over_ranks(domain);
        }
        self.collect_residue(domain, boundary, &mut report);
        self.update_density(domain);
        report
    }

    /// Extrapolates the face velocity by half a step; it stays divergence-free.
    fn move_faces_to_middle(&mut self, domain: &Domain, dt: Real) {
        if let Some((previous, before)) = &mut self.previous_faces {
            let part = 0.5 * dt / *before;
            *before = dt;
            for (d, (now, old)) in self.face_velocity.iter_mut().zip(previous).enumerate() {
                domain.for_each_row(&domain.faces(d), (now.data_mut(), old.data_mut()), |_, (now, old)| {
                    for (now, old) in now.iter_mut().zip(old) {
                        let start = *now;
                        *now += part * (start - *old);
                        *old = start;
                    }
                });
            }
        } else {
            self.previous_faces = Some((self.face_velocity.clone(), dt));
        }
    }

    /// Moves mixed-cell residue to the interface.
    fn collect_residue(&mut self, domain: &Domain, boundary: &Boundary, report: &mut TransportReport) {
        let density = match self.schemes.convection {
            Convection::Consistent => self.fluids.density_line(),
            Convection::VelocityForm | Convection::Off => [1.0, 0.0],
        };
        let Self { volume_fraction, velocity, collector, .. } = self;
        let view = crate::interface::View {
            c: volume_fraction.data(),
            u: velocity.each_ref().map(|field| field.data()),
            density,
        };
        report.residue = collector.find(domain, view);
        if report.residue.moved_cells + report.residue.clipped_cells > 0 {
            collector.apply(volume_fraction.data_mut(), velocity.each_mut().map(|field| field.data_mut()));
            let [u1, u2, u3] = velocity;
            Set { c: volume_fraction, u: [u1, u2, u3] }.fill_halos(domain, boundary, false);
        }
    }

    /// Predicts the face velocities: mass-weighted means of the cells on both sides. Gravity acts on
    /// cells and faces alike for `dt` [s]; walls and inlets keep their own velocity.
    pub fn predict_faces(&mut self, domain: &Domain, boundary: &Boundary, gravity: Vector, dt: Real) {
        let Self { velocity, face_velocity, density, .. } = self;
        let rho = density.data();
        for (d, (u, uf)) in velocity.iter_mut().zip(face_velocity.iter_mut()).enumerate() {
            let gain = gravity[d] * dt;
            if gain != 0.0 {
                domain.for_each_row(&domain.interior(), u.data_mut(), |_, u| u.iter_mut().for_each(|u| *u += gain));
            }
            domain.fill_halos_to(1, &mut [(u, &boundary.velocity_rules(d))]);
            let behind = -domain.strides()[d];
            let u = u.data();
            domain.for_each_row(&domain.faces(d), uf.data_mut(), |row, uf| {
                let (rho_l, rho_r) = (&rho[row.shifted(behind)], &rho[row.shifted(0)]);
                let (u_l, u_r) = (&u[row.shifted(behind)], &u[row.shifted(0)]);
                for (i, uf) in uf.iter_mut().enumerate() {
                    *uf = (rho_l[i] * u_l[i] + rho_r[i] * u_r[i]) / (rho_l[i] + rho_r[i]);
                }
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

    /// Mass of liquid and gas, over all ranks [kg].
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

    /// Kinetic energy of liquid and gas, over all ranks [J].
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

/// A volume fraction and a velocity at the same stage of the sweeps.
struct Set<'a> {
    c: &'a mut Field<Real>,
    u: [&'a mut Field<Real>; 3],
}

impl Set<'_> {
    fn read(&self) -> State<'_> {
        let [u1, u2, u3] = self.u.each_ref();
        [self.c.data(), u1.data(), u2.data(), u3.data()]
    }

    fn write(&mut self) -> StateMut<'_> {
        let [u1, u2, u3] = self.u.each_mut();
        [self.c.data_mut(), u1.data_mut(), u2.data_mut(), u3.data_mut()]
    }

    fn fill_halos(&mut self, domain: &Domain, boundary: &Boundary, velocity: bool) {
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

impl TransportReport {
    /// Adds what entered through the two sides in `direction`, in cell volumes.
    fn add_inflow(&mut self, domain: &Domain, direction: usize, entered: [[Real; 4]; 2]) {
        let volume = domain.grid().cell_volume();
        for (side, [liquid, momentum @ ..]) in entered.into_iter().enumerate() {
            self.volume_through[direction][side] += liquid * volume;
            self.momentum_through += Vector::from_array(momentum) * volume;
        }
    }

    fn sum_over_ranks(&mut self, domain: &Domain) {
        let [[a, b], [c, d], [e, f]] = self.volume_through;
        let p = self.momentum_through;
        let [a, b, c, d, e, f, x, y, z] = domain.sum([a, b, c, d, e, f, p.x, p.y, p.z]);
        self.volume_through = [[a, b], [c, d], [e, f]];
        self.momentum_through = Vector::new(x, y, z);
    }
}
