//! Shapes that few scenes have. All of them stand behind one door that is never inlined, so that scenes without them do not pay for them.

use glam::DVec3;

use super::{Bounds, Cone, Point, Ray, Rectangle};

/// A shape that few scenes have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Other {
    /// A rectangle.
    Rectangle(Rectangle),
    /// A cone or a cylinder.
    Cone(Cone),
}

impl Other {
    /// Scaled about the origin, then moved.
    pub fn moved(&self, scale: f64, by: DVec3) -> Self {
        match self {
            Self::Rectangle(rectangle) => Self::Rectangle(rectangle.moved(scale, by)),
            Self::Cone(cone) => Self::Cone(cone.moved(scale, by)),
        }
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Rectangle(rectangle) => rectangle.bounds(),
            Self::Cone(cone) => cone.bounds(),
        }
    }

    /// The nearest hit and the part of the shape that it is on.
    #[inline(never)]
    pub fn closest(&self, ray: &Ray) -> Option<(f64, u32)> {
        match self {
            Self::Rectangle(rectangle) => rectangle.closest(ray).map(|t| (t, 0)),
            Self::Cone(cone) => cone.closest(ray),
        }
    }

    /// Both crossings of the line, unless both lie behind the origin; infinite for one that is not there.
    #[inline(never)]
    pub fn crossings(&self, ray: &Ray) -> Option<[f64; 2]> {
        match self {
            Self::Rectangle(rectangle) => rectangle.closest(ray).map(|t| [t, f64::INFINITY]),
            Self::Cone(cone) => cone.crossings(ray).map(|crossings| crossings.map(|(t, _)| t)),
        }
    }

    /// The surface at a hit of a part. `textured` asks for its texture coordinates, where they cost much.
    #[inline(never)]
    pub fn point(&self, ray: &Ray, t: f64, part: u32, textured: bool) -> Point {
        match self {
            Self::Rectangle(rectangle) => rectangle.point(ray, t),
            Self::Cone(cone) => cone.point(ray, t, part, textured),
        }
    }

    /// How the position changes with u and with v at a place of a part.
    #[inline(never)]
    pub fn along_uv(&self, position: DVec3, part: u32) -> [DVec3; 2] {
        match self {
            Self::Rectangle(rectangle) => rectangle.along_uv(),
            Self::Cone(cone) => cone.along_uv(position, part),
        }
    }
}
