//! The numbers behind every choice: a stateless Owen-scrambled Sobol sequence, padded in pairs of dimensions.
//!
//! A sample is a pure function of (seed, pixel, index, set), so it does not matter who takes it, when, or beside which others. Each set of
//! dimensions is the first two dimensions of Sobol's sequence in an order of its own: its index is shuffled by a nested uniform permutation,
//! then each coordinate is scrambled by another (Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020). Pairs of sets are
//! therefore paired at random, like padded samplers (Kollig & Keller, "Efficient Multidimensional Sampling", 2002).

use glam::DVec2;

/// All samples of one (seed, pixel, index). Numbers of different sets are independent of each other, and so are those of [`Sampler::pair`] and
/// [`Sampler::one`] for the same set.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    /// The low half of the index, first digit last: the digits of van der Corput's sequence.
    digits: u32,
    /// Where the hashes of the sets start: seed and pixel mixed, plus the high half of the index.
    base: u64,
}

impl Sampler {
    /// The samples of a pixel's `index`th path. All values of all arguments are fine; each other seed, pixel, or block of 2^32 indices is an
    /// independent sequence.
    #[inline]
    pub fn new(seed: u64, pixel: (u32, u32), index: u64) -> Self {
        let stream = mix(mix(seed.wrapping_add(GOLDEN)) ^ (u64::from(pixel.0) << 32 | u64::from(pixel.1)));
        Self { digits: (index as u32).reverse_bits(), base: stream.wrapping_add(index >> 32 << 32) }
    }

    /// Two numbers in [0, 1), multiples of 2^-53. Over every aligned range of 2^m <= 2^32 indices they are a (0, m, 2)-net: each elementary
    /// interval of area 2^-m holds one point. Within its cell of the net, a point is distributed evenly.
    #[inline]
    pub fn pair(&self, set: u32) -> DVec2 {
        let hash = mix(self.base.wrapping_add(u64::from(set)));
        let index = permute(u64::from(self.digits), hash) as u32;
        let index = index.reverse_bits();
        let x = permute(u64::from(index), derive(hash, 0xd6e8_feb8_6659_fd93));
        let y = permute(u64::from(pascal(index)), derive(hash, 0xa076_1d64_78bd_642f));
        // One reversal for the leading digits of both.
        let leading = ((x & LOW) << 32 | y & LOW).reverse_bits();
        DVec2::new(unit(leading & LOW, x >> 32), unit(leading >> 32, y >> 32))
    }

    /// One number in [0, 1), a multiple of 2^-53. Over every aligned range of 2^m <= 2^32 indices, each interval of length 2^-m holds one.
    #[inline]
    pub fn one(&self, set: u32) -> f64 {
        let hash = mix(self.base.wrapping_add(u64::from(set)).wrapping_add(GOLDEN));
        let index = permute(u64::from(self.digits), hash) as u32;
        let x = permute(u64::from(index.reverse_bits()), derive(hash, 0xd6e8_feb8_6659_fd93));
        unit(u64::from((x as u32).reverse_bits()), x >> 32)
    }
}

/// 2^64 over the golden ratio.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The low half of a word.
const LOW: u64 = 0xffff_ffff;

/// The finalizer of SplitMix64 (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014; Stafford's variant 13).
#[inline(always)]
pub(crate) fn mix(mut z: u64) -> u64 {
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

/// Another hash from a good one.
#[inline(always)]
fn derive(hash: u64, factor: u64) -> u64 {
    let product = hash.wrapping_mul(factor);
    product ^ product >> 32
}

/// A nested uniform (Owen) permutation of digits in base 2, the first digit in the lowest bit: whether a digit flips is a hash of those before.
///
/// Each step carries upwards only and keeps or flips a bit by lower ones, which makes it such a permutation (Laine & Karras, "Stratified
/// Sampling for Stochastic Transparency", 2011, section 3.1). Unlike theirs, most factors and addends are random, different windows of the
/// hash, so that the first digits, which see few bits of each word, are nearly independent: the constant is the best of a search, with
/// which flips behind any two of up to 2^8 prefixes are no more correlated over 65,536 hashes than independent ones.
///
/// The input has 32 digits; those of the output beyond 32 are random.
#[inline(always)]
fn permute(digits: u64, hash: u64) -> u64 {
    let x = digits.wrapping_add(hash).wrapping_mul(hash >> 32 | 1).wrapping_add(hash >> 16);
    x ^ x.wrapping_mul(0xe8ee_2644_5ca8_8374)
}

/// The second dimension of Sobol's sequence, first digit in the lowest bit: digit j is the sum of C(k, j) times bit k of the index mod 2 (Sobol,
/// 1967). By Lucas, C(k, j) is odd where the bits of j are among those of k, so this is a sum over supersets, bit by bit of the position.
#[inline(always)]
fn pascal(mut index: u32) -> u32 {
    index ^= index >> 1 & 0x5555_5555;
    index ^= index >> 2 & 0x3333_3333;
    index ^= index >> 4 & 0x0f0f_0f0f;
    index ^= index >> 8 & 0x00ff_00ff;
    index ^ index >> 16
}

/// The number in [0, 1) of 32 leading binary digits and 21 trailing ones, the upper of the 32 bits of `tail`.
#[inline(always)]
fn unit(leading: u64, tail: u64) -> f64 {
    // Less than 2^53, so both conversions are exact; the signed one is a single instruction on x86.
    let number = (leading << 21 | tail >> 11) as i64 as f64 * (1.0 / (1u64 << 53) as f64);
    #[cfg(test)]
    let number = super::extreme::instead_of(number);
    number
}

#[cfg(test)]
mod tests;
