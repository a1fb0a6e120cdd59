//! Sums over samples whose bits do not depend on how the samples were grouped.

use glam::DVec3;

/// A sum by a fixed binary tree over the sample index: samples 2k and 2k + 1 are added, then pairs of pairs, and so on.
///
/// Every aligned range of 2^n samples is one node of the tree, so ranges that were summed apart and then added in pairs give the same bits as one
/// sum of all; extending 64 samples to 4096 gives what 4096 at once would. Each node is rounded to what two floats of 32 bits hold, 49 bits or more, so that a picture can tell
/// the sums that it was made of (see [`crate::description::Aov::Residual`]). The error grows with the logarithm of the number of samples
/// (Higham, "Accuracy and Stability of Numerical Algorithms", 4.2). It works as a binary counter: bit n of `count` says whether `nodes[n]`
/// holds a range of 2^n samples that waits for its sibling.
#[derive(Clone, Debug)]
pub struct PairwiseSum {
    count: u64,
    nodes: [DVec3; u64::BITS as usize],
}

impl Default for PairwiseSum {
    fn default() -> Self {
        Self { count: 0, nodes: [DVec3::ZERO; u64::BITS as usize] }
    }
}

impl PairwiseSum {
    /// Forgets all samples.
    #[inline]
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds the next sample.
    #[inline]
    pub fn push(&mut self, sample: DVec3) {
        let mut node = rounded(sample);
        let mut level = 0;
        while self.count >> level & 1 == 1 {
            node = rounded(node + self.nodes[level]);
            level += 1;
        }
        self.nodes[level] = node;
        self.count += 1;
    }

    /// The sum of all samples so far. Ranges that still wait for their sibling are added from the shortest to the longest.
    #[inline]
    pub fn total(&self) -> DVec3 {
        let mut total = DVec3::ZERO;
        let mut waiting = self.count;
        while waiting != 0 {
            total += self.nodes[waiting.trailing_zeros() as usize];
            waiting &= waiting - 1;
        }
        total
    }
}

/// As near as two floats of 32 bits come, of which the first is as near as one comes; numbers near the ends of floats are rounded to as many bits as others.
#[inline(always)]
fn rounded(x: DVec3) -> DVec3 {
    const DARK: f64 = 1.0 / (1u64 << 60) as f64;
    const BRIGHT: f64 = (1u64 << 60) as f64;
    let of = |x: f64| {
        let unit = match x.abs() {
            ..DARK => DARK,
            BRIGHT.. => BRIGHT,
            _ => 1.0,
        };
        let y = x * (1.0 / unit);
        let high = f64::from(y as f32);
        (high + f64::from((y - high) as f32)) * unit
    };
    DVec3::new(of(x.x), of(x.y), of(x.z))
}

/// The unit of residuals: small enough for those of the darkest pixels, large enough for those of the brightest.
const UNIT: f64 = 1.0 / (1u64 << 32) as f64;

/// The mean of two ranges of `count` samples each, a power of two, one after the other and aligned, from their own: each the sum of two floats of 32 bits, and so is what comes out, the nearer one
/// first. From 2^-126 to 2^120, it has the bits of the mean of all samples at once.
pub fn joined([first, second]: [[[f32; 3]; 2]; 2], count: u64) -> [[f32; 3]; 2] {
    let sum = |[high, low]: [[f32; 3]; 2]| (DVec3::from(high.map(f64::from)) + DVec3::from(low.map(f64::from)) * UNIT) * count as f64;
    apart(rounded(sum(first) + sum(second)) * (0.5 / count as f64))
}

