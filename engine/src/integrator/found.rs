//! Light that rays of a path find, and how much of it counts where it could have been found in another way too (Veach, "Robust Monte Carlo Methods for Light Transport
//! Simulation", 1997, 9.2).

use glam::DVec3;

use super::{path::MOST_PASSED, rgb};
use crate::{
    light::Vertex,
    material::Emission,
    scene::{Inside, Tracer},
    shape::{Ray, Surface},
};

/// The vertex that a ray comes from, and the density by solid angle with which it was sent: what lights need to know that could have been chosen there instead.
#[derive(Clone, Copy, Debug)]
pub struct Last {
    /// Where it was sent from.
    pub vertex: Vertex,
    /// Density by solid angle.
    pub pdf: f64,
    /// How far the ray's start is from there: it may have gone through something.
    pub distance: f64,
}

/// Radiance that a surface sends against a ray by itself, weighted by what choosing a place on it would have found.
#[inline(always)]
pub fn shining(scene: impl Tracer, surface: &Surface, emission: &Emission, direction: DVec3, last: Option<&Last>) -> DVec3 {
    let radiance = emitted(scene, surface, emission, direction);
    let Some(last) = last.filter(|_| radiance != DVec3::ZERO) else { return radiance };
    let lights = &scene.light_sampler;
    match lights.emitter(surface.object, surface.part) {
        Some(emitter) => {
            let distance = last.distance + surface.t;
            radiance * power_heuristic(last.pdf, lights.emitter_pdf(&last.vertex, emitter, direction, distance))
        }
        None => radiance,
    }
}

#[inline(always)]
fn emitted(scene: impl Tracer, surface: &Surface, emission: &Emission, direction: DVec3) -> DVec3 {
    if !emission.two_sided && direction.dot(surface.ng) >= 0.0 {
        return DVec3::ZERO;
    }
    let mut radiance = emission.radiance;
    if let Some(texture) = emission.texture {
        let [r, g, b, _] = scene.textures[texture as usize].at(surface.uvs());
        radiance *= rgb([r, g, b]);
    }
    if emission.color_from_vertices {
        let [r, g, b, _] = surface.color;
        radiance *= rgb([r, g, b]);
    }
    radiance
}

/// Radiance that a ray finds which leaves the scene, weighted by what choosing that direction would have found.
#[inline(always)]
pub fn leaving(scene: impl Tracer, direction: DVec3, last: Option<&Last>) -> DVec3 {
    let lights = &scene.light_sampler;
    let mut radiance = scene.environment.radiance(direction);
    if lights.has_distant() {
        let weight = |pdf: f64| last.map_or(1.0, |last| power_heuristic(last.pdf, pdf));
        if last.is_some() {
            radiance *= weight(lights.environment_pdf(&scene.environment, direction));
        }
        for (disc, pdf) in lights.discs(direction) {
            radiance += disc * weight(pdf);
        }
    }
    radiance
}

/// The weight of what was found with the first density and could have been found with the second one.
#[inline(always)]
pub fn power_heuristic(pdf: f64, other: f64) -> f64 {
    let ratio = other / pdf;
    1.0 / (1.0 + ratio * ratio)
}

/// Radiance of an emitter that a ray is sent to, if nothing stands before it.
#[inline(never)]
pub fn looked_up(scene: impl Tracer, emitter: u32, ray: &Ray) -> DVec3 {
    let endless = Ray { t_max: f64::INFINITY, ..*ray };
    scene.closest(&endless).map_or(DVec3::ZERO, |surface| shown(scene, emitter, &surface, ray.direction))
}

/// Radiance of a surface, if it belongs to an emitter.
fn shown(scene: impl Tracer, emitter: u32, surface: &Surface, direction: DVec3) -> DVec3 {
    let emitter = &scene.light_sampler.emitters[emitter as usize];
    let emission = &scene.materials[surface.material as usize].emission;
    let is_it = (surface.object, surface.part) == (emitter.object, emitter.part);
    emission.as_ref().filter(|_| is_it).map_or(DVec3::ZERO, |emission| emitted(scene, surface, emission, direction))
}

/// The share of light that gets through media and borders that do not show, or what a textured emitter shows through them.
#[inline(never)]
pub fn through_media(scene: impl Tracer, emitter: Option<u32>, ray: &Ray, inside: &Inside) -> DVec3 {
    let (mut ray, mut inside, mut share) = (*ray, *inside, DVec3::ONE);
    for _ in 0..MOST_PASSED {
        let t_max = if emitter.is_some() { f64::INFINITY } else { ray.t_max };
        let met = scene.closest(&Ray { t_max, ..ray });
        let way = met.as_ref().map_or(ray.t_max, |surface| surface.t);
        if let Some(medium) = inside.medium(&scene) {
            share *= medium.transmittance(way);
        }
        let Some(surface) = met else { return share };
        let (shows, beyond) = inside.through(&scene, &surface, ray.direction);
        if share == DVec3::ZERO || shows {
            return emitter.map_or(DVec3::ZERO, |emitter| share * shown(scene, emitter, &surface, ray.direction));
        }
        inside = beyond;
        ray = Ray { t_max: ray.t_max - surface.t, ..surface.spawn(ray.direction) };
    }
    DVec3::ZERO
}
