//! Mixed-cell residue: liquid fractions within 1e-9 of 0 or 1, and round-off beyond that range.
//!
//! Left alone, residue keeps pure cells on the slow path of interface cells. The liquid of a residue,
//! with its momentum, is moved to the neighbouring interface cell nearest to half full (the receiver);
//! the total is unchanged. Residues without a receiver, which the projection's tolerance leaves inside the liquid and
//! the gas, are shared among all interface cells of the box by their `C (1 - C)`. Where there are none, or too few to take
//! them, they are clipped and their volume reported. A fraction further out of range without a receiver is left and counted.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::GHOSTS;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

/// Fractions nearer to 0 or 1 than this are residue.
pub(crate) const RESIDUE: Real = 1e-9;
/// Larger deviations are never moved: they are errors, and the count must show them.
const LARGEST: Real = 1e-3;
/// Least `C (1 - C)` of a receiver, and the least ratio of that to the residue.
const LEAST_RECEIVER: Real = 1e-6;
const RECEIVER_TO_RESIDUE: Real = 40.0;
/// Largest part of its `C (1 - C)` that an interface cell takes of the residues without a receiver.
const LARGEST_SHARE: Real = 1e-6;

/// Liquid fractions outside the range 0 to 1, or within 1e-9 of its ends, after a transport.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ResidueReport {
    /// Residues moved to interface cells.
    pub moved_cells: u64,
    /// Sum of their volumes without their signs; of those shared among the interface cells of the box only the size of their sum is known [m^3].
    pub moved_volume: Real,
    /// Residues clipped for want of an interface that takes them.
    pub clipped_cells: u64,
    /// Liquid volume added by clipping (negative: removed) [m^3].
    pub clipped_volume: Real,
    /// Momentum added by clipping [N s].
    pub clipped_momentum: Vector,
    /// Cells more than 1e-9 out of range before anything was moved.
    pub out_of_range_cells: u64,
    /// Largest distance from the range 0 to 1.
    pub worst_excess: Real,
}

impl ResidueReport {
    /// Sum of the reports of two sets of cells or of two transports.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            moved_cells: self.moved_cells + other.moved_cells,
            moved_volume: self.moved_volume + other.moved_volume,
            clipped_cells: self.clipped_cells + other.clipped_cells,
            clipped_volume: self.clipped_volume + other.clipped_volume,
            clipped_momentum: self.clipped_momentum + other.clipped_momentum,
            out_of_range_cells: self.out_of_range_cells + other.out_of_range_cells,
            worst_excess: self.worst_excess.max(other.worst_excess),
        }
    }

    /// The report over all ranks.
    fn over_ranks(self, domain: &Domain) -> Self {
        let p = self.clipped_momentum;
        let counts = [self.moved_cells, self.clipped_cells, self.out_of_range_cells].map(|n| n as Real);
        let [moved, clipped, out, moved_volume, clipped_volume, x, y, z] =
            domain.sum([counts[0], counts[1], counts[2], self.moved_volume, self.clipped_volume, p.x, p.y, p.z]);
        Self {
            moved_cells: moved as u64,
            moved_volume,
            clipped_cells: clipped as u64,
            clipped_volume,
            clipped_momentum: Vector::new(x, y, z),
            out_of_range_cells: out as u64,
            worst_excess: domain.max(self.worst_excess),
        }
    }
}

/// New values of a cell.
struct Change {
    at: usize,
    fraction: Real,
    velocity: Option<Vector>,
}

struct PlaneOfChanges {
    changes: Vec<Change>,
    /// Interface cells with their `C (1 - C)`.
    interface: Vec<(usize, Real)>,
    report: ResidueReport,
}

/// What each interface cell gets of the residues without a receiver, per `C (1 - C)`.
#[derive(Default)]
struct Share {
    fraction: Real,
    /// Momentum density [kg/(m^2 s)].
    momentum: Vector,
    density: [Real; 2],
}

impl PlaneOfChanges {
    /// Room for what a plane usually needs: the list seldom grows during a run.
    fn new() -> Self {
        Self { changes: Vec::with_capacity(256), interface: Vec::with_capacity(256), report: ResidueReport::default() }
    }
}

