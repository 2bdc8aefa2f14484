//! Budgets of momentum and liquid volume.
//!
//! The fluid fills every cell, also inside grains; the part that grains displace moves with them and is
//! subtracted. With the deferred impulse `J` that the exchange gives the grains in the next step, the momentum
//!
//! `P = sum rho_f u dV + sum (M_k - m_fk) v_k + sum J_k`
//!
//! changes only by the impulses of walls, gravity and open sides, and by the displaced-mass flux
//! `- sum v_k dm_fk`. The solver supplies both sides; their difference is the residual. A solver
//! whose `J` uses the displaced mass `m_fk` after the step takes `- v_k dm_fk` with the velocity before
//! it, and the other way round: then the residual is round-off.
//!
//! Moving particles have a separate budget ([`FluidMomentumBudget`]): that fluid lies between the grains, and
//! acts on them by drag and pressure.

use sazanami_numerics::snapshot::{Snapshot, SnapshotError};
use sazanami_numerics::{Real, Vector};

/// Section of a snapshot with the initial momentum of a fluid and the sums of its impulses.
const FLUID_SUMS: &str = "observe/momentum";
/// Round-off of these sums.
const FLUID_RESTS: &str = "observe/momentum_rest";

/// Momentum stored at one time, summed over all ranks [kg m/s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StoredMomentum {
    /// `sum rho_l C u dV`, liquid inside grains included.
    pub liquid: Vector,
    /// `sum rho_g (1 - C) u dV`, gas inside grains included.
    pub gas: Vector,
    /// `sum M_k v_k`.
    pub grains: Vector,
    /// `sum m_fk v_k`: fluid displaced by grains; counts negative in the total.
    pub displaced: Vector,
    /// `sum J_k`: deferred impulse, given to the grains in the next step.
    pub deferred: Vector,
}

impl StoredMomentum {
    /// Total momentum `P` [kg m/s].
    #[must_use]
    pub fn total(&self) -> Vector {
        self.liquid + self.gas + self.grains - self.displaced + self.deferred
    }

    fn terms(&self) -> [Vector; 5] {
        [self.liquid, self.gas, self.grains, self.displaced, self.deferred]
    }
}

/// Impulses from outside during one step, or since the start [kg m/s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Impulses {
    /// Pressure and viscous stress of the walls on the fluid.
    pub walls_on_fluid: Vector,
    /// Contact forces of the walls on the grains.
    pub walls_on_grains: Vector,
    /// Weight of the fluid.
    pub gravity_on_fluid: Vector,
    /// Weight of the grains less that of the fluid they displace, `sum (M_k - m_fk) g dt`.
    pub gravity_on_grains: Vector,
    /// Displaced-mass flux, `- sum v_k dm_fk`.
    pub displaced_mass_flux: Vector,
    /// Momentum convected in through open sides.
    pub open_sides: Vector,
    /// Constraints that hold or drive grains with fixed or prescribed motion.
    pub held_grains: Vector,
}

impl Impulses {
    /// Names of the terms, in the order of [`Self::terms`].
    pub const NAMES: [&str; 7] = [
        "walls_on_fluid",
        "walls_on_grains",
        "gravity_on_fluid",
        "gravity_on_grains",
        "swallowed",
        "open_sides",
        "held_grains",
    ];

    /// The terms in the order of [`Self::NAMES`].
    #[must_use]
    pub fn terms(&self) -> [Vector; 7] {
        [
            self.walls_on_fluid,
            self.walls_on_grains,
            self.gravity_on_fluid,
            self.gravity_on_grains,
            self.displaced_mass_flux,
            self.open_sides,
            self.held_grains,
        ]
    }

    /// Sum of all impulses.
    #[must_use]
    pub fn total(&self) -> Vector {
        self.terms().into_iter().sum()
    }
}

impl From<[Vector; 7]> for Impulses {
    fn from(terms: [Vector; 7]) -> Self {
        let [
            walls_on_fluid,
            walls_on_grains,
            gravity_on_fluid,
            gravity_on_grains,
            displaced_mass_flux,
            open_sides,
            held_grains,
        ] = terms;
        Self {
            walls_on_fluid,
            walls_on_grains,
            gravity_on_fluid,
            gravity_on_grains,
            displaced_mass_flux,
            open_sides,
            held_grains,
        }
    }
}

/// Compensated sum (Neumaier): millions of small impulses add up to the last digit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Total {
    sum: Vector,
    rest: Vector,
}

