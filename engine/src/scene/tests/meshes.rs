//! Triangle meshes: watertight, indifferent to degenerate input, the same wherever they are.

use super::*;

fn mesh_scene(mesh: &MeshData) -> Scene {
    Maker::default().mesh(mesh, DAffine3::IDENTITY).compile()
}

/// From inside a closed mesh every ray meets it, above all one that is aimed at an edge or at a vertex.
fn count_leaks(mesh: &MeshData, inside: DVec3, size: f64, count: u32) -> u32 {
    let scene = mesh_scene(mesh);
    let mut random = Random(11);
    let vertex = |i: u32| glam::Vec3::from(mesh.positions[i as usize]).as_dvec3();
    let mut leaks = 0;
    for i in 0..count {
        let triangle = mesh.triangles[random.bits() as usize % mesh.triangles.len()];
        let corner = random.bits() as usize % 3;
        let (a, b) = (vertex(triangle[corner]), vertex(triangle[(corner + 1) % 3]));
        let target = if i % 2 == 0 { a } else { a.lerp(b, random.unit()) };
        let origin = inside + random.point() * size * 0.3;
        let ray = Ray::new(origin, (target - origin).normalize());
        leaks += u32::from(scene.closest(&ray).is_none()) + u32::from(!scene.any(&ray, |_, _| true));
    }
    leaks
}

#[test]
fn no_ray_slips_through_edges_or_vertices_of_a_closed_mesh() {
    assert_eq!(count_leaks(&ball(60, 80, 0.2), DVec3::ZERO, 1.0, 1_000_000), 0);
}

/// Far from the origin f32 positions are coarse, but the mesh stays closed; at other scales it stays what it is.
#[test]
fn closed_meshes_stay_closed_far_away_and_at_any_scale() {
    let ball = ball(40, 40, 0.2);
    let offset = DVec3::new(148_376.0, 1_234.0, -223_423.0);
    let mut moved = ball.clone();
    for p in &mut moved.positions {
        *p = (glam::Vec3::from(*p).as_dvec3() + offset).as_vec3().into();
    }
    assert_eq!(count_leaks(&moved, offset, 1.0, 100_000), 0);
    for exponent in [-60, 60] {
        let scale = crate::math::exp2(f64::from(exponent));
        let mut scaled = ball.clone();
        for p in &mut scaled.positions {
            *p = (glam::Vec3::from(*p).as_dvec3() * scale).as_vec3().into();
        }
        assert_eq!(count_leaks(&scaled, DVec3::ZERO, scale, 100_000), 0, "scale 2^{exponent}");
    }
}

/// Long thin triangles meet at the poles of a ball of few rows.
#[test]
fn needles_do_not_leak() {
    assert_eq!(count_leaks(&ball(3, 2_000, 0.0), DVec3::ZERO, 0.3, 100_000), 0);
}

#[test]
fn degenerate_and_duplicate_triangles_change_nothing() {
    let clean = ball(20, 20, 0.1);
    let mut dirty = clean.clone();
    for i in 0..200u32 {
        let [a, b, c] = clean.triangles[i as usize];
        dirty.triangles.extend([[a, a, b], [c, c, c], [a, b, c]]);
    }
    let (clean, dirty) = (mesh_scene(&clean), mesh_scene(&dirty));
    for ray in rays_of(&clean, 20_000) {
        assert_eq!(clean.closest(&ray), dirty.closest(&ray), "{ray:?}");
    }
}

/// Triangles of a few units in the last place of their distance: products of coordinates beside the ray, once rounded, do not tell their vertices apart.
#[test]
fn triangles_far_below_resolution_are_passed_by() {
    let (mut random, eye) = (Random(12), DVec3::new(0.0, 3.5, 11.0));
    for _ in 0..2_000 {
        let size = crate::math::pow(10.0, -15.5 + 2.0 * random.unit());
        let mut corner = || (random.point() * size).as_vec3().to_array();
        let mesh = MeshData { positions: vec![corner(), corner(), corner()], triangles: vec![[0, 1, 2]], ..Default::default() };
        let scene = mesh_scene(&mesh);
        for _ in 0..100 {
            let beside = eye.cross(random.direction()).normalize() * (1.0 + random.unit() * 2.0);
            let ray = Ray::new(eye, (beside - eye).normalize());
            assert_eq!(scene.closest(&ray), None, "size {size:e}, {:?}", mesh.positions);
        }
    }
}

#[test]
fn coincident_objects_are_won_by_the_earlier() {
    let mut random = Random(2);
    let (mesh, map) = (ball(12, 12, 0.1), placement(&mut random));
    let scene = Maker::default().mesh(&mesh, map).mesh(&mesh, map).mesh(&mesh, map).compile();
    let mut hits = 0;
    for ray in rays_of(&scene, 20_000) {
        if let Some(surface) = scene.closest(&ray) {
            assert_eq!(surface.material, 0);
            hits += 1;
        }
    }
    assert!(hits > 1_000);
}

