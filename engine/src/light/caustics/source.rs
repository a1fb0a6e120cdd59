//! Photons as they leave lights, towards things that may gather them.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::squares::Squares;
use crate::{
    light::{Emitter, Environment, LightSampler, luminance},
    math::{UNIT, max_abs, orthonormal_basis},
    sampling::{Sampler, concentric_disc, uniform_cone, uniform_cone_pdf, uniform_sphere},
    shape::Bounds,
};

/// Most pairs of a light and a target: of more lights the strongest are taken, of more targets the largest.
const MOST_PAIRS: usize = 1 << 18;

/// The share of photons that go where others have been of use.
const AIMED: f64 = 0.75;

/// Most targets.
const MOST_TARGETS: usize = 1 << 10;

/// What of an image around the scene is so many times as bright as its mean sends photons: the rest is seen from so many places that chance finds it as well.
const BRIGHT: f64 = 16.0;

/// Places of an image that are looked at to learn how much of its light comes from bright ones.
const LOOKS: u64 = 1 << 12;

/// A ball around something.
#[derive(Clone, Copy, Debug)]
struct Ball {
    center: DVec3,
    radius: f64,
}

impl Ball {
    /// The smallest around a box.
    fn around(Bounds { min, max }: Bounds) -> Self {
        Self { center: (min + max) * 0.5, radius: (max - min).length() * 0.5 }
    }

    fn is_some(&self) -> bool {
        self.radius > 0.0 && self.radius.is_finite() && self.center.is_finite()
    }
}

/// Where photons come from and go to. Only lights that rays may find by chance send them.
#[derive(Debug)]
pub struct Sources<'s> {
    environment: &'s Environment,
    /// The luminance from which on it sends photons.
    bright: f64,
    /// Around all that light comes from afar to.
    whole: Ball,
    pairs: Vec<Pair<'s>>,
    /// Up to the end of each pair: how often it is chosen.
    sums: Vec<f64>,
    /// Where photons are sent of some pairs, in order, instead of evenly.
    aims: Vec<(u32, u32)>,
    squares: Squares,
}

#[derive(Clone, Copy, Debug)]
struct Pair<'s> {
    origin: Origin<'s>,
    target: Ball,
}

#[derive(Clone, Copy, Debug)]
enum Origin<'s> {
    Emitter(&'s Emitter),
    /// Towards its middle, its radiance, the squared sine of half the angle under which it is seen.
    Sun(DVec3, DVec3, f64),
    /// The share of its light that comes from bright places.
    Environment(f64),
}

/// How a photon leaves: the pair of light and target, and the numbers in [0, 1)^2 behind its direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct Begin {
    pair: u32,
    u: DVec2,
}

/// What a photon begins with.
#[derive(Clone, Copy, Debug)]
pub struct Departing {
    /// Where it starts.
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    /// The light that it stands for, by luminance.
    pub flux: f64,
    /// For [`Sources::aimed`].
    pub begin: Begin,
}

mod set {
    use crate::sampling::Sampler;

    pub const PAIR: u32 = Sampler::FIRST_FREE;
    pub const PLACE: u32 = Sampler::FIRST_FREE + 1;
    pub const DIRECTION: u32 = Sampler::FIRST_FREE + 2;
    pub const AIM: u32 = Sampler::FIRST_FREE + 3;
    /// Sets of all.
    pub const COUNT: u32 = 4;
}

impl<'s> Sources<'s> {
    /// The first set of numbers of a sampler that [`Self::depart`] does not use.
    pub const SETS: u32 = set::PAIR + set::COUNT;

