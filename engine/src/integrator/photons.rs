//! Photons: light that is followed from its lights over mirrors and lenses, to learn where paths should look for it.

use std::ops::Range;

use rayon::prelude::*;

use super::{path, shading::Shading};
use crate::{
    light::{Caustics, Departing, Photon, Sources, luminance},
    material::Recipe,
    sampling::Sampler,
    scene::{Inside, Scene, Tracer, Work},
    shape::Ray,
};

/// Photons that are sent, as many for every picture: what they teach must not depend on how a picture is divided.
const COUNT: u64 = 1 << 16;

/// Those that are sent before, to learn where others are needed.
const SCOUTS: u64 = 1 << 14;

/// Those that are followed at a time.
const BATCH: u64 = 1 << 10;

/// Most mirrors and lenses on their way.
const MOST_BOUNCES: u32 = 16;

/// Learns where light is gathered, with all threads of the pool that the caller is in; what is learnt does not depend on their number. Paths need it: else the first of
/// them waits for it.
pub fn prepare(scene: &Scene) {
    if scene.caustics.get().is_none() {
        // Not within the lock: a thread of the pool that waits for others may begin work that waits for the lock.
        let _ = scene.caustics.set(gathered(scene));
    }
}

/// What was learnt, if light is gathered anywhere.
pub fn caustics(scene: &Scene) -> Option<&Caustics> {
    prepare(scene);
    scene.caustics.get().filter(|caustics| !caustics.is_empty())
}

fn gathered(scene: &Scene) -> Caustics {
    let Some(sources) = scene.gathered() else { return Caustics::default() };
    // The first ones show where others are few: of light on a bright spot enough is known soon. Bright spots must not be left out either, so the root of the root.
    let scouts = sent(scene, &sources, 0..SCOUTS);
    let scouted = Caustics::new(&scouts);
    let area = |photon: &Photon| scouted.at(photon.point).map_or(0.0, |region| region.area_of_photon());
    let sources = sources.aimed(scouts.iter().map(|photon| (photon.begin, area(photon).sqrt().sqrt())));
    Caustics::new(&sent(scene, &sources, SCOUTS..SCOUTS + COUNT))
}

/// Those that arrive, in order, of those with these numbers.
fn sent(scene: &Scene, sources: &Sources, numbers: Range<u64>) -> Vec<Photon> {
    let batches = (numbers.end - numbers.start) / BATCH;
    let batch = |batch: u64| scene.run(Batch { sources, first: numbers.start + batch * BATCH });
    (0..batches).into_par_iter().map(batch).collect::<Vec<_>>().concat()
}

/// Some photons in order.
struct Batch<'s> {
    sources: &'s Sources<'s>,
    first: u64,
}

impl Work for Batch<'_> {
    type Output = Vec<Photon>;

    #[inline(always)]
    fn run(self, scene: impl Tracer) -> Vec<Photon> {
        let numbers = self.first..self.first + BATCH;
        numbers.filter_map(|number| self.photon(scene, &Sampler::new(0, (0, 0), number))).collect()
    }
}

impl Batch<'_> {
    /// Follows a photon to where it is scattered, if it has been gathered before.
    fn photon(&self, scene: impl Tracer, sampler: &Sampler) -> Option<Photon> {
        let Departing { origin, direction, mut flux, begin } = self.sources.depart(sampler)?;
        let (mut ray, mut inside, mut caster) = (Ray::new(origin, direction), Inside::default(), None);
        for bounce in 0..=MOST_BOUNCES {
            let surface = scene.closest(&ray)?;
            let material = &scene.materials[surface.material as usize];
            if matches!(material.recipe, Recipe::Nothing) {
                return None;
            }
            let mut room = None;
            let (bsdf, turn) = path::bsdf(&scene, material, &surface, ray.direction, &inside, &mut room)?;
            let shading = Shading::new(bsdf, turn, &scene, material, &surface, ray.direction);
            if !shading.bsdf.is_specular() {
                return caster.map(|caster| Photon { point: surface.point, towards: -ray.direction, flux, caster, begin });
            }
            let sets = Sources::SETS + 2 * bounce;
            let (scattered, direction) = shading.sample(sampler.one(sets), sampler.pair(sets + 1))?;
            if scattered.transmitted && material.recipe.has_inside() {
                inside.cross(&surface, direction);
            }
            flux *= luminance(scattered.weight) * scattered.eta2;
            if flux <= 0.0 || flux.is_nan() {
                return None;
            }
            caster = Some((surface.object, bounce));
            ray = surface.spawn(direction);
        }
        None
    }
}
