//! Many rays against the scene at a time.

use super::{
    Scene,
    geometry::{Instance, Placed, kind},
    query::Hit,
    surface::Crossing,
};
#[cfg(target_arch = "x86_64")]
use crate::accel::Avx2;
use crate::{
    accel::{BLOCK, Baseline, Block, Lanes, MeshHit, MeshTree},
    shape::Ray,
};
use glam::DVec3;

/// [`MeshTree::stream`] as a function of its own.
pub(super) trait Streams: Lanes {
    unsafe fn stream<const ANY: bool>(tree: &MeshTree, block: &mut Block, rays: &mut [Ray], visit: impl FnMut(usize, MeshHit) -> f64);
}

#[cfg(target_arch = "x86_64")]
impl Streams for Avx2 {
    #[inline(always)]
    unsafe fn stream<const ANY: bool>(tree: &MeshTree, block: &mut Block, rays: &mut [Ray], visit: impl FnMut(usize, MeshHit) -> f64) {
        #[target_feature(enable = "avx2,bmi1")]
        #[inline(never)]
        unsafe fn outlined<const ANY: bool>(
            tree: &MeshTree,
            block: &mut Block,
            rays: &mut [Ray],
            visit: impl FnMut(usize, MeshHit) -> f64,
        ) {
            // SAFETY: this function enables the instructions.
            unsafe { tree.stream::<Avx2, ANY>(block, rays, visit) }
        }
        // SAFETY: the caller has the instructions.
        unsafe { outlined::<ANY>(tree, block, rays, visit) }
    }
}

impl Streams for Baseline {
    #[inline(never)]
    unsafe fn stream<const ANY: bool>(tree: &MeshTree, block: &mut Block, rays: &mut [Ray], visit: impl FnMut(usize, MeshHit) -> f64) {
        // SAFETY: every machine has these instructions.
        unsafe { tree.stream::<Baseline, ANY>(block, rays, visit) }
    }
}

impl Scene {
    /// Nearest hits of many rays, each handed over once, in order; whether the scene is one that this can be done with, and so it was.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn hits_in<L: Streams>(&self, rays: &[Ray], mut found: impl FnMut(usize, Option<Hit>)) -> bool {
        let Some(reference) = self.only_mesh() else { return false };
        let placed = self.placed(reference);
        let (mut room, mut local) = (Block::new(), LocalRays::new());
        for (block, rays) in rays.chunks(BLOCK).enumerate() {
            let mut best = [Hit::none(0.0); BLOCK];
            for (best, ray) in best.iter_mut().zip(rays) {
                // SAFETY: the caller has the instructions of `L`.
                *best = unsafe { self.closest_beside_tree::<L>(ray, None) };
            }
            local.fill(placed, rays, |ray| best[ray].t);
            let visit = |ray: usize, hit: MeshHit| {
                if !placed.shape.masked || self.is_there(placed, &hit) {
                    best[ray].offer(Hit::of_mesh(&hit, placed.object, reference));
                }
                best[ray].t
            };
            // SAFETY: the caller has the instructions of `L`.
            unsafe { L::stream::<false>(self.tree_of(placed), &mut room, local.all(), visit) };
            best.iter().take(rays.len()).enumerate().for_each(|(ray, best)| found(block * BLOCK + ray, best.some()));
        }
        true
    }

    /// Whether anything stands in the way of each of many rays, handed over once, in order; whether the scene is one that this can be done with, and so it was.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn any_of_in<L: Streams>(
        &self,
        rays: &[Ray],
        blocks: &mut impl FnMut(usize, u32, &Crossing) -> bool,
        mut found: impl FnMut(usize, bool),
    ) -> bool {
        let Some(reference) = self.only_mesh() else { return false };
        let placed = self.placed(reference);
        let (mut room, mut local) = (Block::new(), LocalRays::new());
        for (block, rays) in rays.chunks(BLOCK).enumerate() {
            let mut is_blocked = [false; BLOCK];
            let mut blocked =
                |ray: usize, material: u32, t: f64| t < rays[ray].t_max && blocks(block * BLOCK + ray, material, &Crossing { t });
            for (number, ray) in rays.iter().enumerate() {
                let mut blocked = |material, t| t > 0.0 && blocked(number, material, t);
                // SAFETY: the caller has the instructions of `L`.
                is_blocked[number] = unsafe { self.any_beside_tree::<L>(ray, None, &mut blocked) };
            }
            local.fill(placed, rays, |ray| if is_blocked[ray] { -1.0 } else { rays[ray].t_max });
            let visit = |ray: usize, hit: MeshHit| {
                let there = !placed.shape.masked || self.is_there(placed, &hit);
                is_blocked[ray] = there && blocked(ray, placed.material, hit.at.t);
                if is_blocked[ray] { -1.0 } else { rays[ray].t_max }
            };
            // SAFETY: the caller has the instructions of `L`.
            unsafe { L::stream::<true>(self.tree_of(placed), &mut room, local.all(), visit) };
            is_blocked.iter().take(rays.len()).enumerate().for_each(|(ray, is_blocked)| found(block * BLOCK + ray, *is_blocked));
        }
        true
    }

    fn placed(&self, reference: u32) -> &Placed<Instance> {
        &self.geometry.instances[(reference & kind::INDEX) as usize]
    }

    fn tree_of(&self, placed: &Placed<Instance>) -> &MeshTree {
        &self.geometry.meshes[placed.shape.mesh as usize].tree
    }
}

/// A block of rays in the coordinates of an instance.
struct LocalRays {
    rays: [Ray; BLOCK],
    count: usize,
}

impl LocalRays {
    #[inline(always)]
    fn new() -> Self {
        Self { rays: [Ray::new(DVec3::ZERO, DVec3::X); BLOCK], count: 0 }
    }

    #[inline(always)]
    fn fill(&mut self, placed: &Placed<Instance>, rays: &[Ray], t_max: impl Fn(usize) -> f64) {
        self.count = rays.len();
        for (number, (local, ray)) in self.rays.iter_mut().zip(rays).enumerate() {
            *local = Ray { t_max: t_max(number), ..placed.shape.transform.of_ray(ray) };
        }
    }

    #[inline(always)]
    fn all(&mut self) -> &mut [Ray] {
        &mut self.rays[..self.count]
    }
}
