//! What a frame tells beside colours: a pass of its own, after that of the colours, so that frames without it run the code that they would run if there were none.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;

use super::{Cancelled, PairwiseSum, SampleRange, render::Lattice, wave::Wave};
use crate::{
    description::{Aov, Aovs},
    integrator::{First, first},
    scene::{Hit, Scene, Tracer, Work},
};

/// What the samples of colours tell.
pub struct Beside {
    /// Standard errors, if they are asked for.
    pub errors: Vec<DVec3>,
    /// What colours lack, which are floats of 32 bits.
    pub residuals: Vec<[f32; 3]>,
}

/// The numbers of all pixels of a lattice, each in the order of [`Aovs::channels`]; `beside` is of their colours.
pub fn gather(scene: &Scene, lattice: Lattice, samples: SampleRange, beside: &Beside, cancel: &AtomicBool) -> Result<Vec<f32>, Cancelled> {
    if scene.aovs.is_empty() {
        return Ok(Vec::new());
    }
    let (wave, hits, seen, told) = (Wave::default(), Vec::new(), Seen::default(), Told::default());
    scene.run(Gathering { lattice, samples, beside, cancel, wave, hits, seen, told })
}

struct Gathering<'c> {
    lattice: Lattice,
    samples: SampleRange,
    beside: &'c Beside,
    cancel: &'c AtomicBool,
    wave: Wave,
    hits: Vec<Option<Hit>>,
    /// By the pixel that is being looked at.
    seen: Seen,
    told: Told,
}

/// What was told of the pixels that are done.
#[derive(Default)]
struct Told {
    pixels: usize,
    numbers: Vec<f32>,
}

impl Work for Gathering<'_> {
    type Output = Result<Vec<f32>, Cancelled>;

    #[inline(always)]
    fn run(mut self, scene: impl Tracer) -> Self::Output {
        let of_hits = scene.aovs.iter().any(|aov| !matches!(aov, Aov::Samples | Aov::Error | Aov::Residual));
        for y in self.lattice.rows() {
            if self.cancel.load(Ordering::Relaxed) {
                return Err(Cancelled);
            }
            for x in self.lattice.columns() {
                if !of_hits {
                    self.tell(&scene);
                    continue;
                }
                for index in self.samples.first..self.samples.first + self.samples.count {
                    self.wave.push(&scene, (x, y), index);
                    if self.wave.is_full() {
                        self.look(scene);
                    }
                }
            }
        }
        self.look(scene);
        Ok(self.told.numbers)
    }
}

impl Gathering<'_> {
    /// Looks along the rays of a wave, and tells of the pixels that are done.
    #[inline(always)]
    fn look(&mut self, scene: impl Tracer) {
        self.hits.clear();
        scene.hits_from_eye(&self.wave.rays, |_, hit| self.hits.push(hit));
        for number in 0..self.hits.len() {
            scene.prefetch(&self.hits, number);
            let (ray, weight) = (&self.wave.rays[number], self.wave.weights[number]);
            let met = self.hits[number].and_then(|hit| scene.surface(ray, &hit));
            self.seen.add(met.and_then(|met| first(scene, ray, met)), weight);
            if self.seen.samples == self.samples.count {
                self.tell(&scene);
                self.seen.clear();
            }
        }
        self.wave.clear();
    }

    /// Tells of the next pixel.
    fn tell(&mut self, scene: &Scene) {
        let Told { pixels, numbers } = &mut self.told;
        let error = self.beside.errors.get(*pixels).copied().unwrap_or_default();
        let residual = self.beside.residuals.get(*pixels).copied().unwrap_or_default();
        self.seen.tell(scene.aovs, self.samples.count, (error, residual), scene.begin(), numbers);
        *pixels += 1;
    }
}

/// What the samples of a pixel met. Nothing counts as 0, so that sums are made by the tree of the samples.
#[derive(Default)]
struct Seen {
    albedo: PairwiseSum,
    normal: PairwiseSum,
    point: PairwiseSum,
    depth: PairwiseSum,
    samples: u64,
    /// Of these, those that met something.
    met: u64,
    /// Numbers of object and material, from 1.
    first: [u32; 2],
}

impl Seen {
    fn clear(&mut self) {
        [&mut self.albedo, &mut self.normal, &mut self.point, &mut self.depth].into_iter().for_each(PairwiseSum::clear);
        (self.samples, self.met, self.first) = (0, 0, [0; 2]);
    }

    fn add(&mut self, met: Option<First>, weight: f64) {
        self.samples += 1;
        self.met += u64::from(met.is_some());
        if let (1, Some(met)) = (self.samples, &met) {
            self.first = [met.object + 1, met.material + 1];
        }
        let of = |what: fn(&First) -> DVec3| met.as_ref().map_or(DVec3::ZERO, what);
        self.albedo.push(of(|met| met.albedo) * weight);
        self.normal.push(of(|met| met.normal) * weight);
        self.point.push(of(|met| met.point));
        self.depth.push(of(|met| DVec3::splat(met.depth)));
    }

    /// Appends the numbers of a pixel; `begin` is where the scene's coordinates begin in the world.
    fn tell(&self, aovs: Aovs, samples: u64, (error, residual): (DVec3, [f32; 3]), begin: DVec3, numbers: &mut Vec<f32>) {
        let share = 1.0 / self.samples.max(1) as f64;
        let of_met = 1.0 / self.met.max(1) as f64;
        let [object, material] = self.first;
        for aov in aovs.iter() {
            match aov {
                Aov::Albedo => numbers.extend(three(self.albedo.total() * share)),
                Aov::Normal => numbers.extend(three(self.normal.total() * share)),
                Aov::Depth if self.met == 0 => numbers.push(Aov::FARTHEST),
                Aov::Depth => numbers.push(number(self.depth.total().x * of_met).min(Aov::FARTHEST)),
                Aov::Position if self.met == 0 => numbers.extend([0.0; 3]),
                Aov::Position => numbers.extend(three(self.point.total() * of_met + begin)),
                Aov::Object => numbers.push(object as f32),
                Aov::Material => numbers.push(material as f32),
                Aov::Samples => numbers.push(samples as f32),
                Aov::Error => numbers.extend(three(error)),
                Aov::Residual => numbers.extend(residual),
            }
        }
    }
}

fn three(numbers: DVec3) -> [f32; 3] {
    numbers.to_array().map(number)
}

/// As near as a float of 32 bits comes.
fn number(x: f64) -> f32 {
    x.clamp(f32::MIN.into(), f32::MAX.into()) as f32
}
