//! Liquid and gas: boundaries, properties, schemes, and where liquid is at first.

use sazanami_numerics::{Real, Vector};

use crate::case::written::choices;

/// Names of the sides of the box, `SIDE_NAMES[direction][0 lower, 1 upper]`.
pub const SIDE_NAMES: [[&str; 2]; 3] = [["x1_lower", "x1_upper"], ["x2_lower", "x2_upper"], ["x3_lower", "x3_upper"]];

choices! {
    /// Which of the two fluids.
    FluidName {
        /// The heavier one.
        Liquid = "liquid",
        /// The lighter one.
        Gas = "gas",
    }

    /// Transport of the liquid's volume.
    VofScheme {
        /// Planes in cells, exactly conserving split fluxes.
        Plic = "plic",
        /// Hyperbolic tangents in cells, weighted by the normal.
        ThincWlic = "thinc_wlic",
        /// Hyperbolic tangents in cells with a slope by the normal.
        ThincSw = "thinc_sw",
    }

    /// Form of the convection of momentum.
    Convection {
        /// Momentum carried with the same mass fluxes as the liquid.
        Consistent = "consistent",
        /// Velocity carried as such, Yagyu et al. (2015), eq. (3).
        VelocityForm = "velocity_form",
    }

    /// Limiter of the slopes in the convection.
    Limiter {
        /// Van Leer's.
        VanLeer = "van_leer",
        /// The smaller of the two slopes.
        Minmod = "minmod",
        /// None: central slopes, for convergence tests in smooth flow.
        None = "none",
    }

    /// Projection onto divergence-free velocities.
    Projection {
        /// The whole pressure every step.
        Full = "full",
        /// The pressure's increment (single-phase flow, second order in time).
        Incremental = "incremental",
    }

    /// Treatment of viscosity.
    ViscosityScheme {
        /// Backward Euler.
        Implicit = "implicit",
        /// The mean of forward and backward Euler: second order in time.
        CrankNicolson = "crank_nicolson",
        /// Forward Euler, which limits the step.
        Explicit = "explicit",
        /// None: inviscid fluids.
        Off = "off",
    }

    /// What grains get back of the momentum that the fluid loses to them.
    Exchange {
        /// All of it, one step later.
        Exact = "exact",
        /// The stress integral alone.
        Stress = "stress",
    }

    /// Weight of the grain's velocity in a cell it shares with fluid.
    Weighting {
        /// By mass.
        Mass = "mass",
        /// By volume.
        Volume = "volume",
    }

    /// Arm of the fluid's forces on a grain.
    TorqueArm {
        /// Centroid of the covered part of the cell.
        Centroid = "centroid",
        /// Centre of the cell.
        Cell = "cell",
    }

    /// Initial velocity in a cell that liquid fills in part.
    DropVelocity {
        /// Mass-weighted: carries the liquid's momentum.
        Mass = "mass",
        /// Velocity times volume fraction, as Yagyu et al. (2015).
        Beta = "beta",
    }
}

/// Physics of one side of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BoundarySide {
    /// Wall that holds the fluid.
    NoSlip,
    /// Wall without friction.
    Slip,
    /// Wall that moves in its own plane with `velocity` [m/s].
    Moving {
        /// Velocity [m/s].
        velocity: Vector,
    },
    /// Joined to the opposite side.
    Periodic,
    /// Fluid enters with `velocity` [m/s].
    Inflow {
        /// Velocity [m/s].
        velocity: Vector,
        /// Which fluid enters.
        fluid: FluidName,
    },
    /// Fluid leaves freely; pressure zero, and gas comes back in if any does.
    Outflow,
    /// Fluid enters or leaves as the pressure [Pa] has it.
    FixedPressure {
        /// Pressure [Pa].
        pressure: Real,
        /// Which fluid comes back in.
        fluid: FluidName,
    },
}

/// Acceleration of the frame of reference [m/s^2].
pub type Acceleration = Vector;

/// An oscillating part of the frame's acceleration: `amplitude sin(2 pi frequency t + phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oscillation {
    /// Amplitude [m/s^2].
    pub amplitude: Acceleration,
    /// Frequency [Hz].
    pub frequency: Real,
    /// Phase [rad].
    pub phase: Real,
}

