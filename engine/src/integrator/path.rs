//! Path tracing: all light that a scene's materials pass on.

use glam::{DVec2, DVec3};

use super::{
    Integrator, RayCounts,
    chain::Chain,
    found,
    shading::{self, Shading},
    sought::Sought,
};
use crate::{
    light::{Arriving, Caustics, Vertex},
    material::{Bsdf, Material, Medium, MetallicRoughness, Recipe, Scattered, Travel},
    sampling::Sampler,
    scene::{Hit, Inside, Scene, Tracer},
    shape::{Ray, Surface},
};

/// Unidirectional path tracing with next-event estimation (Kajiya, "The Rendering Equation", 1986; Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., 13.4 and 14.2): at
/// every vertex one ray goes to a light that stands somewhere, one to a light infinitely far away, where there are such, and one goes on as the material scatters. What both
/// kinds of rays find is weighted by the power heuristic. Chains of little weight end by chance (Arvo and Kirk, "Particle Transport and Image Synthesis", 1990).
///
/// `MEDIA` says whether something fills space anywhere, or has a border that cannot be seen.
#[derive(Debug)]
pub struct Path<'s, const MEDIA: bool> {
    pub(super) max_depth: u32,
    roulette_depth: u32,
    smooth_terminator: bool,
    /// Where light is gathered, if anywhere.
    pub(super) caustics: Option<&'s Caustics>,
    pub(super) counts: RayCounts,
    walks: Vec<Walk>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    sought: Sought<MEDIA>,
}

/// What a sample's numbers are for, at every vertex; sets before these belong to film and lens.
pub(super) mod set {
    pub const LIGHT: u32 = 0;
    pub const PLACE: u32 = 1;
    pub const DISTANT: u32 = 2;
    pub const DIRECTION: u32 = 3;
    pub const LOBE: u32 = 4;
    pub const SCATTER: u32 = 5;
    pub const ROULETTE: u32 = 6;
    pub const TRAVEL: u32 = 7;
    /// Sets of one vertex.
    pub const COUNT: u32 = 8;
    /// The direction in which gathered light is looked for, of the set of a path one ray longer.
    pub const GATHERED: u32 = 1 << 30;
    /// The first of those for ways that begin where a ray has gone through something: beyond the sets of the longest path.
    pub const PASSED: u32 = 1 << 31;
}

/// Surfaces without effect that a ray goes through before it is given up: objects that touch everywhere would hold it forever.
pub(super) const MOST_PASSED: u32 = 10_000;

/// Chains end by chance with no smaller chance to go on: one far below 2^-53 could not be told from none, and what went on would be far too bright.
const LEAST_SURVIVAL: f64 = 1.0 / 256.0;

/// A path as far as it is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk {
    /// Which of the paths that are followed together.
    pub(super) number: u32,
    pub(super) sampler: Sampler,
    pub(super) ray: Ray,
    /// Rays so far.
    pub(super) depth: u32,
    /// What the radiance along the ray is multiplied by in the pixel.
    pub(super) throughput: DVec3,
    /// Radiance is compressed where light is slow, but what ends by chance must not depend on it.
    pub(super) compression: f64,
    /// Where the ray was sent from, and with which density.
    pub(super) last: Option<found::Last>,
    /// Where the last ray was sent from whose direction was not the only one: since then there were mirrors and lenses alone.
    pub(super) chain: Option<Chain>,
    /// What the ray is inside of.
    pub(super) inside: Inside,
    /// Where several objects have a face where it meets one: what it is inside of at the one that shows, and behind all.
    pub(super) joint: Option<[Inside; 2]>,
    /// The set of numbers for what happens on the way to the next surface: one for each way, as several lead through media in turn.
    pub(super) travel: u32,
    /// Surfaces without effect that it went through.
    pub(super) passed: u32,
}

impl Walk {
    /// From the camera.
    #[inline(always)]
    fn new(number: usize, ray: &Ray, sampler: &Sampler, inside: Inside) -> Self {
        Self {
            number: number as u32,
            sampler: *sampler,
            ray: *ray,
            depth: 1,
            throughput: DVec3::ONE,
            compression: 1.0,
            last: None,
            chain: None,
            inside,
            joint: None,
            travel: Sampler::FIRST_FREE + set::TRAVEL,
            passed: 0,
        }
    }

    /// Whether the ray's direction was the only one.
    #[inline(always)]
    pub(super) fn is_after_mirror(&self) -> bool {
        self.last.is_none()
    }

    /// What the ray is inside of where it meets a surface.
    #[inline(always)]
    pub(super) fn before<const MEDIA: bool>(&self) -> &Inside {
        self.joint.as_ref().filter(|_| MEDIA).map_or(&self.inside, |[before, _]| before)
    }

