//! Integrators: how much light comes along a ray.

mod chain;
mod direct;
mod first;
mod found;
mod path;
mod photons;
mod raycast;
mod shading;
mod sought;
mod whitted;

use glam::DVec3;

pub use first::{First, first};
pub use path::Path;
pub use photons::{caustics, prepare};
pub use raycast::Raycast;
pub use whitted::Whitted;

use crate::{sampling::Sampler, scene::Tracer, shape::Ray};

/// A way to follow light. It may keep memory from ray to ray, but what it computes depends on scene, ray and sample alone.
pub trait Integrator {
    /// Radiance that arrives along rays from the camera, of each in its place: many at a time, as trees are walked faster by many.
    fn radiance(&mut self, scene: impl Tracer, rays: &[Ray], samplers: &[Sampler], radiance: &mut [DVec3]);

    /// Rays traced so far, besides those from the camera.
    fn counts(&self) -> RayCounts;
}

/// Rays that were traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Rays towards lights.
    pub shadow: u64,
    /// Reflected and refracted rays.
    pub secondary: u64,
}

/// A colour of the description in the engine's own precision.
fn rgb(color: [f32; 3]) -> DVec3 {
    DVec3::new(color[0].into(), color[1].into(), color[2].into())
}
