//! Spheres, eight at a time: where they are few, testing all of them is faster than walking a tree.

use super::{
    frame::{BoxRay, Normalisation},
    simd::Lanes,
};
use crate::shape::{Bounds, Ray, Sphere};

/// Spheres of a list at the most, so that one word holds a bit for each. More belong into a tree: so many take about as long as a short walk.
pub const MOST: usize = 64;

/// Places in a list of spheres: bit i stands for place i.
#[derive(Clone, Copy, Debug)]
pub struct Candidates(pub(super) u64);

impl Candidates {
    /// Those whose bit is not set.
    #[inline(always)]
    pub fn without(self, bits: u64) -> Self {
        Self(self.0 & !bits)
    }
}

impl Iterator for Candidates {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let place = self.0.trailing_zeros() as usize;
        let some = self.0 != 0;
        self.0 &= self.0.wrapping_sub(1);
        some.then_some(place)
    }
}

/// Some spheres that the caller keeps.
#[derive(Debug)]
pub struct SphereList {
    frame: Normalisation,
    packs: Vec<Pack>,
}

/// Eight spheres in normalised coordinates, structure of arrays.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
struct Pack {
    center: [[f32; 8]; 3],
    /// Below all numbers in empty places, which then never pass, however far an error reaches.
    radius: [f32; 8],
}

const EMPTY: f32 = f32::NEG_INFINITY;

impl SphereList {
    /// A list of at most [`MOST`] spheres; those beyond are left out.
    pub fn new(spheres: &[Sphere]) -> Self {
        let frame = Normalisation::of(spheres.iter().map(Sphere::bounds).reduce(Bounds::union).unwrap_or(Bounds::of([glam::DVec3::ZERO])));
        let packs = spheres.chunks(8).take(MOST / 8).map(|spheres| Pack::new(&frame, spheres)).collect();
        Self { frame, packs }
    }

    /// The spheres that a ray of unit direction may meet between its origin and `limit`.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn candidates<L: Lanes>(&self, ray: &Ray, limit: f64) -> Candidates {
        let boxed = self.frame.ray::<true>(ray.origin, ray.direction);
        let nearest = boxed.limit(limit);
        // First all packs, then all candidates: a loop of known length and one of few steps are predicted better than one within the other.
        let mut candidates = 0_u64;
        for (index, pack) in self.packs.iter().enumerate() {
            // SAFETY: by this function's own condition.
            candidates |= u64::from(unsafe { pack.candidates::<L>(&boxed, nearest) }) << (8 * index);
        }
        Candidates(candidates & !ray.leaves)
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.packs)
    }
}

impl Pack {
    fn new(frame: &Normalisation, spheres: &[Sphere]) -> Self {
        let mut pack = Self { center: [[0.0; 8]; 3], radius: [EMPTY; 8] };
        for (slot, sphere) in spheres.iter().enumerate() {
            let center = frame.point(sphere.center).as_vec3().to_array();
            (0..3).for_each(|axis| pack.center[axis][slot] = center[axis]);
            pack.radius[slot] = frame.length(sphere.radius) as f32;
        }
        pack
    }

