//! Rays in blocks, made ready for a tree.

use std::mem::offset_of;

use super::{
    frame::{BoxRay, FAR, Normalisation, SHRUNK_AND_GROWN, SMALLEST, largest},
    interleave::WALKERS,
    node::near_bounds,
    pack::{PackRay, last_axis},
    simd::Lanes,
    told::Told,
};
use crate::shape::Ray;

/// Most rays in a block: so many that few walk alone at its end, and so few that they stay close to the processor.
pub const SIZE: usize = 64;

/// Rays of a block are numbered in bytes.
const _: () = assert!(SIZE <= 256 && SIZE.is_multiple_of(8));

/// Unlike the bits of any three axes: such a ray goes the way of no other.
const UNSOUND: u32 = 8;

/// A value for each of eight rays.
pub type Eight = [f32; 8];

/// Rays in a tree's normalised coordinates.
pub struct Block {
    count: usize,
    /// All rays, in their order.
    pub groups: [Group; SIZE / 8],
    /// The same for packs of triangles.
    pub filters: [PackRay; SIZE],
    /// Where hits stop to matter, as parameters of the original rays.
    pub limits: [f64; SIZE],
    /// What each ray under way was told of, by its place among these.
    pub told: [Told; WALKERS],
    /// Parameters in the tree's coordinates are so many times those of the original rays.
    ratio: f64,
}

/// Eight rays that are made ready together, as [`BoxRay`] and [`PackRay`] are one by one.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Group {
    /// By axis, as the next three.
    pub origin: [Eight; 3],
    pub inverse_near: [Eight; 3],
    pub inverse_far: [Eight; 3],
    pub direction: [Eight; 3],
    /// Where boxes stop to matter; below 0 for a ray that is done.
    pub limit: Eight,
    /// See [`BoxRay`].
    pub negative: [u32; 8],
    error: Eight,
    start: [f64; 8],
    /// Whether all rays are sound and none started anew.
    pub is_plain: bool,
}

/// Where the numbers of a ray stand in [`Block::groups`], beside those of the first: in bytes, so that nothing is computed on the way.
#[derive(Clone, Copy, Default)]
pub struct Place(usize);

impl Place {
    /// Of a ray of this number.
    #[inline(always)]
    pub fn of(ray: usize) -> Self {
        Self(ray / 8 * size_of::<Group>() + ray % 8 * size_of::<f32>())
    }
}

impl Block {
    /// Room for rays; to be used for many blocks, as making room takes as long as a ray.
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            count: 0,
            groups: [Group::NONE; SIZE / 8],
            filters: [PackRay::NONE; SIZE],
            limits: [0.0; SIZE],
            told: Default::default(),
            ratio: 1.0,
        }
    }

    /// Prepares rays of unit direction, at most `SIZE`, which have as many limits.
    #[inline(always)]
    pub fn fill(&mut self, frame: &Normalisation, rays: &[Ray], limits: &[f64]) {
        self.count = rays.len().min(limits.len()).min(SIZE);
        self.ratio = frame.length(1.0);
        self.limits[..self.count].copy_from_slice(&limits[..self.count]);
        self.limits[self.count..self.count.next_multiple_of(8)].fill(-1.0);
        let full = rays[..self.count].as_chunks::<8>();
        let (groups, filters) = (&mut self.groups, self.filters.as_chunks_mut::<8>().0);
        for ((group, filters), rays) in groups.iter_mut().zip(&mut *filters).zip(full.0) {
            group.fill(filters, frame, rays);
        }
        if let [first, ..] = full.1 {
            let mut rays = [*first; 8];
            rays[..full.1.len()].copy_from_slice(full.1);
            groups[full.0.len()].fill(&mut filters[full.0.len()], frame, &rays);
        }
        for (group, limits) in self.groups.iter_mut().zip(self.limits.as_chunks::<8>().0).take(self.count.div_ceil(8)) {
            group.limit(self.ratio, limits);
        }
    }

    /// Number of rays.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Those of all rays.
    #[inline(always)]
    pub fn groups(&self) -> &[Group] {
        &self.groups[..self.count.div_ceil(8)]
    }

    /// Whether a ray may meet anything.
    #[inline(always)]
    pub fn is_under_way(&self, ray: usize) -> bool {
        self.groups[ray / 8].limit[ray % 8] >= 0.0
    }

    /// A number of a ray's: that of the first ray stands here in the first group.
    ///
    /// # Safety
    /// The place is that of a ray below `SIZE`.
    #[inline(always)]
    unsafe fn number(&self, first: usize, place: Place) -> f32 {
        // SAFETY: by this function's own condition, all within the groups.
        unsafe { *(&raw const self.groups).cast::<f32>().byte_add(first + place.0) }
    }

    /// Three numbers of a ray's, each in all lanes.
    ///
    /// # Safety
    /// The place is that of a ray below `SIZE`; those of the first ray stand from `first` on. The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn vector<L: Lanes>(&self, first: usize, place: Place) -> [L; 3] {
        const NEXT: usize = size_of::<Eight>();
        // SAFETY: by this function's own condition.
        unsafe {
            [
                L::splat(self.number(first, place)),
                L::splat(self.number(first + NEXT, place)),
                L::splat(self.number(first + 2 * NEXT, place)),
            ]
        }
    }

    /// Origin and inverse directions of a ray, near and far.
    ///
    /// # Safety
    /// The place is that of a ray below `SIZE`. The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn ray<L: Lanes>(&self, place: Place) -> [[L; 3]; 3] {
        // SAFETY: by this function's own condition.
        unsafe {
            [
                self.vector(offset_of!(Group, origin), place),
                self.vector(offset_of!(Group, inverse_near), place),
                self.vector(offset_of!(Group, inverse_far), place),
            ]
        }
    }

    /// Where boxes stop to matter for a ray.
    ///
    /// # Safety
    /// The place is that of a ray below `SIZE`.
    #[inline(always)]
    pub unsafe fn limit_of(&self, place: Place) -> f32 {
        // SAFETY: by this function's own condition.
        unsafe { self.number(offset_of!(Group, limit), place) }
    }

    /// See [`near_bounds`].
    #[inline(always)]
    pub fn near(&self, ray: usize) -> [usize; 3] {
        near_bounds(self.groups[ray / 8].negative[ray % 8])
    }

    /// Sets a parameter of the original ray as its limit; below 0, the ray is done.
    #[inline(always)]
    pub fn set_limit(&mut self, ray: usize, t: f64) {
        self.limits[ray] = t;
        let (group, lane) = (&mut self.groups[ray / 8], ray % 8);
        group.limit[lane] = if t < 0.0 { -1.0 } else { BoxRay::limit_of(t, self.ratio, group.start[lane], group.error[lane]) };
    }
}

