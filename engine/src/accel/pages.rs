//! Memory for large trees: in large pages, where the system has them, so that a walk does not wait for addresses to be translated. All threads of the caller's pool fill it: a
//! system takes long to hand out pages.

use rayon::prelude::*;

/// `f` of all numbers below `count`, in memory that is as large as they are.
pub fn fill<T: Send>(count: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    let mut all = Vec::with_capacity(count);
    ask_for_large_pages(&mut all);
    all.par_extend((0..count).into_par_iter().with_min_len((1 << 20) / size_of::<T>().max(1)).map(f));
    all
}

/// The same values.
pub fn settle<T: Copy + Send + Sync>(from: Vec<T>) -> Vec<T> {
    fill(from.len(), |at| from[at])
}

#[cfg(target_os = "linux")]
fn ask_for_large_pages<T>(memory: &mut Vec<T>) {
    use rustix::mm::{Advice, madvise};
    const PAGE: usize = 2 << 20;
    let bytes = memory.capacity() * size_of::<T>();
    let start = memory.as_mut_ptr().cast::<u8>();
    let skipped = start.align_offset(PAGE);
    let whole = bytes.saturating_sub(skipped) / PAGE * PAGE;
    if whole > 0 {
        // Where it is refused, pages stay small.
        // SAFETY: the range lies in the vector's own memory, and the advice changes nothing of what that holds.
        let _: rustix::io::Result<()> = unsafe { madvise(start.add(skipped).cast(), whole, Advice::LinuxHugepage) };
    }
}

#[cfg(not(target_os = "linux"))]
fn ask_for_large_pages<T>(_: &mut Vec<T>) {}

/// Asks memory for some lines of the processor's cache, which begin with `at` and need not be there.
#[inline(always)]
pub fn prefetch<const LINES: usize>(at: *const u8) {
    #[cfg(target_arch = "x86_64")]
    for line in 0..LINES {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: it reads nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(at.wrapping_add(64 * line).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = at;
}
