//! Points of a rectangle, evenly by the solid angle under which they are seen (Ureña, Fajardo & King, "An Area-Preserving Parametrization for
//! Spherical Rectangles", 2013; pbrt-v4, A.5.6).
//!
//! Written by the angles' excess over right ones, which stays exact where the rectangle is small, and through atan2, which stays exact where
//! the angles come near 0 and pi.

use crate::{math::atan2, sampling::warp::sin_cos_of_turn};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// The least solid angle, in steradians, worth the effort: below, sampling by area is as good.
const LEAST: f64 = 1e-4;

/// The greatest solid angle: seen from so close to its plane, a rectangle fills a half space, and the map has no digits left.
const GREATEST: f64 = TAU - 1e-3;

/// The largest cosine between edges that count as perpendicular.
const SKEW: f64 = 1e-6;

/// A rectangle seen from a point.
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    corner: DVec3,
    edges: [DVec3; 2],
    /// Coordinates of the corner and of the opposite one along the edges, from the foot of the point's perpendicular, in units of its length.
    min: DVec2,
    max: DVec2,
    /// Sines of the tilt of the planes through the point and the lower and upper edges along x: heights of the planes' normals.
    lower: f64,
    upper: f64,
    /// Cosine of the tilt of the lower plane.
    cos_lower: f64,
    /// Sum of the excess over pi / 2 of the angles at the two corners of least x.
    excess: f64,
    solid_angle: f64,
}

impl SphericalRectangle {
    /// The rectangle of a corner and two perpendicular edges, seen from a point. None where it cannot be sampled well and the caller does
    /// better by area: if its solid angle is below 1e-4 or within 1e-3 of 2 pi, if it is seen edge on, or if its edges are not
    /// perpendicular.
    pub fn new(corner: DVec3, edge_u: DVec3, edge_v: DVec3, from: DVec3) -> Option<Self> {
        let (width, height) = (edge_u.length(), edge_v.length());
        let (x, y) = (edge_u / width, edge_v / height);
        let towards = corner - from;
        let distance = towards.dot(x.cross(y)).abs();
        let min = DVec2::new(towards.dot(x), towards.dot(y)) / distance;
        let max = min + DVec2::new(width, height) / distance;
        // Negated, so that NaNs of degenerate edges end here too.
        if !(x.dot(y).abs() < SKEW && min.is_finite() && max.is_finite()) {
            return None;
        }
        // Planes through the point and the edges at y = min, x = max, y = max, x = min, in turn; normals point inwards up to the sign of their height.
        let planes = [Plane::new(-min.y), Plane::new(max.x), Plane::new(max.y), Plane::new(-min.x)];
        let right = excess(planes[0], planes[1], planes[2]);
        let left = excess(planes[2], planes[3], planes[0]);
        let solid_angle = right + left;
        let [lower, _, upper, _] = planes;
        (LEAST..=GREATEST).contains(&solid_angle).then_some(Self {
            corner,
            edges: [edge_u, edge_v],
            min,
            max,
            lower: lower.sin,
            upper: upper.sin,
            cos_lower: lower.cos,
            excess: left,
            solid_angle,
        })
    }

    /// The solid angle in steradians; the density of [`SphericalRectangle::sample`] per steradian is its inverse.
    #[inline(always)]
    pub fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// A point of the rectangle, evenly by solid angle.
    #[inline]
    pub fn sample(&self, u: DVec2) -> DVec3 {
        let at = self.coordinates(u);
        self.corner + self.edges[0] * at.x + self.edges[1] * at.y
    }

    /// The same point by its position along the two edges, within [0, 1].
    #[inline]
    pub fn coordinates(&self, u: DVec2) -> DVec2 {
        let x = self.column(u.x);
        let y = self.row(x, u.y);
        ((DVec2::new(x, y) - self.min) / (self.max - self.min)).clamp(DVec2::ZERO, DVec2::ONE)
    }

    /// The x with the fraction `u` of the solid angle below it (section 4.1 there, with angles counted from pi).
    #[inline(always)]
    fn column(&self, u: f64) -> f64 {
        let (sin, cos) = sin_cos_of_turn((u * self.solid_angle - self.excess) / TAU);
        // Infinite where x is 0.
        let f = (cos * self.lower + self.upper) / sin;
        let tan2 = (f.abs() - self.cos_lower) * (f.abs() + self.cos_lower);
        let x = 1.0 / tan2.max(0.0).sqrt();
        x.copysign(f).clamp(self.min.x, self.max.x)
    }

