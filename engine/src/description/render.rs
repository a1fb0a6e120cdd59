//! How light is followed through the scene.

use serde::{Deserialize, Serialize};

/// The integrator and its settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Render {
    /// Nearest hit only ("first rank" of the paper): every light shines on it unhindered; mirror and glass show as diffuse of their reflectance.
    Raycast,
    /// Whitted's ray tracing ("higher rank"): nearest hit, a shadow ray to every light, reflected and refracted rays.
    Whitted {
        /// Longest chain of rays, the camera's ray included; at least 1. What a longer chain would bring is left out.
        max_depth: u32,
        /// Whether glass lets shadow rays pass, weakened by its transmittance once at every surface. Not physical: glass then casts no caustic
        /// and no shadow.
        transparent_shadows: bool,
        /// Rays whose weight in the pixel is this or less are not traced; 0 traces all.
        min_weight: f64,
    },
    /// Path tracing: all light, with an error that falls with the number of samples.
    Path {
        /// Longest chain of rays, the camera's ray included; at least 1. What a longer chain would bring is left out: 1 shows only what shines, 2 adds
        /// light that comes straight from the lights.
        max_depth: u32,
        /// Chains at least this long are ended by chance, with no error in the mean (Russian roulette); `max_depth` for never.
        roulette_depth: u32,
        /// Whether light that meets a mesh with vertex normals is shadowed as by the smooth surface that these tell of, and not as by the mesh: without a jagged border between light and
        /// shadow on coarse meshes, but not without bias.
        smooth_terminator: bool,
    },
}
