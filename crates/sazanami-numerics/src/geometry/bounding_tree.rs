//! A binary tree of axis-aligned boxes over triangles, tetrahedra or points: which of them lie near a place.

use crate::{Real, Vector};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub lower: Vector,
    pub upper: Vector,
}

impl Bounds {
    /// The box that holds nothing.
    pub const EMPTY: Self = Self { lower: Vector::splat(Real::INFINITY), upper: Vector::splat(Real::NEG_INFINITY) };

    /// The smallest box around `points`.
    pub fn around(points: impl IntoIterator<Item = Vector>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { lower: b.lower.min(p), upper: b.upper.max(p) })
    }

    fn union(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    /// Whether the two boxes share more than their surfaces.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.lower.cmplt(other.upper).all() && other.lower.cmplt(self.upper).all()
    }

    /// Squared distance of `point` to the box, zero inside [m^2].
    pub fn distance_squared(&self, point: Vector) -> Real {
        (point - point.clamp(self.lower, self.upper)).length_squared()
    }
}

/// Leaves hold at most this many items.
const LEAF: usize = 4;

#[derive(Clone, Debug)]
struct Branch {
    bounds: Bounds,
    /// Leaf: first item in `order`; inner: index of the right child (the left one follows directly).
    start: u32,
    /// Number of items of a leaf, zero for an inner branch.
    count: u32,
}

/// Binary tree of boxes over numbered items.
#[derive(Clone, Debug)]
pub(crate) struct BoundingTree {
    branches: Vec<Branch>,
    order: Vec<u32>,
    boxes: Vec<Bounds>,
}

impl BoundingTree {
    /// Builds the tree over `boxes` by halving along the longest direction.
    pub fn new(boxes: Vec<Bounds>) -> Self {
        let mut tree =
            Self { branches: Vec::with_capacity(2 * boxes.len()), order: (0..boxes.len() as u32).collect(), boxes };
        if !tree.boxes.is_empty() {
            tree.split(0, tree.boxes.len());
        }
        tree
    }

    fn split(&mut self, start: usize, end: usize) {
        let boxes = &self.boxes;
        let items = &mut self.order[start..end];
        let bounds = items.iter().fold(Bounds::EMPTY, |b, &i| b.union(boxes[i as usize]));
        let index = self.branches.len();
        self.branches.push(Branch { bounds, start: start as u32, count: (end - start) as u32 });
        if end - start <= LEAF {
            return;
        }
        let centre = |i: u32| boxes[i as usize].lower + boxes[i as usize].upper;
        let spread = Bounds::around(items.iter().map(|&i| centre(i)));
        let axis = longest_axis(spread.upper - spread.lower);
        items.sort_unstable_by(|&a, &b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b)));
        let middle = usize::midpoint(start, end);
        self.split(start, middle);
        self.branches[index].start = self.branches.len() as u32;
        self.branches[index].count = 0;
        self.split(middle, end);
    }

    /// Calls `visit` with every item whose box overlaps `bounds`, in a fixed order.
    pub fn for_each_overlap(&self, bounds: &Bounds, mut visit: impl FnMut(usize)) {
        let mut stack = vec![0_usize];
        while let Some(index) = stack.pop() {
            let Some(branch) = self.branches.get(index) else { continue };
            if !branch.bounds.overlaps(bounds) {
                continue;
            }
            if branch.count == 0 {
                stack.push(branch.start as usize);
                stack.push(index + 1);
                continue;
            }
            let first = branch.start as usize;
            for &item in &self.order[first..first + branch.count as usize] {
                if self.boxes[item as usize].overlaps(bounds) {
                    visit(item as usize);
                }
            }
        }
    }

    /// Item for which `distance_squared(item)` is smallest, given that it is never below the distance of
    /// `point` to the item's box; and that distance.
    pub fn nearest(&self, point: Vector, distance_squared: impl FnMut(usize) -> Real) -> Option<(usize, Real)> {
        self.search::<false>(point, distance_squared)
    }

    /// A tree over `points`.
    pub fn of_points(points: &[Vector]) -> Self {
        Self::new(points.iter().map(|&point| Bounds { lower: point, upper: point }).collect())
    }

    /// The nearest of the points of a tree over points, of several as near the first; and its squared distance [m^2].
    pub fn nearest_point(&self, point: Vector) -> Option<(usize, Real)> {
        self.search::<true>(point, |item| self.boxes[item].lower.distance_squared(point))
    }

    /// The nearest item, of several as near the `FIRST` or any.
    fn search<const FIRST: bool>(
        &self,
        point: Vector,
        mut distance_squared: impl FnMut(usize) -> Real,
    ) -> Option<(usize, Real)> {
        let mut best: Option<(usize, Real)> = None;
        let mut stack = vec![(0_usize, 0.0)];
        while let Some((index, bound)) = stack.pop() {
            let Some(branch) = self.branches.get(index) else { continue };
            if best.is_some_and(|(_, d)| bound > d || (!FIRST && bound == d)) {
                continue;
            }
            if branch.count == 0 {
                let mut children = [index + 1, branch.start as usize]
                    .map(|child| (child, self.branches[child].bounds.distance_squared(point)));
                if children[0].1 < children[1].1 {
                    children.swap(0, 1);
                }
                stack.extend(children);
                continue;
            }
            let first = branch.start as usize;
            for &item in &self.order[first..first + branch.count as usize] {
                let item = item as usize;
                let d = distance_squared(item);
                if best.is_none_or(|(first, least)| d < least || (FIRST && d == least && item < first)) {
                    best = Some((item, d));
                }
            }
        }
        best
    }
}

