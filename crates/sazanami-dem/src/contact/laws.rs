//! The list of contact models, and the laws of all pairs of materials.

use sazanami_numerics::Real;

use super::context::Reach;
use super::force::PairConstants;
use super::linear_spring_dashpot::LinearSpringDashpot;
use super::model::ContactModel;
use crate::bridge::Bridge;
use crate::film::Film;
use crate::material::ContactOptions;

/// Work that is compiled for each contact model.
pub(crate) trait ForModel {
    /// Result of the work.
    type Output;

    /// Does the work with the constants of all laws, by [`Interactions::index`].
    fn run<M: ContactModel>(self, laws: &[PairConstants<M>]) -> Self::Output;
}

macro_rules! contact_models {
    ($($(#[$about:meta])+ $Model:ident;)+) => {
        /// The contact law of a pair of materials.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum ContactLaw {
            $($(#[$about])+ $Model($Model),)+
        }

        $(impl From<$Model> for ContactLaw {
            fn from(law: $Model) -> Self {
                Self::$Model(law)
            }
        })+

        impl std::fmt::Display for ContactLaw {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                match self {
                    $(Self::$Model(law) => law.fmt(f),)+
                }
            }
        }

        impl ContactLaw {
            /// Friction and the other parameters that all laws have.
            #[must_use]
            pub fn options(&self) -> ContactOptions {
                match self {
                    $(Self::$Model(law) => law.options(),)+
                }
            }

            /// Largest normal and tangential stiffness of contacts of effective radius up to `radius` \[m], at any overlap
            /// that a run is meant to reach [N/m].
            #[must_use]
            pub fn stiffness(&self, radius: Real) -> [Real; 2] {
                match self {
                    $(Self::$Model(law) => law.stiffness(radius),)+
                }
            }

            /// Largest normal and tangential dashpot of contacts of grains of reduced mass `mass` \[kg] [N s/m].
            #[must_use]
            pub fn damping(&self, mass: Real) -> [Real; 2] {
                match self {
                    $(Self::$Model(law) => law.damping(mass),)+
                }
            }

            /// Coefficient of restitution of a central impact of two grains of reduced mass `mass` \[kg].
            #[must_use]
            pub fn restitution(&self, mass: Real) -> Real {
                match self {
                    $(Self::$Model(law) => law.restitution(mass),)+
                }
            }

            /// Whether dashpots are proportional to the square root of the reduced mass.
            pub(crate) fn damped_by_mass(&self) -> bool {
                match self {
                    $(Self::$Model(law) => law.damped_by_mass(),)+
                }
            }

            /// The same law with its friction coefficient times `factor`.
            #[must_use]
            pub fn with_friction_times(mut self, factor: Real) -> Self {
                match &mut self {
                    $(Self::$Model(law) => law.scale_friction(factor),)+
                }
                self
            }

            /// The same law with its stiffness times `factor`, and the same restitution.
            #[must_use]
            pub fn with_stiffness_times(mut self, factor: Real) -> Self {
                match &mut self {
                    $(Self::$Model(law) => law.scale_stiffness(factor),)+
                }
                self
            }
        }

        /// The constants of all laws of a run, by [`Interactions::index`].
        #[derive(Debug)]
        pub(crate) enum LawTable {
            $($Model(Vec<PairConstants<$Model>>),)+
        }

        impl LawTable {
            /// The constants of the laws of `interactions`, which are of one model.
            pub fn new(interactions: &Interactions) -> Self {
                let laws = &interactions.laws[..];
                match laws.first() {
                    $(Some(ContactLaw::$Model(_)) => Self::$Model(
                        laws.iter()
                            .filter_map(|law| match law {
                                ContactLaw::$Model(law) => Some(PairConstants::new(law, interactions.film, interactions.bridge)),
                                #[allow(unreachable_patterns, reason = "there may be one model only")]
                                _ => None,
                            })
                            .collect(),
                    ),)+
                    None => Self::LinearSpringDashpot(Vec::new()),
                }
            }

            /// Does work with the laws.
            pub fn run<J: ForModel>(&self, job: J) -> J::Output {
                match self {
                    $(Self::$Model(laws) => job.run(laws),)+
                }
            }

            /// Elastic energy of the normal and of the tangential spring of a contact; see [`ContactModel::energy`].
            pub fn energy(&self, law: usize, overlap: Real, stretch: Real, radii: [Real; 2]) -> [Real; 2] {
                match self {
                    $(Self::$Model(laws) => $Model::energy(&laws[law].model, overlap, stretch, radii),)+
                }
            }
        }
    };
}

contact_models! {
    /// Linear spring and dashpot.
    LinearSpringDashpot;
}

impl ContactLaw {
    fn same_model(&self, other: &Self) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other)
    }
}

