use sazanami_mps::scheme::{Scheme, Projection};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let _ = Projection::Enhanced;
    let s: f64 = a[1].parse().unwrap();
    let t: f64 = a[2].parse().unwrap();
    println!("{:?}", sazanami_verification::particles::bed_load(Scheme::default(), s, t));
}
