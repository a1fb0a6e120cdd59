//! Tests of [`super`].

use super::*;

const PIXELS: [(u32, u32); 4] = [(0, 0), (1, 0), (0, 1), (1023, 767)];

/// Whether `2^(a + b)` points fall one into each cell of a grid of 2^a x 2^b cells.
fn stratified(points: &[DVec2], a: u32, b: u32) -> bool {
    let mut seen = vec![false; 1 << (a + b)];
    let cell = |p: &DVec2| ((p.x * f64::from(1 << a)) as usize) << b | (p.y * f64::from(1 << b)) as usize;
    points.len() == seen.len() && points.iter().all(|p| !std::mem::replace(&mut seen[cell(p)], true))
}

/// Pearson's correlation of numbers that are uniform in [0, 1), in standard deviations of that of independent ones.
fn correlation(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (count, sum) = pairs.fold((0.0, 0.0), |(n, sum), (a, b)| (n + 1.0, sum + (a - 0.5) * (b - 0.5)));
    sum * 12.0 / f64::sqrt(count)
}

/// Every elementary interval in base 2 of every aligned range holds one point, as in Sobol's first two dimensions.
#[test]
fn every_aligned_range_is_a_net() {
    for (pixel, set) in PIXELS.into_iter().zip([0, 1, 300, u32::MAX]) {
        for bits in [0, 1, 2, 3, 4, 5, 6, 7, 8, 12] {
            for range in [0, 1, 2, 3, (1 << 32 >> bits) - 1, 1 << 32 >> bits, u64::MAX >> bits] {
                let first = range << bits;
                let points: Vec<_> = (first..=first + ((1 << bits) - 1)).map(|i| Sampler::new(7, pixel, i).pair(set)).collect();
                assert!((0..=bits).all(|a| stratified(&points, a, bits - a)), "{pixel:?} {set} {bits} {range}");
            }
        }
    }
}

#[test]
fn single_numbers_are_stratified_in_every_block() {
    for (block, set) in [(0, 2), (0, 255), (1, 0), (1, 300), (u64::from(u32::MAX), 77), (0, u32::MAX)] {
        for first in [0, 4096, 1 << 20, (1 << 32) - 4096] {
            for bits in [0, 1, 5, 8, 12] {
                let points: Vec<_> =
                    (0..1 << bits).map(|i| DVec2::new(Sampler::new(7, (3, 4), (block << 32) + first + i).one(set), 0.0)).collect();
                assert!(stratified(&points, bits, 0), "{block} {set} {first} {bits}");
            }
        }
    }
}

/// Scrambling only renames cells: unscrambled, the second dimension is Sobol's, from his direction numbers.
#[test]
fn the_second_dimension_is_that_of_sobol() {
    // m_i = 2 m_(i-1) ^ m_(i-1), the polynomial x + 1; digit 1 of direction i is the highest bit of m_i.
    let mut directions = [1u32 << 31; 32];
    for i in 1..32 {
        directions[i] = directions[i - 1] ^ directions[i - 1] >> 1;
    }
    for index in (0..1000).chain([u32::MAX, 0x8000_0000, 0xdead_beef]) {
        let sobol = (0..32).filter(|k| index >> k & 1 == 1).fold(0, |sum, k| sum ^ directions[k]);
        assert_eq!(pascal(index).reverse_bits(), sobol);
    }
}

/// Different seeds, pixels, blocks, sets, and coordinates are different sequences.
#[test]
fn sequences_are_not_correlated() {
    type Sequence = fn(u64) -> f64;
    let sequences: [Sequence; 10] = [
        |i| Sampler::new(7, (3, 4), i).pair(0).x,
        |i| Sampler::new(8, (3, 4), i).pair(0).x,
        |i| Sampler::new(7, (4, 3), i).pair(0).x,
        |i| Sampler::new(7, (3, 5), i).pair(0).x,
        |i| Sampler::new(7, (3, 4), i + (1 << 32)).pair(0).x,
        |i| Sampler::new(7, (3, 4), i).pair(1).x,
        |i| Sampler::new(7, (3, 4), i).pair(0).y,
        |i| Sampler::new(7, (3, 4), i).pair(1).y,
        |i| Sampler::new(7, (3, 4), i).one(0),
        |i| Sampler::new(7, (3, 4), i).one(1),
    ];
    for (a, first) in sequences.iter().enumerate() {
        for second in &sequences[..a] {
            let z = correlation((0..4096).map(|i| (first(i), second(i))));
            assert!(z.abs() < 4.5, "{z}");
        }
    }
}

/// Two sets are paired at random also among few samples: the correlation of 16 samples has mean 0 over pixels. Its variance is up to twice that
/// of independent numbers, for neighbours 2i and 2i + 1 lie in opposite halves in every set (and 16 times, if both sets had the same order).
#[test]
fn few_samples_pair_sets_at_random() {
    type Choice = fn(&Sampler) -> (f64, f64);
    let choices: [Choice; 4] =
        [|s| (s.pair(0).x, s.pair(1).x), |s| (s.pair(2).x, s.pair(3).y), |s| (s.one(0), s.one(1)), |s| (s.one(0), s.pair(0).y)];
    for choose in choices {
        let z = (0..4096).map(|x| correlation((0..16).map(|i| choose(&Sampler::new(1, (x, 9), i)))));
        let (sum, squares) = z.fold((0.0, 0.0), |(sum, squares), z| (sum + z / 64.0, squares + z * z / 4096.0));
        assert!(sum.abs() < 5.0 && (1.0..2.0).contains(&squares), "{sum} {squares}");
    }
}

