//! What surrounds the scene.

use serde::{Deserialize, Serialize};

use super::{AssetId, Rgb, SourceId};

/// Radiance of rays that leave the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Environment {
    /// The same from all sides.
    Constant(Rgb),
    /// A picture of the surroundings in latitude and longitude: its middle lies in the direction -z, its right in +x, its top in +y.
    Image {
        /// A Radiance HDR, PNG or JPEG file.
        file: AssetId,
        /// Multiplies its radiance.
        scale: Rgb,
        /// Degrees by which it is turned about +y, counter-clockwise seen from above.
        rotation: f64,
        /// Where the script made it.
        #[serde(skip)]
        source: SourceId,
    },
    /// A clear sky under the sun, whose disc is seen too.
    Sky {
        /// Towards the sun; any length but 0.
        sun: [f64; 3],
        /// Haze: 2 is clear, 10 is hazy.
        turbidity: f64,
        /// Of the ground that is seen below the horizon.
        ground: Rgb,
        /// Multiplies all radiance.
        scale: f64,
        /// Whether the sun's disc is there.
        disc: bool,
        /// Where the script made it.
        #[serde(skip)]
        source: SourceId,
    },
}

impl Default for Environment {
    fn default() -> Self {
        Self::Constant([0.0; 3])
    }
}
