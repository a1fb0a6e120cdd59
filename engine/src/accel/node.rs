//! Nodes of eight children.

use glam::Vec3;

use super::{build::Box3, identity::Identity, simd::Lanes};

/// Bytes of one bound of all children of a node.
pub const BOUND: usize = size_of::<[f32; 8]>();

/// Marks a reference as one to a leaf.
pub const LEAF: u32 = 1 << 31;

/// Eight children: boxes in structure-of-arrays form, and references.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Lower x, y, z, upper x, y, z of each child, grown by `OUTWARD`. An empty place has an inverted infinite box, which no ray meets.
    pub bounds: [[f32; 8]; 6],
    /// Index of a node, or `LEAF` with what the builder was given for the leaf.
    pub children: [u32; 8],
}

impl Node {
    /// No children.
    pub const EMPTY: Self = Self {
        bounds: [
            [f32::INFINITY; 8],
            [f32::INFINITY; 8],
            [f32::INFINITY; 8],
            [f32::NEG_INFINITY; 8],
            [f32::NEG_INFINITY; 8],
            [f32::NEG_INFINITY; 8],
        ],
        children: [LEAF; 8],
    };

    /// References of its children, with their boxes.
    pub fn boxes(&self) -> impl Iterator<Item = (u32, Box3)> {
        let corner =
            |first: usize, place: usize| Vec3::new(self.bounds[first][place], self.bounds[first + 1][place], self.bounds[first + 2][place]);
        let child = move |place: usize| (self.children[place], Box3 { min: corner(0, place), max: corner(3, place) });
        (0..8).map(child).filter(|(_, bounds)| bounds.min.cmple(bounds.max).all())
    }

    /// Adds all that it is.
    pub fn identify(&self, identity: &mut Identity) {
        identity.floats(self.bounds.as_flattened());
        identity.numbers(&self.children);
    }

    /// Where a ray enters and leaves each child's box, before `limit`; of an empty place, no numbers or such that it leaves before it enters. Near and far
    /// bounds are given an origin and an inverse direction each, by axis: for one ray the same origin, for several rays those that make distances to near bounds
    /// least and to far bounds greatest.
    ///
    /// # Safety
    /// `near` comes from [`near_bounds`]. The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn meet<L: Lanes>(&self, near: [usize; 3], near_ray: [[L; 3]; 2], far_ray: [[L; 3]; 2], limit: L) -> (L, L) {
        let ([near_origin, near_inverse], [far_origin, far_inverse]) = (near_ray, far_ray);
        // SAFETY: by this function's own condition.
        unsafe {
            let enter_x = self.distance(near[0], near_origin[0], near_inverse[0]);
            let leave_x = self.distance(far_bound(near, 0), far_origin[0], far_inverse[0]);
            let enter_y = self.distance(near[1], near_origin[1], near_inverse[1]);
            let leave_y = self.distance(far_bound(near, 1), far_origin[1], far_inverse[1]);
            let enter_z = self.distance(near[2], near_origin[2], near_inverse[2]);
            let leave_z = self.distance(far_bound(near, 2), far_origin[2], far_inverse[2]);
            // Of two of which one is no number, `max` takes the second: an empty place then has no number to enter at.
            (enter_x.max(enter_y).max(L::splat(0.0).max(enter_z)), leave_x.min(leave_y).min(leave_z.min(limit)))
        }
    }

    /// Parameters at which a ray meets one bound of every child.
    ///
    /// # Safety
    /// `bound` is a multiple of `BOUND` below 6 of them. The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn distance<L: Lanes>(&self, bound: usize, origin: L, inverse: L) -> L {
        // SAFETY: by this function's own condition.
        unsafe { L::load(&*(&raw const self.bounds).cast::<[f32; 8]>().byte_add(bound)).sub(origin).mul(inverse) }
    }

    /// One bound of one child.
    ///
    /// # Safety
    /// `bound` is a multiple of `BOUND` below 6 of them, `place` below 8.
    #[inline(always)]
    pub unsafe fn bound(&self, bound: usize, place: usize) -> f32 {
        // SAFETY: by this function's own condition.
        unsafe { *(&raw const self.bounds).cast::<f32>().byte_add(bound).add(place) }
    }
}

/// Where the bounds that a ray meets first stand in a node, by axis, in bytes, so that nothing is multiplied on the way; from the bits of the axes along which it is
/// negative.
#[inline(always)]
pub fn near_bounds(negative: u32) -> [usize; 3] {
    const NEAR: [[usize; 3]; 8] = {
        let mut near = [[0; 3]; 8];
        let mut bits = 0;
        while bits < 8 {
            let mut axis = 0;
            while axis < 3 {
                near[bits][axis] = BOUND * if bits >> axis & 1 == 1 { axis + 3 } else { axis };
                axis += 1;
            }
            bits += 1;
        }
        near
    };
    NEAR[negative as usize & 7]
}

/// Where the bound along an axis that it meets last stands.
#[inline(always)]
pub fn far_bound(near: [usize; 3], axis: usize) -> usize {
    (3 + 2 * axis) * BOUND - near[axis]
}