impl Total {
    fn add(&mut self, value: Vector) {
        let sum = self.sum + value;
        for d in 0..3 {
            let (old, new) = (self.sum[d], value[d]);
            self.rest[d] += if old.abs() >= new.abs() { (old - sum[d]) + new } else { (new - sum[d]) + old };
        }
        self.sum = sum;
    }

    fn value(&self) -> Vector {
        self.sum + self.rest
    }
}

/// Momentum budget of a whole run.
#[derive(Clone, Debug, PartialEq)]
pub struct MomentumBudget {
    initial: StoredMomentum,
    now: StoredMomentum,
    impulses: [Total; 7],
    largest_term: Real,
}

impl MomentumBudget {
    /// Starts with the momentum at the beginning of the run.
    #[must_use]
    pub fn new(initial: StoredMomentum) -> Self {
        let mut budget = Self { initial, now: initial, impulses: Default::default(), largest_term: 0.0 };
        budget.update_largest_term();
        budget
    }

    /// Adds the impulses of a step; call [`Self::set_stored`] once the momentum after it is known.
    pub fn add(&mut self, step: &Impulses) {
        for (total, impulse) in self.impulses.iter_mut().zip(step.terms()) {
            total.add(impulse);
        }
    }

    /// Sets the momentum stored now. Not every step needs it.
    pub fn set_stored(&mut self, now: StoredMomentum) {
        self.now = now;
        self.update_largest_term();
    }

    fn update_largest_term(&mut self) {
        let stored = self.now.terms().into_iter().chain([self.initial.total()]);
        let largest = stored.chain(self.impulses.map(|t| t.value())).map(Vector::length).fold(0.0, Real::max);
        self.largest_term = self.largest_term.max(largest);
    }

    /// Momentum at the start.
    #[must_use]
    pub fn initial(&self) -> &StoredMomentum {
        &self.initial
    }

    /// Momentum stored now.
    #[must_use]
    pub fn stored(&self) -> &StoredMomentum {
        &self.now
    }

    /// Impulses since the start.
    #[must_use]
    pub fn impulses(&self) -> Impulses {
        self.impulses.map(|total| total.value()).into()
    }

    /// Residual momentum `P - P(0) - impulses` [kg m/s].
    #[must_use]
    pub fn residual(&self) -> Vector {
        self.now.total() - self.initial.total() - self.impulses().total()
    }

    /// Largest term of the budget at any time so far [kg m/s]: the scale of the residual.
    #[must_use]
    pub fn largest_term(&self) -> Real {
        self.largest_term
    }

    /// Residual relative to the largest term; 0 if that is 0.
    #[must_use]
    pub fn relative_residual(&self) -> Real {
        if self.largest_term > 0.0 { self.residual().length() / self.largest_term } else { 0.0 }
    }

    /// Residual relative to the momentum at the start: the share of a drop's momentum that is lost.
    #[must_use]
    pub fn residual_of_initial(&self) -> Option<Real> {
        let initial = self.initial.total().length();
        (initial > 0.0).then(|| self.residual().length() / initial)
    }

    /// Writes the state into a snapshot.
    pub fn save(&self, snapshot: &mut Snapshot) {
        let stored = self.initial.terms().into_iter().chain(self.now.terms());
        let totals = self.impulses.iter().flat_map(|total| [total.sum, total.rest]);
        snapshot.put_vectors("momentum_budget.vectors", &stored.chain(totals).collect::<Vec<_>>());
        snapshot.put_reals("momentum_budget.largest_term", vec![self.largest_term]);
    }

    /// Reads the state from a snapshot.
    ///
    /// # Errors
    /// [`SnapshotError`] if it is not there or of another length.
    pub fn restore(snapshot: &Snapshot) -> Result<Self, SnapshotError> {
        let v = vectors_of(snapshot, "momentum_budget.vectors", 5 + 5 + 14)?;
        let stored = |at: usize| StoredMomentum {
            liquid: v[at],
            gas: v[at + 1],
            grains: v[at + 2],
            displaced: v[at + 3],
            deferred: v[at + 4],
        };
        Ok(Self {
            initial: stored(0),
            now: stored(5),
            impulses: std::array::from_fn(|n| Total { sum: v[10 + 2 * n], rest: v[11 + 2 * n] }),
            largest_term: snapshot.reals_of("momentum_budget.largest_term", 1)?[0],
        })
    }
}

