//! A mean velocity that a uniform body force holds, as in a channel that is periodic along its flow.
//!
//! The force per mass answers to the mean velocity `u` as a critically damped oscillator does: with the wanted velocity `U` and
//! the time `T` of the answer,
//!
//! ```text
//! a = h + 2 (U - u) / T,   dh/dt = (U - u) / T^2
//! ```
//!
//! Drag that stops the flow at a rate `k` beyond `1/T`, as that of a bed held in it, would make the answer last `k T^2`. What `h` holds
//! against it, `h - b` with the part `b` that bears the weight, goes to `k U`: where `T (h - b)/U` is above one, `h` gathers that many
//! times as fast, and `u` answers at the rates `1/T` and `k`.
//!
//! In steady flow `a` times the mass that it drives is the friction that holds this mass back: over a bed the shear stress.
//! In a box that falls with its liquid the force is that of the frame: it holds the liquid where it is, the fluid outside is at rest and has
//! the velocity that such a force gives it.
//!
//! A velocity that would take long to be reached at a bearable force rises as `U (3 s^2 - 2 s^3)`, `s = t / rise`.

use crate::snapshot::{Snapshot, SnapshotError};
use crate::{Real, Vector, choices};

/// Section of a snapshot with the state of the force.
const STATE: &str = "mean_flow/state";
/// Section with the velocity of the fluid outside a box that moves.
const OUTSIDE: &str = "mean_flow/outside";

choices! {
    /// What the force that drives a flow acts on grains by.
    pub enum ActsBy {
        /// Their mass, as gravity in a channel that slopes.
        Mass = "mass",
        /// The volume of liquid that they displace, as a gradient of pressure from outside: in a tunnel, under waves.
        Volume = "volume",
    }
}

/// What is held, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanFlowSettings {
    /// Mean velocity that is held [m/s].
    pub velocity: Vector,
    /// The directions in which it is held.
    pub held: [bool; 3],
    /// Whether the mean is that of all that is in the box, the net flow, in place of the liquid above a height.
    pub net: bool,
    /// Height above which the mean is taken \[m].
    pub above: Real,
    /// Area of what lies under the flow, for the stress on it [m^2].
    pub area: Real,
    /// Time in which the force answers to the mean \[s]; longer than a step.
    pub answer: Real,
    /// Time in which the velocity rises \[s].
    pub rise: Real,
    /// What the force acts on grains by.
    pub acts_by: ActsBy,
    /// Constant force per mass beside it, as that of gravity, which it bears along the held directions [m/s^2].
    pub beside: Vector,
    /// Whether the force is that of a box that moves with the liquid.
    pub moves_box: bool,
}

/// The mean flow and what drove it, at the end of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeanFlowReport {
    /// Body force per mass during the step [m/s^2].
    pub acceleration: Vector,
    /// Mean velocity of the liquid above the height at its end [m/s].
    pub velocity: Vector,
    /// Velocity wanted at that time, none of liquid that is not there [m/s].
    pub wanted: Vector,
    /// Force on that liquid over the area under it \[Pa]: in steady flow the shear stress there.
    pub stress: Vector,
    /// What the velocity of the fluid outside has changed by, where the box moves [m/s]; the box has the opposite.
    pub outside: Vector,
}

/// A mean velocity that is held, and the force that holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanFlow {
    settings: MeanFlowSettings,
    /// Time since it is held \[s].
    time: Real,
    /// The part of the force that has gathered [m/s^2].
    held: Vector,
    acceleration: Vector,
    outside: Vector,
}

impl MeanFlow {
    /// A flow that is held from now on, at first by what bears the constant force beside it.
    #[must_use]
    pub fn new(settings: MeanFlowSettings) -> Self {
        let idle = Self { settings, time: 0.0, held: Vector::ZERO, acceleration: Vector::ZERO, outside: Vector::ZERO };
        let held = if settings.net { Vector::ZERO } else { idle.in_held_directions(Vector::ZERO - settings.beside) };
        Self { held, acceleration: held, ..idle }
    }

