//! The grains of a bed as the observers see them.

use sazanami_numerics::geometry::Shape;
use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_parallel::for_each_chunk;

/// Grains in one parallel task.
pub(crate) const GRAINS_AT_ONCE: usize = 64;

/// Closed surface of a grain shape in its body frame (origin at the centre of mass).
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// Nodes \[m].
    pub nodes: &'a [Vector],
    /// Triangles as node numbers, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// Direction of the long axis, if the shape has a single one (unit vector).
    pub long_axis: Option<Vector>,
}

/// All grains of a bed at one time, in the order of their identifiers.
///
/// The slices have one entry per grain, except `bodies` (one per shape).
#[derive(Clone, Copy, Debug)]
pub struct BedView<'a> {
    /// Shapes that `body` refers to.
    pub bodies: &'a [Body<'a>],
    /// Identifier of each grain.
    pub id: &'a [u64],
    /// Whether each grain is held or has a given motion: contacts between such grains are not looked at, and none of them is in the air.
    pub held: &'a [bool],
    /// Shape of each grain.
    pub body: &'a [u32],
    /// Size factor of each grain against its shape.
    pub scale: &'a [Real],
    /// Mass \[kg].
    pub mass: &'a [Real],
    /// Centre of mass \[m].
    pub position: &'a [Vector],
    /// Orientation, body to laboratory.
    pub orientation: &'a [Quaternion],
    /// Velocity of the centre of mass [m/s].
    pub velocity: &'a [Vector],
    /// Time of the last contact with a grain or a wall, on the clock of `time` \[s]; minus infinity if
    /// there was none. `None` where contacts are not known, as in a bed read from a file.
    pub last_contact: Option<&'a [Real]>,
    /// Time now \[s].
    pub time: Real,
}

impl<'a> Body<'a> {
    /// Volume inside the surface [m^3].
    #[must_use]
    pub fn volume(&self) -> Real {
        let corners = |triangle: &[u32; 3]| triangle.map(|node| self.nodes[node as usize]);
        self.triangles.iter().map(corners).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    /// The surface of a shape. The long axis is that of the smallest moment of inertia, if the others
    /// are clearly larger.
    #[must_use]
    pub fn of(shape: &'a Shape) -> Self {
        let moments = shape.principal_inertia();
        let longest = if moments.x <= moments.y && moments.x <= moments.z {
            0
        } else if moments.y <= moments.z {
            1
        } else {
            2
        };
        let others = moments[(longest + 1) % 3].min(moments[(longest + 2) % 3]);
        let surface = shape.surface();
        Self {
            nodes: &surface.nodes,
            triangles: &surface.triangles,
            long_axis: (others > 1.02 * moments[longest]).then(|| Vector::AXES[longest]),
        }
    }
}

impl BedView<'_> {
    /// Number of grains.
    #[must_use]
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there are no grains.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Shape of a grain.
    #[must_use]
    pub fn body_of(&self, grain: usize) -> &Body<'_> {
        &self.bodies[self.body[grain] as usize]
    }

    /// Nodes of a grain in the laboratory frame \[m].
    pub fn nodes_of(&self, grain: usize) -> impl Iterator<Item = Vector> + '_ {
        let (centre, turn, scale) = (self.position[grain], self.orientation[grain], self.scale[grain]);
        self.body_of(grain).nodes.iter().map(move |&node| centre + turn * (node * scale))
    }

    /// Time since the last contact of a grain \[s]; `None` where contacts are not known.
    #[must_use]
    pub fn time_since_contact(&self, grain: usize) -> Option<Real> {
        self.last_contact.map(|times| self.time - times[grain])
    }

    /// Volume of a grain [m^3].
    #[must_use]
    pub fn volume_of(&self, grain: usize) -> Real {
        self.body_of(grain).volume() * self.scale[grain].powi(3)
    }

    /// Smallest box around a grain: lower and upper corner \[m].
    #[must_use]
    pub fn bounds_of(&self, grain: usize) -> (Vector, Vector) {
        let nothing = (Vector::INFINITY, Vector::NEG_INFINITY);
        self.nodes_of(grain).fold(nothing, |(lower, upper), node| (lower.min(node), upper.max(node)))
    }

    /// Smallest boxes around all grains: lower and upper corners \[m].
    #[must_use]
    pub fn bounds(&self) -> Vec<(Vector, Vector)> {
        let mut bounds = vec![(Vector::ZERO, Vector::ZERO); self.len()];
        for_each_chunk(&mut bounds[..], GRAINS_AT_ONCE, |number, bounds| {
            let first = number * GRAINS_AT_ONCE;
            bounds.iter_mut().enumerate().for_each(|(n, bounds)| *bounds = self.bounds_of(first + n));
        });
        bounds
    }

    /// Height of the highest node of a grain \[m].
    #[must_use]
    pub fn top_of(&self, grain: usize) -> Real {
        self.nodes_of(grain).fold(Real::NEG_INFINITY, |top, node| top.max(node.z))
    }
}

#[cfg(test)]
pub(crate) mod test_bed {
    //! Beds of small grains for the tests.

    use super::*;

    const PHI: Real = 1.618_033_988_749_895;

