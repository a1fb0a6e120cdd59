//! Few spheres as seen from one point: rays from the camera and towards a light share what depends on that point alone.

use glam::DVec3;

use super::{
    frame::power_of_two_below,
    simd::Lanes,
    spheres::{Candidates, MOST},
};
use crate::shape::Sphere;

/// Spheres for all rays through one point, the apex: a pencil of rays, as optics calls it.
///
/// A ray meets a sphere of radius r at distance D if its direction lies in the cone around the sphere, that is if the centre's foot on it lies at
/// least as far away as the points where tangents touch, sqrt(D^2 - r^2); and it meets nothing of it before D - r. All lengths are compared by their
/// squares, with their signs, so that nobody waits for a root.
#[derive(Debug)]
pub struct Pencil {
    apex: DVec3,
    /// A power of two that makes D + r at most 1 for every sphere.
    scale: f64,
    /// Bits of all spheres.
    all: u64,
    packs: Vec<Pack>,
}

/// Eight spheres, scaled, structure of arrays.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
struct Pack {
    /// Centre less apex.
    center: [[f32; 8]; 3],
    /// Distance of the points where tangents touch, less what rounding may amount to, squared. Infinite in empty places, which then never pass; below all
    /// numbers where the apex lies inside.
    tangent: [f32; 8],
    /// Distance of the nearest point, less what rounding may amount to, squared.
    nearest: [f32; 8],
}

/// Segments longer than this, scaled, are not filtered.
const LONGEST: f64 = (1 << 10) as f64;

/// Nor are shorter ones, whose squares might vanish.
const SHORTEST: f64 = 1.0 / (1u64 << 40) as f64;

/// Bound on the distance at which a segment's exact line may pass by the apex, on that at which the exact test still takes a miss for a hit, and their sum:
/// both are below 32 u of a segment's length plus D + r, at most `LONGEST + 1`, with u = 2^-53.
const OFFSIDE: f64 = 1.0 / (1u64 << 36) as f64;

/// The foot's distance in f32 is wrong by up to 5 u D, u = 2^-24, and what it is compared with by up to 5 u D too.
const FOOT_SLACK: f64 = 1.0 / (1 << 20) as f64;

/// Near a tangent an error of `OFFSIDE` moves a hit by up to the root of `2 r OFFSIDE`.
const DEPTH_SLACK: f64 = 1.0 / (1 << 16) as f64;

impl Pencil {
    /// At most [`MOST`] spheres; those beyond are left out.
    pub fn new(apex: DVec3, spheres: &[Sphere]) -> Self {
        let spheres = &spheres[..spheres.len().min(MOST)];
        let size = spheres.iter().map(|sphere| apex.distance(sphere.center) + sphere.radius).fold(f64::MIN_POSITIVE * 4.0, f64::max);
        let scale = power_of_two_below(1.0 / size);
        let packs = spheres.chunks(8).map(|spheres| Pack::new(apex, scale, spheres)).collect();
        Self { apex, scale, all: if spheres.is_empty() { 0 } else { u64::MAX >> (MOST - spheres.len()) }, packs }
    }

    /// The spheres that the segment between the apex and a point may meet. The line that is tested afterwards may be computed, in f64, as that through
    /// both in either direction.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn before<L: Lanes>(&self, point: DVec3) -> Candidates {
        let segment = (point - self.apex) * self.scale;
        let squared = segment.length_squared();
        let filtered = squared > SHORTEST * SHORTEST && squared < LONGEST * LONGEST;
        if !filtered {
            return Candidates(self.all);
        }
        // SAFETY: by this function's own condition.
        unsafe { self.filter::<L>(segment, squared, squared) }
    }

    /// The spheres that a ray of unit direction from exactly the apex may meet before `limit`.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn along<L: Lanes>(&self, direction: DVec3, limit: f64) -> Candidates {
        let limit = limit * self.scale;
        // Not a number if the scale is 0, because the spheres are too large for f64.
        if limit.is_nan() {
            return Candidates(self.all);
        }
        // SAFETY: by this function's own condition.
        unsafe { self.filter::<L>(direction, 1.0, limit * limit) }
    }

    /// `squared` is the squared length of `segment`, `limit` that of what is looked at.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn filter<L: Lanes>(&self, segment: DVec3, squared: f64, limit: f64) -> Candidates {
        let segment = segment.as_vec3().to_array();
        let mut candidates = 0_u64;
        for (index, pack) in self.packs.iter().enumerate() {
            // SAFETY: by this function's own condition.
            candidates |= u64::from(unsafe { pack.candidates::<L>(segment, squared as f32, limit as f32) }) << (8 * index);
        }
        Candidates(candidates)
    }
}

