//! What a round does to its cells.

use sazanami_numerics::geometry::VolumeFractionMethod;
use sazanami_numerics::grid::Grid;

use super::*;
use crate::schemes::Schemes;

const FLUIDS: Fluids = Fluids { liquid_density: 1e3, gas_density: 1.0, liquid_viscosity: 1e-3, gas_viscosity: 1e-5 };

#[test]
fn cells_among_full_ones_take_what_cells_one_by_one_do() {
    let [n1, n2, n3] = [7, 5, 4];
    let domain = Domain::solo(Grid::new([n1, n2, n3], Vector::ZERO, Vector::ONE), [false; 3]);
    let places: Vec<(usize, [isize; 3])> = (0..(n1 * n2 * n3) as isize)
        .map(|n| [n % 7, n / 7 % 5, n / 35])
        .map(|cell| (domain.field(0.0).at(cell[0], cell[1], cell[2]), cell))
        .collect();
    // Rooms, lacks and excesses up to a quarter of a cell, and velocities without any order.
    let random = |n: usize, salt: Real| ((n as Real * 12.9898 + salt).sin() * 43758.5453).fract();
    let mut flow = Flow::new(&domain, FLUIDS, Schemes::default());
    let [mut open, mut excess] = [1.0, 0.0].map(|value| domain.field(value));
    for (n, &(at, _)) in places.iter().enumerate() {
        flow.volume_fraction.data_mut()[at] = FULL;
        open.data_mut()[at] = 0.8 + 0.2 * random(n, 1.0).abs();
        excess.data_mut()[at] = if n % 3 == 0 { 0.0 } else { 1e-2 * random(n, 2.0) };
        (0..3).for_each(|d| flow.velocity[d].data_mut()[at] = random(n, 3.0 + d as Real));
    }
    excess.data_mut()[places[60].0] = -0.25;
    let zero = domain.field(0.0);
    let imprint = Imprint::new([n1, n2, n3], VolumeFractionMethod::Clip);
    let (mut among, mut rates, mut handed) = (AmongFull::new(&domain), domain.field(0.0), vec![0.0; n2 * n3]);
    among.find(&domain, &imprint, &flow.volume_fraction, &open);
    among.hand_on(&domain, true, &excess, &mut rates, &mut handed);
    assert!(places.iter().all(|&(at, _)| among.holds(at)) && handed.iter().all(|&row| row > 0.0));
    // The same cells one by one.
    let (given, before) = (excess.clone(), flow.velocity.clone());
    let cells = Cells {
        open: open.data(),
        alpha: zero.data(),
        fraction: flow.volume_fraction.data(),
        excess: given.data(),
        beyond: &[],
        rates: &[],
        velocity: before.each_ref().map(Field::data),
        solid: [zero.data(); 3],
        faces: [zero.data(); 3],
        strides: domain.strides().map(|stride| stride as usize),
        per_width: Vector::ZERO,
        size: [n1, n2, n3].map(|n| n as isize),
        ends: box_ends(&domain),
        fluids: FLUIDS,
        moved: true,
    };
    let [mut beyond, mut one_by_one] = [0, 1].map(|_| domain.field(0.0));
    for &(at, cell) in places.iter().filter(|(at, _)| goes(given.data()[*at])) {
        beyond.data_mut()[at] = cells.beyond(cell, at);
        let with_beyond = Cells { beyond: beyond.data(), ..cells };
        let sum: Real = cells.neighbours(cell, at).map(|(to, d, above)| with_beyond.weight(at, to, d, above)).sum();
        one_by_one.data_mut()[at] = with_beyond.part(at) * given.data()[at] / sum;
        assert!((one_by_one.data()[at] - rates.data()[at]).abs() < 1e-15, "{cell:?}");
    }
    let cells = Cells { beyond: beyond.data(), rates: one_by_one.data(), ..cells };
    let changes: Vec<Change> = places.iter().filter_map(|&(at, cell)| cells.change(cell, at)).collect();
    assert!(changes.len() > 120);
    among.take(&domain, [&open, &rates], &mut excess, &handed, &mut flow);
    for Change { at, excess: x, velocity, .. } in changes {
        let found = Vector::from_array([0, 1, 2].map(|d| flow.velocity[d].data()[at]));
        assert!((excess.data()[at] - x).abs() < 1e-14, "{at}: {} {x}", excess.data()[at]);
        assert!((found - velocity).length() < 1e-11 * (1.0 + velocity.length()), "{at}: {found} {velocity}");
    }
    // Control: the round has moved something.
    assert!(places.iter().any(|&(at, _)| (excess.data()[at] - given.data()[at]).abs() > 1e-3));
}