/// Finds residue and moves it to the interface.
#[derive(Default)]
pub(crate) struct Collector {
    planes: Vec<PlaneOfChanges>,
    share: Share,
}

/// Fields to search; all ghosts of `c` and `open` and the first of `u` must be filled.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub c: &'a [Real],
    pub u: [&'a [Real]; 3],
    /// Density is `density[0] + density[1] C` [kg/m^3].
    pub density: [Real; 2],
    /// Open part of the cells, if liquid has only that; cells not wholly open keep their residue.
    pub open: Option<&'a [Real]>,
}

impl View<'_> {
    fn velocity(&self, at: usize) -> Vector {
        Vector::new(self.u[0][at], self.u[1][at], self.u[2][at])
    }

    /// Whether a cell gives and takes residue.
    fn is_open(&self, at: usize) -> bool {
        self.open.is_none_or(|open| open[at] == 1.0)
    }

    /// See [`excess`].
    fn excess(&self, at: usize) -> Option<Real> {
        excess(self.c[at]).filter(|_| self.is_open(at))
    }

    fn density(&self, c: Real) -> Real {
        self.density[0] + self.density[1] * c
    }
}

/// Distance of a residue from a pure cell, positive if there is too much liquid; `None` for other fractions.
fn excess(c: Real) -> Option<Real> {
    if c == 0.0 || c == 1.0 {
        None
    } else if c < RESIDUE {
        Some(c)
    } else if c > 1.0 - RESIDUE {
        Some(c - 1.0)
    } else {
        None
    }
}

impl Collector {
    /// Finds the changes on this rank, and counts over all ranks.
    pub fn find(&mut self, domain: &Domain, view: View<'_>) -> ResidueReport {
        self.planes.resize_with(domain.cells()[2], PlaneOfChanges::new);
        let volume = domain.grid().cell_volume();
        let neighbours = Neighbours::new(domain);
        for_each_chunk(&mut self.planes[..], 1, |k, planes| {
            let PlaneOfChanges { changes, interface, report } = &mut planes[0];
            changes.clear();
            interface.clear();
            *report = ResidueReport::default();
            for j in 0..domain.cells()[1] {
                let start =
                    domain.strides()[2] as usize * (k + GHOSTS) + domain.strides()[1] as usize * (j + GHOSTS) + GHOSTS;
                let row = &view.c[start..start + domain.cells()[0]];
                if row.iter().all(|&c| c == 0.0) || row.iter().all(|&c| c == 1.0) {
                    continue;
                }
                for (i, &c) in row.iter().enumerate() {
                    let cell = [i as isize, j as isize, k as isize];
                    if let Some(e) = view.excess(start + i) {
                        let (change, residue) = neighbours.release(view, cell, start + i, e, volume);
                        changes.extend(change);
                        *report = report.and(residue);
                    } else if c * (1.0 - c) > LEAST_RECEIVER && view.is_open(start + i) {
                        neighbours.receive(view, cell, start + i, changes);
                        interface.push((start + i, c * (1.0 - c)));
                    }
                }
            }
        });
        let report = self.planes.iter().fold(ResidueReport::default(), |sum, plane| sum.and(plane.report));
        let mut report = report.over_ranks(domain);
        let interface = self.planes.iter().flat_map(|plane| &plane.interface).map(|(_, weight)| weight).sum();
        let [interface] = domain.sum([interface]);
        let fraction = -report.clipped_volume / (volume * interface);
        self.share = Share::default();
        if report.clipped_cells > 0 && fraction.abs() <= LARGEST_SHARE {
            let momentum = -report.clipped_momentum / (volume * interface);
            self.share = Share { fraction, momentum, density: view.density };
            report.moved_cells += std::mem::take(&mut report.clipped_cells);
            report.moved_volume += std::mem::take(&mut report.clipped_volume).abs();
            report.clipped_momentum = Vector::ZERO;
        }
        report
    }

