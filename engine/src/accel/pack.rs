//! Eight triangles at a time: the conservative f32 filter before the exact test.

use glam::{DVec3, Vec3};

use super::{frame::BoxRay, simd::Lanes};

/// Eight triangles in normalised coordinates, structure of arrays.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Pack {
    /// First vertex.
    corner: [[f32; 8]; 3],
    /// Second to first vertex.
    edge1: [[f32; 8]; 3],
    /// First to third vertex.
    edge2: [[f32; 8]; 3],
    /// Largest component of the edges, to which rounding errors are proportional; negative in empty places, which then never pass.
    extent: [f32; 8],
}

/// Extents below this count as this, so that underflow never exceeds the slack.
const SMALLEST: f32 = 1e-30;

impl Pack {
    /// Up to eight triangles, each three vertices in normalised coordinates.
    pub fn new(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> Self {
        let mut pack = Self { corner: [[0.0; 8]; 3], edge1: [[0.0; 8]; 3], edge2: [[0.0; 8]; 3], extent: [-1.0; 8] };
        for (slot, [a, b, c]) in triangles.into_iter().take(8).enumerate() {
            let (corner, edge1, edge2) = (a.as_vec3(), (a - b).as_vec3(), (c - a).as_vec3());
            for axis in 0..3 {
                pack.corner[axis][slot] = corner[axis];
                pack.edge1[axis][slot] = edge1[axis];
                pack.edge2[axis][slot] = edge2[axis];
            }
            pack.extent[slot] = max_abs(edge1).max(max_abs(edge2)).max(SMALLEST);
        }
        pack
    }

    /// Bit i is set where the line of the ray may meet triangle i.
    ///
    /// The test is Möller and Trumbore's. With u = 2^-24, E the extent and M = 1 + |origin|: vertex minus origin is wrong by up to 3 u M, its
    /// cross product with the direction by 12 u M, and a scalar product of that with an edge by 60 u M E; the determinant, of size up to
    /// 12 E^2 <= 24 M E, by 80 u M E. The slacks below are 64 u M E for each of the two and 256 u M E for their sum.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn candidates<L: Lanes>(&self, ray: &BoxRay) -> u32 {
        // SAFETY: by this function's own condition.
        unsafe {
            let load = |v: &[[f32; 8]; 3]| [L::load(&v[0]), L::load(&v[1]), L::load(&v[2])];
            let splat = |v: &[f32; 4]| [L::splat(v[0]), L::splat(v[1]), L::splat(v[2])];
            let (origin, direction) = (splat(&ray.origin), splat(&ray.direction));
            let (corner, edge1, edge2) = (load(&self.corner), load(&self.edge1), load(&self.edge2));
            let relative = [corner[0].sub(origin[0]), corner[1].sub(origin[1]), corner[2].sub(origin[2])];
            let normal = cross(edge2, edge1);
            let moment = cross(relative, direction);
            let signed = dot(normal, direction);
            let (u, v) = (dot(moment, edge2).with_sign_of(signed), dot(moment, edge1).with_sign_of(signed));
            let slack = L::load(&self.extent).mul(L::splat(ray.magnitude * (1.0 / (1 << 18) as f32)));
            let inside = u.min(v).add(slack);
            let beyond = signed.abs().sub(u.add(v)).add(slack.mul(L::splat(4.0)));
            L::splat(0.0).le(inside.min(beyond))
        }
    }
}

fn max_abs(v: Vec3) -> f32 {
    v.abs().max_element()
}

#[inline(always)]
unsafe fn cross<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    // SAFETY: the caller has the instructions of `L`.
    unsafe { [a[1].mul(b[2]).sub(a[2].mul(b[1])), a[2].mul(b[0]).sub(a[0].mul(b[2])), a[0].mul(b[1]).sub(a[1].mul(b[0]))] }
}

#[inline(always)]
unsafe fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    // SAFETY: the caller has the instructions of `L`.
    unsafe { a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2])) }
}
