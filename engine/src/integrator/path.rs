//! Path tracing: all light that a scene's materials pass on.

use glam::DVec3;

use super::{Integrator, RayCounts, rgb, shading::Shading};
use crate::{
    light::{Arriving, Vertex},
    material::{Emission, Scattered},
    sampling::Sampler,
    scene::{Surface, Tracer},
    shape::Ray,
};

/// Unidirectional path tracing with next-event estimation (Kajiya, "The Rendering Equation", 1986; Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., 13.4): at
/// every vertex one ray goes to a light that stands somewhere, one to a light infinitely far away, where there are such, and one goes on as the material scatters. What both
/// kinds of rays find is weighted by the power heuristic (Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, 9.2). Chains of little weight end by chance (Arvo and
/// Kirk, "Particle Transport and Image Synthesis", 1990).
#[derive(Debug)]
pub struct Path {
    max_depth: u32,
    roulette_depth: u32,
    counts: RayCounts,
}

/// What a sample's numbers are for, at every vertex; sets before these belong to film and lens.
mod set {
    pub const LIGHT: u32 = 0;
    pub const PLACE: u32 = 1;
    pub const DISTANT: u32 = 2;
    pub const DIRECTION: u32 = 3;
    pub const LOBE: u32 = 4;
    pub const SCATTER: u32 = 5;
    pub const ROULETTE: u32 = 6;
    /// Sets of one vertex.
    pub const COUNT: u32 = 8;
}

/// The vertex that a ray comes from, and the density by solid angle with which it was sent: what lights need to know that could have been chosen there instead.
#[derive(Clone, Copy)]
struct Last {
    vertex: Vertex,
    pdf: f64,
}

impl Path {
    /// With the settings of [`crate::description::Render::Path`].
    pub fn new(max_depth: u32, roulette_depth: u32) -> Self {
        Self { max_depth, roulette_depth, counts: RayCounts::default() }
    }
}

impl Integrator for Path {
    #[inline(always)]
    fn radiance(&mut self, scene: impl Tracer, ray: &Ray, sampler: &Sampler) -> DVec3 {
        let (mut radiance, mut throughput) = (DVec3::ZERO, DVec3::ONE);
        // Radiance is compressed inside of what is dense, but what ends there by chance must not depend on it.
        let mut compression = 1.0;
        let mut last: Option<Last> = None;
        let mut ray = *ray;
        for depth in 1..=self.max_depth {
            let met = if depth == 1 { scene.closest_from_eye(&ray) } else { scene.closest(&ray) };
            let Some(surface) = met else {
                radiance += throughput * leaving(scene, ray.direction, last.as_ref());
                break;
            };
            let material = &scene.materials[surface.material as usize];
            if let Some(emission) = &material.emission {
                radiance += throughput * shining(scene, &surface, emission, ray.direction, last.as_ref());
            }
            if depth == self.max_depth {
                break;
            }
            let Some(shading) = Shading::new(&scene, material, &surface, ray.direction) else { break };
            let sets = Sampler::FIRST_FREE + (depth - 1) * set::COUNT;
            let vertex = Vertex { point: surface.point, normal: Some(surface.ng) };
            if !shading.bsdf.is_specular() {
                radiance += throughput * self.direct(scene, &surface, &shading, &vertex, sampler, sets);
            }
            let pick = if shading.bsdf.has_lobes() { sampler.one(sets + set::LOBE) } else { 0.0 };
            let Some((scattered, direction)) = shading.sample(pick, sampler.pair(sets + set::SCATTER)) else { break };
            let Scattered { weight, pdf, specular, eta2, .. } = scattered;
            throughput *= weight;
            compression *= eta2;
            if depth >= self.roulette_depth {
                let survival = (throughput * compression).max_element();
                if survival < 1.0 {
                    if sampler.one(sets + set::ROULETTE) >= survival {
                        break;
                    }
                    throughput *= 1.0 / survival;
                }
            }
            if throughput == DVec3::ZERO {
                break;
            }
            last = (!specular).then_some(Last { vertex, pdf });
            ray = surface.spawn(direction);
            self.counts.secondary += 1;
        }
        radiance
    }

    fn counts(&self) -> RayCounts {
        self.counts
    }
}

