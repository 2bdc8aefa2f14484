//! Changes of the motion of grains from outside, between steps.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Matrix, Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::Engine;
use crate::grain::{ATTACHED, Grains, Motion, ROWS};
use crate::motion::{MassProperties, Pose};

impl Engine {
    /// Changes the velocity of an own grain, and its angular velocity [m/s, rad/s]; its ghosts follow with
    /// [`Self::refresh_ghosts`].
    pub fn set_velocity(&mut self, own: usize, velocity: Vector, angular_velocity: Vector) {
        let turn = self.rotations[own];
        let inertia = self.grains.inertia[own];
        self.grains.velocity[own] = velocity;
        self.grains.angular_momentum[own] = turn * (inertia * (turn.transpose() * angular_velocity));
        self.rotations[own] = self.poses[own].follow(&self.grains, own, &self.mass_properties[own]);
    }

    /// Adds to each own grain that forces move an impulse [N s] and an angular impulse about its centre of mass [N m s];
    /// its ghosts follow with [`Self::refresh_ghosts`].
    ///
    /// # Panics
    /// If there are not as many impulses as own grains.
    pub fn add_impulses(&mut self, impulses: &[[Vector; 2]]) {
        assert_eq!(impulses.len(), self.grains.owned, "every own grain has an impulse");
        let Self { grains, poses, rotations, mass_properties, .. } = self;
        let Grains { velocity, angular_momentum, motion, owned, .. } = grains;
        let (owned, columns) = (*owned, (&mut velocity[..*owned], &mut angular_momentum[..*owned]));
        for_each_chunk(columns, ROWS, |number, (velocity, momentum)| {
            for (n, (velocity, momentum)) in velocity.iter_mut().zip(momentum).enumerate() {
                let g = number * ROWS + n;
                if motion[g] == Motion::Free {
                    let [impulse, angular_impulse] = impulses[g];
                    *velocity += impulse * mass_properties[g].inverse_mass;
                    *momentum += angular_impulse;
                }
            }
        });
        follow(grains, mass_properties, &mut poses[..owned], &mut rotations[..owned]);
    }

    /// Changes what a coupled solver stores with each own grain by the grains as they are; what it stores with others cannot
    /// be read meanwhile.
    pub fn change_attached(&mut self, change: impl Fn(&Grains, usize, &mut [Real; ATTACHED]) + Sync) {
        let mut attached = std::mem::take(&mut self.grains.attached);
        let grains = &self.grains;
        for_each_chunk(&mut attached[..grains.owned], ROWS, |number, attached| {
            attached.iter_mut().enumerate().for_each(|(n, attached)| change(grains, number * ROWS + n, attached));
        });
        self.grains.attached = attached;
    }

    /// Applies an impulse through the centre of mass of each own grain that forces move [N s], and updates the ghosts.
    ///
    /// # Panics
    /// If there are not as many impulses as own grains.
    pub fn apply_impulses(&mut self, domain: &Domain, impulses: &[Vector]) {
        assert_eq!(impulses.len(), self.grains.owned, "every own grain has an impulse");
        let Self { grains, poses, mass_properties, .. } = self;
        let columns = (&mut grains.velocity[..grains.owned], &mut poses[..grains.owned]);
        for_each_chunk(columns, ROWS, |number, (velocity, poses)| {
            for (n, (velocity, pose)) in velocity.iter_mut().zip(poses).enumerate() {
                let g = number * ROWS + n;
                *velocity += impulses[g] * mass_properties[g].inverse_mass;
                pose.velocity = *velocity;
            }
        });
        self.refresh_ghosts(domain);
    }

    /// Adds `velocity` [m/s] to that of each own grain that forces move, and updates the ghosts. Collective.
    pub fn add_velocity(&mut self, domain: &Domain, velocity: Vector) {
        let Self { grains, poses, .. } = self;
        let Grains { velocity: all, motion, owned, .. } = grains;
        let columns = (&mut all[..*owned], &mut poses[..*owned]);
        for_each_chunk(columns, ROWS, |number, (all, poses)| {
            for ((own, pose), motion) in all.iter_mut().zip(poses).zip(&motion[number * ROWS..]) {
                if *motion == Motion::Free {
                    *own += velocity;
                    pose.velocity = *own;
                }
            }
        });
        self.refresh_ghosts(domain);
    }

    /// Multiplies all velocities by `factor` or less, so that neither the speed of a grain's centre nor that of its
    /// farthest contact sphere about it exceeds `limit` [m/s].
    pub fn limit_speeds(&mut self, domain: &Domain, limit: Real, factor: Real) {
        let Self { grains, poses, rotations, mass_properties, .. } = self;
        let Grains { velocity, angular_momentum, motion, owned, .. } = grains;
        let (owned, columns) = (*owned, (&mut velocity[..*owned], &mut angular_momentum[..*owned]));
        for_each_chunk(columns, ROWS, |number, (velocity, momentum)| {
            for (n, (velocity, momentum)) in velocity.iter_mut().zip(momentum).enumerate() {
                let g = number * ROWS + n;
                if motion[g] == Motion::Free {
                    let speed = velocity.length().max(mass_properties[g].arm * poses[g].spin.length());
                    let part = factor.min(limit / speed.max(Real::MIN_POSITIVE));
                    *velocity *= part;
                    *momentum *= part;
                }
            }
        });
        follow(grains, mass_properties, &mut poses[..owned], &mut rotations[..owned]);
        self.refresh_ghosts(domain);
    }
}

/// Brings the poses of own grains that forces move up to date with their velocities.
fn follow(grains: &Grains, mass_properties: &[MassProperties], poses: &mut [Pose], rotations: &mut [Matrix]) {
    for_each_chunk((poses, rotations), ROWS, |number, (poses, rotations)| {
        for (n, (pose, rotation)) in poses.iter_mut().zip(rotations).enumerate() {
            let g = number * ROWS + n;
            if grains.motion[g] == Motion::Free {
                *rotation = pose.follow(grains, g, &mass_properties[g]);
            }
        }
    });
}
