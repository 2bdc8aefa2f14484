use sazanami_numerics::Vector;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let f = |i: usize| a[i].parse::<f64>().unwrap();
    match a[1].as_str() {
        "drag" => {
            let (re, n, width, factor, until) = (f(2), f(3) as usize, f(4), f(5), f(6));
            let clift = |re: f64| {
                let w = re.log10();
                24.0 / re
                    * (1.0 + if re <= 20.0 { 0.1315 * re.powf(0.82 - 0.05 * w) } else { 0.1935 * re.powf(0.6305) })
            };
            let places = [[0.21, 0.37, 0.13], [0.0, 0.0, 0.0], [0.5, 0.5, 0.5], [0.5, 0.0, 0.25], [0.3, 0.8, 0.6]];
            let count = a.get(7).map_or(1, |c| c.parse().unwrap());
            for p in &places[..count] {
                let t = std::time::Instant::now();
                let (cd, change, steps) = sazanami_verification::cases::immersed::trial_drag(
                    re,
                    n,
                    width,
                    factor,
                    Vector::from_array(*p),
                    until,
                )
                .unwrap();
                println!(
                    "Re {re} n {n} width {width} dt x {factor} at {p:?}: C_D {cd:.4} ({:+.1} % of Clift {:.3}) change {change:.1e} steps {steps} {:.0} s",
                    100.0 * (cd / clift(re) - 1.0),
                    clift(re),
                    t.elapsed().as_secs_f64()
                );
            }
        }
        "release" => {
            let (ratio, n, steps, width) = (f(2), f(3) as usize, f(4) as usize, f(5));
            let t = std::time::Instant::now();
            match sazanami_verification::cases::immersed::trial_release(ratio, n, steps, width) {
                Ok((found, theory)) => {
                    let cm = ((ratio - 1.0) / found) - ratio;
                    println!(
                        "ratio {ratio} n {n} steps {steps}: a/g {found:.4} theory {theory:.4} ({:+.1} %) C_m {cm:.3} {:.0} s",
                        100.0 * (found / theory - 1.0),
                        t.elapsed().as_secs_f64()
                    );
                }
                Err(e) => println!("ratio {ratio}: {e}"),
            }
        }
        "settle" => sazanami_verification::cases::settling::trial(f(2) as usize, f(3) as usize, f(4), f(5)).unwrap(),
        _ => panic!(),
    }
}
