//! The tree against every object in turn.

use super::*;
use crate::{
    accel::Simd,
    scene::{
        Crossing, Tracer, Work,
        geometry::{Geometry, LocalShape},
    },
    shape::triangle::Sheared,
};

/// Distance of the nearest hit and number of its object, by the exact intersections alone.
fn nearest(geometry: &Geometry, ray: &Ray) -> Option<(f64, u32)> {
    let mut hits: Vec<(f64, u32)> = Vec::new();
    hits.extend(geometry.planes.iter().filter_map(|p| Some((p.shape.closest(ray)?, p.object))));
    hits.extend(geometry.spheres.iter().filter_map(|p| Some((p.shape.closest::<true>(ray)?, p.object))));
    hits.extend(geometry.cuboids.iter().filter_map(|p| Some((p.shape.closest(ray)?.0, p.object))));
    hits.extend(geometry.discs.iter().filter_map(|p| Some((p.shape.closest(ray)?, p.object))));
    hits.extend(geometry.others.iter().filter_map(|p| Some((p.shape.closest(ray)?.0, p.object))));
    hits.extend(geometry.transformed.iter().filter_map(|p| {
        let local = ray.transformed(&p.shape.transform.to_object);
        let t = match &p.shape.shape {
            LocalShape::Sphere(sphere) => sphere.closest::<false>(&local)?,
            LocalShape::Cuboid(cuboid) => cuboid.closest(&local)?.0,
            LocalShape::Disc(disc) => disc.closest(&local)?,
            LocalShape::Other(other) => other.closest(&local)?.0,
        };
        Some((t, p.object))
    }));
    for p in &geometry.instances {
        let local = ray.transformed(&p.shape.transform.to_object);
        let (sheared, mesh) = (Sheared::new(local.origin, local.direction), &geometry.meshes[p.shape.mesh as usize].triangles);
        let of_triangle = |triangle| Some((sheared.hit(sheared.turned(mesh.vertices(triangle)))?.t, p.object));
        hits.extend((0..mesh.count() as u32).filter_map(of_triangle).filter(|(t, _)| *t < ray.t_max));
    }
    hits.into_iter().min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
}

/// The scene's own answer, with the number of the object found again by its distance.
fn found(scene: &Scene, ray: &Ray) -> Option<u64> {
    scene.closest(ray).map(|surface| surface.t.to_bits())
}

/// What many rays find at a time, and whether each crosses anything: by width, as single rays do.
fn check_streams(scene: &mut Scene, rays: &[Ray]) {
    struct Streams<'r>(&'r [Ray]);
    impl Work for Streams<'_> {
        type Output = ();

        fn run(self, scene: impl Tracer) {
            let Self(rays) = self;
            let mut next = 0;
            scene.hits(rays, |ray, hit| {
                assert_eq!((ray, hit), (next, scene.hit(&rays[ray])), "{:?}", rays[ray]);
                next += 1;
            });
            assert_eq!(next, rays.len());
            let blocks = |_, _: u32, _: &Crossing| true;
            scene.any_of(
                rays,
                |_| None,
                blocks,
                |ray, is_blocked| assert_eq!(is_blocked, scene.hit(&rays[ray]).is_some(), "{:?}", rays[ray]),
            );
        }
    }
    for simd in [Simd::Baseline, Simd::detect()] {
        scene.geometry.simd = simd;
        scene.run(Streams(rays));
    }
}

/// Holds a scene's answers against brute force, for both vector widths.
pub fn check(scene: &mut Scene, rays: &[Ray]) {
    check_streams(scene, rays);
    for ray in rays {
        let expected = nearest(&scene.geometry, ray);
        let bits = expected.map(|(t, _)| t.to_bits());
        for simd in [Simd::Baseline, Simd::detect()] {
            scene.geometry.simd = simd;
            assert_eq!(found(scene, ray), bits, "{simd:?} {ray:?}");
            assert_eq!(scene.any(ray, |_, _| true), bits.is_some(), "{simd:?} {ray:?}");
            if let Some((t, _)) = expected {
                let short = Ray { t_max: t, ..*ray };
                assert_eq!(found(scene, &short), None, "nothing lies before the nearest hit: {simd:?} {ray:?}");
                assert!(!scene.any(&short, |_, _| true), "{simd:?} {ray:?}");
            }
        }
    }
}

