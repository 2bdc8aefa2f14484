//! Momentum budget of a fluid on a grid with grains in it: lines as the solver names them.

use sazanami_numerics::snapshot::{Snapshot, SnapshotError};
use sazanami_numerics::{Real, Vector};

use super::total::{Total, vectors_of};

/// Name and sign in the total of each term of the stored momentum.
pub type StoredTerms = &'static [(&'static str, Real)];

/// Momentum budget of a whole run: the momentum stored, and the impulses that change it [kg m/s].
#[derive(Clone, Debug, PartialEq)]
pub struct MomentumBudget {
    terms: StoredTerms,
    lines: Vec<&'static str>,
    initial: Vec<Vector>,
    now: Vec<Vector>,
    impulses: Vec<Total>,
    largest_term: Real,
    largest_exchange: Real,
}

const VECTORS: &str = "momentum_budget.vectors";
const LARGEST_EXCHANGE: &str = "momentum_budget.largest_exchange";

impl MomentumBudget {
    /// Starts with the momentum at the beginning of the run, in the order of `terms`; `lines` names the impulses.
    #[must_use]
    pub fn new(terms: StoredTerms, initial: impl IntoIterator<Item = Vector>, lines: Vec<&'static str>) -> Self {
        let impulses = vec![Total::default(); lines.len()];
        let initial: Vec<Vector> = initial.into_iter().collect();
        let now = initial.clone();
        let mut budget = Self { terms, lines, initial, now, impulses, largest_term: 0.0, largest_exchange: 0.0 };
        budget.update_largest_term();
        budget
    }

    /// Adds the impulses of a step in the order of the lines; call [`Self::set_stored`] once the momentum after it
    /// is known.
    pub fn add(&mut self, step: impl IntoIterator<Item = Vector>) {
        self.impulses.iter_mut().zip(step).for_each(|(total, impulse)| total.add(impulse));
    }

    /// Sets the momentum stored now, in the order of the terms. Not every step needs it.
    pub fn set_stored(&mut self, now: impl IntoIterator<Item = Vector>) {
        self.now.iter_mut().zip(now).for_each(|(term, now)| *term = now);
        self.update_largest_term();
    }

    /// Notes the momentum that all that moves would have along one direction [kg m/s]: a scale where the terms of the budget cancel.
    pub fn note_motion(&mut self, momentum: Real) {
        self.largest_term = self.largest_term.max(momentum);
    }

    fn update_largest_term(&mut self) {
        let stored = self.now.iter().copied().chain([self.total(&self.initial)]);
        let largest = stored.chain(self.impulses.iter().map(Total::value)).map(Vector::length).fold(0.0, Real::max);
        self.largest_term = self.largest_term.max(largest);
    }

    fn total(&self, stored: &[Vector]) -> Vector {
        self.terms.iter().zip(stored).map(|(&(_, sign), &term)| sign * term).sum()
    }

    /// Terms of the stored momentum at the start.
    pub fn initial(&self) -> impl Iterator<Item = (&'static str, Vector)> {
        self.terms.iter().zip(&self.initial).map(|(&(name, _), &term)| (name, term))
    }

    /// Terms of the stored momentum now.
    pub fn stored(&self) -> impl Iterator<Item = (&'static str, Vector)> {
        self.terms.iter().zip(&self.now).map(|(&(name, _), &term)| (name, term))
    }

    /// Impulses since the start.
    pub fn impulses(&self) -> impl Iterator<Item = (&'static str, Vector)> {
        self.lines.iter().copied().zip(self.impulses.iter().map(Total::value))
    }

    /// Total momentum at the start.
    #[must_use]
    pub fn initial_total(&self) -> Vector {
        self.total(&self.initial)
    }

    /// Residual momentum `P - P(0) - impulses` [kg m/s].
    #[must_use]
    pub fn residual(&self) -> Vector {
        let impulses: Vector = self.impulses.iter().map(Total::value).sum();
        self.total(&self.now) - self.initial_total() - impulses
    }

    /// Residual relative to the largest term, or to the largest momentum that was noted of the motion if that is more; 0 if both are 0.
    #[must_use]
    pub fn relative_residual(&self) -> Real {
        if self.largest_term > 0.0 { self.residual().length() / self.largest_term } else { 0.0 }
    }