    /// The same behind it.
    #[inline(always)]
    pub(super) fn beyond<const MEDIA: bool>(&self, surface: &Surface, direction: DVec3) -> Inside {
        match &self.joint {
            Some([_, beyond]) if MEDIA => *beyond,
            _ => {
                let mut beyond = self.inside;
                beyond.cross(surface, direction);
                beyond
            }
        }
    }
}

/// What becomes of a path where it meets a surface.
enum Next {
    /// It goes on.
    Along(Scattered, DVec3, Vertex),
    /// As if nothing were there.
    Passes,
    /// It ends.
    Ends,
}

impl<'s, const MEDIA: bool> Path<'s, MEDIA> {
    /// With the settings of [`crate::description::Render::Path`], and what is known of where light is gathered.
    pub fn new(max_depth: u32, roulette_depth: u32, smooth_terminator: bool, caustics: Option<&'s Caustics>) -> Self {
        Self {
            max_depth,
            roulette_depth,
            smooth_terminator,
            caustics,
            counts: RayCounts::default(),
            walks: Vec::new(),
            rays: Vec::new(),
            hits: Vec::new(),
            sought: Sought::default(),
        }
    }
}

impl<const MEDIA: bool> Integrator for Path<'_, MEDIA> {
    #[inline(always)]
    fn radiance(&mut self, scene: impl Tracer, rays: &[Ray], samplers: &[Sampler], radiance: &mut [DVec3]) {
        let mut walks = std::mem::take(&mut self.walks);
        walks.extend(
            rays.iter().zip(samplers).enumerate().map(|(number, (ray, sampler))| Walk::new(number, ray, sampler, scene.around_eye)),
        );
        self.hits.clear();
        scene.hits_from_eye(rays, |_, hit| self.hits.push(hit));
        loop {
            let mut left = 0;
            for number in 0..walks.len() {
                let walk = &mut walks[number];
                scene.prefetch(&self.hits, number);
                let met = self.hits[number].and_then(|hit| scene.surface(&walk.ray, &hit));
                if self.advance(scene, walk, met, &mut radiance[walk.number as usize]) {
                    walks[left] = walks[number];
                    left += 1;
                }
            }
            walks.truncate(left);
            self.sought.arrive(scene, radiance);
            if walks.is_empty() {
                break;
            }
            self.rays.clear();
            self.rays.extend(walks.iter().map(|walk| walk.ray));
            self.hits.clear();
            scene.hits(&self.rays, |_, hit| self.hits.push(hit));
        }
        self.walks = walks;
    }

    fn counts(&self) -> RayCounts {
        self.counts
    }
}