/// Impulses in a tank of moving particles during one step, or since the start [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ParticleImpulses {
    /// Gravity and the inertial force of the tank's motion on the fluid.
    pub body_force_on_fluid: Vector,
    /// Pressure of the walls on the fluid.
    pub wall_pressure_on_fluid: Vector,
    /// Viscous stress of the walls on the fluid.
    pub wall_friction_on_fluid: Vector,
    /// Stabilisation and collisions of fluid particles with walls, and particles returned to the box.
    pub wall_contact_on_fluid: Vector,
    /// Drag of the grains on the fluid.
    pub drag_on_fluid: Vector,
    /// Drag of the fluid on the grains.
    pub drag_on_grains: Vector,
    /// Force of the fluid's pressure on the grains.
    pub pressure_on_grains: Vector,
    /// Contact forces of the grains on the walls.
    pub grains_on_walls: Vector,
}

impl ParticleImpulses {
    /// Names of the terms, in the order of [`Self::terms`].
    pub const NAMES: [&str; 8] = [
        "body_force_on_fluid",
        "wall_pressure_on_fluid",
        "wall_friction_on_fluid",
        "wall_contact_on_fluid",
        "drag_on_fluid",
        "drag_on_grains",
        "pressure_on_grains",
        "grains_on_walls",
    ];

    /// The terms in the order of [`Self::NAMES`].
    #[must_use]
    pub fn terms(&self) -> [Vector; 8] {
        [
            self.body_force_on_fluid,
            self.wall_pressure_on_fluid,
            self.wall_friction_on_fluid,
            self.wall_contact_on_fluid,
            self.drag_on_fluid,
            self.drag_on_grains,
            self.pressure_on_grains,
            self.grains_on_walls,
        ]
    }

    /// Impulse of body force, walls and grains on the fluid.
    #[must_use]
    pub fn on_fluid(&self) -> Vector {
        let walls = self.body_force_on_fluid
            + self.wall_pressure_on_fluid
            + self.wall_friction_on_fluid
            + self.wall_contact_on_fluid;
        walls + self.drag_on_fluid - self.pressure_on_grains
    }

    /// Sum of drag on grains and on fluid: zero where action equals reaction.
    #[must_use]
    pub fn drag_residual(&self) -> Vector {
        self.drag_on_fluid + self.drag_on_grains
    }

    /// The same relative to the larger of the two; 0 if there was no drag.
    #[must_use]
    pub fn relative_drag_residual(&self) -> Real {
        relative(self.drag_residual().length(), self.drag_on_grains.length().max(self.drag_on_fluid.length()))
    }
}

impl From<[Vector; 8]> for ParticleImpulses {
    fn from(terms: [Vector; 8]) -> Self {
        let [body_force_on_fluid, wall_pressure_on_fluid, wall_friction_on_fluid, wall_contact_on_fluid, ..] = terms;
        let [.., drag_on_fluid, drag_on_grains, pressure_on_grains, grains_on_walls] = terms;
        Self {
            body_force_on_fluid,
            wall_pressure_on_fluid,
            wall_friction_on_fluid,
            wall_contact_on_fluid,
            drag_on_fluid,
            drag_on_grains,
            pressure_on_grains,
            grains_on_walls,
        }
    }
}

/// Momentum budget of a fluid of moving particles over a whole run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FluidMomentumBudget {
    initial: Vector,
    impulses: [Total; 8],
    /// Absolute impulses of the body force in each direction: the scale of the residual.
    forced: Total,
    residual: Vector,
}

impl FluidMomentumBudget {
    /// Starts with the momentum of the fluid at the beginning of the run [N s].
    #[must_use]
    pub fn new(initial: Vector) -> Self {
        Self { initial, ..Self::default() }
    }

    /// Adds the impulses of a step.
    pub fn add(&mut self, step: &ParticleImpulses) {
        self.forced.add(step.body_force_on_fluid.abs());
        self.impulses.iter_mut().zip(step.terms()).for_each(|(total, impulse)| total.add(impulse));
    }

    /// Balances the impulses so far with the momentum of the fluid now [N s]. Not every step needs it.
    pub fn balance(&mut self, now: Vector) {
        self.residual = now - self.initial - self.impulses().on_fluid();
    }

    /// Impulses since the start.
    #[must_use]
    pub fn impulses(&self) -> ParticleImpulses {
        self.impulses.map(|total| total.value()).into()
    }

    /// Momentum gained beyond the impulses, when last balanced [N s].
    #[must_use]
    pub fn residual(&self) -> Vector {
        self.residual
    }

