//! Transport of liquid and momentum: three sweeps in alternating order, then the collection of
//! mixed-cell residue.

use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::{Real, Vector};

use crate::advection::{Convection, Frozen, Sweep};
use crate::boundary::Boundary;
use crate::flow::{Flow, StateFields};
use crate::grains::ResolvedGrains;
use crate::grains::room::{Room, SettleReport};
use crate::interface::{ResidueReport, Wetting};
use crate::outside::Outside;
use crate::schemes::{Carrier, ViscosityScheme};

/// Diagnostics of a transport: inflow through open sides, and mixed-cell residue.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TransportReport {
    /// Liquid that came in through each side of the box (negative: went out) [m^3].
    pub volume_through: [[Real; 2]; 3],
    /// Momentum convected in through all sides [N s].
    pub momentum_through: Vector,
    /// Mixed-cell residue: fractions out of range or nearly pure.
    pub residue: ResidueReport,
    /// Liquid that had no room beside grains.
    pub settled: SettleReport,
}

impl std::ops::AddAssign for TransportReport {
    fn add_assign(&mut self, other: Self) {
        for d in 0..3 {
            (0..2).for_each(|side| self.volume_through[d][side] += other.volume_through[d][side]);
        }
        self.momentum_through += other.momentum_through;
        self.residue = self.residue.and(other.residue);
        self.settled += other.settled;
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

/// Orders of the three sweeps, each followed by its reverse.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [2, 1, 0], [1, 2, 0], [0, 2, 1], [2, 0, 1], [1, 0, 2]];

impl Flow {
    /// Convects liquid and velocity with the face velocities for `dt` \[s].
    ///
    /// Afterwards the ghosts of volume fraction and density are filled, those of the velocity are not.
    pub fn transport(&mut self, domain: &Domain, boundary: &Boundary, dt: Real) -> TransportReport {
        self.transport_beside(domain, boundary, dt, None, None)
    }

    /// The same, with liquid that has only the room that grains, the ghosts of their imprint filled, leave it, and with what stands
    /// `outside` open sides.
    pub(crate) fn transport_beside(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        dt: Real,
        mut beside: Option<(&mut Room, &ResolvedGrains)>,
        outside: Option<&Outside>,
    ) -> TransportReport {
        if self.schemes.viscosity == ViscosityScheme::CrankNicolson {
            self.diffuse_before(domain, boundary, 0.5 * dt);
        }
        if self.schemes.carrier == Carrier::Middle {
            self.move_faces_to_middle(domain, dt);
        }
        if let Some((room, grains)) = &mut beside {
            room.hand_over(domain, grains.covered(), self, Vector::ZERO);
            room.keep_fraction(domain, self);
            room.find_carried(domain, grains, self);
            room.carry_grains(domain, grains.covered(), self, -1.0);
        }
        let mut report = TransportReport::default();
        let order = ORDERS[(self.transports % 6) as usize];
        self.transports += 1;
        let Self { volume_fraction, velocity: [u1, u2, u3], face_velocity, work, schemes, fluids, .. } = self;
        let [a0, a1, a2, a3, b0, b1, b2, b3, _] = work;
        let mut now = StateFields { c: volume_fraction, u: [u1, u2, u3] };
        let mut a = StateFields { c: a0, u: [a1, a2, a3] };
        let mut b = StateFields { c: b0, u: [b1, b2, b3] };
        now.fill_halos(domain, boundary, true);
        let rules: [GhostRules; 3] = std::array::from_fn(|d| boundary.face_velocity_rules(d));
        let [f1, f2, f3] = face_velocity;
        domain.fill_halos_to(1, &mut [(f1, &rules[0]), (f2, &rules[1]), (f3, &rules[2])]);
        let wetting = Wetting::new(domain, boundary);
        let moves_velocity = schemes.convection != Convection::Off;
        let mass_density = fluids.density_line();
        let density = if schemes.convection == Convection::VelocityForm { [1.0, 0.0] } else { mass_density };
        for (number, &direction) in order.iter().enumerate() {
            let sweep = Sweep {
                domain,
                direction,
                dt_dx: dt / domain.grid().spacing[direction],
                face_velocity: [&*f1, &*f2, &*f3][direction].data(),
                wetting,
                convection: schemes.convection,
                density,
                openings: Sweep::openings_of(domain, boundary, direction),
                outside: [0, 1].map(|side| outside.map_or(&[][..], |outside| outside.fraction(direction, side))),
            };
            let from = [&now, &a, &b][number].read();
            let entered = [0, 1].map(|side| sweep.entered(from, side, mass_density));
            report.add_inflow(domain, direction, entered);
            let moved = match number {
                0 => {
                    sweep.run(now.read(), Frozen::Read, a.write());
                    &mut a
                }
                1 => {
                    sweep.run(a.read(), Frozen::Kept(now.read()), b.write());
                    &mut b
                }
                _ => {
                    sweep.run(b.read(), Frozen::Overwritten, now.write());
                    &mut now
                }
            };
            moved.fill_halos(domain, boundary, moves_velocity);
        }
        if boundary.has_openings() {
            report.sum_over_ranks(domain);
        }
        if let Some((room, grains)) = &mut beside {
            report.settled = room.carried(domain, boundary, grains.covered(), self, dt);
            room.carry_grains(domain, grains.covered(), self, 1.0);
            let [u1, u2, u3] = &mut self.velocity;
            StateFields { c: &mut self.volume_fraction, u: [u1, u2, u3] }.fill_halos(domain, boundary, moves_velocity);
        }
        self.collect_residue(domain, boundary, beside.as_ref().map(|(room, _)| room.open()), &mut report);
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
    fn collect_residue(
        &mut self,
        domain: &Domain,
        boundary: &Boundary,
        open: Option<&[Real]>,
        report: &mut TransportReport,
    ) {
        let density = match self.schemes.convection {
            Convection::Consistent => self.fluids.density_line(),
            Convection::VelocityForm | Convection::Off => [1.0, 0.0],
        };
        let Self { volume_fraction, velocity, collector, .. } = self;
        let view = crate::interface::View {
            c: volume_fraction.data(),
            u: velocity.each_ref().map(|field| field.data()),
            density,
            open,
        };
        report.residue = collector.find(domain, view);
        if report.residue.moved_cells + report.residue.clipped_cells > 0 {
            collector.apply(volume_fraction.data_mut(), velocity.each_mut().map(|field| field.data_mut()));
            let [u1, u2, u3] = velocity;
            StateFields { c: volume_fraction, u: [u1, u2, u3] }.fill_halos(domain, boundary, false);
        }
    }
}
