//! Coordinates in which a tree's boxes fit f32 well, and rays in them.

use glam::{DVec3, Vec3, Vec3A};

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

/// Bound on the relative error, in f64, of moving a ray's start.
const START_ERROR: f64 = 1.0 / (1u64 << 48) as f64;

/// Smallest unit of error that filters allow for.
pub const FINEST: f32 = 1.0 / (1 << 23) as f32;

/// How much larger the boxes of nodes are than what they hold, on every side. With u = 2^-24, this covers the rounding of a ray's origin, of up to 4 u, of a
/// box, of its growing, and what a ray that started anew is wrong by, of u each.
pub const OUTWARD: f32 = 1.0 / (1 << 21) as f32;

/// From here on a ray starts anew.
const FAR: f64 = 4.0;

/// Most that a ray which started anew may be wrong by for its boxes to be believed.
const NEARLY: f32 = 1.0 / (1 << 24) as f32;

/// A ray in normalised coordinates, ready for conservative tests against f32 boxes.
///
/// Rounding is covered twice: boxes are larger by `OUTWARD` than what they hold, and reciprocals are shrunk for near bounds and grown for far bounds by 2^-21,
/// which covers the four roundings of a product. A ray from far away starts anew before the tree, so that its rounding is that of a near one. Parameters are
/// `ratio` times those of the original ray, less `start`.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay {
    pub(super) origin: Vec3A,
    pub(super) direction: Vec3A,
    pub(super) inverse_near: Vec3A,
    pub(super) inverse_far: Vec3A,
    /// Bit i is set where the direction is negative: the near bound is the upper one.
    pub(super) negative: u32,
    /// |origin|.
    size: f32,
    /// Bound on what a ray that started anew is wrong by.
    error: f32,
    ratio: f64,
    start: f64,
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

    /// For things in a finite box that keep their origin: f32 coordinates stay as exact as they are.
    pub fn scaling(bounds: Bounds) -> Self {
        Self::new(DVec3::ZERO, max_abs(bounds.max).max(max_abs(bounds.min)))
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

    /// The factor that [`Self::point`] and [`Self::length`] apply.
    #[inline(always)]
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// A ray in normalised coordinates. `direction` has any length but 0.
    #[inline(always)]
    pub fn ray<const UNIT_LENGTH: bool>(&self, origin: DVec3, direction: DVec3) -> BoxRay {
        let (size, unit) = if UNIT_LENGTH { (1.0, 1.0) } else { powers_of_two(max_abs(direction)) };
        let (p, d) = (self.point(origin), direction * unit);
        let distance = max_abs(p);
        let (p, start) = if distance > FAR {
            let start = new_start(distance, max_abs(d));
            (p + d * start, start)
        } else {
            (p, 0.0)
        };
        let (origin, direction) = (p.as_vec3a(), d.as_vec3a());
        let error = error_of(start);
        let inverse = (Vec3A::ONE / direction.abs().max(Vec3A::splat(SMALLEST))).copysign(direction);
        let (shrunk, grown) = slack(error);
        BoxRay {
            origin,
            direction,
            inverse_near: inverse * shrunk,
            inverse_far: inverse * grown,
            negative: direction.is_negative_bitmask(),
            size: origin.abs().max_element(),
            error,
            ratio: self.scale * size,
            start,
        }
    }
}

/// Components of a direction below this are raised to it: over the distances that matter the change stays far below `OUTWARD`.
pub const SMALLEST: f32 = 1.0 / (1u64 << 60) as f32;

/// Where a ray starts anew whose origin's largest component is `distance`, and its direction's `largest`: no component can come to within 1 of the
/// centre sooner than this. 0 for a ray that need not.
#[inline(always)]
pub fn new_start(distance: f64, largest: f64) -> f64 {
    if distance > FAR { (distance - 2.0) / largest } else { 0.0 }
}

/// Bound on what a ray is wrong by that started anew.
#[inline(always)]
pub fn error_of(start: f64) -> f32 {
    (start * START_ERROR) as f32
}

/// Factors for reciprocals at near and at far bounds.
#[inline(always)]
pub fn slack(error: f32) -> (f32, f32) {
    const SLACK: f32 = 1.0 / (1 << 21) as f32;
    // From so far away that boxes cannot tell what it meets, it enters and leaves all of them at once.
    if error > NEARLY { (0.0, 0.0) } else { (1.0 - SLACK, 1.0 + SLACK) }
}

/// See [`BoxRay::magnitude`].
#[inline(always)]
pub fn magnitude(size: f32, error: f32, unit: f32) -> f32 {
    1.0 + size + error * (1.0 / unit)
}

/// See [`BoxRay::is_sound`]; `direction` is the sum of its components.
#[inline(always)]
pub fn is_sound(size: f32, error: f32, direction: f32) -> bool {
    (magnitude(size, error, FINEST) + direction).is_finite() & ((size <= 1.125 * FAR as f32) | (error > NEARLY))
}

/// See [`BoxRay::limit`].
#[inline(always)]
pub fn limit(t: f64, ratio: f64, start: f64) -> f32 {
    (t * ratio - start) as f32 * (1.0 + 1.0 / (1 << 20) as f32) + error_of(start)
}

impl BoxRay {
    /// Whether it may meet anything. A ray from where numbers end has none, and every comparison would let it into boxes that are not there. One that started
    /// anew has come to within `FAR` of the centre, if it is to meet anything: where its largest component gets into the tree, so do the
    /// others, not more than 3 later.
    #[inline(always)]
    pub fn is_sound(&self) -> bool {
        is_sound(self.size, self.error, self.direction.element_sum())
    }

    /// 1 + |origin|, and as much as covers the ray's own error for a filter that allows for errors of this times `unit`.
    #[inline(always)]
    pub fn magnitude(&self, unit: f32) -> f32 {
        magnitude(self.size, self.error, unit)
    }

    /// A parameter of the original ray as a limit for boxes, rounded up.
    #[inline(always)]
    pub fn limit(&self, t: f64) -> f32 {
        limit(t, self.ratio, self.start)
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
