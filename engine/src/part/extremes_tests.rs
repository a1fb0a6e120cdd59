//! Paths whose random numbers are all 0, or all next to 1, over every material and light: no sample is invalid, and nothing fails.

use std::sync::atomic::AtomicBool;

use serde_json::json;

use super::{
    canary::{canary, in_all_light},
    *,
};
use crate::{
    assets::tests::glb::Gltf,
    description::{
        Environment, Film, Filter, Frame, Fresnel, Light, Material, Medium, MemoryAssets, Model, ModelFormat, Object, ObjectKind, Render,
        Shape, SourceId,
    },
    sampling::Numbers,
    scene::Scene,
};

/// Materials at their own ends and between them; the canary has the others.
fn materials() -> Vec<Material> {
    let (white, source) = ([1.0; 3], Medium { absorption: [0.0, 1.0, 1e-3], scattering: [1.0, 0.0, 1e3], anisotropy: -0.9 });
    let glass = |ior: f64, roughness: f64, multiple_scattering: bool, interior: Option<Medium>| Material::Glass {
        ior,
        reflectance: white,
        transmittance: white,
        roughness,
        multiple_scattering,
        interior,
        priority: (10.0 * roughness) as u8,
    };
    let metal = |roughness: [f64; 2], multiple_scattering: bool| Material::Metal {
        fresnel: Fresnel::Schlick([0.9, 0.5, 0.0]),
        roughness,
        multiple_scattering,
    };
    let plastic = |roughness: f64| Material::Plastic { reflectance: white, texture: None, ior: 1.5, roughness };
    let rough = |roughness: f64| Material::RoughDiffuse { reflectance: white, texture: None, roughness };
    vec![
        Material::Diffuse { reflectance: white, texture: None },
        rough(1.0),
        rough(1e-4),
        Material::Mirror { reflectance: white },
        metal([0.0; 2], true),
        metal([1e-3, 1.0], true),
        metal([1.0; 2], false),
        metal([0.03; 2], true),
        glass(1.5, 0.0, true, Some(source.clone())),
        glass(1e4, 1.0, true, None),
        glass(1e-4, 0.1, true, None),
        glass(1.000_001, 0.5, true, None),
        glass(1.5, 1.0, false, Some(source.clone())),
        glass(1.5, 0.02, true, None),
        plastic(0.0),
        plastic(1.0),
        Material::Boundary { interior: source },
        Material::Emitter { radiance: [1e30, 1.0, 1e-40], texture: None, two_sided: true },
    ]
}

/// Two squares with all that glTF says of materials: one of them lets light through.
fn model() -> Gltf {
    let of = |transmission: f64, roughness: f64, metallic: f64| {
        json!({
            "pbrMetallicRoughness": { "baseColorFactor": [1, 0.8, 0.6, 1], "metallicFactor": metallic, "roughnessFactor": roughness },
            "doubleSided": true,
            "emissiveFactor": [0.1, 0, 0],
            "extensions": {
                "KHR_materials_clearcoat": { "clearcoatFactor": 1, "clearcoatRoughnessFactor": 0 },
                "KHR_materials_sheen": { "sheenColorFactor": [1, 1, 1], "sheenRoughnessFactor": 0.1 },
                "KHR_materials_transmission": { "transmissionFactor": transmission },
                "KHR_materials_ior": { "ior": 1.5 },
                "KHR_materials_specular": { "specularFactor": 1, "specularColorFactor": [1, 0, 1] },
                "KHR_materials_anisotropy": { "anisotropyStrength": 0.9, "anisotropyRotation": 1 },
            },
        })
    };
    let mut file = Gltf::new(json!({ "nodes": [{ "mesh": 0 }], "materials": [of(0.0, 0.3, 0.5), of(1.0, 0.0, 0.0)] }));
    let mut square = |x: f32, material: u32| {
        let corners = [[x, 0.5, 1.0], [x + 1.4, 0.5, 1.0], [x + 1.4, 2.5, 1.0], [x, 2.5, 1.0]];
        let (positions, normals) = (file.floats(&corners, "VEC3"), file.floats(&corners.map(|[x, ..]| [0.3 * x, 0.0, 1.0]), "VEC3"));
        let indices = file.accessor(&[0, 1, 2, 0, 2, 3], 5121, "SCALAR", 6);
        json!({ "attributes": { "POSITION": positions, "NORMAL": normals }, "indices": indices, "material": material })
    };
    let primitives = json!([square(-1.6, 0), square(0.1, 1)]);
    file.json["meshes"] = json!([{ "primitives": primitives }]);
    file
}

