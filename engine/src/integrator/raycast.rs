//! Ray casting: nearest hit only.

use glam::DVec3;

use super::{Integrator, RayCounts, direct};
use crate::{material::Ideal, sampling::Sampler, scene::Tracer, shape::Ray};

/// "First rank" of Vokorokos, Danková, Ádám, "Parallel scene splitting and assigning for fast ray tracing" (2010): every light shines
/// unhindered on what a ray meets first; mirror and glass show as diffuse of their reflectance.
#[derive(Clone, Copy, Debug)]
pub struct Raycast;

impl Integrator for Raycast {
    #[inline(always)]
    fn radiance(&mut self, scene: impl Tracer, ray: &Ray, _: &Sampler) -> DVec3 {
        let Some(surface) = scene.closest_from_eye(ray) else { return scene.environment.radiance(ray.direction) };
        let material = &scene.materials[surface.material as usize];
        let (Ideal::Diffuse { reflectance, .. } | Ideal::Mirror { reflectance } | Ideal::Glass { reflectance, .. }) = material.ideal;
        let albedo = direct::albedo(scene, material, &surface, reflectance);
        direct::reflected(scene, &surface, ray.direction, albedo, |_, _| DVec3::ONE)
    }

    fn counts(&self) -> RayCounts {
        RayCounts::default()
    }
}
