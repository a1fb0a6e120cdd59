//! Rays.

use glam::{DAffine3, DVec3};

/// A half-line `origin + t direction`, `0 < t < t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Where it goes: a unit vector in the world, of any length in the coordinates of an instance.
    pub direction: DVec3,
    /// Hits at or beyond this are none; may be infinite.
    pub t_max: f64,
    /// The bit of the sphere that it leaves on the outside, and so never meets again; 0 for none. See the list of spheres.
    pub leaves: u64,
}

impl Ray {
    /// A ray without end.
    #[inline]
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, t_max: f64::INFINITY, leaves: 0 }
    }

    /// The point at `t`.
    #[inline]
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }

    /// The ray in other coordinates, where there are no listed spheres; `t` keeps its meaning.
    #[inline]
    pub fn transformed(&self, map: &DAffine3) -> Self {
        Self { origin: map.transform_point3(self.origin), direction: map.transform_vector3(self.direction), t_max: self.t_max, leaves: 0 }
    }
}
