//! Rays through one tree in turns: while one waits for memory, the others compute.

use std::mem::MaybeUninit;

use super::{
    block::Place,
    entry::Entered,
    node::{LEAF, Node},
    pack::Pack,
    pages::prefetch,
    pending::{Left, Pending},
    simd::Lanes,
    stream::Stream,
    visitor::Visitor,
};

/// Rays under way at a time: so many that branches that go another way at the end of a queue are few, and so few that all stay close to the processor.
pub const WALKERS: usize = 32;

/// A ray under way.
struct Walker<R> {
    ray: usize,
    at: Place,
    /// See [`Block::near`](super::block::Block::near).
    near: [usize; 3],
    /// What it visits next.
    current: u32,
    pending: Pending<R>,
}

/// Places of walkers, first in, first out.
struct Queue {
    places: [u8; WALKERS],
    first: usize,
    end: usize,
}

/// So that numbers of places wrap without a division.
const _: () = assert!(WALKERS.is_power_of_two());

impl Queue {
    const EMPTY: Self = Self { places: [0; WALKERS], first: 0, end: 0 };

    /// Adds a place, if it is to be here.
    #[inline(always)]
    fn add(&mut self, place: usize, here: bool) {
        self.places[self.end % WALKERS] = place as u8;
        self.end += usize::from(here);
    }

    /// Takes the first.
    #[inline(always)]
    fn take(&mut self) -> Option<usize> {
        if self.first == self.end {
            return None;
        }
        let place = self.places[self.first % WALKERS];
        self.first += 1;
        Some(place.into())
    }
}

/// Places of walkers that are about to visit a node, and of those about to visit a leaf: kept apart so that no branch depends on which it is, of which nobody could
/// foretell the way.
struct Turns {
    inner: Queue,
    leaf: Queue,
}

impl Turns {
    /// Notes what a walker visits next, and asks memory for it.
    #[inline(always)]
    fn note(&mut self, place: usize, current: u32, nodes: &[Node], packs: &[Pack]) {
        let is_leaf = current & LEAF != 0;
        self.inner.add(place, !is_leaf);
        self.leaf.add(place, is_leaf);
        let (base, size) =
            if is_leaf { (packs.as_ptr().cast::<u8>(), size_of::<Pack>()) } else { (nodes.as_ptr().cast(), size_of::<Node>()) };
        prefetch::<4>(base.wrapping_add((current & !LEAF) as usize * size));
    }
}

impl<V: Visitor> Stream<'_, V> {
    /// Leads rays of the block, given by their numbers, through the tree.
    ///
    /// # Safety
    /// The processor has the instructions of `L`. The numbers are below the block's count, and those of rays that have entered, if any have.
    #[inline(always)]
    pub unsafe fn interleave<L: Lanes, R: Left<L>, const ANY: bool>(&mut self, numbers: &[u8], entered: Option<&Entered<R>>) {
        let mut walkers = [const { MaybeUninit::<Walker<R>>::uninit() }; WALKERS];
        let (mut turns, mut begun) = (Turns { inner: Queue::EMPTY, leaf: Queue::EMPTY }, 0);
        // SAFETY: places of walkers that began are noted, each in one queue. They visit nodes and leaves of this tree, and are never deeper in it than `MAX_DEPTH`.
        unsafe {
            while begun < WALKERS.min(numbers.len()) {
                let place = begun;
                let walker = walkers.get_unchecked_mut(place).write(Walker {
                    ray: 0,
                    at: Place::default(),
                    near: [0; 3],
                    current: 0,
                    pending: Pending::new(),
                });
                self.begin::<L, R, ANY>(walker, place, numbers, &mut begun, entered);
                turns.note(place, walker.current, self.nodes, self.packs);
            }
            // Each kind until none is left, as to turn to the other one costs a branch that goes another way.
            while turns.inner.first != turns.inner.end || turns.leaf.first != turns.leaf.end {
                while let Some(place) = turns.inner.take() {
                    let walker = walkers.get_unchecked_mut(place).assume_init_mut();
                    if self.step::<L, R>(walker) || self.go_on::<L, R, ANY>(walker, place, numbers, &mut begun, entered) {
                        turns.note(place, walker.current, self.nodes, self.packs);
                    }
                }
                while let Some(place) = turns.leaf.take() {
                    let walker = walkers.get_unchecked_mut(place).assume_init_mut();
                    self.visit::<L, ANY>(walker.current & !LEAF, walker.ray, place);
                    if self.go_on::<L, R, ANY>(walker, place, numbers, &mut begun, entered) {
                        turns.note(place, walker.current, self.nodes, self.packs);
                    }
                }
            }
        }
    }

    /// Visits a node; whether a child is met, which is then next.
    ///
    /// # Safety
    /// The walker is at a node of the tree. The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn step<L: Lanes, R: Left<L>>(&self, walker: &mut Walker<R>) -> bool {
        let block = &*self.block;
        // SAFETY: by this function's own condition; the ray is one of the block.
        unsafe {
            let node = self.nodes.get_unchecked(walker.current as usize);
            let [origin, inverse_near, inverse_far] = block.ray::<L>(walker.at);
            let limit = L::splat(block.limit_of(walker.at));
            let (enter, leave) = node.meet(walker.near, [origin, inverse_near], [origin, inverse_far], limit);
            let met = R::of(enter, leave);
            let (_, next) = met.next();
            let rest = met.rest(next);
            walker.pending.push(node, rest, !rest.is_empty());
            walker.current = *node.children.get_unchecked(next);
            !met.is_empty()
        }
    }

    /// Finds what a walker that met nothing visits next, perhaps with another ray; whether there is anything.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn go_on<L: Lanes, R: Left<L>, const ANY: bool>(
        &mut self,
        walker: &mut Walker<R>,
        place: usize,
        numbers: &[u8],
        begun: &mut usize,
        entered: Option<&Entered<R>>,
    ) -> bool {
        // SAFETY: by this function's own condition; the ray is one of the block, and pending are children of this tree's nodes.
        unsafe {
            match walker.pending.pop::<L>(self.block.limit_of(walker.at)) {
                Some(child) => walker.current = child.reference(),
                None if *begun < numbers.len() => self.begin::<L, R, ANY>(walker, place, numbers, begun, entered),
                None => return false,
            }
        }
        true
    }

    /// Gives a walker the next ray.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn begin<L: Lanes, R: Left<L>, const ANY: bool>(
        &mut self,
        walker: &mut Walker<R>,
        place: usize,
        numbers: &[u8],
        begun: &mut usize,
        entered: Option<&Entered<R>>,
    ) {
        walker.ray = numbers[*begun].into();
        *begun += 1;
        walker.at = Place::of(walker.ray);
        walker.near = self.block.near(walker.ray);
        walker.current = self.root;
        walker.pending.clear();
        if ANY {
            self.block.told[place].clear();
        }
        if let Some(entered) = entered {
            // SAFETY: by this function's own condition.
            walker.current = unsafe { entered.first(walker.ray, &mut walker.pending) };
        }
    }
}