/// Motion of the frame of reference without rotation.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Constant acceleration [m/s^2].
    pub acceleration: Acceleration,
    /// Oscillating acceleration, if there is one.
    pub oscillation: Option<Oscillation>,
    /// Displacement of the tank, if it has one.
    pub motion: Option<super::TankMotion>,
    /// Where that motion is seen from.
    pub walls: super::WallMotion,
}

impl Frame {
    /// Acceleration of the frame at `time` [m/s^2].
    #[must_use]
    pub fn acceleration_at(&self, time: Real) -> Acceleration {
        let oscillating = self
            .oscillation
            .map_or(Vector::ZERO, |o| o.amplitude * (std::f64::consts::TAU * o.frequency * time + o.phase).sin());
        let moved = match (&self.motion, self.walls) {
            (Some(motion), super::WallMotion::AtRest) => motion.at(time)[2],
            _ => Acceleration::ZERO,
        };
        self.acceleration + oscillating + moved
    }
}

/// Properties of a fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    /// Density [kg/m^3].
    pub density: Real,
    /// Dynamic viscosity [Pa s].
    pub viscosity: Real,
}

/// The two fluids.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluids {
    /// The heavier one.
    pub liquid: Fluid,
    /// The lighter one.
    pub gas: Fluid,
}

/// Choice of the time step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// The same length always [s]; the fluid makes several passes where its limits ask for it.
    Fixed(Real),
    /// As long as the limits allow.
    Adaptive {
        /// Longest step [s].
        longest: Real,
        /// First step [s].
        first: Real,
        /// Largest ratio of a step to the one before.
        growth: Real,
    },
}

/// How the fluids are computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidOptions {
    /// Transport of the liquid.
    pub vof: VofScheme,
    /// Form of the convection.
    pub convection: Convection,
    /// Limiter of its slopes.
    pub limiter: Limiter,
    /// Projection.
    pub projection: Projection,
    /// Treatment of viscosity.
    pub viscosity: ViscosityScheme,
    /// Time step.
    pub step: Step,
    /// Largest sum of Courant numbers in a fluid pass.
    pub cfl: Real,
    /// Largest `|div u| dt` left by the projection.
    pub divergence_tolerance: Real,
    /// Most iterations of the pressure solver.
    pub pressure_iterations: usize,
}

/// Evaluator of the grains' volume fractions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlphaMethod {
    /// Vertical columns, so many per cell and direction, exact along the column.
    Columns(u8),
    /// Sub-cells, so many per direction.
    SubCells(u8),
    /// Exact clipping of tetrahedra by cells.
    Clip,
}

/// How fluids and grains act on each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// What grains get back of the fluid's loss.
    pub exchange: Exchange,
    /// Weight of the grain's velocity in shared cells.
    pub weighting: Weighting,
    /// Evaluator of the volume fractions.
    pub alpha: AlphaMethod,
    /// Arm of the forces.
    pub torque_arm: TorqueArm,
}

/// A body of liquid (or a bubble) made of primitives, all lengths [m].
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// A box.
    Box {
        /// Lower corner [m].
        lower: Vector,
        /// Upper corner [m].
        upper: Vector,
    },
    /// A sphere.
    Sphere {
        /// Centre [m].
        centre: Vector,
        /// Diameter [m].
        diameter: Real,
    },
    /// A spheroid about the vertical.
    Spheroid {
        /// Centre [m].
        centre: Vector,
        /// Diameter across [m].
        horizontal_diameter: Real,
        /// Diameter along the vertical [m].
        vertical_diameter: Real,
    },
    /// All behind a plane.
    HalfSpace {
        /// A point of the plane [m].
        point: Vector,
        /// Unit normal, out of the region.
        normal: Vector,
    },
    /// Whatever one of several regions holds.
    Union(Vec<Region>),
}

