//! What a frame tells beside colours: a pass of its own, after that of the colours, so that frames without it run the code that they would run if there were none.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;

use super::{
    Cancelled, PairwiseSum, SampleRange,
    render::{Lattice, camera_ray},
};
use crate::{
    description::{Aov, Aovs},
    integrator::{First, first},
    sampling::Sampler,
    scene::{Scene, Tracer, Work},
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
    scene.run(Gathering { lattice, samples, beside, cancel, seen: Seen::default() })
}

struct Gathering<'c> {
    lattice: Lattice,
    samples: SampleRange,
    beside: &'c Beside,
    cancel: &'c AtomicBool,
    seen: Seen,
}

impl Work for Gathering<'_> {
    type Output = Result<Vec<f32>, Cancelled>;

    #[inline(always)]
    fn run(mut self, scene: impl Tracer) -> Self::Output {
        let aovs = scene.aovs;
        let of_hits = aovs.iter().any(|aov| !matches!(aov, Aov::Samples | Aov::Error | Aov::Residual));
        let (mut errors, mut residuals) = (self.beside.errors.iter(), self.beside.residuals.iter());
        let mut numbers = Vec::new();
        for y in self.lattice.rows() {
            if self.cancel.load(Ordering::Relaxed) {
                return Err(Cancelled);
            }
            for x in self.lattice.columns() {
                if of_hits {
                    self.look(scene, (x, y));
                }
                let of_color = (errors.next().copied().unwrap_or_default(), residuals.next().copied().unwrap_or_default());
                self.seen.tell(aovs, self.samples.count, of_color, scene.begin(), &mut numbers);
            }
        }
        Ok(numbers)
    }
}

impl Gathering<'_> {
    /// Looks at a pixel along the rays of its samples.
    #[inline(always)]
    fn look(&mut self, scene: impl Tracer, pixel: (u32, u32)) {
        self.seen.clear();
        for index in self.samples.first..self.samples.first + self.samples.count {
            let sampler = Sampler::new(scene.seed, pixel, index);
            let (ray, weight) = camera_ray(&scene, pixel, &sampler);
            self.seen.add(first(scene, &ray), weight, index == self.samples.first);
        }
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

    fn add(&mut self, met: Option<First>, weight: f64, is_first: bool) {
        self.samples += 1;
        self.met += u64::from(met.is_some());
        if let (true, Some(met)) = (is_first, &met) {
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
