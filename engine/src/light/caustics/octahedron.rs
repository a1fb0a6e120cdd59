//! The sphere of directions as a square: an octahedron whose lower half is unfolded (Meyer et al., "On Floating-Point Normal Vectors", 2010). It needs no transcendental
//! function and stretches no direction by more than a few times.

use glam::{DVec2, DVec3};

/// The unit vector at a point of [0, 1)^2, and how many points of the square there are to a steradian about it.
#[inline]
pub fn folded(place: DVec2) -> (DVec3, f64) {
    let at = place * 2.0 - DVec2::ONE;
    let z = 1.0 - at.x.abs() - at.y.abs();
    let at = if z < 0.0 { turned_over(at) } else { at };
    let corner = DVec3::new(at.x, at.y, z);
    let length = corner.length();
    (corner * (1.0 / length), 0.25 * length * length * length)
}

/// The inverse.
#[inline]
pub fn unfolded(direction: DVec3) -> (DVec2, f64) {
    let length = 1.0 / (direction.x.abs() + direction.y.abs() + direction.z.abs());
    let at = direction.truncate() * length;
    let at = if direction.z < 0.0 { turned_over(at) } else { at };
    let place = (at + DVec2::ONE) * 0.5;
    (place.clamp(DVec2::ZERO, DVec2::splat(1.0 - f64::EPSILON)), 0.25 * length * length * length)
}

/// A corner of the square onto the octahedron's lower half, or back.
#[inline]
fn turned_over(at: DVec2) -> DVec2 {
    DVec2::new((1.0 - at.y.abs()).copysign(at.x), (1.0 - at.x.abs()).copysign(at.y))
}
