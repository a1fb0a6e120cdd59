//! Eight rays that go the same way through one tree, side by side: they visit a node together if any of them might meet it (the interval test of Boulos, Wald,
//! Shirley, "Geometric and Arithmetic Culling Methods for Entire Ray Packets", 2006), and each child's box is then met by each of them.

use super::{
    frame::BoxRay,
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

/// A value for each of eight rays.
type Eight = [f32; 8];

/// Eight rays of a block.
struct Packet {
    near: [usize; 3],
    /// What makes every distance to a near bound least: an origin and an inverse direction.
    near_ray: [[f32; 3]; 2],
    /// And what makes every distance to a far bound greatest.
    far_ray: [[f32; 3]; 2],
    /// By axis.
    origin: [Eight; 3],
    /// By axis.
    inverse_near: [Eight; 3],
    /// By axis.
    inverse_far: [Eight; 3],
}

impl Packet {
    /// `None` where the rays' directions have different signs, or go far apart, or boxes cannot tell what one of them meets.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn of<L: Lanes>(rays: &[BoxRay; 8]) -> Option<Self> {
        let negative = rays[0].negative;
        if rays.iter().any(|other| other.negative != negative) {
            return None;
        }
        // SAFETY: by this function's own condition.
        let ([[low, near_low], [far_low, least]], [[high, near_high], [far_high, greatest]]) = unsafe { ranges::<L>(rays) };
        let mut packet = Self {
            near: near_bounds(negative),
            near_ray: [[0.0; 3]; 2],
            far_ray: [[0.0; 3]; 2],
            origin: [[0.0; 8]; 3],
            inverse_near: [[0.0; 8]; 3],
            inverse_far: [[0.0; 8]; 3],
        };
        for axis in 0..3 {
            // What is no number is not narrow either.
            let is_narrow = high[axis] - low[axis] <= WIDEST && greatest[axis] - least[axis] <= WIDEST;
            if !is_narrow {
                return None;
            }
            let is_negative = negative >> axis & 1 == 1;
            let far_first = |low: f32, high: f32| if is_negative { (low, high) } else { (high, low) };
            (packet.near_ray[0][axis], packet.far_ray[0][axis]) = far_first(low[axis], high[axis]);
            packet.near_ray[1][axis] = far_first(near_low[axis], near_high[axis]).1;
            packet.far_ray[1][axis] = far_first(far_low[axis], far_high[axis]).0;
            // A ray that enters and leaves all boxes at once has nothing in common with one that does not.
            if packet.near_ray[1][axis] == 0.0 {
                return None;
            }
            for (lane, ray) in rays.iter().enumerate() {
                packet.origin[axis][lane] = ray.origin[axis];
                packet.inverse_near[axis][lane] = ray.inverse_near[axis];
                packet.inverse_far[axis][lane] = ray.inverse_far[axis];
            }
        }
        Some(packet)
    }

    /// Bit i is set where ray i meets the box of a child.
    ///
    /// # Safety
    /// The child is one of the tree's. The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn meets<L: Lanes>(&self, limit: &Eight, node: &Node, place: usize) -> u32 {
        // SAFETY: by this function's own condition.
        unsafe {
            let (mut enter, mut leave) = (L::splat(0.0), L::load(limit));
            for axis in 0..3 {
                let origin = L::load(&self.origin[axis]);
                let near = L::splat(node.bound(self.near[axis], place)).sub(origin);
                enter = enter.max(near.mul(L::load(&self.inverse_near[axis])));
                let far = L::splat(node.bound(far_bound(self.near, axis), place)).sub(origin);
                leave = leave.min(far.mul(L::load(&self.inverse_far[axis])));
            }
            enter.le(leave)
        }
    }
}

/// Origins and near inverses, far inverses and directions: the least of each component, and the greatest.
type Range = [[[f32; 4]; 2]; 2];

/// The ranges of eight rays, which are sound or all of them done.
///
/// # Safety
/// The processor has the instructions of `L`.
#[inline(always)]
unsafe fn ranges<L: Lanes>(rays: &[BoxRay; 8]) -> (Range, Range) {
    let (mut low, mut high) = ([[0.0; 8]; 2], [[0.0; 8]; 2]);
    for half in 0..2 {
        // SAFETY: by this function's own condition.
        unsafe {
            let first = L::load(&rays[0].halves()[half]);
            let (mut least, mut greatest) = (first, first);
            for ray in &rays[1..] {
                let next = L::load(&ray.halves()[half]);
                (least, greatest) = (least.min(next), greatest.max(next));
            }
            least.store(&mut low[half]);
            greatest.store(&mut high[half]);
        }
    }
    let by_vector = |[a, b]: [[f32; 8]; 2]| [a, b].map(|[x, y, z, w, k, l, m, n]| [[x, y, z, w], [k, l, m, n]]);
    (by_vector(low), by_vector(high))
}

/// The greatest.
#[inline(always)]
fn greatest(of: &Eight) -> f32 {
    let greater = |a: f32, b: f32| if a > b { a } else { b };
    let [a, b, c, d, e, f, g, h] = *of;
    greater(greater(greater(a, e), greater(b, f)), greater(greater(c, g), greater(d, h)))
}

impl<V: Visitor> Stream<'_, V> {
    /// Leads a group of eight rays through the tree side by side; whether they go the same way, and so it was done.
    ///
    /// # Safety
    /// The processor has the instructions of `L`. The group is one of the block, and full.
    #[inline(always)]
    pub unsafe fn go_together<L: Lanes, R: Left<L>, const ANY: bool>(&mut self, group: usize) -> bool {
        if self.root & LEAF != 0 {
            return false;
        }
        let Some(rays) = self.block.rays.as_chunks::<8>().0.get(group) else { return false };
        // SAFETY: by this function's own condition.
        let Some(packet) = (unsafe { Packet::of::<L>(rays) }) else { return false };
        if ANY {
            self.block.told.iter_mut().for_each(|told| told.clear());
        }
        let mut pending = Pending::<R>::new();
        let mut limit = greatest(&self.block.limit[group]);
        let mut current = self.root;
        // SAFETY: all are nodes and leaves of this tree, which is never deeper than `MAX_DEPTH`.
        unsafe {
            let near_ray = [L::splats(&packet.near_ray[0]), L::splats(&packet.near_ray[1])];
            let far_ray = [L::splats(&packet.far_ray[0]), L::splats(&packet.far_ray[1])];
            while limit >= 0.0 {
                let (enter, leave) = self.nodes.get_unchecked(current as usize).meet(packet.near, near_ray, far_ray, L::splat(limit));
                let met = R::of(enter, leave);
                pending.push(current, met, !met.is_empty());
                loop {
                    let Some(child) = pending.pop::<L>(limit) else { return true };
                    let node = self.nodes.get_unchecked(child.node as usize);
                    let mut met = packet.meets::<L>(self.block.limit.get_unchecked(group), node, child.place);
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
                    limit = greatest(self.block.limit.get_unchecked(group));
                    if limit < 0.0 {
                        return true;
                    }
                }
            }
        }
        true
    }
}
