//! Checks around sub-steps: grains that are lost, and what their new places ask for.

use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;

use super::{EXPIRED, Engine, FINE};
use crate::error::DemError;
use crate::grain::{GrainRecord, Grains};
use crate::selection::first_where;

impl Engine {
    pub(super) fn check_box(&self, domain: &Domain, grains: &[GrainRecord]) -> Result<(), DemError> {
        let size = |r: &GrainRecord| self.bodies[r.shape as usize].bounding_radius * r.scale;
        self.check_film(grains)?;
        let largest = grains.iter().map(size).fold(0.0, Real::max);
        let margin = |r: &GrainRecord| self.interactions.margin(&self.bodies[r.shape as usize], r.scale);
        let needed = Self::shortest_period(largest) + 2.0 * grains.iter().map(margin).fold(0.0, Real::max);
        for direction in 0..3 {
            let length = self.period[direction];
            if domain.periodic()[direction] && length < needed {
                return Err(DemError::BoxTooShort { direction, length, needed });
            }
        }
        Ok(())
    }

    /// Films are for balls, and end above the roughness.
    fn check_film(&self, grains: &[GrainRecord]) -> Result<(), DemError> {
        let Some(film) = self.interactions.film() else { return Ok(()) };
        if !(film.viscosity >= 0.0
            && film.viscosity.is_finite()
            && film.roughness > 0.0
            && film.reach > 0.0
            && film.reach.is_finite()
            && film.farthest > 0.0)
        {
            return Err(DemError::BadFilm { film: *film });
        }
        let fits = |r: &GrainRecord| {
            let body = &self.bodies[r.shape as usize];
            body.is_ball() && film.outer(body.bounding_radius * r.scale) > film.roughness
        };
        grains.iter().find(|r| !fits(r)).map_or(Ok(()), |r| Err(DemError::FilmDoesNotFit { id: r.id, film: *film }))
    }

    pub(super) fn check_finite(&self, domain: &Domain, substep: usize) -> Result<(), DemError> {
        let grains = &self.grains;
        let fine = |g: usize| {
            grains.unwrapped[g].is_finite()
                && grains.velocity[g].is_finite()
                && grains.angular_momentum[g].is_finite()
                && grains.orientation[g].is_finite()
        };
        let outcome = match first_where(grains.owned, |g| !fine(g)) {
            Some(g) => Err(DemError::NotFinite { id: grains.id[g], position: grains.position[g], substep }),
            None => Ok(()),
        };
        domain.agree(outcome)
    }

    /// Places, ownership and ghosts after the last sub-step.
    pub(super) fn finish(&mut self, domain: &Domain) -> Result<(), DemError> {
        self.place();
        let grains = &self.grains;
        let escaped = |g: usize| self.beyond(g).is_some_and(|[d, side]| !self.leave_through[d][side]);
        let outcome = match first_where(grains.owned, escaped) {
            Some(g) => Err(DemError::GrainEscaped { id: grains.id[g], position: grains.position[g] }),
            None => Ok(()),
        };
        domain.agree(outcome)?;
        // Between steps every own entry is the image inside the box, so that sums over grains have one order.
        let returned = self.exchange.return_to_box(domain, &mut self.grains);
        let (rank, (lower, upper)) = (domain.communicator().rank(), domain.rank_box(domain.communicator().rank()));
        let Grains { position, skin, owned, .. } = &self.grains;
        // A grain that is another rank's to own may stay until it has left this part by its skin.
        let slack = |g: usize| if self.owned_promptly { 0.0 } else { skin[g] };
        let strayed = |g: usize| {
            let beyond = (lower - position[g]).max(position[g] - upper);
            beyond.x.max(beyond.y) >= slack(g) && domain.owner_of(position[g]) != rank
        };
        let stays = |g: usize| self.travel[g] <= skin[g] && !strayed(g);
        let within = returned && first_where(*owned, |g| !stays(g)).is_none();
        let state = if within { FINE } else { EXPIRED };
        if Self::worst(domain, state) == EXPIRED { self.renew(domain, true) } else { Ok(()) }
    }
}