#[test]
fn spheres_on_a_floor_are_hit_as_without_a_tree() {
    let mut scene = compile(spheres_on_a_floor());
    let rays = rays_of(&scene, 50_000);
    check(&mut scene, &rays);
}

#[test]
fn all_shapes_and_instances_are_hit_as_without_a_tree() {
    for seed in 0..4 {
        let mut scene = everything(seed, 60).compile();
        let rays = rays_of(&scene, 5_000);
        check(&mut scene, &rays);
    }
}

/// Directions with zeros of both signs, and rays that lie in the planes of boxes and of flat meshes.
#[test]
fn rays_along_the_axes_are_hit_as_without_a_tree() {
    let mut maker = everything(9, 30);
    let square = MeshData {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    };
    maker.mesh(&square, DAffine3::IDENTITY);
    maker.add(Shape::Box { min: [0.0; 3], max: [1.0; 3] }, DAffine3::IDENTITY);
    let mut scene = maker.compile();
    let (mut random, mut rays) = (Random(3), Vec::new());
    let grid = |random: &mut Random| f64::from(random.bits() % 9) * 0.5 - 2.0;
    for _ in 0..3_000 {
        let origin = DVec3::new(grid(&mut random), grid(&mut random), grid(&mut random));
        let axis = random.bits() as usize % 3;
        let mut direction = DVec3::splat(if random.bits() % 2 == 0 { 0.0 } else { -0.0 });
        direction[axis] = if random.bits() % 2 == 0 { 1.0 } else { -1.0 };
        if random.bits() % 2 == 0 {
            direction[(axis + 1) % 3] = 1.0;
        }
        rays.push(Ray::new(origin, direction.normalize()));
    }
    check(&mut scene, &rays);
}

/// Long thin triangles, a stack of them and others at all angles, among many small ones: their boxes are nearly empty, so that the tree holds parts of
/// them. Rays aim at their edges and through the stack too.
fn slivers() -> (Scene, Vec<Ray>) {
    let (mut random, mut mesh, mut rays) = (Random(21), MeshData::default(), Vec::new());
    let mut add = |corners: [DVec3; 3]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners.map(|p| p.as_vec3().to_array()));
        mesh.triangles.push([first, first + 1, first + 2]);
    };
    for height in 0..20 {
        add([[-1.0, -1.0], [1.0, 1.0], [0.02, -0.02]].map(|[x, y]| DVec3::new(x, y, f64::from(height) * 0.1 - 1.0)));
    }
    for triangle in 0..4_000 {
        let (from, along) = (random.point(), random.direction() * if triangle < 400 { 2.0 } else { 0.01 });
        add([from, from + along, from + along * 0.5 + along.cross(random.direction()) * 0.005]);
        let (aim, origin) = (from.as_vec3().as_dvec3().lerp((from + along).as_vec3().as_dvec3(), random.unit()), random.point() * 4.0);
        rays.push(Ray::new(origin, (aim - origin).normalize()));
        rays.push(Ray::new(DVec3::new(0.005, -0.005, 4.0) + random.point() * 0.01, -DVec3::Z));
    }
    let mut maker = Maker::default();
    maker.mesh(&mesh, DAffine3::IDENTITY);
    let scene = maker.compile();
    assert!(scene.geometry.tree.as_ref().unwrap().is_split());
    rays.extend(rays_of(&scene, 1_000));
    (scene, rays)
}

#[test]
fn split_triangles_are_hit_as_without_a_tree() {
    let (mut scene, rays) = slivers();
    check(&mut scene, &rays);
}

