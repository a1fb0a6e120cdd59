//! Tracing many rays in code that is compiled for the processor at hand.

use std::{marker::PhantomData, ops::Deref};

#[cfg(target_arch = "x86_64")]
use crate::accel::Avx2;
use crate::{
    accel::{Baseline, Simd},
    shape::Ray,
};

use super::{Crossing, Hit, Scene, Surface, outlined::Outlined};

/// A scene and its queries, in code for one kind of processor: what [`Scene::run`] gives to its work. All kinds give the same bits.
pub trait Tracer: Copy + Deref<Target = Scene> {
    /// The nearest hit of a ray of unit direction.
    fn hit(self, ray: &Ray) -> Option<Hit>;

    /// The nearest hits of many rays, each given to `found` once with its number, in order: faster than one by one where the tree is large or rays that follow
    /// one another, eight at a time, go the same way.
    fn hits(self, rays: &[Ray], found: impl FnMut(usize, Option<Hit>));

    /// The same for rays that start at the camera's eye.
    fn hits_from_eye(self, rays: &[Ray], found: impl FnMut(usize, Option<Hit>));

    /// See [`Scene::closest`].
    fn closest(self, ray: &Ray) -> Option<Surface>;

    /// See [`Scene::any`].
    fn any(self, ray: &Ray, blocks: impl FnMut(u32, &Crossing) -> bool) -> bool;

    /// The same for a ray that ends at a light of [`Scene::lights`], or goes towards it without end. `blocks` need not be asked of surfaces that let
    /// all light through.
    fn any_before_light(self, light: usize, ray: &Ray, blocks: impl FnMut(u32, &Crossing) -> bool) -> bool;

    /// Both for many rays, each given to `found` once with its number, in order; `light` and `blocks` are given its number too.
    fn any_of(
        self,
        rays: &[Ray],
        light: impl Fn(usize) -> Option<usize>,
        blocks: impl FnMut(usize, u32, &Crossing) -> bool,
        found: impl FnMut(usize, bool),
    );
}

/// Work that traces many rays. Its functions are compiled once for each kind of processor, as far as they are inlined.
pub trait Work {
    /// What comes out.
    type Output;

    /// Does the work. Mark it `#[inline(always)]`.
    fn run(self, scene: impl Tracer) -> Self::Output;
}

impl Scene {
    /// Does work in code for this processor: the choice is made once, not for every ray.
    pub fn run<W: Work>(&self, work: W) -> W::Output {
        match self.simd() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Simd::detect` found these instructions.
            Simd::Avx2 => unsafe { run_avx2(self, work) },
            // SAFETY: every machine has these instructions.
            _ => work.run(unsafe { View::<Baseline>::new(self) }),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1")]
unsafe fn run_avx2<W: Work>(scene: &Scene, work: W) -> W::Output {
    // SAFETY: this function enables the instructions, and its caller found that the processor has them.
    work.run(unsafe { View::<Avx2>::new(scene) })
}

/// A scene for processors that have the instructions of `L`: a value of this type is the proof.
struct View<'s, L> {
    scene: &'s Scene,
    lanes: PhantomData<L>,
}

impl<'s, L> View<'s, L> {
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn new(scene: &'s Scene) -> Self {
        Self { scene, lanes: PhantomData }
    }
}

impl<L> Clone for View<'_, L> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<L> Copy for View<'_, L> {}

impl<L> Deref for View<'_, L> {
    type Target = Scene;

    #[inline(always)]
    fn deref(&self) -> &Scene {
        self.scene
    }
}

impl<L: Outlined> Tracer for View<'_, L> {
    #[inline(always)]
    fn hit(self, ray: &Ray) -> Option<Hit> {
        // SAFETY: `self` is the proof, as below.
        unsafe { L::closest(self.scene, ray, None) }.some()
    }

    #[inline(always)]
    fn hits(self, rays: &[Ray], mut found: impl FnMut(usize, Option<Hit>)) {
        // SAFETY: see above.
        unsafe { self.scene.hits_in::<L>(rays, None, |number, hit| found(number, hit.some())) }
    }

    #[inline(always)]
    fn hits_from_eye(self, rays: &[Ray], mut found: impl FnMut(usize, Option<Hit>)) {
        // SAFETY: see above.
        unsafe { self.scene.hits_in::<L>(rays, self.scene.geometry.from_eye.as_ref(), |number, hit| found(number, hit.some())) }
    }

    #[inline(always)]
    fn closest(self, ray: &Ray) -> Option<Surface> {
        // SAFETY: see above.
        let hit = unsafe { L::closest(self.scene, ray, None) };
        self.scene.surface(ray, &hit)
    }

    #[inline(always)]
    fn any(self, ray: &Ray, blocks: impl FnMut(u32, &Crossing) -> bool) -> bool {
        // SAFETY: see above.
        unsafe { L::any(self.scene, ray, None, blocks) }
    }

    #[inline(always)]
    fn any_before_light(self, light: usize, ray: &Ray, blocks: impl FnMut(u32, &Crossing) -> bool) -> bool {
        // SAFETY: see above.
        unsafe { L::any(self.scene, ray, Some(light), blocks) }
    }

    #[inline(always)]
    fn any_of(
        self,
        rays: &[Ray],
        light: impl Fn(usize) -> Option<usize>,
        blocks: impl FnMut(usize, u32, &Crossing) -> bool,
        found: impl FnMut(usize, bool),
    ) {
        // SAFETY: see above.
        unsafe { self.scene.any_of_in::<L>(rays, light, blocks, found) }
    }
}
