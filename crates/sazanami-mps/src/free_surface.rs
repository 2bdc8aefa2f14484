//! Roles of particles in the pressure equation: free surface, isolated particles, dry walls.

use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;
use sazanami_parallel::for_each_chunk;

use crate::context::Context;
use crate::ghosts::Ghosts;
use crate::matrix::{Block, Row};
use crate::neighbours::ROWS;
use crate::number_density::{NumberDensity, Prediction};
use crate::particles::{Kind, Particles, Role};
use crate::reductions::sum_of;

/// Number of close fluid neighbours below which a particle is isolated.
const FEWEST_NEIGHBOURS: u32 = 5;
/// Whether a particle with this number of fluid neighbours within 2.1 spacings is isolated (spray).
pub(crate) fn is_isolated(neighbour_count: u32) -> bool {
    neighbour_count < FEWEST_NEIGHBOURS
}

/// Sets the role of each particle in the pressure equation from its sums at the predicted position; `numbers` is work
/// space.
pub(crate) fn set_roles(
    step: &Context<'_>,
    particles: &mut Particles,
    predicted: &[Prediction],
    blocks: &[Block],
    ghosts: &mut Ghosts,
    numbers: &mut Vec<u8>,
) {
    let Context { domain, surface, .. } = *step;
    let n0 = step.kernel.sums.number_density;
    let Particles { kind, role, owned, .. } = particles;
    let (kind, owned) = (&kind[..], *owned);
    let isolated = |count: u32| surface.is_some() && is_isolated(count);
    let at_surface =
        |sums: &Prediction| surface.is_some_and(|test| test.is_surface(sums.density / n0, sums.asymmetry / n0));
    numbers.resize(kind.len(), 0);
    for_each_chunk(&mut numbers[..owned], ROWS, |number, numbers| {
        let sums = &predicted[number * ROWS..];
        for ((role, sums), kind) in numbers.iter_mut().zip(sums).zip(&kind[number * ROWS..]) {
            *role = match kind {
                Kind::Fluid if isolated(sums.neighbour_count) => Role::Inactive,
                Kind::Fluid if at_surface(sums) => Role::Dirichlet,
                Kind::Wall if sums.fluid_neighbours == 0 => Role::Inactive,
                Kind::Dummy => Role::Inactive,
                Kind::Fluid | Kind::Wall => Role::Unknown,
            }
            .number();
        }
    });
    share(domain, ghosts, numbers, role);
    // Wall particles beside isolated fluid only are not coupled to any prescribed pressure.
    let known = &role[..];
    for_each_chunk(&mut numbers[..owned], ROWS, |number, numbers| {
        for (row, role) in numbers.iter_mut().enumerate() {
            let a = number * ROWS + row;
            if kind[a] == Kind::Wall && known[a] == Role::Unknown {
                let active = |&b: &u32| kind[b as usize] == Kind::Fluid && known[b as usize] != Role::Inactive;
                if !blocks[number].row(row).0.iter().any(active) {
                    *role = Role::Inactive.number();
                }
            }
        }
    });
    share(domain, ghosts, numbers, role);
}

/// Brings the role numbers of ghosts up to date, and all roles with them.
pub(crate) fn share(domain: &Domain, ghosts: &mut Ghosts, numbers: &mut [u8], role: &mut [Role]) {
    ghosts.refresh(domain, numbers);
    let numbers = &*numbers;
    for_each_chunk(role, ROWS, |number, role| {
        role.iter_mut().zip(&numbers[number * ROWS..]).for_each(|(role, &number)| *role = Role::from_number(number));
    });
}

/// Isolated and surface particles, and the volume strain of the others.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SurfaceReport {
    pub isolated: usize,
    pub surface: usize,
    /// Mean and root mean square away from the surface.
    pub strain: [Real; 2],
}

/// Counts over all ranks; `start` are the sums at the start of the step.
pub(crate) fn report(
    step: &Context<'_>,
    particles: &Particles,
    rows: &[Row],
    start: &[NumberDensity],
) -> SurfaceReport {
    let sums = &step.kernel.sums;
    let counts = sum_of(particles.owned, |a| match particles.role[a] {
        _ if particles.kind[a] != Kind::Fluid => [0.0; 5],
        Role::Inactive => [1.0, 0.0, 0.0, 0.0, 0.0],
        Role::Dirichlet => [0.0, 1.0, 0.0, 0.0, 0.0],
        Role::Unknown if rows[a].beside_surface => [0.0; 5],
        Role::Unknown => {
            let strain = (start[a].density - sums.number_density) / sums.strain;
            [0.0, 0.0, 1.0, strain, strain * strain]
        }
    });
    let [isolated, surface, inner, sum, squares] = step.domain.sum(counts);
    let inner = inner.max(1.0);
    SurfaceReport {
        isolated: isolated as usize,
        surface: surface as usize,
        strain: [sum / inner, (squares / inner).sqrt()],
    }
}
