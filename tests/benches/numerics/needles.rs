//! Triangles that are hardly any: needles, points, duplicates, and those far below the resolution of the numbers.

use glam::{DAffine3, DVec3};
use tessera_engine::{
    description::MeshData,
    scene::{Scene, Surface},
    shape::Ray,
};

use super::{
    scenes::{World, ask, ball, corners, towards},
    trial::{Random, Tally, bits, run},
};

/// Triangles, none of which shares a vertex with another.
fn soup(count: usize, mut triangle: impl FnMut(usize) -> [DVec3; 3]) -> MeshData {
    let positions = (0..count).flat_map(|i| triangle(i).map(|p| p.as_vec3().to_array())).collect();
    MeshData { positions, triangles: (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(), ..Default::default() }
}

/// Of every aspect up to 10^12; of no area, exactly or but for rounding; points; and duplicates.
fn needles(random: &mut Random) -> MeshData {
    soup(400, |i| {
        let (from, along) = (random.point(), random.direction());
        let across = along.cross(random.direction()) * random.power(-12.0, 0.0);
        let exact = DVec3::new(0.25 * (i % 5) as f64, 0.5, 0.125 * (i % 3) as f64);
        match i % 5 {
            0 | 1 => [from, from + along, from + along * 0.5 + across],
            2 => [from, from + along, from + along * 0.5],
            3 => [exact, exact + 0.5, exact + 0.25],
            _ => [exact; 3],
        }
    })
}

/// The vertices of a triangle, as they are stored.
fn bits_of(mesh: &MeshData, triangle: usize) -> [[u32; 3]; 3] {
    mesh.triangles[triangle].map(|i| mesh.positions[i as usize].map(f32::to_bits))
}

fn is_sound(surface: &Surface) -> bool {
    let vectors = [surface.point, surface.ng, surface.ns];
    vectors.iter().all(|v| v.is_finite()) && surface.t > 0.0 && surface.t.is_finite() && surface.error >= 0.0 && surface.error.is_finite()
}

/// Numbers of every hit, and that all ways to ask agree.
pub fn finite(rays: u64) -> Tally {
    let mut random = Random::new(3);
    let meshes: Vec<(MeshData, Scene)> = (0..8)
        .map(|_| {
            let mut mesh = needles(&mut random);
            mesh.triangles.extend_from_within(..);
            let scene = World::of_mesh(&mesh, DAffine3::IDENTITY).compile();
            (mesh, scene)
        })
        .collect();
    run(rays, |random, count, tally| {
        let (mesh, scene) = &meshes[random.below(meshes.len())];
        let aim = |random: &mut Random| {
            let [a, b, _] = corners(mesh, random.below(mesh.triangles.len()));
            towards(random.point() * 3.0, a.lerp(b, random.unit()))
        };
        let rays: Vec<Ray> = (0..count).map(|_| aim(random)).filter(|ray| ray.direction.is_finite()).collect();
        for (ray, answer) in rays.iter().zip(ask(scene, &rays)) {
            let surface = scene.closest(ray);
            let sound = surface.as_ref().is_none_or(is_sound) && answer.agrees() && surface.is_some() == answer.hits[0].is_some();
            tally.check(sound, || {
                let met = answer.hits[0].map(|hit| bits_of(mesh, hit.part as usize));
                format!("triangle {met:x?} with {surface:?}: {}", answer.told(ray))
            });
        }
    })
}

/// A closed mesh with degenerate and duplicate triangles is the mesh without them.
pub fn dirty(rays: u64) -> Tally {
    let clean = ball(20, 20, 0.1);
    let mut dirty = clean.clone();
    for [a, b, c] in &clean.triangles {
        dirty.triangles.extend([[*a, *a, *b], [*c, *c, *c], [*a, *b, *c]]);
    }
    let [clean, dirty] = [clean, dirty].map(|mesh| World::of_mesh(&mesh, DAffine3::IDENTITY).compile());
    run(rays, |random, count, tally| {
        let rays: Vec<Ray> = (0..count).map(|_| towards(random.direction() * 4.0, random.point())).collect();
        for ((ray, clean), dirty) in rays.iter().zip(ask(&clean, &rays)).zip(ask(&dirty, &rays)) {
            tally.check(clean == dirty, || format!("{clean:?} with more: {}", dirty.told(ray)));
        }
    })
}

/// Triangles of all sizes about a point; rays from (0, 3.5, 11) pass by at distances from 1,000 sizes and one millionth to 3.
pub fn specks(rays: u64) -> Tally {
    let eye = DVec3::new(0.0, 3.5, 11.0);
    run(rays, |random, count, tally| {
        let size = random.power(-20.0, -6.0);
        let mesh = soup(1, |_| [(); 3].map(|()| random.point() * size));
        let scene = World::of_mesh(&mesh, DAffine3::IDENTITY).compile();
        let by = |random: &mut Random| {
            let aside = eye.normalize().cross(random.direction()).normalize() * random.power((size * 1e3).max(1e-6).log10(), 0.5);
            towards(eye, aside)
        };
        let rays: Vec<Ray> = (0..count).map(|_| by(random)).collect();
        for (ray, answer) in rays.iter().zip(ask(&scene, &rays)) {
            tally.check(answer.is_missed(), || format!("size {size:e}, triangle {:x?}: {}", bits_of(&mesh, 0), bits(ray)));
        }
    })
}