impl<const MEDIA: bool> Path<'_, MEDIA> {
    /// Follows a path from where its ray met something, if it did; whether it goes on.
    #[inline(always)]
    fn advance(&mut self, scene: impl Tracer, walk: &mut Walk, mut met: Option<Surface>, radiance: &mut DVec3) -> bool {
        if let Some(surface) = met.as_mut().filter(|_| self.smooth_terminator || MEDIA) {
            self.look_closer(scene, surface, walk);
        }
        let sets = Sampler::FIRST_FREE + (walk.depth - 1) * set::COUNT;
        let next = match self.scattered_on_the_way(scene, walk, met.as_ref(), sets) {
            Some(next) => next,
            None => match &met {
                None => {
                    *radiance += walk.throughput * found::leaving(scene, walk.ray.direction, walk.last.as_ref()) * self.share(walk);
                    Next::Ends
                }
                Some(surface) => self.meet(scene, surface, walk, sets, radiance),
            },
        };
        match (next, &met) {
            (Next::Along(scattered, direction, vertex), _) => {
                if self.caustics.is_some() && !scattered.specular {
                    walk.chain = vertex.normal.map(|_| Chain {
                        point: vertex.point,
                        direction,
                        pdf: scattered.pdf,
                        throughput: walk.throughput.max_element(),
                    });
                }
                walk.ray = match (&met, vertex.normal) {
                    (Some(surface), Some(_)) => surface.spawn(direction),
                    _ => Ray::new(vertex.point, direction),
                };
                self.goes_on(walk, &scattered, vertex, sets)
            }
            (Next::Passes, Some(surface)) if walk.passed < MOST_PASSED => {
                walk.travel = set::PASSED + walk.passed;
                walk.passed += 1;
                walk.inside = walk.beyond::<MEDIA>(surface, walk.ray.direction);
                walk.ray = surface.spawn(walk.ray.direction);
                walk.last.iter_mut().for_each(|last| last.distance += surface.t);
                true
            }
            _ => false,
        }
    }

    /// Looks for what a ray does not tell that meets a surface: other faces in the same place, and the smooth surface that a coarse one stands for.
    #[inline(always)]
    pub(super) fn look_closer(&self, scene: impl Tracer, surface: &mut Surface, walk: &mut Walk) {
        if MEDIA && scene.may_touch {
            let joint = walk.inside.joint(&scene, surface, walk.ray.direction);
            walk.joint = joint.map(|joint| [joint.before, joint.beyond]);
            *surface = joint.map_or(*surface, |joint| joint.surface);
        }
        if self.smooth_terminator {
            *surface = scene.smoothed(surface, walk.ray.direction);
        }
    }

    /// Adds what a surface shows by itself and what it scatters once, and chooses where the path goes on.
    #[inline(always)]
    fn meet(&mut self, scene: impl Tracer, surface: &Surface, walk: &mut Walk, sets: u32, radiance: &mut DVec3) -> Next {
        let material = &scene.materials[surface.material as usize];
        let direction = walk.ray.direction;
        if let Some(emission) = &material.emission {
            *radiance += walk.throughput * found::shining(scene, surface, emission, direction, walk.last.as_ref()) * self.share(walk);
        }
        let mut room = None;
        let Some((bsdf, turn)) = bsdf(&scene, material, surface, direction, walk.before::<MEDIA>(), &mut room) else { return Next::Passes };
        if walk.depth == self.max_depth || matches!(material.recipe, Recipe::Nothing) {
            return Next::Ends;
        }
        let shading = Shading::new(bsdf, turn, &scene, material, surface, direction);
        let vertex = Vertex { point: surface.point, normal: Some(surface.ng) };
        if !shading.bsdf.is_specular() {
            let evaluate = |direction| shading.evaluate(direction);
            self.seek(scene, Some(surface), walk, &vertex, sets, evaluate);
            if let Some(caustics) = self.caustics {
                *radiance += walk.throughput * self.gathered(scene, caustics, surface, &shading, walk, sets);
            }
        }
        let pick = if shading.bsdf.has_lobes() { walk.sampler.one(sets + set::LOBE) } else { 0.0 };
        let Some((scattered, direction)) = shading.sample(pick, walk.sampler.pair(sets + set::SCATTER)) else { return Next::Ends };
        if scattered.transmitted && material.recipe.has_inside() {
            walk.inside = walk.beyond::<MEDIA>(surface, direction);
        }
        Next::Along(scattered, direction, vertex)
    }

    /// Lets light be weakened, and perhaps scattered, on the way to the next surface.
    #[inline(always)]
    fn scattered_on_the_way(&mut self, scene: impl Tracer, walk: &mut Walk, met: Option<&Surface>, sets: u32) -> Option<Next> {
        if !MEDIA {
            return None;
        }
        let medium = walk.inside.medium(&scene)?;
        let distance = met.map_or(f64::INFINITY, |surface| surface.t);
        let u = if medium.scatters() { walk.sampler.pair(walk.travel) } else { DVec2::ZERO };
        match medium.travel(distance, u) {
            Travel::Arrives(weight) => {
                walk.throughput *= weight;
                (walk.throughput == DVec3::ZERO).then_some(Next::Ends)
            }
            Travel::Scatters(way, weight) => {
                walk.throughput *= weight;
                if walk.depth == self.max_depth {
                    return Some(Next::Ends);
                }
                Some(self.scatter_in(scene, medium, walk, walk.ray.at(way), sets))
            }
        }
    }

    /// A vertex within a medium.
    #[inline(never)]
    fn scatter_in(&mut self, scene: impl Tracer, medium: &Medium, walk: &Walk, point: DVec3, sets: u32) -> Next {
        let vertex = Vertex { point, normal: None };
        let along = walk.ray.direction;
        let evaluate = |direction: DVec3| {
            let pdf = medium.phase(along.dot(direction));
            (DVec3::splat(pdf), pdf)
        };
        self.seek(scene, None, walk, &vertex, sets, evaluate);
        let (direction, pdf) = medium.scatter(along, walk.sampler.pair(sets + set::SCATTER));
        Next::Along(Scattered { transmitted: true, ..Scattered::reflected(direction, DVec3::ONE, pdf) }, direction, vertex)
    }

    /// Makes a path one ray longer, unless chance or a weight of 0 ends it.
    #[inline(always)]
    fn goes_on(&mut self, walk: &mut Walk, scattered: &Scattered, vertex: Vertex, sets: u32) -> bool {
        let Scattered { weight, pdf, specular, eta2, .. } = *scattered;
        walk.throughput *= weight;
        walk.compression *= eta2;
        if walk.depth >= self.roulette_depth {
            // The root: between ending as much as a path has lost, which costs the least time, and never, which adds the least noise.
            let survival = (walk.throughput * walk.compression).max_element().sqrt().max(LEAST_SURVIVAL);
            if survival < 1.0 {
                if walk.sampler.one(sets + set::ROULETTE) >= survival {
                    return false;
                }
                walk.throughput *= 1.0 / survival;
            }
        }
        walk.last = (!specular).then_some(found::Last { vertex, pdf, distance: 0.0 });
        walk.depth += 1;
        walk.travel = sets + set::COUNT + set::TRAVEL;
        self.counts.secondary += 1;
        walk.throughput != DVec3::ZERO
    }

    /// Seeks light that comes straight from lights and is scattered once, as `evaluate` says.
    #[inline(always)]
    fn seek(
        &mut self,
        scene: impl Tracer,
        surface: Option<&Surface>,
        walk: &Walk,
        vertex: &Vertex,
        sets: u32,
        evaluate: impl Fn(DVec3) -> (DVec3, f64),
    ) {
        let lights = &scene.light_sampler;
        if lights.has_local() {
            let (pick, u) = (|| walk.sampler.one(sets + set::LIGHT), || walk.sampler.pair(sets + set::PLACE));
            if let Some(arriving) = lights.sample_local(&scene.lights, vertex, pick, u) {
                self.seek_from(scene, surface, walk, vertex, &arriving, &evaluate);
            }
        }
        if lights.has_distant() {
            let (pick, u) = (|| walk.sampler.one(sets + set::DISTANT), || walk.sampler.pair(sets + set::DIRECTION));
            if let Some(arriving) = lights.sample_distant(&scene.lights, &scene.environment, vertex, pick, u) {
                self.seek_from(scene, surface, walk, vertex, &arriving, &evaluate);
            }
        }
    }

    /// Seeks the light of one of them.
    #[inline(always)]
    fn seek_from(
        &mut self,
        scene: impl Tracer,
        surface: Option<&Surface>,
        walk: &Walk,
        vertex: &Vertex,
        arriving: &Arriving,
        evaluate: &impl Fn(DVec3) -> (DVec3, f64),
    ) {
        let (f, pdf) = evaluate(arriving.direction);
        if f == DVec3::ZERO {
            return;
        }
        let weight = arriving.pdf.map_or(1.0, |of_light| found::power_heuristic(of_light, pdf));
        let ray = match surface {
            Some(surface) => {
                let side = arriving.direction.dot(surface.ng);
                Ray { t_max: arriving.distance, leaves: surface.leaves(side), ..Ray::new(surface.start(side), arriving.direction) }
            }
            None => Ray { t_max: arriving.distance, ..Ray::new(vertex.point, arriving.direction) },
        };
        let inside = || match surface {
            Some(surface) if goes_through(scene, surface, walk.ray.direction, ray.direction) => {
                walk.beyond::<MEDIA>(surface, ray.direction)
            }
            _ => walk.inside,
        };
        self.counts.shadow += 1;
        self.sought.push(ray, arriving, walk.throughput * f * weight * arriving.light, walk.number, inside);
    }
}

