//! Queries and walks through trees as functions of their own.

use super::{
    Scene,
    query::Hit,
    surface::{Crossing, Thing},
    visit::Blocked,
};
#[cfg(target_arch = "x86_64")]
use crate::accel::Avx2;
use crate::{
    accel::{Baseline, Block, Lanes, Pencil, Tree},
    shape::{Ray, triangle::TriangleHit},
};

/// Outlined, so that scenes without meshes do not pay for them in registers, nor what is inside of meshes for what is beside them.
///
/// # Safety
/// The processor has the instructions of the type.
pub(super) trait Outlined: Lanes {
    unsafe fn closest(scene: &Scene, ray: &Ray, pencil: Option<&Pencil>) -> Hit;
    unsafe fn any(scene: &Scene, ray: &Ray, light: Option<usize>, blocks: impl FnMut(u32, &Crossing) -> bool) -> bool;
    unsafe fn closest_of_tree(scene: &Scene, tree: &Tree, ray: &Ray, best: &mut Hit);
    unsafe fn any_of_tree(scene: &Scene, tree: &Tree, ray: &Ray, blocked: &mut impl Blocked) -> bool;
    unsafe fn closest_of_leaf(scene: &Scene, ray: &Ray, reference: u32, best: &mut Hit);
    unsafe fn any_of_leaf(scene: &Scene, ray: &Ray, reference: u32, blocked: &mut impl FnMut(Thing, f64) -> bool) -> bool;
    unsafe fn exact(scene: &Scene, ray: &Ray, instance: u32, triangle: u32) -> Option<TriangleHit>;
    unsafe fn closest_of_block(scene: &Scene, tree: &Tree, room: &mut Block, rays: &[Ray], best: &mut [Hit]);
    unsafe fn any_of_block(scene: &Scene, tree: &Tree, room: &mut Block, rays: &[Ray], is_blocked: &mut [bool], blocked: &mut impl Blocked);
}

