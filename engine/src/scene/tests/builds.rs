//! Meshes that builders of trees fear: built the same everywhere, and hit as without a tree.

use super::{brute_force::check, *};

/// A triangle of its number.
type Make = fn(u32) -> [DVec3; 3];

const COUNT: u32 = 600;

const FEARED: [(&str, Make); 11] = [
    ("equal", |_| [DVec3::ZERO, DVec3::X, DVec3::Y]),
    ("points", |_| [DVec3::ONE; 3]),
    ("shells", |i| octant(i % 8, 1.0 + f64::from(i / 8) * 1e-3)),
    ("in a corner", |i| octant(0, 1.0 + f64::from(i) * 1e-3)),
    ("shrinking", |i| octant(i % 8, crate::math::exp2(-0.06 * f64::from(i)))),
    ("huge", |i| random(i, 1.0)),
    ("slivers", |i| {
        let [a, b, c] = random(i, 0.5);
        [a, b, b + (c - b) * 1e-6]
    }),
    ("a bundle", |i| [DVec3::ZERO, DVec3::ONE, DVec3::ONE].map(|p| p + Random(u64::from(i)).point() * 0.01)),
    ("giants", |i| random(i, if i % 50 == 0 { 2.0 } else { 0.01 })),
    ("at both ends of all numbers", |i| random(i, 0.5).map(|p| p * if i % 2 == 0 { 1e38 } else { 1e-38 })),
    ("denormal", |i| random(i, 0.5).map(|p| p * 1e-42)),
];

fn octant(octant: u32, size: f64) -> [DVec3; 3] {
    let side = |bit: u32| if octant & bit == 0 { size } else { -size };
    [DVec3::X * side(1), DVec3::Y * side(2), DVec3::Z * side(4)]
}

fn random(i: u32, size: f64) -> [DVec3; 3] {
    let mut numbers = Random(u64::from(i) * 77);
    let middle = numbers.point();
    [(); 3].map(|()| middle + numbers.point() * size)
}

fn feared(make: Make) -> Scene {
    let mesh = MeshData {
        positions: (0..COUNT).flat_map(make).map(|p| p.as_vec3().into()).collect(),
        triangles: (0..COUNT).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..Default::default()
    };
    Maker::default().mesh(&mesh, DAffine3::IDENTITY).compile()
}

#[test]
fn feared_meshes_are_hit_as_without_a_tree() {
    for (name, make) in FEARED {
        let mut scene = feared(make);
        let rays = rays_of(&scene, 400);
        println!("{name}");
        check(&mut scene, &rays);
    }
}

/// A mesh so large that threads share the work, with slivers, which are split.
#[test]
fn a_tree_is_the_same_however_many_threads_build_it() {
    let make = |i: u32| {
        let is_sliver = i.is_multiple_of(8);
        let [a, b, c] = random(i, if is_sliver { 0.5 } else { 0.01 });
        [a, b, if is_sliver { b + (c - b) * 1e-3 } else { c }]
    };
    let mesh = MeshData {
        positions: (0..60_000).flat_map(make).map(|p| p.as_vec3().into()).collect(),
        triangles: (0..60_000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..Default::default()
    };
    let hashes = [1, 2, 3, 8, 64].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let scene = pool.install(|| Maker::default().mesh(&mesh, DAffine3::IDENTITY).compile());
        assert!(scene.geometry.tree.as_ref().unwrap().is_split());
        scene.tree_hash()
    });
    assert_eq!(hashes, [hashes[0]; 5]);
}

/// One, two and eight threads that build at once, each in an order of its own.
#[test]
fn trees_are_the_same_on_any_number_of_threads() {
    let hashes = |first: usize| {
        let mut hashes: Vec<_> =
            (first..first + FEARED.len()).map(|i| i % FEARED.len()).map(|i| (i, feared(FEARED[i].1).tree_hash())).collect();
        hashes.sort_unstable();
        hashes
    };
    let expected = hashes(0);
    let mut different: Vec<_> = expected.iter().map(|(_, hash)| hash).collect();
    different.sort_unstable();
    different.dedup();
    assert_eq!(different.len(), FEARED.len());
    for threads in [1, 2, 8] {
        std::thread::scope(|scope| {
            let builds: Vec<_> = (0..threads).map(|first| scope.spawn(move || hashes(first))).collect();
            builds.into_iter().for_each(|build| assert_eq!(build.join().unwrap(), expected));
        });
    }
}
