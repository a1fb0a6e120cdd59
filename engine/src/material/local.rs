//! The local frame of a surface: z is the shading normal on the outward side.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

pub use crate::sampling::cosine_hemisphere;

/// Whether two directions lie on the same side of the surface; a direction along the surface lies on neither.
#[inline(always)]
pub fn same_side(a: DVec3, b: DVec3) -> bool {
    a.z * b.z > 0.0
}

/// The pair mirrored by the surface where needed, so that `a` lies on the outward side: for models that look alike from both sides.
#[inline(always)]
pub fn upright(a: DVec3, b: DVec3) -> (DVec3, DVec3) {
    let sign = 1f64.copysign(a.z);
    (DVec3::new(a.x, a.y, a.z * sign), DVec3::new(b.x, b.y, b.z * sign))
}

/// Density of [`cosine_hemisphere`] on the side of the direction, by solid angle.
#[inline(always)]
pub fn cosine_density(w: DVec3) -> f64 {
    w.z.abs() * FRAC_1_PI
}

/// The half vector of two unit vectors, in the upper hemisphere; `None` where it is undefined.
#[inline(always)]
pub fn half_vector(a: DVec3, b: DVec3) -> Option<DVec3> {
    let sum = a + b;
    let squared = sum.length_squared();
    let unit = sum * (1.0 / squared.sqrt());
    (squared > 0.0).then(|| if unit.z < 0.0 { -unit } else { unit })
}
