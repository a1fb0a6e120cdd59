//! Lights that stand in a model's file.

use glam::DVec3;

/// A light in model coordinates. Numbers are the file's, whose units are photometric: candela and lux.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelLight {
    /// Linear Rec. 709, finite, at least 0. Of points and spots, intensity (power per solid angle); of directional lights, irradiance.
    pub strength: [f32; 3],
    /// Its kind and place.
    pub kind: ModelLightKind,
}

/// Where a light stands and where it shines. Positions and directions are finite, directions not 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModelLightKind {
    /// From a point to all sides.
    Point {
        /// Place.
        position: DVec3,
    },
    /// From a point into a cone.
    Spot {
        /// Place.
        position: DVec3,
        /// The middle of the cone.
        direction: DVec3,
        /// Radians between the middle and where it begins to weaken, in [0, `outer`].
        inner: f64,
        /// Radians between the middle and where it ends, in (0, pi / 2].
        outer: f64,
    },
    /// From infinitely far away.
    Directional {
        /// In which the light travels.
        direction: DVec3,
    },
}
