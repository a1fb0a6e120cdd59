//! Eight triangles at a time: the conservative f32 filter before the exact test, and what that test reads.

use glam::Vec3;

use super::{
    frame::{BoxRay, FINEST},
    identity::Identity,
    simd::Lanes,
};
use crate::{
    math::max_abs,
    shape::triangle::{Sheared, TriangleHit},
};

/// A ray as the filter sees it.
#[derive(Clone, Copy, Debug)]
pub struct PackRay {
    /// The ray's own axes, in which everything else is given.
    axes: [usize; 3],
    origin: [f32; 3],
    shear: [f32; 2],
    /// Slack is `(extent + near) * slack`.
    near: f32,
    slack: f32,
}

impl PackRay {
    /// The same ray twice.
    #[inline(always)]
    pub fn new(ray: &BoxRay, sheared: &Sheared) -> Self {
        let (magnitude, origin) = (ray.magnitude(FINEST), ray.origin.to_array());
        let [x, y, z] = sheared.axes();
        let [sx, sy] = sheared.shear();
        Self {
            axes: [x, y, z],
            origin: [origin[x], origin[y], origin[z]],
            shear: [sx as f32, sy as f32],
            near: magnitude * (1.0 / (1 << 22) as f32),
            slack: magnitude * (1.0 / (1 << 17) as f32),
        }
    }

    /// Eight points, given by axis, as they lie beside the ray.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn project<L: Lanes>(&self, points: &[[f32; 8]; 3]) -> (L, L) {
        let [x, y, z] = self.axes;
        // SAFETY: by this function's own condition; axes are below 3.
        unsafe {
            let z = L::load(points.get_unchecked(z)).sub(L::splat(self.origin[2]));
            let x = L::load(points.get_unchecked(x)).sub(L::splat(self.origin[0])).sub(z.mul(L::splat(self.shear[0])));
            let y = L::load(points.get_unchecked(y)).sub(L::splat(self.origin[1])).sub(z.mul(L::splat(self.shear[1])));
            (x, y)
        }
    }
}

/// Eight triangles in scaled coordinates, structure of arrays.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug)]
pub struct Pack {
    /// By vertex and axis.
    vertices: [[[f32; 8]; 3]; 3],
    /// Largest component of the edges, to which rounding errors are proportional; below all numbers in empty places, which then never pass.
    extent: [f32; 8],
    /// Number of each triangle in its mesh.
    ids: [u32; 8],
}

impl Pack {
    /// Up to eight triangles, each three vertices in scaled coordinates, with their numbers.
    pub fn new(triangles: impl IntoIterator<Item = (u32, [Vec3; 3])>) -> Self {
        let mut pack = Self { vertices: [[[0.0; 8]; 3]; 3], extent: [f32::NEG_INFINITY; 8], ids: [u32::MAX; 8] };
        for (slot, (id, vertices)) in triangles.into_iter().take(8).enumerate() {
            for (vertex, axis) in (0..3).flat_map(|vertex| (0..3).map(move |axis| (vertex, axis))) {
                pack.vertices[vertex][axis][slot] = vertices[vertex][axis];
            }
            let [a, b, c] = vertices.map(Vec3::as_dvec3);
            pack.extent[slot] = (max_abs(a - b).max(max_abs(b - c)).max(max_abs(c - a)) as f32).next_up();
            pack.ids[slot] = id;
        }
        pack
    }

    /// Adds all that it is.
    pub fn identify(&self, identity: &mut Identity) {
        identity.floats(self.vertices.as_flattened().as_flattened());
        identity.floats(&self.extent);
        identity.numbers(&self.ids);
    }

    /// Number of the triangle in a place.
    #[inline(always)]
    pub fn id(&self, slot: usize) -> u32 {
        self.ids[slot]
    }

    /// Where a ray hits the triangle in a place. A function of its own, so that the walk through the tree keeps its registers.
    ///
    /// # Safety
    /// The place is below 8.
    #[inline(never)]
    pub unsafe fn hit(&self, slot: usize, ray: &Sheared) -> Option<TriangleHit> {
        let [x, y, z] = ray.axes();
        // SAFETY: by this function's own condition; axes are below 3.
        let at = |vertex: &[[f32; 8]; 3], axis: usize| unsafe { f64::from(*vertex.get_unchecked(axis).get_unchecked(slot)) };
        let [a, b, c] = &self.vertices;
        ray.hit([[at(a, x), at(a, y), at(a, z)], [at(b, x), at(b, y), at(b, z)], [at(c, x), at(c, y), at(c, z)]])
    }

    /// Bit i is set where the line of the ray may meet triangle i.
    ///
    /// The test is that of `shape::triangle` in f32: vertices are sheared so that the ray becomes the z axis, and the signs of the edge functions
    /// decide. With u = 2^-24, E the extent and M = 1 + |origin| (coordinates are at most 1): vertex minus origin is wrong by up to 2 u M,
    /// as the origin is rounded too, and a sheared coordinate by d = 8 u M. Where the line meets the triangle, sheared coordinates are at most 2 E, since
    /// they surround 0, so that an edge function is wrong by up to 8 E d + 2 d^2 for its arguments and 4 u (2 E + d)^2 for its own rounding:
    /// with E <= 2 M less than 128 u M (E + 4 u M), the slack.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn candidates<L: Lanes>(&self, ray: &PackRay) -> u32 {
        // SAFETY: by this function's own condition; axes are below 3.
        unsafe {
            let [a, b, c] = &self.vertices;
            let (a, b, c) = (ray.project::<L>(a), ray.project::<L>(b), ray.project::<L>(c));
            let u = c.0.mul(b.1).sub(c.1.mul(b.0));
            let v = a.0.mul(c.1).sub(a.1.mul(c.0));
            let w = b.0.mul(a.1).sub(b.1.mul(a.0));
            let (lowest, highest) = (u.min(v).min(w), u.max(v).max(w));
            let slack = L::load(&self.extent).add(L::splat(ray.near)).mul(L::splat(ray.slack));
            let zero = L::splat(0.0);
            zero.le(lowest.max(zero.sub(highest)).add(slack))
        }
    }
}
