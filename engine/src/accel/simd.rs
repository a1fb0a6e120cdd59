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
/// Every function needs the instructions of its type; they are inlined into functions that enable them. Closures that are given to functions of the standard library
/// (`map`, `fold`) may be compiled without these instructions, each of which is then a call: loops instead.
pub(crate) trait Lanes: Copy {
    unsafe fn load(from: &[f32; 8]) -> Self;
    unsafe fn splat(x: f32) -> Self;
    /// Each of the first three in all lanes.
    #[inline(always)]
    unsafe fn splats<const N: usize>(v: &[f32; N]) -> [Self; 3] {
        // SAFETY: by this function's own condition.
        unsafe { [Self::splat(v[0]), Self::splat(v[1]), Self::splat(v[2])] }
    }
    unsafe fn store(self, to: &mut [f32; 8]);
    unsafe fn add(self, o: Self) -> Self;
    unsafe fn sub(self, o: Self) -> Self;
    unsafe fn mul(self, o: Self) -> Self;
    unsafe fn min(self, o: Self) -> Self;
    unsafe fn max(self, o: Self) -> Self;
    unsafe fn abs(self) -> Self;
    /// With the sign turned where `o` has one.
    unsafe fn signed(self, o: Self) -> Self;
    /// Bit i is set where `self[i] <= o[i]`.
    unsafe fn le(self, o: Self) -> u32;
    /// Eight distances, each cut to the upper half of its bits: they order as the distances do, but for some that are nearly the same.
    type Keys: Copy;
    /// Of all `self[i]` that are not above `o[i]`, none of which has a sign; all bits are set for the others.
    unsafe fn keys(self, o: Self) -> Self::Keys;
    /// The least key and its place, below 8.
    unsafe fn least(keys: Self::Keys) -> (u32, usize);
    /// The keys but for that of one place, below 8.
    unsafe fn without(keys: Self::Keys, place: usize) -> Self::Keys;
    /// Whether no key is left.
    unsafe fn is_empty(keys: Self::Keys) -> bool;
}

/// `TAKEN[i]` has all bits of place i.
const TAKEN: [[u16; 8]; 8] = {
    let mut taken = [[0; 8]; 8];
    let mut i = 0;
    while i < 8 {
        taken[i][i] = 0xffff;
        i += 1;
    }
    taken
};

#[cfg(target_arch = "x86_64")]
// One argument holds for all functions of a type, and stands there.
#[allow(clippy::undocumented_unsafe_blocks)]
mod x86 {
    use super::{Lanes, TAKEN};
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
        #[inline(always)] unsafe fn signed(self, o: Self) -> Self { unsafe { Self(_mm256_xor_ps(self.0, _mm256_and_ps(_mm256_set1_ps(-0.0), o.0))) } }
        #[inline(always)] unsafe fn abs(self) -> Self { unsafe { Self(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)) } }
        #[inline(always)] unsafe fn le(self, o: Self) -> u32 { unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, o.0)) as u32 } }
        type Keys = __m128i;
        #[inline(always)] unsafe fn keys(self, o: Self) -> __m128i { unsafe {
            let all = _mm256_castps_si256(_mm256_or_ps(self.0, _mm256_cmp_ps::<_CMP_NLE_UQ>(self.0, o.0)));
            let upper = _mm256_srli_epi32::<16>(all);
            _mm_packus_epi32(_mm256_castsi256_si128(upper), _mm256_extracti128_si256::<1>(upper))
        } }
        #[inline(always)] unsafe fn least(keys: __m128i) -> (u32, usize) { unsafe {
            let found = _mm_cvtsi128_si32(_mm_minpos_epu16(keys)) as u32;
            (found & 0xffff, (found >> 16) as usize)
        } }
        #[inline(always)] unsafe fn without(keys: __m128i, place: usize) -> __m128i { unsafe { _mm_or_si128(keys, _mm_loadu_si128(TAKEN.as_ptr().add(place).cast())) } }
        #[inline(always)] unsafe fn is_empty(keys: __m128i) -> bool { unsafe { _mm_test_all_ones(keys) != 0 } }
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
        #[inline(always)] unsafe fn signed(self, o: Self) -> Self { unsafe { let s = _mm_set1_ps(-0.0); Self(_mm_xor_ps(self.0, _mm_and_ps(s, o.0)), _mm_xor_ps(self.1, _mm_and_ps(s, o.1))) } }
        #[inline(always)] unsafe fn abs(self) -> Self { unsafe { let s = _mm_set1_ps(-0.0); Self(_mm_andnot_ps(s, self.0), _mm_andnot_ps(s, self.1)) } }
        #[inline(always)] unsafe fn le(self, o: Self) -> u32 { unsafe { (_mm_movemask_ps(_mm_cmple_ps(self.0, o.0)) | _mm_movemask_ps(_mm_cmple_ps(self.1, o.1)) << 4) as u32 } }
        type Keys = __m128i;
        #[inline(always)] unsafe fn keys(self, o: Self) -> __m128i { unsafe {
            let half = |a: __m128, b: __m128| _mm_srai_epi32::<16>(_mm_castps_si128(_mm_or_ps(a, _mm_cmpnle_ps(a, b))));
            _mm_packs_epi32(half(self.0, o.0), half(self.1, o.1))
        } }
        #[inline(always)] unsafe fn least(keys: __m128i) -> (u32, usize) { unsafe {
            // Distances are not negative: with their sign, keys that are taken would come first, and so lose it here.
            let low = _mm_andnot_si128(_mm_set1_epi16(i16::MIN), keys);
            let m = _mm_min_epi16(low, _mm_shuffle_epi32::<0b01_00_11_10>(low));
            let m = _mm_min_epi16(m, _mm_shuffle_epi32::<0b10_11_00_01>(m));
            let m = _mm_min_epi16(m, _mm_or_si128(_mm_srli_epi32::<16>(m), _mm_slli_epi32::<16>(m)));
            let place = (_mm_movemask_epi8(_mm_cmpeq_epi16(low, m)) as u32).trailing_zeros() as usize / 2;
            let key = _mm_cvtsi128_si32(m) as u32 & 0x7fff;
            (if key == 0x7fff { 0xffff } else { key }, place)
        } }
        #[inline(always)] unsafe fn without(keys: __m128i, place: usize) -> __m128i { unsafe { _mm_or_si128(keys, _mm_loadu_si128(TAKEN.as_ptr().add(place).cast())) } }
        #[inline(always)] unsafe fn is_empty(keys: __m128i) -> bool { unsafe { _mm_movemask_epi8(_mm_cmpeq_epi16(keys, _mm_set1_epi16(-1))) == 0xffff } }
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{Avx2, Baseline};

