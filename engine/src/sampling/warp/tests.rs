//! Tests of [`super`].

use std::f64::consts::PI;

use super::*;
use crate::{math, sampling::Sampler};

/// The ends of [0, 1), the middle, and numbers beside them.
const EDGES: [f64; 8] = [0.0, f64::EPSILON / 2.0, 1e-9, 0.5 - 1e-16, 0.5, 0.5 + 1e-9, 1.0 - 1e-9, 1.0 - f64::EPSILON / 2.0];

fn edges() -> impl Iterator<Item = DVec2> {
    EDGES.into_iter().flat_map(|x| EDGES.into_iter().map(move |y| DVec2::new(x, y)))
}

/// 2^16 points of a net.
fn points() -> impl Iterator<Item = DVec2> {
    (0..1 << 16).map(|i| Sampler::new(1, (0, 0), i).pair(0))
}

fn mean<T: std::iter::Sum<T> + std::ops::Div<f64, Output = T>>(f: impl Fn(DVec2) -> T) -> T {
    points().map(f).sum::<T>() / 65_536.0
}

/// Chi-square of 2^16 random points in `cells` cells of equal measure, in standard deviations above its mean. (A net would be too even.)
fn unevenness(cells: usize, cell: impl Fn(DVec2) -> usize) -> f64 {
    let mut counts = vec![0.0; cells];
    (0..1 << 16).map(|x| Sampler::new(2, (x, 0), 0).pair(0)).for_each(|u| counts[cell(u)] += 1.0);
    let expected = 65_536.0 / cells as f64;
    let chi_square = counts.iter().map(|n| (n - expected) * (n - expected) / expected).sum::<f64>();
    (chi_square - (cells as f64 - 1.0)) / (2.0 * (cells as f64 - 1.0)).sqrt()
}

/// The cell of a number in [0, 1] among `count`.
fn bin(x: f64, count: usize) -> usize {
    ((x * count as f64) as usize).min(count - 1)
}

/// The angle of a point about the origin, in turns.
fn angle(x: f64, y: f64) -> f64 {
    (math::atan2(y, x) / TAU).rem_euclid(1.0)
}

/// Against libm, whose arguments are rounded, so by up to 6e-16 in the angle; in steps that hit all octants and their borders.
#[test]
fn sines_of_turns_are_sines() {
    let turns = (0..=1 << 16).map(|i| f64::from(i) / 65_536.0).chain((0..50_000).map(|i| f64::from(i) / 49_999.3)).chain(EDGES);
    for u in turns.chain([-0.3, -7.125, 1e6 + 0.4]) {
        let (sin, cos) = sin_cos_of_turn(u);
        // The nearest eighth is taken off exactly, so that libm's argument is small.
        let eighth = (u * 8.0).round();
        let (s, c) = (math::sin((u - eighth / 8.0) * TAU), math::cos((u - eighth / 8.0) * TAU));
        let r = std::f64::consts::FRAC_1_SQRT_2;
        let (se, ce) =
            [(0.0, 1.0), (r, r), (1.0, 0.0), (r, -r), (0.0, -1.0), (-r, -r), (-1.0, 0.0), (-r, r)][(eighth as i64).rem_euclid(8) as usize];
        assert!((sin - (s * ce + c * se)).abs() < 5e-16 && (cos - (c * ce - s * se)).abs() < 5e-16, "{u} {sin} {cos}");
        assert!((sin * sin + cos * cos - 1.0).abs() < 1e-15);
    }
    for (u, exact) in [(0.0, (0.0, 1.0)), (0.25, (1.0, 0.0)), (0.5, (0.0, -1.0)), (0.75, (-1.0, 0.0))] {
        assert_eq!(sin_cos_of_turn(u), exact);
    }
}

#[test]
fn the_disc_is_covered_evenly() {
    let cell = |u| {
        let p = concentric_disc(u);
        bin(p.length_squared(), 16) * 16 + bin(angle(p.x, p.y), 16)
    };
    assert!(unevenness(256, cell).abs() < 4.0);
    assert!(edges().map(concentric_disc).all(|p| p.length_squared() <= 1.0 + 1e-15));
    assert_eq!(concentric_disc(DVec2::splat(0.5)), DVec2::ZERO);
}