/// However many leaves hold a part of it, and also where a ray goes through many.
#[test]
fn a_split_triangle_is_crossed_once() {
    let (scene, rays) = slivers();
    let mesh = &scene.geometry.meshes[0].triangles;
    let mut expected = Vec::new();
    for ray in &rays {
        let sheared = Sheared::new(ray.origin, ray.direction);
        let hits = (0..mesh.count() as u32).filter(|&triangle| sheared.hit(sheared.turned(mesh.vertices(triangle))).is_some()).count();
        let mut crossings = 0;
        assert!(!scene.any(ray, |_, _| {
            crossings += 1;
            false
        }));
        assert_eq!(crossings, hits, "{ray:?}");
        expected.push(hits);
    }
    struct Counting<'r>(&'r [Ray]);
    impl Work for Counting<'_> {
        type Output = Vec<usize>;

        fn run(self, scene: impl Tracer) -> Vec<usize> {
            let mut crossings = vec![0; self.0.len()];
            scene.any_of(
                self.0,
                |_| None,
                |ray, _, _| {
                    crossings[ray] += 1;
                    false
                },
                |_, is_blocked| assert!(!is_blocked),
            );
            crossings
        }
    }
    assert_eq!(scene.run(Counting(&rays)), expected);
    let most = expected.into_iter().max().unwrap();
    assert!(most > 8, "{most}");
}

/// Short rays that start near one another, of all sizes, some of which end just behind what they meet first.
#[test]
fn bundles_of_short_rays_find_what_single_rays_find() {
    let mut meshes = Maker::default();
    meshes.mesh(&ball(60, 80, 0.2), placement(&mut Random(3)));
    meshes.mesh(&ball(30, 20, 0.1), placement(&mut Random(5)));
    for mut scene in [meshes.compile(), everything(1, 60).compile()] {
        let (mut random, mut rays) = (Random(23), Vec::new());
        for seen in rays_of(&scene, 1_500) {
            let Some(surface) = scene.closest(&seen) else { continue };
            let size = 10f64.powf(-5.0 * random.unit());
            for _ in 0..64 {
                let mut ray = Ray::new(surface.point + random.point() * size, random.direction());
                ray.t_max = random.unit() * size * 2.0;
                if random.bits().is_multiple_of(2)
                    && let Some(met) = scene.closest(&Ray { t_max: size * 2.0, ..ray })
                {
                    ray.t_max = met.t.next_up();
                }
                rays.push(ray);
            }
        }
        check_streams(&mut scene, &rays);
    }
}

/// Rays that go the same way, eight at a time, and those that do not, some of them short, some that are not sound, beside a plane and a sphere.
#[test]
fn streams_find_what_single_rays_find() {
    let mut maker = Maker::default();
    maker.mesh(&ball(60, 80, 0.2), placement(&mut Random(3)));
    maker.add(Shape::Plane { point: [0.0, -1.2, 0.0], normal: [0.0, 1.0, 0.1] }, DAffine3::IDENTITY);
    maker.add(Shape::Sphere { center: [0.5, 1.0, 2.0], radius: 0.4 }, DAffine3::IDENTITY);
    let mut scene = maker.compile();
    let mut random = Random(17);
    let mut rays: Vec<Ray> =
        (0..8_192).map(|i| scene.camera.ray(f64::from(i % 128) * 8.0, f64::from(i / 128) * 12.0, DVec2::ZERO)).collect();
    rays.extend((0..8_192).map(|i| scene.camera.ray(480.0 + f64::from(i % 128) * 0.5, 400.0 + f64::from(i / 128) * 0.5, DVec2::ZERO)));
    rays.extend(rays_of(&scene, 8_000));
    for ray in &mut rays[8_192..] {
        ray.t_max = if random.bits().is_multiple_of(4) { random.unit() * 20.0 } else { f64::INFINITY };
    }
    for (origin, direction) in [(f64::NAN, 1.0), (f64::INFINITY, 1.0), (1e300, 1.0), (0.0, f64::NAN)] {
        let at = random.bits() as usize % rays.len();
        rays[at] = Ray::new(DVec3::splat(origin), DVec3::X * direction);
    }
    rays.truncate(rays.len() - 3);
    check_streams(&mut scene, &rays);
    let hits = rays.iter().filter(|ray| scene.closest(ray).is_some()).count();
    assert!(hits > rays.len() / 4, "{hits}");
}

