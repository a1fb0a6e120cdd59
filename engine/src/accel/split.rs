//! Spatial splits: a triangle whose box is mostly empty goes into a tree as several smaller boxes.

use glam::{Vec3, Vec3A};
use obvhs::{aabb::Aabb, splits::split_aabbs_preset, triangle::Triangle};

use super::build::Box3;

/// Boxes, and the triangle that each of them holds a part of.
pub struct References {
    /// Boxes around parts of triangles.
    pub boxes: Vec<Box3>,
    /// The triangle of each.
    pub triangles: Vec<u32>,
}

/// How far a cut may be off: a point of an edge is a corner, at most 1, and a share of the edge, at most 2. With u = 2^-24, six operations make that share wrong
/// by up to 12 u, adding it by another u, and growing a box by this by one more.
const CUT_ERROR: f32 = 1.0 / (1 << 20) as f32;

/// Splitting that takes away less than this share of all boxes' areas is not worth more boxes.
const LEAST_GAIN: f32 = 0.05;

/// Splits the boxes of triangles in normalised coordinates, by the heuristics of obvhs; `None` where that gains little, as on scans.
pub fn split(whole: &[Box3], vertices: impl Fn(u32) -> [Vec3; 3]) -> Option<References> {
    let area = total_area(whole);
    let largest = whole.iter().map(Box3::half_area).fold(0.0, f32::max);
    let mut triangles: Vec<u32> = (0..whole.len() as u32).collect();
    let cut = |triangle: &u32| {
        let [v0, v1, v2] = vertices(*triangle).map(Vec3A::from);
        Triangle { v0, v1, v2 }
    };
    let corners: Vec<Triangle> = triangles.iter().map(cut).collect();
    let mut boxes: Vec<Aabb> = whole.iter().map(|b| Aabb::new(b.min.into(), b.max.into())).collect();
    split_aabbs_preset(&mut boxes, &mut triangles, &corners, area / whole.len() as f32, largest);
    let grown = |b: &Aabb| Box3 { min: Vec3::from(b.min) - CUT_ERROR, max: Vec3::from(b.max) + CUT_ERROR };
    let boxes: Vec<Box3> =
        boxes.iter().zip(&triangles).map(|(part, triangle)| grown(part).intersection(whole[*triangle as usize])).collect();
    (total_area(&boxes) < area * (1.0 - LEAST_GAIN)).then_some(References { boxes, triangles })
}

fn total_area(boxes: &[Box3]) -> f32 {
    boxes.iter().map(|b| f64::from(b.half_area())).sum::<f64>() as f32
}