#[cfg(any(not(target_arch = "x86_64"), test))]
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
        #[inline(always)] unsafe fn signed(self, o: Self) -> Self { self.zip(o, |a, b| f32::from_bits(a.to_bits() ^ (b.to_bits() & 1 << 31))) }
        type Keys = [u16; 8];
        #[inline(always)] unsafe fn keys(self, o: Self) -> [u16; 8] { std::array::from_fn(|i| if self.0[i] <= o.0[i] { (self.0[i].to_bits() >> 16) as u16 } else { u16::MAX }) }
        #[inline(always)] unsafe fn least(keys: [u16; 8]) -> (u32, usize) { (1..8).fold((keys[0].into(), 0), |(least, place), i| if u32::from(keys[i]) < least { (keys[i].into(), i) } else { (least, place) }) }
        #[inline(always)] unsafe fn without(mut keys: [u16; 8], place: usize) -> [u16; 8] { keys[place & 7] = u16::MAX; keys }
        #[inline(always)] unsafe fn is_empty(keys: [u16; 8]) -> bool { keys == [u16::MAX; 8] }
        #[inline(always)] unsafe fn le(self, o: Self) -> u32 { (0..8).fold(0, |bits, i| bits | u32::from(self.0[i] <= o.0[i]) << i) }
    }
}

#[cfg(not(target_arch = "x86_64"))]
pub(crate) use portable::Baseline;

#[cfg(test)]
mod tests {
    use super::*;

    /// What a kind of lanes makes of two rows: every operation, and the order in which keys come.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    unsafe fn outcome<L: Lanes>(a: &[f32; 8], b: &[f32; 8]) -> (Vec<u32>, Vec<(u32, usize)>) {
        // SAFETY: by this function's own condition.
        unsafe {
            let (x, y) = (L::load(a), L::load(b));
            let rows = [x.add(y), x.sub(y), x.mul(y), x.min(y), x.max(y), x.abs(), x.signed(y), L::splat(a[3])];
            let mut bits = vec![x.le(y)];
            for row in rows {
                let mut out = [0.0; 8];
                row.store(&mut out);
                // Which NaN it is, nobody promises.
                bits.extend(out.map(|x| if x.is_nan() { u32::MAX } else { x.to_bits() }));
            }
            let (mut keys, mut order) = (x.abs().keys(y), Vec::new());
            while !L::is_empty(keys) {
                order.push(L::least(keys));
                keys = L::without(keys, L::least(keys).1);
            }
            (bits, order)
        }
    }

    #[test]
    fn all_kinds_of_lanes_do_the_same() {
        let values = [0.0, -0.0, 1.0, -1.0, 1.5, 3e38, -3e38, 1e-40, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.3, 0.300_000_1, 7.0];
        for i in 0..2_000usize {
            let row = |step: usize| std::array::from_fn(|lane| values[(i * step + lane * lane + i / (lane + 3)) % values.len()]);
            let (a, b) = (row(5), row(11));
            // SAFETY: every machine has the first two, and this one the last, where it is asked for.
            unsafe {
                let plain = outcome::<portable::Baseline>(&a, &b);
                assert_eq!(outcome::<Baseline>(&a, &b), plain, "{a:?} {b:?}");
                #[cfg(target_arch = "x86_64")]
                if Simd::detect() == Simd::Avx2 {
                    assert_eq!(outcome::<Avx2>(&a, &b), plain, "{a:?} {b:?}");
                }
            }
        }
    }
}
