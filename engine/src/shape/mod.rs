//! Shapes: one file each, with its intersection in f64.
//!
//! Every intersection reports hits with `0 < t < t_max`, and every point of a hit comes with a bound on its distance from the true surface,
//! so that a ray that leaves it can start beyond the bound: there are no tolerances in scene units anywhere.

pub mod cone;
pub mod cuboid;
pub mod disc;
pub mod other;
pub mod plane;
mod ray;
pub mod rectangle;
pub mod sphere;
mod surface;
pub mod triangle;

pub use cone::Cone;
pub use cuboid::Cuboid;
pub use disc::Disc;
pub use other::Other;
pub use plane::Plane;
pub use ray::Ray;
pub use rectangle::Rectangle;
pub use sphere::Sphere;
pub use surface::Surface;

use glam::{DVec2, DVec3};

/// A point of a shape's surface, in the shape's own coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The position, as near to the surface as f64 allows.
    pub position: DVec3,
    /// Bound on the distance from `position` to the true surface.
    pub error: f64,
    /// Unit normal on the shape's outward side.
    pub normal: DVec3,
    /// Texture coordinates.
    pub uv: DVec2,
}

/// Smallest and largest corner of a box along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest coordinates.
    pub min: DVec3,
    /// Highest coordinates.
    pub max: DVec3,
}

impl Bounds {
    /// Contains nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box around this one and a point.
    pub fn with(self, point: DVec3) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// The smallest box around points.
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with)
    }

    /// The eight corners.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, lo: f64, hi: f64| if i >> bit & 1 == 0 { lo } else { hi };
            DVec3::new(pick(0, self.min.x, self.max.x), pick(1, self.min.y, self.max.y), pick(2, self.min.z, self.max.z))
        })
    }
}
