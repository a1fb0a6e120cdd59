//! Work on many things at a time, on all threads of the pool that the caller is in. What comes out does not depend on their number.

use rayon::prelude::*;

/// Fewer things are not worth waking a thread for.
const FEW: usize = 1 << 13;

/// `f` of all numbers below `count`, in order.
pub fn map<R: Send>(count: usize, f: impl Fn(usize) -> R + Sync + Send) -> Vec<R> {
    map_with(count, || (), |(), at| f(at))
}

/// The same with room that each thread makes for itself.
pub fn map_with<S, R: Send>(count: usize, room: impl Fn() -> S + Sync + Send, f: impl Fn(&mut S, usize) -> R + Sync + Send) -> Vec<R> {
    if count < FEW {
        let mut room = room();
        return (0..count).map(|at| f(&mut room, at)).collect();
    }
    (0..count).into_par_iter().with_min_len(FEW / 8).map_init(room, f).collect()
}

/// `f` of the place where each chunk of this size begins, and of the chunk, in order.
pub fn map_chunks<T: Send, R: Send>(all: &mut [T], size: usize, f: impl Fn(usize, &mut [T]) -> R + Sync + Send) -> Vec<R> {
    if all.len() <= size {
        return all.chunks_mut(size).map(|chunk| f(0, chunk)).collect();
    }
    all.par_chunks_mut(size).enumerate().map(|(at, chunk)| f(at * size, chunk)).collect()
}

/// Sorts what has no equals.
pub fn sort<T: Ord + Send>(all: &mut [T]) {
    if all.len() < FEW { all.sort_unstable() } else { all.par_sort_unstable() }
}