macro_rules! outlined {
    ($lanes:ty $(, $features:literal)?) => {
        impl Outlined for $lanes {
            #[inline(always)]
            unsafe fn closest(scene: &Scene, ray: &Ray, pencil: Option<&Pencil>) -> Hit {
                $(#[target_feature(enable = $features)])?
                #[inline(never)]
                unsafe fn outlined(scene: &Scene, ray: &Ray, pencil: Option<&Pencil>) -> Hit {
                    // SAFETY: by the trait's condition, as below.
                    unsafe { scene.closest_in::<$lanes>(ray, pencil) }
                }
                // SAFETY: see above.
                unsafe { outlined(scene, ray, pencil) }
            }

            #[inline(always)]
            unsafe fn any(scene: &Scene, ray: &Ray, light: Option<usize>, blocks: impl FnMut(u32, &Crossing) -> bool) -> bool {
                $(#[target_feature(enable = $features)])?
                unsafe fn outlined(scene: &Scene, ray: &Ray, light: Option<usize>, blocks: impl FnMut(u32, &Crossing) -> bool) -> bool {
                    // SAFETY: see above.
                    unsafe { scene.any_in::<$lanes>(ray, light, blocks) }
                }
                // SAFETY: see above.
                unsafe { outlined(scene, ray, light, blocks) }
            }

            #[inline(always)]
            unsafe fn closest_of_tree(scene: &Scene, tree: &Tree, ray: &Ray, best: &mut Hit) {
                $(#[target_feature(enable = $features)])?
                #[inline(never)]
                unsafe fn outlined(scene: &Scene, tree: &Tree, ray: &Ray, best: &mut Hit) {
                    // SAFETY: see above.
                    unsafe { scene.closest_of_tree_in::<$lanes>(tree, ray, best) }
                }
                // SAFETY: see above.
                unsafe { outlined(scene, tree, ray, best) }
            }

            #[inline(always)]
            unsafe fn any_of_tree(scene: &Scene, tree: &Tree, ray: &Ray, blocked: &mut impl Blocked) -> bool {
                $(#[target_feature(enable = $features)])?
                #[inline(never)]
                unsafe fn outlined(scene: &Scene, tree: &Tree, ray: &Ray, blocked: &mut impl Blocked) -> bool {
                    // SAFETY: see above.
                    unsafe { scene.any_of_tree_in::<$lanes>(tree, ray, blocked) }
                }
                // SAFETY: see above.
                unsafe { outlined(scene, tree, ray, blocked) }
            }

            #[inline(always)]
            unsafe fn closest_of_leaf(scene: &Scene, ray: &Ray, reference: u32, best: &mut Hit) {
                $(#[target_feature(enable = $features)])?
                #[inline(never)]
                unsafe fn outlined(scene: &Scene, ray: &Ray, reference: u32, best: &mut Hit) {
                    // SAFETY: see above.
                    unsafe { scene.closest_of_leaf_in::<$lanes>(ray, reference, best) }
                }
                // SAFETY: see above.
                unsafe { outlined(scene, ray, reference, best) }
            }

            #[inline(always)]
            unsafe fn any_of_leaf(scene: &Scene, ray: &Ray, reference: u32, blocked: &mut impl FnMut(Thing, f64) -> bool) -> bool {
                $(#[target_feature(enable = $features)])?
                #[inline(never)]
                unsafe fn outlined(scene: &Scene, ray: &Ray, reference: u32, blocked: &mut impl FnMut(Thing, f64) -> bool) -> bool {
                    // SAFETY: see above.
                    unsafe { scene.any_of_leaf_in::<$lanes>(ray, reference, blocked) }
                }
                // SAFETY: see above.
                unsafe { outlined(scene, ray, reference, blocked) }
            }

            #[inline(always)]
            unsafe fn exact(scene: &Scene, ray: &Ray, instance: u32, triangle: u32) -> Option<TriangleHit> {
                $(#[target_feature(enable = $features)])?
                #[inline(never)]
                unsafe fn outlined(scene: &Scene, ray: &Ray, instance: u32, triangle: u32) -> Option<TriangleHit> {
                    scene.exact_in(ray, instance, triangle)
                }
                // SAFETY: see above.
                unsafe { outlined(scene, ray, instance, triangle) }
            }

            #[inline(always)]
            unsafe fn closest_of_block(scene: &Scene, tree: &Tree, room: &mut Block, rays: &[Ray], best: &mut [Hit]) {
                $(#[target_feature(enable = $features)])?
                #[inline(never)]
                unsafe fn outlined(scene: &Scene, tree: &Tree, room: &mut Block, rays: &[Ray], best: &mut [Hit]) {
                    // SAFETY: see above.
                    unsafe { scene.closest_of_block_in::<$lanes>(tree, room, rays, best) }
                }
                // SAFETY: see above.
                unsafe { outlined(scene, tree, room, rays, best) }
            }

            #[inline(always)]
            unsafe fn any_of_block(
                scene: &Scene,
                tree: &Tree,
                room: &mut Block,
                rays: &[Ray],
                is_blocked: &mut [bool],
                blocked: &mut impl Blocked,
            ) {
                $(#[target_feature(enable = $features)])?
                #[inline(never)]
                unsafe fn outlined(
                    scene: &Scene,
                    tree: &Tree,
                    room: &mut Block,
                    rays: &[Ray],
                    is_blocked: &mut [bool],
                    blocked: &mut impl Blocked,
                ) {
                    // SAFETY: see above.
                    unsafe { scene.any_of_block_in::<$lanes>(tree, room, rays, is_blocked, blocked) }
                }
                // SAFETY: see above.
                unsafe { outlined(scene, tree, room, rays, is_blocked, blocked) }
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
outlined!(Avx2, "avx2,bmi1");
outlined!(Baseline);
