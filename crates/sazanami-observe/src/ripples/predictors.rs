//! Predictions of published formulas for ripples under an oscillating flow.
//!
//! Each formula rests on ripples in equilibrium under waves of deep channels; few hold for ripples that still grow or
//! for a tank shallower than its waves are high.

use sazanami_numerics::Real;

/// Mobility number from which on ripples are looked for. GAIA (openTELEMAC) has them from 1.69 on; Sekiguchi and
/// Sunamura (2004, Coastal Engineering 50, 231) saw them form on beds with notches and mounds from 2.5 on.
pub const LEAST_MOBILITY: Real = 1.7;

/// Mobility number `U^2/((s - 1) g d)` for an orbital speed `speed` [m/s], the submerged specific gravity times
/// gravity `submerged_gravity` = `(s - 1) g` [m/s^2] and the grain size \[m].
#[must_use]
pub fn mobility(speed: Real, submerged_gravity: Real, grain_size: Real) -> Real {
    speed * speed / (submerged_gravity * grain_size)
}

/// Ripples by a formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// Authors and year.
    pub source: &'static str,
    /// Wavelength \[m].
    pub wavelength: Real,
    /// Height from crest to trough \[m], where the formula has one.
    pub height: Option<Real>,
}

/// Longest wavelength over the orbital amplitude among the formulas, that of Nielsen for a mobility of zero.
pub const LONGEST_OVER_AMPLITUDE: Real = 2.2;

/// Ripples under an orbital amplitude \[m] (half the way of the water) at a mobility number, for grains of
/// `grain_size` \[m]: Nielsen (laboratory), Wiberg and Harris, Miller and Komar, O'Donoghue and others.
#[must_use]
pub fn predicted(amplitude: Real, mobility: Real, grain_size: Real) -> [Predicted; 4] {
    [
        nielsen(amplitude, mobility),
        wiberg_harris(2.0 * amplitude, grain_size),
        Predicted { source: "Miller and Komar 1980", wavelength: 0.65 * 2.0 * amplitude, height: None },
        o_donoghue(amplitude, mobility, grain_size),
    ]
}

/// Nielsen 1981 (J. Geophys. Res. 86, 6467) and 1992 (Coastal Bottom Boundary Layers and Sediment Transport), ripples of
/// regular waves in the laboratory.
fn nielsen(amplitude: Real, mobility: Real) -> Predicted {
    Predicted {
        source: "Nielsen 1981",
        wavelength: amplitude * (2.2 - 0.345 * mobility.powf(0.34)).max(0.0),
        height: Some(amplitude * (0.275 - 0.022 * mobility.sqrt()).max(0.0)),
    }
}

/// Wiberg and Harris 1994 (J. Geophys. Res. 99, 775) in the closed form of Malarkey and Davies 2003 (J. Coastal Res. 19,
/// 738), for an orbital diameter \[m].
fn wiberg_harris(diameter: Real, grain_size: Real) -> Predicted {
    // ln(eta/lambda) = -0.095 ln(d0/eta)^2 + 0.442 ln(d0/eta) - 2.28, solved for d0/eta.
    let over_height = |over_length: Real| {
        let middle = 0.5 * (1.0 + 0.442) / 0.095;
        (middle - (middle * middle - (2.28 + over_length.ln()) / 0.095).max(0.0).sqrt()).exp()
    };
    let anorbital = 535.0 * grain_size;
    let orbital = 0.62 * diameter;
    let first = over_height(diameter / anorbital);
    let wavelength = if first < 20.0 {
        orbital
    } else if first > 100.0 {
        anorbital
    } else {
        anorbital * (-(orbital / anorbital).ln() * (0.01 * first).ln() / 5.0_f64.ln()).exp()
    };
    Predicted {
        source: "Wiberg and Harris 1994",
        wavelength,
        height: Some(diameter / over_height(diameter / wavelength)),
    }
}

/// O'Donoghue, Doucette, van der Werf and Ribberink 2006 (Coastal Engineering 53, 997), with the transitions of van der
/// A and others 2013 (Coastal Engineering 76, 26), appendix B.
fn o_donoghue(amplitude: Real, mobility: Real, grain_size: Real) -> Predicted {
    let coarse = ((grain_size - 0.22e-3) / 0.08e-3).clamp(0.0, 1.0);
    let flat = 0.5 * (1.0 + (std::f64::consts::PI * ((mobility - 190.0) / 50.0).clamp(0.0, 1.0)).cos());
    let of = |share: Real, value: Real| amplitude * flat * (share + (1.0 - share) * coarse) * value.max(0.0);
    Predicted {
        source: "O'Donoghue et al. 2006",
        wavelength: of(0.73, 1.97 - 0.44 * mobility.powf(0.21)),
        height: Some(of(0.55, 0.275 - 0.022 * mobility.powf(0.42))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn millimetres(amplitude: Real, mobility: Real) -> [[Real; 2]; 4] {
        predicted(amplitude, mobility, 1e-3).map(|one| [1e3 * one.wavelength, 1e3 * one.height.unwrap_or_default()])
    }

    #[test]
    fn formulas_give_the_values_worked_out_by_hand() {
        // Quartz of 1 mm at 2 Hz: U = 0.1257 and 0.2513 m/s.
        let submerged = 1.65 * 9.81;
        let at = |amplitude: Real| mobility(amplitude * 4.0 * std::f64::consts::PI, submerged, 1e-3);
        assert!((at(10e-3) - 0.976).abs() < 2e-3 && (at(20e-3) - 3.90).abs() < 1e-2);
        let expected = [
            (10e-3, [[18.6, 2.53], [12.4, 2.1], [13.0, 0.0], [15.3, 2.53]]),
            (20e-3, [[33.0, 4.63], [24.8, 4.2], [26.0, 0.0], [27.7, 4.72]]),
        ];
        for (amplitude, rows) in expected {
            let found = millimetres(amplitude, at(amplitude));
            let close = |a: [Real; 2], b: [Real; 2]| (a[0] - b[0]).abs() < 0.1 && (a[1] - b[1]).abs() < 0.06;
            assert!(found.iter().zip(rows).all(|(a, b)| close(*a, b)), "{found:?}");
        }
    }

    #[test]
    fn fine_sand_and_strong_flow_change_the_regime() {
        // Anorbital ripples do not feel the orbit, and sheet flow has none.
        let anorbital = [2.0, 3.0].map(|diameter| wiberg_harris(diameter, 0.1e-3).wavelength);
        assert!(anorbital.iter().all(|length| (length - 53.5e-3).abs() < 1e-9), "{anorbital:?}");
        let between = wiberg_harris(0.3, 0.1e-3).wavelength;
        assert!(between > 53.5e-3 && between < 0.62 * 0.3, "{between}");
        assert_eq!(o_donoghue(1.0, 250.0, 0.2e-3).wavelength, 0.0);
        let fine = o_donoghue(1.0, 10.0, 0.2e-3).wavelength / o_donoghue(1.0, 10.0, 1e-3).wavelength;
        assert!((fine - 0.73).abs() < 1e-12, "{fine}");
    }
}
