//! The grains in the fluid: volume fractions, fluid loads, and the exchange of momentum.

mod covered;
mod exchange;
mod imprint;
mod joint;
mod loads;
mod open;
mod resolved;
pub mod room;
mod surface;
mod wetting;

use std::sync::Arc;

use sazanami_dem::{ATTACHED, ContactReport, DemError, Engine, Loads, Motion, Substeps};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{Shape, VolumeFractionMethod};
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_parallel::{Reduction, for_each_chunk, reduce_over};

use crate::flow::{Flow, Fluids};
use crate::grains::joint::Joint;
use crate::grains::room::Room;
use crate::momentum::Impulses;
use crate::stability::travel;

pub use exchange::{Exchange, RESOLVED};
pub use imprint::{Imprint, ImprintReport, Pose, Share};
pub use loads::FluidLoad;
pub(crate) use surface::{Surface, resistance};

/// Grains in one parallel task.
const BATCH: usize = 256;
/// Makes a bound safe from round-off.
const ROUND_UP: Real = 1.0 + 1e-12;

/// Coupling of fluid and grains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// Scheme of the momentum exchange.
    pub exchange: Exchange,
    /// Columns to the edge of a cell in which volume fractions are evaluated, 1 to 64.
    pub columns: usize,
    /// Number of contact sub-steps in a step.
    pub substeps: Substeps,
}

impl Default for Coupling {
    fn default() -> Self {
        Self { exchange: Exchange::default(), columns: 4, substeps: Substeps::default() }
    }
}

impl Coupling {
    /// Evaluation of the volume fractions.
    #[must_use]
    pub fn volume_fractions(&self) -> VolumeFractionMethod {
        VolumeFractionMethod::Columns { per_axis: self.columns.clamp(1, 64) as u8 }
    }
}

/// State of the coupling with each grain between steps, also when it migrates to another rank: the grain's state before the contacts
/// moved it, and the pose of its volume fractions.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct CouplingState {
    /// Largest part of the fluid about the grain that has been liquid so far, where bridges ask for it.
    wetted: Real,
    unused: [Real; 5],
    /// Mass of displaced fluid at the last exchange \[kg].
    displaced_mass: Real,
    velocity_before: [Real; 3],
    unused_too: [Real; 3],
    /// The pose at which the grain was last imprinted, without wrapping at periodic sides; orientation zero: never.
    imprinted_at: [Real; 3],
    imprinted_turned: [Real; 4],
    not_used: [Real; ATTACHED - 20],
}

impl CouplingState {
    fn imprinted(&self) -> Pose {
        let orientation = Quaternion::from_array(self.imprinted_turned);
        Pose { position: Vector::from_array(self.imprinted_at), orientation }
    }
}

const _: () = assert!(size_of::<CouplingState>() == size_of::<[Real; ATTACHED]>());

/// The grains of a rank and their coupling to the fluid.
pub struct ResolvedGrains {
    engine: Engine,
    shapes: Arc<[Shape]>,
    /// Least extent of each shape \[m].
    widths: Vec<Real>,
    /// Middle one of the extents of each shape \[m].
    middles: Vec<Real>,
    coupling: Coupling,
    imprint: Imprint,
    surface: Surface,
    joint: Joint,
    /// Time integral of the stress divergence over the passes of a step [N s/m^3].
    stress_impulse: [Field<Real>; 3],
    loads: Vec<FluidLoad>,
    /// Mass of the fluid that the grains displace \[kg].
    displaced: Vec<[Real; 1]>,
    partial: Vec<[Real; 7]>,
    /// Storage of loops over grains block by block of cells.
    by_block: Vec<[Real; imprint::MOST]>,
    /// Velocity and angular velocity of every grain and ghost on the grid.
    motion: Vec<[Real; 6]>,
    force: Vec<Vector>,
    torque: Vec<Vector>,
    /// What the owned grains receive after they have moved [N s, N m s].
    impulses: Vec<[Vector; 2]>,
    /// Poses at which the grains of the engine, ghosts included, are imprinted.
    poses: Vec<Pose>,
    /// Grains on all ranks, with those that have left and without those that were fed in.
    at_first: usize,
}

