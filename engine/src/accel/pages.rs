//! Memory for large trees: in large pages, where the system has them, so that a walk does not wait for addresses to be translated.

use rayon::prelude::*;

/// The same values, in memory of their own that is as large as they are. All threads of the caller's pool copy: a system takes long to hand out pages.
pub fn settle<T: Copy + Send + Sync>(from: Vec<T>) -> Vec<T> {
    let mut to = Vec::with_capacity(from.len());
    ask_for_large_pages(&mut to);
    to.par_extend(from.par_iter().with_min_len((1 << 20) / size_of::<T>()));
    to
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
