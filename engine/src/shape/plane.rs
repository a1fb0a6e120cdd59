//! Infinite planes.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::{Point, Ray};
use crate::math::{UNIT, max_abs, orthonormal_basis};

/// An infinite plane, in world coordinates: an affine map of a plane is a plane, so transforms are applied once, when a scene is compiled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point of the plane.
    pub point: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// `normal . p` of all points p of the plane.
    pub offset: f64,
    /// `u = u_axis . p + uv_offset.x`.
    pub u_axis: DVec3,
    /// `v = v_axis . p + uv_offset.y`.
    pub v_axis: DVec3,
    /// See the axes.
    pub uv_offset: DVec2,
}

impl Plane {
    /// The plane through `point` with a normal of any length but 0. Texture coordinates are scene units along two axes of the plane; for
    /// the normal (0, 1, 0) they are exactly x and z.
    pub fn new(point: DVec3, normal: DVec3) -> Self {
        let normal = normal.normalize();
        let (u_axis, v_axis) = if normal == DVec3::Y { (DVec3::X, DVec3::Z) } else { orthonormal_basis(normal) };
        Self { point, normal, offset: normal.dot(point), u_axis, v_axis, uv_offset: DVec2::ZERO }
    }

    /// The image of the plane under an invertible map, with its texture coordinates.
    pub fn transformed(&self, to_world: &DAffine3, to_object: &DAffine3) -> Self {
        let covector = to_object.matrix3.transpose();
        let moved = DVec2::new(self.u_axis.dot(to_object.translation), self.v_axis.dot(to_object.translation));
        let is_moved_only = to_world.matrix3 == DMat3::IDENTITY;
        let normal = if is_moved_only { self.normal } else { (covector * self.normal).normalize() };
        let point = to_world.transform_point3(self.point);
        Self {
            point,
            normal,
            offset: normal.dot(point),
            u_axis: covector * self.u_axis,
            v_axis: covector * self.v_axis,
            uv_offset: self.uv_offset + moved,
        }
    }

    /// The hit of a ray, where there is one.
    #[inline(always)]
    pub fn closest(&self, ray: &Ray) -> Option<f64> {
        let height = self.offset - self.normal.dot(ray.origin);
        let approach = self.normal.dot(ray.direction);
        // Most rays that leave the plane are told apart without the division.
        if (height > 0.0) != (approach > 0.0) {
            return None;
        }
        let t = height / approach;
        (t > 0.0 && t < ray.t_max).then_some(t)
    }

    /// The surface at a hit: the point of the ray is moved along the normal onto the plane.
    #[inline(always)]
    pub fn point(&self, ray: &Ray, t: f64) -> Point {
        let along = ray.at(t);
        let position = along - self.normal * (self.normal.dot(along) - self.offset);
        let error = 16.0 * UNIT * (max_abs(position) + max_abs(self.point));
        let uv = DVec2::new(self.u_axis.dot(position), self.v_axis.dot(position)) + self.uv_offset;
        Point { position, error, normal: self.normal, uv }
    }

    /// How the position changes with u and with v.
    pub fn along_uv(&self) -> [DVec3; 2] {
        // Within the plane, along lines of the same v, and of the same u.
        let (along_u, along_v) = (self.v_axis.cross(self.normal), self.normal.cross(self.u_axis));
        [along_u / self.u_axis.dot(along_u), along_v / self.v_axis.dot(along_v)]
    }
}
