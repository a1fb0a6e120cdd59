//! Coordinates in which a tree's boxes fit f32 well, and rays in them.

use glam::{DVec3, Vec3};

use super::build::Box3;
use crate::{math::max_abs, shape::Bounds};

/// Centre and power-of-two scale that take everything in a tree into [-1, 1]. So f32 boxes are tight wherever the tree lies in the world, and
/// a tree scaled by a power of two is traversed in the same steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalisation {
    center: DVec3,
    scale: f64,
    /// 1 / scale.
    unscale: f64,
}

/// Bound on the relative error, in f64, of moving a ray's start, and of its coordinates in an instance that stands in a tree of the world: where lengths grow by at most 4 on the way
/// there and back, origin and direction are wrong by up to 50 units of 2^-53 together, of which half the distance counts as start; 64 are allowed for.
const START_ERROR: f64 = 1.0 / (1u64 << 47) as f64;

/// Smallest unit of error that filters allow for.
pub const FINEST: f32 = 1.0 / (1 << 23) as f32;

/// How much larger the boxes of nodes are than what they hold, on every side. With u = 2^-24, this covers the rounding of a ray's origin, of up to 4 u, of a
/// box, of its growing, and what a ray that started anew is wrong by, of u each.
pub const OUTWARD: f32 = 1.0 / (1 << 21) as f32;

/// From here on a ray starts anew: no component of its place can come to within 1 of the centre sooner.
pub(super) const FAR: f64 = 4.0;

/// Most that a ray which started anew may be wrong by for its boxes to be believed.
const NEARLY: f32 = 1.0 / (1 << 24) as f32;

/// A ray in normalised coordinates, ready for conservative tests against f32 boxes.
///
/// Rounding is covered twice: boxes are larger by `OUTWARD` than what they hold, and reciprocals are shrunk for near bounds and grown for far bounds by 2^-21,
/// which covers the four roundings of a product. A ray from far away starts anew before the tree, so that its rounding is that of a near one. Parameters are
/// `ratio` times those of the original ray, less `start`.
///
/// Vectors have a fourth component, so that the processor's lanes can take them.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub struct BoxRay {
    pub(super) origin: [f32; 4],
    pub(super) inverse_near: [f32; 4],
    pub(super) inverse_far: [f32; 4],
    pub(super) direction: [f32; 4],
    /// Bit i is set where the direction is negative: the near bound is the upper one.
    pub(super) negative: u32,
    /// |origin|.
    size: f32,
    /// Bound on what a ray that started anew is wrong by.
    pub(super) error: f32,
    ratio: f64,
    pub(super) start: f64,
}

impl Normalisation {
    /// For things in a finite box.
    pub fn of(bounds: Bounds) -> Self {
        let center = bounds.min + (bounds.max - bounds.min) * 0.5;
        let half = max_abs(bounds.max - center).max(max_abs(bounds.min - center));
        Self::new(center, half)
    }

    fn new(center: DVec3, half: f64) -> Self {
        let scale = if half > f64::MIN_POSITIVE * 4.0 { power_of_two_below(1.0 / half) } else { 1.0 };
        Self { center, scale, unscale: 1.0 / scale }
    }

    /// For things in a finite box of which some keep their own origin, which stands at this place: their f32 coordinates stay as exact as they are.
    pub fn scaling(origin: DVec3, bounds: Bounds) -> Self {
        Self::new(origin, max_abs(bounds.max - origin).max(max_abs(bounds.min - origin)))
    }

    /// Whether what has its own origin at this place keeps it.
    pub fn keeps(&self, origin: DVec3) -> bool {
        self.center == origin
    }

    /// A point that is given from the centre, in normalised coordinates.
    #[inline(always)]
    pub fn scaled(&self, p: DVec3) -> DVec3 {
        p * self.scale
    }

    /// A point in normalised coordinates.
    #[inline(always)]
    pub fn point(&self, p: DVec3) -> DVec3 {
        (p - self.center) * self.scale
    }

    /// A length in normalised coordinates.
    #[inline(always)]
    pub fn length(&self, length: f64) -> f64 {
        length * self.scale
    }

    /// The length that is this one in normalised coordinates.
    #[inline(always)]
    pub fn unscaled<T: std::ops::Mul<f64, Output = T>>(&self, length: T) -> T {
        length * self.unscale
    }

    /// The box that is this one in normalised coordinates.
    pub fn unscaled_box(&self, bounds: Box3) -> Bounds {
        let corner = |p: Vec3| self.unscaled(p.as_dvec3()) + self.center;
        Bounds { min: corner(bounds.min), max: corner(bounds.max) }
    }