/// Rows of balls of all materials, overlapping here and there, before the canary's things, under lights of all kinds.
fn frame(background: &Environment) -> (Frame, MemoryAssets) {
    let (frame, mut assets) = canary(1).unwrap();
    let mut frame = in_all_light(frame);
    let source = SourceId::default();
    let scene = &mut frame.scene;
    if !matches!(background, Environment::Constant(_)) {
        scene.background = background.clone();
    }
    for (index, material) in materials().into_iter().enumerate() {
        let [x, y] = [index % 6, index / 6].map(|at| at as f64);
        let shape = Shape::Sphere { center: [0.62 * x - 1.5, 0.5 + 0.62 * y, 2.0 - 0.2 * y], radius: 0.32 };
        let kind = ObjectKind::Shape { shape, material: scene.materials.len() as u32 };
        scene.materials.push(material);
        scene.groups[1].objects.push(Object { kind, transform: None, source });
    }
    let model = Model { format: ModelFormat::Gltf, file: assets.insert(model().glb()), parts: Vec::new() };
    scene.groups[1].objects.push(Object { kind: ObjectKind::Model { model, material: None }, transform: None, source });
    scene.lights.extend([
        Light::Spot { position: [0.0, 4.0, 4.0], direction: [0.0, -1.0, -0.7], intensity: [50.0; 3], inner: 0.0, outer: 40.0, source },
        Light::Directional { direction: [-0.2, -1.0, -0.5], irradiance: [1.0; 3], angle: 0.533, source },
        Light::Directional { direction: [0.2, -1.0, -0.5], irradiance: [1.0; 3], angle: 179.0, source },
    ]);
    (frame, assets)
}

/// Traces so many paths of every kind of numbers, in several kinds of surroundings.
fn trace(paths: u32) {
    let sky =
        Environment::Sky { sun: [0.3, 0.5, 0.4], turbidity: 3.0, ground: [0.2; 3], scale: 1.0, disc: true, source: SourceId::default() };
    let all = [Numbers::Least, Numbers::Greatest, Numbers::Mixed];
    for (background, smooth_terminator) in [(Environment::Constant([0.0; 3]), false), (sky, true)] {
        for numbers in all {
            let (mut frame, assets) = frame(&background);
            let side = (f64::from(paths / 2).sqrt() as u32).max(1);
            // Without the negative weights of the canary's own filter.
            frame.film = Film { width: side, height: side, filter: Filter::Box };
            frame.render = Render::Path { max_depth: 30, roulette_depth: 4, smooth_terminator };
            let scene = Scene::compile(&frame, &assets).unwrap();
            let rect = Rect { x: 0, y: 0, width: side, height: side };
            let samples = SampleRange { first: 0, count: 1 };
            let part = numbers.during(|| render(&scene, rect, samples, &AtomicBool::new(false)).unwrap());
            assert_eq!(part.counters.invalid_samples, 0, "{numbers:?}");
            assert!(part.pixels.iter().flatten().all(|number| number.is_finite() && *number >= 0.0), "{numbers:?}");
            let lit = part.pixels.iter().filter(|pixel| **pixel != [0.0; 3]).count();
            assert!(lit as u64 > rect.area() / 20, "{numbers:?}: of {} paths {lit} found light", rect.area());
        }
    }
}

#[test]
fn numbers_at_their_ends_make_no_invalid_samples() {
    trace(100_000);
}

/// The same with ten million paths of each kind: `cargo test --release -p tessera-engine -- --ignored ten_million`.
#[test]
#[ignore = "takes minutes"]
fn ten_million_paths_with_numbers_at_their_ends_are_sound() {
    trace(10_000_000);
}
