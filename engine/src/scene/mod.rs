//! The compiled scene: all that a frame's rays need, immutable and shared by all threads.

mod compile;
mod directions;
mod emitters;
mod error;
mod explain;
mod forest;
mod geometry;
mod identity;
mod inside;
mod joint;
mod models;
mod outlined;
mod place;
mod query;
mod shortcut;
mod statistics;
mod stream;
mod surface;
mod terminator;
mod tracer;
mod unbuilt;
mod visit;
#[cfg(test)]
mod tests;

pub use crate::shape::Surface;
pub use error::{CompileError, Warning};
pub use inside::Inside;
pub use joint::Joint;
pub use query::Hit;
pub use shortcut::Shortcut;
pub use statistics::Statistics;
pub use surface::Crossing;
pub use tracer::{Tracer, Work};
pub use unbuilt::Unbuilt;

use std::sync::OnceLock;

use glam::DVec3;

use crate::{
    camera::Camera,
    description::{Aovs, Film, Quality, Render},
    light::{Caustics, Environment, Light, LightSampler, Sources},
    material::{Material, Medium},
    sampling::PixelFilter,
    shape::Bounds,
    texture::Texture,
};
use geometry::Geometry;

/// A compiled frame, in coordinates that begin at [`Scene::begin`].
#[derive(Debug)]
pub struct Scene {
    /// From where it is seen.
    pub camera: Camera,
    /// All lights.
    pub lights: Vec<Light>,
    /// All materials: those of the description, then those of its models.
    pub materials: Vec<Material>,
    /// All textures: those of the description, then those of its models.
    pub textures: Vec<Texture>,
    /// Radiance of rays that leave the scene.
    pub environment: Environment,
    /// Chooses among all lights, those that are surfaces included.
    pub light_sampler: LightSampler,
    /// Where samples look from within a pixel.
    pub filter: PixelFilter,
    /// What fills space outside of everything.
    pub medium: Option<Medium>,
    /// Whether there are several objects with an inside whose boxes touch, for `path`.
    pub may_touch: bool,
    /// Whether something fills space anywhere, or has a border that may not be seen, or lie where another is.
    pub media: bool,
    /// What the camera is inside of.
    pub around_eye: Inside,
    /// What the frame is gathered on.
    pub film: Film,
    /// How light is followed.
    pub render: Render,
    /// How accurately.
    pub quality: Quality,
    /// Chooses the sample pattern.
    pub seed: u64,
    /// What the frame tells beside colours.
    pub aovs: Aovs,
    /// What a user should know, each once.
    pub warnings: Vec<Warning>,
    /// Where mirrors and lenses gather light: found by photons when it is first asked for.
    pub caustics: OnceLock<Caustics>,
    /// What the scene is made of.
    pub statistics: Statistics,
    geometry: Geometry,
}

impl Scene {
    /// Where in the world the scene's coordinates begin.
    pub fn begin(&self) -> DVec3 {
        -self.geometry.origin
    }

    /// Lights whose light something in the scene may gather, and these things; `None` if there are none.
    pub fn gathered(&self) -> Option<Sources<'_>> {
        let boxes = self.geometry.boxes(|material| self.materials[material as usize].recipe.gathers());
        Sources::new(&self.light_sampler, &self.environment, boxes, self.geometry.bounds?)
    }

    /// Lowest and highest coordinates, in the world, of all finite things.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.geometry.bounds.map(|Bounds { min, max }| (min + self.begin(), max + self.begin()))
    }
}
