//! Parts against the whole, and the light in them against closed forms.

use std::{
    f64::consts::PI,
    sync::atomic::{AtomicBool, Ordering},
};

use super::*;
use crate::{
    accel::Simd,
    description::{
        Aov, Aovs, Camera, Environment, Falloff, Film as FilmDescription, Filter, Frame, Group, Light, Material, MemoryAssets, Object,
        ObjectKind, Quality, Render, Rgb, Scene as SceneDescription, Shape, SourceId,
    },
    film::Film,
    scene::Scene,
};

const WHITTED: Render = Render::Whitted { max_depth: 8, transparent_shadows: false, min_weight: 0.0 };

const WHITE: Material = Material::Diffuse { reflectance: [1.0; 3], texture: None };

/// The floor y = 0.
const FLOOR: Shape = Shape::Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] };

fn glass(tint: f32) -> Material {
    Material::smooth_glass(1.5, [tint; 3])
}

/// What one ray through the middle of the only pixel sees of some shapes.
struct Look {
    eye: [f64; 3],
    at: [f64; 3],
    shapes: Vec<(Shape, Material)>,
    lights: Vec<Light>,
    background: Rgb,
    render: Render,
}

impl Look {
    fn down(shapes: Vec<(Shape, Material)>, lights: Vec<Light>) -> Self {
        Self { eye: [0.0, 1.0, 0.0], at: [0.0; 3], shapes, lights, background: [0.0; 3], render: WHITTED }
    }

    fn part(self) -> RenderedPart {
        let mut scene =
            SceneDescription { lights: self.lights, background: Environment::Constant(self.background), ..SceneDescription::default() };
        let mut group = Group::default();
        for (index, (shape, material)) in self.shapes.into_iter().enumerate() {
            scene.materials.push(material);
            let kind = ObjectKind::Shape { shape, material: index as u32 };
            group.objects.push(Object { kind, transform: None, source: SourceId::default() });
        }
        scene.groups.push(group);
        let frame = Frame {
            scene,
            camera: Camera::pinhole(self.eye, self.at, [0.0, 0.0, 1.0], 10.0),
            film: FilmDescription { width: 1, height: 1, filter: Filter::Point },
            render: self.render,
            quality: Quality::of(1),
            seed: 0,
            aovs: Aovs::NONE,
        };
        // Lights may be as near the floor as numbers go.
        let scene = Scene::compile_around(&frame, &MemoryAssets::default(), glam::DVec3::ZERO).unwrap();
        render(&scene, Rect { x: 0, y: 0, width: 1, height: 1 }, SampleRange { first: 0, count: 1 }, &AtomicBool::new(false)).unwrap()
    }

    fn radiance(self) -> f64 {
        self.part().pixels[0][0].into()
    }
}

fn point(y: f64, intensity: f32, falloff: Falloff) -> Light {
    Light::Point { position: [0.0, y, 0.0], intensity: [intensity; 3], falloff, source: SourceId::default() }
}

fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-6 * b.abs().max(1e-3), "{a} is not {b}");
}

#[test]
fn a_white_floor_under_a_directional_light_shows_irradiance_by_pi() {
    for (direction, cos) in [([0.0, -2.0, 0.0], 1.0), ([3.0, -4.0, 0.0], 0.8), ([1.0, 0.0, 0.0], 0.0), ([0.0, 1.0, 0.0], 0.0)] {
        for render in [Render::Raycast, WHITTED] {
            let light = Light::Directional { direction, irradiance: [2.0; 3], angle: 0.0, source: SourceId::default() };
            close(Look { render, ..Look::down(vec![(FLOOR, WHITE)], vec![light]) }.radiance(), 2.0 / PI * cos);
        }
    }
}

#[test]
fn a_point_light_weakens_with_the_square_of_the_distance_or_not_at_all() {
    for distance in [0.25, 0.5, 2.0, 7.0] {
        let look = |falloff| Look::down(vec![(FLOOR, WHITE)], vec![point(distance, 3.0, falloff)]).radiance();
        close(look(Falloff::InverseSquare), 3.0 / (PI * distance * distance));
        close(look(Falloff::None), 3.0);
    }
}

#[test]
fn both_sides_of_a_diffuse_surface_are_lit_but_each_by_the_lights_on_its_side() {
    let below = || Look { eye: [0.0, -1.0, 0.0], ..Look::down(vec![(FLOOR, WHITE)], vec![]) };
    close(Look { lights: vec![point(-2.0, 1.0, Falloff::None)], ..below() }.radiance(), 1.0);
    close(Look { lights: vec![point(2.0, 1.0, Falloff::None)], ..below() }.radiance(), 0.0);
}

/// A white disc above the eye.
fn roof(material: Material) -> (Shape, Material) {
    (Shape::Disc { center: [0.0, 2.0, 0.0], normal: [0.0, 1.0, 0.0], radius: 1.0 }, material)
}

