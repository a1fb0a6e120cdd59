//! What frames tell beside colours, against closed forms.

use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};

use super::*;
use crate::{
    description::{
        Aov, Aovs, Camera, Environment, Film, Filter, Frame, Group, Material, Medium, MemoryAssets, Object, ObjectKind, Quality, Render,
        Scene as SceneDescription, Shape, SourceId,
    },
    scene::Scene,
};

const SIDE: u32 = 4;
const EYE: [f64; 3] = [3.0, 5.0, -2.0];
const FLOOR: Shape = Shape::Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] };
const GREY: Material = Material::Diffuse { reflectance: [0.25, 0.5, 0.75], texture: None };
const RAYCAST: Render = Render::Raycast;
const WHITTED: Render = Render::Whitted { max_depth: 4, transparent_shadows: false, min_weight: 0.0 };
const PATH: Render = Render::Path { max_depth: 4, roulette_depth: 4, smooth_terminator: false };

/// The floor as `EYE` sees it from above, with something before it.
fn frame(before: Vec<(Shape, Material)>, render: Render) -> Frame {
    let mut scene = SceneDescription { background: Environment::Constant([1.0; 3]), ..SceneDescription::default() };
    let mut group = Group::default();
    for (shape, material) in before.into_iter().chain([(FLOOR, GREY)]) {
        let kind = ObjectKind::Shape { shape, material: scene.materials.len() as u32 };
        scene.materials.push(material);
        group.objects.push(Object { kind, transform: None, source: SourceId::default() });
    }
    scene.groups.push(group);
    Frame {
        scene,
        camera: Camera::pinhole(EYE, [EYE[0], 0.0, EYE[2]], [0.0, 0.0, 1.0], 60.0),
        film: Film { width: SIDE, height: SIDE, filter: Filter::Point },
        render,
        quality: Quality::of(3),
        seed: 1,
        aovs: Aov::ALL.into_iter().collect(),
    }
}

fn compiled(frame: &Frame) -> Scene {
    Scene::compile(frame, &MemoryAssets::default()).unwrap()
}

fn rendered(scene: &Scene) -> RenderedPart {
    let rect = Rect { x: 0, y: 0, width: scene.film.width, height: scene.film.height };
    render(scene, rect, SampleRange { first: 0, count: scene.quality.samples.into() }, &AtomicBool::new(false)).unwrap()
}

/// The numbers of one variable in each pixel.
fn told(scene: &Scene, aov: Aov) -> Vec<Vec<f32>> {
    let alone: Aovs = [aov].into_iter().collect();
    let all = scene.aovs;
    let at = all.channels().position(|name| name == aov.channels()[0]).unwrap();
    let part = rendered(scene);
    assert_eq!(part.extra.len(), part.pixels.len() * all.numbers());
    part.extra.chunks(all.numbers()).map(|pixel| pixel[at..][..alone.numbers()].to_vec()).collect()
}

#[test]
fn a_floor_is_told_as_it_is() {
    for render in [RAYCAST, WHITTED, PATH] {
        let scene = compiled(&frame(vec![], render));
        let pixels = SIDE * SIDE;
        assert_eq!(told(&scene, Aov::Normal), vec![[0.0, 1.0, 0.0]; pixels as usize]);
        assert_eq!(told(&scene, Aov::Albedo), vec![[0.25, 0.5, 0.75]; pixels as usize]);
        assert_eq!(told(&scene, Aov::Object), vec![[1.0]; pixels as usize]);
        assert_eq!(told(&scene, Aov::Material), vec![[1.0]; pixels as usize]);
        assert_eq!(told(&scene, Aov::Samples), vec![[3.0]; pixels as usize]);
        let (depths, positions) = (told(&scene, Aov::Depth), told(&scene, Aov::Position));
        for (i, (depth, position)) in (0..pixels).zip(depths.iter().zip(&positions)) {
            let ray = scene.camera.ray(f64::from(i % SIDE) + 0.5, f64::from(i / SIDE) + 0.5, DVec2::ZERO);
            let distance = -EYE[1] / ray.direction.y;
            let place = DVec3::from(EYE) + ray.direction * distance;
            assert!((f64::from(depth[0]) - distance).abs() < 1e-6 * distance, "{depth:?} is not {distance}");
            for (told, place) in position.iter().zip(place.to_array()) {
                assert!((f64::from(*told) - place).abs() < 1e-6, "{position:?} is not {place}");
            }
        }
    }
}