/// Component in which `extent` is largest.
fn longest_axis(extent: Vector) -> usize {
    if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes() -> Vec<Bounds> {
        (0..200)
            .map(|i| {
                let t = Real::from(i);
                let centre = Vector::new((t * 0.731).sin(), (t * 1.37).cos(), (t * 0.311).sin());
                Bounds { lower: centre - Vector::splat(0.05), upper: centre + Vector::splat(0.05) }
            })
            .collect()
    }

    #[test]
    fn the_tree_finds_what_a_search_through_all_finds() {
        let all = boxes();
        let tree = BoundingTree::new(all.clone());
        let probe = Bounds { lower: Vector::splat(-0.3), upper: Vector::new(0.4, 0.2, 0.5) };
        let mut found = Vec::new();
        tree.for_each_overlap(&probe, |i| found.push(i));
        found.sort_unstable();
        let expected: Vec<usize> = (0..all.len()).filter(|&i| all[i].overlaps(&probe)).collect();
        assert!(!expected.is_empty());
        assert_eq!(found, expected);

        for point in [Vector::ZERO, Vector::new(2.0, 0.1, -0.4), Vector::new(0.3, 0.9, 0.1)] {
            let (_, d) = tree.nearest(point, |i| all[i].distance_squared(point)).unwrap();
            let least = all.iter().map(|b| b.distance_squared(point)).fold(Real::INFINITY, Real::min);
            assert_eq!(d, least);
        }
    }

    #[test]
    fn of_points_as_near_the_first_is_found() {
        let points: Vec<Vector> =
            (0..300).map(|i| Vector::new(Real::from(i % 7), Real::from(i % 5), Real::from(i % 3))).collect();
        let tree = BoundingTree::of_points(&points);
        for i in 0..60 {
            let place = Vector::new(0.5 * Real::from(i % 13), 0.5 * Real::from(i % 9), 0.5 * Real::from(i % 5));
            let all = points.iter().map(|p| p.distance_squared(place)).enumerate();
            let first = all.min_by(|a, b| a.1.total_cmp(&b.1));
            assert_eq!(tree.nearest_point(place), first);
        }
    }

    #[test]
    fn an_empty_tree_finds_nothing() {
        let tree = BoundingTree::new(Vec::new());
        assert!(tree.nearest(Vector::ZERO, |_| 0.0).is_none());
    }
}