/// How a surface scatters light at a point that a ray along `direction` meets, and the turn of its tangent; `None` if it cannot be seen there. `room` is where a large model is put, so that small ones stay small.
#[inline(always)]
pub(super) fn bsdf<'s: 'r, 'r>(
    scene: &'s Scene,
    material: &'s Material,
    surface: &Surface,
    direction: DVec3,
    inside: &Inside,
    room: &'r mut Option<MetallicRoughness<'s>>,
) -> Option<(Bsdf<'r>, DVec2)> {
    let bsdf = match &material.recipe {
        Recipe::Boundary { .. } => return None,
        Recipe::Glass(glass) => Bsdf::Dielectric(glass.beside(inside.outside_of(scene, surface)?)),
        Recipe::Model(model) => {
            let outside = if model.ior().is_some() { inside.outside_of(scene, surface)? } else { 1.0 };
            let (mut model, turn) = model.at(outside, &scene.textures, surface);
            if let Some(normal) = shading::coat_normal(turn, scene, material, surface, direction) {
                model = model.with_coat_normal(normal);
            }
            return Some((Bsdf::MetallicRoughness(room.insert(model)), turn));
        }
        recipe => recipe.bsdf(material, &scene.textures, surface),
    };
    Some((bsdf, DVec2::X))
}

/// Whether light that a ray along `to` brings to what a ray along `from` has met comes from inside of it, or leaves it.
pub(super) fn goes_through(scene: impl Tracer, surface: &Surface, from: DVec3, to: DVec3) -> bool {
    scene.materials[surface.material as usize].recipe.has_inside() && (from.dot(surface.ng) < 0.0) == (to.dot(surface.ng) < 0.0)
}