    /// Makes the changes found on this rank.
    pub fn apply(&self, c: &mut [Real], u: [&mut [Real]; 3]) {
        let [u1, u2, u3] = u;
        for change in self.planes.iter().flat_map(|plane| &plane.changes) {
            c[change.at] = change.fraction;
            if let Some(v) = change.velocity {
                (u1[change.at], u2[change.at], u3[change.at]) = (v.x, v.y, v.z);
            }
        }
        let Share { fraction, momentum, density } = self.share;
        if fraction == 0.0 && momentum == Vector::ZERO {
            return;
        }
        for &(at, weight) in self.planes.iter().flat_map(|plane| &plane.interface) {
            let before = density[0] + density[1] * c[at];
            c[at] += fraction * weight;
            let after = density[0] + density[1] * c[at];
            for (u, momentum) in [&mut *u1, &mut *u2, &mut *u3].into_iter().zip(momentum.to_array()) {
                u[at] = (before * u[at] + weight * momentum) / after;
            }
        }
    }
}

/// The 26 cells around a cell, those behind walls left out.
struct Neighbours {
    strides: [isize; 3],
    start: [isize; 3],
    cells: [isize; 3],
    periodic: [bool; 3],
}

impl Neighbours {
    fn new(domain: &Domain) -> Self {
        Self {
            strides: domain.strides(),
            start: domain.start().map(|n| n as isize),
            cells: domain.grid().cells.map(|n| n as isize),
            periodic: domain.periodic(),
        }
    }

