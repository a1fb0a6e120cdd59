//! Light that comes straight from the lights.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::rgb;
use crate::{
    material::Material,
    scene::Tracer,
    shape::{Ray, Surface},
};

/// The albedo of a surface: its reflectance, texture and vertex colour.
#[inline(always)]
pub fn albedo(scene: impl Tracer, material: &Material, surface: &Surface, reflectance: DVec3) -> DVec3 {
    let mut albedo = reflectance;
    if let Some(texture) = material.texture() {
        let [r, g, b, _] = scene.textures[texture as usize].at(surface.uvs());
        albedo *= rgb([r, g, b]);
    }
    if material.color_from_vertices {
        let [r, g, b, _] = surface.color;
        albedo *= rgb([r, g, b]);
    }
    albedo
}

/// Radiance that a Lambertian surface shows to a ray that travels along `view`: `albedo / pi` times the irradiance from every light
/// (Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., 9.2). `visible` is given the index of a light and the way to it, and gives the share
/// that arrives.
///
/// Both sides reflect; light must stand on the side that is seen, by the geometric normal and by the shading normal.
#[inline(always)]
pub fn reflected(
    scene: impl Tracer,
    surface: &Surface,
    view: DVec3,
    albedo: DVec3,
    mut visible: impl FnMut(usize, &Ray) -> DVec3,
) -> DVec3 {
    let side = if surface.ng.dot(view) > 0.0 { -1.0 } else { 1.0 };
    // The lights that count stand on one side, so all rays towards them start at one point.
    let (start, leaves) = (surface.start(side), surface.leaves(side));
    let mut irradiance = DVec3::ZERO;
    for (index, light) in scene.lights.iter().enumerate() {
        let sample = light.sample(start);
        let cos = side * surface.ns.dot(sample.direction);
        if cos > 0.0 && side * surface.ng.dot(sample.direction) > 0.0 {
            let ray = Ray { origin: start, direction: sample.direction, t_max: sample.distance, leaves };
            irradiance += sample.irradiance * cos * visible(index, &ray);
        }
    }
    albedo * (irradiance * FRAC_1_PI)
}