impl Region {
    /// Whether the region holds the point `x` [m].
    #[must_use]
    pub fn contains(&self, x: Vector) -> bool {
        match self {
            Self::Box { lower, upper } => x.cmpge(*lower).all() && x.cmple(*upper).all(),
            Self::Sphere { centre, diameter } => (x - centre).length() <= 0.5 * diameter,
            Self::Spheroid { centre, horizontal_diameter, vertical_diameter } => {
                let scale = Vector::new(*horizontal_diameter, *horizontal_diameter, *vertical_diameter) * 0.5;
                ((x - centre) / scale).length() <= 1.0
            }
            Self::HalfSpace { point, normal } => (x - point).dot(*normal) <= 0.0,
            Self::Union(regions) => regions.iter().any(|region| region.contains(x)),
        }
    }

    /// The region moved by `shift` [m].
    #[must_use]
    pub fn moved(&self, shift: Vector) -> Self {
        match self {
            Self::Box { lower, upper } => Self::Box { lower: *lower + shift, upper: *upper + shift },
            Self::Sphere { centre, diameter } => Self::Sphere { centre: *centre + shift, diameter: *diameter },
            Self::Spheroid { centre, horizontal_diameter, vertical_diameter } => Self::Spheroid {
                centre: *centre + shift,
                horizontal_diameter: *horizontal_diameter,
                vertical_diameter: *vertical_diameter,
            },
            Self::HalfSpace { point, normal } => Self::HalfSpace { point: *point + shift, normal: *normal },
            Self::Union(regions) => Self::Union(regions.iter().map(|region| region.moved(shift)).collect()),
        }
    }

    /// Lowest and highest height of the region [m]; infinite for half-spaces that are not horizontal.
    #[must_use]
    pub fn heights(&self) -> [Real; 2] {
        match self {
            Self::Box { lower, upper } => [lower.z, upper.z],
            Self::Sphere { centre, diameter } => [centre.z - 0.5 * diameter, centre.z + 0.5 * diameter],
            Self::Spheroid { centre, vertical_diameter, .. } => {
                [centre.z - 0.5 * vertical_diameter, centre.z + 0.5 * vertical_diameter]
            }
            Self::HalfSpace { point, normal } => {
                let level = normal.x == 0.0 && normal.y == 0.0;
                [
                    if level && normal.z < 0.0 { point.z } else { Real::NEG_INFINITY },
                    if level && normal.z > 0.0 { point.z } else { Real::INFINITY },
                ]
            }
            Self::Union(regions) => regions
                .iter()
                .map(Self::heights)
                .fold([Real::INFINITY, Real::NEG_INFINITY], |[low, high], [l, h]| [low.min(l), high.max(h)]),
        }
    }

    /// Exact volume [m^3], where it has a formula.
    #[must_use]
    pub fn volume(&self) -> Option<Real> {
        let sixth = std::f64::consts::PI / 6.0;
        match self {
            Self::Box { lower, upper } => {
                let edges = *upper - *lower;
                Some(edges.x * edges.y * edges.z)
            }
            Self::Sphere { diameter, .. } => Some(sixth * diameter.powi(3)),
            Self::Spheroid { horizontal_diameter, vertical_diameter, .. } => {
                Some(sixth * horizontal_diameter.powi(2) * vertical_diameter)
            }
            Self::HalfSpace { .. } | Self::Union(_) => None,
        }
    }
}

/// Where a region is put.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placement {
    /// The region's origin comes to this point [m].
    Absolute(Vector),
    /// Above the highest point H_s of the bed in use, near the axis of the box.
    AboveBed {
        /// Height above H_s [m] of the region's origin (`to_bottom` false) or of its lowest point (true).
        height: Real,
        /// Whether the height is that of the lowest point.
        to_bottom: bool,
        /// Offset from the axis in x1 and x2 [m].
        offset: [Real; 2],
    },
}

/// A body of liquid (or a bubble) at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct LiquidRegion {
    /// Name for messages and results.
    pub name: String,
    /// Which fluid fills it. Later regions overwrite earlier ones.
    pub fluid: FluidName,
    /// Its shape about its origin.
    pub region: Region,
    /// Where its origin is put.
    pub placement: Placement,
    /// Velocity [m/s].
    pub velocity: Vector,
    /// Velocity in cells that it fills in part.
    pub drop_velocity: DropVelocity,
    /// Whether it may touch grains at the start.
    pub allow_touching_grains: bool,
}