    /// Goes on from a snapshot.
    ///
    /// # Errors
    /// [`SnapshotError`] if nothing was held when it was taken.
    pub fn restore(settings: MeanFlowSettings, snapshot: &Snapshot) -> Result<Self, SnapshotError> {
        let state = snapshot.reals_of(STATE, 7)?;
        let [held, acceleration] = [1, 4].map(|n| Vector::from_slice(&state[n..n + 3]));
        let outside =
            if settings.moves_box { Vector::from_slice(snapshot.reals_of(OUTSIDE, 3)?) } else { Vector::ZERO };
        Ok(Self { settings, time: state[0], held, acceleration, outside })
    }

    /// Adds the state of the force to a snapshot.
    pub fn save(&self, snapshot: &mut Snapshot) {
        let state = [self.held, self.acceleration].into_iter().flat_map(|v| v.to_array());
        snapshot.put_reals(STATE, std::iter::once(self.time).chain(state).collect());
        if self.settings.moves_box {
            snapshot.put_reals(OUTSIDE, self.outside.to_array().to_vec());
        }
    }

    /// Body force per mass in the next step [m/s^2].
    #[must_use]
    pub const fn acceleration(&self) -> Vector {
        self.acceleration
    }

    /// The part of [`Self::acceleration`] that acts on grains by their volume [m/s^2].
    #[must_use]
    pub fn by_volume(&self) -> Vector {
        if self.settings.acts_by == ActsBy::Volume { self.acceleration } else { Vector::ZERO }
    }

    /// What the velocity of the fluid outside a box that moves will have changed by in `dt` \[s] since it is held; none of others [m/s].
    #[must_use]
    pub fn outside_after(&self, dt: Real) -> Vector {
        if self.settings.moves_box { self.outside + self.acceleration * dt } else { Vector::ZERO }
    }

    /// Whether the force is that of a box that moves with the liquid.
    #[must_use]
    pub const fn moves_box(&self) -> bool {
        self.settings.moves_box
    }

    /// Whether the mean is that of all that is in the box.
    #[must_use]
    pub const fn is_net(&self) -> bool {
        self.settings.net
    }

    /// The directions in which a velocity is held.
    #[must_use]
    pub const fn held(&self) -> [bool; 3] {
        self.settings.held
    }

    /// Begins with the force that bears the weight of a `mass` \[kg] under `gravity` [m/s^2], by the liquid of `displaced` \[kg]
    /// that would fill its room; nothing where the flow is held already.
    pub fn bear(&mut self, gravity: Vector, mass: Real, displaced: Real) {
        if self.time == 0.0 {
            self.held = self.in_held_directions(-gravity * (mass / displaced));
            self.acceleration = self.held;
        }
    }

    /// The part of a vector along the directions in which the flow is held.
    #[must_use]
    pub fn in_held_directions(&self, of: Vector) -> Vector {
        Vector::from_array(std::array::from_fn(|d| if self.settings.held[d] { of[d] } else { 0.0 }))
    }

    /// Height above which the mean is taken \[m].
    #[must_use]
    pub const fn above(&self) -> Real {
        self.settings.above
    }

    /// The velocity that is wanted `dt` \[s] from now [m/s].
    #[must_use]
    pub fn wanted_after(&self, dt: Real) -> Vector {
        self.wanted(self.time + dt)
    }

    /// Goes on by a step of `dt` \[s] whose force, an `acceleration` of the liquid [m/s^2], kept the mean `velocity` [m/s] of a room that
    /// `mass` \[kg] of liquid would fill.
    pub fn kept(&mut self, dt: Real, acceleration: Vector, velocity: Vector, mass: Real) -> MeanFlowReport {
        self.time += dt;
        (self.acceleration, self.held) = (acceleration, acceleration);
        MeanFlowReport {
            acceleration,
            velocity,
            wanted: self.wanted(self.time),
            stress: acceleration * mass / self.settings.area,
            outside: self.outside,
        }
    }

