//! Eight triangles at a time: the conservative f32 filter before the exact test, and what that test reads.

use glam::{DVec3, Vec3};

use super::{
    frame::{BoxRay, FINEST},
    identity::Identity,
    simd::Lanes,
};
use crate::{
    math::max_abs,
    shape::triangle::{AXES, Sheared, TriangleHit},
};

/// A ray as the filter sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackRay {
    /// The ray's own axes, in which everything else is given: where their coordinates stand beside those of the first axis, in bytes.
    axes: [u32; 3],
    origin: [f32; 3],
    shear: [f32; 2],
    /// Slack is `(extent + near) * slack`.
    near: f32,
    slack: f32,
    /// Has the sign of the direction along the last axis.
    forward: f32,
}

/// The axis along which a direction of these magnitudes goes most: without branches, of which nobody could foretell the way.
#[inline(always)]
pub(super) fn last_axis([x, y, z, _]: [f32; 4]) -> usize {
    let y_first = usize::from(y > x);
    if z > if y > x { y } else { x } { 2 } else { y_first }
}

/// u, half a unit in the last place of 1.
const UNIT: f32 = 1.0 / (1 << 24) as f32;

/// Bytes of one coordinate of eight points.
const AXIS: usize = size_of::<[f32; 8]>();

/// One coordinate of eight points.
///
/// # Safety
/// `axis` is a multiple of `AXIS`, below 3 of them. The processor has the instructions of `L`.
#[inline(always)]
unsafe fn along<L: Lanes>(points: &[[f32; 8]; 3], axis: u32) -> L {
    // SAFETY: by this function's own condition.
    unsafe { L::load(&*points.as_ptr().byte_add(axis as usize)) }
}

impl PackRay {
    /// No ray.
    pub const NONE: Self = Self { axes: [0; 3], origin: [0.0; 3], shear: [0.0; 2], near: 0.0, slack: 0.0, forward: 0.0 };

    /// The same ray. Its own axes are turned so that the direction's largest component comes last.
    #[inline(always)]
    pub fn new(ray: &BoxRay) -> Self {
        let last = last_axis(ray.direction.map(f32::abs));
        Self::ready(last, |axis| ray.origin[axis], |axis| ray.direction[axis], 1.0 / ray.direction[last], ray.magnitude(FINEST))
    }

    /// From what is known of a ray: the axis along which it goes most, origin and direction by axis, the reciprocal of the direction along that, and 1 + |origin|.
    #[inline(always)]
    pub fn ready(last: usize, origin: impl Fn(usize) -> f32, direction: impl Fn(usize) -> f32, scale: f32, magnitude: f32) -> Self {
        let [x, y, z] = AXES[last];
        Self {
            axes: [(x * AXIS) as u32, (y * AXIS) as u32, (z * AXIS) as u32],
            origin: [origin(x), origin(y), origin(z)],
            shear: [direction(x) * scale, direction(y) * scale],
            near: magnitude * (1.0 / (1 << 22) as f32),
            slack: magnitude * (1.0 / (1 << 17) as f32),
            forward: direction(z),
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
            let z = along::<L>(points, z).sub(L::splat(self.origin[2]));
            let x = along::<L>(points, x).sub(L::splat(self.origin[0])).sub(z.mul(L::splat(self.shear[0])));
            let y = along::<L>(points, y).sub(L::splat(self.origin[1])).sub(z.mul(L::splat(self.shear[1])));
            (x, y)
        }
    }
}

/// Eight triangles in normalised coordinates, structure of arrays.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Pack {
    /// By vertex and axis.
    vertices: [[[f32; 8]; 3]; 3],
    /// Largest component of the edges, to which rounding errors are proportional; below all numbers in empty places, which then never pass.
    extent: [f32; 8],
    /// Number of each triangle in its mesh.
    ids: [u32; 8],
    /// And which mesh that is.
    instances: [u16; 8],
    /// 0 where all triangles are what they are; 1 where a vertex may be beside its place, by half a unit in the last place of 1.
    rounding: f32,
}

/// A triangle for a pack.
pub struct PackTriangle {
    /// Which mesh it is of.
    pub instance: u16,
    /// Its number in that.
    pub id: u32,
    /// In normalised coordinates.
    pub vertices: [Vec3; 3],
    /// Whether these are what they are in the mesh, but for a power of two.
    pub is_exact: bool,
}

impl Pack {
    /// Up to eight triangles.
    pub fn new(triangles: impl IntoIterator<Item = PackTriangle>) -> Self {
        let mut pack = Self {
            vertices: [[[0.0; 8]; 3]; 3],
            extent: [f32::NEG_INFINITY; 8],
            ids: [u32::MAX; 8],
            instances: [u16::MAX; 8],
            rounding: 0.0,
        };
        for (slot, PackTriangle { instance, id, vertices, is_exact }) in triangles.into_iter().take(8).enumerate() {
            for (vertex, axis) in (0..3).flat_map(|vertex| (0..3).map(move |axis| (vertex, axis))) {
                pack.vertices[vertex][axis][slot] = vertices[vertex][axis];
            }
            let [a, b, c] = vertices.map(Vec3::as_dvec3);
            pack.extent[slot] = (max_abs(a - b).max(max_abs(b - c)).max(max_abs(c - a)) as f32).next_up();
            pack.ids[slot] = id;
            pack.instances[slot] = instance;
            pack.rounding = if is_exact { pack.rounding } else { 1.0 };
        }
        pack
    }