impl Path {
    /// Light that comes straight from lights and is scattered once.
    #[inline(always)]
    fn direct(&mut self, scene: impl Tracer, surface: &Surface, shading: &Shading, vertex: &Vertex, sampler: &Sampler, sets: u32) -> DVec3 {
        let lights = &scene.light_sampler;
        let mut radiance = DVec3::ZERO;
        if lights.has_local() {
            let pick = if lights.picks_local() { sampler.one(sets + set::LIGHT) } else { 0.0 };
            if let Some(arriving) = lights.sample_local(&scene.lights, vertex, pick, sampler.pair(sets + set::PLACE)) {
                radiance += self.scattered(scene, surface, shading, &arriving);
            }
        }
        if lights.has_distant() {
            let (pick, u) = (sampler.one(sets + set::DISTANT), sampler.pair(sets + set::DIRECTION));
            if let Some(arriving) = lights.sample_distant(&scene.lights, &scene.environment, vertex, pick, u) {
                radiance += self.scattered(scene, surface, shading, &arriving);
            }
        }
        radiance
    }

    /// What the surface passes on of light that arrives, if nothing stands between.
    #[inline(always)]
    fn scattered(&mut self, scene: impl Tracer, surface: &Surface, shading: &Shading, arriving: &Arriving) -> DVec3 {
        let (f, pdf) = shading.evaluate(arriving.direction);
        if f == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let weight = arriving.pdf.map_or(1.0, |of_light| power_heuristic(of_light, pdf));
        let side = arriving.direction.dot(surface.ng);
        let (origin, leaves) = (surface.start(side), surface.leaves(side));
        let ray = Ray { origin, direction: arriving.direction, t_max: arriving.distance, leaves };
        self.counts.shadow += 1;
        let light = match arriving.textured {
            Some(emitter) => arriving.light * looked_up(scene, emitter, &ray),
            None => {
                let blocked = match arriving.delta {
                    Some(light) => scene.any_before_light(light as usize, &ray, |_, _| true),
                    None => scene.any(&ray, |_, _| true),
                };
                if blocked { DVec3::ZERO } else { arriving.light }
            }
        };
        f * light * weight
    }
}

/// Radiance of an emitter that a ray is sent to, if nothing stands before it.
#[inline(never)]
fn looked_up(scene: impl Tracer, emitter: u32, ray: &Ray) -> DVec3 {
    let emitter = &scene.light_sampler.emitters[emitter as usize];
    let Some(surface) = scene.closest(&Ray { t_max: f64::INFINITY, ..*ray }) else { return DVec3::ZERO };
    if (surface.object, surface.part) != (emitter.object, emitter.part) {
        return DVec3::ZERO;
    }
    let emission = &scene.materials[surface.material as usize].emission;
    emission.as_ref().map_or(DVec3::ZERO, |emission| emitted(scene, &surface, emission, ray.direction))
}

/// Radiance that a surface sends against a ray by itself.
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

/// The same, weighted by what choosing a place on it would have found.
#[inline(always)]
fn shining(scene: impl Tracer, surface: &Surface, emission: &Emission, direction: DVec3, last: Option<&Last>) -> DVec3 {
    let radiance = emitted(scene, surface, emission, direction);
    let Some(last) = last.filter(|_| radiance != DVec3::ZERO) else { return radiance };
    let lights = &scene.light_sampler;
    match lights.emitter(surface.object, surface.part) {
        Some(emitter) => radiance * power_heuristic(last.pdf, lights.emitter_pdf(&last.vertex, emitter, direction, surface.t)),
        None => radiance,
    }
}

/// Radiance that a ray finds which leaves the scene, weighted by what choosing that direction would have found.
#[inline(always)]
fn leaving(scene: impl Tracer, direction: DVec3, last: Option<&Last>) -> DVec3 {
    let lights = &scene.light_sampler;
    let weight = |pdf: &dyn Fn() -> f64| last.map_or(1.0, |last| power_heuristic(last.pdf, pdf()));
    let mut radiance = scene.environment.radiance(direction);
    if lights.has_distant() {
        radiance *= weight(&|| lights.environment_pdf(&scene.environment, direction));
        for (disc, pdf) in lights.discs(direction) {
            radiance += disc * weight(&|| pdf);
        }
    }
    radiance
}

/// The weight of what was found with the first density and could have been found with the second one.
#[inline(always)]
fn power_heuristic(pdf: f64, other: f64) -> f64 {
    let ratio = other / pdf;
    1.0 / (1.0 + ratio * ratio)
}
