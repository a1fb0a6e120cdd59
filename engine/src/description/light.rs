//! Lights that stand in the scene by themselves.

use serde::{Deserialize, Serialize};

use super::{Rgb, SourceId};

/// A light source without extent, or infinitely far away. Surfaces that shine have a material that says so.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Light {
    /// Shines from a point to all sides.
    Point {
        /// Position in the world.
        position: [f64; 3],
        /// With [`Falloff::InverseSquare`], radiant intensity (power per steradian): a white diffuse surface that faces the light at distance
        /// r shows radiance `intensity / (pi r^2)`. With [`Falloff::None`], that surface shows radiance `intensity` at any distance.
        intensity: Rgb,
        /// How the light weakens with distance.
        falloff: Falloff,
        /// Where the script made it.
        #[serde(skip)]
        source: SourceId,
    },
    /// Shines from infinitely far away.
    Directional {
        /// The direction in which the light travels; any length but 0.
        direction: [f64; 3],
        /// Irradiance on a surface that faces the light: a white diffuse surface shows radiance `irradiance / pi`.
        irradiance: Rgb,
        /// Angle in degrees, in [0, 180), across which it is spread evenly, as the sun's is across 0.533; 0 casts hard shadows. For `path`.
        angle: f64,
        /// Where the script made it.
        #[serde(skip)]
        source: SourceId,
    },
    /// Shines from a point into a cone.
    Spot {
        /// Position in the world.
        position: [f64; 3],
        /// The middle of the cone; any length but 0.
        direction: [f64; 3],
        /// Radiant intensity (power per steradian) inside the inner cone.
        intensity: Rgb,
        /// Angle in degrees between the middle and where it begins to weaken, in [0, `outer`].
        inner: f64,
        /// Angle in degrees between the middle and where it ends, in (0, 180].
        outer: f64,
        /// Where the script made it.
        #[serde(skip)]
        source: SourceId,
    },
}

/// How a point light weakens with distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Falloff {
    /// With the square of the distance, as light does.
    InverseSquare,
    /// Not at all: a convention of older ray tracers, for comparison with them.
    None,
}
