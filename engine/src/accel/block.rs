//! Rays in blocks: made ready for a tree eight at a time, in the processor's lanes.

use super::{
    frame::{self, FINEST, Normalisation, SMALLEST},
    interleave::WALKERS,
    mesh::Told,
    pack::PackRay,
};
use crate::shape::{
    Ray,
    triangle::{AXES, last_axis},
};

/// Most rays in a block: so many that few walk alone at its end, and so few that they stay close to the processor.
pub const SIZE: usize = 64;

/// Rays of a block are numbered in bytes.
const _: () = assert!(SIZE <= 256 && SIZE.is_multiple_of(8));

/// Unlike the bits of any three axes: such a ray goes the way of no other.
const UNSOUND: u8 = 8;

/// A value for each of eight rays.
pub type Eight = [f32; 8];

/// A value for each ray of a block.
pub type Each = [Eight; SIZE / 8];

/// Rays in a tree's normalised coordinates, by component: see [`super::frame::BoxRay`] for what these are.
pub struct Block {
    count: usize,
    /// By axis.
    pub origin: [Each; 3],
    /// By axis.
    pub direction: [Each; 3],
    /// By axis.
    pub inverse_near: [Each; 3],
    /// By axis.
    pub inverse_far: [Each; 3],
    /// Where boxes stop to matter; below 0 for a ray that is done.
    pub limit: Each,
    /// A bit for each axis along which the direction is negative; `UNSOUND` for a ray that is none.
    pub negative: [u8; SIZE],
    /// For packs of triangles.
    pub filters: [PackRay; SIZE],
    ratio: [f64; SIZE],
    start: [f64; SIZE],
    /// What each ray under way was told of, by its place among these.
    pub told: [Told; WALKERS],
}

impl Block {
    /// Room for rays; to be used for many blocks, as making room takes as long as a ray.
    #[inline(always)]
    pub fn new() -> Self {
        let none = [[0.0; 8]; SIZE / 8];
        Self {
            count: 0,
            origin: [none; 3],
            direction: [none; 3],
            inverse_near: [none; 3],
            inverse_far: [none; 3],
            limit: none,
            negative: [0; SIZE],
            filters: [PackRay::default(); SIZE],
            ratio: [0.0; SIZE],
            start: [0.0; SIZE],
            told: Default::default(),
        }
    }

    /// Prepares rays, at most `SIZE`, whose directions are of any length but 0.
    #[inline(always)]
    pub fn fill(&mut self, frame: &Normalisation, rays: &[Ray]) {
        self.count = rays.len().min(SIZE);
        for (group, rays) in rays.chunks(8).take(SIZE / 8).enumerate() {
            self.prepare(frame, group, rays);
        }
    }

    /// Prepares up to eight rays: the arithmetic of [`Normalisation::ray`] and [`crate::shape::triangle::Sheared::new`], each step for all of them, so that lanes can take it.
    #[inline(always)]
    fn prepare(&mut self, frame: &Normalisation, group: usize, rays: &[Ray]) {
        let first = group * 8;
        let (mut p, mut d) = ([[0.0f64; 8]; 3], [[1.0f64; 8]; 3]);
        for (k, ray) in rays.iter().take(8).enumerate() {
            let (origin, direction) = (frame.point(ray.origin).to_array(), ray.direction.to_array());
            for axis in 0..3 {
                p[axis][k] = origin[axis];
                d[axis][k] = direction[axis];
            }
        }
        let (mut shear, mut axes) = ([[0.0; 2]; 8], [0; 8]);
        for k in 0..8 {
            let [x, y, z] = [d[0][k], d[1][k], d[2][k]];
            let last = last_axis([x.abs(), y.abs(), z.abs()]);
            let (a, b, c) = if last == 0 {
                (y, z, x)
            } else if last == 1 {
                (z, x, y)
            } else {
                (x, y, z)
            };
            let scale = 1.0 / c;
            shear[k] = [(a * scale) as f32, (b * scale) as f32];
            axes[k] = last;
        }
        for k in 0..8 {
            let largest = greater(greater(d[0][k].abs(), d[1][k].abs()), d[2][k].abs());
            let (size, unit) = frame::powers_of_two(largest);
            let distance = greater(greater(p[0][k].abs(), p[1][k].abs()), p[2][k].abs());
            let start = frame::new_start(distance, largest * unit);
            self.ratio[first + k] = frame.scale() * size;
            self.start[first + k] = start;
            for axis in 0..3 {
                d[axis][k] *= unit;
                p[axis][k] += d[axis][k] * start;
            }
        }
        let mut negative = [0u8; 8];
        let (mut sizes, mut sums, mut errors) = ([0f32; 8], [0f32; 8], [0f32; 8]);
        for (error, start) in errors.iter_mut().zip(&self.start[first..]) {
            *error = frame::error_of(*start);
        }
        for axis in 0..3 {
            for k in 0..8 {
                let (origin, direction) = (p[axis][k] as f32, d[axis][k] as f32);
                let size = direction.abs();
                let inverse = (1.0 / if size > SMALLEST { size } else { SMALLEST }).copysign(direction);
                let (shrunk, grown) = frame::slack(errors[k]);
                self.origin[axis][group][k] = origin;
                self.direction[axis][group][k] = direction;
                self.inverse_near[axis][group][k] = inverse * shrunk;
                self.inverse_far[axis][group][k] = inverse * grown;
                negative[k] |= u8::from(direction.is_sign_negative()) << axis;
                sizes[k] = if origin.abs() > sizes[k] { origin.abs() } else { sizes[k] };
                sums[k] += direction + origin * 0.0;
            }
        }
        self.limit[group] = [-1.0; 8];
        for (k, ray) in rays.iter().take(8).enumerate() {
            let limit = frame::limit(ray.t_max, self.ratio[first + k], self.start[first + k]);
            let is_sound = frame::is_sound(sizes[k], errors[k], sums[k]);
            self.limit[group][k] = if is_sound { limit } else { -1.0 };
            let [x, y, z] = AXES[axes[k]];
            let origin = [self.origin[x][group][k], self.origin[y][group][k], self.origin[z][group][k]];
            let magnitude = frame::magnitude(sizes[k], errors[k], FINEST);
            self.filters[first + k] = PackRay::of([x, y, z], origin, shear[k], magnitude, negative[k] >> z & 1 == 1);
            self.negative[first + k] = if is_sound { negative[k] } else { UNSOUND };
        }
    }