#[test]
fn what_stands_before_a_light_casts_a_shadow_unless_rays_are_only_cast() {
    let look =
        |render, light| Look { render, ..Look::down(vec![(FLOOR, WHITE), roof(WHITE)], vec![point(light, 1.0, Falloff::None)]) }.radiance();
    close(look(WHITTED, 3.0), 0.0);
    close(look(WHITTED, 1.9), 1.0);
    close(look(Render::Raycast, 3.0), 1.0);
}

#[test]
fn glass_blocks_light_unless_shadows_are_transparent() {
    let look = |transparent_shadows, shape: Shape| {
        let render = Render::Whitted { max_depth: 8, transparent_shadows, min_weight: 0.0 };
        Look { render, ..Look::down(vec![(FLOOR, WHITE), (shape, glass(0.5))], vec![point(5.0, 1.0, Falloff::None)]) }.radiance()
    };
    let sphere = Shape::Sphere { center: [0.0, 3.0, 0.0], radius: 1.0 };
    close(look(false, sphere.clone()), 0.0);
    close(look(true, sphere), 0.25);
    close(look(true, roof(WHITE).0), 0.5);
}

#[test]
fn a_mirror_shows_its_share_on_both_sides() {
    for y in [1.0, -1.0] {
        let mirror = Material::Mirror { reflectance: [0.9; 3] };
        close(Look { eye: [0.0, y, 0.0], background: [2.0; 3], ..Look::down(vec![(FLOOR, mirror)], vec![]) }.radiance(), 1.8);
    }
}

#[test]
fn a_flat_interface_shows_what_fresnel_says() {
    // Background above and a black floor below: what is seen is what is reflected, 4 % straight on.
    let black = Material::Diffuse { reflectance: [0.0; 3], texture: None };
    let bottom = Shape::Plane { point: [0.0, -1.0, 0.0], normal: [0.0, 1.0, 0.0] };
    close(Look { background: [1.0; 3], ..Look::down(vec![(FLOOR, glass(1.0)), (bottom, black)], vec![]) }.radiance(), 0.04);
}

/// A furnace: colourless glass in uniform light cannot be seen, up to the chains that are longer than the limit.
#[test]
fn clear_glass_vanishes_in_uniform_light() {
    for offset in [0.0, 0.1, 0.5, 0.9, 0.999] {
        let sphere = Shape::Sphere { center: [0.0; 3], radius: 1.0 };
        let look = Look {
            eye: [offset, 3.0, 0.0],
            at: [offset, 0.0, 0.0],
            background: [1.0; 3],
            ..Look::down(vec![(sphere, glass(1.0))], vec![])
        };
        let render = Render::Whitted { max_depth: 60, transparent_shadows: false, min_weight: 0.0 };
        close(Look { render, ..look }.radiance(), 1.0);
    }
}

/// Between two mirrors of reflectance 1/2 a ray of weight 2^-n is followed while 2^-n is above the limit and the chain is not too long.
#[test]
fn chains_end_at_their_depth_and_at_their_weight() {
    let rays = |max_depth, min_weight| {
        let mirror = Material::Mirror { reflectance: [0.5, 0.25, 0.0] };
        let ceiling = Shape::Plane { point: [0.0, 3.0, 0.0], normal: [0.0, 1.0, 0.0] };
        let render = Render::Whitted { max_depth, transparent_shadows: false, min_weight };
        Look { render, ..Look::down(vec![(FLOOR, mirror.clone()), (ceiling, mirror)], vec![]) }.part().counters.secondary_rays
    };
    assert_eq!(rays(1, 0.0), 0);
    assert_eq!(rays(8, 0.0), 7);
    assert_eq!(rays(100, 0.01), 6);
    assert_eq!(rays(100, 0.5), 0, "a weight equal to the limit is not followed");
}

#[test]
fn an_invalid_sample_is_black_and_counted() {
    let part = Look::down(vec![(FLOOR, WHITE)], vec![point(1e-140, 1e38, Falloff::InverseSquare)]).part();
    assert_eq!((part.pixels[0], part.counters.invalid_samples), ([0.0; 3], 1));
    let part = Look::down(vec![(FLOOR, WHITE)], vec![point(1e-9, 1e38, Falloff::InverseSquare)]).part();
    assert_eq!((part.pixels[0], part.counters.invalid_samples), ([f32::MAX; 3], 0), "finite, but not in f32");
}

/// Every kind of work, with the instructions that every machine has and with the best of this one.
#[test]
fn pixels_are_the_same_with_all_instructions() {
    let pixels = |scene: &dyn Fn() -> Scene, simd| {
        let mut scene = scene().with_simd(simd);
        scene.aovs = Aov::ALL.into_iter().collect();
        let rect = Rect { x: 0, y: 0, width: scene.film.width, height: scene.film.height };
        let part = render(&scene, rect, SampleRange { first: 0, count: scene.quality.samples.into() }, &AtomicBool::new(false)).unwrap();
        part.pixels.into_iter().flatten().chain(part.extra).map(f32::to_bits).collect::<Vec<_>>()
    };
    assert_eq!(pixels(&busy, Simd::Baseline), pixels(&busy, Simd::detect()));
    assert_eq!(pixels(&busy_paths, Simd::Baseline), pixels(&busy_paths, Simd::detect()));
}

