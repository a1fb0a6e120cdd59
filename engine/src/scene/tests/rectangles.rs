//! Rectangles against closed forms, and against the two triangles that they are.

use super::*;
use crate::shape::Rectangle;

#[test]
fn corners_and_edges_belong_to_a_rectangle() {
    let rectangle = Rectangle::new(DVec3::ZERO, DVec3::new(0.7, 0.0, 0.0), DVec3::new(0.0, 0.0, -0.9)).unwrap();
    let down = |x: f64, z: f64| Ray::new(DVec3::new(x, 2.0, z), -DVec3::Y);
    for (a, b) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.5, 0.25)] {
        let ray = down(0.7 * a, -0.9 * b);
        assert_eq!(rectangle.closest(&ray), Some(2.0), "{a} {b}");
        let point = rectangle.point(&ray, 2.0);
        assert!((point.uv - glam::DVec2::new(a, 1.0 - b)).length() < 1e-15 && (point.position - ray.at(2.0)).length() < 1e-15, "{point:?}");
        assert_eq!(point.normal, DVec3::Y);
    }
    for (x, z) in [(-1e-300, -0.1), (0.7f64.next_up(), -0.1), (0.5, 1e-300), (0.5, (-0.9f64).next_down())] {
        assert_eq!(rectangle.closest(&down(x, z)), None);
    }
    assert_eq!(rectangle.closest(&Ray::new(DVec3::new(0.5, 0.0, -3.0), DVec3::Z)), None, "along it");
    assert_eq!(rectangle.closest(&Ray::new(DVec3::new(0.5, -1.0, -0.5), -DVec3::Y)), None, "behind");
}

/// Of any angle and at any place, also where a map stretches and mirrors it: a mesh of f32 coordinates is the same surface.
#[test]
fn rectangles_are_hit_as_their_triangles_are() {
    let mut random = Random(41);
    let mut hits = 0;
    for _ in 0..200 {
        let [corner, u, v] = [random.point(), random.point(), random.point()].map(|p| (p * 1024.0).round() / 1024.0);
        let corners = [corner, corner + u, corner + u + v, corner + v].map(|p| p.as_vec3().to_array());
        let mesh = MeshData { positions: corners.to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]], ..Default::default() };
        let map = if random.bits().is_multiple_of(2) { DAffine3::IDENTITY } else { placement(&mut random) };
        let flat = Shape::Rectangle { corner: corner.into(), edge_u: u.into(), edge_v: v.into() };
        let (flat, mesh) = (Maker::default().add(flat, map).compile(), Maker::default().mesh(&mesh, map).compile());
        for _ in 0..200 {
            let origin = random.point() * 8.0;
            let target = map.transform_point3(corner + u * random.unit() * 1.2 + v * random.unit() * 1.2);
            let ray = Ray::new(origin, (target - origin).normalize());
            let (a, b) = (flat.closest(&ray), mesh.closest(&ray));
            assert_eq!(a.is_some(), b.is_some(), "{ray:?}");
            let (Some(a), Some(b)) = (a, b) else { continue };
            // The plane is certain but for rounding, where on it a grazing ray meets it is not.
            assert!((a.t - b.t).abs() * ray.direction.dot(a.ng).abs() <= a.error, "{a:?} {b:?}");
            assert!((a.ng - b.ng).length() < 1e-11 && a.color == b.color, "{a:?} {b:?}");
            hits += 1;
        }
    }
    assert!(hits > 10_000, "{hits}");
}

/// Also where a ray comes from so far away that it is rounded beyond an edge.
#[test]
fn points_of_rectangles_lie_on_them() {
    let mut random = Random(43);
    let mut hits = 0;
    for _ in 0..20_000 {
        let (corner, u, v) = (random.point(), random.direction(), random.direction());
        let rectangle = Rectangle::new(corner, u, v).unwrap();
        let target = corner + u * f64::from(random.bits() % 2) + v * random.unit();
        let direction = random.direction();
        let ray = Ray::new(target - direction * 1e8 * random.unit(), direction);
        let Some(t) = rectangle.closest(&ray) else { continue };
        let point = rectangle.point(&ray, t);
        assert!(point.uv.cmpge(glam::DVec2::ZERO).all() && point.uv.cmple(glam::DVec2::ONE).all(), "{point:?}");
        let expected = corner + u * point.uv.x + v * (1.0 - point.uv.y);
        assert!((point.position - expected).length() < 1e-15 && (point.position - ray.at(t)).length() < 1e-6 / u.cross(v).length());
        hits += 1;
    }
    assert!(hits > 5_000, "{hits}");
}

/// By a power of two, so that nothing is rounded.
#[test]
fn rectangles_are_scaled_as_a_whole() {
    let mut random = Random(44);
    let [corner, u, v] = [random.point(), random.point(), random.point()];
    let large = Rectangle::new(corner * 4.0, u * 4.0, v * 4.0);
    assert_eq!(Some(Rectangle::new(corner, u, v).unwrap().moved(4.0, DVec3::ZERO)), large);
}

/// Texture coordinates run along the edges, whatever their angle.
#[test]
fn texture_coordinates_of_rectangles_are_those_of_their_corners() {
    let mut random = Random(42);
    for _ in 0..2_000 {
        let (corner, u, v) = (random.point(), random.direction(), random.direction());
        let rectangle = Rectangle::new(corner, u, v).unwrap();
        let (a, b) = (random.unit(), random.unit());
        let target = corner + u * a + v * b;
        let origin = target + random.direction();
        let ray = Ray::new(origin, target - origin);
        let sine = u.cross(v).length();
        let Some(t) = rectangle.closest(&ray) else { continue };
        let uv = rectangle.point(&ray, t).uv;
        assert!((uv - glam::DVec2::new(a, 1.0 - b)).length() * sine * ray.direction.dot(u.cross(v) / sine).abs() < 1e-14, "{uv} {a} {b}");
    }
}