impl Group {
    const NONE: Self = Self {
        origin: [[0.0; 8]; 3],
        inverse_near: [[0.0; 8]; 3],
        inverse_far: [[0.0; 8]; 3],
        direction: [[0.0; 8]; 3],
        limit: [-1.0; 8],
        negative: [UNSOUND; 8],
        error: [0.0; 8],
        start: [0.0; 8],
        is_plain: false,
    };

    /// Prepares eight rays of unit direction, but for their limits. Loops over lanes are what compilers turn into vectors.
    #[inline(always)]
    fn fill(&mut self, filters: &mut [PackRay; 8], frame: &Normalisation, rays: &[Ray; 8]) {
        for (lane, ray) in rays.iter().enumerate() {
            let (origin, direction) = (frame.point(ray.origin).as_vec3(), ray.direction.as_vec3());
            for axis in 0..3 {
                self.origin[axis][lane] = origin[axis];
                self.direction[axis][lane] = direction[axis];
            }
        }
        self.is_plain = self.are_plain();
        if self.is_plain {
            self.invert();
            self.prepare(filters);
        } else {
            self.fill_one_by_one(filters, frame, rays);
        }
    }

    /// Whether all rays are sound and none starts anew: see [`BoxRay`].
    #[inline(always)]
    fn are_plain(&self) -> bool {
        let ([px, py, pz], [dx, dy, dz]) = (&self.origin, &self.direction);
        (0..8).fold(true, |all, lane| {
            let is_near = |x: f32| x.abs() <= FAR as f32;
            // What is no number does not pass either.
            all & is_near(px[lane]) & is_near(py[lane]) & is_near(pz[lane]) & (dx[lane].abs() + dy[lane].abs() + dz[lane].abs() <= 2.0)
        })
    }

    /// Reciprocals of directions for near and far bounds, and their signs, of plain rays.
    #[inline(always)]
    fn invert(&mut self) {
        let (shrunk, grown) = SHRUNK_AND_GROWN;
        for axis in 0..3 {
            for lane in 0..8 {
                let along = self.direction[axis][lane];
                let raised = if along.abs() > SMALLEST { along.abs() } else { SMALLEST };
                let inverse = (1.0 / raised).copysign(along);
                self.inverse_near[axis][lane] = inverse * shrunk;
                self.inverse_far[axis][lane] = inverse * grown;
            }
        }
        let [x, y, z] = &self.direction;
        for lane in 0..8 {
            self.negative[lane] = x[lane].to_bits() >> 31 | (y[lane].to_bits() >> 31) << 1 | (z[lane].to_bits() >> 31) << 2;
            (self.error[lane], self.start[lane]) = (0.0, 0.0);
        }
    }

    /// What packs want to know of plain rays.
    #[inline(always)]
    fn prepare(&self, filters: &mut [PackRay; 8]) {
        let ([px, py, pz], [dx, dy, dz]) = (&self.origin, &self.direction);
        let (mut last, mut scale, mut magnitude) = ([0; 8], [0.0; 8], [0.0; 8]);
        for lane in 0..8 {
            let (x, y, z) = (dx[lane], dy[lane], dz[lane]);
            last[lane] = last_axis([x.abs(), y.abs(), z.abs(), 0.0]) as u32;
            let along = match last[lane] {
                0 => x,
                1 => y,
                _ => z,
            };
            scale[lane] = 1.0 / along;
            magnitude[lane] = 1.0 + largest([px[lane].abs(), py[lane].abs(), pz[lane].abs(), 0.0]);
        }
        for lane in 0..8 {
            let (origin, direction) = (|axis: usize| self.origin[axis][lane], |axis: usize| self.direction[axis][lane]);
            filters[lane] = PackRay::ready(last[lane] as usize, origin, direction, scale[lane], magnitude[lane]);
        }
    }

