//! Models in scenes: their lights, what shines of them, tangents and the numbers of their materials at a point.

use std::{io::Cursor, sync::atomic::AtomicBool};

use serde_json::{Value, json};

use super::*;
use crate::{
    assets::tests::glb::Gltf,
    description::{Environment, Model, ModelFormat},
    light::Light,
    part::{Rect, SampleRange, render},
    scene::Surface,
};

/// A PNG of one row of pixels.
fn png(pixels: &[[u8; 4]]) -> Vec<u8> {
    let image = image::RgbaImage::from_raw(pixels.len() as u32, 1, pixels.as_flattened().to_vec()).unwrap();
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// A unit square in the plane z = 0 that faces z, with its image upright; a second set of coordinates is turned by half a turn.
fn square(material: Value, pixels: &[[u8; 4]], change: impl FnOnce(&mut Gltf)) -> Gltf {
    let mut file = Gltf::new(json!({ "nodes": [{ "mesh": 0 }], "materials": [material], "textures": [{ "source": 0 }] }));
    let positions = file.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]], "VEC3");
    let first = file.floats(&[[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]], "VEC2");
    let second = file.floats(&[[1.0, 0.0], [0.0, 0.0], [0.0, 1.0], [1.0, 1.0]], "VEC2");
    let indices = file.accessor(&[0, 1, 2, 0, 2, 3], 5121, "SCALAR", 6);
    let attributes = json!({ "POSITION": positions, "TEXCOORD_0": first, "TEXCOORD_1": second });
    file.json["meshes"] = json!([{ "primitives": [{ "attributes": attributes, "indices": indices, "material": 0 }] }]);
    let image = file.view(&png(pixels));
    file.json["images"] = json!([{ "bufferView": image, "mimeType": "image/png" }]);
    change(&mut file);
    file
}

fn frame_of(file: Gltf, map: DAffine3) -> (Frame, MemoryAssets) {
    let mut assets = MemoryAssets::default();
    let model = Model { format: ModelFormat::Gltf, file: assets.insert(file.glb()), parts: Vec::new() };
    let kind = ObjectKind::Model { model, material: None };
    (frame(vec![Object { kind, transform: Some(matrix(map)), source: SourceId::default() }]), assets)
}

fn scene_of(file: Gltf, map: DAffine3) -> Scene {
    let (frame, assets) = frame_of(file, map);
    Scene::compile_around(&frame, &assets, DVec3::ZERO).unwrap()
}

/// What is there at (x, y) of the square, seen from the front.
fn at(scene: &Scene, x: f64, y: f64) -> Surface {
    scene.closest(&Ray::new(DVec3::new(x, y, 5.0), DVec3::NEG_Z)).unwrap()
}

#[test]
fn lights_of_models_move_with_them() {
    let lights = json!([{ "type": "point", "intensity": 5 }, { "type": "spot", "intensity": 7, "spot": { "outerConeAngle": 0.5 } }, { "type": "directional" }]);
    let file = square(json!({}), &[[255; 4]], |file| {
        let node = |light: u32| json!({ "translation": [0, 0, 1], "extensions": { "KHR_lights_punctual": { "light": light } } });
        file.json["nodes"] = json!([{ "mesh": 0 }, node(0), node(1), node(2)]);
        file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
    });
    // A quarter turn about y takes z to x.
    let turn = DMat3::from_cols(DVec3::NEG_Z, DVec3::Y, DVec3::X);
    let map = DAffine3 { matrix3: turn * 2.0, translation: DVec3::new(1.0, 2.0, 3.0) };
    let scene = scene_of(file, map);
    let place = DVec3::new(3.0, 2.0, 3.0);
    let [Light::Point { position, strength, falloff: true }, Light::Spot { position: of_spot, axis, intensity, .. }, sun] =
        scene.lights[..]
    else {
        panic!("{:?}", scene.lights)
    };
    assert_eq!((position, strength, of_spot, axis, intensity), (place, DVec3::splat(5.0), place, DVec3::NEG_X, DVec3::splat(7.0)));
    assert_eq!(sun, Light::Directional { towards: DVec3::X, irradiance: DVec3::ONE, spread: 0.0 });
    // Inverse square: 5 / 2^2 at two units from the lamp.
    assert_eq!(scene.lights[0].sample(DVec3::new(1.0, 2.0, 3.0)).irradiance, DVec3::splat(1.25));
}

