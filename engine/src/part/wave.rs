//! Samples that are traced at a time.

use glam::DVec3;

use super::render::camera_ray;
use crate::{sampling::Sampler, scene::Scene, shape::Ray};

/// Most samples in a wave: so many that few rays are left alone where most have ended, and so few that they stay close to the processor.
const SIZE: usize = 512;

/// Samples of one pixel after the other.
#[derive(Default)]
pub struct Wave {
    /// From the camera.
    pub rays: Vec<Ray>,
    /// Their numbers.
    pub samplers: Vec<Sampler>,
    /// What their radiance is multiplied by.
    pub weights: Vec<f64>,
    /// What arrives along them.
    pub radiance: Vec<DVec3>,
}

impl Wave {
    /// Adds a sample of a pixel.
    #[inline(always)]
    pub fn push(&mut self, scene: &Scene, pixel: (u32, u32), index: u64) {
        let sampler = Sampler::new(scene.seed, pixel, index);
        let (ray, weight) = camera_ray(scene, pixel, &sampler);
        self.rays.push(ray);
        self.samplers.push(sampler);
        self.weights.push(weight);
    }

    /// Whether it is time to trace them.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.rays.len() >= SIZE
    }

    /// Forgets all, but keeps the room.
    pub fn clear(&mut self) {
        self.rays.clear();
        self.samplers.clear();
        self.weights.clear();
    }
}
