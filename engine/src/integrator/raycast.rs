//! Ray casting: nearest hit only.

use glam::DVec3;

use super::{Integrator, RayCounts, direct};
use crate::{
    material::Ideal,
    sampling::Sampler,
    scene::{Hit, Tracer},
    shape::{Ray, Surface},
};

/// "First rank" of Vokorokos, Danková, Ádám, "Parallel scene splitting and assigning for fast ray tracing" (2010): every light shines
/// unhindered on what a ray meets first; mirror and glass show as diffuse of their reflectance.
#[derive(Debug, Default)]
pub struct Raycast {
    hits: Vec<Option<Hit>>,
}

impl Integrator for Raycast {
    #[inline(always)]
    fn radiance(&mut self, scene: impl Tracer, rays: &[Ray], _: &[Sampler], radiance: &mut [DVec3]) {
        self.hits.clear();
        scene.hits_from_eye(rays, |_, hit| self.hits.push(hit));
        for (number, (ray, radiance)) in rays.iter().zip(radiance).enumerate() {
            scene.prefetch(&self.hits, number);
            *radiance = match self.hits[number].and_then(|hit| scene.surface(ray, &hit)) {
                None => scene.environment.radiance(ray.direction),
                Some(surface) => seen(scene, &surface, ray.direction),
            };
        }
    }

    fn counts(&self) -> RayCounts {
        RayCounts::default()
    }
}

/// What a surface shows to a ray along `direction`.
#[inline(always)]
fn seen(scene: impl Tracer, surface: &Surface, direction: DVec3) -> DVec3 {
    let material = &scene.materials[surface.material as usize];
    let (Ideal::Diffuse { reflectance, .. } | Ideal::Mirror { reflectance } | Ideal::Glass { reflectance, .. }) = material.ideal;
    let albedo = direct::albedo(scene, material, surface, reflectance);
    direct::reflected(scene, surface, direction, albedo, |_, _| DVec3::ONE)
}
