//! The cases of numerical stability hold: the program of `benches/numerics`, with its own number of rays, ten million at edges and as many at vertices.

#[path = "../benches/numerics/main.rs"]
#[allow(dead_code)]
mod cases;

#[test]
fn all_cases_of_numerical_stability_hold() {
    assert!(cases::all_hold(None, &[]));
}
