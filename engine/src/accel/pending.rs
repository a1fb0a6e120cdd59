//! What is still to be visited on a walk through a tree.

use std::mem::MaybeUninit;

use super::{node::Node, simd::Lanes, traverse::MAX_DEPTH};

/// Children of a node that are left to visit.
pub trait Left<L: Lanes>: Copy {
    /// Those that are entered before they are left.
    ///
    /// # Safety
    /// The processor has the instructions of `L`, here and below.
    unsafe fn of(enter: L, leave: L) -> Self;
    /// The next: the upper half of the bits of its distance, and its place, below 8.
    unsafe fn next(self) -> (i32, usize);
    /// All but the next, which is at this place.
    unsafe fn rest(self, next: usize) -> Self;
    /// Whether there are none.
    unsafe fn is_empty(self) -> bool;
}

/// Nearest first.
#[derive(Clone, Copy)]
pub struct Nearest<K>(K);

/// In any order: distances do not matter where nothing that is found brings the limit nearer.
#[derive(Clone, Copy)]
pub struct Unordered(u32);

impl<L: Lanes> Left<L> for Nearest<L::Keys> {
    #[inline(always)]
    unsafe fn of(enter: L, leave: L) -> Self {
        // Adding 0 takes its sign from -0, which would order last.
        // SAFETY: by the trait's condition, as below.
        unsafe { Self(enter.add(L::splat(0.0)).keys(leave)) }
    }

    #[inline(always)]
    unsafe fn next(self) -> (i32, usize) {
        // SAFETY: see above.
        let (key, place) = unsafe { L::least(self.0) };
        (key.cast_signed(), place)
    }

    #[inline(always)]
    unsafe fn rest(self, next: usize) -> Self {
        // SAFETY: see above.
        unsafe { Self(L::without(self.0, next)) }
    }

    #[inline(always)]
    unsafe fn is_empty(self) -> bool {
        // SAFETY: see above.
        unsafe { L::is_empty(self.0) }
    }
}

impl<L: Lanes> Left<L> for Unordered {
    #[inline(always)]
    unsafe fn of(enter: L, leave: L) -> Self {
        // SAFETY: by the trait's condition.
        Self(unsafe { enter.le(leave) })
    }

    #[inline(always)]
    unsafe fn next(self) -> (i32, usize) {
        (0, self.0.trailing_zeros() as usize & 7)
    }

    #[inline(always)]
    unsafe fn rest(self, _: usize) -> Self {
        Self(self.0 & self.0.wrapping_sub(1))
    }

    #[inline(always)]
    unsafe fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// For each node on the way down that has children left to visit: which.
pub struct Pending<R> {
    left: [MaybeUninit<R>; MAX_DEPTH],
    nodes: [MaybeUninit<*const Node>; MAX_DEPTH],
    height: usize,
}

/// A child: the node that it is of, and its place there.
#[derive(Clone, Copy)]
pub struct Child {
    pub node: *const Node,
    pub place: usize,
}

impl<R: Copy> Pending<R> {
    /// Nothing.
    #[inline(always)]
    pub fn new() -> Self {
        Self { left: [const { MaybeUninit::uninit() }; MAX_DEPTH], nodes: [const { MaybeUninit::uninit() }; MAX_DEPTH], height: 0 }
    }

    /// Forgets everything.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.height = 0;
    }

    /// Adds the children of a node, if `some`: without a branch, of which nobody could foretell the way.
    ///
    /// # Safety
    /// There is place: at most `MAX_DEPTH` nodes are on the way down.
    #[inline(always)]
    pub unsafe fn push(&mut self, node: *const Node, left: R, some: bool) {
        // SAFETY: by this function's own condition.
        unsafe {
            self.left.get_unchecked_mut(self.height).write(left);
            self.nodes.get_unchecked_mut(self.height).write(node);
        }
        self.height += usize::from(some);
    }

    /// Takes the nearest child of the lowest node that has one before `limit`; none is before a negative one.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn pop<L: Lanes>(&mut self, limit: f32) -> Option<Child>
    where
        R: Left<L>,
    {
        let limit = limit.to_bits().cast_signed() >> 16;
        while self.height > 0 {
            let top = self.height - 1;
            // SAFETY: what is below the height was written.
            unsafe {
                let slot = self.left.get_unchecked_mut(top);
                let (key, place) = slot.assume_init().next();
                if key <= limit {
                    let rest = slot.assume_init().rest(place);
                    slot.write(rest);
                    self.height -= usize::from(rest.is_empty());
                    return Some(Child { node: self.nodes.get_unchecked(top).assume_init(), place });
                }
            }
            self.height = top;
        }
        None
    }
}

impl Child {
    /// What its reference is.
    ///
    /// # Safety
    /// Its node is there.
    #[inline(always)]
    pub unsafe fn reference(self) -> u32 {
        // SAFETY: by this function's own condition.
        unsafe { *(*self.node).children.get_unchecked(self.place) }
    }
}