impl Pack {
    fn new(apex: DVec3, scale: f64, spheres: &[Sphere]) -> Self {
        let mut pack = Self { center: [[0.0; 8]; 3], tangent: [f32::INFINITY; 8], nearest: [f32::INFINITY; 8] };
        for (slot, sphere) in spheres.iter().enumerate() {
            let center = (sphere.center - apex) * scale;
            (0..3).for_each(|axis| pack.center[axis][slot] = center[axis] as f32);
            let (distance, reach) = (center.length(), sphere.radius * scale + OFFSIDE);
            let (tangent, nearest) = if distance > reach {
                let tangent = (distance * distance - reach * reach).sqrt() - distance * FOOT_SLACK;
                let nearest = (distance - reach - DEPTH_SLACK).max(0.0);
                (tangent * tangent.abs(), nearest * nearest)
            } else {
                (f64::NEG_INFINITY, 0.0)
            };
            (pack.tangent[slot], pack.nearest[slot]) = (tangent as f32, nearest as f32);
        }
        pack
    }

    /// Bit i is set where a segment from the apex may meet sphere i.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    unsafe fn candidates<L: Lanes>(&self, [x, y, z]: [f32; 3], squared: f32, limit: f32) -> u32 {
        // SAFETY: by this function's own condition.
        unsafe {
            let [cx, cy, cz] = [L::load(&self.center[0]), L::load(&self.center[1]), L::load(&self.center[2])];
            let foot = cx.mul(L::splat(x)).add(cy.mul(L::splat(y))).add(cz.mul(L::splat(z)));
            let tangent = L::load(&self.tangent).mul(L::splat(squared));
            tangent.le(foot.mul(foot.abs())) & L::load(&self.nearest).le(L::splat(limit))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        accel::Baseline,
        math::{cos, sin},
        shape::Ray,
    };

    /// Numbers in [-1, 1] that fill a cube.
    fn spread(i: usize) -> DVec3 {
        let i = i as f64;
        DVec3::new(sin(i * 1.1), cos(i * 1.7 + 0.3), sin(i * 2.3 + 1.0))
    }

    /// Segments that touch spheres within a few units of the last place, the apex outside, inside, on and close to spheres, here and far from the
    /// origin: no hit is lost, and most others are culled.
    #[test]
    fn no_hit_is_lost_and_most_misses_are_culled() {
        let (mut hits, mut candidates, mut pairs) = (0, 0, 0);
        for place in [DVec3::ZERO, DVec3::new(1e6, -3e5, 10.0)] {
            let spheres: Vec<Sphere> =
                (0..45).map(|i| Sphere { center: place + spread(i) * 5.0, radius: [1.0, 0.2, 1e-3][i % 3] }).collect();
            let on = |i: usize, out: f64| spheres[i].center + spread(i + 3).normalize() * spheres[i].radius * out;
            for apex in
                [place, place + spread(50) * 9.0, place + spread(51) * 300.0, on(0, 0.3), on(1, 1.0), on(3, 1.0 + 1e-9), on(4, 1.001)]
            {
                let pencil = Pencil::new(apex, &spheres);
                for i in 0..4000 {
                    let target = spheres[i % 45];
                    let towards = target.center - apex;
                    let sideways = towards.cross(spread(i + 7)).normalize() * target.radius * [0.0, 0.999_999, 1.0 - 1e-15, 1.1][i % 4];
                    let end = apex + (towards + sideways) * [0.5, 0.9999, 1.0, 3.0, 1e4][i % 5];
                    let (away, length) = ((end - apex).normalize(), (end - apex).length());
                    let forth = Ray { t_max: length, ..Ray::new(apex, away) };
                    let back = Ray { t_max: length, ..Ray::new(end, -away) };
                    // SAFETY: every processor has the baseline.
                    let (along, before) = unsafe { (pencil.along::<Baseline>(away, length).0, pencil.before::<Baseline>(end).0) };
                    for (slot, sphere) in spheres.iter().enumerate() {
                        for (ray, filtered) in [(&forth, along), (&back, before)] {
                            let hit = sphere.closest::<true>(ray).is_some();
                            let passed = filtered >> slot & 1 == 1;
                            assert!(passed || !hit, "{ray:?} {sphere:?} {apex}");
                            hits += usize::from(hit);
                            candidates += usize::from(passed && length < 1e3);
                            pairs += 1;
                        }
                    }
                }
            }
        }
        assert!(hits > 30_000, "{hits}");
        assert!(candidates < hits + pairs / 20, "{candidates} candidates for {hits} hits of {pairs} pairs");
    }
}