    /// The residual in each direction, relative to the impulses of the body force; `None` where there is no such force.
    #[must_use]
    pub fn relative_residual(&self) -> [Option<Real>; 3] {
        let (residual, forced) = (self.residual, self.forced.value());
        [0, 1, 2].map(|d| (forced[d] > 0.0).then(|| residual[d].abs() / forced[d]))
    }

    fn totals(&self) -> impl Iterator<Item = &Total> {
        std::iter::once(&self.forced).chain(&self.impulses)
    }

    /// Writes the state into a snapshot; the residual is not part of it.
    pub fn save(&self, snapshot: &mut Snapshot) {
        let sums = std::iter::once(self.initial).chain(self.totals().map(|total| total.sum));
        snapshot.put_vectors(FLUID_SUMS, &sums.collect::<Vec<_>>());
        snapshot.put_vectors(FLUID_RESTS, &self.totals().map(|total| total.rest).collect::<Vec<_>>());
    }

    /// Reads the state from a snapshot, whose sums may be plain ones as in earlier versions.
    ///
    /// # Errors
    /// [`SnapshotError`] if it is not there or of another length.
    pub fn restore(snapshot: &Snapshot) -> Result<Self, SnapshotError> {
        let sums = vectors_of(snapshot, FLUID_SUMS, 2 + 8)?;
        let is_plain = snapshot.reals(FLUID_RESTS).is_err();
        let rests = if is_plain { vec![Vector::ZERO; 1 + 8] } else { vectors_of(snapshot, FLUID_RESTS, 1 + 8)? };
        let total = |n: usize| Total { sum: sums[1 + n], rest: rests[n] };
        Ok(Self {
            initial: sums[0],
            forced: total(0),
            impulses: std::array::from_fn(|n| total(1 + n)),
            residual: Vector::ZERO,
        })
    }
}

/// A known number of vectors from a snapshot.
fn vectors_of(snapshot: &Snapshot, name: &str, count: usize) -> Result<Vec<Vector>, SnapshotError> {
    snapshot.reals_of(name, 3 * count)?;
    snapshot.vectors(name)
}

/// Liquid volume at one time, and its sources since the start [m^3].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LiquidVolume {
    /// `sum C dV`, liquid inside grains included: conserved by the transport.
    pub transported: Real,
    /// `sum (1 - alpha) C dV`: liquid outside grains.
    pub wet: Real,
    /// Inflow through open sides since the start.
    pub through_open_sides: Real,
    /// Removed (negative: added) by clipping to the range 0 to 1, since the start.
    pub clipped: Real,
}

/// Liquid budget of a whole run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiquidBudget {
    initial: LiquidVolume,
    now: LiquidVolume,
}

impl LiquidBudget {
    /// Starts with the volumes at the beginning of the run.
    #[must_use]
    pub fn new(initial: LiquidVolume) -> Self {
        Self { initial, now: initial }
    }

    /// Sets the volumes now.
    pub fn set(&mut self, now: LiquidVolume) {
        self.now = now;
    }

    /// Volumes now.
    #[must_use]
    pub fn now(&self) -> &LiquidVolume {
        &self.now
    }

    /// Change of the transported volume that open sides do not explain, relative to the volume at the
    /// start (or the inflow, if that is more); clipping is included.
    #[must_use]
    pub fn relative_change(&self) -> Real {
        let inflow = self.now.through_open_sides - self.initial.through_open_sides;
        let change = self.now.transported - self.initial.transported - inflow;
        relative(change, self.initial.transported.max(inflow))
    }

    /// Relative change of the liquid volume outside grains.
    #[must_use]
    pub fn wet_relative_change(&self) -> Real {
        let inflow = self.now.through_open_sides - self.initial.through_open_sides;
        relative(self.now.wet - self.initial.wet - inflow, self.initial.wet.max(inflow))
    }

    /// Writes the state into a snapshot.
    pub fn save(&self, snapshot: &mut Snapshot) {
        let volumes = [self.initial, self.now].map(|v| [v.transported, v.wet, v.through_open_sides, v.clipped]);
        snapshot.put_reals("liquid_budget", volumes.concat());
    }

    /// Reads the state from a snapshot.
    ///
    /// # Errors
    /// [`SnapshotError`] if it is not there or of another length.
    pub fn restore(snapshot: &Snapshot) -> Result<Self, SnapshotError> {
        let v = snapshot.reals_of("liquid_budget", 8)?;
        let volume = |at: usize| LiquidVolume {
            transported: v[at],
            wet: v[at + 1],
            through_open_sides: v[at + 2],
            clipped: v[at + 3],
        };
        Ok(Self { initial: volume(0), now: volume(4) })
    }
}

