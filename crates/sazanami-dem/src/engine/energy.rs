//! The energy that contacts take from the grains and give back: no more than they took, or sub-steps are too long.
//!
//! Over a call a contact changes the energy of a grain by what its kinetic energy rises beyond the work of the loads,
//!
//! ```text
//! w = [m v^2/2 + w . L/2]_0^1 - (F + m g) . (x_1 - x_0) - T . (w_0 + w_1) dt/2 - drag
//! ```
//!
//! exact for constant forces in drift, kick, drift; the torque's work is that of the mean of both ends. What grains of given
//! motion and moving walls do on the contacts is booked against it. The sum over a window of sub-steps, with the change of the
//! elastic energy, is what dashpots and friction took, below zero. Explicit integration returns a little too much or too
//! little of single impacts; an unstable network of contacts drives, and gives in every sub-step. The two are told apart by
//! the part of all energy exchanged that contacts may give: [`MOST_GIVEN`].

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{for_each_chunk, reduce_over, sum_over};

use super::{ContactReport, Engine, Loads};
use crate::error::DemError;
use crate::grain::{Motion, ROWS};

/// Shortest window in sub-steps.
const WINDOW: usize = 200;
/// Part of the exchanged energy that contacts may give beyond what they took.
const MOST_GIVEN: Real = 0.2;
/// Energy over that of all grains and springs below which nothing is judged: impacts without loss come out with up to 2 % more or
/// less, which the sums over a call cannot tell from a drive; a drive grows past it within windows.
const LEAST: Real = 0.05;
/// Energy over that which lifts a free grain of the mean weight by its radius below which nothing is judged: where all is nearly
/// at rest, what is left of motion and springs is no measure.
const UNSEEN: Real = 1e-6;
/// Part of the energies and works of a grain that rounding of their difference may leave.
const ROUNDING: Real = 16.0 * Real::EPSILON;

/// What contacts took and gave; see the module.
#[derive(Debug, Default)]
pub(super) struct EnergyBook {
    /// Whether nothing is booked.
    pub closed: bool,
    /// Energy of each own grain at the start of the call, less what its place in the loads is worth; at its end what contacts gave
    /// it \[J].
    given: Vec<Real>,
    /// Work of each own grain's drag or, where its motion is given, of its contacts on it during the call \[J].
    pub aside: Vec<Real>,
    /// Impulse of the contacts of each own grain whose motion is given, during the call [N s].
    pub held: Vec<Vector>,
    /// The present window: from the end of the first call on, which finds what touches from before.
    pub window: Option<Window>,
}

/// Consecutive calls.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// Sub-steps so far.
    substeps: usize,
    /// Elastic energy at its start that springs can give back \[J].
    stored: Real,
    /// What that of this rank has grown by since, since its grains became drier or moister \[J].
    pub moistened: Real,
    /// Energy that contacts have given \[J].
    given: Real,
    /// Energy that they have taken or given \[J].
    exchanged: Real,
    /// Most that they gave a grain in a call, its identifier, and the time \[J, s].
    most: (Real, u64, Real),
}

/// What contacts gave in a call: free grains, those of given motion, both by magnitude \[J]; the grain that they gave most, and how much.
#[derive(Clone, Copy, Debug)]
struct Call {
    sums: [Real; 3],
    most: (Real, u64),
}

impl Call {
    const NOTHING: Self = Self { sums: [0.0; 3], most: (Real::NEG_INFINITY, 0) };

    fn with(self, other: Self) -> Self {
        let sums = std::array::from_fn(|n| self.sums[n] + other.sums[n]);
        Self { sums, most: if other.most.0 > self.most.0 { other.most } else { self.most } }
    }
}

impl Engine {
    /// Books no energy of rounded bodies, whose contacts are stable in sub-steps that resolve each of them: for calls of few sub-steps,
    /// in which the book would cost a tenth of them.
    pub fn book_flat_bodies_only(&mut self) {
        self.book.closed = !self.bodies.iter().any(|body| body.face().is_flat());
    }

    /// Opens the book for a call.
    pub(super) fn open_book(&mut self, loads: &Loads<'_>, gravity: Vector, dt: Real) {
        let mut book = std::mem::take(&mut self.book);
        let owned = self.grains.owned;
        book.aside.clear();
        book.aside.resize(owned, 0.0);
        book.held.clear();
        book.held.resize(owned, Vector::ZERO);
        if !book.closed {
            book.given.resize(owned, 0.0);
            for_each_chunk(&mut book.given[..], ROWS, |number, given| {
                for (n, given) in given.iter_mut().enumerate() {
                    [*given, _] = self.worth(number * ROWS + n, loads, gravity, -dt);
                }
            });
        }
        self.book = book;
    }

