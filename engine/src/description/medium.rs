//! What fills space.

use serde::{Deserialize, Serialize};

use super::Rgb;

/// A homogeneous participating medium. Coefficients are per scene unit of length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Medium {
    /// Absorption: after a length d, `exp(-absorption d)` of the light is left.
    pub absorption: Rgb,
    /// Scattering.
    pub scattering: Rgb,
    /// Mean cosine of scattering (Henyey and Greenstein), in (-1, 1); 0 scatters evenly to all sides.
    pub anisotropy: f64,
}
