//! The limits on the contact sub-step, the one authority that the engine, `check` and `feasible` ask.
//!
//! **A contact** of stiffness `K` between grains of effective mass `m*` oscillates with half period `pi sqrt(m*/K)`. A force
//! off the centre of mass also turns a grain: at its contact point a grain of mass `m` has the effective mass `m/l` with
//! the leverage `l` of [`Body::leverage`], which is 1 along and 3.5 across the normal for a ball. A sub-step is a part of it
//! chosen by the errors that impacts of the lightest grains have with it ([`crate::impact`]): the largest between the two of
//! [`crate::TangentialForce::substep_factors`] with at most [`USUAL_ERROR`], or the smaller; of those up to 0.225,
//! where the case allows an error. Where it does, or where a dashpot damps so much that the smaller of the two is more than 0.35 of the
//! limit of stability below, for springs and dashpot of the lightest pair, sub-steps take that much at most: without, impacts on such a
//! dashpot would turn round within a sub-step and gain energy, and so would grains of a bed with several contacts each.
//!
//! **The contacts of a body** add up: `N` spheres of a face that touch a plane at once have `N K` and `N D`. Places are half a
//! sub-step older than the forces, velocities a whole one, so that a mode of square frequency `k` and rate of damping `c`
//! follows `v' = v - h (k x + c v)`, `x' = x + h v'`, which neither grows nor is driven by its dashpot while
//!
//! ```text
//! h^2 k/4 + h c/2 < 1
//! ```
//!
//! (both roots of `z^2 - (2 - h c - h^2 k) z + 1 - h c` within the unit circle), and so does any set of contacts with `k` and
//! `c` the largest eigenvalues of its stiffness and its damping over mass and inertia. Two bodies share the energy of a spring
//! between them at most as `(a - b)^2 <= 2 a^2 + 2 b^2`: eigenvalues of one body after the other, contacts with bodies that
//! move counted twice, bound those of all. A face on a plane takes a quarter of this limit at most, before it touches; the
//! contacts that there are at the start of a step of a body with flat faces half of it. Rounded bodies, of which few
//! spheres touch at once, are far below it in sub-steps that resolve each contact.
//!
//! **A liquid film** damps at the rate `D/m*`, `D` the coefficient of [`crate::Film`] at the roughness.

use std::f64::consts::PI;

use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;

use crate::body::Body;
use crate::contact::laws::Interactions;
use crate::film::{FILM_FACTOR, Film};
use crate::impact::{ImpactErrors, Impacts};

/// Least and most that a sub-step takes of the half period of the stiffest contact where an error of impacts is asked for; those in
/// between are multiples of the least.
const LEAST_FACTOR: Real = 0.0075;
const MOST_FACTOR: Real = 0.225;
/// Largest mean error of the restitution, and of the spin over the tangential speed, where none is asked for.
pub const USUAL_ERROR: Real = 0.025;

/// Shortest sub-step that a bounded film asks for over the longest without it.
const OF_BOUNDED_FILM: Real = 0.1;
/// Part of the limit of stability that a face on a plane takes.
const OF_A_FACE: Real = 0.25;
/// Part that the contact of a lightest pair takes: one of six contacts that all stick has up to 2.9 times its springs and dashpots.
const OF_A_CONTACT: Real = 0.35;
/// Part that all contacts of a body take.
pub(crate) const OF_ALL_CONTACTS: Real = 0.5;

/// Longest sub-step that takes `part` of the limit of stability of a mode, or of modes up to this square frequency \[1/s^2]
/// and this rate of damping [1/s] \[s].
pub(crate) fn stable_for(part: Real, [square, rate]: [Real; 2]) -> Real {
    if square > 0.0 || rate > 0.0 {
        2.0 * part / (0.5 * rate + (0.25 * rate * rate + part * square).sqrt())
    } else {
        Real::INFINITY
    }
}

/// Longest sub-steps by cause \[s]; infinite where there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LongestSubstep {
    /// That resolves each contact by itself.
    pub contact: Real,
    /// Whether impacts have no larger errors with it than the case allows, or than usual; else it is the shortest there is.
    pub accurate: bool,
    /// In which a body comes to rest with a face on a plane.
    pub face: Real,
    /// Of the film between grains.
    pub film: Real,
    /// The same for all of its damping, where that is cut ([`Film::bounded`]).
    pub whole_film: Real,
}