/// A number as two floats of 32 bits: as near as one comes, but finite, and the rest in units of 2^-32.
pub fn apart(mean: DVec3) -> [[f32; 3]; 2] {
    let high = mean.to_array().map(|x| x.min(f32::MAX.into()) as f32);
    let rest = |i: usize| (mean[i] - f64::from(high[i])) / UNIT;
    [high, std::array::from_fn(|i| rest(i).clamp(f32::MIN.into(), f32::MAX.into()) as f32)]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::Rng;
    use proptest::test_runner::{RngAlgorithm, TestRng};

    use super::*;

    fn random(seed: u8) -> TestRng {
        TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32])
    }

    fn samples(rng: &mut TestRng, count: usize) -> Vec<DVec3> {
        let mut one = || (rng.next_u64() >> 11) as f64 * 2f64.powi(-(50 + (rng.next_u32() % 40) as i32));
        (0..count).map(|_| DVec3::new(one(), one(), one())).collect()
    }

    fn sum(samples: &[DVec3]) -> DVec3 {
        let mut sum = PairwiseSum::default();
        samples.iter().for_each(|&sample| sum.push(sample));
        sum.total()
    }

    /// The definition of the tree, written down recursively.
    fn tree(samples: &[DVec3]) -> DVec3 {
        match samples {
            [one] => rounded(*one),
            _ => rounded(tree(&samples[..samples.len() / 2]) + tree(&samples[samples.len() / 2..])),
        }
    }

    /// Cuts an aligned range at random into aligned ranges (first, count).
    fn cut(rng: &mut TestRng, first: usize, count: usize, ranges: &mut Vec<(usize, usize)>) {
        if count > 1 && rng.next_u32().is_multiple_of(2) {
            cut(rng, first, count / 2, ranges);
            cut(rng, first + count / 2, count / 2, ranges);
        } else {
            ranges.push((first, count));
        }
    }

    #[test]
    fn any_grouping_and_order_gives_the_same_bits() {
        let mut rng = random(1);
        let samples = samples(&mut rng, 256);
        let expected = sum(&samples);
        let mut plain_order_differs = false;
        for _ in 0..10_000 {
            let mut ranges = Vec::new();
            cut(&mut rng, 0, samples.len(), &mut ranges);
            let mut waiting: Vec<_> = ranges.iter().map(|&(first, count)| (first, count, sum(&samples[first..first + count]))).collect();
            while waiting.len() > 1 {
                let (first, count, left) = waiting.swap_remove(rng.next_u32() as usize % waiting.len());
                let sibling = waiting.iter().position(|&(other, size, _)| size == count && other == first ^ count);
                match sibling {
                    Some(at) => {
                        let (other, _, right) = waiting.swap_remove(at);
                        waiting.push((first.min(other), 2 * count, rounded(left + right)));
                    }
                    None => waiting.push((first, count, left)),
                }
            }
            assert_eq!(waiting[0].2, expected);
            plain_order_differs |= ranges.iter().map(|&(first, count)| sum(&samples[first..first + count])).sum::<DVec3>() != expected;
        }
        assert!(plain_order_differs, "the samples are too tame to tell orders apart");
    }

    #[test]
    fn powers_of_two_follow_the_tree() {
        let samples = samples(&mut random(2), 4096);
        for level in 0..=12 {
            assert_eq!(sum(&samples[..1 << level]), tree(&samples[..1 << level]));
        }
    }

    #[test]
    fn two_floats_hold_49_bits() {
        let mut rng = random(4);
        for sample in samples(&mut rng, 100_000) {
            let [high, low] = apart(rounded(sample));
            let both = DVec3::from(high.map(f64::from)) + DVec3::from(low.map(f64::from)) * UNIT;
            assert_eq!(both, rounded(sample));
            assert!((both - sample).abs().cmple(sample * 2f64.powi(-49)).all(), "{both} is not {sample}");
        }
        for end in [1e-44, 1e-37, 1e37, 1e44] {
            let error = (rounded(DVec3::splat(end)) / end - 1.0).abs().max_element();
            assert!(error < 2f64.powi(-49), "{error} of {end}");
        }
    }

    #[test]
    fn halves_join_to_what_all_samples_come_to() {
        for scale in [1.0, 1e-14, 1e-24, 1e14, 1e34] {
            let samples: Vec<_> = samples(&mut random(5), 512).into_iter().map(|sample| sample * scale).collect();
            let mean = |samples: &[DVec3]| apart(sum(samples) * (1.0 / samples.len() as f64));
            for count in [1, 2, 64, 256] {
                assert_eq!(
                    joined([mean(&samples[..count]), mean(&samples[count..2 * count])], count as u64),
                    mean(&samples[..2 * count]),
                    "{scale}"
                );
            }
        }
    }

    #[test]
    fn other_counts_add_their_aligned_ranges_from_the_shortest() {
        let s = samples(&mut random(3), 7);
        assert_eq!(sum(&s), tree(&s[..4]) + (tree(&s[4..6]) + tree(&s[6..])));
        assert_eq!(sum(&[]), DVec3::ZERO);
    }
}
