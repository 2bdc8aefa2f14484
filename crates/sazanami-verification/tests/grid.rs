//! Flows with a known answer, on grids that take seconds; `sazanami verify` runs them on finer ones.

use sazanami_mics::interface::InterfaceScheme;
use sazanami_verification::grid::{deformation, reversed_vortex, translation};

const ALL_SCHEMES: [InterfaceScheme; 3] = [InterfaceScheme::Plic, InterfaceScheme::ThincSw, InterfaceScheme::ThincWlic];

#[test]
fn a_sphere_comes_back_with_its_volume_and_second_order_shape() {
    let errors = [16, 32].map(|n| translation(n, InterfaceScheme::Plic));
    for error in &errors {
        println!("{error:?}");
        assert!((error.volume).abs() < 1e-12);
        assert!(error.range[0] >= -1e-12 && error.range[1] <= 1.0 + 1e-12);
    }
    let order = (errors[0].shape / errors[1].shape).log2();
    println!("order {order:.2}");
    assert!(order > 1.8);
}

/// Bands: about twice the best split or unsplit schemes collected by Xie and Xiao (2017), on 64^2.
#[test]
fn the_reversed_vortex_gives_the_circle_back() {
    for (scheme, band) in ALL_SCHEMES.into_iter().zip([1.8e-2, 2.5e-2, 2.5e-2]) {
        let errors = [32, 64].map(|n| reversed_vortex(n, scheme));
        println!("{scheme:?}: {errors:?}");
        assert!(errors[1].shape < band);
        assert!(errors[1].shape < 0.4 * errors[0].shape);
        assert!(errors.iter().all(|e| e.volume.abs() < 1e-12));
    }
}

/// Schemes of the literature have 6.9e-3 to 8.1e-3 on 32^3 (Xie and Xiao 2017, table 12).
#[test]
fn the_deformed_sphere_comes_back() {
    for (scheme, band) in ALL_SCHEMES.into_iter().zip([8.1e-3, 9e-3, 1.05e-2]) {
        let error = deformation(32, scheme);
        println!("{scheme:?}: {error:?}");
        assert!(error.shape < band);
        assert!(error.volume.abs() < 1e-12);
    }
}