    /// Of the lights of a scene within some bounds, and boxes around what may gather their light, of which infinite ones are left out. `None` if there are no such lights or no targets.
    pub fn new(lights: &'s LightSampler, environment: &'s Environment, boxes: Vec<Bounds>, bounds: Bounds) -> Option<Self> {
        let mut targets: Vec<_> = boxes.into_iter().map(Ball::around).filter(Ball::is_some).collect();
        let whole = Some(Ball::around(bounds)).filter(|whole| whole.is_some() && !targets.is_empty())?;
        targets.sort_by(|a, b| b.radius.total_cmp(&a.radius));
        targets.truncate(MOST_TARGETS);
        let mut emitters: Vec<_> = lights.emitters.iter().collect();
        if emitters.len() * targets.len() > MOST_PAIRS {
            emitters.sort_by(|a, b| power(b).total_cmp(&power(a)));
            emitters.truncate(MOST_PAIRS / targets.len());
        }
        let mut origins: Vec<_> = emitters.into_iter().map(Origin::Emitter).collect();
        origins.extend(lights.suns().map(|(towards, radiance, sin2)| Origin::Sun(towards, radiance, sin2)));
        let bright = BRIGHT * luminance(environment.mean_radiance());
        let share = if matches!(environment, Environment::Image(_)) { share_of_bright(environment, bright) } else { 0.0 };
        if share > 0.0 {
            origins.push(Origin::Environment(share));
        }
        let pairs: Vec<_> = origins.iter().flat_map(|&origin| targets.iter().map(move |&target| Pair { origin, target })).collect();
        let mut sum = 0.0;
        let mut up_to = |pair: &Pair| {
            sum += pair.power(environment);
            sum
        };
        let sums: Vec<_> = pairs.iter().map(&mut up_to).collect();
        (sum > 0.0 && sum.is_finite()).then_some(Self {
            environment,
            bright,
            whole,
            pairs,
            sums,
            aims: Vec::new(),
            squares: Squares::default(),
        })
    }

    /// The same, but most photons go where others have been of use: each of these with its worth, not negative.
    #[must_use]
    pub fn aimed(self, photons: impl Iterator<Item = (Begin, f64)>) -> Self {
        let mut photons: Vec<_> = photons.filter(|(_, worth)| *worth > 0.0).collect();
        photons.sort_by_key(|(begin, _)| begin.pair);
        let (all, worth) = (self.sums.last().copied().unwrap_or(0.0), photons.iter().map(|(_, worth)| worth).sum::<f64>());
        let mut shares: Vec<f64> = (0..self.sums.len()).map(|at| 0.5 * self.power(at) / all).collect();
        let (mut aims, mut squares) = (Vec::new(), Squares::default());
        for photons in photons.chunk_by(|a, b| a.0.pair == b.0.pair) {
            let pair = photons[0].0.pair;
            shares[pair as usize] += 0.5 * photons.iter().map(|(_, worth)| worth).sum::<f64>() / worth;
            aims.push((pair, squares.add(photons.iter().map(|(begin, worth)| (begin.u, *worth)).collect())));
        }
        let mut sum = 0.0;
        let sums = shares.into_iter().map(|share| {
            sum += share;
            sum
        });
        Self { sums: sums.collect(), aims, squares, ..self }
    }

    fn power(&self, at: usize) -> f64 {
        self.sums[at] - if at > 0 { self.sums[at - 1] } else { 0.0 }
    }

    /// A photon; `None` where a light does not shine.
    pub fn depart(&self, sampler: &Sampler) -> Option<Departing> {
        let all = *self.sums.last()?;
        let pick = sampler.one(set::PAIR) * all;
        let at = self.sums.partition_point(|sum| *sum <= pick).min(self.sums.len() - 1);
        let (mut u, mut density) = (sampler.pair(set::DIRECTION), self.power(at) / all);
        if let Ok(aim) = self.aims.binary_search_by_key(&(at as u32), |(pair, _)| *pair) {
            // Evenly too, or those that go where none went before would count too much.
            let first = self.aims[aim].1;
            if sampler.one(set::AIM) < AIMED {
                u = self.squares.sample(first, u).0;
            }
            density *= AIMED * self.squares.pdf(first, u) + (1.0 - AIMED);
        }
        let Pair { origin, target } = self.pairs[at];
        let (origin, direction, flux) = match origin {
            Origin::Emitter(emitter) => depart_from(emitter, target, sampler.pair(set::PLACE), u),
            Origin::Sun(towards, radiance, sin2) => {
                let (x, y) = orthonormal_basis(towards);
                let local = uniform_cone(sampler.pair(set::PLACE), sin2);
                let way = x * local.x + y * local.y + towards * local.z;
                Some(self.across(target, way, radiance / uniform_cone_pdf(sin2), u))
            }
            Origin::Environment(_) => {
                let (towards, radiance, pdf) = self.environment.sample(sampler.pair(set::PLACE))?;
                (luminance(radiance) >= self.bright).then(|| self.across(target, towards, radiance / pdf, u))
            }
        }?;
        let flux = flux / density;
        let begin = Begin { pair: at as u32, u };
        (flux > 0.0 && flux.is_finite()).then_some(Departing { origin, direction, flux, begin })
    }

