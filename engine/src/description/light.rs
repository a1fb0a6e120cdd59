//! Lights that stand in the scene by themselves.

use serde::{Deserialize, Serialize};

use super::{Rgb, SourceId};

/// A light source without extent.
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
