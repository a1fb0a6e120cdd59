//! Cameras.

use serde::{Deserialize, Serialize};

/// How the world is projected on the film. Every camera looks from `eye` to `look_at`; the film's first row is its top.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Camera {
    /// An ideal pinhole with square pixels.
    Perspective {
        /// Position of the pinhole.
        eye: [f64; 3],
        /// A point that falls on the middle of the film; differs from `eye`.
        look_at: [f64; 3],
        /// The direction that is upright on the film; not parallel to the view.
        up: [f64; 3],
        /// Full horizontal field of view in degrees, in (0, 180).
        horizontal_fov: f64,
    },
}
