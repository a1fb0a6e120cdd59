use glam::DVec3;
use proptest::prelude::*;

use crate::assets::polygon::triangulate;

fn area(a: [f32; 3], b: [f32; 3], c: [f32; 3]) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|p| DVec3::from_array(p.map(f64::from)));
    (b - a).cross(c - a) / 2.0
}

proptest! {
    /// A star-shaped polygon, bent as it likes, turned into any plane: the triangles cover its area once, none the other way round.
    #[test]
    fn triangles_cover_a_polygon_once(radii in proptest::collection::vec(0.2..3.0f64, 4..24), tilt in 0..3usize, mirrored: bool) {
        let count = radii.len();
        let points: Vec<[f32; 3]> = radii.iter().enumerate().map(|(i, radius)| {
            let angle = std::f64::consts::TAU * i as f64 / count as f64;
            let (x, y) = ((radius * angle.cos()) as f32, (radius * angle.sin()) as f32);
            let mut point = [x, if mirrored { -y } else { y }, 0.5 * x + 0.25 * y];
            point.rotate_left(tilt);
            point
        }).collect();
        let center = [0.0; 3];
        let whole: DVec3 = (0..count).map(|i| area(center, points[i], points[(i + 1) % count])).sum();
        let triangles = triangulate(&points);
        prop_assert_eq!(triangles.len(), count - 2);
        let direction = whole.normalize();
        let areas: Vec<f64> = triangles.iter().map(|&[a, b, c]| area(points[a], points[b], points[c]).dot(direction)).collect();
        prop_assert!(areas.iter().all(|&area| area > -1e-5), "{areas:?}");
        prop_assert!((areas.iter().sum::<f64>() - whole.length()).abs() < 1e-4 * whole.length());
    }

    /// Whatever the corners are: as many triangles as there should be, of corners that are there.
    #[test]
    fn any_polygon_makes_triangles(points in proptest::collection::vec(prop::array::uniform3(-2..3i8), 0..12)) {
        let points: Vec<[f32; 3]> = points.into_iter().map(|point| point.map(f32::from)).collect();
        let triangles = triangulate(&points);
        prop_assert_eq!(triangles.len(), points.len().saturating_sub(2));
        prop_assert!(triangles.as_flattened().iter().all(|&corner| corner < points.len()));
    }
}