    /// A ray in normalised coordinates. `direction` has any length but 0.
    #[inline(always)]
    pub fn ray<const UNIT_LENGTH: bool>(&self, origin: DVec3, direction: DVec3) -> BoxRay {
        let (size, unit) = if UNIT_LENGTH { (1.0, 1.0) } else { powers_of_two(max_abs(direction)) };
        let mut p = four(self.point(origin));
        let d = four(direction * unit);
        let distance = largest(p.map(f64::abs));
        let mut start = 0.0;
        if distance > FAR {
            start = (distance - 2.0) / largest(d.map(f64::abs));
            p = std::array::from_fn(|i| p[i] + d[i] * start);
        }
        let (origin, direction) = (p.map(|x| x as f32), d.map(|x| x as f32));
        let error = (start * START_ERROR) as f32;
        let raised = direction.map(|x| if x.abs() > SMALLEST { x.abs() } else { SMALLEST });
        let inverse: [f32; 4] = std::array::from_fn(|i| (1.0 / raised[i]).copysign(direction[i]));
        let (shrunk, grown) = slack(error);
        let [x, y, z, _] = direction.map(|x| x.to_bits() >> 31);
        BoxRay {
            origin,
            inverse_near: inverse.map(|x| x * shrunk),
            inverse_far: inverse.map(|x| x * grown),
            direction,
            negative: x | y << 1 | z << 2,
            size: largest(origin.map(f32::abs)),
            error,
            ratio: self.scale * size,
            start,
        }
    }
}

/// With a fourth component that is 0.
#[inline(always)]
fn four(v: DVec3) -> [f64; 4] {
    [v.x, v.y, v.z, 0.0]
}

/// The largest component, or any if one is no number.
#[inline(always)]
pub(super) fn largest<T: PartialOrd + Copy>([x, y, z, _]: [T; 4]) -> T {
    let greater = |a: T, b: T| if a > b { a } else { b };
    greater(greater(x, y), z)
}

/// Components of a direction below this are raised to it: over the distances that matter the change stays far below `OUTWARD`.
pub(super) const SMALLEST: f32 = 1.0 / (1u64 << 60) as f32;

/// Factors for reciprocals at near and at far bounds.
pub(super) const SHRUNK_AND_GROWN: (f32, f32) = (1.0 - 1.0 / (1 << 21) as f32, 1.0 + 1.0 / (1 << 21) as f32);

/// The same for a ray that may have started anew.
#[inline(always)]
fn slack(error: f32) -> (f32, f32) {
    // From so far away that boxes cannot tell what it meets, it enters and leaves all of them at once.
    if error > NEARLY { (0.0, 0.0) } else { SHRUNK_AND_GROWN }
}

impl BoxRay {
    /// Whether it may meet anything. A ray from where numbers end has none, and every comparison would let it into boxes that are not there. One that started
    /// anew has come to within `FAR` of the centre, if it is to meet anything: where its largest component gets into the tree, so do the
    /// others, not more than 3 later.
    #[inline(always)]
    pub fn is_sound(&self) -> bool {
        let [x, y, z, _] = self.direction;
        (self.magnitude(FINEST) + x + y + z + self.origin.iter().sum::<f32>() * 0.0).is_finite()
            & ((self.size <= 1.125 * FAR as f32) | (self.error > NEARLY))
    }

    /// 1 + |origin|, and as much as covers the ray's own error for a filter that allows for errors of this times `unit`.
    #[inline(always)]
    pub fn magnitude(&self, unit: f32) -> f32 {
        1.0 + self.size + self.error * (1.0 / unit)
    }

    /// A parameter of the original ray as a limit for boxes, rounded up.
    #[inline(always)]
    pub fn limit(&self, t: f64) -> f32 {
        Self::limit_of(t, self.ratio, self.start, self.error)
    }

    /// The same of a ray of which only this is known.
    #[inline(always)]
    pub(super) fn limit_of(t: f64, ratio: f64, start: f64, error: f32) -> f32 {
        (t * ratio - start) as f32 * (1.0 + 1.0 / (1 << 20) as f32) + error
    }
}

/// The largest power of two that is not above a positive number, or as near as numbers go whose reciprocal is normal, and that reciprocal.
#[inline(always)]
pub fn powers_of_two(x: f64) -> (f64, f64) {
    let exponent = (x.to_bits() & 0x7ff0_0000_0000_0000).clamp(1 << 52, 2045 << 52);
    (f64::from_bits(exponent), f64::from_bits(0x7fe0_0000_0000_0000 - exponent))
}

/// The largest power of two that is not above a positive normal number.
#[inline(always)]
pub(super) fn power_of_two_below(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & 0x7ff0_0000_0000_0000)
}
