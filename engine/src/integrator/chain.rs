//! Light that mirrors and lenses gather on a surface: rays are sent there from where photons have come.

use glam::DVec3;

use super::{
    found,
    path::{self, MOST_PASSED, Path, Walk, set},
    shading::Shading,
};
use crate::{
    light::{Caustics, Region},
    material::{Recipe, Travel},
    sampling::Sampler,
    scene::Tracer,
    shape::Surface,
};

/// How many of the points that count fully, where gathered light is neither bright nor dim, send a ray to where it may come from: more cost more time than they take away noise.
const SENT: f64 = 0.7;

/// The share of points in a region that send such a ray, where the largest component of a path's throughput is this: noise is least for the time where it goes with what they
/// count, and with the root of how bright gathered light is there: what chance finds of rare light varies as much as there is of it.
#[inline(always)]
fn sent(throughput: f64, region: &Region) -> f64 {
    (SENT * throughput * region.brilliance()).min(1.0)
}

/// A ray whose direction was one of many.
#[derive(Clone, Copy, Debug)]
pub struct Chain {
    /// Where it was sent from.
    pub point: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    /// The density by solid angle with which it was chosen.
    pub pdf: f64,
    /// The largest component of the path's throughput there.
    pub throughput: f64,
}

impl<const MEDIA: bool> Path<'_, MEDIA> {
    /// How much counts of what a path finds: all, unless it comes over mirrors and lenses alone from a point at which they are looked for (by the balance heuristic).
    #[inline(always)]
    pub(super) fn share(&self, walk: &Walk) -> f64 {
        match (self.caustics, walk.chain) {
            (Some(caustics), Some(chain)) if walk.is_after_mirror() => share(caustics, chain),
            _ => 1.0,
        }
    }

    /// Light that a surface scatters once after mirrors and lenses have gathered it.
    #[inline(never)]
    pub(super) fn gathered(
        &mut self,
        scene: impl Tracer,
        caustics: &Caustics,
        surface: &Surface,
        shading: &Shading,
        walk: &Walk,
        sets: u32,
    ) -> DVec3 {
        let Some(region) = caustics.at(surface.point) else { return DVec3::ZERO };
        let (sets, sent) = (set::GATHERED + sets, sent(walk.throughput.max_element(), &region));
        if walk.sampler.one(sets + set::LIGHT) >= sent {
            return DVec3::ZERO;
        }
        let (direction, density) = region.sample(walk.sampler.one(sets + set::PLACE), walk.sampler.pair(sets + set::PLACE));
        let (f, pdf) = shading.evaluate(direction);
        if f == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let mut inside = walk.inside;
        if MEDIA && path::goes_through(scene, surface, walk.ray.direction, direction) {
            inside = walk.beyond::<MEDIA>(surface, direction);
        }
        let throughput = f / (sent * density + pdf);
        let begun = Walk { ray: surface.spawn(direction), depth: walk.depth + 1, throughput, inside, ..*walk };
        self.follow(scene, begun)
    }

    /// What a ray finds over mirrors and lenses alone, at least one.
    #[inline(always)]
    fn follow(&mut self, scene: impl Tracer, mut walk: Walk) -> DVec3 {
        let (mut found, mut gathered) = (DVec3::ZERO, false);
        for passed in 0..MOST_PASSED {
            self.counts.secondary += 1;
            let mut met = scene.closest(&walk.ray);
            if let Some(surface) = met.as_mut() {
                self.look_closer(scene, surface, &mut walk);
            }
            if MEDIA && let Some(medium) = walk.inside.medium(&scene) {
                let distance = met.as_ref().map_or(f64::INFINITY, |surface| surface.t);
                let Travel::Arrives(weight) = medium.travel(distance, walk.sampler.pair(set::GATHERED + set::PASSED + passed)) else {
                    break;
                };
                walk.throughput *= weight;
            }
            let Some(surface) = met else {
                return if gathered { found + walk.throughput * found::leaving(scene, walk.ray.direction, None) } else { found };
            };
            let material = &scene.materials[surface.material as usize];
            if gathered && let Some(emission) = &material.emission {
                found += walk.throughput * found::shining(scene, &surface, emission, walk.ray.direction, None);
            }
            let mut room = None;
            let Some((bsdf, turn)) = path::bsdf(&scene, material, &surface, walk.ray.direction, walk.before::<MEDIA>(), &mut room) else {
                walk.inside = walk.beyond::<MEDIA>(&surface, walk.ray.direction);
                walk.ray = surface.spawn(walk.ray.direction);
                continue;
            };
            if walk.depth == self.max_depth || matches!(material.recipe, Recipe::Nothing) {
                break;
            }
            let shading = Shading::new(bsdf, turn, &scene, material, &surface, walk.ray.direction);
            let sets = set::GATHERED + Sampler::FIRST_FREE + walk.depth * set::COUNT;
            let Some((scattered, direction)) = shading.sample(walk.sampler.one(sets + set::LOBE), walk.sampler.pair(sets + set::SCATTER))
            else {
                break;
            };
            if !scattered.specular {
                break;
            }
            if scattered.transmitted && material.recipe.has_inside() {
                walk.inside = walk.beyond::<MEDIA>(&surface, direction);
            }
            walk.throughput *= scattered.weight;
            walk.depth += 1;
            walk.ray = surface.spawn(direction);
            gathered = true;
        }
        found
    }
}

#[inline(never)]
fn share(caustics: &Caustics, chain: Chain) -> f64 {
    let looked_for = |region: Region| sent(chain.throughput, &region) * region.pdf(chain.direction);
    chain.pdf / (chain.pdf + caustics.at(chain.point).map_or(0.0, looked_for))
}
