//! Polygons become triangles.

use glam::{DVec2, DVec3};

/// Corners up to which a polygon that is not convex is cut into ears, in time that grows with their square; beyond, it becomes a fan.
const MAX_EARS: usize = 4096;

/// Splits a polygon into triangles of its corners' numbers, in its own winding: as a fan if it is convex, else by cutting off ears
/// (Meisters 1975) in the plane that it is steepest to. Fewer than three corners make none.
pub(super) fn triangulate(corners: &[[f32; 3]]) -> Vec<[usize; 3]> {
    let fan = || (2..corners.len()).map(|i| [0, i - 1, i]).collect();
    if corners.len() <= 3 || corners.len() > MAX_EARS {
        return fan();
    }
    let flat = project(corners);
    let ring: Vec<usize> = (0..flat.len()).collect();
    if (0..ring.len()).all(|at| turn(&flat, around(&ring, at)) >= 0.0) { fan() } else { cut_ears(&flat, ring) }
}

/// The polygon in the plane of the two axes in which its area is largest, counter-clockwise.
fn project(corners: &[[f32; 3]]) -> Vec<DVec2> {
    let points: Vec<DVec3> = corners.iter().map(|corner| DVec3::from_array(corner.map(f64::from))).collect();
    // Twice the area's vector, by Newell's method.
    let next = points.iter().cycle().skip(1);
    let area: DVec3 = points.iter().zip(next).map(|(a, b)| (a - points[0]).cross(b - points[0])).sum();
    let size = area.abs();
    let (u, v, upright) = match (size.x >= size.y && size.x >= size.z, size.y >= size.z) {
        (true, _) => (1, 2, area.x),
        (_, true) => (2, 0, area.y),
        _ => (0, 1, area.z),
    };
    let sign = if upright < 0.0 { -1.0 } else { 1.0 };
    points.iter().map(|point| DVec2::new(point[u] * sign, point[v])).collect()
}

/// The corners before, at and after place `at` of a ring.
fn around(ring: &[usize], at: usize) -> [usize; 3] {
    let count = ring.len();
    [ring[(at + count - 1) % count], ring[at], ring[(at + 1) % count]]
}

/// Twice the area of a triangle: positive where it turns left.
fn turn(flat: &[DVec2], [a, b, c]: [usize; 3]) -> f64 {
    (flat[b] - flat[a]).perp_dot(flat[c] - flat[b])
}

fn cut_ears(flat: &[DVec2], mut ring: Vec<usize>) -> Vec<[usize; 3]> {
    let mut triangles = Vec::with_capacity(ring.len() - 2);
    while ring.len() > 3 {
        // A polygon that crosses itself may have no ear: then any corner is cut off.
        let ear = (0..ring.len()).find(|&at| is_ear(flat, &ring, at)).unwrap_or(0);
        triangles.push(around(&ring, ear));
        ring.remove(ear);
    }
    triangles.push([ring[0], ring[1], ring[2]]);
    triangles
}

/// Whether a corner turns left and no other corner lies in its triangle.
fn is_ear(flat: &[DVec2], ring: &[usize], at: usize) -> bool {
    let ear = around(ring, at);
    let [a, b, c] = ear;
    let inside =
        |&p: &usize| !ear.contains(&p) && turn(flat, [a, b, p]) >= 0.0 && turn(flat, [b, c, p]) >= 0.0 && turn(flat, [c, a, p]) >= 0.0;
    turn(flat, ear) > 0.0 && !ring.iter().any(inside)
}
