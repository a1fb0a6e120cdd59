//! Rays from the eye and towards lights have ways of their own: these find what the general ways find.

use super::*;
use crate::{
    accel::Simd,
    description::{Falloff, Light},
    light,
    material::Ideal,
    scene::{Tracer, Work},
};

/// Compares the ways for rays from the eye to `targets`, and for what they meet and every light. Gives hits, and blocked and free lights.
struct Compare(Vec<DVec3>);

impl Work for Compare {
    type Output = [u32; 3];

    fn run(self, scene: impl Tracer) -> [u32; 3] {
        let [mut hits, mut blocked, mut free] = [0; 3];
        for target in self.0 {
            let ray = Ray::new(scene.camera.eye(), (target - scene.camera.eye()).normalize());
            let mut met = None;
            scene.hits_from_eye(&[ray], |_, hit| met = hit.and_then(|hit| scene.surface(&ray, &hit)));
            assert_eq!(met, scene.closest(&ray), "{ray:?}");
            let Some(surface) = met else { continue };
            hits += 1;
            for (index, light) in scene.lights.iter().enumerate() {
                for side in [1.0, -1.0] {
                    let start = surface.start(side);
                    let light::LightSample { direction, distance, .. } = light.sample(start);
                    if direction.dot(surface.ng) * side <= 0.0 {
                        continue;
                    }
                    let ray = Ray { origin: start, direction, t_max: distance, leaves: surface.leaves(side) };
                    let opaque = |material: u32| !matches!(scene.materials[material as usize].ideal, Ideal::Glass { .. });
                    let expected = scene.any(&Ray { leaves: 0, ..ray }, |material, _| opaque(material));
                    assert_eq!(scene.any_before_light(index, &ray, |material, _| opaque(material)), expected, "{ray:?}");
                    *(if expected { &mut blocked } else { &mut free }) += 1;
                }
            }
        }
        [hits, blocked, free]
    }
}

/// Lights outside, within and on spheres, and one without a place.
fn lights() -> Vec<Light> {
    let point = |position| Light::Point { position, intensity: [1.0; 3], falloff: Falloff::None, source: SourceId::default() };
    let sun = Light::Directional { direction: [0.3, -1.0, 0.2], irradiance: [1.0; 3], angle: 0.0, source: SourceId::default() };
    vec![point([-6.0, 9.0, 6.0]), point([-4.5, 1.6, -6.4]), point([1.2, 2.5, 2.5]), point([1.0, 900.0, -2000.0]), sun]
}

#[test]
fn the_short_ways_find_what_the_general_ways_find() {
    for transparent_shadows in [false, true] {
        let mut frame = frame(spheres_on_a_floor());
        frame.scene.lights = lights();
        frame.render = Render::Whitted { max_depth: 8, transparent_shadows, min_weight: 0.0 };
        let mut scene = Scene::compile_around(&frame, &MemoryAssets::default(), DVec3::ZERO).unwrap();
        let mut random = Random(11);
        // Also far out on the floor, where segments are too long to be filtered.
        let targets =
            |random: &mut Random| (0..20_000).map(|i| random.point() * [6.0, 6.0, 60.0, 1e5][i % 4] * DVec3::new(1.0, 0.2, 1.0)).collect();
        for simd in [Simd::Baseline, Simd::detect()] {
            scene.geometry.simd = simd;
            let [hits, blocked, free] = scene.run(Compare(targets(&mut random)));
            assert!(hits > 10_000 && blocked > 3_000 && free > 10_000, "{hits} {blocked} {free}");
        }
    }
}