    /// Offsets from local cell `cell` to its neighbours, always in the same order.
    fn offsets(&self, cell: [isize; 3]) -> impl Iterator<Item = [isize; 3]> + '_ {
        (0..27).filter(|&n| n != 13).map(|n: isize| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]).filter(move |offset| {
            (0..3).all(|d| self.periodic[d] || (0..self.cells[d]).contains(&(cell[d] + self.start[d] + offset[d])))
        })
    }

    fn shift(&self, offset: [isize; 3]) -> isize {
        (0..3).map(|d| offset[d] * self.strides[d]).sum()
    }

    /// The neighbour that receives the residue `e` of `cell`.
    fn receiver(&self, view: View<'_>, cell: [isize; 3], at: usize, e: Real) -> Option<[isize; 3]> {
        let mut best = None;
        let mut most = LEAST_RECEIVER.max(RECEIVER_TO_RESIDUE * e.abs());
        for offset in self.offsets(cell) {
            let beside = (at as isize + self.shift(offset)) as usize;
            let c = view.c[beside];
            if c * (1.0 - c) > most && view.is_open(beside) {
                most = c * (1.0 - c);
                best = Some(offset);
            }
        }
        best
    }

    /// Removes the residue `e` from `cell`: its new value, and the report.
    fn release(
        &self,
        view: View<'_>,
        cell: [isize; 3],
        at: usize,
        e: Real,
        volume: Real,
    ) -> (Option<Change>, ResidueReport) {
        let c = view.c[at];
        let beyond = (-c).max(c - 1.0).max(0.0);
        let mut report = ResidueReport {
            worst_excess: beyond,
            out_of_range_cells: u64::from(beyond > RESIDUE),
            ..ResidueReport::default()
        };
        if e.abs() <= LARGEST && self.receiver(view, cell, at, e).is_some() {
            report.moved_cells = 1;
            report.moved_volume = e.abs() * volume;
        } else if e.abs() <= RESIDUE {
            report.clipped_cells = 1;
            report.clipped_volume = -e * volume;
            report.clipped_momentum = -view.density[1] * e * volume * view.velocity(at);
        } else {
            return (None, report);
        }
        (Some(Change { at, fraction: c - e, velocity: None }), report)
    }

    /// Adds the residues of the neighbours that have `cell` as their receiver.
    fn receive(&self, view: View<'_>, cell: [isize; 3], at: usize, changes: &mut Vec<Change>) {
        let (mut received, mut momentum) = (0.0, Vector::ZERO);
        for offset in self.offsets(cell) {
            let from = (at as isize + self.shift(offset)) as usize;
            let neighbour = std::array::from_fn(|d| cell[d] + offset[d]);
            if let Some(e) = view.excess(from)
                && e.abs() <= LARGEST
                && self.receiver(view, neighbour, from, e) == Some(offset.map(|o| -o))
            {
                received += e;
                momentum += view.density[1] * e * view.velocity(from);
            }
        }
        if received != 0.0 || momentum != Vector::ZERO {
            let c = view.c[at];
            let (before, after) = (view.density(c), view.density(c + received));
            let velocity = (before * view.velocity(at) + momentum) / after;
            changes.push(Change { at, fraction: c + received, velocity: Some(velocity) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sazanami_numerics::domain::GhostRules;
    use sazanami_numerics::grid::Grid;

    #[test]
    fn residue_joins_the_interface_and_nothing_is_lost() {
        let domain = Domain::solo(Grid::new([4, 4, 4], Vector::ZERO, Vector::ONE), [true, false, false]);
        let mut c = domain.field(0.0);
        let mut u = [domain.field(1.0), domain.field(0.0), domain.field(-2.0)];
        c[[0, 1, 1]] = 0.5;
        c[[3, 1, 1]] = 3e-10; // neighbour across the periodic seam
        c[[1, 2, 1]] = -1e-7;
        c[[2, 0, 3]] = 5e-10; // without a receiver: shared
        c[[1, 1, 1]] = 1.0 - 2e-12;
        u[0][[1, 2, 1]] = 5.0;
        for field in [&mut c].into_iter().chain(&mut u) {
            domain.fill_halos(&mut [(field, &GhostRules::EVEN)]);
        }
        let density = [1.0, 999.0];
        let totals = |c: &sazanami_numerics::grid::Field<Real>, u: &[sazanami_numerics::grid::Field<Real>; 3]| {
            domain.sum_rows(&domain.interior(), |row| {
                let range = row.shifted(0);
                let mut sum = [0.0; 4];
                for at in range {
                    sum[0] += c.data()[at];
                    let rho = density[0] + density[1] * c.data()[at];
                    (0..3).for_each(|d| sum[1 + d] += rho * u[d].data()[at]);
                }
                sum
            })
        };
        let before = totals(&c, &u);
        let mut collector = Collector::default();
        let view = View { c: c.data(), u: u.each_ref().map(|f| f.data()), density, open: None };
        let report = collector.find(&domain, view);
        let [u1, u2, u3] = &mut u;
        collector.apply(c.data_mut(), [u1.data_mut(), u2.data_mut(), u3.data_mut()]);
        assert_eq!((report.moved_cells, report.clipped_cells, report.out_of_range_cells), (4, 0, 1));
        assert!((report.worst_excess - 1e-7).abs() < 1e-20);
        let after = totals(&c, &u);
        assert!((after[0] - before[0]).abs() < 1e-15);
        for d in 0..3 {
            assert!((after[1 + d] - before[1 + d]).abs() < 1e-12 * before[1 + d].abs().max(1.0), "{d}");
        }
        assert_eq!((c[[3, 1, 1]], c[[1, 2, 1]], c[[2, 0, 3]], c[[1, 1, 1]]), (0.0, 0.0, 0.0, 1.0));
    }
    #[test]
    fn residue_without_an_interface_is_clipped_and_reported() {
        let domain = Domain::solo(Grid::new([4, 4, 4], Vector::ZERO, Vector::ONE), [false; 3]);
        let mut c = domain.field(1.0);
        let mut u = [domain.field(1.0), domain.field(0.0), domain.field(-2.0)];
        c[[2, 0, 3]] = 1.0 - 5e-10;
        let mut collector = Collector::default();
        let view = View { c: c.data(), u: u.each_ref().map(|f| f.data()), density: [1.0, 999.0], open: None };
        let report = collector.find(&domain, view);
        let [u1, u2, u3] = &mut u;
        collector.apply(c.data_mut(), [u1.data_mut(), u2.data_mut(), u3.data_mut()]);
        let volume = 5e-10 * domain.grid().cell_volume();
        assert_eq!((report.moved_cells, report.clipped_cells, c[[2, 0, 3]]), (0, 1, 1.0));
        assert!((report.clipped_volume / volume - 1.0).abs() < 1e-6);
        assert!(
            (report.clipped_momentum - 999.0 * volume * Vector::new(1.0, 0.0, -2.0)).length() < 1e-6 * volume * 999.0
        );
    }
}
