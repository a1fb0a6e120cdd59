//! All lights of a scene, and what arrives from one of them.

use glam::{DVec2, DVec3};

use super::{
    Emitter, Environment, Light, luminance,
    tree::{Cluster, LightTree},
};
use crate::{
    math::orthonormal_basis,
    sampling::{uniform_cone, uniform_cone_pdf},
    shape::Bounds,
};
use std::f64::consts::{FRAC_1_PI, PI};

/// Where light is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// The place.
    pub point: DVec3,
    /// The unit normal of the surface there; `None` in a medium.
    pub normal: Option<DVec3>,
}

/// What arrives at a vertex from one place of one light, where nothing stands between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arriving {
    /// Unit vector towards the light.
    pub direction: DVec3,
    /// How far a ray towards it goes before it is there.
    pub distance: f64,
    /// Radiance over the density of choosing it, or irradiance over its probability.
    pub light: DVec3,
    /// Density by solid angle with which it was chosen; `None` for light that no other ray can find.
    pub pdf: Option<f64>,
    /// Index among the lights without extent, if it is one of these.
    pub delta: Option<u32>,
    /// The emitter whose radiance has to be looked up: `light` is white then.
    pub textured: Option<u32>,
}

/// All lights of a scene: those that stand at a place, in a tree, and those infinitely far away.
#[derive(Debug, Default)]
pub struct LightSampler {
    /// Surfaces that shine, sorted by object and part.
    pub emitters: Vec<Emitter>,
    tree: LightTree,
    /// What each light of the tree is.
    local: Vec<Local>,
    /// The place in the tree of each emitter.
    place_of_emitter: Vec<u32>,
    /// Lights without a place, each with its probability.
    distant: Vec<(Distant, f64)>,
    /// Of the environment.
    environment: f64,
}

#[derive(Clone, Copy, Debug)]
enum Local {
    /// A light without extent.
    Delta(u32),
    Emitter(u32),
}

#[derive(Clone, Copy, Debug)]
enum Distant {
    Delta(u32),
    /// Seen under an angle: towards the middle, its radiance, the squared sine of half the angle.
    Disc(DVec3, DVec3, f64),
    Environment,
}

impl LightSampler {
    /// Of all lights of a scene. An environment that is the same on all sides is left to rays that find it by themselves: they do it better.
    pub fn new(mut emitters: Vec<Emitter>, lights: &[Light], environment: &Environment) -> Self {
        emitters.sort_by_key(|emitter| (emitter.object, emitter.part));
        let (mut local, mut clusters, mut distant) = (Vec::new(), Vec::new(), Vec::new());
        for (index, light) in (0..).zip(lights) {
            match cluster_of_light(light) {
                Some(cluster) if cluster.power > 0.0 => {
                    clusters.push(cluster);
                    local.push(Local::Delta(index));
                }
                Some(_) => {}
                None => distant.extend(distant_light(index, light)),
            }
        }
        let place_of_emitter = (0..emitters.len() as u32).map(|index| index + local.len() as u32).collect();
        local.extend((0..emitters.len() as u32).map(Local::Emitter));
        clusters.extend(emitters.iter().map(cluster_of_emitter));
        let mean = environment.mean_radiance();
        if matches!(environment, Environment::Image(_)) && luminance(mean) > 0.0 {
            distant.push((Distant::Environment, luminance(mean) * PI));
        }
        let total: f64 = distant.iter().map(|(_, power)| power).sum();
        distant.iter_mut().for_each(|(_, power)| *power /= total);
        let environment = distant.iter().find(|(light, _)| matches!(light, Distant::Environment)).map_or(0.0, |(_, share)| *share);
        Self { tree: LightTree::new(&clusters), emitters, local, place_of_emitter, distant, environment }
    }

    /// Whether there are lights without a place.
    pub fn has_distant(&self) -> bool {
        !self.distant.is_empty()
    }

    /// Whether there are lights that stand somewhere.
    pub fn has_local(&self) -> bool {
        !self.tree.is_empty()
    }

    /// Light from a light that stands somewhere: `pick` draws the number in [0, 1) that chooses the light, `u` those that choose the place on it, where there is a choice.
    #[inline]
    pub fn sample_local(
        &self,
        lights: &[Light],
        vertex: &Vertex,
        pick: impl FnOnce() -> f64,
        u: impl FnOnce() -> DVec2,
    ) -> Option<Arriving> {
        let pick = if self.local.len() > 1 { pick() } else { 0.0 };
        let (place, probability) = self.tree.sample(vertex.point, vertex.normal, pick)?;
        match self.local[place as usize] {
            Local::Delta(index) => delta(lights, index, vertex.point, probability),
            Local::Emitter(index) => {
                let emitter = &self.emitters[index as usize];
                let sample = emitter.sample(vertex.point, u())?;
                let pdf = sample.pdf * probability;
                let (radiance, textured) = if emitter.textured { (DVec3::ONE, Some(index)) } else { (emitter.radiance, None) };
                let light = radiance / pdf;
                Some(Arriving { direction: sample.direction, distance: sample.distance, light, pdf: Some(pdf), delta: None, textured })
            }
        }
    }