#[test]
fn tangents_lie_along_the_image() {
    let tangents = |map: DAffine3, transform: Value, change: fn(&mut Gltf)| {
        let texture = json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } });
        let scene = scene_of(square(json!({ "normalTexture": texture, "doubleSided": true }), &[[255; 4]], change), map);
        let x = if map.matrix3.x_axis.x < 0.0 { -0.5 } else { 0.5 };
        at(&scene, x, 0.4).tangents_across(DVec3::Z).unwrap()
    };
    let near = |(t, b): (DVec3, DVec3), [u, v]: [DVec3; 2]| assert!(t.distance(u) < 1e-6 && b.distance(v) < 1e-6, "{t} {b}");
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    near(tangents(DAffine3::IDENTITY, json!({}), |_| {}), [DVec3::X, DVec3::Y]);
    near(tangents(mirror, json!({}), |_| {}), [DVec3::NEG_X, DVec3::Y]);
    // Turned coordinates turn the image clockwise: what was its right is below.
    let quarter = json!({ "rotation": std::f64::consts::FRAC_PI_2 });
    near(tangents(DAffine3::IDENTITY, quarter, |_| {}), [DVec3::NEG_Y, DVec3::X]);
    near(tangents(DAffine3::IDENTITY, json!({ "texCoord": 1 }), |_| {}), [DVec3::NEG_X, DVec3::NEG_Y]);
    let given = |file: &mut Gltf| file.attributes()["TANGENT"] = json!(file.floats(&[[0.0, 1.0, 0.0, -1.0]; 4], "VEC4"));
    near(tangents(DAffine3::IDENTITY, json!({}), given), [DVec3::Y, DVec3::X]);
    near(tangents(mirror, json!({}), given), [DVec3::Y, DVec3::NEG_X]);
}

#[test]
fn normal_maps_bend_normals() {
    let material = json!({ "normalTexture": { "index": 0, "scale": 0.5 } });
    let scene = scene_of(square(material, &[[255, 0, 255, 255]], |_| {}), DAffine3::IDENTITY);
    let surface = at(&scene, 0.5, 0.4);
    let map = scene.materials[surface.material as usize].normal_map.unwrap();
    let bent = map.normal(&scene.textures, &surface).unwrap();
    assert!(bent.distance(DVec3::new(0.5, -0.5, 1.0).normalize()) < 1e-12, "{bent}");
    assert_eq!(surface.ns, DVec3::Z);
}

#[test]
fn textures_multiply_the_numbers_of_a_material() {
    let second = json!({ "index": 0, "texCoord": 1 });
    let material = json!({
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 1, 1, 1], "metallicFactor": 0.5, "roughnessFactor": 0.5,
            "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": second,
        },
        "extensions": {
            "KHR_materials_ior": { "ior": 0 },
            "KHR_materials_specular": { "specularFactor": 0.5, "specularTexture": { "index": 0 } },
            "KHR_materials_transmission": { "transmissionFactor": 0.5, "transmissionTexture": second },
            "KHR_materials_volume": { "thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [0.25, 1, 1] },
            "KHR_materials_anisotropy": { "anisotropyStrength": 0.5, "anisotropyRotation": std::f64::consts::FRAC_PI_2, "anisotropyTexture": second },
        },
    });
    // On the left green and a quarter there, on the right blue and red.
    let pixels = [[0, 255, 0, 51], [255, 0, 255, 255]];
    let change = |file: &mut Gltf| file.attributes()["COLOR_0"] = json!(file.floats(&[[1.0, 0.5, 1.0]; 4], "VEC3"));
    let scene = scene_of(square(material, &pixels, change), DAffine3::IDENTITY);
    let surface = at(&scene, 0.25, 0.4);
    let model = scene.materials[surface.material as usize].model.as_ref().unwrap();
    let (point, direction) = model.at(&scene.textures, &surface);
    assert_eq!(point.base_color, DVec3::new(0.0, 0.5, 0.0));
    assert_eq!((point.metallic, point.roughness, point.transmission, point.volume), (0.5, 0.0, 0.5, true));
    assert!((point.specular - 0.1).abs() < 1e-7 && point.ior == 1e4, "{point:?}");
    // (1, -1) turned by a quarter is (1, 1).
    assert!(point.anisotropy == 0.5 && direction.distance(DVec2::ONE.normalize()) < 1e-7, "{point:?}");
    // A quarter is left after two units: ln 4 / 2.
    assert!(model.absorption().unwrap().distance(DVec3::X * crate::math::ln(2.0)) < 1e-12);
}