/// A mesh by itself, from so near and so far away that boxes can tell something or nothing, eight rays at a time from about one place, and each from elsewhere; one of
/// every eight from nowhere.
#[test]
fn distant_and_broken_rays_in_streams_find_what_they_find_alone() {
    let mut scene = Maker::default().mesh(&ball(30, 40, 0.2), DAffine3::IDENTITY).compile();
    let mut random = Random(31);
    for exponent in (0..48).map(|step| 1.0 + f64::from(step) * 0.5) {
        let distance = crate::math::exp2(exponent);
        let mut rays = Vec::new();
        for group in 0..64 {
            let from = random.direction();
            for lane in 0..8 {
                let from = if group % 2 == 0 { from * (1.0 + 0.2 * random.signed()) } else { random.direction() };
                let (target, origin) = (random.point() * 0.05, from * distance);
                let broken = group % 4 == 2 && lane == group / 4 % 8;
                let direction = (target - origin).normalize();
                rays.push(Ray::new(if broken { DVec3::new(f64::NAN, origin.y, origin.z) } else { origin }, direction));
            }
        }
        check_streams(&mut scene, &rays);
    }
}

/// Balls, turned and scaled, near the origin and far from it, twice or so each: their triangles stand in the tree of the world, but for those of one that is stretched, and of
/// one that is there too often. From near and far, singly and in streams.
#[test]
fn triangles_of_moved_meshes_are_hit_as_without_a_tree() {
    for (seed, middle) in [(41, DVec3::ZERO), (42, DVec3::new(300.0, -20.0, 1e4))] {
        let (mut random, mut maker) = (Random(seed), Maker::default());
        for kind in 0..12 {
            let mesh = ball(6 + kind, 10, 0.2);
            let times = if kind == 5 { 40 } else { 1 + kind % 2 };
            for _ in 0..times {
                let turn = glam::DQuat::from_axis_angle(random.direction(), random.unit() * 6.0);
                let stretch = if kind == 4 { DVec3::new(9.0, 0.5, 0.5) } else { DVec3::splat(0.2 + random.unit()) };
                maker.mesh(&mesh, DAffine3::from_scale_rotation_translation(stretch, turn, middle + random.point() * 3.0));
            }
        }
        let still = ball(20, 20, 0.1);
        maker.mesh(&still, DAffine3::IDENTITY);
        maker.add(Shape::Sphere { center: (middle + DVec3::X * 4.0).into(), radius: 1.0 }, DAffine3::IDENTITY);
        let mut scene = maker.compile();
        let of_their_own = scene.geometry.meshes.iter().filter(|mesh| mesh.tree.is_some()).count();
        assert_eq!(of_their_own, 2, "meshes that have a tree of their own");
        let mut rays = Vec::new();
        for i in 0..6_000 {
            let origin = middle + random.point() * [4.0, 30.0, 1e4, 1e8][i % 4];
            let target = if i % 16 == 0 { random.point() } else { middle + random.point() * 3.5 };
            let t_max = if i % 5 == 0 { random.unit() * 8.0 } else { f64::INFINITY };
            rays.push(Ray { t_max, ..Ray::new(origin, (target - origin).normalize()) });
        }
        let hits = rays.iter().filter(|ray| scene.closest(ray).is_some()).count();
        assert!(hits > rays.len() / 4, "{hits}");
        check(&mut scene, &rays);
    }
}

/// From a thousand to 10^12 scene sizes away.
#[test]
fn distant_rays_are_hit_as_without_a_tree() {
    let mut scene = everything(13, 60).compile();
    let mut random = Random(13);
    let mut rays = Vec::new();
    for exponent in [3, 6, 9, 12] {
        for _ in 0..1_000 {
            let target = random.point() * 4.0;
            let origin = target + random.direction() * crate::math::pow(10.0, f64::from(exponent));
            rays.push(Ray::new(origin, (target - origin).normalize()));
        }
    }
    check(&mut scene, &rays);
}