    /// The y with the fraction `v` of the great arc at `x` below it (section 4.2 there): its sine is linear in `v`.
    #[inline(always)]
    fn row(&self, x: f64, v: f64) -> f64 {
        let away2 = x * x + 1.0;
        let sine = |y: f64| y / (away2 + y * y).sqrt();
        let (low, high) = (sine(self.min.y), sine(self.max.y));
        let sine = low + (high - low) * v;
        let y = sine * (away2 / ((1.0 - sine) * (1.0 + sine)).max(f64::MIN_POSITIVE)).sqrt();
        y.clamp(self.min.y, self.max.y)
    }
}

/// A plane through the point and an edge: sine and cosine of the tilt of its normal out of the rectangle's plane.
#[derive(Clone, Copy)]
struct Plane {
    sin: f64,
    cos: f64,
}

impl Plane {
    /// The plane through an edge `offset` beside the foot of the perpendicular of length 1.
    fn new(offset: f64) -> Self {
        let cos = 1.0 / (1.0 + offset * offset).sqrt();
        Self { sin: offset * cos, cos }
    }
}

/// The excess over pi of the two angles that three planes in turn enclose. The angle between perpendicular edges has the cosine
/// -(a.sin * b.sin), so its excess over pi / 2 has that as sine; two such are added as complex numbers.
fn excess(a: Plane, b: Plane, c: Plane) -> f64 {
    let complex = |a: Plane, b: Plane| (((a.cos * a.cos) + (a.sin * b.cos) * (a.sin * b.cos)).sqrt(), a.sin * b.sin);
    let ((re1, im1), (re2, im2)) = (complex(a, b), complex(b, c));
    atan2(re1 * im2 + im1 * re2, re1 * re2 - im1 * im2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    /// The solid angle of a rectangle by the midpoint rule, and the means of x and y over it.
    fn brute_force(corner: DVec3, u: DVec3, v: DVec3, from: DVec3) -> (f64, DVec2) {
        let n = 1000;
        let normal = u.cross(v) / f64::from(n * n);
        let (mut sum, mut mean) = (0.0, DVec2::ZERO);
        for i in 0..n {
            for j in 0..n {
                let at = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5) / f64::from(n);
                let d = corner + u * at.x + v * at.y - from;
                let cell = normal.dot(d).abs() / d.length().powi(3);
                sum += cell;
                mean += at * cell;
            }
        }
        (sum, mean / sum)
    }

    /// Rectangles before, beside, oblique, large, small, far: corner, edges, and the point.
    const CASES: [[DVec3; 4]; 6] = [
        [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0), DVec3::new(0.0, 0.0, 1.0)],
        [DVec3::new(3.0, 1.0, 0.0), DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 5.0, 0.0), DVec3::new(0.5, 0.0, -1.0)],
        [DVec3::new(0.0, 0.0, 0.0), DVec3::new(0.6, 0.8, 0.0), DVec3::new(-4.0, 3.0, 0.0), DVec3::new(0.4, -0.3, 0.2)],
        [DVec3::new(-9.0, 2.0, -7.0), DVec3::new(0.0, 0.0, 15.0), DVec3::new(20.0, 0.0, 0.0), DVec3::new(0.0, 3.0, 0.0)],
        [DVec3::new(10.0, 0.0, 0.0), DVec3::new(0.0, 0.3, 0.0), DVec3::new(0.0, 0.0, 0.2), DVec3::new(0.0, 0.0, 0.0)],
        [DVec3::new(1e6, 2e6, 0.0), DVec3::new(1e6, 0.0, 0.0), DVec3::new(0.0, 1e5, 0.0), DVec3::new(0.0, 0.0, 3e5)],
    ];

    fn cases() -> impl Iterator<Item = (SphericalRectangle, [DVec3; 4])> {
        CASES.into_iter().map(|[corner, u, v, from]| (SphericalRectangle::new(corner, u, v, from).unwrap(), [corner, u, v, from]))
    }

    #[test]
    fn solid_angles_and_means_are_those_of_quadrature() {
        for (rectangle, [corner, u, v, from]) in cases() {
            let (solid_angle, mean) = brute_force(corner, u, v, from);
            assert!((rectangle.solid_angle() / solid_angle - 1.0).abs() < 1e-4, "{} {solid_angle}", rectangle.solid_angle());
            let points = (0..1 << 14).map(|i| rectangle.coordinates(Sampler::new(0, (0, 0), i).pair(0)));
            let sampled = points.sum::<DVec2>() / f64::from(1 << 14);
            assert!((sampled - mean).length() < 1e-3, "{sampled} {mean}");
        }
    }

    /// A sixth of the sphere, from the centre of a cube.
    #[test]
    fn the_face_of_a_cube_is_a_sixth_of_the_sphere() {
        let (rectangle, _) = cases().next().unwrap();
        assert!((rectangle.solid_angle() - 4.0 * std::f64::consts::PI / 6.0).abs() < 1e-15);
    }

    /// Cells of the square of numbers map to cells of the rectangle of the same solid angle: chi-square of 2^14 random points in 8 x 8 cells of
    /// the rectangle, whose expectations are their solid angles by a formula of its own (Van Oosterom & Strackee, 1983).
    #[test]
    fn points_are_even_by_solid_angle() {
        let triangle = |a: DVec3, b: DVec3, c: DVec3| {
            let (a, b, c) = (a.normalize(), b.normalize(), c.normalize());
            2.0 * atan2(a.dot(b.cross(c)).abs(), 1.0 + a.dot(b) + b.dot(c) + c.dot(a))
        };
        for (rectangle, [corner, u, v, from]) in cases() {
            let mut counts = [[0.0; 8]; 8];
            for x in 0..1 << 14 {
                let at = rectangle.coordinates(Sampler::new(9, (x, 1), 0).pair(0)) * 8.0;
                counts[(at.x as usize).min(7)][(at.y as usize).min(7)] += 1.0;
            }
            let (mut chi_square, mut cells) = (0.0, 0.0);
            for (i, row) in counts.iter().enumerate() {
                for (j, count) in row.iter().enumerate() {
                    let p = |i: usize, j: usize| corner + u * (i as f64 / 8.0) + v * (j as f64 / 8.0) - from;
                    let (a, b, c, d) = (p(i, j), p(i + 1, j), p(i + 1, j + 1), p(i, j + 1));
                    let expected = (triangle(a, b, c) + triangle(a, c, d)) / rectangle.solid_angle() * f64::from(1 << 14);
                    chi_square += (count - expected) * (count - expected) / expected.max(1.0);
                    cells += 1.0;
                }
            }
            assert!(chi_square < cells + 5.0 * f64::sqrt(2.0 * cells), "{chi_square}");
        }
    }

    #[test]
    fn the_ends_of_the_numbers_are_the_corners() {
        let end = 1.0 - f64::EPSILON / 2.0;
        for (rectangle, [corner, u, v, _]) in cases() {
            for (x, y) in [(0.0, 0.0), (0.0, end), (end, 0.0), (end, end)] {
                let expected = corner + u * x + v * y;
                let tolerance = 1e-6 * (u.length() + v.length());
                assert!((rectangle.sample(DVec2::new(x, y)) - expected).length() < tolerance, "{x} {y}");
            }
        }
    }

    #[test]
    fn what_cannot_be_sampled_well_is_refused() {
        let new = |u, v, from| SphericalRectangle::new(DVec3::ZERO, u, v, from);
        let middle = DVec3::new(0.5, 0.5, 0.0);
        assert!(new(DVec3::X, DVec3::Y, middle + DVec3::Z).is_some());
        assert!(new(DVec3::X, DVec3::new(0.1, 1.0, 0.0), middle + DVec3::Z).is_none(), "skew");
        assert!(new(DVec3::X, DVec3::Y, middle + DVec3::Z * 101.0).is_none(), "far");
        assert!(new(DVec3::X, DVec3::Y, middle + DVec3::Z * 1e-9).is_none(), "near");
        assert!(new(DVec3::X, DVec3::Y, middle).is_none(), "in it");
        assert!(new(DVec3::X, DVec3::Y, DVec3::new(2.0, 0.0, 0.0)).is_none(), "in its plane");
        assert!(new(DVec3::ZERO, DVec3::Y, DVec3::Z).is_none(), "no width");
        assert!(new(DVec3::X, DVec3::NAN, DVec3::Z).is_none(), "NaN");
        assert!(new(DVec3::X, DVec3::Y, DVec3::INFINITY).is_none(), "infinite");
    }
}