    /// From outside of everything, through the target's cross-section.
    fn across(&self, target: Ball, towards: DVec3, irradiance: DVec3, u: DVec2) -> (DVec3, DVec3, f64) {
        let (x, y) = orthonormal_basis(towards);
        let at = concentric_disc(u) * target.radius;
        let far = self.whole.radius + target.radius + target.center.distance(self.whole.center);
        let origin = target.center + x * at.x + y * at.y + towards * far;
        (origin, -towards, luminance(irradiance) * PI * target.radius * target.radius)
    }
}

impl Pair<'_> {
    /// About what the light sends to the target.
    fn power(&self, environment: &Environment) -> f64 {
        let section = PI * self.target.radius * self.target.radius;
        match self.origin {
            Origin::Emitter(emitter) => {
                let Bounds { min, max } = emitter.bounds();
                let squared = self.target.center.distance_squared((min + max) * 0.5) + self.target.radius * self.target.radius;
                power(emitter) * section / squared
            }
            Origin::Sun(_, radiance, sin2) => luminance(radiance) * PI * sin2 * section,
            Origin::Environment(share) => luminance(environment.mean_radiance()) * 4.0 * PI * share * section,
        }
    }
}

/// How much of an image's light comes from where it has this luminance.
fn share_of_bright(environment: &Environment, bright: f64) -> f64 {
    let (mut all, mut of_bright) = (0.0, 0.0);
    for look in 0..LOOKS {
        let Some((_, radiance, pdf)) = environment.sample(Sampler::new(0, (0, 0), look).pair(set::PLACE)) else { continue };
        let power = luminance(radiance) / pdf;
        all += power;
        of_bright += if luminance(radiance) >= bright { power } else { 0.0 };
    }
    if of_bright > 0.0 { of_bright / all } else { 0.0 }
}

/// In all directions, but for a factor.
fn power(emitter: &Emitter) -> f64 {
    luminance(emitter.radiance) * emitter.size()
}

/// Start, direction and flux.
fn depart_from(emitter: &Emitter, target: Ball, place: DVec2, u: DVec2) -> Option<(DVec3, DVec3, f64)> {
    let (origin, normal) = emitter.point(place);
    let (direction, pdf) = towards(target, origin, u);
    let cos = direction.dot(normal);
    let shines = cos > 0.0 || emitter.two_sided;
    // Off the light itself, by more than rounding moves it.
    let origin = origin + normal * (1024.0 * UNIT * max_abs(origin)).copysign(cos);
    shines.then(|| (origin, direction, power(emitter) * cos.abs() / pdf))
}

/// A direction from a point to a ball, with its density by solid angle.
fn towards(ball: Ball, from: DVec3, u: DVec2) -> (DVec3, f64) {
    let way = ball.center - from;
    let sin2 = ball.radius * ball.radius / way.length_squared();
    if sin2 < 1.0 {
        let axis = way.normalize();
        let (x, y) = orthonormal_basis(axis);
        let local = uniform_cone(u, sin2);
        (x * local.x + y * local.y + axis * local.z, uniform_cone_pdf(sin2))
    } else {
        (uniform_sphere(u), 0.25 / PI)
    }
}