    /// Adds all that it is.
    pub fn identify(&self, identity: &mut Identity) {
        identity.floats(self.vertices.as_flattened().as_flattened());
        identity.floats(&self.extent);
        identity.numbers(&self.ids);
        identity.numbers(&self.instances.map(u32::from));
        identity.floats(&[self.rounding]);
    }

    /// The mesh and the number there of the triangle in a place.
    ///
    /// # Safety
    /// The place is below 8.
    #[inline(always)]
    pub unsafe fn id(&self, slot: usize) -> (u32, u32) {
        // SAFETY: by this function's own condition.
        unsafe { (u32::from(*self.instances.get_unchecked(slot)), *self.ids.get_unchecked(slot)) }
    }

    /// Whether all triangles are what they are in their mesh, but for a power of two: only then are hits right.
    #[inline(always)]
    pub fn is_exact(&self) -> bool {
        self.rounding == 0.0
    }

    /// Where a ray in normalised coordinates hits the triangle in a place. A function of its own, so that the walk through the tree keeps its registers.
    ///
    /// # Safety
    /// The place is below 8.
    #[inline(never)]
    pub unsafe fn hit(&self, slot: usize, origin: DVec3, direction: DVec3) -> Option<TriangleHit> {
        let ray = Sheared::new(origin, direction);
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
    /// as both may be rounded too, and a sheared coordinate by d = 11 u M, as the shear is by 4 u. Where the line meets the triangle, sheared coordinates are at most 2 E, since
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
            let met = zero.le(lowest.max(zero.sub(highest)).add(slack));
            if met == 0 { 0 } else { met & self.ahead::<L>(ray) }
        }
    }

    /// Bit i is set unless the ray certainly meets the plane of triangle i behind its start: rays that leave a surface always pass near what they left.
    ///
    /// Signs of products of the normal n = p x q decide, with p and q edges from vertex a. With u, E and M as in [`Self::candidates`], D the largest component of a minus the
    /// origin, and R = 1 where vertices are rounded, else 0: p and q are wrong by u (E + 2 R), a component of n by 8 u (E + R) (E + u R) and at most 2 E^2 itself, and a minus the
    /// origin by u (M + D), so that its product with n is wrong by up to 24 u D (E + R) (E + u R) + 6 u (M + D) E^2 + 18 u D E^2. The error allowed for is
    /// (16 u M E + 48 u D (E + R)) (E + 4 u R), and for n's product with the direction, in proportion to its largest component, 64 u (E + R) (E + 4 u R).
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn ahead<L: Lanes>(&self, ray: &PackRay) -> u32 {
        // SAFETY: by this function's own condition; axes are below 3.
        unsafe {
            let [a, b, c] = &self.vertices;
            let [i, j, k] = ray.axes;
            let (ax, ay, az) = (along::<L>(a, i), along::<L>(a, j), along::<L>(a, k));
            let (px, py, pz) = (along::<L>(b, i).sub(ax), along::<L>(b, j).sub(ay), along::<L>(b, k).sub(az));
            let (qx, qy, qz) = (along::<L>(c, i).sub(ax), along::<L>(c, j).sub(ay), along::<L>(c, k).sub(az));
            let x = py.mul(qz).sub(pz.mul(qy));
            let y = pz.mul(qx).sub(px.mul(qz));
            let z = px.mul(qy).sub(py.mul(qx));
            let (ax, ay, az) = (ax.sub(L::splat(ray.origin[0])), ay.sub(L::splat(ray.origin[1])), az.sub(L::splat(ray.origin[2])));
            let approach = z.add(x.mul(L::splat(ray.shear[0]))).add(y.mul(L::splat(ray.shear[1])));
            let distance = ax.mul(x).add(ay.mul(y)).add(az.mul(z)).signed(approach).signed(L::splat(ray.forward));
            let (extent, apart) = (L::load(&self.extent), ax.abs().max(ay.abs()).max(az.abs()));
            let (rounded, least) = (extent.add(L::splat(self.rounding)), extent.add(L::splat(self.rounding * (4.0 * UNIT))));
            let error = extent.mul(L::splat(ray.slack * 0.125)).add(apart.mul(L::splat(48.0 * UNIT)).mul(rounded)).mul(least);
            let level = rounded.mul(least).mul(L::splat(64.0 * UNIT));
            L::splat(0.0).le(distance.add(error)) | approach.abs().le(level)
        }
    }
}
