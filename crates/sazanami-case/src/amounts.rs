//! Amounts for people: in the unit that leaves few digits, to four significant ones. Units, but those of long times, can be read back.

use sazanami_numerics::Real;

use crate::units::rounded;

/// A unit: from which amount on it is taken, its size in SI units, its name.
type Unit = (Real, Real, &'static str);

/// The largest unit whose beginning the amount reaches; the units go from small to large.
fn shown(value: Real, units: &[Unit]) -> String {
    let fits = |unit: &&Unit| value.abs() >= unit.0;
    let (_, size, name) = units.iter().rev().find(fits).or(units.first()).copied().unwrap_or((0.0, 1.0, ""));
    format!("{} {name}", rounded(value / size))
}

/// A length \[m].
#[must_use]
pub fn length(metres: Real) -> String {
    if metres == 0.0 {
        return "0 mm".to_owned();
    }
    shown(metres, &[(0.0, 1e-9, "nm"), (1e-7, 1e-6, "um"), (1e-4, 1e-3, "mm"), (1.0, 1.0, "m"), (1e4, 1e3, "km")])
}

/// The least length of a range \[m], rounded up.
#[must_use]
pub fn at_least(metres: Real) -> String {
    length(metres + 5e-4 * metres.abs())
}

/// A volume [m^3].
#[must_use]
pub fn volume(cubic_metres: Real) -> String {
    shown(cubic_metres, &[(0.0, 1e-9, "mm^3"), (1e-6, 1e-6, "cm^3"), (1e-2, 1.0, "m^3")])
}

/// A mass \[kg].
#[must_use]
pub fn mass(kilograms: Real) -> String {
    shown(kilograms, &[(0.0, 1e-9, "ug"), (1e-7, 1e-6, "mg"), (1e-3, 1e-3, "g"), (1.0, 1.0, "kg"), (1e4, 1e3, "t")])
}

/// A momentum [kg m/s].
#[must_use]
pub fn momentum(kilogram_metres: Real) -> String {
    shown(kilogram_metres, &[(0.0, 1e-5, "g cm/s"), (1e-2, 1.0, "kg m/s")])
}

/// A time in a run \[s].
#[must_use]
pub fn time(seconds: Real) -> String {
    if seconds == 0.0 {
        return "0 s".to_owned();
    }
    shown(seconds, &[(0.0, 1e-9, "ns"), (1e-7, 1e-6, "us"), (1e-3, 1e-3, "ms"), (1.0, 1.0, "s")])
}

/// A length of time that is known to a factor of two, to two digits: `42 s`, `3.3 min`, `5.2 h`.
#[must_use]
pub fn estimate(seconds: Real) -> String {
    let two = |value: Real| format!("{value:.1e}").parse().unwrap_or(value);
    match seconds {
        ..95.0 => format!("{} s", two(seconds)),
        ..5700.0 => format!("{} min", two(seconds / 60.0)),
        ..3.6e9 => format!("{} h", two(seconds / 3600.0)),
        _ => format!("{:.1e} h", seconds / 3600.0),
    }
}

/// A length of time for people: `42 s`, `3 min 20 s`, `5 h 10 min`.
#[must_use]
pub fn duration(seconds: Real) -> String {
    if seconds < 10.0 {
        return format!("{seconds:.1} s");
    }
    let whole = seconds.round();
    if whole < 120.0 {
        format!("{whole:.0} s")
    } else if whole < 7200.0 {
        format!("{:.0} min {:02.0} s", (whole / 60.0).floor(), whole % 60.0)
    } else if whole < 3.6e9 {
        format!("{:.0} h {:02.0} min", (whole / 3600.0).floor(), ((whole % 3600.0) / 60.0).floor())
    } else {
        format!("{:.1e} h", whole / 3600.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::parse_quantity;

    #[test]
    fn durations_read_well() {
        assert_eq!(duration(4.25), "4.2 s");
        assert_eq!(duration(42.4), "42 s");
        assert_eq!(duration(200.0), "3 min 20 s");
        assert_eq!(duration(18_650.0), "5 h 10 min");
    }

    #[test]
    fn estimates_have_two_digits() {
        assert_eq!([0.42, 94.4, 637.0, 18_650.0, 4e9].map(estimate), ["0.42 s", "94 s", "11 min", "5.2 h", "1.1e6 h"]);
    }

    #[test]
    fn units_leave_few_digits_and_can_be_read_back() {
        assert_eq!([19.1299e-3, 0.52e-3, 5.537e-3, 12e-6].map(length), ["19.13 mm", "0.52 mm", "5.537 mm", "12 um"]);
        let length_of = |text: String| parse_quantity(&text).unwrap().0;
        assert!(
            [1.00049e-3, 0.12344, 9.9999].map(|x| length_of(at_least(x)) / x).iter().all(|r| (1.0..1.0011).contains(r))
        );
        assert_eq!([0.0, 1.25, 24e3, -0.03].map(length), ["0 mm", "1.25 m", "24 km", "-30 mm"]);
        assert_eq!([9e-2, 7.238e-9, 1.6e-3, 0.0].map(volume), ["0.09 m^3", "7.238 mm^3", "1600 cm^3", "0 mm^3"]);
        assert_eq!([7.238e-6, 1.93e-7, 2.6, 3e-9].map(mass), ["7.238 mg", "0.193 mg", "2.6 kg", "3 ug"]);
        assert_eq!(
            [0.039, 5.0000e-3, 0.0234567, 1.5, 3e-5, 0.0].map(time),
            ["39 ms", "5 ms", "23.46 ms", "1.5 s", "30 us", "0 s"]
        );
        assert_eq!([80e-5, 0.25, 0.0].map(momentum), ["80 g cm/s", "0.25 kg m/s", "0 g cm/s"]);
        for value in [3.1e-9, 4.56e-5, 0.0123, 7.0, 5.5e4] {
            for text in [length(value), volume(value), mass(value), momentum(value)] {
                let (read, _) = parse_quantity(&text).unwrap();
                assert!((read - value).abs() < 1e-3 * value, "{value}: {text}");
            }
        }
    }
}