    /// Surface of an icosahedron whose corners lie on the ellipsoid with semi-axes `axes`.
    pub fn icosahedron(axes: Vector) -> (Vec<Vector>, Vec<[u32; 3]>) {
        let mut nodes = Vec::new();
        for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            nodes.push(Vector::new(0.0, s, t * PHI));
            nodes.push(Vector::new(s, t * PHI, 0.0));
            nodes.push(Vector::new(t * PHI, 0.0, s));
        }
        let mut triangles = Vec::new();
        for a in 0..12_u32 {
            for b in 0..12 {
                for c in 0..12 {
                    let [p, q, r] = [a, b, c].map(|n| nodes[n as usize]);
                    let edges = [p - q, q - r, r - p].iter().all(|e| (e.length_squared() - 4.0).abs() < 1e-9);
                    if edges && a < b && a < c && (q - p).cross(r - p).dot(p + q + r) > 0.0 {
                        triangles.push([a, b, c]);
                    }
                }
            }
        }
        (nodes.into_iter().map(|n| n.normalize() * axes).collect(), triangles)
    }

    /// A bed that owns its data.
    pub struct Bed {
        pub nodes: Vec<Vector>,
        pub triangles: Vec<[u32; 3]>,
        pub position: Vec<Vector>,
        pub velocity: Vec<Vector>,
        pub orientation: Vec<Quaternion>,
        /// At time 1.
        pub last_contact: Option<Vec<Real>>,
        pub mass: Vec<Real>,
        pub id: Vec<u64>,
        pub held: Vec<bool>,
        body: Vec<u32>,
        scale: Vec<Real>,
    }

    impl Bed {
        /// Grains of diameter `diameter` at `position`, at rest and in contact.
        pub fn new(diameter: Real, position: Vec<Vector>) -> Self {
            let (nodes, triangles) = icosahedron(Vector::splat(diameter / 2.0));
            let count = position.len();
            Self {
                nodes,
                triangles,
                velocity: vec![Vector::ZERO; count],
                orientation: vec![Quaternion::IDENTITY; count],
                last_contact: Some(vec![1.0; count]),
                mass: vec![1e-7; count],
                id: (0..count as u64).collect(),
                held: vec![false; count],
                body: vec![0; count],
                scale: vec![1.0; count],
                position,
            }
        }

        /// Columns of grains on a square lattice that fill the square of half-width `half` about the
        /// origin from the floor up to the level `top(r)`; the highest node of each column is there.
        pub fn columns(diameter: Real, half: Real, layers: usize, top: impl Fn(Real) -> Real) -> Self {
            let count = (2.0 * half / diameter).round() as usize;
            let pitch = 2.0 * half / count as Real;
            let (nodes, _) = icosahedron(Vector::splat(diameter / 2.0));
            let highest = nodes.iter().fold(0.0, |z: Real, n| z.max(n.z));
            let mut position = Vec::new();
            for i in 0..count {
                for j in 0..count {
                    let [x, y] = [i, j].map(|n| -half + (n as Real + 0.5) * pitch);
                    let level = top(x.hypot(y));
                    position.extend((0..layers).map(|k| Vector::new(x, y, level - highest - k as Real * diameter)));
                }
            }
            Self::new(diameter, position)
        }

        /// The bed without the grain in a place of its order.
        pub fn without(mut self, grain: usize) -> Self {
            fn take<T>(column: &mut Vec<T>, grain: usize) {
                drop(column.remove(grain));
            }
            take(&mut self.position, grain);
            take(&mut self.velocity, grain);
            take(&mut self.orientation, grain);
            take(&mut self.mass, grain);
            take(&mut self.id, grain);
            take(&mut self.held, grain);
            take(&mut self.body, grain);
            take(&mut self.scale, grain);
            self.last_contact.iter_mut().for_each(|times| take(times, grain));
            self
        }

        pub fn view<R>(&self, look: impl FnOnce(&BedView) -> R) -> R {
            let bodies =
                [Body { nodes: &self.nodes, triangles: &self.triangles, long_axis: Some(Vector::new(0.0, 0.0, 1.0)) }];
            look(&BedView {
                bodies: &bodies,
                id: &self.id,
                held: &self.held,
                body: &self.body,
                scale: &self.scale,
                mass: &self.mass,
                position: &self.position,
                orientation: &self.orientation,
                velocity: &self.velocity,
                last_contact: self.last_contact.as_deref(),
                time: 1.0,
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use sazanami_numerics::geometry::ContactSphereRule;

    use super::test_bed::*;
    use super::*;

    #[test]
    fn nodes_follow_the_pose() {
        let mut bed = Bed::new(2.0, vec![Vector::new(1.0, 2.0, 3.0)]);
        bed.nodes = vec![Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 0.0, 2.0)];
        bed.orientation[0] = Quaternion::from_rotation_y(-std::f64::consts::FRAC_PI_2);
        bed.view(|bed| {
            // The body's x1 axis points up now, its x3 axis along -x1.
            assert!((bed.top_of(0) - 4.0).abs() < 1e-14);
            let (lower, upper) = bed.bounds_of(0);
            assert!((lower - Vector::new(-1.0, 2.0, 3.0)).length() < 1e-14);
            assert!((upper - Vector::new(1.0, 2.0, 4.0)).length() < 1e-14);
        });
    }

    #[test]
    fn only_elongated_shapes_have_a_long_axis() {
        let axis = |edges: Vector| {
            let shape = Shape::cuboid(edges, &ContactSphereRule::Listed(vec![(Vector::ZERO, 0.1)])).unwrap();
            Body::of(&shape).long_axis
        };
        assert_eq!(axis(Vector::new(1.0, 2.0, 1.0)), Some(Vector::Y));
        assert_eq!(axis(Vector::new(1.0, 1.5, 2.0)), Some(Vector::Z));
        assert_eq!(axis(Vector::new(2.0, 2.0, 1.0)), None);
        assert_eq!(axis(Vector::ONE), None);
    }

    #[test]
    fn an_icosahedron_has_twenty_triangles() {
        assert_eq!(icosahedron(Vector::ONE).1.len(), 20);
    }
}
