//! Spheres.

use glam::{DVec2, DVec3};

use super::{Bounds, Point, Ray};
use crate::math::{UNIT, acos, atan2, max_abs};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// The direction of a vector whose length is known but for rounding: one step of Newton's method for `1 / sqrt(x)` instead of a root and a division.
#[inline(always)]
fn unit(v: DVec3, length: f64) -> DVec3 {
    /// A step leaves 3/8 of the square of the error: less than 2^-53.
    const CLOSE: f64 = 1.0 / (1 << 26) as f64;
    let nearly = v * (1.0 / length);
    let excess = nearly.length_squared() - 1.0;
    // Not so where the sphere is tiny and far away, or a tiny radius has no reciprocal.
    if excess.abs() < CLOSE { nearly * (1.0 - 0.5 * excess) } else { v.normalize() }
}

/// All points at `radius` from `center`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Middle.
    pub center: DVec3,
    /// Above 0.
    pub radius: f64,
}

impl Sphere {
    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        Bounds { min: self.center - self.radius, max: self.center + self.radius }
    }

    /// Both crossings of the line, nearer first, unless both lie behind the origin, by the numerically robust form of Haines, Günther, Akenine-Möller, "Precision Improvements for
    /// Ray/Sphere Intersection" (Ray Tracing Gems, ch. 7): the discriminant comes from the distance of the centre to the line, so
    /// that nothing cancels however far or small the sphere is.
    ///
    /// `UNIT_LENGTH` says that the direction is a unit vector, which saves a division.
    #[inline(always)]
    pub fn crossings<const UNIT_LENGTH: bool>(&self, origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
        let f = origin - self.center;
        let a = if UNIT_LENGTH { 1.0 } else { direction.length_squared() };
        let b = -f.dot(direction);
        let c = f.length_squared() - self.radius * self.radius;
        // Outside and going away: both crossings lie behind.
        if b <= 0.0 && c > 0.0 {
            return None;
        }
        let foot = f + direction * (if UNIT_LENGTH { b } else { b / a });
        let discriminant = self.radius * self.radius - foot.length_squared();
        if discriminant < 0.0 {
            return None;
        }
        let root = if UNIT_LENGTH { discriminant.sqrt() } else { (a * discriminant).sqrt() };
        let q = b + root.copysign(b);
        let (t0, t1) = (c / q, if UNIT_LENGTH { q } else { q / a });
        Some(if t0 < t1 { [t0, t1] } else { [t1, t0] })
    }

    /// The nearest hit.
    #[inline(always)]
    pub fn closest<const UNIT_LENGTH: bool>(&self, ray: &Ray) -> Option<f64> {
        let [t0, t1] = self.crossings::<UNIT_LENGTH>(ray.origin, ray.direction)?;
        let t = if t0 > 0.0 { t0 } else { t1 };
        (t > 0.0 && t < ray.t_max).then_some(t)
    }

    /// The surface at a hit: the point of the ray is moved along the radius onto the sphere.
    #[inline(always)]
    pub fn point(&self, ray: &Ray, t: f64) -> Point {
        let normal = unit(ray.at(t) - self.center, self.radius);
        let position = self.center + normal * self.radius;
        // Rounding of centre, radius and position, and what a later intersection adds: |f|^2 - r^2 is wrong by up to 8 u r^2.
        let error = 16.0 * UNIT * (max_abs(position) + max_abs(self.center) + self.radius);
        Point { position, error, normal, uv: DVec2::ZERO }
    }

    /// Longitude and latitude of a unit normal, each in [0, 1]: (0.5, 0.5) faces +z, u grows towards +x, v from the north pole (+y) to the
    /// south pole, so that an image is seen upright and unmirrored from outside.
    pub fn uv(normal: DVec3) -> DVec2 {
        DVec2::new(0.5 + atan2(normal.x, normal.z) * (0.5 * FRAC_1_PI), acos(normal.y.clamp(-1.0, 1.0)) * FRAC_1_PI)
    }

    /// How the position changes with u and with v where the unit normal is this; u leads nowhere at the poles.
    pub fn along_uv(&self, normal: DVec3) -> [DVec3; 2] {
        let from_axis = DVec2::new(normal.x, normal.z).length();
        if from_axis == 0.0 {
            return [DVec3::ZERO; 2];
        }
        let (east, height) = (DVec3::new(normal.z, 0.0, -normal.x), normal.y / from_axis);
        [east * (TAU * self.radius), DVec3::new(normal.x * height, -from_axis, normal.z * height) * (PI * self.radius)]
    }
}
