//! How far samples lie apart, and so how far their mean may be from what it estimates.

use glam::DVec3;

use super::PairwiseSum;

/// Gathers samples of a pixel. They are told from the first one, so that equal samples have no spread at all, and large ones that are nearly equal keep their digits (Chan, Golub,
/// LeVeque, "Algorithms for Computing the Sample Variance", 1983, on shifted data).
#[derive(Clone, Debug, Default)]
pub struct Spread {
    count: u64,
    first: DVec3,
    sum: PairwiseSum,
    squares: PairwiseSum,
}

impl Spread {
    /// Forgets all samples.
    pub fn clear(&mut self) {
        self.count = 0;
        self.sum.clear();
        self.squares.clear();
    }

    /// Adds the next sample.
    pub fn push(&mut self, sample: DVec3) {
        if self.count == 0 {
            self.first = sample;
        }
        self.count += 1;
        let difference = sample - self.first;
        self.sum.push(difference);
        self.squares.push(difference * difference);
    }

    /// The standard error of the mean, of samples that are independent: the root of the unbiased variance over their number. 0 for less than two samples.
    pub fn standard_error(&self) -> DVec3 {
        if self.count < 2 {
            return DVec3::ZERO;
        }
        let count = self.count as f64;
        let sum = self.sum.total();
        let variance = (self.squares.total() - sum * sum / count) / (count - 1.0);
        // Squares of what is large are no numbers any more.
        let error = |variance: f64| if variance.is_finite() { (variance.max(0.0) / count).sqrt() } else { f64::MAX };
        DVec3::new(error(variance.x), error(variance.y), error(variance.z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(samples: &[f64]) -> f64 {
        let mut spread = Spread::default();
        spread.push(DVec3::splat(7.0));
        spread.clear();
        samples.iter().for_each(|sample| spread.push(DVec3::new(*sample, 2.0 * sample, 0.1)));
        let error = spread.standard_error();
        assert!(error.z == 0.0 && (error.y - 2.0 * error.x).abs() <= 1e-12 * error.y);
        error.x
    }

    #[test]
    fn equal_samples_have_no_error() {
        assert_eq!(error(&[]), 0.0);
        assert_eq!(error(&[0.3]), 0.0);
        assert_eq!(error(&[0.1; 1000]), 0.0);
    }

    /// Of samples that are 1 with a share m and else 0, the variance is m (1 - m).
    #[test]
    fn yes_and_no_have_the_error_of_their_share() {
        for (yes, all) in [(1, 2), (3, 10), (999, 1000), (1, 4096)] {
            let samples: Vec<f64> = (0..all).map(|i| if i * 7 % all < yes { 1.0 } else { 0.0 }).collect();
            let m = samples.iter().sum::<f64>() / f64::from(all);
            assert!((error(&samples) - (m * (1.0 - m) / f64::from(all - 1)).sqrt()).abs() < 1e-12, "{yes} of {all}");
        }
    }

    #[test]
    fn what_is_far_from_zero_keeps_its_digits() {
        let near: Vec<f64> = (0..100).map(|i| f64::from(i % 10)).collect();
        let far: Vec<f64> = near.iter().map(|sample| sample + 1e12).collect();
        let (near, far) = (error(&near), error(&far));
        assert!((near - far).abs() < 1e-3 * near, "{near} {far}");
    }

    #[test]
    fn no_samples_give_what_is_no_number() {
        let mut spread = Spread::default();
        [1e300, 0.0, 1e300].iter().for_each(|sample| spread.push(DVec3::splat(*sample)));
        assert_eq!(spread.standard_error(), DVec3::splat(f64::MAX));
    }
}
