//! Noise: clouds that need no image.

use glam::DVec2;

use crate::sampling::mix;

/// Perlin's gradient noise ("Improving Noise", 2002) in the plane, in several octaves, from 0 to 1. Gradients are unit vectors in 16 directions, chosen by a hash of the knot.
pub(super) fn fractal(uv: DVec2, octaves: u32, seed: u64) -> f64 {
    let (mut sum, mut whole) = (0.0, 0.0);
    let (mut at, mut strength) = (uv, 1.0);
    for octave in 0..octaves {
        sum += strength * gradient_noise(at, seed ^ u64::from(octave) << 56);
        whole += strength;
        at *= 2.0;
        strength *= 0.5;
    }
    (0.5 + 0.5 * sum / whole).clamp(0.0, 1.0)
}

/// One octave, about -1 to 1, and 0 at whole numbers.
fn gradient_noise(at: DVec2, seed: u64) -> f64 {
    let knot = at.floor();
    let inside = at - knot;
    let corner = |x: f64, y: f64| {
        let offset = DVec2::new(x, y);
        gradient(knot + offset, seed).dot(inside - offset)
    };
    // The quintic 6 t^5 - 15 t^4 + 10 t^3, whose first and second derivatives vanish at both ends.
    let smooth = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (s, t) = (smooth(inside.x), smooth(inside.y));
    let lower = corner(0.0, 0.0) * (1.0 - s) + corner(1.0, 0.0) * s;
    let upper = corner(0.0, 1.0) * (1.0 - s) + corner(1.0, 1.0) * s;
    // With unit gradients it stays within sqrt(1/2).
    (lower * (1.0 - t) + upper * t) * std::f64::consts::SQRT_2
}

fn gradient(knot: DVec2, seed: u64) -> DVec2 {
    // Cosines of eighths of a quarter turn.
    const DIRECTIONS: [[f64; 2]; 4] = [
        [1.0, 0.0],
        [0.923_879_532_511_286_7, 0.382_683_432_365_089_8],
        [std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2],
        [0.382_683_432_365_089_8, 0.923_879_532_511_286_7],
    ];
    // Whole numbers: beyond those that fit, all knots look alike.
    let hash = mix(mix(seed ^ knot.x as i64 as u64) ^ knot.y as i64 as u64);
    let [x, y] = DIRECTIONS[(hash & 3) as usize];
    match hash >> 2 & 3 {
        0 => DVec2::new(x, y),
        1 => DVec2::new(-y, x),
        2 => DVec2::new(-x, -y),
        _ => DVec2::new(y, -x),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values() -> impl Iterator<Item = f64> {
        (0..40_000).map(|i| fractal(DVec2::new(f64::from(i % 200) * 0.173, f64::from(i / 200) * 0.191), 4, 7))
    }

    #[test]
    fn it_is_even_about_its_middle_and_uses_most_of_its_range() {
        let mean = values().sum::<f64>() / 40_000.0;
        let (lowest, highest) = values().fold((1.0_f64, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
        assert!((mean - 0.5).abs() < 0.01 && lowest < 0.2 && highest > 0.8, "{lowest} {mean} {highest}");
    }

    #[test]
    fn knots_of_the_largest_octave_are_even_and_the_noise_is_continuous_there() {
        assert_eq!(fractal(DVec2::new(3.0, -2.0), 1, 9), 0.5);
        for x in [3.0, -7.0, 0.5] {
            let step = 1e-9;
            let (left, right) = (fractal(DVec2::new(x - step, 0.3), 5, 1), fractal(DVec2::new(x + step, 0.3), 5, 1));
            assert!((left - right).abs() < 1e-7);
        }
    }

    #[test]
    fn seeds_and_octaves_differ_and_far_away_are_still_numbers() {
        let at = DVec2::new(0.37, 0.61);
        assert_ne!(fractal(at, 3, 1), fractal(at, 3, 2));
        assert_ne!(fractal(at, 3, 1), fractal(at, 4, 1));
        assert!(fractal(DVec2::splat(1e300), 16, 1).is_finite());
    }
}
