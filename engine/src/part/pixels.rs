//! Pixels from their samples.

use glam::DVec3;

use super::{PairwiseSum, pairwise::apart, spread::Spread};

/// Takes the samples of pixels, one pixel after the other.
pub struct Pixels {
    /// Samples of a pixel.
    count: u64,
    /// Samples of this pixel so far.
    taken: u64,
    sum: PairwiseSum,
    /// Where errors are asked for.
    spread: Option<Box<Spread>>,
    /// Of the pixels that are done.
    pub means: Vec<[f32; 3]>,
    /// Their standard errors, if these are asked for.
    pub errors: Vec<DVec3>,
    /// What the means lack, which are floats of 32 bits.
    pub residuals: Vec<[f32; 3]>,
}

impl Pixels {
    /// Room for `pixels` of `count` samples each.
    pub fn new(pixels: usize, count: u64, errors: bool) -> Self {
        let spread = errors.then(Box::default);
        Self {
            count,
            taken: 0,
            sum: PairwiseSum::default(),
            spread,
            means: Vec::with_capacity(pixels),
            errors: Vec::new(),
            residuals: Vec::with_capacity(pixels),
        }
    }

    /// Takes the next sample.
    #[inline]
    pub fn push(&mut self, sample: DVec3) {
        self.sum.push(sample);
        self.spread.iter_mut().for_each(|spread| spread.push(sample));
        self.taken += 1;
        if self.taken == self.count {
            self.finish();
        }
    }

    fn finish(&mut self) {
        let mean = self.sum.total() * (1.0 / self.count as f64);
        let [mean, residual] = apart(mean);
        self.means.push(mean);
        self.residuals.push(residual);
        self.sum.clear();
        if let Some(spread) = &mut self.spread {
            self.errors.push(spread.standard_error());
            spread.clear();
        }
        self.taken = 0;
    }
}