#[test]
fn rows_without_cells_among_full_ones_keep_no_rates() {
    let domain = Domain::solo(Grid::new([4, 3, 3], Vector::ZERO, Vector::ONE), [false; 3]);
    let [gas, mut excess, mut rates] = [0.0; 3].map(|value| domain.field(value));
    let open = domain.field(1.0);
    let imprint = Imprint::new([4, 3, 3], VolumeFractionMethod::Clip);
    let (mut among, mut handed) = (AmongFull::new(&domain), vec![0.0; 9]);
    among.find(&domain, &imprint, &gas, &open);
    let (here, there) = (excess.at(2, 1, 1), excess.at(1, 2, 0));
    excess.data_mut()[here] = 0.1;
    let mut left = |rates_before: [Real; 2], handed_before: [Real; 2], first: bool| {
        rates.data_mut()[here] = rates_before[0];
        rates.data_mut()[there] = rates_before[1];
        (handed[3 + 1], handed[2]) = handed_before.into();
        among.hand_on(&domain, first, &excess, &mut rates, &mut handed);
        assert!(handed.iter().all(|&row| row == 0.0));
        [rates.data()[here], rates.data()[there]]
    };
    // Of earlier rounds in the first round, of the round before in others.
    assert_eq!(left([0.3, 0.2], [0.0, 0.0], true), [0.0, 0.0]);
    assert_eq!(left([0.3, 0.2], [0.1, 0.1], false), [0.0, 0.0]);
    // Control: rows that the round before left alone are not looked at.
    assert_eq!(left([0.3, 0.2], [0.1, 0.0], false), [0.0, 0.2]);
}

#[test]
fn a_cell_with_hardly_any_mass_does_not_leap_away() {
    let fluids = FLUIDS;
    let entering = 1e-6;
    // Two cells of gas; the first lacks as much liquid as it weighs, and gets a little of the second, which is fast.
    for (alpha, weighs) in [(0.0, 0.0), (0.0, 1e-12), (0.0, -1e-3), (0.0, 0.9), (0.1, 0.0)] {
        let lacking = (weighs - 1.0) / (fluids.liquid_density - fluids.gas_density) - entering;
        let (excess, zero) = ([lacking, entering], [0.0; 2]);
        let cells = Cells {
            open: &[1.0; 2],
            alpha: &[alpha, 0.0],
            fraction: &zero,
            excess: &excess,
            beyond: &zero,
            rates: &zero,
            velocity: [&[0.0, 2.0], &zero, &zero],
            solid: [&zero; 3],
            faces: [&zero; 3],
            strides: [1, 2, 2],
            per_width: Vector::ZERO,
            size: [2, 1, 1],
            ends: [[true; 2]; 3],
            fluids,
            moved: false,
        };
        let rates = [0.0, entering / cells.weight(1, 0, 0, false)];
        let change = Cells { rates: &rates, ..cells }.change([0; 3], 0).expect("liquid enters");
        let impulse = 999.0 * entering * 2.0;
        let mass = 1.0 + 999.0 * change.excess;
        assert!((mass - weighs).abs() < 1e-12 && change.velocity.x.abs() < 2.5 * impulse, "{weighs}: {mass}");
        // What the cell does not take is told: all of it, where it has no mass.
        assert!((mass * change.velocity.x + change.given.x - impulse).abs() < 1e-15, "{}", change.given);
        assert_eq!(change.given.x == 0.0, weighs == 0.9);
    }
}