/// A frame of every kind of work.
fn busy() -> Scene {
    let (frame, assets) = canary(3).unwrap();
    Scene::compile(&frame, &assets).unwrap()
}

/// The same by path tracing, with all that this needs more.
fn busy_paths() -> Scene {
    let (frame, assets) = canary(3).unwrap();
    Scene::compile(&canary::in_all_light(frame), &assets).unwrap()
}

const WHOLE: SampleRange = SampleRange { first: 0, count: 5 };

/// Cuts a rectangle into parts of 1 x 1 to 16 x 16 pixels.
fn cut(rect: Rect, parts: &mut Vec<Rect>) {
    let Rect { x, y, width, height } = rect;
    // Any rule does; this one depends on the place, so that parts are of many sizes.
    if width > 16 || (width > 1 && (x * 7 + y * 3 + width) % 3 == 0) {
        cut(Rect { width: width / 3 + 1, ..rect }, parts);
        cut(Rect { x: x + width / 3 + 1, width: width - width / 3 - 1, ..rect }, parts);
    } else if height > 16 || (height > 1 && (x * 5 + y + height) % 3 == 0) {
        cut(Rect { height: height / 2, ..rect }, parts);
        cut(Rect { y: y + height / 2, height: height - height / 2, ..rect }, parts);
    } else {
        parts.push(rect);
    }
}

#[test]
fn parts_of_any_size_in_any_order_give_the_same_bytes() {
    [busy(), busy_paths()].into_iter().for_each(any_parts_give_the_same_bytes);
}

fn any_parts_give_the_same_bytes(mut scene: Scene) {
    let go = AtomicBool::new(false);
    let (width, height) = (scene.film.width, scene.film.height);
    let all = Rect { x: 0, y: 0, width, height };
    let mut parts = Vec::new();
    cut(all, &mut parts);
    assert!(parts.len() > 20 && parts.iter().map(Rect::area).sum::<u64>() == all.area());
    parts.sort_by_key(|rect| (rect.x * 31 + rect.y * 17) % 13);

    for aovs in [Aovs::NONE, Aov::ALL.into_iter().collect(), [Aov::Error].into_iter().collect()] {
        scene.aovs = aovs;
        let mut whole = Film::with_aovs(width, height, aovs);
        whole.place(&render(&scene, all, WHOLE, &go).unwrap()).unwrap();
        let mut film = Film::with_aovs(width, height, aovs);
        parts.iter().for_each(|&rect| film.place(&render(&scene, rect, WHOLE, &go).unwrap()).unwrap());
        assert_eq!(film.hash(), whole.hash(), "{aovs:?}");
    }
}

#[test]
fn pictures_are_extended_to_those_of_all_samples_at_once() {
    let go = AtomicBool::new(false);
    for mut scene in [busy(), busy_paths()] {
        scene.aovs = [Aov::Object, Aov::Samples, Aov::Residual].into_iter().collect();
        let (width, height) = (scene.film.width, scene.film.height);
        let taken = |first, count| {
            let mut film = Film::with_aovs(width, height, scene.aovs);
            film.place(&render(&scene, Rect { x: 0, y: 0, width, height }, SampleRange { first, count }, &go).unwrap()).unwrap();
            film
        };
        let mut film = taken(0, 2);
        assert!(film.pixels() != taken(2, 2).pixels(), "other samples see the same");
        for count in [2, 4, 8] {
            film = film.joined(&taken(count, count), count).unwrap();
            assert_eq!(film.hash(), taken(0, 2 * count).hash());
        }
        scene.aovs = Aov::ALL.into_iter().collect();
        let all = Film::with_aovs(width, height, scene.aovs);
        assert!(all.joined(&all, 1).is_none() && film.joined(&all, 1).is_none() && Film::new(3, 3).joined(&Film::new(3, 3), 1).is_none());
    }
}

#[test]
fn work_is_counted_alike_however_it_is_cut() {
    let scene = busy();
    let go = AtomicBool::new(false);
    let half = |x| render(&scene, Rect { x, y: 0, width: 32, height: 48 }, WHOLE, &go).unwrap().counters;
    let mut sum = half(0);
    sum += half(32);
    assert_eq!(sum, render(&scene, Rect { x: 0, y: 0, width: 64, height: 48 }, WHOLE, &go).unwrap().counters);
    assert_eq!(sum.camera_rays, 64 * 48 * 5);
}

#[test]
fn a_cancelled_part_ends_at_once() {
    let scene = busy();
    let cancel = AtomicBool::new(true);
    let rect = Rect { x: 0, y: 0, width: 64, height: 48 };
    assert_eq!(render(&scene, rect, WHOLE, &cancel), Err(Cancelled));
    assert_eq!(probe(&scene, rect, 4, &cancel), Err(Cancelled));
    cancel.store(false, Ordering::Relaxed);
    assert_eq!(probe(&scene, rect, 4, &cancel), Ok(16 * 12));
}