impl LongestSubstep {
    /// The shortest of them \[s].
    #[must_use]
    pub fn shortest(&self) -> Real {
        self.contact.min(self.face).min(self.film)
    }
}

/// The grains that set the limits: the smallest effective masses at contact points of the grains of each material, and the
/// stiffest face.
#[derive(Clone, Debug)]
pub struct EffectiveMasses<'i> {
    interactions: &'i Interactions,
    /// Largest reciprocal of the effective mass along and across the normal, by material; 0: no grain [1/kg].
    inverse: Vec<[Real; 2]>,
    /// Largest radius of a contact sphere, by material \[m].
    radius: Vec<Real>,
    /// Largest square of that of a grain over its mass, by material [m^2/kg].
    square: Vec<Real>,
    /// Largest reciprocal of a mass, by material; 0: no grain [1/kg].
    lightest: Vec<Real>,
    /// See [`LongestSubstep::face`].
    face: Real,
}

impl<'i> EffectiveMasses<'i> {
    /// No grains yet.
    #[must_use]
    pub fn new(interactions: &'i Interactions) -> Self {
        let materials = interactions.materials();
        Self {
            interactions,
            inverse: vec![[0.0; 2]; materials],
            radius: vec![0.0; materials],
            square: vec![0.0; materials],
            lightest: vec![0.0; materials],
            face: Real::INFINITY,
        }
    }

    /// Takes a grain into account that forces move: its body times `scale`, with its `mass` \[kg].
    ///
    /// # Panics
    /// If there is no such material.
    pub fn add(&mut self, body: &Body, scale: Real, mass: Real, material: u32) {
        let radius = body.radii.iter().copied().fold(0.0, Real::max) * scale;
        let largest = &mut self.radius[material as usize];
        *largest = largest.max(radius);
        let square = &mut self.square[material as usize];
        *square = square.max(radius * radius / mass);
        let lightest = &mut self.lightest[material as usize];
        *lightest = lightest.max(mass.recip());
        let leverage = body.leverage();
        let worst = &mut self.inverse[material as usize];
        (0..2).for_each(|d| worst[d] = worst[d].max(leverage[d] / mass));
        // The few spheres of a rounded body are stable in sub-steps that resolve each by itself.
        for other in (0..self.interactions.materials()).filter(|_| body.face().is_flat()) {
            let law = self.interactions.law(material, other as u32);
            let index = self.interactions.index(material, other as u32) as usize;
            let modes = [law.stiffness(), self.interactions.dashpots(index, mass)]
                .map(|values| body.face().mode(values) / mass);
            self.face = self.face.min(stable_for(OF_A_FACE, modes));
        }
    }

    /// Takes the grains of all ranks into account.
    pub fn over_ranks(&mut self, domain: &Domain) {
        let all = self.inverse.iter_mut().flatten().chain(&mut self.radius).chain(&mut self.square);
        for value in all.chain(&mut self.lightest) {
            *value = domain.max(*value);
        }
        self.face = domain.min(self.face);
    }

    /// The longest sub-steps for every contact of these grains with each other and with walls of any of the materials.
    #[must_use]
    pub fn longest_substep(&self) -> LongestSubstep {
        let mut longest = LongestSubstep {
            contact: Real::INFINITY,
            accurate: true,
            face: self.face,
            film: Real::INFINITY,
            whole_film: Real::INFINITY,
        };
        for pair in self.pairs() {
            let (factor, accurate) = self.longest_factor(&pair);
            longest.contact = longest.contact.min(factor * pair.half_period);
            longest.accurate &= accurate;
            // R*^2/m* of two spheres is at most the larger R^2/m, which is that at a wall.
            let damping = self.interactions.film().map_or(0.0, Film::largest_damping);
            let [a, b] = pair.materials;
            let rate = damping * self.square[a].max(self.square[b]);
            if rate > 0.0 {
                longest.whole_film = longest.whole_film.min(FILM_FACTOR / rate);
            }
        }
        let bounded = self.interactions.film().is_some_and(|film| film.bounded);
        let least = if bounded { OF_BOUNDED_FILM * longest.contact.min(longest.face) } else { 0.0 };
        longest.film = longest.whole_film.max(least);
        longest
    }

