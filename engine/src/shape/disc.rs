//! Flat circles.

use glam::{DVec2, DVec3};

use super::{Bounds, Point, Ray};
use crate::math::{UNIT, max_abs, orthonormal_basis};

/// A flat circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Middle.
    pub center: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Above 0.
    pub radius: f64,
}

impl Disc {
    /// The box around it: along an axis, a circle reaches `radius sin(angle between axis and normal)`.
    pub fn bounds(&self) -> Bounds {
        let DVec3 { x, y, z } = self.normal * self.normal;
        // Of the other two components: 1 - x^2 would lose a slight tilt.
        let reach = DVec3::new(y + z, z + x, x + y).map(f64::sqrt) * self.radius;
        Bounds { min: self.center - reach, max: self.center + reach }
    }

    /// The hit of a ray, where there is one.
    #[inline(always)]
    pub fn closest(&self, ray: &Ray) -> Option<f64> {
        let t = self.normal.dot(self.center - ray.origin) / self.normal.dot(ray.direction);
        let inside = (self.flattened(ray.at(t)) - self.center).length_squared() <= self.radius * self.radius;
        (inside && t > 0.0 && t < ray.t_max).then_some(t)
    }

    /// The surface at a hit. Its uv run from 0 to 1 across the diameter; v = 0 lies at the top where the disc stands upright.
    #[inline(always)]
    pub fn point(&self, ray: &Ray, t: f64) -> Point {
        let position = self.flattened(ray.at(t));
        let error = 16.0 * UNIT * (max_abs(position) + max_abs(self.center));
        Point { position, error, normal: self.normal, uv: self.uv(position) }
    }

    /// Texture coordinates of a point of the disc.
    #[inline(always)]
    pub fn uv(&self, position: DVec3) -> DVec2 {
        let (right, up) = self.axes();
        let across = (position - self.center) / (2.0 * self.radius);
        DVec2::new(0.5 + across.dot(right), 0.5 - across.dot(up))
    }

    /// How the position changes with u and with v.
    pub fn along_uv(&self) -> [DVec3; 2] {
        let (right, up) = self.axes();
        [right * (2.0 * self.radius), up * (-2.0 * self.radius)]
    }

    fn flattened(&self, point: DVec3) -> DVec3 {
        point - self.normal * self.normal.dot(point - self.center)
    }

    /// Right and up as seen by one who faces the disc with +y upright; for a disc that lies flat, u and v run along x and z.
    fn axes(&self) -> (DVec3, DVec3) {
        let right = DVec3::Y.cross(self.normal);
        if right.length_squared() > 1e-12 {
            let right = right.normalize();
            (right, self.normal.cross(right))
        } else if self.normal.y.abs() == 1.0 {
            (DVec3::X, DVec3::NEG_Z)
        } else {
            orthonormal_basis(self.normal)
        }
    }
}
