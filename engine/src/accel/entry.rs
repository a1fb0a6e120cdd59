//! Where the rays of a block enter a tree: rays that end near where they start, near one another, need not come down from its root (after Reshetov, Soupikov, Hurley,
//! "Multi-Level Ray Tracing Algorithm", 2005).

use std::mem::MaybeUninit;

use super::{
    block::{Block, Place, SIZE},
    frame::OUTWARD,
    node::Node,
    packet::range,
    pending::{Left, Pending},
    simd::Lanes,
};

/// Most that a block may measure along a side, the tree's side being 2: what is larger meets as much of the tree as its root.
const LARGEST: f32 = 0.5;

/// Added to a block's box on every side: covers the rounding of ends, as `OUTWARD` does that of origins.
const MARGIN: f32 = 2.0 * OUTWARD;

/// A node whose children are all that the rays of a block may meet, as deep in the tree as eight of them go.
pub struct Entry(pub Node);

impl Entry {
    /// `None` for rays that go far.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn of<L: Lanes>(nodes: &[Node], root: u32, block: &Block) -> Option<Self> {
        let mut opened = nodes.get(root as usize)?;
        // SAFETY: by this function's own condition, as below.
        let reach = unsafe { Reach::of::<L>(block) }?;
        // SAFETY: see above.
        let mut met = unsafe { reach.overlaps::<L>(opened) };
        // Of which nodes its children are, and their places there.
        let (mut children, mut count, mut tried) = ([(opened, 0); 8], 0, 0);
        loop {
            while met != 0 {
                children[count] = (opened, met.trailing_zeros() as usize);
                count += 1;
                met &= met - 1;
            }
            // The next that has few enough children there gives place to them.
            loop {
                if tried == count {
                    return Some(Self(node_of(&children[..count])));
                }
                let (of, place) = children[tried];
                if let Some(node) = nodes.get(of.children[place] as usize) {
                    // SAFETY: see above.
                    met = unsafe { reach.overlaps::<L>(node) };
                    if count - 1 + met.count_ones() as usize <= 8 {
                        opened = node;
                        break;
                    }
                }
                tried += 1;
            }
            count -= 1;
            children[tried] = children[count];
        }
    }

    /// What each of some rays of the block, given by their numbers, meets of it; takes those away that meet nothing.
    ///
    /// # Safety
    /// The processor has the instructions of `L`. The numbers are below the block's count.
    #[inline(always)]
    pub unsafe fn enter<'n, L: Lanes, R: Left<L>>(self, block: &Block, numbers: &'n mut [u8]) -> (Entered<R>, &'n [u8]) {
        let mut entered = Entered { node: self.0, met: [const { MaybeUninit::uninit() }; SIZE] };
        let mut count = 0;
        for at in 0..numbers.len() {
            let number = numbers[at];
            let ray = usize::from(number);
            // SAFETY: by this function's own condition.
            unsafe {
                let place = Place::of(ray);
                let [origin, inverse_near, inverse_far] = block.ray::<L>(place);
                let limit = L::splat(block.limit_of(place));
                let (enter, leave) = entered.node.meet(block.near(ray), [origin, inverse_near], [origin, inverse_far], limit);
                let met = R::of(enter, leave);
                entered.met[ray].write(met);
                numbers[count] = number;
                count += usize::from(!met.is_empty());
            }
        }
        (entered, &numbers[..count])
    }
}

/// Rays that have entered.
pub struct Entered<R> {
    node: Node,
    met: [MaybeUninit<R>; SIZE],
}

impl<R: Copy> Entered<R> {
    /// What a ray visits first; the rest is left pending.
    ///
    /// # Safety
    /// The ray is one of those that met something. The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn first<L: Lanes>(&self, ray: usize, pending: &mut Pending<R>) -> u32
    where
        R: Left<L>,
    {
        // SAFETY: by this function's own condition.
        unsafe {
            let met = self.met.get_unchecked(ray).assume_init();
            let (_, next) = met.next();
            let rest = met.rest(next);
            pending.push(&self.node, rest, !rest.is_empty());
            *self.node.children.get_unchecked(next)
        }
    }
}

/// A node of children of others, given with their places there.
#[inline(always)]
fn node_of(children: &[(&Node, usize)]) -> Node {
    let mut made = Node::EMPTY;
    for (at, &(of, place)) in children.iter().enumerate() {
        for (from, to) in of.bounds.iter().zip(&mut made.bounds) {
            to[at] = from[place];
        }
        made.children[at] = of.children[place];
    }
    made
}

/// A box around all that the rays of a block may meet.
struct Reach {
    min: [f32; 3],
    max: [f32; 3],
}

impl Reach {
    /// `None` where it is large, or boxes cannot tell what a ray meets.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn of<L: Lanes>(block: &Block) -> Option<Self> {
        let mut reach = Self { min: [0.0; 3], max: [0.0; 3] };
        // SAFETY: by this function's own condition.
        unsafe {
            let (mut min, mut max) = ([L::splat(f32::INFINITY); 3], [L::splat(f32::NEG_INFINITY); 3]);
            for group in block.groups() {
                if !group.is_plain {
                    return None;
                }
                let limit = L::load(&group.limit).max(L::splat(0.0));
                for axis in 0..3 {
                    let origin = L::load(&group.origin[axis]);
                    let end = origin.add(L::load(&group.direction[axis]).mul(limit));
                    // Of two of which one is no number, the second is taken: a ray without end may have none along an axis, but then it has none either along another.
                    (min[axis], max[axis]) = (end.min(origin.min(min[axis])), end.max(origin.max(max[axis])));
                }
            }
            for axis in 0..3 {
                let (mut least, mut greatest) = ([0.0; 8], [0.0; 8]);
                min[axis].store(&mut least);
                max[axis].store(&mut greatest);
                let (least, greatest) = (range(&least).0, range(&greatest).1);
                if !(0.0..=LARGEST).contains(&(greatest - least)) {
                    return None;
                }
                (reach.min[axis], reach.max[axis]) = (least - MARGIN, greatest + MARGIN);
            }
        }
        Some(reach)
    }

    /// Bit i is set where it overlaps the box of child i.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn overlaps<L: Lanes>(&self, node: &Node) -> u32 {
        // A loop: see `Lanes`.
        let mut all = 0xff;
        for axis in 0..3 {
            // SAFETY: by this function's own condition.
            unsafe {
                let (lower, upper) = (L::load(&node.bounds[axis]), L::load(&node.bounds[axis + 3]));
                all &= lower.le(L::splat(self.max[axis])) & L::splat(self.min[axis]).le(upper);
            }
        }
        all
    }
}