    /// Bit i is set where the ray may meet sphere i before `limit`.
    ///
    /// The line passes the centre at a distance that must not exceed the radius, and the centre's foot on it lies at most a radius before the origin or
    /// behind the limit. With u = 2^-24 and M = 1 + |origin|: centre minus origin is wrong by up to 2 u M in each component, its
    /// scalar product with the direction by 11 u M, the foot's offset by 20 u M in each component and so by 35 u M in length; radius and squares
    /// add less than 8 u M. The slack is 64 u M.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn candidates<L: Lanes>(&self, ray: &BoxRay, limit: f32) -> u32 {
        const UNIT: f32 = 1.0 / (1 << 18) as f32;
        // SAFETY: by this function's own condition.
        unsafe {
            let [dx, dy, dz] = [L::splat(ray.direction[0]), L::splat(ray.direction[1]), L::splat(ray.direction[2])];
            let x = L::load(&self.center[0]).sub(L::splat(ray.origin[0]));
            let y = L::load(&self.center[1]).sub(L::splat(ray.origin[1]));
            let z = L::load(&self.center[2]).sub(L::splat(ray.origin[2]));
            let along = x.mul(dx).add(y.mul(dy)).add(z.mul(dz));
            let (x, y, z) = (x.sub(dx.mul(along)), y.sub(dy.mul(along)), z.sub(dz.mul(along)));
            let squared = x.mul(x).add(y.mul(y)).add(z.mul(z));
            let reach = L::load(&self.radius).add(L::splat(ray.magnitude(UNIT) * UNIT));
            let ahead = along.add(reach);
            let before = L::splat(limit).add(reach).sub(along);
            squared.le(reach.mul(reach)) & L::splat(0.0).le(ahead.min(before))
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{
        accel::Baseline,
        math::{cos, sin},
    };

    /// Numbers in [-1, 1] that fill a cube.
    fn spread(i: usize) -> DVec3 {
        let i = i as f64;
        DVec3::new(sin(i * 1.1), cos(i * 1.7 + 0.3), sin(i * 2.3 + 1.0))
    }

    /// Rays that touch spheres within a few units of the last place, from near, from far and from inside: no hit is lost, and most others are culled.
    #[test]
    fn no_hit_is_lost_and_most_misses_are_culled() {
        for place in [DVec3::ZERO, DVec3::new(1e6, -3e5, 10.0)] {
            let spheres: Vec<Sphere> =
                (0..45).map(|i| Sphere { center: place + spread(i) * 5.0, radius: [1.0, 0.2, 1e-3][i % 3] }).collect();
            let list = SphereList::new(&spheres);
            let (mut hits, mut candidates, mut pairs) = (0, 0, 0);
            for i in 0..6000 {
                let origin = place + spread(i + 99) * [0.1, 6.0, 100.0][i % 3];
                let target = spheres[i % 45];
                let towards = target.center - origin;
                let sideways = towards.cross(spread(i + 7)).normalize() * target.radius * [0.0, 0.999_999, 1.0 - 1e-15, 1.1][i % 4];
                let ray = Ray::new(origin, (towards + sideways).normalize());
                let mut visited = [false; 45];
                // SAFETY: every processor has the baseline.
                unsafe { list.candidates::<Baseline>(&ray, f64::INFINITY) }.for_each(|index| visited[index] = true);
                for (sphere, visited) in spheres.iter().zip(visited) {
                    let hit = sphere.closest::<true>(&ray).is_some();
                    assert!(visited || !hit, "{ray:?} {sphere:?}");
                    hits += usize::from(hit);
                    candidates += usize::from(visited);
                    pairs += 1;
                }
            }
            assert!(hits > 3000, "{hits}");
            assert!(candidates - hits < pairs / 50, "{candidates} candidates for {hits} hits of {pairs} pairs");
        }
    }

    #[test]
    fn what_lies_behind_the_limit_is_not_visited() {
        let spheres = [2.0, 6.0, 10.0].map(|z| Sphere { center: DVec3::new(0.0, 0.0, z), radius: 1.0 });
        let list = SphereList::new(&spheres);
        let ray = Ray::new(DVec3::ZERO, DVec3::Z);
        // SAFETY: every processor has the baseline.
        let visited = |ray: &Ray| unsafe { list.candidates::<Baseline>(ray, 8.0) }.collect::<Vec<_>>();
        assert_eq!(visited(&ray), [0, 1]);
        assert_eq!(visited(&Ray { leaves: 1, ..ray }), [1]);
    }

    /// Rays from where numbers end reach far, but not into places where no sphere is.
    #[test]
    fn empty_places_are_never_visited() {
        let list = SphereList::new(&[Sphere { center: DVec3::ZERO, radius: 1.0 }]);
        for size in [1e20, 1e50, 1e56, 1e90, 1e200, 1e308, f64::INFINITY, f64::NAN] {
            for (origin, limit) in [(spread(1), f64::INFINITY), (spread(2), 1.0), (DVec3::NEG_Z, 2.0 * size)] {
                let ray = Ray::new(origin * size, -origin.normalize());
                // SAFETY: every processor has the baseline.
                unsafe { list.candidates::<Baseline>(&ray, limit) }.for_each(|place| assert_eq!(place, 0, "{ray:?}"));
            }
        }
    }
}
