//! The observers on a bed of spheroidal grains of the size used by Yagyu et al. (2015).

use sazanami_numerics::geometry::{ContactSphereRule, Shape, SpheroidMesh, VolumeRule};
use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_observe::bed_profile::{height_near, motion, orientation, porosity_of_grains};
use sazanami_observe::erosion::{Erosion, ErosionSettings, cap_volume};
use sazanami_observe::splash::SplashTracker;
use sazanami_observe::{BedView, Body};

const SIDE: Real = 33.8e-3;
const D: Real = 0.52e-3;

/// A deterministic number between 0 and 1 (golden-ratio sequences of different rates).
fn share(n: usize, which: u32) -> Real {
    (n as Real * [0.618_033_988_7, 0.754_877_666_2, 0.569_840_290_9, 0.438_447_187_2][which as usize]).fract()
}

struct Sand {
    shape: Shape,
    position: Vec<Vector>,
    orientation: Vec<Quaternion>,
}

/// Grains at random angles in layers below the level `top(r)`, wherever that leaves room above the floor.
fn sand(top: impl Fn(Real) -> Real) -> Sand {
    let resolution = SpheroidMesh { rings: 7, segments: 6 };
    let rule = ContactSphereRule::Axis { count: 9 };
    let shape =
        Shape::spheroid(0.26e-3, 0.635e-3, resolution, VolumeRule::Inscribed, &rule).expect("the grain of the paper");
    let columns = 44;
    let pitch = SIDE / columns as Real;
    let (mut position, mut orientation) = (Vec::new(), Vec::new());
    for i in 0..columns {
        for j in 0..columns {
            let [x, y] = [i, j].map(|n| (n as Real + 0.5) * pitch);
            let level = top((x - SIDE / 2.0).hypot(y - SIDE / 2.0));
            for k in 0..16 {
                let z = level - 0.4e-3 - k as Real * 0.45e-3;
                if z > 0.635e-3 {
                    let n = position.len();
                    let jitter = Vector::new(share(n, 0) - 0.5, share(n, 1) - 0.5, 0.0) * 0.3e-3;
                    position.push(Vector::new(x, y, z) + jitter);
                    let axis = Vector::new(share(n, 2) - 0.5, share(n, 3) - 0.5, 0.3);
                    orientation
                        .push(Quaternion::from_axis_angle(axis.normalize(), std::f64::consts::TAU * share(n, 1)));
                }
            }
        }
    }
    Sand { shape, position, orientation }
}

impl Sand {
    fn view<R>(&self, look: impl FnOnce(&BedView) -> R) -> R {
        let count = self.position.len();
        let bodies = [Body::of(&self.shape)];
        look(&BedView {
            bodies: &bodies,
            id: &(0..count as u64).collect::<Vec<u64>>(),
            held: &vec![false; count],
            body: &vec![0; count],
            scale: &vec![1.0; count],
            mass: &vec![2650.0 * self.shape.volume(); count],
            position: &self.position,
            orientation: &self.orientation,
            velocity: &vec![Vector::ZERO; count],
            last_contact: None,
            time: 0.0,
        })
    }
}

fn settings() -> ErosionSettings {
    ErosionSettings::recommended([0.0; 2], [SIDE; 2], 0.0, D)
}

#[test]
fn a_crater_in_sand_is_measured_above_its_noise() {
    let level = 7.5e-3;
    let flat = sand(|_| level).view(|bed| Erosion::of(bed, &settings(), None)).unwrap();
    let initial = flat.as_initial();
    assert!(flat.crater.volume < cap_volume(D, flat.crater.rim_radius), "{:?}", flat.crater);

    // A bowl with a rim: parabola of depth 2.5 mm, rim radius 6.2 mm, rim 0.6 mm above the level.
    let (rim, radius) = (0.6e-3, 6.2e-3);
    let bowl = |r: Real| {
        let outside = level + (rim - 0.25 * (r - radius)).max(0.0);
        if r < radius { level + rim - 2.5e-3 * (1.0 - (r / radius).powi(2)) } else { outside }
    };
    let crater = sand(bowl).view(|bed| Erosion::of(bed, &settings(), Some(&initial))).unwrap();
    assert!(crater.crater.volume > 3.0 * initial.noise, "{:?}", crater.crater);
    assert!((crater.crater.rim_radius - radius).abs() < settings().layer);
    assert!((crater.crater.depth - 2.5e-3).abs() < D);
    // A paraboloid below the initial level: depth 1.9 mm, base area by its radius there.
    let excavated = 0.5 * 1.9e-3 * std::f64::consts::PI * radius * radius * (1.9 / 2.5);
    assert!((crater.volume_excavated.unwrap() / excavated - 1.0).abs() < 0.2);
    assert!(crater.volume_rim.unwrap() > 0.0 && crater.airborne_grains == 0);
}

#[test]
fn the_bed_has_the_state_it_was_built_with() {
    let bed = sand(|_| 7.5e-3);
    bed.view(|view| {
        let height = height_near(view, &settings().ground(), [SIDE / 2.0; 2], 1e-3).unwrap();
        assert!((7.1e-3..7.8e-3).contains(&height), "{height}");
        // All grains lie between 0 and the slab's top: their volume is exact.
        let porosity = porosity_of_grains(view, 0.0..8e-3, SIDE * SIDE);
        let exact = 1.0 - bed.position.len() as Real * bed.shape.volume() / (SIDE * SIDE * 8e-3);
        assert!((porosity - exact).abs() < 1e-12, "{porosity} {exact}");
        assert_eq!(motion(view).largest_speed, 0.0);
        let order = orientation(view).unwrap();
        assert_eq!(order.grains, bed.position.len());
        assert!(order.vertical_order.abs() < 0.5);
        assert_eq!(SplashTracker::new(view, [SIDE / 2.0; 2], D, 0.0).observe(view).grains, 0);
    });
}
