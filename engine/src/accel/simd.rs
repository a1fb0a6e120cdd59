//! Eight f32 at a time: AVX2, SSE2 in halves, or plain arrays elsewhere. All give identical bits: no operation is fused or approximate.

/// Which instructions a scene is traversed with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Simd {
    /// 256 bits at a time.
    Avx2,
    /// What every machine of the architecture has.
    Baseline,
}

impl Simd {
    /// The best that this machine has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("bmi1") {
            return Self::Avx2;
        }
        Self::Baseline
    }
}

/// Eight f32.
///
/// # Safety
/// Every function needs the instructions of its type; they are inlined into functions that enable them.
pub(crate) trait Lanes: Copy {
    unsafe fn load(from: &[f32; 8]) -> Self;
    unsafe fn splat(x: f32) -> Self;
    unsafe fn store(self, to: &mut [f32; 8]);
    unsafe fn add(self, o: Self) -> Self;
    unsafe fn sub(self, o: Self) -> Self;
    unsafe fn mul(self, o: Self) -> Self;
    unsafe fn min(self, o: Self) -> Self;
    unsafe fn max(self, o: Self) -> Self;
    unsafe fn abs(self) -> Self;
    /// Bit i is set where `self[i] <= o[i]`.
    unsafe fn le(self, o: Self) -> u32;
}

#[cfg(target_arch = "x86_64")]
// One argument holds for all functions of a type, and stands there.
#[allow(clippy::undocumented_unsafe_blocks)]
mod x86 {
    use super::Lanes;
    use std::arch::x86_64::*;

    // SAFETY of all functions: the caller enables AVX2, as the trait demands; loads and stores stay within their arrays.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx2(__m256);

    #[rustfmt::skip]
    impl Lanes for Avx2 {
        #[inline(always)] unsafe fn load(from: &[f32; 8]) -> Self { unsafe { Self(_mm256_loadu_ps(from.as_ptr())) } }
        #[inline(always)] unsafe fn splat(x: f32) -> Self { unsafe { Self(_mm256_set1_ps(x)) } }
        #[inline(always)] unsafe fn store(self, to: &mut [f32; 8]) { unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) } }
        #[inline(always)] unsafe fn add(self, o: Self) -> Self { unsafe { Self(_mm256_add_ps(self.0, o.0)) } }
        #[inline(always)] unsafe fn sub(self, o: Self) -> Self { unsafe { Self(_mm256_sub_ps(self.0, o.0)) } }
        #[inline(always)] unsafe fn mul(self, o: Self) -> Self { unsafe { Self(_mm256_mul_ps(self.0, o.0)) } }
        #[inline(always)] unsafe fn min(self, o: Self) -> Self { unsafe { Self(_mm256_min_ps(self.0, o.0)) } }
        #[inline(always)] unsafe fn max(self, o: Self) -> Self { unsafe { Self(_mm256_max_ps(self.0, o.0)) } }
        #[inline(always)] unsafe fn abs(self) -> Self { unsafe { Self(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)) } }
        #[inline(always)] unsafe fn le(self, o: Self) -> u32 { unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, o.0)) as u32 } }
    }

    // SAFETY of all functions: SSE2 is part of x86_64; loads and stores stay within their arrays.
    #[derive(Clone, Copy)]
    pub(crate) struct Baseline(__m128, __m128);

    #[rustfmt::skip]
    impl Lanes for Baseline {
        #[inline(always)] unsafe fn load(from: &[f32; 8]) -> Self { unsafe { Self(_mm_loadu_ps(from.as_ptr()), _mm_loadu_ps(from.as_ptr().add(4))) } }
        #[inline(always)] unsafe fn splat(x: f32) -> Self { unsafe { Self(_mm_set1_ps(x), _mm_set1_ps(x)) } }
        #[inline(always)] unsafe fn store(self, to: &mut [f32; 8]) { unsafe { _mm_storeu_ps(to.as_mut_ptr(), self.0); _mm_storeu_ps(to.as_mut_ptr().add(4), self.1); } }
        #[inline(always)] unsafe fn add(self, o: Self) -> Self { unsafe { Self(_mm_add_ps(self.0, o.0), _mm_add_ps(self.1, o.1)) } }
        #[inline(always)] unsafe fn sub(self, o: Self) -> Self { unsafe { Self(_mm_sub_ps(self.0, o.0), _mm_sub_ps(self.1, o.1)) } }
        #[inline(always)] unsafe fn mul(self, o: Self) -> Self { unsafe { Self(_mm_mul_ps(self.0, o.0), _mm_mul_ps(self.1, o.1)) } }
        #[inline(always)] unsafe fn min(self, o: Self) -> Self { unsafe { Self(_mm_min_ps(self.0, o.0), _mm_min_ps(self.1, o.1)) } }
        #[inline(always)] unsafe fn max(self, o: Self) -> Self { unsafe { Self(_mm_max_ps(self.0, o.0), _mm_max_ps(self.1, o.1)) } }
        #[inline(always)] unsafe fn abs(self) -> Self { unsafe { let s = _mm_set1_ps(-0.0); Self(_mm_andnot_ps(s, self.0), _mm_andnot_ps(s, self.1)) } }
        #[inline(always)] unsafe fn le(self, o: Self) -> u32 { unsafe { (_mm_movemask_ps(_mm_cmple_ps(self.0, o.0)) | _mm_movemask_ps(_mm_cmple_ps(self.1, o.1)) << 4) as u32 } }
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{Avx2, Baseline};

#[cfg(not(target_arch = "x86_64"))]
mod portable {
    use super::Lanes;

    #[derive(Clone, Copy)]
    pub(crate) struct Baseline([f32; 8]);

    impl Baseline {
        #[inline(always)]
        fn zip(self, o: Self, f: impl Fn(f32, f32) -> f32) -> Self {
            Self(std::array::from_fn(|i| f(self.0[i], o.0[i])))
        }
    }

    // SAFETY of all functions: they are plain arithmetic.
    #[rustfmt::skip]
    impl Lanes for Baseline {
        #[inline(always)] unsafe fn load(from: &[f32; 8]) -> Self { Self(*from) }
        #[inline(always)] unsafe fn splat(x: f32) -> Self { Self([x; 8]) }
        #[inline(always)] unsafe fn store(self, to: &mut [f32; 8]) { *to = self.0 }
        #[inline(always)] unsafe fn add(self, o: Self) -> Self { self.zip(o, |a, b| a + b) }
        #[inline(always)] unsafe fn sub(self, o: Self) -> Self { self.zip(o, |a, b| a - b) }
        #[inline(always)] unsafe fn mul(self, o: Self) -> Self { self.zip(o, |a, b| a * b) }
        #[inline(always)] unsafe fn min(self, o: Self) -> Self { self.zip(o, |a, b| if a < b { a } else { b }) }
        #[inline(always)] unsafe fn max(self, o: Self) -> Self { self.zip(o, |a, b| if a > b { a } else { b }) }
        #[inline(always)] unsafe fn abs(self) -> Self { Self(self.0.map(f32::abs)) }
        #[inline(always)] unsafe fn le(self, o: Self) -> u32 { (0..8).fold(0, |bits, i| bits | u32::from(self.0[i] <= o.0[i]) << i) }
    }
}

#[cfg(not(target_arch = "x86_64"))]
pub(crate) use portable::Baseline;
