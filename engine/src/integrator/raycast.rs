//! Ray casting: nearest hit only.

use glam::DVec3;

use super::{Integrator, RayCounts, direct, rgb};
use crate::{material::Bsdf, scene::Tracer, shape::Ray};

/// "First rank" of Vokorokos, Danková, Ádám, "Parallel scene splitting and assigning for fast ray tracing" (2010): every light shines
/// unhindered on what a ray meets first; mirror and glass show as diffuse of their reflectance.
#[derive(Clone, Copy, Debug)]
pub struct Raycast;

impl Integrator for Raycast {
    #[inline(always)]
    fn radiance(&mut self, scene: impl Tracer, ray: &Ray) -> DVec3 {
        let Some(surface) = scene.closest_from_eye(ray) else { return rgb(scene.background) };
        let material = &scene.materials[surface.material as usize];
        let (Bsdf::Diffuse { reflectance, .. } | Bsdf::Mirror { reflectance } | Bsdf::Glass { reflectance, .. }) = material.bsdf;
        let albedo = direct::albedo(scene, material, &surface, reflectance);
        direct::reflected(scene, &surface, ray.direction, albedo, |_, _| DVec3::ONE)
    }

    fn counts(&self) -> RayCounts {
        RayCounts::default()
    }
}
