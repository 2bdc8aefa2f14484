//! Surfaces of grains with as few triangles as the view can draw.

use std::collections::BTreeMap;

/// A surface in body coordinates.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Corners \[m].
    pub nodes: Vec<[f32; 3]>,
    /// Node numbers of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A surface from coordinates and node numbers.
    pub fn new(coordinates: &[f32], corners: &[f32]) -> Self {
        let count = coordinates.len() / 3;
        let triangle = |corners: &[f32; 3]| corners.map(|corner| corner as u32);
        let is_whole = |triangle: &[u32; 3]| triangle.iter().all(|&corner| (corner as usize) < count);
        let triangles = corners.as_chunks().0.iter().map(triangle).filter(is_whole).collect();
        Self { nodes: coordinates.as_chunks().0.to_vec(), triangles }
    }

    /// The surface with at most `most` triangles: nodes that share a cell of a grid over it become one, their mean (Rossignac and
    /// Borrel 1993), on the finest of the grids that does.
    pub fn reduced(self, most: usize) -> Self {
        const FINEST: usize = 24;
        if self.triangles.len() <= most {
            return self;
        }
        (2..=FINEST).rev().map(|cells| self.clustered(cells)).find(|mesh| mesh.triangles.len() <= most).unwrap_or(self)
    }

    fn clustered(&self, cells: usize) -> Self {
        let ends = |of: fn(f32, f32) -> f32, first: f32| {
            std::array::from_fn::<f32, 3, _>(|d| self.nodes.iter().map(|node| node[d]).fold(first, of))
        };
        let (lower, upper) = (ends(f32::min, f32::INFINITY), ends(f32::max, f32::NEG_INFINITY));
        let cell = |node: &[f32; 3]| {
            std::array::from_fn::<usize, 3, _>(|d| {
                let part = (node[d] - lower[d]) / (upper[d] - lower[d]).max(f32::MIN_POSITIVE);
                ((part * cells as f32) as usize).min(cells - 1)
            })
        };
        let mut numbers: BTreeMap<[usize; 3], u32> = BTreeMap::new();
        let mut sums: Vec<([f32; 3], f32)> = Vec::new();
        let number = |node: &[f32; 3]| {
            let number = *numbers.entry(cell(node)).or_insert_with(|| {
                sums.push(([0.0; 3], 0.0));
                sums.len() as u32 - 1
            });
            let (sum, count) = &mut sums[number as usize];
            sum.iter_mut().zip(node).for_each(|(sum, x)| *sum += x);
            *count += 1.0;
            number
        };
        let of_node: Vec<u32> = self.nodes.iter().map(number).collect();
        let nodes = sums.into_iter().map(|(sum, count)| sum.map(|x| x / count)).collect();
        let moved = |triangle: &[u32; 3]| triangle.map(|node| of_node[node as usize]);
        let is_flat = |[a, b, c]: &[u32; 3]| a == b || b == c || c == a;
        let triangles = self.triangles.iter().map(moved).filter(|triangle| !is_flat(triangle)).collect();
        Self { nodes, triangles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fine_sphere_keeps_its_size_with_few_triangles() {
        let (rings, around) = (40_u32, 80_u32);
        let angle = |n: u32, of: u32| std::f32::consts::PI * n as f32 / of as f32;
        let node = |n: u32| {
            let (polar, turn) = (angle(n / around, rings - 1), 2.0 * angle(n % around, around));
            [polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()]
        };
        let nodes: Vec<[f32; 3]> = (0..rings * around).map(node).collect();
        let quad = |n: u32| {
            let (ring, next) = (n / around * around, (n + 1) % around + n / around * around);
            [[n, n + around, next], [next, n + around, next - ring + ring + around]]
        };
        let triangles: Vec<[u32; 3]> = (0..(rings - 1) * around).flat_map(quad).collect();
        let sphere = Mesh { nodes, triangles };
        let small = sphere.clone().reduced(200);
        assert!((50..=200).contains(&small.triangles.len()), "{}", small.triangles.len());
        assert!(small.nodes.iter().all(|n| (0.8..1.01).contains(&n.iter().map(|x| x * x).sum::<f32>().sqrt())));
        let same = sphere.clone().reduced(1_000_000);
        assert_eq!(same.triangles.len(), sphere.triangles.len());
    }
}