/// Four coordinates of two sets fill their 4^4 cells evenly: chi-square of 2^16 points, 255 degrees of freedom, stays below mean + 5 sigma.
#[test]
fn pairs_of_pairs_fill_four_dimensions() {
    for (a, b) in [(0, 1), (1, 2), (0, 256), (5, u32::MAX)] {
        let mut counts = [0f64; 256];
        for i in 0..1 << 16 {
            let sampler = Sampler::new(3, (100, 200), i);
            let (p, q) = (sampler.pair(a) * 4.0, sampler.pair(b) * 4.0);
            counts[[p.x, p.y, q.x, q.y].iter().fold(0, |cell, &digit| cell * 4 + digit as usize)] += 1.0;
        }
        let chi_square = counts.iter().map(|n| (n - 256.0) * (n - 256.0) / 256.0).sum::<f64>();
        assert!(chi_square < 255.0 + 5.0 * f64::sqrt(510.0), "{chi_square}");
    }
}

/// Digits that the net leaves open are evenly distributed: of the first point over pixels, and of the last 21 bits over indices.
#[test]
fn points_are_even_within_their_cells() {
    let chi_square = |numbers: &mut dyn Iterator<Item = f64>| {
        let mut counts = [0f64; 64];
        numbers.for_each(|x| counts[(x * 64.0) as usize] += 1.0);
        counts.iter().map(|n| (n - 1024.0) * (n - 1024.0) / 1024.0).sum::<f64>()
    };
    type Coordinate = fn(Sampler) -> f64;
    for coordinate in [(|s| s.pair(0).x) as Coordinate, |s| s.pair(0).y, |s| s.one(0)] {
        let first = chi_square(&mut (0..1 << 16).map(|x| coordinate(Sampler::new(0, (x % 256, x / 256), 0))));
        let last = chi_square(&mut (0..1 << 16).map(|i| (coordinate(Sampler::new(0, (0, 0), i)) * f64::from(1u32 << 31) * 2.0).fract()));
        assert!(first.max(last) < 63.0 + 5.0 * f64::sqrt(126.0), "{first} {last}");
    }
}

/// Not beyond 2^32 indices either, where the digits start anew.
#[test]
fn points_never_repeat() {
    let indices = (0..5).flat_map(|block| (0..4096).map(move |i| (block << 32) + i));
    let mut points: Vec<_> = indices.map(|i| Sampler::new(7, (3, 4), i).pair(2)).map(|p| (p.x.to_bits(), p.y.to_bits())).collect();
    points.sort_unstable();
    assert!(points.windows(2).all(|p| p[0] != p[1]));
}

/// Root mean square error of the integral of x^2 y over pixels: where random points halve it with four times the samples, a scrambled net of
/// a smooth function divides it by nearly eight (Owen, "Scrambled net variance for integrals of smooth functions", 1997).
#[test]
fn integrals_of_smooth_functions_converge_fast() {
    let error = |count: u32| {
        let integral = |x| {
            let points = (0..count).map(|i| Sampler::new(5, (x, 0), i.into()).pair(0));
            points.map(|p| p.x * p.x * p.y).sum::<f64>() / f64::from(count)
        };
        ((0..256).map(|x| (integral(x) - 1.0 / 6.0) * (integral(x) - 1.0 / 6.0)).sum::<f64>() / 256.0).sqrt()
    };
    let (few, many) = (error(16), error(1024));
    // The standard deviation of x^2 y is sqrt(1/15 - 1/36) = 0.197.
    assert!(many < few / 200.0 && many < 0.197 / f64::sqrt(1024.0) / 50.0, "{few} {many}");
}

/// Bits of the first release: an image of one machine must be that of all others.
#[test]
fn the_bits_are_these() {
    let samplers = [(1, (2, 3), 4), (0, (0, 0), 0), (u64::MAX, (65_535, 65_535), u64::MAX)].map(|(s, p, i)| Sampler::new(s, p, i));
    let bits = samplers.map(|s| [s.pair(0).x, s.pair(0).y, s.pair(513).x, s.pair(513).y, s.one(0), s.one(u32::MAX)].map(f64::to_bits));
    let first = [
        [4605435112326646727, 4599156566788436094, 4605411915538255342, 4604746199102529610, 4599375385923776748, 4597425232047668508],
        [4596518899705085952, 4599970475804677796, 4604986818927687972, 4606121133060230926, 4604199720235635377, 4593848243203308320],
        [4596794781892086740, 4593984965021134016, 4584860590212329280, 4600920624221050266, 4603347159338547765, 4574683874571548160],
    ];
    assert_eq!(bits, first);
}
