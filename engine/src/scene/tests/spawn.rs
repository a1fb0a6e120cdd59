//! Rays that leave a surface neither meet it again nor miss what lies close behind.

use super::*;

/// Shapes that a ray leaves for good on the one side, and crosses once more, or not at all, on the other.
fn convex_shapes() -> Vec<(Shape, u32)> {
    vec![
        (Shape::Sphere { center: [0.3, -0.2, 0.5], radius: 0.7 }, 1),
        (Shape::Box { min: [-0.5, -0.3, 0.1], max: [0.4, 0.6, 0.9] }, 1),
        (Shape::Disc { center: [0.3, -0.2, 0.5], normal: [0.3, 0.5, -0.4], radius: 0.7 }, 0),
        (Shape::Plane { point: [0.3, -0.2, 0.5], normal: [0.3, 0.5, -0.4] }, 0),
        (Shape::Rectangle { corner: [-0.3, -0.5, 0.1], edge_u: [0.7, 0.5, 0.3], edge_v: [-0.4, 0.6, 0.2] }, 0),
        (Shape::Cylinder { from: [-0.2, -0.5, 0.1], to: [0.4, 0.6, 0.7], radius: 0.4, capped: true }, 1),
        (Shape::Cone { from: [-0.2, -0.5, 0.1], to: [0.4, 0.6, 0.7], radius: 0.6, to_radius: 0.0, capped: true }, 1),
        (Shape::Cone { from: [-0.2, -0.5, 0.1], to: [0.4, 0.6, 0.7], radius: 0.2, to_radius: 0.5, capped: true }, 1),
    ]
}

/// A strictly convex mesh whose faces are no two in one plane.
fn octahedron() -> MeshData {
    let mut mesh = MeshData {
        positions: vec![[1.0, 0.1, 0.0], [-1.1, 0.0, 0.0], [0.0, 1.2, 0.1], [0.1, -0.9, 0.0], [0.0, 0.0, 1.0], [0.1, 0.0, -1.3]],
        ..Default::default()
    };
    for (x, y, z) in [(0, 2, 4), (1, 2, 4), (0, 3, 4), (1, 3, 4), (0, 2, 5), (1, 2, 5), (0, 3, 5), (1, 3, 5)] {
        let outward = (x + y + z) % 2 == 0;
        mesh.triangles.push(if outward { [x, y, z] } else { [y, x, z] });
    }
    mesh
}

fn crossings(scene: &Scene, ray: &Ray) -> u32 {
    let mut seen = 0;
    scene.any(ray, |_, _| {
        seen += 1;
        false
    });
    seen
}

fn check(scene: &Scene, behind: u32, size: f64, middle: DVec3, what: &str) {
    let mut random = Random(5);
    let mut checked = 0;
    for _ in 0..4_000 {
        let origin = middle + random.direction() * size * 4.0;
        let target = middle + random.point() * size;
        let Some(surface) = scene.closest(&Ray::new(origin, (target - origin).normalize())) else { continue };
        let mut direction = random.direction();
        if checked % 4 == 0 {
            // Grazing: nearly along the surface.
            direction = (direction - surface.ng * direction.dot(surface.ng) * (1.0 - random.unit() * 1e-6)).normalize();
        }
        // Without the note of what it leaves: it is the geometry that is tested.
        let ray = Ray { leaves: 0, ..surface.spawn(direction) };
        let outward = direction.dot(surface.ng) >= 0.0;
        let expected = if outward { 0 } else { behind };
        let seen = crossings(scene, &ray);
        // A grazing ray that goes in may come out across an edge that two faces share.
        assert!(
            seen == expected || (!outward && behind > 0 && (1..=2).contains(&seen)),
            "{what}: {seen} crossings instead of {expected}, {surface:?} {ray:?}"
        );
        checked += 1;
    }
    assert!(checked > 30, "{what}: {checked}");
}

#[test]
fn no_shape_is_met_again_at_any_scale_and_distance() {
    let mut random = Random(8);
    for exponent in [-8, -3, 0, 3, 8] {
        let scale = crate::math::pow(10.0, f64::from(exponent));
        for distance in [0.0, 1.0, 1e3, 1e6] {
            let linear = placement(&mut random).matrix3;
            let turned = DAffine3::from_mat3_translation(linear * scale, random.point() * scale * distance);
            let moved = DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::splat(scale)), random.point() * scale * distance);
            for map in [moved, turned] {
                let middle = map.transform_point3(DVec3::new(0.2, 0.0, 0.4));
                for (shape, behind) in convex_shapes() {
                    let what = format!("{shape:?} at {map:?}");
                    check(&Maker::default().add(shape, map).compile(), behind, scale, middle, &what);
                }
                check(&Maker::default().mesh(&octahedron(), map).compile(), 1, scale, map.translation, &format!("mesh at {map:?}"));
            }
        }
    }
}

/// Two spheres whose radii differ by 4e-5: the inner one is always found behind the outer one.
#[test]
fn concentric_shells_are_told_apart() {
    for radius in [1e-6, 1.0, 1e6] {
        let center = DVec3::new(3.0, -2.0, 1.0) * radius;
        let scene = compile(vec![sphere(center, radius, 0), sphere(center, radius * (1.0 + 4e-5), 1)]);
        let mut random = Random(1);
        for _ in 0..20_000 {
            let origin = center + random.direction() * radius * 5.0;
            let target = center + random.direction() * radius * 0.99 * random.unit();
            let ray = Ray::new(origin, (target - origin).normalize());
            let outer = scene.closest(&ray).unwrap();
            let inner = scene.closest(&outer.spawn(ray.direction)).unwrap();
            assert_eq!((outer.material, inner.material), (1, 0));
            let back = scene.closest(&inner.spawn(-ray.direction)).unwrap();
            assert_eq!(back.material, 1);
        }
    }
}

/// Far away small spheres are neither lost nor displaced (the bound of Ray Tracing Gems, ch. 7, in f64).
#[test]
fn distant_spheres_are_hit_on_their_surface() {
    let mut random = Random(4);
    for exponent in 0..=12 {
        let distance = crate::math::pow(10.0, f64::from(exponent));
        let center = random.direction() * distance * 0.5;
        let sphere = crate::shape::Sphere { center, radius: 1.0 };
        for _ in 0..2_000 {
            let origin = center + random.direction() * (distance + 2.0);
            let target = center + random.direction() * 0.9;
            let ray = Ray::new(origin, (target - origin).normalize());
            let reached = 1.0 - (target - center).cross(ray.direction).length();
            let Some(t) = sphere.closest::<true>(&ray) else {
                assert!(reached < 4.0 * f64::EPSILON * distance, "lost at distance {distance}");
                continue;
            };
            let radius = (ray.at(t) - center).length();
            assert!((radius - 1.0).abs() <= 8.0 * f64::EPSILON * (distance + 2.0), "{radius} at distance {distance}");
            let point = sphere.point(&ray, t);
            assert!(((point.position - center).length() - 1.0).abs() <= point.error);
        }
    }
}