    /// For rays of which one comes from far away, or is no ray.
    #[cold]
    #[inline(never)]
    fn fill_one_by_one(&mut self, filters: &mut [PackRay; 8], frame: &Normalisation, rays: &[Ray; 8]) {
        for (lane, ray) in rays.iter().enumerate() {
            let boxed = frame.ray::<true>(ray.origin, ray.direction);
            for axis in 0..3 {
                self.origin[axis][lane] = boxed.origin[axis];
                self.inverse_near[axis][lane] = boxed.inverse_near[axis];
                self.inverse_far[axis][lane] = boxed.inverse_far[axis];
                self.direction[axis][lane] = boxed.direction[axis];
            }
            self.negative[lane] = if boxed.is_sound() { boxed.negative } else { UNSOUND };
            (self.error[lane], self.start[lane]) = (boxed.error, boxed.start);
            filters[lane] = PackRay::new(&boxed);
        }
    }

    /// Sets limits, given as parameters of the original rays.
    #[inline(always)]
    fn limit(&mut self, ratio: f64, limits: &[f64; 8]) {
        for (lane, t) in limits.iter().enumerate() {
            let limit = BoxRay::limit_of(*t, ratio, self.start[lane], self.error[lane]);
            // A ray that is done stays so, however small the tree's unit is.
            self.limit[lane] = if *t >= 0.0 && self.negative[lane] != UNSOUND { limit } else { -1.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{
        math::{cos, sin},
        shape::Bounds,
    };

    /// Blocks of plain rays, with one from far away or from where numbers end among them or not, full and not: each ray is as it is by itself.
    #[test]
    fn rays_are_made_ready_together_as_one_by_one() {
        let frame = Normalisation::of(Bounds::of([DVec3::new(-3.0, 1.0, 2.0), DVec3::new(5.0, 9.0, 2.5)]));
        let spread = |i: f64| DVec3::new(sin(i * 1.1), cos(i * 1.7), sin(i * 2.3 + 1.0));
        let axes = [DVec3::X, DVec3::NEG_Y, DVec3::Z, DVec3::new(0.6, 0.0, -0.8)];
        let strange = [DVec3::splat(1e9), DVec3::new(1e300, 0.0, 0.0), DVec3::new(0.0, f64::NAN, 0.0), DVec3::splat(f64::INFINITY)];
        let mut block = Block::new();
        for turn in 0..200 {
            let rays: Vec<Ray> = (0..1 + turn % SIZE)
                .map(|i| {
                    let (number, place) = ((turn * SIZE + i) as f64, spread(i as f64) * 8.0);
                    let direction = if i % 7 == 3 { axes[turn % 4] } else { spread(number + 0.5).normalize() };
                    Ray::new(if turn % 2 == 1 && i == turn % 16 { strange[turn / 2 % 4] } else { place }, direction)
                })
                .collect();
            let limits: Vec<f64> = (0..rays.len()).map(|i| [f64::INFINITY, 3.0, 0.0, -1.0, 1e-30][(i + turn) % 5]).collect();
            block.fill(&frame, &rays, &limits);
            assert_eq!(block.len(), rays.len());
            for (number, (ray, limit)) in rays.iter().zip(limits).enumerate() {
                let (alone, group, lane) = (frame.ray::<true>(ray.origin, ray.direction), &block.groups[number / 8], number % 8);
                assert_eq!(block.is_under_way(number), alone.is_sound() && limit >= 0.0 && alone.limit(limit) >= 0.0, "{ray:?}");
                if !alone.is_sound() {
                    assert_eq!(group.negative[lane], UNSOUND, "{ray:?}");
                    continue;
                }
                let of = |eights: &[Eight; 3]| eights.each_ref().map(|eight| eight[lane].to_bits());
                let bits = |[x, y, z, _]: [f32; 4]| [x, y, z].map(f32::to_bits);
                assert_eq!(of(&group.origin), bits(alone.origin), "{ray:?}");
                assert_eq!(of(&group.direction), bits(alone.direction), "{ray:?}");
                assert_eq!(of(&group.inverse_near), bits(alone.inverse_near), "{ray:?}");
                assert_eq!(of(&group.inverse_far), bits(alone.inverse_far), "{ray:?}");
                assert_eq!(group.negative[lane], alone.negative, "{ray:?}");
                assert_eq!(block.filters[number], PackRay::new(&alone), "{ray:?}");
                if limit >= 0.0 {
                    assert_eq!(group.limit[lane].to_bits(), alone.limit(limit).to_bits(), "{ray:?}");
                }
            }
        }
    }
}