/// A small square becomes a region as large as it, times pi / 4, everywhere: the Jacobian by differences.
#[test]
fn the_disc_map_keeps_area() {
    let h = 1e-6;
    for u in points().step_by(64).map(|u| u * 0.99 + 0.005) {
        let (dx, dy) = (DVec2::new(h, 0.0), DVec2::new(0.0, h));
        let x = concentric_disc(u + dx) - concentric_disc(u - dx);
        let y = concentric_disc(u + dy) - concentric_disc(u - dy);
        let area = x.perp_dot(y) / (4.0 * h * h);
        let (a, b) = ((2.0 * u.x - 1.0).abs(), (2.0 * u.y - 1.0).abs());
        assert!((a - b).abs() < 1e-4 || (area - PI).abs() < 1e-5, "{u} {area}");
    }
}

#[test]
fn hemispheres_are_covered_by_cosine() {
    let cell = |u| {
        let d = cosine_hemisphere(u);
        bin(1.0 - d.z * d.z, 16) * 16 + bin(angle(d.x, d.y), 16)
    };
    assert!(unevenness(256, cell).abs() < 4.0);
    // Moments of cos theta / pi: 2/3, 1/2; and the solid angle, as the mean of 1 / density.
    assert!((mean(|u| cosine_hemisphere(u).z) - 2.0 / 3.0).abs() < 1e-4);
    assert!((mean(|u| cosine_hemisphere(u).z.powi(2)) - 0.5).abs() < 1e-4);
    assert!((mean(|u| f64::from(u8::from(cosine_hemisphere(u).z > 0.1)) / (cosine_hemisphere(u).z / PI)) / (0.9 * TAU) - 1.0).abs() < 1e-3);
    assert!(edges().map(cosine_hemisphere).all(|d| d.z > 1e-8 && (d.length() - 1.0).abs() < 1e-15));
}

#[test]
fn spheres_are_covered_evenly() {
    let cell = |u| {
        let d = uniform_sphere(u);
        bin(d.z * 0.5 + 0.5, 16) * 16 + bin(angle(d.x, d.y), 16)
    };
    assert!(unevenness(256, cell).abs() < 4.0);
    assert!(mean(uniform_sphere).length() < 1e-3);
    assert!((mean(|u| uniform_sphere(u) * uniform_sphere(u)) - DVec3::splat(1.0 / 3.0)).length() < 1e-3);
    assert!(edges().map(uniform_sphere).all(|d| (d.length() - 1.0).abs() < 1e-15));
}

#[test]
fn cones_are_covered_evenly_even_tiny_ones() {
    for sin2 in [1.0, 0.5, 1e-3, 1e-10, 1e-20, 1e-40] {
        let height = sin2 / (1.0 + f64::sqrt(1.0 - sin2));
        // The height by the sine, for 1 - z of a tiny cone is lost.
        let depth = |d: DVec3| d.truncate().length_squared() / (1.0 + d.z) / height;
        let cell = |u| {
            let d = uniform_cone(u, sin2);
            bin(depth(d), 16) * 16 + bin(angle(d.x, d.y), 16)
        };
        assert!(unevenness(256, cell).abs() < 4.0, "{sin2}");
        assert!((uniform_cone_pdf(sin2) * TAU * height - 1.0).abs() < 1e-15);
        let within = |d: DVec3| d.z >= 0.0 && (d.length() - 1.0).abs() < 1e-15 && depth(d) < 1.0 + 1e-14;
        assert!(edges().map(|u| uniform_cone(u, sin2)).all(within));
    }
    assert!(edges().all(|u| uniform_cone(u, 0.0) == DVec3::Z));
    assert!(edges().all(|u| uniform_cone(u, 1.5).is_finite() && uniform_cone(u, -1.0) == DVec3::Z));
}

#[test]
fn triangles_are_covered_evenly() {
    // Cells of equal area: by the fraction of the area towards a corner, (1 - b0)^2, and across it.
    let cell = |u| {
        let [a, b, c] = uniform_triangle(u);
        bin((1.0 - a) * (1.0 - a), 16) * 16 + bin(b / (b + c), 16)
    };
    assert!(unevenness(256, cell).abs() < 4.0);
    for i in 0..3 {
        assert!((mean(|u| uniform_triangle(u)[i]) - 1.0 / 3.0).abs() < 1e-4);
        assert!((mean(|u| uniform_triangle(u)[i] * uniform_triangle(u)[(i + 1) % 3]) - 1.0 / 12.0).abs() < 1e-4);
    }
    let within = |b: [f64; 3]| b.iter().all(|&x| (0.0..=1.0).contains(&x)) && (b.iter().sum::<f64>() - 1.0).abs() < 1e-15;
    assert!(edges().chain(points()).map(uniform_triangle).all(within));
}
