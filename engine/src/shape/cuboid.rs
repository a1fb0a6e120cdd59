//! Boxes along the axes.

use glam::{DVec2, DVec3};

use super::{Bounds, Point, Ray};
use crate::math::{UNIT, max_abs};

/// A box along the axes of its coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    /// The corner with the lowest coordinates.
    pub min: DVec3,
    /// The corner with the highest coordinates.
    pub max: DVec3,
}

impl Cuboid {
    /// The box itself.
    pub fn bounds(&self) -> Bounds {
        Bounds { min: self.min, max: self.max }
    }

    /// Both crossings of the line, nearer first, each with its face: `2 axis` for the lower, `2 axis + 1` for the upper (Kay and Kajiya's slabs).
    #[inline(always)]
    pub fn crossings(&self, origin: DVec3, direction: DVec3) -> Option<[(f64, u32); 2]> {
        let mut near = (f64::NEG_INFINITY, 0);
        let mut far = (f64::INFINITY, 0);
        for axis in 0..3u32 {
            let a = axis as usize;
            let (o, d) = (origin[a], direction[a]);
            let (to_min, to_max) = (self.min[a] - o, self.max[a] - o);
            if d == 0.0 {
                if to_min > 0.0 || to_max < 0.0 {
                    return None;
                }
                continue;
            }
            let (entry, exit) = if d > 0.0 {
                ((to_min / d, 2 * axis), (to_max / d, 2 * axis + 1))
            } else {
                ((to_max / d, 2 * axis + 1), (to_min / d, 2 * axis))
            };
            if entry.0 > near.0 {
                near = entry;
            }
            if exit.0 < far.0 {
                far = exit;
            }
        }
        (near.0 <= far.0).then_some([near, far])
    }

    /// The nearest hit and its face.
    #[inline(always)]
    pub fn closest(&self, ray: &Ray) -> Option<(f64, u32)> {
        let [near, far] = self.crossings(ray.origin, ray.direction)?;
        let hit = if near.0 > 0.0 { near } else { far };
        (hit.0 > 0.0 && hit.0 < ray.t_max).then_some(hit)
    }

    /// The surface at a hit on a face: the point lies exactly on the face. Its uv run from 0 to 1 across every face, v = 0 at the top of the
    /// sides.
    #[inline(always)]
    pub fn point(&self, ray: &Ray, t: f64, face: u32) -> Point {
        let (axis, upper) = ((face / 2) as usize, face % 2 == 1);
        let mut position = ray.at(t).clamp(self.min, self.max);
        position[axis] = if upper { self.max[axis] } else { self.min[axis] };
        let mut normal = DVec3::ZERO;
        normal[axis] = if upper { 1.0 } else { -1.0 };
        // The face is exact; the rest covers rounding when a ray starts beside it.
        let error = 16.0 * UNIT * (max_abs(position) + max_abs(self.max.max(-self.min)));
        let across = (position - self.min) / (self.max - self.min);
        let uv = match face {
            0 => DVec2::new(across.z, 1.0 - across.y),
            1 => DVec2::new(1.0 - across.z, 1.0 - across.y),
            2 => DVec2::new(across.x, 1.0 - across.z),
            3 => DVec2::new(across.x, across.z),
            4 => DVec2::new(1.0 - across.x, 1.0 - across.y),
            _ => DVec2::new(across.x, 1.0 - across.y),
        };
        Point { position, error, normal, uv }
    }

    /// How the position changes with u and with v on a face.
    pub fn along_uv(&self, face: u32) -> [DVec3; 2] {
        let DVec3 { x, y, z } = self.max - self.min;
        let (right, up, front) = (DVec3::X * x, DVec3::Y * y, DVec3::Z * z);
        match face {
            0 => [front, -up],
            1 => [-front, -up],
            2 => [right, -front],
            3 => [right, front],
            4 => [-right, -up],
            _ => [right, -up],
        }
    }
}
