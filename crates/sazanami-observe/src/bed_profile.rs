//! The state of a bed: height at the axis, porosity, motion, orientation.

use std::ops::Range;

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{max_over, sum_over};

use crate::{BedView, Body, Ground, Horizontal};

/// Highest node \[m] of the grains within `radius` \[m] of the vertical through `axis`, `H_s` of the paper, or the highest surface on the axis where that
/// is higher: faces wider than the radius have their nodes farther off, and nodes of buried grains may lie nearer.
///
/// `None` if no grain is there.
#[must_use]
pub fn height_near(bed: &BedView, ground: &Ground, axis: Horizontal, radius: Real) -> Option<Real> {
    let way = |node: Vector| ground.from_axis(axis, node);
    let near = |node: &Vector| way(*node)[0].hypot(way(*node)[1]) <= radius;
    let highest = |grain| bed.nodes_of(grain).filter(near).fold(Real::NEG_INFINITY, |top, node| top.max(node.z));
    let on_axis = ground.seen_from(axis, bed, |bed| max_over(bed.len(), |grain| surface_over(bed, grain, axis)));
    Some(max_over(bed.len(), highest).max(on_axis)).filter(|&top| top > Real::NEG_INFINITY)
}

/// Height \[m] of the highest surface of a grain over a point; negative infinity beside it.
fn surface_over(bed: &BedView, grain: usize, [x, y]: Horizontal) -> Real {
    let (body, centre, scale) = (bed.body_of(grain), bed.position[grain], bed.scale[grain]);
    let square = ((x - centre.x).powi(2) + (y - centre.y).powi(2)) / (scale * scale);
    if body.nodes.iter().all(|node| node.length_squared() < square) {
        return Real::NEG_INFINITY;
    }
    let nodes: Vec<Vector> = bed.nodes_of(grain).collect();
    let height = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|n| nodes[n as usize]);
        let twice_area = |p: Vector, q: Vector, r: [Real; 2]| (q.x - p.x) * (r[1] - p.y) - (q.y - p.y) * (r[0] - p.x);
        let parts = [twice_area(b, c, [x, y]), twice_area(c, a, [x, y]), twice_area(a, b, [x, y])];
        let whole = twice_area(a, b, [c.x, c.y]);
        let is_over = whole > 0.0 && parts.iter().all(|&part| part >= 0.0);
        is_over.then(|| (parts[0] * a.z + parts[1] * b.z + parts[2] * c.z) / whole)
    };
    body.triangles.iter().filter_map(height).fold(Real::NEG_INFINITY, Real::max)
}

/// Share of void in the slab `heights` \[m] over a floor of `area` [m^2], exactly from the surfaces of
/// the grains; where grains overlap both count.
#[must_use]
pub fn porosity_of_grains(bed: &BedView, heights: Range<Real>, area: Real) -> Real {
    let within = |grain| volume_below(bed, grain, heights.end) - volume_below(bed, grain, heights.start);
    let [solid] = sum_over(bed.len(), |grain| [within(grain)]);
    1.0 - solid / (area * (heights.end - heights.start))
}

/// Volume [m^3] of the part of a grain below the height `level` \[m].
///
/// Over each point of the plane the solid thickness below the level is the sum of `min(x3, level)`
/// over the surface above that point, positive where the surface faces up and negative where it
/// faces down; integrated over the plane, triangle by triangle.
#[must_use]
pub fn volume_below(bed: &BedView, grain: usize, level: Real) -> Real {
    let Body { nodes, triangles, .. } = *bed.body_of(grain);
    let (centre, turn, scale) = (bed.position[grain], bed.orientation[grain], bed.scale[grain]);
    let height_above_level = |corner: Vector| (centre + turn * (corner * scale)).z - level;
    let mut volume = 0.0;
    for triangle in triangles {
        let corners = triangle.map(|n| nodes[n as usize]);
        let normal = turn * (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let projected_area = 0.5 * normal.z * scale * scale;
        volume += projected_area * mean_below_zero(corners.map(height_above_level));
    }
    volume
}

/// Mean of `min(z, 0)` over a triangle with the heights `z` at its corners.
fn mean_below_zero(mut z: [Real; 3]) -> Real {
    z.sort_by(Real::total_cmp);
    let [a, b, c] = z;
    if c <= 0.0 {
        (a + b + c) / 3.0
    } else if a >= 0.0 {
        0.0
    } else if b >= 0.0 {
        // Only the tip at `a` is below: a triangle with two corners at height 0.
        a / 3.0 * (a / (a - b)) * (a / (a - c))
    } else {
        // Only the tip at `c` is above: take away what it would add.
        (a + b + c) / 3.0 - c / 3.0 * (c / (c - a)) * (c / (c - b))
    }
}

/// Speeds of the grains of a bed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Mean of the grains' speeds [m/s].
    pub mean_speed: Real,
    /// Largest speed [m/s].
    pub largest_speed: Real,
}