    /// Residual relative to the momentum at the start: the share of a drop's momentum that is lost.
    #[must_use]
    pub fn residual_of_initial(&self) -> Option<Real> {
        let initial = self.initial_total().length();
        (initial > 0.0).then(|| self.residual().length() / initial)
    }

    /// Notes the momentum that the grains have from the fluid since the start [kg m/s], a scale of the residual.
    pub fn note_exchange(&mut self, exchanged: Vector) {
        self.largest_exchange = self.largest_exchange.max(exchanged.length());
    }

    /// Residual relative to the largest momentum that the grains have had from the fluid so far, beyond the buoyancy of fluid at rest, if they had any.
    #[must_use]
    pub fn residual_of_exchange(&self) -> Option<Real> {
        (self.largest_exchange > 0.0).then(|| self.residual().length() / self.largest_exchange)
    }

    /// Writes the state into a snapshot.
    pub fn save(&self, snapshot: &mut Snapshot) {
        let stored = self.initial.iter().chain(&self.now).copied();
        let totals = self.impulses.iter().flat_map(|total| [total.sum, total.rest]);
        snapshot.put_vectors(VECTORS, &stored.chain(totals).collect::<Vec<_>>());
        snapshot.put_reals("momentum_budget.largest_term", vec![self.largest_term]);
        snapshot.put_reals(LARGEST_EXCHANGE, vec![self.largest_exchange]);
    }