impl ResolvedGrains {
    /// Couples the grains of `engine`, of the given shapes, to the `fluids` of `domain` and imprints them: where they
    /// were last imprinted, if they come from a snapshot.
    #[must_use]
    pub fn new(domain: &Domain, fluids: &Fluids, engine: Engine, shapes: Arc<[Shape]>, coupling: Coupling) -> Self {
        // With those that have left: the run goes on as one with grains.
        let there = domain.sum([engine.grains().owned() as Real])[0] as usize + engine.departures().grains as usize;
        let at_first = there - engine.arrivals().grains as usize;
        let surfaces = coupling.exchange == Exchange::Surface;
        let densest = fluids.liquid_density.max(fluids.gas_density);
        // Without grains the fields of the coupling take no memory.
        let cells = if at_first == 0 && !engine.expects_arrivals() { [0; 3] } else { domain.cells() };
        let extents = shapes.iter().map(|shape| shape.extent().1 - shape.extent().0);
        let mut phase = Self {
            engine,
            widths: extents.clone().map(|extent| extent.min_element()).collect(),
            middles: extents.map(|extent| extent.element_sum() - extent.min_element() - extent.max_element()).collect(),
            shapes,
            coupling,
            imprint: Imprint::new(cells, coupling.volume_fractions()).with_areas(surfaces, densest),
            surface: Surface::new(if surfaces { cells } else { [0; 3] }),
            joint: Joint::default(),
            stress_impulse: {
                let cells = if surfaces { [0; 3] } else { cells };
                std::array::from_fn(|_| Field::new(cells, 0.0))
            },
            loads: Vec::new(),
            displaced: Vec::new(),
            partial: Vec::new(),
            motion: Vec::new(),
            force: Vec::new(),
            torque: Vec::new(),
            impulses: Vec::new(),
            by_block: Vec::new(),
            poses: Vec::new(),
            at_first,
        };
        phase.imprint(domain);
        phase
    }

    /// The engine that moves the grains and finds their contacts.
    #[must_use]
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    pub(crate) fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// Volume fractions of the grains.
    #[must_use]
    pub fn covered(&self) -> &Imprint {
        &self.imprint
    }

    /// Solid fraction of the cells, one ghost layer filled; `None` without grains. Collective.
    pub(crate) fn filled_fraction(&mut self, domain: &Domain) -> Option<&[Real]> {
        if self.is_empty() {
            return None;
        }
        self.imprint.fill_halos(domain);
        Some(self.imprint.solid_fraction.data())
    }

    /// Sums solid fraction and surface over the volume of the cells [1/m] of the grains of `cells` cells and wider into the first two of
    /// three fields of zeros, if they act by their surfaces.
    pub(crate) fn sum_wide(&self, domain: &Domain, cells: Real, into: [&mut Field<Real>; 3]) {
        if !self.has_surfaces() {
            return;
        }
        self.imprint.sum_shares(domain, into, |n, share| {
            if self.has_cells(n, domain, cells) {
                Vector::new(share.fraction, share.wetted.into(), 0.0)
            } else {
                Vector::ZERO
            }
        });
    }

    /// Sums the solid fraction of the grains narrower than `cells` cells into the first of three fields of zeros, if they act by their surfaces.
    pub(crate) fn sum_narrow(&self, domain: &Domain, cells: Real, into: [&mut Field<Real>; 3]) {
        if !self.has_surfaces() {
            return;
        }
        self.imprint.sum_shares(domain, into, |n, share| {
            if self.has_cells(n, domain, cells) { Vector::ZERO } else { Vector::X * share.fraction }
        });
    }