/// The contact laws of all pairs of materials. Walls are made of a material too.
#[derive(Clone, Debug, PartialEq)]
pub struct Interactions {
    materials: usize,
    laws: Vec<ContactLaw>,
    /// Dashpots of each law at a unit of reduced mass: with a coefficient of restitution they take an iteration to find.
    dashpots: Vec<[Real; 2]>,
    film: Option<Film>,
    bridge: Option<Bridge>,
    allowed_error: Option<Real>,
}

impl Interactions {
    /// The same law between all of `materials` materials.
    #[must_use]
    pub fn uniform(materials: usize, law: impl Into<ContactLaw>) -> Self {
        let (law, count) = (law.into(), materials * materials);
        Self {
            materials,
            laws: vec![law; count],
            dashpots: vec![law.damping(1.0); count],
            film: None,
            bridge: None,
            allowed_error: None,
        }
    }

    /// The same laws with a liquid film between spheres that do not touch, or without.
    #[must_use]
    pub fn with_film(self, film: Option<Film>) -> Self {
        Self { film, ..self }
    }

    /// The same laws with liquid bridges between balls, or without.
    #[must_use]
    pub fn with_bridge(self, bridge: Option<Bridge>) -> Self {
        Self { bridge, ..self }
    }

    /// The same laws with sub-steps as long as this mean error of restitution and spin lets them be, or as usual
    /// (see [`crate::stability`]).
    #[must_use]
    pub fn with_allowed_error(self, allowed_error: Option<Real>) -> Self {
        Self { allowed_error, ..self }
    }

    /// Mean error of restitution and spin that sub-steps may bring.
    #[must_use]
    pub fn allowed_error(&self) -> Option<Real> {
        self.allowed_error
    }

    /// The liquid film between spheres.
    #[must_use]
    pub fn film(&self) -> Option<&Film> {
        self.film.as_ref()
    }

    /// The liquid bridges between balls.
    #[must_use]
    pub fn bridge(&self) -> Option<&Bridge> {
        self.bridge.as_ref()
    }

    /// Gap up to which spheres may act on each other.
    pub(crate) fn reach(&self) -> Reach {
        let film = self.film.map_or([0.0; 2], |film| [film.reach, film.farthest]);
        match self.bridge {
            Some(bridge) => Reach { over_radius: bridge.reach().max(film[0]), farthest: Real::INFINITY },
            None => Reach { over_radius: film[0], farthest: film[1] },
        }
    }

    /// Whether every choice is the usual one, for which shorter formulas suffice.
    pub(crate) fn plain(&self) -> bool {
        self.film.is_none() && self.bridge.is_none() && self.laws.iter().all(|law| law.options().plain())
    }

    /// Sets the law between two materials.
    ///
    /// # Panics
    /// If there is no such material, or if the law is of another model than those there are.
    pub fn set(&mut self, a: u32, b: u32, law: impl Into<ContactLaw>) {
        let law = law.into();
        assert!(self.laws.iter().all(|known| known.same_model(&law)), "all contact laws of a run are of one model");
        for (a, b) in [(a, b), (b, a)] {
            let at = self.index(a, b);
            self.laws[at as usize] = law;
            self.dashpots[at as usize] = law.damping(1.0);
        }
    }

    /// The law between two materials.
    #[must_use]
    pub fn law(&self, a: u32, b: u32) -> &ContactLaw {
        &self.laws[self.index(a, b) as usize]
    }

    /// Normal and tangential dashpot by law `index` of grains of reduced mass `mass` \[kg] [N s/m].
    pub(crate) fn dashpots(&self, index: usize, mass: Real) -> [Real; 2] {
        let root = if self.laws[index].damped_by_mass() { mass.sqrt() } else { 1.0 };
        self.dashpots[index].map(|dashpot| root * dashpot)
    }

    /// Number of materials.
    #[must_use]
    pub fn materials(&self) -> usize {
        self.materials
    }

    pub(crate) fn index(&self, a: u32, b: u32) -> u32 {
        a * self.materials as u32 + b
    }

    /// All laws, by [`Self::index`].
    pub(crate) fn laws(&self) -> &[ContactLaw] {
        &self.laws
    }

    /// Changes every stiffness by a factor; restitution stays as it is.
    pub fn scale_stiffness(&mut self, factor: Real) {
        self.laws.iter_mut().for_each(|law| *law = law.with_stiffness_times(factor));
    }

    /// The least normal stiffness of any pair, between grains of effective radius up to `radius` \[m] [N/m].
    #[must_use]
    pub fn least_stiffness(&self, radius: Real) -> Real {
        self.laws.iter().map(|law| law.stiffness(radius)[0]).fold(Real::INFINITY, Real::min)
    }

    /// Changes every friction coefficient by a factor.
    pub fn scale_friction(&mut self, factor: Real) {
        self.laws.iter_mut().for_each(|law| *law = law.with_friction_times(factor));
    }
}