    /// Errors of impacts of the lightest grains with sub-steps of `substep` \[s], the largest over pairs of materials; `None`
    /// where no grain moves.
    #[must_use]
    pub fn impact_errors(&self, substep: Real) -> Option<ImpactErrors> {
        let of = |pair: &Pair| self.impacts(pair).errors(substep / pair.half_period);
        self.pairs().map(|pair| of(&pair)).reduce(ImpactErrors::max)
    }

    /// Longest sub-step of a pair over its half period, and whether its errors are as small as is asked for.
    fn longest_factor(&self, pair: &Pair) -> (Real, bool) {
        let [a, b] = pair.materials.map(|material| material as u32);
        let usual = self.interactions.law(a, b).tangential_force.substep_factors();
        let asked = self.interactions.allowed_error();
        let [least, most] = asked.map_or(usual, |_| [LEAST_FACTOR, MOST_FACTOR]);
        let stable = pair.stable / pair.half_period;
        let most = if asked.is_some() || stable < usual[0] { most.min(stable) } else { most };
        let least = least.min(most);
        if usual[0] == usual[1] && asked.is_none() {
            return (most, true);
        }
        let impacts = self.impacts(pair);
        let allowed = asked.unwrap_or(USUAL_ERROR);
        let steps = ((most - least) / LEAST_FACTOR).round() as usize;
        let found = (0..=steps)
            .map(|n| most - LEAST_FACTOR * n as Real)
            .find(|&factor| factor > 0.0 && impacts.errors(factor).mean() <= allowed);
        (found.unwrap_or(least), found.is_some())
    }

    fn impacts(&self, pair: &Pair) -> Impacts {
        let [a, b] = pair.materials;
        let mass = (self.lightest[a] + self.lightest[b]).recip();
        Impacts::new(self.interactions.law(a as u32, b as u32), mass, pair.radius)
    }

    /// Pairs of materials of which grains may touch.
    fn pairs(&self) -> impl Iterator<Item = Pair> {
        let materials = self.interactions.materials();
        let all = (0..materials).flat_map(move |a| (a..materials).map(move |b| [a, b]));
        all.filter_map(|materials| {
            let [a, b] = materials;
            // A wall has no curvature: the effective radius of a contact is at most that of its larger sphere.
            let radius = self.radius[a].max(self.radius[b]);
            let [normal, tangential] = self.interactions.law(a as u32, b as u32).stiffness();
            let sum = |d: usize| self.inverse[a][d] + self.inverse[b][d];
            let square = Real::max(normal * sum(0), tangential * sum(1));
            (square > 0.0).then(|| {
                let mass = (self.lightest[a] + self.lightest[b]).recip();
                // Of the law as it is now: springs are softened while beds are packed.
                let dashpots = self.interactions.law(a as u32, b as u32).damping(mass);
                let rate = Real::max(dashpots[0] * sum(0), dashpots[1] * sum(1));
                let stable = stable_for(OF_A_CONTACT, [square, rate]);
                Pair { materials, radius, half_period: PI / square.sqrt(), stable }
            })
        })
    }
}

/// Two materials whose grains, or grains and walls, may touch.
struct Pair {
    materials: [usize; 2],
    /// Largest of a contact sphere \[m].
    radius: Real,
    /// `pi sqrt(m*/K)` of the stiffest contact \[s].
    half_period: Real,
    /// Longest sub-step by its springs and dashpots \[s].
    stable: Real,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::linear_spring_dashpot::{Damping, LinearSpringDashpot};
    use crate::material::TangentialForce;

