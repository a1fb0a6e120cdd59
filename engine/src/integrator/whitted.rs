//! Whitted's ray tracing: nearest hit, a shadow ray to every light, reflected and refracted rays.

use glam::DVec3;

use super::{Integrator, RayCounts, direct, rgb};
use crate::{
    material::{
        Bsdf,
        dielectric::{interface, reflect},
    },
    scene::{Surface, Tracer},
    shape::Ray,
};

/// "An Improved Illumination Model for Shaded Display" (Whitted, 1980), "higher rank" of Vokorokos et al. (2010).
///
/// The tree of rays is walked depth first, refraction before reflection, with a stack that is kept from ray to ray: nothing is allocated once it has
/// grown to the depth of the tree. Radiance is not scaled by the squared index of refraction inside glass: what enters leaves again.
#[derive(Debug)]
pub struct Whitted {
    max_depth: u32,
    transparent_shadows: bool,
    min_weight: f64,
    waiting: Vec<Branch>,
    counts: RayCounts,
}

/// A ray that is still to be followed.
#[derive(Clone, Copy, Debug)]
struct Branch {
    ray: Ray,
    /// What its radiance is multiplied by in the pixel.
    weight: DVec3,
    /// Place in the chain of rays; the camera's ray is 1.
    depth: u32,
}

impl Whitted {
    /// With the settings of [`crate::description::Render::Whitted`].
    pub fn new(max_depth: u32, transparent_shadows: bool, min_weight: f64) -> Self {
        Self { max_depth, transparent_shadows, min_weight, waiting: Vec::new(), counts: RayCounts::default() }
    }
}

impl Integrator for Whitted {
    #[inline(always)]
    fn radiance(&mut self, scene: impl Tracer, ray: &Ray) -> DVec3 {
        let mut radiance = DVec3::ZERO;
        let mut branch = Branch { ray: *ray, weight: DVec3::ONE, depth: 1 };
        loop {
            let met = if branch.depth == 1 { scene.closest_from_eye(&branch.ray) } else { scene.closest(&branch.ray) };
            let (shown, child) = match &met {
                None => (rgb(scene.background), None),
                Some(surface) => self.meet(scene, &branch, surface),
            };
            radiance += branch.weight * shown;
            match child.or_else(|| self.waiting.pop()) {
                Some(next) => branch = next,
                None => return radiance,
            }
        }
    }

    fn counts(&self) -> RayCounts {
        self.counts
    }
}

impl Whitted {
    /// What the end of a branch shows by itself, and the child to follow next; another is left waiting.
    #[inline(always)]
    fn meet(&mut self, scene: impl Tracer, branch: &Branch, surface: &Surface) -> (DVec3, Option<Branch>) {
        let material = &scene.materials[surface.material as usize];
        let direction = branch.ray.direction;
        match material.bsdf {
            Bsdf::Diffuse { reflectance, .. } => {
                let albedo = direct::albedo(scene, material, surface, reflectance);
                (direct::reflected(scene, surface, direction, albedo, |light, ray| self.visible(scene, light, ray)), None)
            }
            Bsdf::Mirror { reflectance } => (DVec3::ZERO, self.child(branch, surface, mirrored(direction, surface), reflectance)),
            Bsdf::Glass { ior, reflectance, transmittance } => {
                let at = interface(direction, shading_normal(direction, surface), ior);
                let reflected = self.child(branch, surface, mirrored(direction, surface), reflectance * at.reflected);
                let refracted =
                    at.refracted.and_then(|refracted| self.child(branch, surface, refracted, transmittance * (1.0 - at.reflected)));
                if refracted.is_none() {
                    return (DVec3::ZERO, reflected);
                }
                self.waiting.extend(reflected);
                (DVec3::ZERO, refracted)
            }
        }
    }

    /// A ray that follows from a branch, unless the chain of rays is too long or its weight too small: the largest component counts.
    #[inline(always)]
    fn child(&mut self, parent: &Branch, surface: &Surface, direction: DVec3, share: DVec3) -> Option<Branch> {
        let weight = parent.weight * share;
        let follow = parent.depth < self.max_depth && weight.max_element() > self.min_weight;
        self.counts.secondary += u64::from(follow);
        follow.then(|| Branch { ray: surface.spawn(direction), weight, depth: parent.depth + 1 })
    }

    /// The share of a light that arrives at the start of a ray towards it.
    #[inline(always)]
    fn visible(&mut self, scene: impl Tracer, light: usize, ray: &Ray) -> DVec3 {
        self.counts.shadow += 1;
        let mut share = DVec3::ONE;
        let blocked = scene.any_before_light(light, ray, |material, _| {
            if !self.transparent_shadows {
                return true;
            }
            match scene.materials[material as usize].bsdf {
                Bsdf::Glass { transmittance, .. } => {
                    share *= transmittance;
                    share == DVec3::ZERO
                }
                Bsdf::Diffuse { .. } | Bsdf::Mirror { .. } => true,
            }
        });
        if blocked { DVec3::ZERO } else { share }
    }
}

/// The shading normal, unless it faces the ray from the other side than the surface itself does.
#[inline(always)]
fn shading_normal(direction: DVec3, surface: &Surface) -> DVec3 {
    if direction.dot(surface.ns) * direction.dot(surface.ng) > 0.0 { surface.ns } else { surface.ng }
}

/// The reflected direction; by the geometric normal where that of the shading normal would lead through the surface.
#[inline(always)]
fn mirrored(direction: DVec3, surface: &Surface) -> DVec3 {
    let reflected = reflect(direction, surface.ns);
    if reflected.dot(surface.ng) * direction.dot(surface.ng) < 0.0 { reflected } else { reflect(direction, surface.ng) }
}
