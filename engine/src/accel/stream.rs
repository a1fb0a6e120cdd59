//! Many rays against one mesh.

use super::{
    block::{self, Block},
    frame::Normalisation,
    mesh::{MeshHit, MeshTree},
    node::Node,
    pack::Pack,
    pending::{Left, Nearest, Unordered},
    simd::Lanes,
};
use crate::shape::{Ray, triangle::TriangleHit};

/// A block of rays on their way through a mesh.
pub struct Stream<'m, V> {
    pub(super) nodes: &'m [Node],
    pub(super) packs: &'m [Pack],
    pub(super) root: u32,
    pub(super) block: &'m mut Block,
    is_split: bool,
    frame: &'m Normalisation,
    rays: &'m mut [Ray],
    visit: V,
}

impl MeshTree {
    /// Calls `visit` with the number of a ray and hits in `0 < t <= limit`, of either side, in no particular order; it returns the limit for what follows, or less
    /// than 0 for a ray that is done. A hit nearer than every limit is never left out. No triangle is hit twice by a ray if `ANY`. At most [`block::SIZE`] rays, in the
    /// mesh's coordinates; their `t_max` is the first limit, and is changed. The block is room that may be used again.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn stream<L: Lanes, const ANY: bool>(&self, block: &mut Block, rays: &mut [Ray], visit: impl FnMut(usize, MeshHit) -> f64) {
        let frame = self.tree.frame();
        block.fill(frame, rays);
        let count = block.len();
        let (nodes, root) = self.tree.parts();
        let mut stream = Stream { nodes, packs: &self.packs, root, block, is_split: self.is_split, frame, rays, visit };
        // SAFETY: the caller has the instructions of `L`.
        unsafe { if ANY { stream.lead::<L, Unordered, ANY>(count) } else { stream.lead::<L, Nearest<L::Keys>, ANY>(count) } }
    }
}

impl<V: FnMut(usize, MeshHit) -> f64> Stream<'_, V> {
    /// Leads all rays through the mesh: side by side those that go the same way, in turns the others.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn lead<L: Lanes, R: Left<L>, const ANY: bool>(&mut self, count: usize) {
        let (mut single, mut singles) = ([0; block::SIZE], 0);
        for group in 0..count.div_ceil(8) {
            let numbers = group * 8..count.min(group * 8 + 8);
            // SAFETY: by this function's own condition.
            if numbers.len() == 8 && unsafe { self.go_together::<L, R, ANY>(group) } {
                continue;
            }
            for number in numbers.filter(|number| self.block.is_under_way(*number)) {
                single[singles] = number as u8;
                singles += 1;
            }
        }
        // SAFETY: by this function's own condition.
        unsafe { self.interleave::<L, R, ANY>(&single[..singles]) };
    }

    /// Lets a ray meet the triangles of a pack. `place` is that of what it was told.
    ///
    /// # Safety
    /// The pack is one of the mesh's, the ray one of the block's, the place below `WALKERS`. The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn visit<L: Lanes, const ANY: bool>(&mut self, pack: u32, number: usize, place: usize) {
        // SAFETY: by this function's own condition.
        unsafe {
            let pack = self.packs.get_unchecked(pack as usize);
            let mut candidates = pack.candidates::<L>(self.block.filters.get_unchecked(number));
            while candidates != 0 {
                let slot = candidates.trailing_zeros() as usize;
                candidates &= candidates - 1;
                let ray = self.rays.get_unchecked_mut(number);
                let Some(at) = pack.hit_by(slot, self.frame.point(ray.origin), ray.direction) else { continue };
                let at = TriangleHit { t: self.frame.unscaled(at.t), ..at };
                if at.t > ray.t_max || (ANY && self.is_split && !self.block.told.get_unchecked_mut(place).is_new(pack.id(slot))) {
                    continue;
                }
                ray.t_max = (self.visit)(number, MeshHit { triangle: pack.id(slot), at });
                self.block.set_limit(number, ray.t_max);
            }
        }
    }
}