    /// The wanted velocity at `time` \[s] since it is held [m/s].
    fn wanted(&self, time: Real) -> Vector {
        let MeanFlowSettings { velocity, rise, .. } = self.settings;
        let s = if rise > 0.0 { (time / rise).min(1.0) } else { 1.0 };
        velocity * (s * s * (3.0 - 2.0 * s))
    }

    /// Answers to the `momentum` [N s] of a `mass` \[kg] of liquid after a step of `dt` \[s]; where there is no liquid the force
    /// stays.
    pub fn answer(&mut self, dt: Real, momentum: Vector, mass: Real) -> MeanFlowReport {
        let acceleration = self.acceleration;
        self.time += dt;
        let MeanFlowSettings { area, answer, .. } = self.settings;
        let stress = acceleration * mass / area;
        self.outside = self.outside_after(dt);
        let outside = self.outside;
        if mass <= 0.0 {
            return MeanFlowReport { acceleration, stress, outside, ..MeanFlowReport::default() };
        }
        let (mean, wanted) = (momentum / mass, self.wanted(self.time));
        let lacks = self.in_held_directions(wanted - mean);
        let faster = |d: usize| match self.settings.velocity[d] {
            0.0 => 1.0,
            wanted => (answer * (self.held[d] + self.settings.beside[d]) / wanted).max(1.0),
        };
        self.held += lacks * dt / (answer * answer) * Vector::new(faster(0), faster(1), faster(2));
        self.acceleration = self.held + 2.0 * lacks / answer;
        MeanFlowReport { acceleration, velocity: mean, wanted, stress, outside }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: MeanFlowSettings = MeanFlowSettings {
        velocity: Vector::new(0.3, 0.0, 0.0),
        held: [true, false, false],
        net: false,
        above: 0.0,
        area: 0.5,
        answer: 0.05,
        rise: 0.0,
        acts_by: ActsBy::Mass,
        beside: Vector::ZERO,
        moves_box: false,
    };

    /// Velocity after a second, last force and largest velocity of a mass of 2 kg with a friction of `rate` [1/s].
    fn after(mut flow: MeanFlow, rate: Real) -> [Real; 3] {
        let (dt, mut u, mut largest) = (1e-4, Vector::new(0.0, 0.1, 0.0), Real::NEG_INFINITY);
        for _ in 0..10_000 {
            u += dt * (flow.acceleration() - rate * u);
            let report = flow.answer(dt, 2.0 * u, 2.0);
            assert_eq!((report.velocity, report.stress), (u, 4.0 * report.acceleration));
            largest = largest.max(u.x);
        }
        assert_eq!(flow.acceleration().y, 0.0, "nothing is wanted across");
        [u.x, flow.acceleration().x, largest]
    }

    #[test]
    fn the_force_in_steady_flow_is_the_friction() {
        for rate in [2.0, 4.0] {
            let [u, force, _] = after(MeanFlow::new(SETTINGS), rate);
            assert!((u / 0.3 - 1.0).abs() < 1e-4 && (force / (rate * 0.3) - 1.0).abs() < 1e-3, "{u} {force}");
        }
        // A velocity of zero is held as well; negative control: nothing is where no direction is.
        let still = after(MeanFlow::new(MeanFlowSettings { velocity: Vector::ZERO, ..SETTINGS }), 2.0);
        assert_eq!(still[..2], [0.0; 2]);
        let idle = MeanFlow::new(MeanFlowSettings { held: [false; 3], ..SETTINGS });
        assert_eq!(after(idle, 2.0)[..2], [0.0; 2]);
    }

    #[test]
    fn drag_that_stops_the_flow_within_a_step_is_answered_too() {
        // Implicit drag of 5000/s, with the time of answer 250 times what it takes to stop: 14 of them.
        let after = |answer: Real, sign: Real, gravity: Real| {
            let beside = Vector::new(gravity, 0.0, 0.0);
            let settings = MeanFlowSettings { answer, velocity: sign * SETTINGS.velocity, beside, ..SETTINGS };
            let (dt, mut flow, mut u, mut largest) = (2e-4, MeanFlow::new(settings), Vector::ZERO, 0.0_f64);
            for _ in 0..3500 {
                u = (u + dt * (beside + flow.acceleration())) / (1.0 + 5e3 * dt);
                flow.answer(dt, u, 1.0);
                largest = largest.max(sign * u.x);
            }
            [sign * u.x / 0.3, largest / 0.3]
        };
        for (sign, gravity) in [(1.0, 0.0), (-1.0, 0.0), (1.0, -9.8), (1.0, 9.8)] {
            let [u, largest] = after(0.05, sign, gravity);
            assert!((u - 1.0).abs() < 0.02 && largest < 1.02, "{sign} {gravity}: {u} {largest}");
        }
        // Control: an answer of a tenth of the time is not there.
        assert!(after(0.5, 1.0, 0.0)[0] < 0.1, "{:?}", after(0.5, 1.0, 0.0));
    }

    #[test]
    fn weight_along_the_flow_is_no_drag() {
        // Water of little friction that falls along the flow, and the law as it is without drag.
        let lag = |pull: Real, beside: Real| {
            let settings = MeanFlowSettings { beside: Vector::new(beside, 0.0, 0.0), rise: 0.25, ..SETTINGS };
            let (dt, mut flow, mut u) = (1e-4, MeanFlow::new(settings), [0.0; 2]);
            let (mut held, mut force, mut apart) = (-beside, -beside, 0.0_f64);
            for n in 1..10_000 {
                u[0] += dt * (pull + flow.acceleration().x - 0.5 * u[0]);
                flow.answer(dt, Vector::new(u[0], 0.0, 0.0), 1.0);
                u[1] += dt * (pull + force - 0.5 * u[1]);
                let lacks = flow.wanted(dt * Real::from(n)).x - u[1];
                held += lacks * dt / (0.05 * 0.05);
                force = held + 2.0 * lacks / 0.05;
                apart = apart.max((u[0] - u[1]).abs());
            }
            apart
        };
        for pull in [0.0, -9.8, 9.8] {
            assert!(lag(pull, pull) < 1e-12, "{pull}: {}", lag(pull, pull));
        }
        // Control: weight that it does not know is taken for drag.
        assert!(lag(-9.8, 0.0) > 1e-3, "{}", lag(-9.8, 0.0));
    }

    #[test]
    fn a_velocity_that_rises_is_not_exceeded_by_much() {
        let [_, _, at_once] = after(MeanFlow::new(SETTINGS), 1.0);
        let [u, _, risen] = after(MeanFlow::new(MeanFlowSettings { rise: 0.5, ..SETTINGS }), 1.0);
        assert!((u / 0.3 - 1.0).abs() < 1e-3 && risen < 0.31 && at_once > 0.33, "{u} {risen} {at_once}");
    }

    #[test]
    fn a_restart_goes_on_with_the_same_force_and_dry_steps_change_none() {
        let mut flow = MeanFlow::new(MeanFlowSettings { rise: 0.1, ..SETTINGS });
        flow.answer(0.01, Vector::ZERO, 1.0);
        let before = flow;
        assert_eq!(flow.answer(0.01, Vector::ZERO, 0.0).acceleration, before.acceleration());
        assert_eq!(flow.acceleration(), before.acceleration());
        let mut snapshot = Snapshot::default();
        flow.save(&mut snapshot);
        assert_eq!(MeanFlow::restore(flow.settings, &snapshot).unwrap(), flow);
        assert!(MeanFlow::restore(flow.settings, &Snapshot::default()).is_err());
        // In a box that moves the fluid outside goes on with what it has gained.
        let mut followed = MeanFlow::new(MeanFlowSettings { moves_box: true, beside: Vector::NEG_X, ..SETTINGS });
        assert!(MeanFlow::restore(followed.settings, &snapshot).is_err());
        let gained = followed.answer(0.01, Vector::ZERO, 1.0).outside;
        assert_eq!((gained, flow.outside_after(0.01)), (Vector::new(0.01, 0.0, 0.0), Vector::ZERO));
        followed.save(&mut snapshot);
        assert_eq!(MeanFlow::restore(followed.settings, &snapshot).unwrap(), followed);
    }
}
