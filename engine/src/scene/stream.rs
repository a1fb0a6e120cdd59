//! Many rays against the scene at a time.

use std::marker::PhantomData;

use super::{
    Scene,
    outlined::Outlined,
    query::Hit,
    surface::{Crossing, Thing},
    visit::{Any, Blocked, Closest},
};
use crate::{
    accel::{BLOCK, Block, Tree},
    shape::Ray,
};

impl Scene {
    /// Nearest hits of many rays, each handed over once, in order; whether the scene is one where this is faster than one by one, and so it was done.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn hits_in<L: Outlined>(&self, rays: &[Ray], mut found: impl FnMut(usize, Option<Hit>)) -> bool {
        let Some(tree) = self.tree_for_streams() else { return false };
        let mut room = Block::new();
        for (block, rays) in rays.chunks(BLOCK).enumerate() {
            let mut best = [Hit::none(0.0); BLOCK];
            for (best, ray) in best.iter_mut().zip(rays) {
                // SAFETY: the caller has the instructions of `L`.
                *best = unsafe { self.closest_beside_tree::<L>(ray, None) };
            }
            // SAFETY: the caller has the instructions of `L`.
            unsafe { L::closest_of_block(self, tree, &mut room, rays, &mut best) };
            best.iter().take(rays.len()).enumerate().for_each(|(ray, best)| found(block * BLOCK + ray, best.some()));
        }
        true
    }

    /// Whether anything stands in the way of each of many rays, handed over once, in order; whether the scene is one where this is faster than one by one, and so it
    /// was done.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn any_of_in<L: Outlined>(
        &self,
        rays: &[Ray],
        blocks: &mut impl FnMut(usize, u32, &Crossing) -> bool,
        mut found: impl FnMut(usize, bool),
    ) -> bool {
        let Some(tree) = self.tree_for_streams() else { return false };
        let mut room = Block::new();
        for (block, rays) in rays.chunks(BLOCK).enumerate() {
            let mut is_blocked = [false; BLOCK];
            let mut blocked = |ray: usize, thing: Thing, t: f64| {
                t > 0.0 && t < rays[ray].t_max && blocks(block * BLOCK + ray, thing.material, &Crossing { t, object: thing.object })
            };
            for (number, ray) in rays.iter().enumerate() {
                // SAFETY: the caller has the instructions of `L`.
                is_blocked[number] = unsafe { self.any_beside_tree::<L>(ray, None, &mut |thing, t| blocked(number, thing, t)) };
            }
            // SAFETY: the caller has the instructions of `L`.
            unsafe { L::any_of_block(self, tree, &mut room, rays, &mut is_blocked, &mut blocked) };
            is_blocked.iter().take(rays.len()).enumerate().for_each(|(ray, is_blocked)| found(block * BLOCK + ray, *is_blocked));
        }
        true
    }

    fn tree_for_streams(&self) -> Option<&Tree> {
        self.geometry.tree.as_ref().filter(|_| !self.geometry.instances.is_empty())
    }

    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn closest_of_block_in<L: Outlined>(&self, tree: &Tree, room: &mut Block, rays: &[Ray], best: &mut [Hit]) {
        let mut limits = [0.0; BLOCK];
        limits.iter_mut().zip(&*best).for_each(|(limit, best)| *limit = best.t);
        // SAFETY: the caller has the instructions of `L`.
        unsafe { tree.stream::<L, false>(room, rays, &limits, Closest::<L> { scene: self, rays, best, lanes: PhantomData }) };
    }

    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn any_of_block_in<L: Outlined>(
        &self,
        tree: &Tree,
        room: &mut Block,
        rays: &[Ray],
        is_blocked: &mut [bool],
        blocked: &mut impl Blocked,
    ) {
        let mut limits = [0.0; BLOCK];
        for (limit, (ray, is_blocked)) in limits.iter_mut().zip(rays.iter().zip(&*is_blocked)) {
            *limit = if *is_blocked { -1.0 } else { ray.t_max };
        }
        let visitor = Any::<L, _> { scene: self, rays, is_blocked, blocked, lanes: PhantomData };
        // SAFETY: the caller has the instructions of `L`.
        unsafe { tree.stream::<L, true>(room, rays, &limits, visitor) };
    }

    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn closest_of_tree_in<L: Outlined>(&self, tree: &Tree, ray: &Ray, best: &mut Hit) {
        let limit = best.t;
        let (rays, best) = (std::slice::from_ref(ray), std::slice::from_mut(best));
        // SAFETY: the caller has the instructions of `L`.
        unsafe { tree.walk::<L, false>(ray, limit, &mut Closest::<L> { scene: self, rays, best, lanes: PhantomData }) };
    }

    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn any_of_tree_in<L: Outlined>(&self, tree: &Tree, ray: &Ray, blocked: &mut impl Blocked) -> bool {
        let mut is_blocked = false;
        let (rays, one) = (std::slice::from_ref(ray), std::slice::from_mut(&mut is_blocked));
        // SAFETY: the caller has the instructions of `L`.
        unsafe {
            tree.walk::<L, true>(ray, ray.t_max, &mut Any::<L, _> { scene: self, rays, is_blocked: one, blocked, lanes: PhantomData })
        };
        is_blocked
    }
}