fn relative(change: Real, scale: Real) -> Real {
    if scale > 0.0 { change / scale } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grain that takes momentum from a fluid with an impulse that arrives one step late, under gravity,
    /// while the mass it displaces changes: the scheme in one cell.
    fn run(steps: usize, count_displaced_mass: bool) -> MomentumBudget {
        let (fluid_mass, grain_mass, dt) = (2.0, 3.0, 0.01);
        let gravity = Vector::new(0.0, 0.0, -9.8);
        let (mut u, mut v, mut deferred) = (Vector::new(1.0, 0.5, -4.0), Vector::ZERO, Vector::ZERO);
        let mut displaced_mass = 0.2;
        let stored = |u: Vector, v: Vector, displaced_mass: Real, deferred: Vector| StoredMomentum {
            liquid: fluid_mass * u,
            grains: grain_mass * v,
            displaced: displaced_mass * v,
            deferred,
            ..Default::default()
        };
        let mut budget = MomentumBudget::new(stored(u, v, displaced_mass, deferred));
        for step in 0..steps {
            let wall = Vector::new(0.0, 0.0, 0.1 * dt);
            u += gravity * dt + wall / fluid_mass;
            let load = 0.7 * (u - v) * dt;
            let v_old = v;
            v += gravity * dt + (load + deferred) / grain_mass;
            let old_mass = displaced_mass;
            displaced_mass = 0.2 + 0.1 * (step as Real).sin();
            let taken = 0.3 * fluid_mass * (u - v);
            u -= taken / fluid_mass;
            deferred = taken + displaced_mass * (v - v_old - gravity * dt) - load;
            let displaced_mass_flux = -v_old * (displaced_mass - old_mass);
            budget.add(&Impulses {
                walls_on_fluid: wall,
                gravity_on_fluid: fluid_mass * gravity * dt,
                gravity_on_grains: (grain_mass - displaced_mass) * gravity * dt,
                displaced_mass_flux: if count_displaced_mass { displaced_mass_flux } else { Vector::ZERO },
                ..Default::default()
            });
            budget.set_stored(stored(u, v, displaced_mass, deferred));
        }
        budget
    }

    #[test]
    fn the_budget_closes_to_round_off() {
        let budget = run(10_000, true);
        assert!(budget.relative_residual() < 1e-12, "{}", budget.relative_residual());
        assert!(budget.largest_term() > 100.0);
        // Negative control: the displaced_mass_flux liquid left out.
        assert!(run(10_000, false).relative_residual() > 1e-4);
    }

    #[test]
    fn impulses_add_up_to_the_last_digit() {
        let mut budget = MomentumBudget::new(StoredMomentum::default());
        let small = Vector::splat(0.1);
        (0..1_000_000).for_each(|_| budget.add(&Impulses { held_grains: small, ..Default::default() }));
        let sum = budget.impulses().held_grains.x;
        assert_eq!(sum, 1e5);
        // Negative control: a plain sum misses that.
        let plain: Real = (0..1_000_000).map(|_| 0.1).sum();
        assert!((plain - 1e5).abs() > 1e-7);
    }

    #[test]
    fn a_residual_is_measured_against_the_largest_term() {
        let start = StoredMomentum { liquid: Vector::new(0.0, 0.0, -4.0), ..Default::default() };
        let mut budget = MomentumBudget::new(start);
        budget.set_stored(StoredMomentum { liquid: Vector::new(0.0, 0.0, -8.0), ..start });
        budget.set_stored(StoredMomentum { liquid: Vector::new(0.0, 0.0, -3.0), ..start });
        assert_eq!(budget.relative_residual(), 1.0 / 8.0);
        assert_eq!(budget.residual_of_initial(), Some(0.25));
        assert_eq!(MomentumBudget::new(StoredMomentum::default()).relative_residual(), 0.0);
    }

    #[test]
    fn names_and_terms_match() {
        let only = Impulses { displaced_mass_flux: Vector::ONE, ..Default::default() };
        let at = Impulses::NAMES.iter().position(|&name| name == "swallowed").unwrap();
        assert_eq!(only.terms()[at], Vector::ONE);
        assert_eq!(Impulses::from(only.terms()), only);
        let only = ParticleImpulses { pressure_on_grains: Vector::ONE, ..Default::default() };
        let at = ParticleImpulses::NAMES.iter().position(|&name| name == "pressure_on_grains").unwrap();
        assert_eq!(only.terms()[at], Vector::ONE);
        assert_eq!(ParticleImpulses::from(only.terms()), only);
    }

    /// A fluid that is shaken along x1 between walls and drags grains along.
    fn shaken(steps: u32) -> FluidMomentumBudget {
        let mut momentum = Vector::new(0.2, 0.0, -0.1);
        let mut budget = FluidMomentumBudget::new(momentum);
        for step in 0..steps {
            let phase = 0.1 * Real::from(step);
            let impulses = ParticleImpulses {
                body_force_on_fluid: Vector::new(1e-3 * phase.sin(), 0.0, -1e-2),
                wall_pressure_on_fluid: Vector::new(0.0, 0.0, 0.9e-2),
                drag_on_fluid: Vector::new(-1e-4 * phase.cos(), 0.0, 0.0),
                drag_on_grains: Vector::new(1e-4 * phase.cos(), 0.0, 0.0),
                pressure_on_grains: Vector::new(0.0, 0.0, -1e-3),
                grains_on_walls: Vector::new(0.0, 0.0, -5.0),
                ..Default::default()
            };
            momentum += impulses.on_fluid();
            budget.add(&impulses);
        }
        budget.balance(momentum);
        budget
    }

    #[test]
    fn the_budget_of_a_fluid_closes_and_a_loss_shows() {
        let mut budget = shaken(10_000);
        assert!(budget.residual().length() < 1e-12, "{}", budget.residual());
        assert_eq!(budget.impulses().relative_drag_residual(), 0.0);
        // Negative control: momentum that nothing gave.
        budget.balance(Vector::new(0.2, 0.0, 1.0 - 0.1) + budget.impulses().on_fluid());
        assert!((budget.residual() - Vector::Z).length() < 1e-12);
        let [along, across, up] = budget.relative_residual();
        assert!(along.unwrap() < 1e-12 && across.is_none() && (up.unwrap() - 1e-2).abs() < 1e-12);
        assert_eq!(ParticleImpulses::default().relative_drag_residual(), 0.0);
    }

    #[test]
    fn the_budget_of_a_fluid_survives_a_snapshot() {
        let budget = shaken(1000);
        let mut snapshot = Snapshot::default();
        budget.save(&mut snapshot);
        let again = FluidMomentumBudget::restore(&snapshot).unwrap();
        assert_eq!((again.impulses(), again.forced), (budget.impulses(), budget.forced));
        assert_eq!(again.initial, budget.initial);
        // Plain sums have no rests.
        let mut plain = Snapshot::default();
        plain.put_reals(FLUID_SUMS, snapshot.reals(FLUID_SUMS).unwrap().to_vec());
        let plain = FluidMomentumBudget::restore(&plain).unwrap();
        assert!(plain.impulses.iter().zip(&budget.impulses).all(|(a, b)| a.sum == b.sum && a.rest == Vector::ZERO));
        assert!(FluidMomentumBudget::restore(&Snapshot::default()).is_err());
    }

    #[test]
    fn the_state_survives_a_snapshot() {
        let budget = run(7, true);
        let liquid = LiquidBudget {
            initial: LiquidVolume { transported: 2.0, wet: 1.9, through_open_sides: 0.0, clipped: 0.0 },
            now: LiquidVolume { transported: 2.5, wet: 2.1, through_open_sides: 0.5, clipped: 1e-12 },
        };
        let mut snapshot = Snapshot::default();
        budget.save(&mut snapshot);
        liquid.save(&mut snapshot);
        assert_eq!(MomentumBudget::restore(&snapshot).unwrap(), budget);
        assert_eq!(LiquidBudget::restore(&snapshot).unwrap(), liquid);
        assert!(MomentumBudget::restore(&Snapshot::default()).is_err());
        assert!(LiquidBudget::restore(&Snapshot::default()).is_err());
    }

    #[test]
    fn inflow_is_not_a_loss_of_liquid() {
        let mut budget = LiquidBudget::new(LiquidVolume { transported: 2.0, wet: 2.0, ..Default::default() });
        budget.set(LiquidVolume { transported: 3.0, wet: 2.9, through_open_sides: 1.0, clipped: 0.0 });
        assert_eq!(budget.relative_change(), 0.0);
        assert!((budget.wet_relative_change() + 0.05).abs() < 1e-15);
    }
}
