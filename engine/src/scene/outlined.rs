//! Queries of one mesh as functions of their own.

use super::{Scene, query::Hit};
#[cfg(target_arch = "x86_64")]
use crate::accel::Avx2;
use crate::{
    accel::{Baseline, Lanes},
    shape::Ray,
};

/// Outlined, so that scenes without meshes do not pay for them in registers.
pub(super) trait Outlined: Lanes {
    unsafe fn closest_of_mesh(scene: &Scene, ray: &Ray, reference: u32, best: &mut Hit);
    unsafe fn any_of_mesh(scene: &Scene, ray: &Ray, reference: u32, blocked: &mut impl FnMut(u32, f64) -> bool) -> bool;
}

#[cfg(target_arch = "x86_64")]
impl Outlined for Avx2 {
    #[inline(always)]
    unsafe fn closest_of_mesh(scene: &Scene, ray: &Ray, reference: u32, best: &mut Hit) {
        #[target_feature(enable = "avx2,bmi1")]
        #[inline(never)]
        unsafe fn outlined(scene: &Scene, ray: &Ray, reference: u32, best: &mut Hit) {
            // SAFETY: this function enables the instructions.
            unsafe { scene.closest_of_mesh_in::<Avx2>(ray, reference, best) }
        }
        // SAFETY: the caller has the instructions.
        unsafe { outlined(scene, ray, reference, best) }
    }

    #[inline(always)]
    unsafe fn any_of_mesh(scene: &Scene, ray: &Ray, reference: u32, blocked: &mut impl FnMut(u32, f64) -> bool) -> bool {
        #[target_feature(enable = "avx2,bmi1")]
        #[inline(never)]
        unsafe fn outlined(scene: &Scene, ray: &Ray, reference: u32, blocked: &mut impl FnMut(u32, f64) -> bool) -> bool {
            // SAFETY: this function enables the instructions.
            unsafe { scene.any_of_mesh_in::<Avx2>(ray, reference, blocked) }
        }
        // SAFETY: the caller has the instructions.
        unsafe { outlined(scene, ray, reference, blocked) }
    }
}

impl Outlined for Baseline {
    #[inline(never)]
    unsafe fn closest_of_mesh(scene: &Scene, ray: &Ray, reference: u32, best: &mut Hit) {
        // SAFETY: every machine has these instructions.
        unsafe { scene.closest_of_mesh_in::<Baseline>(ray, reference, best) }
    }

    #[inline(never)]
    unsafe fn any_of_mesh(scene: &Scene, ray: &Ray, reference: u32, blocked: &mut impl FnMut(u32, f64) -> bool) -> bool {
        // SAFETY: every machine has these instructions.
        unsafe { scene.any_of_mesh_in::<Baseline>(ray, reference, blocked) }
    }
}