    /// Reads the state of a budget of these terms and lines from a snapshot; those of earlier versions lack the last line.
    ///
    /// # Errors
    /// [`SnapshotError`] if it is not there or has other lines.
    pub fn restore(terms: StoredTerms, lines: Vec<&'static str>, snapshot: &Snapshot) -> Result<Self, SnapshotError> {
        let all = 2 * (terms.len() + lines.len());
        let is_earlier = snapshot.vectors(VECTORS)?.len() + 2 == all;
        let mut vectors = vectors_of(snapshot, VECTORS, if is_earlier { all - 2 } else { all })?;
        vectors.resize(all, Vector::ZERO);
        let (initial, rest) = vectors.split_at(terms.len());
        let (now, totals) = rest.split_at(terms.len());
        Ok(Self {
            terms,
            initial: initial.to_vec(),
            now: now.to_vec(),
            impulses: totals.chunks(2).map(|of| Total { sum: of[0], rest: of[1] }).collect(),
            lines,
            largest_term: snapshot.reals_of("momentum_budget.largest_term", 1)?[0],
            // Snapshots of earlier versions have none.
            largest_exchange: snapshot.reals_of(LARGEST_EXCHANGE, 1).map_or(0.0, |largest| largest[0]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TERMS: StoredTerms = &[("liquid", 1.0), ("grains", 1.0), ("displaced", -1.0), ("deferred", 1.0)];

    fn lines() -> Vec<&'static str> {
        vec!["walls", "gravity_on_fluid", "gravity_on_grains", "displaced_mass_flux"]
    }

    /// A grain that takes momentum from a fluid with an impulse that arrives one step late, under gravity,
    /// while the mass it displaces changes: the scheme in one cell.
    fn run(steps: usize, count_displaced_mass: bool) -> MomentumBudget {
        let (fluid_mass, grain_mass, dt) = (2.0, 3.0, 0.01);
        let gravity = Vector::new(0.0, 0.0, -9.8);
        let (mut u, mut v, mut deferred) = (Vector::new(1.0, 0.5, -4.0), Vector::ZERO, Vector::ZERO);
        let mut displaced_mass = 0.2;
        let stored = |u: Vector, v: Vector, displaced_mass: Real, deferred: Vector| {
            [fluid_mass * u, grain_mass * v, displaced_mass * v, deferred]
        };
        let mut budget = MomentumBudget::new(TERMS, stored(u, v, displaced_mass, deferred), lines());
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
            let flux = -v_old * (displaced_mass - old_mass);
            let flux = if count_displaced_mass { flux } else { Vector::ZERO };
            budget.add([wall, fluid_mass * gravity * dt, (grain_mass - displaced_mass) * gravity * dt, flux]);
            budget.set_stored(stored(u, v, displaced_mass, deferred));
        }
        budget
    }

    #[test]
    fn the_budget_closes_to_round_off() {
        let budget = run(10_000, true);
        assert!(budget.relative_residual() < 1e-12, "{}", budget.relative_residual());
        assert!(budget.largest_term > 100.0);
        // Negative control: the displaced-mass flux left out.
        assert!(run(10_000, false).relative_residual() > 1e-4);
    }

    #[test]
    fn a_residual_is_told_of_what_the_grains_had_from_the_fluid() {
        let lines = || vec!["walls"];
        let stored = |liquid: Real, grains: Real| [liquid, grains, 0.0, 0.0].map(|momentum| momentum * Vector::Z);
        let mut budget = MomentumBudget::new(TERMS, stored(-100.0, 1.0), lines());
        assert_eq!(budget.residual_of_exchange(), None);
        budget.set_stored(stored(-98.5, -1.0));
        budget.note_exchange(-2.0 * Vector::Z);
        assert_eq!(budget.residual_of_exchange(), Some(0.25));
        let mut snapshot = Snapshot::default();
        budget.save(&mut snapshot);
        assert_eq!(MomentumBudget::restore(TERMS, lines(), &snapshot).unwrap(), budget);
        // The largest exchange so far stays the scale, when they have given it back.
        budget.set_stored(stored(-100.0, 1.0));
        budget.note_exchange(Vector::ZERO);
        assert_eq!((budget.largest_exchange, budget.residual_of_exchange()), (2.0, Some(0.0)));
        budget.set_stored(stored(-99.5, 1.0));
        // Negative control: the largest term hides it.
        assert!(budget.relative_residual() < 0.01);
    }

    #[test]
    fn impulses_add_up_to_the_last_digit() {
        let mut budget = MomentumBudget::new(TERMS, [Vector::ZERO; 4], lines());
        let small = Vector::splat(0.1);
        (0..1_000_000).for_each(|_| budget.add([small]));
        assert_eq!(budget.impulses().next(), Some(("walls", Vector::splat(1e5))));
        // Negative control: a plain sum misses that.
        let plain: Real = (0..1_000_000).map(|_| 0.1).sum();
        assert!((plain - 1e5).abs() > 1e-7);
    }

    #[test]
    fn a_residual_is_measured_against_the_largest_term() {
        let liquid = |momentum: Real| [Vector::Z * momentum, Vector::ZERO, Vector::ZERO, Vector::ZERO];
        let mut budget = MomentumBudget::new(TERMS, liquid(-4.0), lines());
        budget.set_stored(liquid(-8.0));
        budget.set_stored(liquid(-3.0));
        assert_eq!(budget.relative_residual(), 1.0 / 8.0);
        assert_eq!(budget.residual_of_initial(), Some(0.25));
        // What moves to and fro has no momentum together; it is a scale where it is more than the terms.
        budget.note_motion(4.0);
        assert_eq!(budget.relative_residual(), 1.0 / 8.0);
        budget.note_motion(80.0);
        assert_eq!(budget.relative_residual(), 1.0 / 80.0);
        assert_eq!(MomentumBudget::new(TERMS, liquid(0.0), lines()).relative_residual(), 0.0);
        assert_eq!(budget.stored().next(), Some(("liquid", -3.0 * Vector::Z)));
    }

    #[test]
    fn the_state_survives_a_snapshot() {
        let budget = run(7, true);
        let mut snapshot = Snapshot::default();
        budget.save(&mut snapshot);
        assert_eq!(MomentumBudget::restore(TERMS, lines(), &snapshot).unwrap(), budget);
        // Another list of lines is another run.
        assert!(MomentumBudget::restore(TERMS, lines()[1..].to_vec(), &snapshot).is_err());
        assert!(MomentumBudget::restore(TERMS, lines(), &Snapshot::default()).is_err());
        // Of an earlier version, without the last line, and of two that lack.
        let earlier = |lacks: usize| {
            let known = lines()[..lines().len() - lacks].to_vec();
            let mut snapshot = Snapshot::default();
            MomentumBudget::new(TERMS, budget.initial.clone(), known).save(&mut snapshot);
            MomentumBudget::restore(TERMS, lines(), &snapshot)
        };
        assert_eq!(earlier(1).unwrap().impulses().count(), lines().len());
        assert!(earlier(2).is_err());
    }
}
