//! Cameras.

use serde::{Deserialize, Serialize};

/// How the world is projected on the film. Every camera looks from `eye` to `look_at`; the film's first row is its top.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Camera {
    /// A pinhole, or a thin lens that is sharp at one distance alone, with square pixels.
    Perspective {
        /// Position of the pinhole, or the lens's centre.
        eye: [f64; 3],
        /// A point that falls on the middle of the film; differs from `eye`.
        look_at: [f64; 3],
        /// The direction that is upright on the film; not parallel to the view.
        up: [f64; 3],
        /// Full horizontal field of view in degrees, in (0, 180): that of the pinhole, and so of the plane in focus.
        horizontal_fov: f64,
        /// Radius of the lens's opening in scene units, 0 to 1e75: focal length over twice the f-number. 0 is a pinhole, for which everything
        /// is sharp.
        lens_radius: f64,
        /// Distance in scene units, along the axis of view, from `eye` to the plane that is sharp; finite and above 0.
        focus_distance: f64,
    },
    /// Parallel rays with square pixels: size does not depend on distance.
    Orthographic {
        /// The middle of the film, which stands in the world: what lies behind it is not seen.
        eye: [f64; 3],
        /// A point that falls on the middle of the film; differs from `eye`.
        look_at: [f64; 3],
        /// The direction that is upright on the film; not parallel to the view.
        up: [f64; 3],
        /// Scene units that the film is wide, above 0 to 1e75.
        width: f64,
    },
    /// Everything around a point by longitude and latitude: the film is 360 degrees wide and 180 degrees high, so that pixels are square on a film
    /// that is twice as wide as high.
    Panoramic {
        /// From where it is seen.
        eye: [f64; 3],
        /// A point that falls on the middle of the film; differs from `eye`.
        look_at: [f64; 3],
        /// The direction that is upright in the middle of the film; not parallel to the view. It falls on the first row if it is perpendicular to
        /// the view; otherwise the panorama is tilted.
        up: [f64; 3],
    },
}

impl Camera {
    /// A perspective for which everything is sharp.
    pub fn pinhole(eye: [f64; 3], look_at: [f64; 3], up: [f64; 3], horizontal_fov: f64) -> Self {
        Self::Perspective { eye, look_at, up, horizontal_fov, lens_radius: 0.0, focus_distance: 1.0 }
    }
}
