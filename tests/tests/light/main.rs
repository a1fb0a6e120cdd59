//! Light as `path` computes it, through the engine's own interface, against what can be known otherwise: closed forms, sums of what lights do alone, and the same scene told in another way.
//!
//! What is random is measured by independent pixels that look at one point, and compared by Welch's test: all comparisons here together fail by chance with a probability of 1 %.

mod alike;
mod closed;
mod coincident;
mod furnace;
mod gathered;
mod media;
mod ranges;
mod specular;
mod terminator;
mod together;

use tessera_tests::statistics::{Estimate, SIGNIFICANCE, sidak};

/// As many comparisons as there are here, or more.
const COMPARISONS: usize = 1000;

/// Where the measured mean is known so exactly, relative to what is expected, a test means something.
const PRECISE: f64 = 4e-3;

/// Asserts that estimates agree, and that they are good enough to tell.
fn assert_alike(what: &str, ours: [Estimate; 3], expected: [Estimate; 3]) {
    for (channel, (ours, expected)) in ours.into_iter().zip(expected).enumerate() {
        let (deviations, probability) = ours.compared(expected);
        let error = (ours.variance + expected.variance).sqrt() / expected.mean.abs();
        println!(
            "{what}, channel {channel}: {:.7} is {:.7}, standard error {error:.1e}, {deviations:+.2} of these, p {probability:.2e}",
            ours.mean, expected.mean
        );
        assert!(ours.mean.is_finite() && error <= PRECISE, "{what}: too little is known, standard error {error:e}");
        assert!(probability >= sidak(SIGNIFICANCE, COMPARISONS), "{what}, channel {channel}: {} is {}", ours.mean, expected.mean);
    }
}

/// The same for numbers that are known.
fn assert_is(what: &str, ours: [Estimate; 3], expected: [f64; 3]) {
    assert_alike(what, ours, expected.map(Estimate::exact));
}

/// Asserts what is not random at all, but for what single precision rounds.
fn assert_exactly(what: &str, ours: [Estimate; 3], expected: [f64; 3]) {
    for (ours, expected) in ours.into_iter().zip(expected) {
        let error = (ours.mean - expected).abs();
        assert!(
            error <= 1e-6 * expected.abs() && ours.error() <= 1e-7 * expected.abs(),
            "{what}: {} +- {:e} is {expected}",
            ours.mean,
            ours.error()
        );
    }
}
