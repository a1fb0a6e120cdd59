//! Whitted's ray tracing: nearest hit, a shadow ray to every light, reflected and refracted rays.

use glam::DVec3;

use super::{Integrator, RayCounts, direct};
use crate::{
    material::{
        Ideal,
        dielectric::{interface, reflect},
    },
    sampling::Sampler,
    scene::{Hit, Tracer},
    shape::{Ray, Surface},
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
    hits: Vec<Option<Hit>>,
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
        Self { max_depth, transparent_shadows, min_weight, hits: Vec::new(), waiting: Vec::new(), counts: RayCounts::default() }
    }
}

impl Integrator for Whitted {
    #[inline(always)]
    fn radiance(&mut self, scene: impl Tracer, rays: &[Ray], _: &[Sampler], radiance: &mut [DVec3]) {
        self.hits.clear();
        scene.hits_from_eye(rays, |_, hit| self.hits.push(hit));
        for (number, ray) in rays.iter().enumerate() {
            scene.prefetch(&self.hits, number);
            radiance[number] = self.followed(scene, ray, self.hits[number].and_then(|hit| scene.surface(ray, &hit)));
        }
    }

    fn counts(&self) -> RayCounts {
        self.counts
    }
}

impl Whitted {
    /// Radiance along a ray, by what it meets first.
    #[inline(always)]
    fn followed(&mut self, scene: impl Tracer, ray: &Ray, mut met: Option<Surface>) -> DVec3 {
        let mut radiance = DVec3::ZERO;
        let mut branch = Branch { ray: *ray, weight: DVec3::ONE, depth: 1 };
        loop {
            let goes_on = match &met {
                None => {
                    radiance += branch.weight * scene.environment.radiance(branch.ray.direction);
                    false
                }
                Some(surface) => self.meet(scene, surface, &mut branch, &mut radiance),
            };
            if !goes_on {
                match self.waiting.pop() {
                    Some(next) => branch = next,
                    None => return radiance,
                }
            }
            met = scene.closest(&branch.ray);
        }
    }

    /// Adds what the end of a branch shows by itself to the radiance, and turns the branch, where it stands, into the one to follow next, if there is
    /// one; another is left waiting.
    #[inline(always)]
    fn meet(&mut self, scene: impl Tracer, surface: &Surface, branch: &mut Branch, radiance: &mut DVec3) -> bool {
        let material = &scene.materials[surface.material as usize];
        let direction = branch.ray.direction;
        match material.ideal {
            Ideal::Diffuse { reflectance, .. } => {
                let albedo = direct::albedo(scene, material, surface, reflectance);
                *radiance +=
                    branch.weight * direct::reflected(scene, surface, direction, albedo, |light, ray| self.visible(scene, light, ray));
                false
            }
            Ideal::Mirror { reflectance } => self.follow(branch, surface, mirrored(direction, surface), reflectance),
            Ideal::Glass { ior, reflectance, transmittance } => {
                let at = interface(direction, shading_normal(direction, surface), ior);
                let Some(refracted) = at.refracted else {
                    return self.follow(branch, surface, mirrored(direction, surface), reflectance);
                };
                let mut reflected = *branch;
                let reflects = self.follow(&mut reflected, surface, mirrored(direction, surface), reflectance * at.reflected);
                if !self.follow(branch, surface, refracted, transmittance * (1.0 - at.reflected)) {
                    *branch = reflected;
                    return reflects;
                }
                if reflects {
                    self.waiting.push(reflected);
                }
                true
            }
        }
    }

    /// Turns a branch into the ray that follows from it, unless the chain of rays is too long or its weight too small: the largest component counts.
    #[inline(always)]
    fn follow(&mut self, branch: &mut Branch, surface: &Surface, direction: DVec3, share: DVec3) -> bool {
        let weight = branch.weight * share;
        let follow = branch.depth < self.max_depth && weight.max_element() > self.min_weight;
        if follow {
            self.counts.secondary += 1;
            *branch = Branch { ray: surface.spawn(direction), weight, depth: branch.depth + 1 };
        }
        follow
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
            match scene.materials[material as usize].ideal {
                Ideal::Glass { transmittance, .. } => {
                    share *= transmittance;
                    share == DVec3::ZERO
                }
                Ideal::Diffuse { .. } | Ideal::Mirror { .. } => true,
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
