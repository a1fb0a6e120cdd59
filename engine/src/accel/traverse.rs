//! The walk through a tree: one body for nearest and any hit, for every vector width.

use std::{mem::MaybeUninit, ops::ControlFlow};

use super::{
    frame::BoxRay,
    node::{LEAF, Node, near_bounds},
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
        let (origin, inverse_near, inverse_far) = (L::splats(&ray.origin), L::splats(&ray.inverse_near), L::splats(&ray.inverse_far));
        let near = near_bounds(ray.negative);
        let mut stack = MaybeUninit::<[u64; STACK]>::uninit();
        let stack = stack.as_mut_ptr().cast::<u64>();
        let mut height = 0usize;
        let mut current = root;
        let mut entry = [0f32; 8];
        loop {
            if current & LEAF == 0 {
                let node = nodes.get_unchecked(current as usize);
                let (enter, leave) = node.meet(near, [origin, inverse_near], [origin, inverse_far], L::splat(limit));
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