    /// Closes it after the last sub-step of a call in which walls did `by_walls` on the contacts \[J].
    pub(super) fn close_book(
        &mut self,
        domain: &Domain,
        (loads, gravity, dt): (&Loads<'_>, Vector, Real),
        by_walls: Real,
        report: &mut ContactReport,
    ) -> Result<(), DemError> {
        if self.book.closed {
            return Ok(());
        }
        let mut book = std::mem::take(&mut self.book);
        for_each_chunk((&mut book.given[..], &mut book.aside[..]), ROWS, |number, (given, aside)| {
            for (n, (given, aside)) in given.iter_mut().zip(aside).enumerate() {
                let g = number * ROWS + n;
                if self.grains.motion[g] == Motion::Free {
                    let [worth, size] = self.worth(g, loads, gravity, dt);
                    let change = worth - *given - *aside;
                    *given = if change.abs() <= ROUNDING * (size + aside.abs()) { 0.0 } else { change };
                    *aside = 0.0;
                } else {
                    *given = 0.0;
                }
            }
        });
        self.book = book;
        let (id, book) = (&self.grains.id, &self.book);
        let part = |chunk: usize| {
            let rows = chunk * ROWS..((chunk + 1) * ROWS).min(book.given.len());
            rows.fold(Call::NOTHING, |sum, g| {
                let (mine, driven) = (book.given[g], book.aside[g]);
                sum.with(Call { sums: [mine, driven, mine.abs() + driven.abs()], most: (mine, id[g]) })
            })
        };
        let Call { sums: [mine, driven, exchanged], most } =
            reduce_over(book.given.len().div_ceil(ROWS), part, Call::with).unwrap_or(Call::NOTHING);
        let [mine, driven, exchanged] = domain.sum([mine, driven - by_walls, exchanged + by_walls.abs()]);
        report.contact_work = Some(mine);
        let Some(mut window) = self.book.window else {
            self.book.window = Some(self.window(domain));
            return Ok(());
        };
        window.given += mine + driven;
        window.exchanged += exchanged;
        window.substeps += report.substeps;
        if most.0 > window.most.0 {
            window.most = (most.0, most.1, self.time);
        }
        self.book.window = Some(window);
        if window.substeps >= WINDOW { self.judge(domain, window, gravity.length()) } else { Ok(()) }
    }

    /// A window that begins now.
    fn window(&self, domain: &Domain) -> Window {
        let [stored] = domain.sum([self.elastic_energies()[1]]);
        Window {
            substeps: 0,
            stored,
            moistened: 0.0,
            given: 0.0,
            exchanged: 0.0,
            most: (Real::NEG_INFINITY, 0, self.time),
        }
    }

    /// Judges a window that has ended under `gravity` [m/s^2], and begins the next.
    fn judge(&mut self, domain: &Domain, ended: Window, gravity: Real) -> Result<(), DemError> {
        let next = self.window(domain);
        self.book.window = Some(next);
        let grains = &self.grains;
        let of_grain = |g: usize| {
            let free = Real::from(u8::from(grains.motion[g] == Motion::Free));
            [grains.kinetic_energy(g), free * grains.mass[g] * self.bounding_radius(g), free]
        };
        let [kinetic, levers, count] = sum_over(grains.owned, of_grain);
        let [kinetic, levers, count, moistened] = domain.sum([kinetic, levers, count, ended.moistened]);
        let unseen = UNSEEN * gravity * levers / count.max(1.0);
        let more_stored = next.stored - ended.stored - moistened;
        let (gained, exchanged) = (ended.given + more_stored, ended.exchanged + more_stored.abs());
        if gained <= MOST_GIVEN * exchanged || gained <= (LEAST * (kinetic + next.stored.max(0.0))).max(unseen) {
            return Ok(());
        }
        // The rank with the grain that was given most names it.
        let (most, id, time) = ended.most;
        let error = DemError::EnergyGained { id, time, gained, exchanged };
        domain.agree(if most >= domain.max(most) { Err(error) } else { Ok(()) })
    }

    /// Kinetic energy of own grain `g` with that of its added mass, less the work that the loads of a step have done by the
    /// time at its end, or with a negative `dt` at its start, and the sum of their magnitudes \[J].
    fn worth(&self, g: usize, loads: &Loads<'_>, gravity: Vector, dt: Real) -> [Real; 2] {
        let (grains, spin) = (&self.grains, self.poses[g].spin);
        let mass = grains.mass[g];
        let moved = mass + loads.added_mass.get(g).copied().unwrap_or(0.0);
        let force = loads.force.get(g).copied().unwrap_or(Vector::ZERO) + mass * gravity;
        let torque = loads.torque.get(g).copied().unwrap_or(Vector::ZERO);
        let kinetic = 0.5 * (moved * grains.velocity[g].length_squared() + spin.dot(grains.angular_momentum[g]));
        let (pushed, turned) = (force.dot(grains.unwrapped[g]), 0.5 * dt * spin.dot(torque));
        [kinetic - pushed - turned, kinetic + pushed.abs() + turned.abs()]
    }
}