    /// Whether a grain or ghost has so many cells across its least extent.
    fn has_cells(&self, n: usize, domain: &Domain, cells: Real) -> bool {
        let grains = self.engine.grains();
        let width = self.widths[grains.shape[n] as usize] * grains.scale[n];
        domain.grid().cells_across(width * ROUND_UP) >= cells
    }

    /// Force of the fluid on each owned grain in the last step \[N].
    #[must_use]
    pub fn fluid_forces(&self) -> &[Vector] {
        &self.force
    }

    /// Torque of the fluid on each owned grain in the last step [N m].
    #[must_use]
    pub fn fluid_torques(&self) -> &[Vector] {
        &self.torque
    }

    /// Number of grains on all ranks.
    #[must_use]
    pub fn count(&self) -> usize {
        self.at_first + self.engine.arrivals().grains as usize - self.engine.departures().grains as usize
    }

    /// Shapes of the grains, by shape index.
    #[must_use]
    pub fn shapes(&self) -> &Arc<[Shape]> {
        &self.shapes
    }

    /// Whether there are no grains at all, were none, and will be none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.at_first == 0 && !self.engine.expects_arrivals()
    }

    /// Reciprocal of the longest step in which no grain on any rank goes farther than its [`travel`] and than the fluid at this Courant
    /// number, what its turn moves the surface along its normal added; and largest angular velocity [1/s].
    #[must_use]
    pub fn motion_rates(&self, domain: &Domain, courant: Real) -> [Real; 2] {
        let grains = self.engine.grains();
        let cell = domain.grid().spacing.min_element();
        let of_batch = |batch: usize| {
            let mut fastest = [0.0_f64; 2];
            for n in batch * BATCH..((batch + 1) * BATCH).min(grains.owned()) {
                let shape = &self.shapes[grains.shape[n] as usize];
                let (scale, v, w) = (grains.scale[n], grains.velocity[n], grains.angular_velocity(n));
                let travel = cell * travel(self.middles[grains.shape[n] as usize] * scale / cell).min(courant);
                fastest[1] = fastest[1].max(w.length());
                // Most grains are slower than the fastest whichever way they turn. With some reserve for round-off: the
                // largest must not depend on the order.
                if (v.length() + scale * shape.bounding_radius() * w.length()) * ROUND_UP > fastest[0] * travel {
                    let turning = shape.turning_speed(grains.orientation[n].inverse() * w);
                    fastest[0] = fastest[0].max((v.length() + scale * turning) / travel);
                }
            }
            fastest
        };
        let larger = |a: [Real; 2], b: [Real; 2]| [a[0].max(b[0]), a[1].max(b[1])];
        let mut fastest = reduce_over(grains.owned().div_ceil(BATCH), of_batch, larger).unwrap_or_default();
        domain.communicator().all_reduce(&mut fastest, Reduction::Max);
        fastest
    }

    /// Reciprocal of the longest step that a given number of sub-steps resolves the contacts in [1/s]; zero where
    /// their number follows the step.
    #[must_use]
    pub fn contact_rate(&self, domain: &Domain) -> Real {
        match self.coupling.substeps {
            Substeps::Fixed(count) => 1.0 / (count.max(1) as Real * self.engine.present_time_step(domain)),
            Substeps::Auto => 0.0,
        }
    }

    /// Whether the grains act on the fluid by their surfaces.
    pub(crate) fn has_surfaces(&self) -> bool {
        !self.is_empty() && self.coupling.exchange == Exchange::Surface
    }

    /// Finds velocity and angular velocity of every grain and ghost, changed by `change(n)`.
    fn find_motion(&mut self, domain: &Domain, change: impl Fn(&Self, usize) -> [Vector; 2] + Sync) {
        let mut motion = std::mem::take(&mut self.motion);
        let grains = self.engine.grains();
        motion.resize(grains.len(), [0.0; 6]);
        for_each_chunk(&mut motion[..grains.owned()], BATCH, |number, motion| {
            for (n, motion) in (number * BATCH..).zip(motion) {
                let [faster, spinning] = change(self, n);
                let [v, w] = [grains.velocity[n] + faster, grains.angular_velocity(n) + spinning].map(|v| v.to_array());
                *motion = [v[0], v[1], v[2], w[0], w[1], w[2]];
            }
        });
        self.engine.share_with_ghosts(domain, &mut motion);
        self.motion = motion;
    }

    /// Sums the velocities of the grains on the grid, changed by `change(n)` of velocity and angular velocity.
    fn sum_velocities(&mut self, domain: &Domain, change: impl Fn(&Self, usize) -> [Vector; 2] + Sync) {
        self.find_motion(domain, change);
        self.imprint.sum_velocities(domain, self.engine.grains(), &self.motion);
    }

    /// Clears the stress impulse of the last step.
    pub(crate) fn clear_stress(&mut self, domain: &Domain) {
        if !self.is_empty() {
            let [s1, s2, s3] = &mut self.stress_impulse;
            let all = domain.interior();
            domain.for_each_row(&all, (s1.data_mut(), s2.data_mut(), s3.data_mut()), |_, (s1, s2, s3)| {
                s1.fill(0.0);
                s2.fill(0.0);
                s3.fill(0.0);
            });
        }
    }

    /// Adds the stress divergence [N/m^3] of a fluid pass of length `dt` \[s], given per cell by its
    /// place in memory, in the cells that grains cover.
    pub(crate) fn add_stress(&mut self, domain: &Domain, dt: Real, stress_divergence: impl Fn(usize) -> Vector + Sync) {
        if self.is_empty() || self.has_surfaces() {
            return;
        }
        let Self { stress_impulse: [s1, s2, s3], imprint, .. } = self;
        let alpha = imprint.solid_fraction.data();
        let slices = (s1.data_mut(), s2.data_mut(), s3.data_mut());
        domain.for_each_row(&domain.interior(), slices, |row, (s1, s2, s3)| {
            if !imprint.row_is_covered(row.j, row.k) {
                return;
            }
            for i in (0..row.len).filter(|i| alpha[row.start + i] > 0.0) {
                let impulse = dt * stress_divergence(row.start + i);
                s1[i] += impulse.x;
                s2[i] += impulse.y;
                s3[i] += impulse.z;
            }
        });
    }

    /// Turns what the fluid gave the grains in the passes into a constant force and torque on each owned grain over `dt` \[s].
    pub(crate) fn load(&mut self, domain: &Domain, room: Option<&mut Room>, gravity: Vector, dt: Real) -> Impulses {
        if let Some(room) = room {
            return self.load_open(domain, room, gravity, dt);
        }
        let count = self.engine.grains().len();
        self.loads.resize(count, FluidLoad::default());
        loads::integrate(domain, &self.imprint, &self.stress_impulse, &mut self.loads);
        self.gather_loads(domain);
        self.force.clear();
        self.torque.clear();
        for n in 0..self.engine.grains().owned() {
            let [impulse, turn] = vectors(&self.partial[n]);
            self.force.push(impulse / dt);
            self.torque.push(turn / dt);
            let velocity_before = self.engine.grains().velocity[n].to_array();
            let state = CouplingState { velocity_before, ..self.coupling_state(n) };
            self.set_coupling_state(n, state);
        }
        Impulses::default()
    }

    /// Sums the loads of the cells of all ranks at the owners of the grains.
    fn gather_loads(&mut self, domain: &Domain) {
        self.partial.clear();
        self.partial.extend(self.loads.iter().map(FluidLoad::in_numbers));
        self.engine.gather_to_owners(domain, &mut self.partial);
    }

    /// Moves the grains under the fluid's load, their contacts and `gravity` [m/s^2] over `dt` \[s], with films of the fluid about them.
    ///
    /// # Errors
    /// [`DemError`] names the grain that failed.
    pub(crate) fn advance(
        &mut self,
        domain: &Domain,
        flow: &Flow,
        gravity: Vector,
        dt: Real,
    ) -> Result<ContactReport, DemError> {
        if self.is_empty() {
            return Ok(ContactReport::default());
        }
        self.wet(domain, flow);
        let loads = Loads { force: &self.force, torque: &self.torque, ..Loads::none() };
        self.engine.advance(domain, &loads, gravity, dt, self.coupling.substeps)
    }

    /// Updates the volume fractions of the grains.
    pub(crate) fn imprint(&mut self, domain: &Domain) -> ImprintReport {
        if self.is_empty() {
            return ImprintReport::default();
        }
        self.choose_poses(domain);
        self.imprint.update(domain, self.engine.grains(), &self.shapes, Some(&self.poses))
    }

    /// Poses of the volume fractions: kept until a point of the grain has moved by more than [`imprint::STALE`]
    /// cells. The pose is stored with the grain and is the same for its ghosts, so that it depends neither on the
    /// decomposition nor on a restart.
    fn choose_poses(&mut self, domain: &Domain) {
        let stale = imprint::STALE * domain.grid().spacing.min_element();
        self.poses.clear();
        for n in 0..self.engine.grains().len() {
            let grains = self.engine.grains();
            let radius = self.shapes[grains.shape[n] as usize].bounding_radius() * grains.scale[n];
            let now = Pose { position: grains.unwrapped_position(n), orientation: grains.orientation[n] };
            let image = grains.image(n);
            let mut state = self.coupling_state(n);
            let mut pose = state.imprinted();
            // An orientation of zeros marks a grain never imprinted.
            if pose.distance(&now, radius) > stale || state.imprinted_turned == [0.0; 4] {
                pose = now;
                state.imprinted_at = now.position.to_array();
                state.imprinted_turned = now.orientation.to_array();
                self.set_coupling_state(n, state);
            }
            self.poses.push(Pose { position: self.engine.image_position(pose.position, image), ..pose });
        }
    }

    /// Gives the grains in their new places what the cells owe them; with back-projection makes the velocity of covered cells mass-averaged.
    pub(crate) fn exchange(
        &mut self,
        domain: &Domain,
        flow: &mut Flow,
        room: Option<&mut Room>,
        gravity: Vector,
        dt: Real,
    ) -> Impulses {
        if self.is_empty() {
            return Impulses::default();
        }
        if let Some(room) = room {
            return self.exchange_open(domain, room, dt);
        }
        self.sum_velocities(domain, |_, _| [Vector::ZERO; 2]);
        let Flow { velocity: u, density, .. } = flow;
        self.displace(domain, density);
        exchange::back_project(domain, &self.imprint, u, density);

        let mut sum = [Vector::ZERO; 3];
        let [weight, displaced_mass_flux, held] = &mut sum;
        for n in 0..self.engine.grains().owned() {
            let grains = self.engine.grains();
            let [displaced] = self.displaced[n];
            let mut state = self.coupling_state(n);
            let before = Vector::from_array(state.velocity_before);
            let gained = grains.velocity[n] - before;
            *weight -= displaced * gravity * dt;
            if grains.motion[n] == Motion::Free {
                *weight += grains.mass[n] * gravity * dt;
                *displaced_mass_flux -= before * (displaced - state.displaced_mass);
            } else {
                *held += displaced * gained - dt * self.force[n];
            }
            state.displaced_mass = displaced;
            self.set_coupling_state(n, state);
        }
        let [gravity_on_grains, displaced_mass_flux, held_grains] = sum_over_ranks(domain, sum);
        Impulses { gravity_on_grains, displaced_mass_flux, held_grains, ..Impulses::default() }
    }

    /// Whether a grain on any rank is beyond an open side.
    pub(crate) fn have_left(&self, domain: &Domain) -> bool {
        !self.is_empty() && self.engine.any_departed(domain)
    }

    /// Takes away the grains that are beyond an open side; the others keep what the last step knows of them.
    pub(crate) fn take_departed(&mut self, domain: &Domain) -> Result<(), DemError> {
        let before: Vec<u64> = self.engine.grains().id[..self.engine.grains().owned()].to_vec();
        self.engine.take_departed(domain)?;
        let Self { engine, force, torque, .. } = &mut *self;
        let stays = &engine.grains().id[..engine.grains().owned()];
        for values in [force, torque] {
            let mut ids = before.iter();
            values.retain(|_| ids.next().is_some_and(|id| stays.binary_search(id).is_ok()));
        }
        self.imprint(domain);
        Ok(())
    }

    /// Starts the exchange.
    pub(crate) fn begin_exchange(&mut self, domain: &Domain, flow: &Flow, gravity: Vector) {
        if self.is_empty() {
            return;
        }
        if self.has_surfaces() {
            return self.begin_surfaces(domain, flow, gravity);
        }
        self.displace(domain, &flow.density);
        for n in 0..self.engine.grains().owned() {
            let [displaced_mass] = self.displaced[n];
            self.set_coupling_state(n, CouplingState { displaced_mass, ..self.coupling_state(n) });
        }
    }

    /// Momentum of the free grains, and of the fluid they displace at their velocity (with surfaces none), over all ranks [N s].
    #[must_use]
    pub fn momentum(&self, domain: &Domain) -> [Vector; 2] {
        let grains = self.engine.grains();
        let mut sum = [Vector::ZERO; 2];
        for n in (0..grains.owned()).filter(|&n| grains.motion[n] == Motion::Free) {
            sum[0] += grains.mass[n] * grains.velocity[n];
            if !self.has_surfaces() {
                sum[1] += self.coupling_state(n).displaced_mass * grains.velocity[n];
            }
        }
        let [a, b, _] = sum_over_ranks(domain, [sum[0], sum[1], Vector::ZERO]);
        [a, b]
    }

    /// Volume of liquid inside grains, over all ranks [m^3].
    #[must_use]
    pub fn liquid_volume_inside(&self, domain: &Domain, volume_fraction: &Field<Real>) -> Real {
        if self.is_empty() {
            return 0.0;
        }
        let (alpha, c) = (self.imprint.solid_fraction.data(), volume_fraction.data());
        let inside = domain.sum_rows(&domain.interior(), |row| {
            if !self.imprint.row_is_covered(row.j, row.k) {
                return [0.0];
            }
            [row.shifted(0).map(|at| alpha[at].min(1.0) * c[at]).sum()]
        });
        domain.sum(inside)[0] * domain.grid().cell_volume()
    }

    fn coupling_state(&self, n: usize) -> CouplingState {
        bytemuck::cast(self.engine.grains().attached[n])
    }

    fn set_coupling_state(&mut self, n: usize, state: CouplingState) {
        self.engine.attached_mut()[n] = bytemuck::cast(state);
    }

    /// Sums the mass of the fluid that the grains displace, at their owners.
    fn displace(&mut self, domain: &Domain, density: &Field<Real>) {
        self.displaced.resize(self.engine.grains().len(), [0.0]);
        exchange::displace(domain, &self.imprint, density, &mut self.displaced);
        self.engine.gather_to_owners(domain, &mut self.displaced);
    }
}

/// The first two vectors of a grain's gathered sums.
fn vectors(sums: &[Real; 7]) -> [Vector; 2] {
    [Vector::new(sums[0], sums[1], sums[2]), Vector::new(sums[3], sums[4], sums[5])]
}

fn sum_over_ranks(domain: &Domain, [a, b, c]: [Vector; 3]) -> [Vector; 3] {
    let sum = domain.sum([a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z]);
    [Vector::from_slice(&sum[..3]), Vector::from_slice(&sum[3..6]), Vector::from_slice(&sum[6..])]
}