#[test]
fn what_is_read_but_not_drawn_is_named() {
    let material = json!({ "name": "m", "alphaMode": "BLEND", "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0.5 } });
    let scene = scene_of(square(material, &[[255; 4]], |_| {}), DAffine3::IDENTITY);
    let warnings: Vec<&str> = scene.warnings.iter().map(|warning| warning.message.as_str()).collect();
    let blends = "material \"m\": alpha blending is not modelled; cut away where it is less than half opaque";
    assert_eq!(warnings, ["material \"m\": gloss is not modelled; drawn diffuse", blends]);
    assert!(scene.materials.iter().any(|material| material.blends && material.alpha_cutoff == Some(0.5)));
}

/// Black and a quarter there, before a white sky: pixels whose samples all look at their middles are three quarters bright all the same.
#[test]
fn what_blends_does_so_in_every_pixel() {
    let material = json!({
        "alphaMode": "BLEND", "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorFactor": [0, 0, 0, 0.25] },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0 } },
    });
    let (mut frame, assets) = frame_of(square(material, &[[255; 4]], |_| {}), DAffine3::IDENTITY);
    frame.scene.background = Environment::Constant([1.0; 3]);
    frame.camera = Camera::pinhole([0.5, 0.5, 3.0], [0.5, 0.5, 0.0], [0.0, 1.0, 0.0], 5.0);
    frame.film = Film { width: 8, height: 8, filter: Filter::Point };
    frame.render = Render::Path { max_depth: 4, roulette_depth: 4, smooth_terminator: false };
    let scene = Scene::compile_around(&frame, &assets, DVec3::ZERO).unwrap();
    let (rect, samples) = (Rect { x: 0, y: 0, width: 8, height: 8 }, SampleRange { first: 0, count: 1024 });
    let part = render(&scene, rect, samples, &AtomicBool::new(false)).unwrap();
    // Five standard errors of 1024 tosses.
    let wrong = part.pixels.iter().filter(|pixel| (pixel[0] - 0.75).abs() > 5.0 * 0.0135).count();
    assert_eq!(wrong, 0, "{:?}", part.pixels);
}

#[test]
fn dark_triangles_of_a_shining_texture_are_no_lights() {
    // The left half shines: of 16 parts of each triangle 4 and 12 lie there, but interpolation between pixels blurs the border.
    let material = json!({ "emissiveFactor": [1, 0.5, 0], "emissiveTexture": { "index": 0 } });
    let halves = scene_of(square(material.clone(), &[[255; 4], [0, 0, 0, 255]], |_| {}), DAffine3::IDENTITY);
    let sum: DVec3 = halves.light_sampler.emitters.iter().map(|emitter| emitter.radiance).sum();
    assert!(halves.light_sampler.emitters.len() == 2 && sum.distance(DVec3::new(1.0, 0.5, 0.0)) < 0.02, "{sum}");
    let dark = scene_of(square(material, &[[0, 0, 0, 255]], |_| {}), DAffine3::IDENTITY);
    assert_eq!(dark.light_sampler.emitters.len(), 0);
    let unlit = json!({ "extensions": { "KHR_materials_unlit": {} } });
    let unlit = scene_of(square(unlit, &[[255; 4]], |_| {}), DAffine3::IDENTITY);
    assert_eq!(unlit.light_sampler.emitters.len(), 0);
    assert_eq!(unlit.materials.iter().filter_map(|material| material.emission).map(|emission| emission.radiance).next(), Some(DVec3::ONE));
}

/// Inside a closed cube that shines with radiance 1 and reflects a half of all light, chains of three rays bring 1 + 1/2 + 1/4.
#[test]
fn shining_models_light_the_scene() {
    let material = json!({
        "doubleSided": true, "emissiveFactor": [0.25, 0.25, 0.25], "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0 },
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 4 }, "KHR_materials_specular": { "specularFactor": 0 } },
    });
    let mut cube = Gltf::cube(json!({ "nodes": [{ "mesh": 0 }], "materials": [material] }));
    cube.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let (mut frame, assets) = frame_of(cube, DAffine3::IDENTITY);
    frame.camera = Camera::pinhole([0.4, 0.5, 0.6], [1.0, 0.4, 0.3], [0.0, 1.0, 0.0], 60.0);
    frame.film = Film { width: 8, height: 8, filter: Filter::Point };
    frame.render = Render::Path { max_depth: 3, roulette_depth: 3, smooth_terminator: false };
    frame.quality.samples = 256;
    let scene = Scene::compile(&frame, &assets).unwrap();
    assert_eq!(scene.light_sampler.emitters.len(), 12);
    let rect = Rect { x: 0, y: 0, width: 8, height: 8 };
    let part = render(&scene, rect, SampleRange { first: 0, count: 256 }, &AtomicBool::new(false)).unwrap();
    let mean = part.pixels.iter().map(|pixel| glam::Vec3::from(*pixel).as_dvec3()).sum::<DVec3>() / 64.0;
    assert!(mean.distance(DVec3::splat(1.75)) < 0.02, "{mean}");
}
