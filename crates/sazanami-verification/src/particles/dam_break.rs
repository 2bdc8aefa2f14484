//! Columns of water that collapse: Martin and Moyce (1952), Lobovsky et al. (2014).

use sazanami_numerics::Real;

use super::vessel::{DENSITY, DOWN, ExperimentError, GRAVITY, OPEN_TOP, PERIODIC, SLAB, Vessel, WALLS};
use super::vessel::{advance, fluid, under};
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::pressure::hydrostatic;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::Solver;
use sazanami_mps::{Kind, Role};

/// Width of the column of Martin and Moyce \[m].
pub const WIDTH: Real = 0.05715;

/// A column of water beside the left wall of a long tank with walls that slip.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Width \[m].
    pub width: Real,
    /// Particles in the width.
    pub across: usize,
    /// Particles in the height.
    pub high: usize,
    /// Length of the tank in spacings.
    pub length: usize,
    /// Enhancements.
    pub scheme: Scheme,
}

/// State of a collapsing column at a time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Collapse {
    /// Time \[s].
    pub time: Real,
    /// Front from the left wall \[m].
    pub front: Real,
    /// Height of the water at the left wall \[m].
    pub height: Real,
    /// Pressure on the right wall one particle above the floor \[Pa].
    pub impact: Real,
    /// Kinetic energy and that of height above the floor \[J].
    pub energy: Real,
}

impl Column {
    fn spacing(&self) -> Real {
        self.width / self.across as Real
    }

    /// The collapse until `end` \[s].
    ///
    /// # Errors
    /// [`ExperimentError`] if a step fails.
    pub fn collapse(&self, end: Real) -> Result<Vec<Collapse>, ExperimentError> {
        let spacing = self.spacing();
        let size = [self.length, SLAB, self.high + 8];
        let fill = [self.across, SLAB, self.high];
        let mut vessel = Vessel::new(size, spacing, [WALLS, PERIODIC, OPEN_TOP]).filled(fill);
        vessel.friction = WallFriction::Slip;
        vessel.scheme = self.scheme;
        let right = vessel.upper.x;
        let mut solver = vessel.solver()?;
        // No pressure is known before the first step.
        let mut series = vec![Collapse { impact: 0.0, ..state(&solver, 0.0, right) }];
        advance(&mut solver, [0.0, end], under(DOWN), |time, solver, _| series.push(state(solver, time, right)))?;
        Ok(series)
    }
}

/// Front, height and impact; particles that fly on their own do not count.
fn state(solver: &Solver, time: Real, right: Real) -> Collapse {
    let particles = solver.particles();
    let spacing = solver.settings().fluid.spacing;
    let [specific] = solver.sum_over_fluid(|p, a| [0.5 * p.velocity[a].length_squared() + GRAVITY * p.position[a].z]);
    let energy = solver.particle_mass() * specific;
    let mut state = Collapse { time, energy, ..Collapse::default() };
    for a in fluid(solver).filter(|&a| particles.role[a] != Role::Inactive) {
        let x = particles.position[a];
        state.front = state.front.max(x.x + 0.5 * spacing);
        // What stands on a strip of two spacings.
        if x.x < 2.0 * spacing {
            state.height += spacing / (2 * SLAB) as Real;
        }
    }
    let (reference, force) = (solver.settings().reference, solver.reduced_force(DOWN));
    let (mut sum, mut count) = (0.0, 0.0);
    for a in (0..particles.owned()).filter(|&a| particles.kind[a] == Kind::Wall) {
        let x = particles.position[a];
        if x.x > right && x.x < right + spacing && x.z > 0.0 && x.z < spacing {
            count += 1.0;
            if particles.role[a] == Role::Unknown {
                sum += particles.pressure[a] + hydrostatic(DENSITY, force, x, reference);
            }
        }
    }
    state.impact = sum / Real::max(count, 1.0);
    state
}

/// `t sqrt(g/length)`.
#[must_use]
pub fn dimensionless(time: Real, length: Real) -> Real {
    time * (GRAVITY / length).sqrt()
}

/// Value of `part` of a series at a time, linear between entries.
#[must_use]
pub fn at(series: &[Collapse], time: Real, part: impl Fn(&Collapse) -> Real) -> Real {
    let after = series.partition_point(|state| state.time < time).clamp(1, series.len() - 1);
    let [a, b] = [&series[after - 1], &series[after]];
    let share = ((time - a.time) / (b.time - a.time)).clamp(0.0, 1.0);
    part(a) + share * (part(b) - part(a))
}

/// Slope of the line that fits points `(x, y)` best.
#[must_use]
pub fn fitted_slope(points: &[[Real; 2]]) -> Real {
    let n = points.len() as Real;
    let [x, y] = [0, 1].map(|d| points.iter().map(|p| p[d]).sum::<Real>() / n);
    let product: Real = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum();
    product / points.iter().map(|p| (p[0] - x).powi(2)).sum::<Real>()
}
