//! Many rays through one tree.

use super::{
    block::{self, Block},
    entry::Entry,
    frame::Normalisation,
    node::Node,
    pack::Pack,
    pending::{Left, Nearest, Unordered},
    simd::Lanes,
    tree::{OTHER, Tree},
    visitor::{MeshHit, Visitor},
};
use crate::shape::{Ray, triangle::TriangleHit};

/// A block of rays on their way through a tree.
pub struct Stream<'t, V> {
    pub(super) nodes: &'t [Node],
    pub(super) packs: &'t [Pack],
    pub(super) root: u32,
    pub(super) block: &'t mut Block,
    is_split: bool,
    frame: &'t Normalisation,
    rays: &'t [Ray],
    visitor: V,
}

impl Tree {
    /// [`Tree::walk`] for at most [`block::SIZE`] rays, each up to its own limit. The block is room that may be used again.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn stream<L: Lanes, const ANY: bool>(&self, block: &mut Block, rays: &[Ray], limits: &[f64], visitor: impl Visitor) {
        let frame = self.frame();
        block.fill(frame, rays, limits);
        let count = block.len();
        let Self { nodes, packs, root, is_split, .. } = self;
        let mut stream = Stream { nodes, packs, root: *root, block, is_split: *is_split, frame, rays, visitor };
        // SAFETY: the caller has the instructions of `L`.
        unsafe { if ANY { stream.lead::<L, Unordered, ANY>(count) } else { stream.lead::<L, Nearest<L::Keys>, ANY>(count) } }
    }
}

impl<V: Visitor> Stream<'_, V> {
    /// Leads all rays through the tree: side by side those that go the same way, in turns the others.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn lead<L: Lanes, R: Left<L>, const ANY: bool>(&mut self, count: usize) {
        // Rays that look for the nearest hit hardly ever end nearby.
        // SAFETY: by this function's own condition, as below.
        let entry = if ANY { unsafe { Entry::of::<L>(self.nodes, self.root, self.block) } } else { None };
        let (mut singles, mut count_of_singles) = ([0; block::SIZE], 0);
        for group in 0..count.div_ceil(8) {
            let numbers = group * 8..count.min(group * 8 + 8);
            // SAFETY: see above.
            if numbers.len() == 8 && unsafe { self.go_together::<L, R, ANY>(group, entry.as_ref()) } {
                continue;
            }
            for number in numbers.filter(|number| self.block.is_under_way(*number)) {
                singles[count_of_singles] = number as u8;
                count_of_singles += 1;
            }
        }
        let singles = &mut singles[..count_of_singles];
        match entry {
            // SAFETY: see above.
            Some(entry) => unsafe {
                let (entered, singles) = entry.enter::<L, R>(self.block, singles);
                self.interleave::<L, R, ANY>(singles, Some(&entered));
            },
            // SAFETY: see above.
            None => unsafe { self.interleave::<L, R, ANY>(singles, None) },
        }
    }

    /// Lets a ray meet what is in a leaf. `place` is that of what it was told.
    ///
    /// # Safety
    /// The reference is a leaf's of the tree, the ray one of the block's, the place below `WALKERS`. The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn visit<L: Lanes, const ANY: bool>(&mut self, reference: u32, number: usize, place: usize) {
        // SAFETY: by this function's own condition.
        unsafe {
            if reference & OTHER != 0 {
                let limit = self.visitor.other(number, reference & !OTHER);
                self.block.set_limit(number, limit);
                return;
            }
            let pack = self.packs.get_unchecked(reference as usize);
            let mut candidates = pack.candidates::<L>(self.block.filters.get_unchecked(number));
            while candidates != 0 {
                let slot = candidates.trailing_zeros() as usize;
                candidates &= candidates - 1;
                let (instance, triangle) = pack.id(slot);
                let at = if pack.is_exact() {
                    let ray = self.rays.get_unchecked(number);
                    let at = pack.hit(slot, self.frame.point(ray.origin), ray.direction);
                    at.map(|at| TriangleHit { t: self.frame.unscaled(at.t), ..at })
                } else {
                    self.visitor.exact(number, instance, triangle)
                };
                let Some(at) = at else { continue };
                if at.t > *self.block.limits.get_unchecked(number)
                    || (ANY && self.is_split && !self.block.told.get_unchecked_mut(place).is_new(instance, triangle))
                {
                    continue;
                }
                let limit = self.visitor.triangle(number, MeshHit { instance, triangle, at });
                self.block.set_limit(number, limit);
            }
        }
    }
}
