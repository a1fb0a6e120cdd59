//! Maps of the unit square to discs, spheres, cones and triangles that keep area: evenly distributed numbers in, evenly distributed points out.
//!
//! All are continuous or nearly so, so that stratified numbers give stratified points, and finite on all of [0, 1)^2. Directions are about +z.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_4, TAU};

/// Sine and cosine of `u` turns, 2 pi u radians, to within 4e-16 each, for |u| < 2^48.
///
/// The angle is reduced to an eighth of a turn on either side of a quarter, which is exact in turns; no table, no branches.
#[inline(always)]
pub fn sin_cos_of_turn(u: f64) -> (f64, f64) {
    // Adding 1.5 * 2^52 rounds to an integer and leaves it in the lowest bits: one instruction everywhere, where `round` is a call on some CPUs.
    const ROUND: f64 = 1.5 * (1u64 << 52) as f64;
    let rounded = u * 4.0 + ROUND;
    let (sin, cos) = sin_cos_of_eighth((u - (rounded - ROUND) * 0.25) * TAU);
    let quarter = rounded.to_bits();
    let (sin, cos) = if quarter & 1 == 0 { (sin, cos) } else { (cos, sin) };
    // The sine is negative in quarters 2 and 3, the cosine in 1 and 2.
    let negate = |x: f64, quarter: u64| f64::from_bits(x.to_bits() ^ (quarter & 2) << 62);
    (negate(sin, quarter), negate(cos, quarter.wrapping_add(1)))
}

/// Sine and cosine of an angle within [-pi/4, pi/4]: Taylor series, of which the first terms left out are (pi/4)^17 / 17! = 5e-17 and
/// (pi/4)^18 / 18! = 2e-18. Powers are grouped (Estrin's scheme), for products that wait for each other take longer than the sums.
#[inline(always)]
fn sin_cos_of_eighth(t: f64) -> (f64, f64) {
    /// 1 / n! with the sign of the term.
    const fn term(n: u32) -> f64 {
        let (mut factorial, mut i) = (1u64, 2);
        while i <= n as u64 {
            factorial *= i;
            i += 1;
        }
        if n & 2 == 0 { 1.0 / factorial as f64 } else { -1.0 / factorial as f64 }
    }
    const T: [f64; 17] = {
        let mut terms = [0.0; 17];
        let mut n = 0;
        while n < 17 {
            terms[n] = term(n as u32);
            n += 1;
        }
        terms
    };
    let t2 = t * t;
    let t4 = t2 * t2;
    let t8 = t4 * t4;
    let sin = (T[3] + T[5] * t2) + (T[7] + T[9] * t2) * t4 + ((T[11] + T[13] * t2) + T[15] * t4) * t8;
    let cos = (T[4] + T[6] * t2) + (T[8] + T[10] * t2) * t4 + ((T[12] + T[14] * t2) + T[16] * t4) * t8;
    (t + t * t2 * sin, 1.0 - (0.5 * t2 - t4 * cos))
}

/// A point of the unit disc, density 1 / pi: squares about the centre become circles (Shirley & Chiu, "A Low Distortion Map Between Disk and
/// Square", 1997).
#[inline]
pub fn concentric_disc(u: DVec2) -> DVec2 {
    let (x, y) = (2.0 * u.x - 1.0, 2.0 * u.y - 1.0);
    let steep = y.abs() > x.abs();
    let (radius, along) = if steep { (y, x) } else { (x, y) };
    if radius == 0.0 {
        return DVec2::ZERO;
    }
    // A negative radius turns the quadrant of +x to that of -x.
    let (sin, cos) = sin_cos_of_eighth(FRAC_PI_4 * (along / radius));
    if steep { DVec2::new(radius * sin, radius * cos) } else { DVec2::new(radius * cos, radius * sin) }
}

/// The least cosine of a direction that [`cosine_hemisphere`] gives, 2^-26.5: on the horizon, the density would be 0.
const LEAST_COSINE: f64 = 1.053_671_212_772_350_8e-8;

/// A direction about +z, density cos theta / pi per steradian: the disc lifted to the hemisphere (Malley's method; pbrt-v4, A.5.3). Its cosine is
/// at least 1e-8.
#[inline]
pub fn cosine_hemisphere(u: DVec2) -> DVec3 {
    let disc = concentric_disc(u);
    // By the square that the circle was, so that nothing cancels near the rim.
    let radius = (2.0 * u.x - 1.0).abs().max((2.0 * u.y - 1.0).abs());
    let z = ((1.0 - radius) * (1.0 + radius)).max(0.0).sqrt();
    DVec3::new(disc.x, disc.y, z.max(LEAST_COSINE))
}

/// A direction of the whole sphere, density 1 / (4 pi) per steradian: `u.x` is the part of the sphere above it, `u.y` its longitude in turns
/// (Archimedes' map of the cylinder).
#[inline]
pub fn uniform_sphere(u: DVec2) -> DVec3 {
    let radius = 2.0 * (u.x * (1.0 - u.x)).max(0.0).sqrt();
    let (sin, cos) = sin_cos_of_turn(u.y);
    DVec3::new(radius * cos, radius * sin, 1.0 - 2.0 * u.x)
}

/// A direction of the cone of half angle `theta_max` <= pi / 2 about +z, density [`uniform_cone_pdf`]. The cone is given by
/// sin^2(theta_max), for a sphere of radius r seen from distance d (r/d)^2, in which small cones lose nothing.
///
/// The disc of [`concentric_disc`] is wrapped about the cap: heights are proportional to squared radii in both.
#[inline]
pub fn uniform_cone(u: DVec2, sin2_theta_max: f64) -> DVec3 {
    let height = cap_height(sin2_theta_max);
    let disc = concentric_disc(u);
    let depth = disc.length_squared().min(1.0) * height;
    // sin theta = sqrt(depth (2 - depth)), of which sqrt(depth) is the disc's radius times sqrt(height).
    let scale = (height * (2.0 - depth)).sqrt();
    DVec3::new(disc.x * scale, disc.y * scale, 1.0 - depth)
}

/// The density of [`uniform_cone`] per steradian, 1 / (2 pi (1 - cos theta_max)): infinite for a cone of no width.
#[inline]
pub fn uniform_cone_pdf(sin2_theta_max: f64) -> f64 {
    1.0 / (TAU * cap_height(sin2_theta_max))
}

/// 1 - cos theta by sin^2 theta, for theta <= pi / 2.
#[inline(always)]
fn cap_height(sin2_theta: f64) -> f64 {
    let sin2 = sin2_theta.clamp(0.0, 1.0);
    sin2 / (1.0 + (1.0 - sin2).sqrt())
}

/// Barycentric coordinates of a point of a triangle, evenly by area; they are not negative and sum to 1. The square is folded along its
/// diagonal (Heitz, "A Low-Distortion Map Between Triangle and Square", 2019).
#[inline]
pub fn uniform_triangle(u: DVec2) -> [f64; 3] {
    let (less, more) = if u.x < u.y { (u.x, u.y) } else { (u.y, u.x) };
    let half = less * 0.5;
    // The sum of the two is the greater number, so that the third loses nothing.
    if u.x < u.y { [half, u.y - half, 1.0 - more] } else { [u.x - half, half, 1.0 - more] }
}

#[cfg(test)]
mod tests;