#[test]
fn straight_down_it_is_exact_and_from_below_its_normal_turns() {
    for (y, normal) in [(5.0, [0.0, 1.0, 0.0]), (-0.75, [0.0, -1.0, 0.0])] {
        let mut frame = frame(vec![], WHITTED);
        frame.camera = Camera::pinhole([EYE[0], y, EYE[2]], [EYE[0], 0.0, EYE[2]], [0.0, 0.0, 1.0], 60.0);
        (frame.film.width, frame.film.height) = (1, 1);
        let scene = compiled(&frame);
        assert_eq!(told(&scene, Aov::Depth), [[y.abs() as f32]]);
        assert_eq!(told(&scene, Aov::Position), [[3.0, 0.0, -2.0]]);
        assert_eq!(told(&scene, Aov::Normal), [normal]);
    }
}

#[test]
fn nothing_is_told_as_nothing() {
    for render in [RAYCAST, WHITTED, PATH] {
        let mut frame = frame(vec![], render);
        frame.camera = Camera::pinhole(EYE, [EYE[0], 9.0, EYE[2]], [0.0, 0.0, 1.0], 60.0);
        let scene = compiled(&frame);
        for aov in Aov::ALL {
            let expected = match aov {
                Aov::Depth => Aov::FARTHEST,
                Aov::Samples => 3.0,
                _ => 0.0,
            };
            assert!(told(&scene, aov).iter().flatten().all(|number| *number == expected), "{aov:?}");
        }
    }
}

/// A roof at height 2 over the left half of each pixel's column, seen straight down without perspective and without a floor.
fn half_covered(material: Material, samples: u32) -> Frame {
    let roof = Shape::Rectangle { corner: [-10.0, 2.0, -10.0], edge_u: [10.0, 0.0, 0.0], edge_v: [0.0, 0.0, 20.0] };
    let mut frame = frame(vec![(roof, material)], PATH);
    frame.scene.groups[0].objects.truncate(1);
    frame.camera = Camera::Orthographic { eye: [0.0, 5.0, 0.0], look_at: [0.0; 3], up: [0.0, 0.0, 1.0], width: 2.0 };
    frame.film = Film { width: 1, height: 1, filter: Filter::Box };
    frame.quality.samples = samples;
    frame.scene.background = Environment::Constant([0.0; 3]);
    frame
}

#[test]
fn depth_and_position_are_those_of_what_is_there_and_the_rest_is_filtered() {
    let scene = compiled(&half_covered(GREY, 64));
    let [depth] = told(&scene, Aov::Depth)[0][..] else { unreachable!() };
    assert_eq!(depth, 3.0);
    let position = &told(&scene, Aov::Position)[0];
    assert!((position[0] + 0.5).abs() < 0.1 && position[1] == 2.0, "{position:?}");
    let share = told(&scene, Aov::Normal)[0][1];
    assert!((share - 0.5).abs() <= 0.05, "{share}");
    assert_eq!(told(&scene, Aov::Albedo)[0], [0.25 * share, 0.5 * share, 0.75 * share]);
}

/// Each sample is 1 with a probability of a half, and else 0: a mean of m has the standard error of a share, and is as near to a half as that says.
#[test]
fn the_error_of_yes_and_no_is_that_of_their_share() {
    for samples in [2, 16, 101] {
        let shines = Material::Emitter { radiance: [1.0, 2.0, 0.0], texture: None, two_sided: true };
        let scene = compiled(&half_covered(shines, samples));
        let mean = f64::from(rendered(&scene).pixels[0][0]);
        let expected = (mean * (1.0 - mean) / f64::from(samples - 1)).sqrt();
        let error = &told(&scene, Aov::Error)[0];
        assert!((f64::from(error[0]) - expected).abs() < 1e-6 && error[1] == 2.0 * error[0] && error[2] == 0.0, "{error:?}, {expected}");
        assert!((mean - 0.5).abs() <= 3.0 * expected + 1e-6, "{mean} +- {expected}");
    }
}

#[test]
fn what_never_differs_has_no_error() {
    let mut frame = frame(vec![], RAYCAST);
    frame.scene.groups[0].objects.clear();
    frame.film.filter = Filter::Box;
    frame.scene.background = Environment::Constant([0.1, 0.7, 1e9]);
    frame.quality.samples = 33;
    assert!(told(&compiled(&frame), Aov::Error).iter().flatten().all(|number| *number == 0.0));
    frame.quality.samples = 1;
    assert!(told(&compiled(&frame), Aov::Error).iter().flatten().all(|number| *number == 0.0));
}

