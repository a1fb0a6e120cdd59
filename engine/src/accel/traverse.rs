//! The walk through a tree: one body for nearest and any hit, for every vector width.

use std::{mem::MaybeUninit, ops::ControlFlow};

use super::{
    frame::BoxRay,
    node::{BOUND, LEAF, Node},
    simd::Lanes,
};

/// Entries of the traversal stack. Every level leaves at most seven; builders keep trees below `MAX_DEPTH`.
const STACK: usize = 1024;

/// Deepest tree that may be traversed.
pub const MAX_DEPTH: usize = (STACK - 8) / 7;

/// Visits the leaves whose boxes the ray meets before a limit (see [`BoxRay::limit`]) that every visit says anew; nearest boxes first, unless `ANY`, which saves the sorting.
///
/// # Safety
/// `nodes` is a tree made by `collapse` with root `root`: its references are in range and its depth is at most `MAX_DEPTH`. The processor has the
/// instructions of `L`.
#[inline(always)]
pub unsafe fn traverse<L: Lanes, const ANY: bool>(
    nodes: &[Node],
    root: u32,
    ray: &BoxRay,
    mut limit: f32,
    mut leaf: impl FnMut(u32) -> ControlFlow<(), f32>,
) {
    if !ray.is_sound() {
        return;
    }
    // SAFETY: by this function's own conditions.
    unsafe {
        let (ox, oy, oz) = (L::splat(ray.origin.x), L::splat(ray.origin.y), L::splat(ray.origin.z));
        let (nx, ny, nz) = (L::splat(ray.inverse_near.x), L::splat(ray.inverse_near.y), L::splat(ray.inverse_near.z));
        let (fx, fy, fz) = (L::splat(ray.inverse_far.x), L::splat(ray.inverse_far.y), L::splat(ray.inverse_far.z));
        // In bytes, so that nothing is multiplied on the way.
        let near_bound = |axis: u32| BOUND * (axis as usize + if ray.negative >> axis & 1 == 1 { 3 } else { 0 });
        let (near_x, near_y, near_z) = (near_bound(0), near_bound(1), near_bound(2));
        let (far_x, far_y, far_z) = (3 * BOUND - near_x, 5 * BOUND - near_y, 7 * BOUND - near_z);
        let zero = L::splat(0.0);
        let mut stack = MaybeUninit::<[u64; STACK]>::uninit();
        let stack = stack.as_mut_ptr().cast::<u64>();
        let mut height = 0usize;
        let mut current = root;
        let mut entry = [0f32; 8];
        loop {
            if current & LEAF == 0 {
                let node = nodes.get_unchecked(current as usize);
                let (enter_x, leave_x) = (node.distance(near_x, ox, nx), node.distance(far_x, ox, fx));
                let (enter_y, leave_y) = (node.distance(near_y, oy, ny), node.distance(far_y, oy, fy));
                let (enter_z, leave_z) = (node.distance(near_z, oz, nz), node.distance(far_z, oz, fz));
                // Of two of which one is no number, `max` takes the second: an empty place then has no number to enter at.
                let enter = enter_x.max(enter_y).max(zero.max(enter_z));
                let leave = leave_x.min(leave_y).min(leave_z.min(L::splat(limit)));
                let mut hits = enter.le(leave);
                if hits != 0 {
                    let first = hits.trailing_zeros() as usize;
                    hits &= hits - 1;
                    if hits == 0 {
                        current = *node.children.get_unchecked(first);
                        continue;
                    }
                    if ANY {
                        while hits != 0 {
                            *stack.add(height) = u64::from(*node.children.get_unchecked(hits.trailing_zeros() as usize));
                            height += 1;
                            hits &= hits - 1;
                        }
                        current = *node.children.get_unchecked(first);
                        continue;
                    }
                    // Distances are not negative, so their bits order as they do; child references make the order total.
                    enter.store(&mut entry);
                    let key = |i: usize| u64::from(entry.get_unchecked(i).to_bits()) << 32 | u64::from(*node.children.get_unchecked(i));
                    let mut nearest = key(first);
                    let base = height;
                    while hits != 0 {
                        let other = key(hits.trailing_zeros() as usize);
                        hits &= hits - 1;
                        let farther = nearest.max(other);
                        nearest = nearest.min(other);
                        let mut place = height;
                        while place > base && *stack.add(place - 1) < farther {
                            *stack.add(place) = *stack.add(place - 1);
                            place -= 1;
                        }
                        *stack.add(place) = farther;
                        height += 1;
                    }
                    current = nearest as u32;
                    continue;
                }
            } else {
                match leaf(current & !LEAF) {
                    ControlFlow::Continue(lower) => limit = lower,
                    ControlFlow::Break(()) => return,
                }
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                let top = *stack.add(height);
                current = top as u32;
                if ANY || f32::from_bits((top >> 32) as u32) <= limit {
                    break;
                }
            }
        }
    }
}