/// Motion of all grains, each with the same weight; zero without grains.
#[must_use]
pub fn motion(bed: &BedView) -> Motion {
    let count = bed.len().max(1) as Real;
    let velocity = bed.velocity;
    let [speeds] = sum_over(bed.len(), |grain| [velocity[grain].length()]);
    Motion { mean_speed: speeds / count, largest_speed: max_over(bed.len(), |grain| velocity[grain].length()).max(0.0) }
}

/// Orientation of the long axes against the vertical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// Nematic order parameter about the vertical, the mean of `(3 cos^2 theta - 1)/2`: 1 upright, 0 at
    /// random, -1/2 all lying.
    pub vertical_order: Real,
    /// The same read as flatness, `-2` times it: 1 all lying, 0 at random, -2 upright.
    pub lying_order: Real,
    /// Number of grains that have a long axis.
    pub grains: usize,
}

/// Orientation of the grains that have a long axis; `None` if there are none.
#[must_use]
pub fn orientation(bed: &BedView) -> Option<Orientation> {
    let [count, squares] = sum_over(bed.len(), |grain| {
        let long_axis = bed.body_of(grain).long_axis;
        long_axis.map_or([0.0; 2], |axis| [1.0, (bed.orientation[grain] * axis).z.powi(2)])
    });
    let vertical_order = 1.5 * squares / count - 0.5;
    (count > 0.0).then(|| Orientation { vertical_order, lying_order: -2.0 * vertical_order, grains: count as usize })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use sazanami_numerics::Quaternion;

    use super::*;
    use crate::bed::test_bed::{Bed, icosahedron};

    #[test]
    fn the_highest_node_near_the_axis_is_found() {
        let bed = Bed::columns(0.5, 5.0, 2, |r| 3.0 - 0.1 * r);
        bed.view(|view| {
            let ground = Ground { lower: [-5.0; 2], upper: [5.0; 2], periodic: [false; 2] };
            let near = height_near(view, &ground, [2.0, 0.0], 0.6).unwrap();
            let exact = 3.0 - 0.1 * (1.75_f64.hypot(0.25));
            assert!((near - exact).abs() < 1e-12, "{near} {exact}");
            assert_eq!(height_near(view, &ground, [9.0, 0.0], 0.6), None);
            // Nearer than any node, the surface on the axis, which lies below the highest node by the shape of the grain.
            let place = [2.25, 0.25];
            let over = height_near(view, &ground, place, 1e-6).unwrap();
            assert!(over > 2.0 && over <= height_near(view, &ground, place, 0.3).unwrap(), "{over}");
            // Beyond a seam it is the other end of the box.
            let repeats = Ground { periodic: [true, false], ..ground };
            assert_eq!(height_near(view, &repeats, [9.0, 0.0], 0.6), height_near(view, &repeats, [-1.0, 0.0], 0.6));
        });
    }

    #[test]
    fn a_face_hides_the_nodes_below_it() {
        // The grain below has a node under the face of the one above, whose own are farther off.
        let beside = icosahedron(Vector::splat(2.0))
            .0
            .iter()
            .map(|node| node.y)
            .fold(Real::INFINITY, |least, y| if y > 0.5 { least.min(y) } else { least });
        let bed = Bed::new(4.0, vec![Vector::new(0.0, 0.0, 10.0), Vector::new(0.0, -beside, 0.0)]);
        bed.view(|view| {
            let ground = Ground { lower: [-5.0; 2], upper: [5.0; 2], periodic: [false; 2] };
            let height = height_near(view, &ground, [0.1, 0.0], 0.3).unwrap();
            assert!(height > 11.5 && height < 12.0, "{height}");
        });
        // Negative control: alone, the lower one is seen.
        let alone = Bed::new(4.0, vec![Vector::new(0.0, -beside, 0.0)]);
        let ground = Ground { lower: [-5.0; 2], upper: [5.0; 2], periodic: [false; 2] };
        assert!(alone.view(|view| height_near(view, &ground, [0.1, 0.0], 0.3)).unwrap() < 2.0);
    }

    #[test]
    fn cut_grains_have_the_volume_below_the_cut() {
        let mut bed = Bed::new(1.0, vec![Vector::new(0.3, -0.2, 0.7)]);
        let whole = bed.view(|view| view.volume_of(0));
        bed.orientation[0] = Quaternion::from_scaled_axis(Vector::new(0.3, 1.1, -0.7));
        bed.view(|view| {
            assert!((volume_below(view, 0, 2.0) - whole).abs() < 1e-14);
            assert!(volume_below(view, 0, 0.1).abs() < 1e-14);
            // Centrally symmetric shape: half of it lies below its centre.
            assert!((volume_below(view, 0, 0.7) - 0.5 * whole).abs() < 1e-14);
            // The section area is the derivative; summed up it gives the volume again.
            let steps = 2000;
            let level = |n: usize| 0.2 + n as Real / f64::from(steps);
            let moment: Real = (0..steps as usize)
                .map(|n| {
                    (volume_below(view, 0, level(n + 1)) - volume_below(view, 0, level(n)))
                        * 0.5
                        * (level(n) + level(n + 1))
                })
                .sum();
            assert!((moment / whole - 0.7).abs() < 1e-10, "the centroid comes out of the slices");
        });
    }

    #[test]
    fn the_porosity_of_a_slab_counts_the_grains_in_it() {
        let bed = Bed::columns(0.5, 2.0, 4, |_| 2.0);
        let grain = bed.view(|view| view.volume_of(0));
        bed.view(|view| {
            // The slab holds the second and third of four layers.
            let porosity = porosity_of_grains(view, 0.5..1.5, 16.0);
            let highest = bed.nodes.iter().fold(0.0, |z: Real, n| z.max(n.z));
            assert!(highest <= 0.25);
            let uncut = 1.0 - 2.0 * 64.0 * grain / 16.0;
            assert!((porosity - uncut).abs() < 0.05);
            // A slab has the solid of its slices, however they cut the grains.
            let slices = [0.3..0.7, 0.7..1.1, 1.1..1.5].map(|slice| porosity_of_grains(view, slice, 16.0));
            assert!((slices.iter().sum::<Real>() / 3.0 - porosity_of_grains(view, 0.3..1.5, 16.0)).abs() < 1e-12);
        });
    }

    #[test]
    fn speeds_are_magnitudes() {
        let mut bed = Bed::new(1.0, vec![Vector::ZERO; 2]);
        bed.velocity = vec![Vector::new(0.0, 3.0, 0.0), Vector::new(0.0, -1.0, 0.0)];
        assert_eq!(bed.view(motion), Motion { mean_speed: 2.0, largest_speed: 3.0 });
        assert_eq!(Bed::new(1.0, Vec::new()).view(motion), Motion::default());
    }

    #[test]
    fn lying_upright_and_random_grains_are_told_apart() {
        let count = 4000_u32;
        let mut bed = Bed::new(1.0, vec![Vector::ZERO; count as usize]);
        let (nodes, _) = icosahedron(Vector::new(1.0, 1.0, 2.0));
        bed.nodes = nodes;
        let upright = bed.view(orientation).unwrap();
        assert!((upright.vertical_order - 1.0).abs() < 1e-14 && (upright.lying_order + 2.0).abs() < 1e-14);
        bed.orientation.fill(Quaternion::from_rotation_x(FRAC_PI_2));
        let lying = bed.view(orientation).unwrap();
        assert!((lying.lying_order - 1.0).abs() < 1e-12);
        for (n, turn) in bed.orientation.iter_mut().enumerate() {
            let cosine = (n as Real + 0.5) / f64::from(count);
            *turn = Quaternion::from_rotation_x(cosine.acos());
        }
        let random = bed.view(orientation).unwrap();
        assert!(random.vertical_order.abs() < 1e-6);
    }
}
