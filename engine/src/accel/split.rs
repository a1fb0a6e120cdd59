//! Spatial splits: a triangle whose box is mostly empty goes into a tree as several smaller boxes.

use glam::{Vec3, Vec3A};
use obvhs::{aabb::Aabb, splits::split_aabbs_precise, triangle::Triangle};

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

/// Boxes of larger area, in proportion to the mean one, are worth splitting.
const LARGE: f32 = 3.0;

/// A triangle is halved so many times at the most.
const HALVINGS: usize = 12;

/// As many boxes as triangles may be added, and these, so that a few huge ones in a small mesh are split well.
const FREE: usize = 1 << 14;

/// Meshes of more triangles are not split: that takes four times their memory.
const MOST: usize = 1 << 24;

/// Splits the boxes of triangles in normalised coordinates, by the heuristics of obvhs; `None` where that gains little, as on scans.
pub fn split(whole: &[Box3], vertices: impl Fn(u32) -> [Vec3; 3]) -> Option<References> {
    let area = total_area(whole);
    let mean = area / whole.len() as f32;
    let is_large = |b: &Box3| b.half_area() > LARGE * mean;
    let large: Vec<u32> = (0..whole.len() as u32).filter(|&i| is_large(&whole[i as usize])).collect();
    if whole.len() > MOST || large.iter().map(|&i| f64::from(whole[i as usize].half_area())).sum::<f64>() < f64::from(area * LEAST_GAIN) {
        return None;
    }
    let largest = whole.iter().map(Box3::half_area).fold(0.0, f32::max);
    let corners = |&triangle: &u32| {
        let [v0, v1, v2] = vertices(triangle).map(Vec3A::from);
        Triangle { v0, v1, v2 }
    };
    let corners: Vec<Triangle> = large.iter().map(corners).collect();
    let mut parts: Vec<Aabb> = large.iter().map(|&i| whole[i as usize]).map(|b| Aabb::new(b.min.into(), b.max.into())).collect();
    let mut owners: Vec<u32> = (0..large.len() as u32).collect();
    for _ in 0..HALVINGS {
        let before = parts.len();
        if before - large.len() + parts.iter().filter(|b| b.half_area() > LARGE * mean).count() > whole.len() + FREE {
            break;
        }
        halve(&mut parts, &mut owners, &corners, mean, largest);
        if parts.len() == before {
            break;
        }
    }
    let mut references = References { boxes: whole.to_vec(), triangles: (0..whole.len() as u32).collect() };
    for (at, (part, owner)) in parts.iter().zip(&owners).enumerate() {
        let triangle = large[*owner as usize];
        let grown = Box3 { min: Vec3::from(part.min) - CUT_ERROR, max: Vec3::from(part.max) + CUT_ERROR };
        let bounds = grown.intersection(whole[triangle as usize]);
        match large.get(at) {
            Some(&first) => references.boxes[first as usize] = bounds,
            None => {
                references.boxes.push(bounds);
                references.triangles.push(triangle);
            }
        }
    }
    (total_area(&references.boxes) < area * (1.0 - LEAST_GAIN)).then_some(references)
}

/// Halves once what is worth it, by the measure of `split_aabbs_preset`.
fn halve(parts: &mut Vec<Aabb>, owners: &mut Vec<u32>, corners: &[Triangle], mean: f32, largest: f32) {
    let high = (mean * 4.0).max(mean * 0.9 + largest * 0.1);
    split_aabbs_precise(parts, owners, corners, mean * LARGE, high, 1.8, 1.6, 1, 12);
}

fn total_area(boxes: &[Box3]) -> f32 {
    boxes.iter().map(|b| f64::from(b.half_area())).sum::<f64>() as f32
}
