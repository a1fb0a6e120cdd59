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
    accel::{BLOCK, Block, Pencil, Tree, Triangles},
    shape::Ray,
};

/// To make room for a stream takes about as long as a ray.
const FEW: usize = 4;

impl Scene {
    /// Nearest hits of many rays, each handed over once, in order.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn hits_in<L: Outlined>(&self, rays: &[Ray], pencil: Option<&Pencil>, mut found: impl FnMut(usize, Hit)) {
        let Some(tree) = self.tree_for_streams(rays.len()) else {
            // SAFETY: the caller has the instructions of `L`.
            rays.iter().enumerate().for_each(|(number, ray)| found(number, unsafe { L::closest(self, ray, pencil) }));
            return;
        };
        let mut room = Block::new();
        for (block, rays) in rays.chunks(BLOCK).enumerate() {
            let mut best = [Hit::none(0.0); BLOCK];
            for (best, ray) in best.iter_mut().zip(rays) {
                // SAFETY: the caller has the instructions of `L`.
                *best = unsafe { self.closest_beside_tree::<L>(ray, pencil) };
            }
            // SAFETY: the caller has the instructions of `L`.
            unsafe { L::closest_of_block(self, tree, &mut room, rays, &mut best) };
            best.iter().take(rays.len()).enumerate().for_each(|(ray, best)| found(block * BLOCK + ray, *best));
        }
    }

    /// Whether anything stands in the way of each of many rays, handed over once, in order; `light` says which light of [`Scene::lights`] a ray goes to, if to one of them.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn any_of_in<L: Outlined>(
        &self,
        rays: &[Ray],
        light: impl Fn(usize) -> Option<usize>,
        mut blocks: impl FnMut(usize, u32, &Crossing) -> bool,
        mut found: impl FnMut(usize, bool),
    ) {
        let Some(tree) = self.tree_for_streams(rays.len()) else {
            for (number, ray) in rays.iter().enumerate() {
                // SAFETY: the caller has the instructions of `L`.
                found(number, unsafe { L::any(self, ray, light(number), |material, crossing| blocks(number, material, crossing)) });
            }
            return;
        };
        let mut room = Block::new();
        for (block, rays) in rays.chunks(BLOCK).enumerate() {
            let first = block * BLOCK;
            let mut is_blocked = [false; BLOCK];
            let mut blocked = |ray: usize, thing: Thing, t: f64| {
                t > 0.0 && t < rays[ray].t_max && blocks(first + ray, thing.material, &Crossing { t, object: thing.object })
            };
            for (number, ray) in rays.iter().enumerate() {
                // SAFETY: the caller has the instructions of `L`.
                is_blocked[number] =
                    unsafe { self.any_beside_tree::<L>(ray, light(first + number), &mut |thing, t| blocked(number, thing, t)) };
            }
            // SAFETY: the caller has the instructions of `L`.
            unsafe { L::any_of_block(self, tree, &mut room, rays, &mut is_blocked, &mut blocked) };
            is_blocked.iter().take(rays.len()).enumerate().for_each(|(ray, is_blocked)| found(first + ray, *is_blocked));
        }
    }

    /// Asks memory for what [`Scene::surface`] will look at of hits that come soon after one of many.
    #[inline(always)]
    pub(crate) fn prefetch(&self, hits: &[Option<Hit>], number: usize) {
        /// So far ahead that memory has answered, in steps of one hit.
        const AHEAD: usize = 6;
        if let Some((triangles, triangle)) = hits.get(number + 2 * AHEAD).and_then(|hit| self.triangle(hit)) {
            triangles.prefetch_indices(triangle);
        }
        if let Some((triangles, triangle)) = hits.get(number + AHEAD).and_then(|hit| self.triangle(hit)) {
            triangles.prefetch_vertices(triangle);
        }
    }

    #[inline(always)]
    fn triangle(&self, hit: &Option<Hit>) -> Option<(&Triangles, u32)> {
        let hit = hit.as_ref()?;
        let instance = self.geometry.instances.get(hit.instance()?)?;
        Some((&self.geometry.meshes[instance.shape.mesh as usize].triangles, hit.part))
    }

    /// The tree, if so many rays at a time are faster through it than one by one.
    fn tree_for_streams(&self, rays: usize) -> Option<&Tree> {
        self.geometry.tree.as_ref().filter(|_| rays >= FEW && !self.geometry.instances.is_empty())
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