/// Thousands of boxes about one middle, or in one corner: neither slow to build nor too deep to traverse.
#[test]
fn nested_shells_are_built_and_crossed_one_by_one() {
    let mut mesh = MeshData::default();
    for shell in 0..3_000u32 {
        let size = 1.0 + shell as f32 * 0.001;
        let first = 6 * shell;
        mesh.positions.extend([
            [size, 0.0, 0.0],
            [-size, 0.0, 0.0],
            [0.0, size, 0.0],
            [0.0, -size, 0.0],
            [0.0, 0.0, size],
            [0.0, 0.0, -size],
        ]);
        for (x, y, z) in [(0, 2, 4), (1, 2, 4), (0, 3, 4), (1, 3, 4), (0, 2, 5), (1, 2, 5), (0, 3, 5), (1, 3, 5)] {
            mesh.triangles.push([first + x, first + y, first + z]);
        }
    }
    let shells = mesh_scene(&mesh);
    let spheres = compile((0..3_000).map(|i| sphere(DVec3::ZERO, 1.0 + f64::from(i) * 0.001, 0)).collect());
    for scene in [shells, spheres] {
        let mut ray = Ray::new(DVec3::new(30.0, -0.1, 0.2), -DVec3::X);
        let mut hits = 0;
        while let Some(surface) = scene.closest(&ray) {
            ray = surface.spawn(ray.direction);
            hits += 1;
        }
        assert_eq!(hits, 6_000);
    }
}

/// Flat shading where there are no normals, or where they cannot be used.
#[test]
fn unusable_normals_give_way_to_the_triangles_own() {
    let mut mesh = ball(8, 8, 0.0);
    let flat = mesh_scene(&mesh);
    mesh.normals = vec![[0.0; 3]; mesh.positions.len()];
    let zero = mesh_scene(&mesh);
    mesh.normals = vec![[f32::NAN; 3]; mesh.positions.len()];
    let nan = mesh_scene(&mesh);
    for ray in rays_of(&flat, 5_000) {
        let expected = flat.closest(&ray);
        assert!(expected.is_none_or(|surface| surface.ns == surface.ng));
        assert_eq!(zero.closest(&ray), expected);
        assert_eq!(nan.closest(&ray), expected);
    }
}

/// A mesh with the normals of a ball is shaded like one.
#[test]
fn normals_are_interpolated() {
    let mut mesh = ball(40, 40, 0.0);
    mesh.normals = mesh.positions.clone();
    let scene = mesh_scene(&mesh);
    for ray in rays_of(&scene, 5_000) {
        if let Some(surface) = scene.closest(&ray) {
            assert!((surface.ns - surface.point.normalize()).length() < 1e-3);
            assert!((surface.ns.length() - 1.0).abs() < 1e-12 && surface.ns.dot(surface.ng) > 0.0);
        }
    }
}

/// Single-sided surfaces are seen through from behind; cut-away surfaces from both sides.
#[test]
fn backs_and_masked_surfaces_are_passed_through() {
    let mut scene = mesh_scene(&ball(16, 16, 0.0));
    let from_outside = Ray::new(DVec3::new(0.1, 0.2, 5.0), -DVec3::Z);
    let near = scene.closest(&from_outside).unwrap().t;
    let crossings = |scene: &Scene, ray: &Ray| {
        let mut seen = 0;
        scene.any(ray, |_, _| {
            seen += 1;
            false
        });
        seen
    };
    assert_eq!(crossings(&scene, &from_outside), 2);
    scene.geometry.instances[0].shape.masked = true;
    scene.materials[0].double_sided = false;
    assert_eq!(scene.closest(&from_outside).unwrap().t, near);
    assert_eq!(crossings(&scene, &from_outside), 1);
    let from_inside = Ray::new(DVec3::ZERO, -DVec3::Z);
    assert!(scene.closest(&from_inside).is_none() && !scene.any(&from_inside, |_, _| true));
    scene.materials[0].double_sided = true;
    scene.materials[0].alpha_cutoff = Some(0.5);
    scene.materials[0].base_alpha = 0.4;
    assert!(scene.closest(&from_outside).is_none() && !scene.any(&from_outside, |_, _| true));
    scene.materials[0].base_alpha = 0.5;
    assert_eq!(scene.closest(&from_outside).unwrap().t, near);
}

/// Corners in one line, which rounding lets rays meet: they get a normal nevertheless.
#[test]
fn triangles_without_area_have_normals() {
    let corners = [[0.75, 0.5, 0.0], [1.25, 1.0, 0.5], [1.0, 0.75, 0.25]];
    let mesh = MeshData { positions: corners.to_vec(), triangles: vec![[0, 1, 2]], ..Default::default() };
    let (scene, mut random, mut hits) = (mesh_scene(&mesh), Random(2), 0);
    let [from, to, _] = corners.map(|p| glam::Vec3::from(p).as_dvec3());
    for _ in 0..100_000 {
        let origin = random.point() * 3.0;
        let ray = Ray::new(origin, (from.lerp(to, random.unit()) - origin).normalize());
        if let Some(surface) = scene.closest(&ray) {
            hits += 1;
            assert!(surface.ng.is_normalized() && surface.ns.is_normalized(), "{surface:?}");
        }
    }
    assert!(hits > 100, "{hits}");
}
