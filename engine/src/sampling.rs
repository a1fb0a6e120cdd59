//! Samples: a stateless Owen-scrambled Sobol sequence a pixel.
//!
//! A sample is a pure function of (seed, pixel, index, dimension), so it does not matter who takes it, when, or beside which others. Scrambling
//! follows Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020.

use crate::description::Filter;

/// Samples that one Sobol sequence serves; the next block of as many is a sequence of its own, scrambled anew.
const BLOCK_BITS: u32 = 16;

/// A number in [0, 1).
///
/// Aligned ranges of 2^n <= 65,536 indices are stratified within each dimension, and within pairs of low dimensions; beyond, blocks of 65,536
/// are independent of each other. `dimension` may be any number; sets of 256 dimensions are independent of each other.
#[inline]
pub fn sample(seed: u64, pixel: (u32, u32), index: u64, dimension: u32) -> f64 {
    let block = index >> BLOCK_BITS;
    let set = dimension / sobol_burley::NUM_DIMENSIONS;
    let scramble = hash(seed, pixel, block, set);
    let within = (index & ((1 << BLOCK_BITS) - 1)) as u32;
    sobol_burley::sample(within, dimension % sobol_burley::NUM_DIMENSIONS, scramble).into()
}

/// Dimensions of the point on the film.
const FILM_X: u32 = 0;
const FILM_Y: u32 = 1;

/// The point of the film, in pixels from its upper left corner, where a sample looks from.
#[inline]
pub fn film_point(filter: Filter, seed: u64, pixel: (u32, u32), index: u64) -> (f64, f64) {
    let (x, y) = (f64::from(pixel.0), f64::from(pixel.1));
    match filter {
        Filter::Box => (x + sample(seed, pixel, index, FILM_X), y + sample(seed, pixel, index, FILM_Y)),
        Filter::Point => (x + 0.5, y + 0.5),
    }
}

/// A scramble for each (seed, pixel, block, set).
#[inline]
fn hash(seed: u64, (x, y): (u32, u32), block: u64, set: u32) -> u32 {
    let mut state = mix(seed ^ 0x9e37_79b9_7f4a_7c15);
    state = mix(state ^ (u64::from(x) << 32 | u64::from(y)));
    state = mix(state ^ (block << 24 ^ u64::from(set)));
    (state >> 32) as u32
}

/// The finalizer of SplitMix64 (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014; Stafford's variant 13).
#[inline]
fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: [(u32, u32); 4] = [(0, 0), (1, 0), (0, 1), (1023, 767)];

    /// Whether `2^bits` points fall one into each cell of a grid of 2^a x 2^b cells, a + b = bits.
    fn stratified(points: &[(f64, f64)], a: u32, b: u32) -> bool {
        let cell = |&(x, y): &(f64, f64)| ((x * f64::from(1 << a)) as usize) << b | (y * f64::from(1 << b)) as usize;
        let mut cells: Vec<_> = points.iter().map(cell).collect();
        cells.sort_unstable();
        cells.iter().enumerate().all(|(i, &cell)| i == cell)
    }

    /// Every elementary interval in base 2 holds one point: the (0, m, 2)-net of Sobol's first two dimensions, which Owen scrambling keeps.
    #[test]
    fn every_aligned_range_is_a_net() {
        for pixel in PIXELS {
            for bits in 0..=8 {
                for range in 0..4 {
                    let first = range << bits;
                    let points: Vec<_> = (first..first + (1 << bits)).map(|i| (sample(7, pixel, i, 0), sample(7, pixel, i, 1))).collect();
                    assert!((0..=bits).all(|a| stratified(&points, a, bits - a)), "{pixel:?} {bits} {range}");
                }
            }
        }
    }

    #[test]
    fn every_dimension_is_stratified_in_every_block() {
        for (block, dimension) in [(0, 2), (0, 255), (1, 0), (1, 300), (u64::MAX >> 16, 77), (0, u32::MAX)] {
            let points: Vec<_> = (0..1024).map(|i| (sample(7, (3, 4), (block << 16) + i, dimension), 0.0)).collect();
            assert!(stratified(&points, 10, 0), "{block} {dimension}");
        }
    }

    /// Different seeds, pixels, blocks, sets of dimensions and dimensions are different sequences: correlation of 4096 samples stays within five standard
    /// deviations, 5 / sqrt(4096).
    #[test]
    fn sequences_are_not_correlated() {
        type Sequence = fn(u64) -> f64;
        let sequences: [Sequence; 7] = [
            |i| sample(7, (3, 4), i, 0),
            |i| sample(8, (3, 4), i, 0),
            |i| sample(7, (4, 3), i, 0),
            |i| sample(7, (3, 5), i, 0),
            |i| sample(7, (3, 4), i + 65_536, 0),
            |i| sample(7, (3, 4), i, 256),
            |i| sample(7, (3, 4), i, 1),
        ];
        for (a, first) in sequences.iter().enumerate() {
            for second in &sequences[..a] {
                let correlation = (0..4096).map(|i| (first(i) - 0.5) * (second(i) - 0.5)).sum::<f64>() / 4096.0 * 12.0;
                assert!(correlation.abs() < 5.0 / 64.0, "{correlation}");
            }
        }
    }

    /// Bits of the first release: an image of one machine must be that of all others.
    #[test]
    fn the_bits_are_these() {
        let bits = [(1, (2, 3), 4, 0), (1, (2, 3), 4, 1), (u64::MAX, (65_535, 65_535), u64::MAX, 513)]
            .map(|(seed, pixel, index, dimension)| sample(seed, pixel, index, dimension).to_bits());
        assert_eq!(bits, [4_602_912_817_580_867_584, 4_607_141_850_686_423_040, 4_603_188_790_704_472_064]);
    }

    #[test]
    fn the_point_filter_looks_through_the_centre_and_the_box_filter_through_all_of_the_pixel() {
        assert_eq!(film_point(Filter::Point, 1, (3, 4), 99), (3.5, 4.5));
        let points: Vec<_> = (0..256).map(|i| film_point(Filter::Box, 1, (3, 4), i)).map(|(x, y)| (x - 3.0, y - 4.0)).collect();
        assert!(stratified(&points, 4, 4));
    }
}
