//! Rendering a part.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DVec2, DVec3};

use super::{
    Cancelled, Counters, Rect, RenderedPart, SampleRange,
    aovs::{self, Beside},
    pixels::Pixels,
    wave::Wave,
};
use crate::{
    description::{Aov, Render},
    integrator::{self, Integrator, Path, Raycast, Whitted, caustics},
    sampling::Sampler,
    scene::{Scene, Tracer, Work},
    shape::Ray,
};

/// A scene with all that its parts have in common done, by all threads of the pool that the caller is in: else the first of its parts does it, and takes longer than it should.
pub fn prepared(scene: Scene) -> Scene {
    if matches!(scene.render, Render::Path { .. }) {
        integrator::prepare(&scene);
    }
    scene
}

/// Renders the samples of a range in every pixel of a rectangle. A pixel is the mean of its samples, summed by [`super::PairwiseSum`]. A sample that is
/// invalid (a component is negative or no finite number) counts as black, so that it cannot spoil the pixel, and is counted. What the frame tells beside
/// colours comes along.
///
/// The pixels depend on the scene, the rectangle and the range alone.
///
/// # Errors
/// If `cancel` was set meanwhile; it is looked at once a row.
pub fn render(scene: &Scene, rect: Rect, samples: SampleRange, cancel: &AtomicBool) -> Result<RenderedPart, Cancelled> {
    let lattice = Lattice { rect, stride: 1 };
    let Traced { pixels, beside, counters } = trace(scene, lattice, samples, cancel)?;
    let extra = aovs::gather(scene, lattice, samples, &beside, cancel)?;
    Ok(RenderedPart { rect, pixels, extra, counters })
}

/// Renders sample 0 of some pixels of a rectangle to learn how long the whole takes: those in the middle of squares of `stride` pixels, at least
/// one. Returns their number; whoever calls it measures seconds.
///
/// # Errors
/// If `cancel` was set meanwhile; it is looked at once a row.
pub fn probe(scene: &Scene, cell: Rect, stride: u32, cancel: &AtomicBool) -> Result<u64, Cancelled> {
    let (lattice, samples) = (Lattice { rect: cell, stride }, SampleRange { first: 0, count: 1 });
    let Traced { beside, counters, .. } = trace(scene, lattice, samples, cancel)?;
    aovs::gather(scene, lattice, samples, &beside, cancel)?;
    Ok(counters.camera_rays)
}

/// Pixels in the middle of squares of `stride` pixels of a rectangle.
#[derive(Clone, Copy)]
pub struct Lattice {
    rect: Rect,
    stride: u32,
}

impl Lattice {
    pub fn columns(self) -> impl Iterator<Item = u32> {
        middles(self.rect.x, self.rect.width, self.stride)
    }

    pub fn rows(self) -> impl Iterator<Item = u32> {
        middles(self.rect.y, self.rect.height, self.stride)
    }
}

/// The middles of the strides within `first..first + length`; the middle of all where a stride does not fit.
fn middles(first: u32, length: u32, stride: u32) -> impl Iterator<Item = u32> {
    let stride = stride.clamp(1, length.max(1));
    (0..length / stride).map(move |step| first + step * stride + stride / 2)
}

/// Colours of pixels, and what is told of them.
struct Traced {
    pixels: Vec<[f32; 3]>,
    beside: Beside,
    counters: Counters,
}

fn trace(scene: &Scene, lattice: Lattice, samples: SampleRange, cancel: &AtomicBool) -> Result<Traced, Cancelled> {
    match scene.render {
        Render::Raycast => trace_by(Raycast::default(), scene, lattice, samples, cancel),
        Render::Whitted { max_depth, transparent_shadows, min_weight } => {
            trace_by(Whitted::new(max_depth, transparent_shadows, min_weight), scene, lattice, samples, cancel)
        }
        Render::Path { max_depth, roulette_depth, smooth_terminator } => {
            let caustics = caustics(scene);
            if scene.media {
                trace_by(Path::<true>::new(max_depth, roulette_depth, smooth_terminator, caustics), scene, lattice, samples, cancel)
            } else {
                trace_by(Path::<false>::new(max_depth, roulette_depth, smooth_terminator, caustics), scene, lattice, samples, cancel)
            }
        }
    }
}