    /// Number of rays.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether a ray may meet anything.
    #[inline(always)]
    pub fn is_under_way(&self, ray: usize) -> bool {
        self.limit[ray / 8][ray % 8] >= 0.0
    }

    /// A ray's value in one of its arrays.
    ///
    /// # Safety
    /// The ray is below `SIZE`.
    #[inline(always)]
    pub unsafe fn of(each: &Each, ray: usize) -> f32 {
        // SAFETY: by this function's own condition.
        unsafe { *each.as_flattened().get_unchecked(ray) }
    }

    /// Sets a parameter of the original ray as its limit; below 0, the ray is done.
    #[inline(always)]
    pub fn set_limit(&mut self, ray: usize, t: f64) {
        self.limit[ray / 8][ray % 8] = if t < 0.0 { -1.0 } else { frame::limit(t, self.ratio[ray], self.start[ray]) };
    }
}

/// The greater one, or `b` where they cannot be compared.
#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{shape::Bounds, shape::triangle::Sheared};

    /// From near and far, along the axes and between them, of all lengths.
    #[test]
    fn a_ray_of_a_block_is_the_ray_by_itself() {
        let frame = Normalisation::of(Bounds { min: DVec3::new(-3.0, 0.5, 2.0), max: DVec3::new(5.0, 1.5, 11.0) });
        let sizes = [0.0, -0.0, 1.0, -1.0, 0.3, -1e-3, 1e-30, 1e30, 1e-300, 1e300, f64::NAN, f64::INFINITY];
        let value = |i: usize| sizes[(i * i + i / 7) % sizes.len()];
        let rays: Vec<Ray> = (0..SIZE - 3)
            .map(|i| {
                let direction = DVec3::new(value(i), value(i + 5), value(i + 11));
                let direction = if direction == DVec3::ZERO { DVec3::Y } else { direction };
                Ray { t_max: value(i + 3), ..Ray::new(DVec3::new(value(i + 1), value(i + 2), value(i + 17)), direction) }
            })
            .collect();
        let mut block = Block::new();
        block.limit = [[1.0; 8]; SIZE / 8];
        block.fill(&frame, &rays);
        for (i, ray) in rays.iter().enumerate() {
            let single = frame.ray::<false>(ray.origin, ray.direction);
            let sheared = Sheared::new(frame.point(ray.origin), ray.direction);
            let of = |each: &[Each; 3]| each.each_ref().map(|each| each[i / 8][i % 8].to_bits());
            let bits = |v: glam::Vec3A| v.to_array().map(f32::to_bits);
            if !single.is_sound() || !ray.origin.is_finite() {
                assert!(!block.is_under_way(i), "{ray:?}");
                continue;
            }
            assert_eq!(of(&block.origin), bits(single.origin), "{ray:?}");
            assert_eq!(of(&block.direction), bits(single.direction), "{ray:?}");
            assert_eq!(of(&block.inverse_near), bits(single.inverse_near), "{ray:?}");
            assert_eq!(of(&block.inverse_far), bits(single.inverse_far), "{ray:?}");
            assert_eq!(block.limit[i / 8][i % 8].to_bits(), single.limit(ray.t_max).to_bits(), "{ray:?}");
            assert_eq!(u32::from(block.negative[i]), single.negative, "{ray:?}");
            assert_eq!(block.filters[i], PackRay::new(&single, &sheared), "{ray:?}");
        }
        assert!((SIZE - 3..SIZE).all(|i| !block.is_under_way(i)));
    }
}
