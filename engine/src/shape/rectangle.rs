//! Rectangles, and parallelograms of any angle.

use glam::{DVec2, DVec3};

use super::{Bounds, Point, Ray};
use crate::math::{UNIT, max_abs};

/// All points `corner + a u + b v` with a and b in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    corner: DVec3,
    /// u and v.
    edges: [DVec3; 2],
    /// `u x v`, made a unit vector.
    normal: DVec3,
    /// Vectors of the plane, the first perpendicular to v, the second to u: along them, the other edge does not count.
    across: [DVec3; 2],
    /// How far u reaches along the first of them, and v along the second.
    widths: [f64; 2],
    /// Sum of the edges, over the sine of their angle: what bounds the error of the normal, times all lengths.
    reach: f64,
}

impl Rectangle {
    /// `None` if an edge is 0, or both are parallel as far as numbers can tell.
    pub fn new(corner: DVec3, u: DVec3, v: DVec3) -> Option<Self> {
        let (long_u, long_v) = (max_abs(u), max_abs(v));
        // Directions of lengths near 1, so that no product leaves the range of numbers.
        let (to_u, to_v) = (u / long_u, v / long_v);
        let normal = to_u.cross(to_v);
        // Each of its components is wrong by up to 3 u, of lengths up to 3.
        let apart = normal.length();
        if !(long_u > 0.0 && long_v > 0.0 && apart > 16.0 * UNIT) {
            return None;
        }
        let normal = normal / apart;
        let across = [to_v.cross(normal), normal.cross(to_u)];
        let sine = apart / (to_u.length() * to_v.length());
        let reach = (long_u + long_v) / sine;
        Some(Self { corner, edges: [u, v], normal, across, widths: [u.dot(across[0]), v.dot(across[1])], reach })
    }

    /// Scaled about the origin, then moved.
    pub fn moved(&self, scale: f64, by: DVec3) -> Self {
        let edges = self.edges.map(|edge| edge * scale);
        let widths = [edges[0].dot(self.across[0]), edges[1].dot(self.across[1])];
        Self { corner: self.corner * scale + by, edges, widths, reach: self.reach * scale, ..*self }
    }

    /// Where both edges begin.
    pub fn corner(&self) -> DVec3 {
        self.corner
    }

    /// u and v.
    pub fn edges(&self) -> [DVec3; 2] {
        self.edges
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        let [u, v] = self.edges;
        Bounds::of([DVec3::ZERO, u, v, u + v].map(|p| self.corner + p))
    }

    /// The hit of a ray, where there is one.
    pub fn closest(&self, ray: &Ray) -> Option<f64> {
        let from_corner = ray.origin - self.corner;
        let t = -self.normal.dot(from_corner) / self.normal.dot(ray.direction);
        let p = from_corner + ray.direction * t;
        let inside = |i: usize| (0.0..=self.widths[i]).contains(&self.across[i].dot(p));
        (inside(0) && inside(1) && t > 0.0 && t < ray.t_max).then_some(t)
    }

    /// The surface at a hit. Its uv run from 0 to 1, u along the first edge, v against the second one: where that points up and the first one to the
    /// right, v = 0 lies at the top, and the normal points at the viewer.
    pub fn point(&self, ray: &Ray, t: f64) -> Point {
        let p = (ray.origin - self.corner) + ray.direction * t;
        let along = |i: usize| self.across[i].dot(p) / self.widths[i];
        let (a, b) = (along(0), along(1));
        let position = self.corner + self.edges[0] * a + self.edges[1] * b;
        let error = 16.0 * UNIT * (max_abs(position) + max_abs(self.corner) + self.reach);
        Point { position, error, normal: self.normal, uv: DVec2::new(a, 1.0 - b) }
    }

    /// How the position changes with u and with v.
    pub fn along_uv(&self) -> [DVec3; 2] {
        [self.edges[0], -self.edges[1]]
    }
}