#[test]
fn things_and_materials_are_numbered_from_one() {
    let disc = |y: f64| Shape::Disc { center: [EYE[0], y, EYE[2]], normal: [0.0, 1.0, 0.0], radius: 0.1 };
    let mut frame = frame(vec![(disc(1.0), GREY), (disc(2.0), Material::Mirror { reflectance: [0.5, 0.25, 1.0] })], WHITTED);
    (frame.film.width, frame.film.height) = (3, 3);
    let scene = compiled(&frame);
    let expected: Vec<Vec<f32>> = (0..9).map(|i| vec![if i == 4 { 2.0 } else { 3.0 }]).collect();
    assert_eq!(told(&scene, Aov::Object), expected);
    assert_eq!(told(&scene, Aov::Material), expected);
    assert_eq!(told(&scene, Aov::Albedo)[4], [0.5, 0.25, 1.0]);
    assert_eq!(told(&scene, Aov::Depth)[4], [3.0]);
}

#[test]
fn clear_glass_passes_all_light_on_and_tinted_glass_its_share() {
    let ball = Shape::Sphere { center: [EYE[0], 2.0, EYE[2]], radius: 1.0 };
    for render in [RAYCAST, WHITTED, PATH] {
        for (tint, expected) in [(1.0, 1.0), (0.5, 0.04 + 0.96 * 0.5)] {
            let mut frame = frame(vec![(ball.clone(), Material::smooth_glass(1.5, [tint; 3]))], render.clone());
            (frame.film.width, frame.film.height) = (1, 1);
            let scene = compiled(&frame);
            assert!((told(&scene, Aov::Albedo)[0][0] - expected).abs() < 1e-6);
            assert_eq!(told(&scene, Aov::Depth), [[2.0]]);
        }
    }
}

#[test]
fn path_tracing_looks_through_what_cannot_be_seen() {
    let fog = Medium { absorption: [0.1; 3], scattering: [0.0; 3], anisotropy: 0.0 };
    let ball = Shape::Sphere { center: [EYE[0], 2.0, EYE[2]], radius: 1.0 };
    let mut frame = frame(vec![(ball, Material::Boundary { interior: fog })], PATH);
    (frame.film.width, frame.film.height) = (1, 1);
    let scene = compiled(&frame);
    assert_eq!((told(&scene, Aov::Depth), told(&scene, Aov::Object)), (vec![vec![5.0]], vec![vec![2.0]]));
    frame.render = WHITTED;
    let scene = compiled(&frame);
    assert_eq!((told(&scene, Aov::Depth), told(&scene, Aov::Object)), (vec![vec![2.0]], vec![vec![1.0]]));
}

/// Whoever asks for more gets the same picture, and whoever asks for nothing the same hash as ever.
#[test]
fn colours_and_work_do_not_depend_on_what_is_told_beside_them() {
    for filter in [Filter::Box, Filter::Mitchell] {
        for render in [RAYCAST, WHITTED, PATH] {
            let mut frame = frame(vec![(Shape::Sphere { center: [EYE[0], 2.0, EYE[2]], radius: 1.0 }, GREY)], render);
            frame.film.filter = filter;
            let with = rendered(&compiled(&frame));
            assert!(with.extra.iter().all(|number| number.is_finite()));
            frame.aovs = Aovs::NONE;
            let without = rendered(&compiled(&frame));
            assert!(without.extra.is_empty());
            assert_eq!((with.pixels, with.counters), (without.pixels, without.counters));
        }
    }
}

#[test]
fn a_picture_without_them_is_called_as_ever_and_each_set_has_a_name_of_its_own() {
    let mut frame = frame(vec![], RAYCAST);
    frame.aovs = Aovs::NONE;
    let coded = postcard::to_stdvec(&frame).unwrap();
    let mut hasher = blake3::Hasher::new_derive_key("tessera frame identity");
    hasher.update(&crate::REVISION.to_le_bytes()).update(&coded[..coded.len() - 1]);
    assert_eq!(frame.hash().unwrap().0, *hasher.finalize().as_bytes());
    let names: std::collections::BTreeSet<_> =
        (0..256).map(|bits| Frame { aovs: Aovs::from(bits), ..frame.clone() }.hash().unwrap()).collect();
    assert_eq!(names.len(), 256);
}
