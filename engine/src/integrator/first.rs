//! What a ray from the camera meets first, for those who ask for more than light.

use glam::DVec3;

use super::{direct, path, shading};
use crate::{
    description::Render,
    material::{Ideal, Material},
    scene::{Surface, Tracer},
    shape::Ray,
};

/// A surface as the camera sees it.
#[derive(Clone, Copy, Debug)]
pub struct First {
    /// Share of light that is passed on, as a colour: see [`crate::description::Aov::Albedo`].
    pub albedo: DVec3,
    /// Unit shading normal on the side that is seen.
    pub normal: DVec3,
    /// Distance from the ray's start.
    pub depth: f64,
    /// Its place, in the scene's coordinates.
    pub point: DVec3,
    /// Place in the order of the scene.
    pub object: u32,
    /// Index of its material.
    pub material: u32,
}

/// What a ray from the camera meets first, where it meets this surface: path tracing looks through the borders of media, and of what something else fills.
#[inline(never)]
pub fn first(scene: impl Tracer, ray: &Ray, surface: Surface) -> Option<First> {
    if !matches!(scene.render, Render::Path { .. }) {
        return Some(seen(scene, &surface, ray, 0.0, None));
    }
    let (mut surface, mut ray, mut before, mut inside) = (surface, *ray, 0.0, scene.around_eye);
    for _ in 0..path::MOST_PASSED {
        let material = &scene.materials[surface.material as usize];
        let (shows, beyond) = inside.through(&scene, &surface, ray.direction);
        if shows {
            return Some(seen(scene, &surface, &ray, before, Some(material)));
        }
        inside = beyond;
        before += surface.t;
        ray = surface.spawn(ray.direction);
        surface = scene.closest(&ray)?;
    }
    None
}

/// A surface at the end of a ray that begins at a distance from the camera; its normals are bent by those of `bumpy`.
fn seen(scene: impl Tracer, surface: &Surface, ray: &Ray, before: f64, bumpy: Option<&Material>) -> First {
    let material = &scene.materials[surface.material as usize];
    let passed_on = match material.ideal {
        Ideal::Diffuse { reflectance, .. } | Ideal::Mirror { reflectance } => reflectance,
        Ideal::Glass { ior, reflectance, transmittance } => {
            // Fresnel's equations straight on.
            let root = (ior - 1.0) / (ior + 1.0);
            reflectance * (root * root) + transmittance * (1.0 - root * root)
        }
    };
    let normal = shading::normal(&scene, bumpy, surface, ray.direction);
    First {
        albedo: direct::albedo(scene, material, surface, passed_on),
        normal: if ray.direction.dot(surface.ng) < 0.0 { normal } else { -normal },
        depth: before + surface.t,
        point: surface.point,
        object: surface.object,
        material: surface.material,
    }
}
