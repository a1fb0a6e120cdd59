//! Scenes under maps that must change nothing but what they say.

use super::*;
use crate::scene::Surface;

/// Texture coordinates of planes are scene units: they are left out.
fn scaled(surface: Option<Surface>, scale: f64) -> Option<Surface> {
    surface.map(|s| Surface { point: s.point * scale, t: s.t * scale, error: s.error * scale, uv: glam::DVec2::ZERO, ..s })
}

/// Every length of an object multiplied by a power of two.
fn scale_object(object: &Object, mesh: crate::description::AssetId, scale: f64) -> Object {
    let by = |v: [f64; 3]| v.map(|x| x * scale);
    let mut object = object.clone();
    object.transform = object.transform.map(|rows| rows.map(|[x, y, z, t]| [x, y, z, t * scale]));
    if let ObjectKind::Shape { shape, .. } = &mut object.kind {
        *shape = match *shape {
            Shape::Sphere { center, radius } => Shape::Sphere { center: by(center), radius: radius * scale },
            Shape::Plane { point, normal } => Shape::Plane { point: by(point), normal },
            Shape::Box { min, max } => Shape::Box { min: by(min), max: by(max) },
            Shape::Disc { center, normal, radius } => Shape::Disc { center: by(center), normal, radius: radius * scale },
            Shape::Mesh { .. } => Shape::Mesh { data: mesh },
            Shape::Rectangle { corner, edge_u, edge_v } => Shape::Rectangle { corner: by(corner), edge_u: by(edge_u), edge_v: by(edge_v) },
            Shape::Cylinder { from, to, radius, capped } => Shape::Cylinder { from: by(from), to: by(to), radius: radius * scale, capped },
            Shape::Cone { from, to, radius, to_radius, capped } => {
                Shape::Cone { from: by(from), to: by(to), radius: radius * scale, to_radius: to_radius * scale, capped }
            }
        };
    }
    object
}

#[test]
fn a_scene_scaled_by_a_power_of_two_is_hit_at_the_same_bits() {
    let original = everything(6, 60);
    let scene = original.compile();
    let rays = rays_of(&scene, 10_000);
    for exponent in [-60, -20, 20, 60] {
        let scale = crate::math::exp2(f64::from(exponent));
        let mut mesh = ball(12, 16, 0.1);
        for p in &mut mesh.positions {
            *p = p.map(|x| x * scale as f32);
        }
        let mut assets = MemoryAssets::default();
        let mesh = assets.insert(postcard::to_stdvec(&mesh).unwrap());
        let objects = original.objects.iter().map(|object| scale_object(object, mesh, scale)).collect();
        let large = Scene::compile_around(&frame(objects), &assets, DVec3::ZERO).unwrap();
        for ray in &rays {
            let other = Ray { origin: ray.origin * scale, ..*ray };
            assert_eq!(scaled(large.closest(&other), 1.0), scaled(scene.closest(ray), scale), "2^{exponent} {ray:?}");
        }
    }
}

/// The mirror image of a mesh, made by a transform or by its vertices.
#[test]
fn a_mirrored_instance_equals_the_mirrored_mesh() {
    let mesh = ball(20, 24, 0.2);
    let mut mirrored = mesh.clone();
    mirrored.positions.iter_mut().for_each(|p| p[0] = -p[0]);
    mirrored.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let by_transform = Maker::default().mesh(&mesh, DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))).compile();
    let by_vertices = Maker::default().mesh(&mirrored, DAffine3::IDENTITY).compile();
    let mut hits = 0;
    for ray in rays_of(&by_vertices, 20_000) {
        let (a, b) = (by_transform.closest(&ray), by_vertices.closest(&ray));
        assert_eq!(a.is_some(), b.is_some(), "{ray:?}");
        if let (Some(a), Some(b)) = (a, b) {
            assert_eq!((a.t.to_bits(), a.ng), (b.t.to_bits(), b.ng), "{ray:?}");
            assert!((a.point - b.point).length() <= a.error);
            hits += 1;
        }
    }
    assert!(hits > 500, "{hits}");
}

