//! What the engine is told of the fluid about each grain: how viscous it is, for films, and how moist it leaves the grain, for liquid bridges.

use sazanami_dem::Bridge;
use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;
use sazanami_parallel::for_each_chunk;

use super::{BATCH, CouplingState, ResolvedGrains};
use crate::flow::Flow;

/// Weight of the cells that grains fill among those that have what is about a grain: they count where there are no others.
const BURIED: Real = 1e-9;

impl ResolvedGrains {
    /// Tells the engine how viscous the fluid about each grain is, and what of it bridges have: by means over the cells that hold its
    /// surface, by their open parts. Grains are moist as far as liquid has been about them, or as they are found damp, and is not now.
    pub(super) fn wet(&mut self, domain: &Domain, flow: &Flow) {
        let interactions = self.engine.interactions();
        let bridge = interactions.bridge().copied();
        if interactions.film().is_none() && bridge.is_none() {
            return;
        }
        let [gas, liquid] = flow.fluids.viscosities();
        let (alpha, c) = (self.imprint.solid_fraction.data(), flow.volume_fraction.data());
        let imprint = &self.imprint;
        self.partial.resize(self.engine.grains().len(), [0.0; 7]);
        for_each_chunk(&mut self.partial[..], 64, |number, sums| {
            for (offset, sum) in sums.iter_mut().enumerate() {
                let [mut open, mut viscous, mut wet] = [0.0; 3];
                for share in imprint.shares(number * 64 + offset) {
                    let at = share.at as usize;
                    let weight = share.fraction * (1.0 - alpha[at]).max(BURIED);
                    open += weight;
                    let part = c[at].clamp(0.0, 1.0);
                    viscous += weight * (gas + part * (liquid - gas));
                    wet += weight * part;
                }
                *sum = [open, viscous, wet, 0.0, 0.0, 0.0, 0.0];
            }
        });
        self.engine.gather_to_owners(domain, &mut self.partial);
        self.engine.share_with_ghosts(domain, &mut self.partial);
        let sums = &self.partial;
        for_each_chunk(self.engine.wetness_mut(), BATCH, |number, wetness| {
            for (wetness, sum) in wetness.iter_mut().zip(&sums[number * BATCH..]) {
                *wetness = if sum[0] > 0.0 { sum[1] / (sum[0] * liquid) } else { 0.0 };
            }
        });
        if let Some(bridge) = bridge {
            self.moisten(&bridge);
        }
    }

    /// Remembers how wet each grain has been and tells the engine how moist it is, from the sums of [`Self::wet`].
    fn moisten(&mut self, bridge: &Bridge) {
        let sums = &self.partial;
        self.engine.set_moisture(|n, attached| {
            let [open, _, wet, ..] = sums[n];
            let wet = if open > 0.0 { wet / open } else { 0.0 };
            let state: &mut CouplingState = bytemuck::cast_mut(attached);
            state.wetted = state.wetted.max(wet);
            bridge.supplied(state.wetted) * (1.0 - wet)
        });
    }
}
