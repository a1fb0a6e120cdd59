//! Eight rays that go the same way through one tree, side by side: they visit a node together if any of them might meet it (the interval test of Boulos, Wald,
//! Shirley, "Geometric and Arithmetic Culling Methods for Entire Ray Packets", 2006), and each child's box is then met by each of them.

use super::{
    block::{Block, Each, Eight},
    interleave::WALKERS,
    mesh::MeshHit,
    node::{LEAF, Node, far_bound, near_bounds},
    pending::{Left, Pending},
    simd::Lanes,
    stream::Stream,
};

/// Most that directions may differ, in a component, in proportion to the largest; and origins, in halves of the tree's size: rays farther apart have little in common.
const WIDEST: f32 = 1.0 / 24.0;

/// Each ray of a packet has a place among those under way.
const _: () = assert!(WALKERS >= 8);

/// Eight rays of a block.
struct Packet {
    group: usize,
    near: [usize; 3],
    /// By axis, what makes every distance to a near bound least: an origin and an inverse direction.
    near_ray: [[f32; 3]; 2],
    /// And what makes every distance to a far bound greatest.
    far_ray: [[f32; 3]; 2],
}

impl Packet {
    /// `None` where the rays' directions have different signs, or go far apart, or boxes cannot tell what one of them meets.
    #[inline(always)]
    fn of(block: &Block, group: usize) -> Option<Self> {
        let negative = block.negative[group * 8];
        if block.negative[group * 8..group * 8 + 8].iter().any(|other| *other != negative) {
            return None;
        }
        let mut packet = Self { group, near: near_bounds(negative.into()), near_ray: [[0.0; 3]; 2], far_ray: [[0.0; 3]; 2] };
        for axis in 0..3 {
            let is_negative = negative >> axis & 1 == 1;
            let far_first = |(low, high): (f32, f32)| if is_negative { (low, high) } else { (high, low) };
            let (low, high) = range(&block.origin[axis][group]);
            let (least, greatest) = range(&block.direction[axis][group]);
            // What is no number is not narrow either.
            let is_narrow = high - low <= WIDEST && greatest - least <= WIDEST;
            if !is_narrow {
                return None;
            }
            (packet.near_ray[0][axis], packet.far_ray[0][axis]) = far_first((low, high));
            packet.near_ray[1][axis] = far_first(range(&block.inverse_near[axis][group])).1;
            packet.far_ray[1][axis] = far_first(range(&block.inverse_far[axis][group])).0;
            // A ray that enters and leaves all boxes at once has nothing in common with one that does not.
            if packet.near_ray[1][axis] == 0.0 {
                return None;
            }
        }
        Some(packet)
    }

    /// Bit i is set where ray i meets the box of a child.
    ///
    /// # Safety
    /// The child is one of the tree's. The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn meets<L: Lanes>(&self, block: &Block, node: &Node, place: usize) -> u32 {
        // SAFETY: by this function's own condition.
        unsafe {
            let of = |each: &Each| -> *const Eight { each.as_ptr().add(self.group) };
            let (mut enter, mut leave) = (L::splat(0.0), L::load(&*of(&block.limit)));
            for axis in 0..3 {
                let origin = L::load(&*of(&block.origin[axis]));
                let near = L::splat(node.bound(self.near[axis], place)).sub(origin);
                enter = enter.max(near.mul(L::load(&*of(&block.inverse_near[axis]))));
                let far = L::splat(node.bound(far_bound(self.near, axis), place)).sub(origin);
                leave = leave.min(far.mul(L::load(&*of(&block.inverse_far[axis]))));
            }
            enter.le(leave)
        }
    }
}

/// The least and the greatest.
#[inline(always)]
fn range(of: &Eight) -> (f32, f32) {
    let lesser = |a: f32, b: f32| if a < b { a } else { b };
    let greater = |a: f32, b: f32| if a > b { a } else { b };
    let [a, b, c, d, e, f, g, h] = *of;
    (
        lesser(lesser(lesser(a, e), lesser(b, f)), lesser(lesser(c, g), lesser(d, h))),
        greater(greater(greater(a, e), greater(b, f)), greater(greater(c, g), greater(d, h))),
    )
}

impl<V: FnMut(usize, MeshHit) -> f64> Stream<'_, V> {
    /// Leads a group of eight rays through the mesh side by side; whether they go the same way, and so it was done.
    ///
    /// # Safety
    /// The processor has the instructions of `L`. The group is one of the block, and full.
    #[inline(always)]
    pub unsafe fn go_together<L: Lanes, R: Left<L>, const ANY: bool>(&mut self, group: usize) -> bool {
        if self.root & LEAF != 0 {
            return false;
        }
        let Some(packet) = Packet::of(self.block, group) else { return false };
        if ANY {
            self.block.told.iter_mut().for_each(|told| told.clear());
        }
        let mut pending = Pending::<R>::new();
        let mut limit = range(&self.block.limit[group]).1;
        let mut current = self.root;
        // SAFETY: all are nodes and leaves of this tree, which is never deeper than `MAX_DEPTH`.
        unsafe {
            let [[ox, oy, oz], [ix, iy, iz]] = packet.near_ray;
            let near_ray = [[L::splat(ox), L::splat(oy), L::splat(oz)], [L::splat(ix), L::splat(iy), L::splat(iz)]];
            let [[ox, oy, oz], [ix, iy, iz]] = packet.far_ray;
            let far_ray = [[L::splat(ox), L::splat(oy), L::splat(oz)], [L::splat(ix), L::splat(iy), L::splat(iz)]];
            while limit >= 0.0 {
                let (enter, leave) = self.nodes.get_unchecked(current as usize).meet(packet.near, near_ray, far_ray, L::splat(limit));
                let met = R::of(enter, leave);
                pending.push(current, met, !met.is_empty());
                loop {
                    let Some(child) = pending.pop::<L>(limit) else { return true };
                    let node = self.nodes.get_unchecked(child.node as usize);
                    let mut met = packet.meets::<L>(self.block, node, child.place);
                    if met == 0 {
                        continue;
                    }
                    let reference = child.reference(self.nodes);
                    if reference & LEAF == 0 {
                        current = reference;
                        break;
                    }
                    while met != 0 {
                        let lane = met.trailing_zeros() as usize;
                        met &= met - 1;
                        self.visit::<L, ANY>(reference & !LEAF, group * 8 + lane, lane);
                    }
                    limit = range(self.block.limit.get_unchecked(group)).1;
                    if limit < 0.0 {
                        return true;
                    }
                }
            }
        }
        true
    }
}
