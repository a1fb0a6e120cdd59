//! Eight rays that go the same way through one tree, side by side: they visit a node together if any of them might meet it (the interval test of Boulos, Wald,
//! Shirley, "Geometric and Arithmetic Culling Methods for Entire Ray Packets", 2006), and each child's box is then met by each of them.

use super::{
    block::{Eight, Group},
    entry::Entry,
    interleave::WALKERS,
    node::{LEAF, Node, far_bound, near_bounds},
    pending::{Left, Pending},
    simd::Lanes,
    stream::Stream,
    visitor::Visitor,
};

/// Most that directions may differ, in a component, in proportion to the largest; and origins, in halves of the tree's size: rays farther apart have little in common.
const WIDEST: f32 = 1.0 / 24.0;

/// Each ray of a packet has a place among those under way.
const _: () = assert!(WALKERS >= 8);

/// What eight rays of a block that go the same way have in common.
struct Packet {
    near: [usize; 3],
    /// What makes every distance to a near bound least: an origin and an inverse direction.
    near_ray: [[f32; 3]; 2],
    /// And what makes every distance to a far bound greatest.
    far_ray: [[f32; 3]; 2],
}

impl Packet {
    /// `None` where the rays' directions have different signs, or go far apart, or boxes cannot tell what one of them meets.
    #[inline(always)]
    fn of(rays: &Group) -> Option<Self> {
        let negative = rays.negative[0];
        if rays.negative.iter().any(|other| *other != negative) {
            return None;
        }
        let mut packet = Self { near: near_bounds(negative), near_ray: [[0.0; 3]; 2], far_ray: [[0.0; 3]; 2] };
        for axis in 0..3 {
            let ((low, high), (least, greatest)) = (range(&rays.origin[axis]), range(&rays.direction[axis]));
            // What is no number is not narrow either.
            let is_narrow = high - low <= WIDEST && greatest - least <= WIDEST;
            if !is_narrow {
                return None;
            }
            let (near, far) = (range(&rays.inverse_near[axis]), range(&rays.inverse_far[axis]));
            let is_negative = negative >> axis & 1 == 1;
            (packet.near_ray[0][axis], packet.far_ray[0][axis]) = if is_negative { (low, high) } else { (high, low) };
            (packet.near_ray[1][axis], packet.far_ray[1][axis]) = if is_negative { (near.1, far.0) } else { (near.0, far.1) };
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
    unsafe fn meets<L: Lanes>(&self, rays: &Group, node: &Node, place: usize) -> u32 {
        // SAFETY: by this function's own condition.
        unsafe {
            let (mut enter, mut leave) = (L::splat(0.0), L::load(&rays.limit));
            for axis in 0..3 {
                let origin = L::load(&rays.origin[axis]);
                let near = L::splat(node.bound(self.near[axis], place)).sub(origin);
                enter = enter.max(near.mul(L::load(&rays.inverse_near[axis])));
                let far = L::splat(node.bound(far_bound(self.near, axis), place)).sub(origin);
                leave = leave.min(far.mul(L::load(&rays.inverse_far[axis])));
            }
            enter.le(leave)
        }
    }
}

/// The least and the greatest.
#[inline(always)]
pub(super) fn range(of: &Eight) -> (f32, f32) {
    let (less, greater) = (|a: f32, b: f32| if a < b { a } else { b }, |a: f32, b: f32| if a > b { a } else { b });
    let [a, b, c, d, e, f, g, h] = *of;
    (
        less(less(less(a, e), less(b, f)), less(less(c, g), less(d, h))),
        greater(greater(greater(a, e), greater(b, f)), greater(greater(c, g), greater(d, h))),
    )
}

impl<V: Visitor> Stream<'_, V> {
    /// Leads a group of eight rays through the tree side by side; whether they go the same way, and so it was done.
    ///
    /// # Safety
    /// The processor has the instructions of `L`. The group is one of the block, and full.
    #[inline(always)]
    pub unsafe fn go_together<L: Lanes, R: Left<L>, const ANY: bool>(&mut self, group: usize, entry: Option<&Entry>) -> bool {
        if self.root & LEAF != 0 {
            return false;
        }
        let Some(packet) = self.block.groups.get(group).and_then(Packet::of) else { return false };
        if ANY {
            // Those of its own eight.
            self.block.told.iter_mut().take(8).for_each(|told| told.clear());
        }
        let mut pending = Pending::<R>::new();
        let mut limit = range(&self.block.groups[group].limit).1;
        let mut current: *const Node = entry.map_or(&self.nodes[self.root as usize], |entry| &entry.0);
        // SAFETY: all are nodes and leaves of this tree, which is never deeper than `MAX_DEPTH`.
        unsafe {
            let near_ray = [L::splats(&packet.near_ray[0]), L::splats(&packet.near_ray[1])];
            let far_ray = [L::splats(&packet.far_ray[0]), L::splats(&packet.far_ray[1])];
            while limit >= 0.0 {
                let (enter, leave) = (*current).meet(packet.near, near_ray, far_ray, L::splat(limit));
                let met = R::of(enter, leave);
                pending.push(current, met, !met.is_empty());
                loop {
                    let Some(child) = pending.pop::<L>(limit) else { return true };
                    let node = &*child.node;
                    let mut met = packet.meets::<L>(self.block.groups.get_unchecked(group), node, child.place);
                    if met == 0 {
                        continue;
                    }
                    let reference = child.reference();
                    if reference & LEAF == 0 {
                        current = self.nodes.get_unchecked(reference as usize);
                        break;
                    }
                    while met != 0 {
                        let lane = met.trailing_zeros() as usize;
                        met &= met - 1;
                        self.visit::<L, ANY>(reference & !LEAF, group * 8 + lane, lane);
                    }
                    limit = range(&self.block.groups.get_unchecked(group).limit).1;
                    if limit < 0.0 {
                        return true;
                    }
                }
            }
        }
        true
    }
}