/// One object, placed by nested groups, by one matrix, or made there.
#[test]
fn nested_groups_are_the_product_of_their_transforms() {
    let mut random = Random(21);
    let (outer, inner) = (placement(&mut random), placement(&mut random));
    let unit = Shape::Sphere { center: [0.1, 0.2, 0.3], radius: 0.8 };
    let mut nested = frame(vec![]);
    let instance = |group, map| Object { kind: ObjectKind::Instance { group }, transform: Some(matrix(map)), source: SourceId::default() };
    nested.scene.groups = vec![
        Group { objects: vec![shape(unit.clone(), 0)] },
        Group { objects: vec![instance(0, inner)] },
        Group { objects: vec![instance(1, outer)] },
    ];
    nested.scene.root = 2;
    let nested = Scene::compile_around(&nested, &MemoryAssets::default(), DVec3::ZERO).unwrap();
    let direct = Maker::default().add(unit, outer * inner).compile();
    for ray in rays_of(&direct, 5_000) {
        assert_eq!(nested.closest(&ray), direct.closest(&ray));
    }
}

/// A sphere under an uneven scale is an ellipsoid: its points satisfy the ellipsoid's equation, its normals are that equation's gradient.
#[test]
fn normals_of_stretched_shapes_are_perpendicular_to_them() {
    let axes = DVec3::new(2.0, 0.5, 1.0);
    let scene = Maker::default().add(Shape::Sphere { center: [0.0; 3], radius: 1.0 }, DAffine3::from_scale(axes)).compile();
    let mut hits = 0;
    for ray in rays_of(&scene, 10_000) {
        let Some(surface) = scene.closest(&ray) else { continue };
        assert!(((surface.point / axes).length() - 1.0).abs() < 1e-14);
        let gradient = (surface.point / (axes * axes)).normalize();
        assert!((surface.ng - gradient).length() < 1e-14, "{surface:?}");
        hits += 1;
    }
    assert!(hits > 500, "{hits}");
}

#[test]
fn texture_coordinates_follow_their_conventions() {
    let mut frame =
        frame(vec![shape(Shape::Plane { point: [5.0, 0.0, 1.0], normal: [0.0, 2.0, 0.0] }, 0), sphere(DVec3::new(0.0, 2.0, 0.0), 1.0, 0)]);
    frame.scene.textures = vec![crate::description::Texture::Checker { even: [0.0; 3], odd: [1.0; 3], size: 1.0 }];
    frame.scene.materials[0] = Material::Diffuse { reflectance: [1.0; 3], texture: Some(0) };
    let scene = Scene::compile_around(&frame, &MemoryAssets::default(), DVec3::ZERO).unwrap();
    let mut random = Random(3);
    for _ in 0..1_000 {
        let origin = DVec3::new(random.signed() * 9.0, 1.0 + random.unit(), 30.0 + random.signed() * 9.0);
        let surface = scene.closest(&Ray::new(origin, -DVec3::Y)).unwrap();
        assert_eq!((surface.uv.x, surface.uv.y, surface.point.y), (origin.x, origin.z, 0.0));
    }
    let uv = |towards: DVec3| scene.closest(&Ray::new(DVec3::new(0.0, 2.0, 0.0) + towards * 1.5, -towards)).unwrap().uv;
    assert_eq!(uv(DVec3::Z).to_array(), [0.5, 0.5]);
    assert_eq!(uv(DVec3::X).to_array(), [0.75, 0.5]);
    assert_eq!(uv(DVec3::Y).y, 0.0);
}

/// The box of an instance holds every vertex, and hardly more, however it is turned and stretched.
#[test]
fn instances_have_close_boxes() {
    let (mesh, mut random) = (ball(40, 60, 0.2), Random(5));
    for _ in 0..100 {
        let map = placement(&mut random);
        let (low, high) = Maker::default().mesh(&mesh, map).compile().bounds().unwrap();
        let vertices = mesh.positions.iter().map(|p| map.transform_point3(glam::Vec3::from(*p).as_dvec3()));
        let (least, greatest) = vertices.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        assert!((low - 1e-12).cmple(least).all() && (high + 1e-12).cmpge(greatest).all(), "{map}");
        assert!((high - low).cmple((greatest - least) * 1.4).all(), "{} {} {map}", high - low, greatest - least);
    }
}