    #[test]
    fn two_balls_are_limited_by_their_tangential_spring() {
        // Without friction sub-steps are as long as they may be.
        let law = LinearSpringDashpot { friction: 0.0, ..LinearSpringDashpot::SAND };
        let longest = |law: LinearSpringDashpot, count: usize| {
            let interactions = Interactions::uniform(1, law);
            let mut masses = EffectiveMasses::new(&interactions);
            (0..count).for_each(|_| masses.add(&Body::ball(1e-3), 1.0, 2e-6, 0));
            masses.longest_substep().shortest()
        };
        assert_eq!(longest(law, 0), Real::INFINITY);
        let expected = 0.15 * PI * (2e-6 / (2.0 * 3.5 * 1e4_f64)).sqrt();
        let found = longest(law, 1);
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        let softer = LinearSpringDashpot { tangential_stiffness: 1e3, ..law };
        let found = longest(softer, 1);
        assert!((found / (expected * 3.5_f64.sqrt()) - 1.0).abs() < 1e-12, "then by the normal one: {found}");
        let from_the_sub_step = LinearSpringDashpot { tangential_force: TangentialForce::Published, ..law };
        let found = longest(from_the_sub_step, 1);
        assert!((found / expected - 0.057 / 0.15).abs() < 1e-12, "{found} {expected}");
        // Contacts that are damped more have larger errors, and shorter sub-steps.
        let damped = |e: Real| {
            longest(LinearSpringDashpot { damping: Damping::Restitution(e), ..LinearSpringDashpot::SAND }, 1) / expected
        };
        let found = [0.5, 0.1].map(damped);
        assert!((found[0] - 1.0).abs() < 1e-12 && (found[1] - 0.314).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn an_error_that_is_allowed_leaves_damped_contacts_stable() {
        let of = |restitution: Real, allowed: Option<Real>| {
            let law = LinearSpringDashpot {
                damping: Damping::Restitution(restitution),
                friction: 0.3,
                ..LinearSpringDashpot::SAND
            };
            let interactions = Interactions::uniform(1, law).with_allowed_error(allowed);
            let mut masses = EffectiveMasses::new(&interactions);
            masses.add(&Body::ball(1e-3), 1.0, 2e-6, 0);
            let pair = masses.pairs().next().expect("a grain");
            [masses.longest_substep().contact, pair.stable].map(|substep| substep / pair.half_period)
        };
        let [asked, stable] = of(0.2, Some(0.1));
        assert!((0.075..0.09).contains(&stable) && asked <= stable && asked > 0.9 * stable, "{asked} {stable}");
        assert!((of(0.2, None)[0] - 0.075).abs() < 1e-12, "the usual one stays");
        // Negative control: springs that hardly damp bear more.
        let [asked, stable] = of(0.9, Some(0.1));
        assert!((asked - MOST_FACTOR).abs() < 1e-12 && stable > MOST_FACTOR, "{asked} {stable}");
    }

    #[test]
    fn contacts_with_any_dashpot_lose_energy_in_their_sub_steps() {
        // A dashpot as it stands, on ever lighter balls: up to 30 times critical.
        let law = LinearSpringDashpot { normal_stiffness: 1e3, tangential_stiffness: 1e3, ..LinearSpringDashpot::SAND };
        for radius in [3e-4, 1e-4, 4e-5, 2e-5, 1e-5] {
            let mass = 4.0 / 3.0 * PI * 1500.0 * Real::powi(radius, 3);
            let interactions = Interactions::uniform(1, law);
            let mut masses = EffectiveMasses::new(&interactions);
            masses.add(&Body::ball(radius), 1.0, mass, 0);
            let longest = masses.longest_substep();
            let errors = |substep: Real| masses.impact_errors(substep).expect("it moves").restitution.largest;
            assert!(errors(longest.contact) < 0.04, "{radius}: {longest:?} {}", errors(longest.contact));
            // The spin is not as good as usual then, and that is told.
            let spin = masses.impact_errors(longest.contact).expect("it moves").spin.mean;
            assert!(spin < 0.25 && longest.accurate == (spin < USUAL_ERROR), "{radius}: {longest:?} {spin}");
            // Negative control: the sub-step by the spring alone throws fine balls apart faster than they met.
            let of_spring = 0.075 * PI * (mass / (2.0 * 3.5 * 1e3)).sqrt();
            let damping = LinearSpringDashpot::SAND_DASHPOT / (2.0 * (0.5 * mass * 1e3).sqrt());
            assert_eq!(errors(of_spring) > 0.5, damping > 5.0, "{radius}: {damping} {}", errors(of_spring));
            assert_eq!(longest.contact < of_spring, damping > 0.77, "{radius}: {damping}");
        }
    }
}