fn trace_by(
    integrator: impl Integrator,
    scene: &Scene,
    lattice: Lattice,
    samples: SampleRange,
    cancel: &AtomicBool,
) -> Result<Traced, Cancelled> {
    let pixels = Pixels::new(lattice.rows().count() * lattice.columns().count(), samples.count, scene.aovs.contains(Aov::Error));
    scene.run(Tracing { integrator, lattice, samples, cancel, wave: Wave::default(), pixels, counters: Counters::default() })
}

struct Tracing<'c, I> {
    integrator: I,
    lattice: Lattice,
    samples: SampleRange,
    cancel: &'c AtomicBool,
    wave: Wave,
    pixels: Pixels,
    counters: Counters,
}

impl<I: Integrator> Work for Tracing<'_, I> {
    type Output = Result<Traced, Cancelled>;

    #[inline(always)]
    fn run(mut self, scene: impl Tracer) -> Self::Output {
        for y in self.lattice.rows() {
            if self.cancel.load(Ordering::Relaxed) {
                return Err(Cancelled);
            }
            for x in self.lattice.columns() {
                for index in self.samples.first..self.samples.first + self.samples.count {
                    self.wave.push(&scene, (x, y), index);
                    if self.wave.is_full() {
                        self.trace(scene);
                    }
                }
            }
        }
        self.trace(scene);
        let rays = self.integrator.counts();
        let counters = Counters { shadow_rays: rays.shadow, secondary_rays: rays.secondary, ..self.counters };
        let Pixels { means, errors, residuals, .. } = self.pixels;
        Ok(Traced { pixels: means, beside: Beside { errors, residuals }, counters })
    }
}

impl<I: Integrator> Tracing<'_, I> {
    /// Traces the samples of a wave, and hands them over in order.
    #[inline(always)]
    fn trace(&mut self, scene: impl Tracer) {
        let Wave { rays, samplers, weights, radiance } = &mut self.wave;
        radiance.clear();
        radiance.resize(rays.len(), DVec3::ZERO);
        self.integrator.radiance(scene, rays, samplers, radiance);
        for (radiance, weight) in radiance.iter().zip(&*weights) {
            self.counters.camera_rays += 1;
            let is_valid = radiance.is_finite() && radiance.min_element() >= 0.0;
            self.counters.invalid_samples += u64::from(!is_valid);
            self.pixels.push(if is_valid { *radiance * *weight } else { DVec3::ZERO });
        }
        self.wave.clear();
    }
}
/// The ray of a sample, and the weight of what it sees.
#[inline(always)]
pub fn camera_ray(scene: &Scene, pixel: (u32, u32), sampler: &Sampler) -> (Ray, f64) {
    let (offset, weight) = scene.filter.sample(sampler.pair(Sampler::FILM));
    let (x, y) = (f64::from(pixel.0) + 0.5 + offset.x, f64::from(pixel.1) + 0.5 + offset.y);
    let lens = if scene.camera.needs_lens() { sampler.pair(Sampler::LENS) } else { DVec2::ZERO };
    (scene.camera.ray(x, y, lens), weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_takes_the_middle_of_every_stride() {
        assert_eq!(middles(10, 48, 16).collect::<Vec<_>>(), [18, 34, 50]);
        assert_eq!(middles(10, 50, 16).collect::<Vec<_>>(), [18, 34, 50]);
        assert_eq!(middles(10, 5, 16).collect::<Vec<_>>(), [12], "a cell that is smaller than a stride is looked at nevertheless");
        assert_eq!(middles(3, 4, 1).collect::<Vec<_>>(), [3, 4, 5, 6]);
        assert_eq!(middles(3, 4, 0).count(), 4);
        assert_eq!(middles(3, 0, 8).count(), 0);
    }
}