    /// The same of the lights infinitely far away.
    #[inline]
    pub fn sample_distant(
        &self,
        lights: &[Light],
        environment: &Environment,
        vertex: &Vertex,
        pick: impl FnOnce() -> f64,
        u: impl FnOnce() -> DVec2,
    ) -> Option<Arriving> {
        let (mut at, mut left) = (0, if self.distant.len() > 1 { pick() } else { 0.0 });
        while at + 1 < self.distant.len() && left >= self.distant[at].1 {
            left -= self.distant[at].1;
            at += 1;
        }
        let (light, probability) = self.distant.get(at)?;
        match *light {
            Distant::Delta(index) => delta(lights, index, vertex.point, *probability),
            Distant::Disc(towards, radiance, sin2) => {
                let (x, y) = orthonormal_basis(towards);
                let local = uniform_cone(u(), sin2);
                let direction = x * local.x + y * local.y + towards * local.z;
                let pdf = uniform_cone_pdf(sin2) * probability;
                let light = radiance / pdf;
                Some(Arriving { direction, distance: f64::INFINITY, light, pdf: Some(pdf), delta: None, textured: None })
            }
            Distant::Environment => {
                let (direction, radiance, pdf) = environment.sample(u())?;
                let pdf = pdf * probability;
                Some(Arriving { direction, distance: f64::INFINITY, light: radiance / pdf, pdf: Some(pdf), delta: None, textured: None })
            }
        }
    }

    /// The emitter that is a part of an object.
    pub fn emitter(&self, object: u32, part: u32) -> Option<u32> {
        self.emitters.binary_search_by_key(&(object, part), |emitter| (emitter.object, emitter.part)).ok().map(|index| index as u32)
    }

    /// The density by solid angle with which [`Self::sample_local`] chooses a place on an emitter, in this direction and at this distance.
    #[inline]
    pub fn emitter_pdf(&self, vertex: &Vertex, emitter: u32, direction: DVec3, distance: f64) -> f64 {
        let probability = self.tree.probability(vertex.point, vertex.normal, self.place_of_emitter[emitter as usize]);
        if probability > 0.0 { probability * self.emitters[emitter as usize].pdf(vertex.point, direction, distance) } else { 0.0 }
    }

    /// The density by solid angle with which [`Self::sample_distant`] chooses a direction of the environment.
    #[inline]
    pub fn environment_pdf(&self, environment: &Environment, direction: DVec3) -> f64 {
        if self.environment > 0.0 { self.environment * environment.pdf(direction) } else { 0.0 }
    }

    /// All distant lights of some extent: the direction to the middle of each, its radiance, and the squared sine of half the angle under which it is seen.
    pub fn suns(&self) -> impl Iterator<Item = (DVec3, DVec3, f64)> {
        self.distant.iter().filter_map(|(light, _)| match *light {
            Distant::Disc(towards, radiance, sin2) => Some((towards, radiance, sin2)),
            _ => None,
        })
    }

    /// Distant lights of some extent that are seen in a direction: radiance and density of each.
    #[inline]
    pub fn discs(&self, direction: DVec3) -> impl Iterator<Item = (DVec3, f64)> {
        self.distant.iter().filter_map(move |(light, probability)| match light {
            Distant::Disc(towards, radiance, sin2) => {
                let beside = direction - *towards;
                // The chord, whose square is 2 - 2 cos: exact where a difference of cosines is not.
                let within = beside.length_squared() <= 2.0 * sin2 / (1.0 + (1.0 - sin2).sqrt());
                within.then(|| (*radiance, uniform_cone_pdf(*sin2) * probability))
            }
            _ => None,
        })
    }
}

fn delta(lights: &[Light], index: u32, from: DVec3, probability: f64) -> Option<Arriving> {
    let sample = lights[index as usize].sample(from);
    let light = sample.irradiance / probability;
    let arrives = light.max_element() > 0.0;
    let (direction, distance) = (sample.direction, sample.distance);
    arrives.then_some(Arriving { direction, distance, light, pdf: None, delta: Some(index), textured: None })
}

fn cluster_of_light(light: &Light) -> Option<Cluster> {
    let power = luminance(light.power()?);
    let at = |point| Bounds { min: point, max: point };
    match *light {
        Light::Point { position, .. } => {
            Some(Cluster { bounds: at(position), power, axis: DVec3::Z, spread: -1.0, reach: -1.0, two_sided: false })
        }
        Light::Spot { position, axis, cosines: [_, outer], .. } => {
            Some(Cluster { bounds: at(position), power, axis, spread: 1.0, reach: outer, two_sided: false })
        }
        Light::Directional { .. } => None,
    }
}

fn cluster_of_emitter(emitter: &Emitter) -> Cluster {
    let (axis, spread) = emitter.normals();
    let sides = if emitter.two_sided { 2.0 } else { 1.0 };
    let power = luminance(emitter.radiance) * emitter.size() * PI * sides;
    Cluster { bounds: emitter.bounds(), power, axis, spread, reach: 0.0, two_sided: emitter.two_sided }
}

fn distant_light(index: u32, light: &Light) -> Option<(Distant, f64)> {
    match *light {
        Light::Point { strength, .. } => Some((Distant::Delta(index), luminance(strength))),
        Light::Directional { towards, irradiance, spread } => {
            let power = luminance(irradiance);
            let light =
                if spread > 0.0 { Distant::Disc(towards, irradiance * (FRAC_1_PI / spread), spread) } else { Distant::Delta(index) };
            Some((light, power))
        }
        Light::Spot { .. } => None,
    }
    .filter(|(_, power)| *power > 0.0)
}
