//! Numbers: the only door to transcendental functions, error bounds, frames.
//!
//! The functions come from `libm`, in plain Rust, so that every machine computes the same bits; the standard library's call the
//! platform's own. Sums, products, quotients and `f64::sqrt` are exact everywhere (IEEE 754) and need no door.

use glam::DVec3;

pub use libm::{acos, asin, atan, atan2, cos, exp, exp2, fma, log as ln, log2, pow, powf, sin, sincos as sin_cos, tan};

/// The unit roundoff of f64, 2^-53: the largest relative error of one operation.
pub const UNIT: f64 = f64::EPSILON / 2.0;

/// A bound on the relative error of `n` operations in sequence, `n u / (1 - n u)` (Higham, "Accuracy and Stability of Numerical
/// Algorithms", 2nd ed., 3.1).
pub const fn gamma(n: u32) -> f64 {
    let nu = n as f64 * UNIT;
    nu / (1.0 - nu)
}

/// Two unit vectors that are perpendicular to the unit vector `n` and to each other, right-handed with it as the third (Duff et al.,
/// "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017).
pub fn orthonormal_basis(n: DVec3) -> (DVec3, DVec3) {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// The largest of the components' magnitudes.
#[inline(always)]
pub fn max_abs(v: DVec3) -> f64 {
    v.abs().max_element()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DAffine3, DMat3, DVec2, Vec3, Vec3A};

    /// glam must round after every operation: its SIMD and FMA paths give other bits. Expected values are written out operation by operation.
    #[test]
    fn glam_rounds_like_scalar_arithmetic() {
        let (a, b) = (DVec3::new(0.1, 0.7, -1.3), DVec3::new(1.0 / 3.0, 2.1, 0.9));
        assert_eq!(a.dot(b).to_bits(), ((a.x * b.x + a.y * b.y) + a.z * b.z).to_bits());
        let cross = DVec3::new(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y);
        assert_eq!(a.cross(b).to_array().map(f64::to_bits), cross.to_array().map(f64::to_bits));
        let squared = (a.x * a.x + a.y * a.y) + a.z * a.z;
        assert_eq!(a.length().to_bits(), squared.sqrt().to_bits());
        let (a, b) = (Vec3A::new(0.1, 0.7, -1.3), Vec3A::new(1.0 / 3.0, 2.1, 0.9));
        assert_eq!(a.dot(b).to_bits(), ((a.x * b.x + a.y * b.y) + a.z * b.z).to_bits());
        assert_eq!(Vec3::from(a).dot(b.into()).to_bits(), a.dot(b).to_bits());
        let m = DAffine3::from_mat3_translation(
            DMat3::from_cols_array(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0]),
            DVec3::new(0.3, 0.1, 7.0),
        );
        let p = m.transform_point3(DVec3::new(0.1, 0.7, -1.3));
        let x = ((0.1 * 0.1 + 0.4 * 0.7) + 0.7 * -1.3) + 0.3;
        assert_eq!(p.x.to_bits(), f64::to_bits(x));
        assert_eq!(DVec2::new(0.1, 0.7).dot(DVec2::new(0.3, 0.9)).to_bits(), (0.1f64 * 0.3 + 0.7 * 0.9).to_bits());
    }

    /// The bits of libm's functions, of which exp is one unit in the last place off at 1.
    #[test]
    fn transcendental_functions_are_those_of_libm() {
        assert_eq!(sin(1.0), 0.841_470_984_807_896_5);
        assert_eq!(cos(1.0), 0.540_302_305_868_139_8);
        assert_eq!(tan(0.5), 0.546_302_489_843_790_5);
        assert_eq!(atan2(1.0, -2.0), 2.677_945_044_588_987);
        assert_eq!(exp(1.0), std::f64::consts::E.next_up());
        assert_eq!(pow(2.0, 0.5), std::f64::consts::SQRT_2);
    }

    #[test]
    fn orthonormal_bases_are_orthonormal_and_right_handed() {
        let mut n = DVec3::new(0.0, 0.0, -1.0);
        for step in 0..1000 {
            let (t, b) = orthonormal_basis(n);
            assert!((t.cross(b) - n).length() < 1e-15 && t.dot(b).abs() < 1e-15, "{n}");
            assert!((t.length() - 1.0).abs() < 1e-15 && (b.length() - 1.0).abs() < 1e-15, "{n}");
            let angle = f64::from(step);
            n = DVec3::new(sin(angle), cos(angle * 1.7), sin(angle * 0.3) * 0.5 - 0.3).normalize();
        }
    }
}
