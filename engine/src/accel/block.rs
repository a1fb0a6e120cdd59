//! Rays in blocks, made ready for a tree.

use super::{
    frame::{BoxRay, Normalisation},
    interleave::WALKERS,
    pack::PackRay,
    told::Told,
};
use crate::shape::Ray;

/// Most rays in a block: so many that few walk alone at its end, and so few that they stay close to the processor.
pub const SIZE: usize = 64;

/// Rays of a block are numbered in bytes.
const _: () = assert!(SIZE <= 256 && SIZE.is_multiple_of(8));

/// Unlike the bits of any three axes: such a ray goes the way of no other.
const UNSOUND: u32 = 8;

/// Rays in a tree's normalised coordinates.
pub struct Block {
    count: usize,
    /// For boxes.
    pub rays: [BoxRay; SIZE],
    /// For packs of triangles.
    pub filters: [PackRay; SIZE],
    /// Where boxes stop to matter, by groups of eight; below 0 for a ray that is done.
    pub limit: [[f32; 8]; SIZE / 8],
    /// The same for hits, as parameters of the original rays.
    pub limits: [f64; SIZE],
    /// What each ray under way was told of, by its place among these.
    pub told: [Told; WALKERS],
}

impl Block {
    /// Room for rays; to be used for many blocks, as making room takes as long as a ray.
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            count: 0,
            rays: [BoxRay::default(); SIZE],
            filters: [PackRay::default(); SIZE],
            limit: [[-1.0; 8]; SIZE / 8],
            limits: [0.0; SIZE],
            told: Default::default(),
        }
    }

    /// Prepares rays of unit direction, at most `SIZE`, which have as many limits.
    #[inline(always)]
    pub fn fill(&mut self, frame: &Normalisation, rays: &[Ray], limits: &[f64]) {
        self.count = rays.len().min(limits.len()).min(SIZE);
        for (number, (ray, limit)) in rays.iter().zip(limits).take(SIZE).enumerate() {
            let mut boxed = frame.ray::<true>(ray.origin, ray.direction);
            let is_sound = boxed.is_sound();
            boxed.negative = if is_sound { boxed.negative } else { UNSOUND };
            self.limits[number] = *limit;
            // One that is done stays so, however small the tree's unit is.
            self.limit[number / 8][number % 8] = if is_sound && *limit >= 0.0 { boxed.limit(*limit) } else { -1.0 };
            self.filters[number] = PackRay::new(&boxed);
            self.rays[number] = boxed;
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

    /// Where boxes stop to matter for a ray.
    ///
    /// # Safety
    /// The ray is below `SIZE`.
    #[inline(always)]
    pub unsafe fn limit_of(&self, ray: usize) -> f32 {
        // SAFETY: by this function's own condition.
        unsafe { *self.limit.as_flattened().get_unchecked(ray) }
    }

    /// Sets a parameter of the original ray as its limit; below 0, the ray is done.
    #[inline(always)]
    pub fn set_limit(&mut self, ray: usize, t: f64) {
        self.limits[ray] = t;
        self.limit[ray / 8][ray % 8] = if t < 0.0 { -1.0 } else { self.rays[ray].limit(t) };
    }
}