/// Their boxes are as flat as they are, and no flatter; rays pass along them.
#[test]
fn slightly_tilted_discs_and_cylinders_are_hit_as_without_a_tree() {
    let (mut random, mut maker, mut rays) = (Random(17), Maker::default(), Vec::new());
    for i in 0..40 {
        let tilt = 2e-8 * random.unit();
        let (center, normal) = (DVec3::new(0.0, f64::from(i % 2), 0.0), DVec3::new(-tilt, 1.0, 0.0));
        let radius = 1.0 + random.unit();
        if i % 4 < 2 {
            maker.add(Shape::Disc { center: center.into(), normal: normal.into(), radius }, DAffine3::IDENTITY);
        } else {
            let to = center + normal * 0.25;
            maker.add(Shape::Cylinder { from: center.into(), to: to.into(), radius, capped: true }, DAffine3::IDENTITY);
        }
        // Through the disc not far from its highest point, and just below the cylinder's first end.
        let height = center.y + radius * tilt * (random.unit() * 2.0 - 1.0);
        rays.extend([-5.0, 5.0].map(|x: f64| Ray::new(DVec3::new(x, height, 0.1), DVec3::X.copysign(DVec3::splat(-x)) * DVec3::X)));
    }
    check(&mut maker.compile(), &rays);
}

/// Every bit of every surface is the same with either vector width.
#[test]
fn vector_widths_give_the_same_bits() {
    let mut scene = everything(5, 200).compile();
    let rays = rays_of(&scene, 20_000);
    let mut surfaces = |simd| {
        scene.geometry.simd = simd;
        rays.iter().map(|ray| scene.closest(ray)).collect::<Vec<_>>()
    };
    assert_eq!(surfaces(Simd::Baseline), surfaces(Simd::detect()));
}

#[test]
fn crossings_come_each_once() {
    let scene = compile(vec![
        shape(Shape::Plane { point: [0.0, -1.0, 0.0], normal: [0.0, 1.0, 0.0] }, 0),
        sphere(DVec3::new(0.0, 3.0, 0.0), 1.0, 1),
        shape(Shape::Box { min: [-1.0, 5.0, -1.0], max: [1.0, 6.0, 1.0] }, 2),
        shape(Shape::Disc { center: [0.0, 8.0, 0.0], normal: [0.0, 1.0, 0.1], radius: 1.0 }, 0),
        shape(Shape::Rectangle { corner: [-1.0, 9.0, -1.0], edge_u: [2.0, 0.0, 0.0], edge_v: [0.0, 0.5, 2.0] }, 1),
        shape(Shape::Cylinder { from: [0.0, 10.0, 0.0], to: [0.0, 11.0, 0.1], radius: 1.0, capped: true }, 2),
        shape(Shape::Cylinder { from: [0.0, 12.0, 0.0], to: [0.0, 13.0, 0.1], radius: 1.0, capped: false }, 0),
        shape(Shape::Cone { from: [0.0, 14.0, 0.0], to: [0.0, 15.0, 0.0], radius: 1.0, to_radius: 0.0, capped: true }, 1),
        shape(Shape::Cone { from: [0.0, 16.0, 0.0], to: [0.0, 17.0, 0.0], radius: 1.0, to_radius: 0.0, capped: false }, 2),
    ]);
    let mut seen = Vec::new();
    assert!(!scene.any(&Ray::new(DVec3::new(0.1, 20.0, 0.1), -DVec3::Y), |material, crossing| {
        seen.push((crossing.t, material));
        false
    }));
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert_eq!(seen.iter().map(|(_, material)| *material).collect::<Vec<_>>(), [2, 1, 1, 2, 2, 1, 0, 2, 2, 1, 1, 0]);
}
