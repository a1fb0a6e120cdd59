//! Materials and lights of glTF files, and the gloss of MTL files: every number where it belongs.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

use glam::{DVec2, DVec3};
use serde_json::{Value, json};

use super::{check_promises, failure, glb::Gltf, load_with, obj, small_png};
use crate::{
    assets::{
        AlphaMode, Anisotropy, Clearcoat, LoadedModel, ModelEmission, ModelLight, ModelLightKind, ModelMaterial, NormalMap, Sheen,
        Specular, Transmission, Volume, model_references, part_references,
    },
    description::ModelFormat,
};

/// A cube of one material with two sets of coordinates and tangents; all textures show one image.
fn file(material: Value) -> Gltf {
    let mut file = Gltf::cube(json!({ "nodes": [{ "mesh": 0 }], "materials": [material], "textures": [{ "source": 0 }, { "source": 0 }] }));
    let png = file.view(&small_png());
    let first = file.floats(&[[0.25, 0.75]; 8], "VEC2");
    let second = file.floats(&[[0.5, 1.0]; 8], "VEC2");
    let tangents = file.floats(&[[0.0, 2.0, 0.0, -1.0]; 8], "VEC4");
    *file.attributes() = json!({ "POSITION": 0, "TEXCOORD_0": first, "TEXCOORD_1": second, "TEXCOORD_2": first, "TANGENT": tangents });
    file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    file.json["images"] = json!([{ "bufferView": png, "mimeType": "image/png" }]);
    file
}

fn load(file: Gltf) -> LoadedModel {
    let model = load_with(ModelFormat::Gltf, &file.glb(), &[]).unwrap();
    check_promises(&model);
    model
}

fn material(material: Value) -> ModelMaterial {
    load(file(material)).materials.swap_remove(0)
}

fn error(material: Value) -> String {
    failure(load_with(ModelFormat::Gltf, &file(material).glb(), &[]))
}

#[test]
fn every_number_of_a_material_is_kept() {
    let (t, name) = (json!({ "index": 0 }), "all");
    let read = material(json!({
        "name": name, "alphaMode": "BLEND", "doubleSided": true, "emissiveFactor": [0.5, 0.25, 1], "emissiveTexture": t,
        "normalTexture": { "index": 0, "scale": 0.5 }, "occlusionTexture": { "index": 9 },
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 0.3, 0.4], "baseColorTexture": t, "metallicFactor": 0.75, "roughnessFactor": 0.5, "metallicRoughnessTexture": t,
        },
        "extensions": {
            "KHR_materials_ior": { "ior": 1.33 },
            "KHR_materials_specular": { "specularFactor": 0.5, "specularTexture": t, "specularColorFactor": [1, 2, 0.5], "specularColorTexture": t },
            "KHR_materials_transmission": { "transmissionFactor": 0.8, "transmissionTexture": t },
            "KHR_materials_volume": { "thicknessFactor": 2, "thicknessTexture": t, "attenuationDistance": 3, "attenuationColor": [0.5, 0.6, 0.7] },
            "KHR_materials_clearcoat": {
                "clearcoatFactor": 0.9, "clearcoatTexture": t, "clearcoatRoughnessFactor": 0.3, "clearcoatRoughnessTexture": t,
                "clearcoatNormalTexture": { "index": 0, "scale": 2 },
            },
            "KHR_materials_sheen": { "sheenColorFactor": [0.1, 0.2, 0.3], "sheenColorTexture": t, "sheenRoughnessFactor": 0.6, "sheenRoughnessTexture": t },
            "KHR_materials_anisotropy": { "anisotropyStrength": 0.7, "anisotropyRotation": -1, "anisotropyTexture": t },
            "KHR_materials_emissive_strength": { "emissiveStrength": 8 },
        },
    }));
    let [color, linear] = [read.base_color_texture, read.metallic_roughness_texture];
    assert_ne!(color, linear);
    let expected = ModelMaterial {
        name: name.into(),
        base_color: [0.1, 0.2, 0.3, 0.4],
        base_color_texture: color,
        metallic: 0.75,
        roughness: 0.5,
        metallic_roughness_texture: linear,
        normal: linear.map(|texture| NormalMap { texture, scale: 0.5 }),
        emission: ModelEmission { radiance: [4.0, 2.0, 8.0], texture: color },
        alpha: AlphaMode::Blend,
        double_sided: true,
        unlit: false,
        ior: 1.33,
        specular: Specular { factor: 0.5, texture: color, color: [1.0, 2.0, 0.5], color_texture: color },
        transmission: Some(Transmission { factor: 0.8, texture: linear }),
        volume: Some(Volume { thickness: 2.0, thickness_texture: linear, attenuation_distance: 3.0, attenuation_color: [0.5, 0.6, 0.7] }),
        clearcoat: Some(Clearcoat {
            factor: 0.9,
            texture: linear,
            roughness: 0.3,
            roughness_texture: linear,
            normal: linear.map(|texture| NormalMap { texture, scale: 2.0 }),
        }),
        sheen: Some(Sheen { color: [0.1, 0.2, 0.3], color_texture: color, roughness: 0.6, roughness_texture: color }),
        anisotropy: Some(Anisotropy { strength: 0.7, rotation: -1.0, texture: linear }),
    };
    assert_eq!(read, expected);
}

#[test]
fn numbers_out_of_their_ranges_are_clamped_and_infinite_ones_refused() {
    let read = material(json!({
        "emissiveFactor": [2, -1, 1],
        "pbrMetallicRoughness": { "baseColorFactor": [2, -1, 1, 1], "metallicFactor": 3, "roughnessFactor": -2 },
        "extensions": {
            "KHR_materials_ior": { "ior": 0.5 },
            "KHR_materials_specular": { "specularFactor": 2, "specularColorFactor": [-1, 3, 0] },
            "KHR_materials_volume": { "thicknessFactor": -1 },
            "KHR_materials_transmission": { "transmissionFactor": -1 },
            "KHR_materials_clearcoat": { "clearcoatFactor": 7, "clearcoatRoughnessFactor": -7 },
            "KHR_materials_emissive_strength": { "emissiveStrength": 4 },
        },
    }));
    assert_eq!((read.base_color, read.metallic, read.roughness), ([1.0, 0.0, 1.0, 1.0], 1.0, 0.0));
    assert_eq!((read.emission.radiance, read.ior), ([4.0, 0.0, 4.0], 1.0));
    assert_eq!((read.specular.factor, read.specular.color), (1.0, [0.0, 3.0, 0.0]));
    assert_eq!((read.volume, read.transmission), (None, None));
    assert_eq!(read.clearcoat.map(|coat| (coat.factor, coat.roughness)), Some((1.0, 0.0)));
    assert_eq!(material(json!({ "extensions": { "KHR_materials_ior": { "ior": 0 } } })).ior, 0.0);
    let refused = |name: &str, value: Value| error(json!({ "name": "m", "extensions": { name: value } }));
    let strength = refused("KHR_materials_emissive_strength", json!({ "emissiveStrength": 1e39 }));
    assert_eq!(strength, "material 0 \"m\": KHR_materials_emissive_strength: its emissiveStrength is not finite");
    assert!(refused("KHR_materials_ior", json!({ "ior": 1e39 })).ends_with("its ior is not finite"));
    assert!(refused("KHR_materials_volume", json!({ "thicknessFactor": 1, "attenuationDistance": 0 })).contains("attenuationDistance"));
    assert!(refused("KHR_materials_sheen", json!({ "sheenColorFactor": "red" })).contains("KHR_materials_sheen: invalid type"));
    assert!(error(json!({ "normalTexture": { "index": 0, "scale": 1e39 } })).contains("number out of range"));
    let transform = json!({ "KHR_texture_transform": { "offset": [0, 1e39] } });
    assert!(error(json!({ "normalTexture": { "index": 0, "extensions": transform } })).contains("not finite"));
    assert!(error(json!({ "normalTexture": { "index": 7 } })).contains("normalTexture: texture 7 does not exist"));
}

#[test]
fn what_has_no_effect_is_not_looked_up() {
    let textures = |material: Value| load(file(material)).textures.len();
    let t = json!({ "index": 0 });
    assert_eq!(textures(json!({ "emissiveTexture": t, "occlusionTexture": t })), 0);
    assert_eq!(
        textures(json!({ "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0, "metallicRoughnessTexture": t } })),
        0
    );
    assert_eq!(textures(json!({ "extensions": { "KHR_materials_sheen": { "sheenColorTexture": t } } })), 0);
}

#[test]
fn images_are_decoded_for_every_use_and_shared_within_one() {
    let transformed = json!({ "index": 0, "extensions": { "KHR_texture_transform": { "scale": [2, 2] } } });
    let model = load(file(json!({
        "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 0 }, "normalTexture": { "index": 0 },
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": transformed },
    })));
    let material = &model.materials[0];
    // The second way to ask for the numbers as they are has a transform of its own.
    assert_eq!(model.textures.len(), 3);
    assert_eq!(material.emission.texture, material.base_color_texture);
    assert_eq!(model.textures[material.normal.unwrap().texture].coordinates().transform, None);
    let scaled = model.textures[material.metallic_roughness_texture.unwrap()].coordinates();
    assert_eq!(scaled.of([DVec2::new(0.25, 0.5), DVec2::ZERO]), DVec2::new(0.5, 1.0));
}

#[test]
fn numbers_and_colours_differ() {
    let mut grey = file(json!({ "normalTexture": { "index": 0 }, "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_raw(1, 1, vec![128, 64, 255]).unwrap().write_to(&mut png, image::ImageFormat::Png).unwrap();
    let view = grey.view(&png.into_inner());
    grey.json["images"][0]["bufferView"] = json!(view);
    let model = load(grey);
    let [color, normal] = [model.materials[0].base_color_texture.unwrap(), model.materials[0].normal.unwrap().texture];
    let look = |texture: usize| model.textures[texture].rgba(DVec2::ZERO).map(f64::from);
    assert!((look(normal)[0] - 128.0 / 255.0).abs() < 1e-6 && (look(normal)[1] - 64.0 / 255.0).abs() < 1e-6);
    assert!((look(color)[0] - 0.215_860_5).abs() < 1e-6 && (look(color)[1] - 0.051_269_5).abs() < 1e-6);
}

#[test]
fn two_sets_of_coordinates_are_kept_as_they_are() {
    let textures = |color: u32, normal: u32, coat: u32| {
        load(file(json!({
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "texCoord": color } },
            "normalTexture": { "index": 0, "texCoord": normal },
            "extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": 1, "clearcoatTexture": { "index": 0, "texCoord": coat } } },
        })))
    };
    let model = textures(1, 0, 1);
    assert_eq!((model.meshes[0].uvs[3], model.meshes[0].second_uvs[3]), ([0.25, 0.75], [0.5, 1.0]));
    let second = |texture: Option<usize>| model.textures[texture.unwrap()].coordinates().second;
    let material = &model.materials[0];
    assert!(second(material.base_color_texture) && second(material.clearcoat.unwrap().texture));
    assert!(!second(material.normal.map(|map| map.texture)));
    // One set alone is the first, whatever its number.
    let model = textures(1, 1, 1);
    assert_eq!((model.meshes[0].uvs[3], model.meshes[0].second_uvs.len()), ([0.5, 1.0], 0));
    let model = textures(0, 1, 2);
    assert!(model.warnings[0].contains("more than two sets"), "{:?}", model.warnings);
}

#[test]
fn tangents_are_kept_where_they_matter() {
    assert!(load(file(json!({}))).meshes[0].tangents.is_empty());
    for needs in
        [json!({ "normalTexture": { "index": 0 } }), json!({ "extensions": { "KHR_materials_anisotropy": { "anisotropyStrength": 1 } } })]
    {
        assert_eq!(load(file(needs)).meshes[0].tangents, [[0.0, 1.0, 0.0, -1.0]; 8]);
    }
}

#[test]
fn lights_stand_where_their_nodes_are() {
    let half = FRAC_1_SQRT_2;
    let mut cube = Gltf::cube(json!({
        "nodes": [
            { "children": [1, 2, 3], "translation": [1, 2, 3], "scale": [2, 2, 2] },
            { "translation": [1, 0, 0], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            // A quarter turn about x takes -z to y.
            { "rotation": [half, 0, 0, half], "extensions": { "KHR_lights_punctual": { "light": 1 } } },
            { "mesh": 0, "extensions": { "KHR_lights_punctual": { "light": 2 } } },
        ],
        "scenes": [{ "nodes": [0] }],
        "extensions": { "KHR_lights_punctual": { "lights": [
            { "type": "point", "color": [1, 0.5, 0], "intensity": 10, "range": 3, "name": "lamp" },
            { "type": "directional", "intensity": 100 },
            { "type": "spot", "spot": { "innerConeAngle": 0.25, "outerConeAngle": 3 } },
            { "type": "moon" },
        ] } },
        "extensionsUsed": ["KHR_lights_punctual"],
    }));
    let model = load_with(ModelFormat::Gltf, &cube.json.to_string().into_bytes(), &[]);
    assert!(model.is_err(), "its buffer is missing");
    cube.json["nodes"][1]["name"] = json!("holder");
    let model = load(cube);
    let [lamp, sun, spot] = model.lights[..] else { panic!("three lights are expected: {:?}", model.lights) };
    let position = DVec3::new(3.0, 2.0, 3.0);
    assert_eq!(lamp, ModelLight { strength: [10.0, 5.0, 0.0], kind: ModelLightKind::Point { position } });
    let ModelLightKind::Directional { direction } = sun.kind else { panic!("{sun:?}") };
    assert!(direction.normalize().distance(DVec3::Y) < 1e-6 && sun.strength == [100.0; 3], "{direction}");
    let position = DVec3::new(1.0, 2.0, 3.0);
    let kind = ModelLightKind::Spot { position, direction: DVec3::NEG_Z * 2.0, inner: 0.25, outer: FRAC_PI_2 };
    assert_eq!(spot, ModelLight { strength: [1.0; 3], kind });
    assert_eq!(model.warnings, ["light \"lamp\": its range is not modelled; it reaches as far as light does"]);
}

#[test]
fn damaged_lights_are_refused_or_named() {
    let with = |light: Value, lights: Value| {
        let node = json!({ "mesh": 0, "extensions": { "KHR_lights_punctual": light } });
        let file = Gltf::cube(json!({ "nodes": [node], "extensions": { "KHR_lights_punctual": { "lights": lights } } }));
        load_with(ModelFormat::Gltf, &file.glb(), &[])
    };
    let first = json!({ "light": 0 });
    assert_eq!(failure(with(first.clone(), json!([]))), "light 0 does not exist (there are 0)");
    assert!(failure(with(json!({ "light": -1 }), json!([]))).starts_with("node 0: KHR_lights_punctual: "));
    assert!(failure(with(first.clone(), json!(7))).starts_with("KHR_lights_punctual: "));
    assert_eq!(failure(with(first.clone(), json!([{ "type": "point", "intensity": 1e39 }]))), "light 0: its intensity is not finite");
    for (light, why) in [
        (json!({ "type": "moon" }), "its type is unknown; left out"),
        (json!({ "type": "spot", "spot": { "outerConeAngle": 0 } }), "its cone is closed; left out"),
    ] {
        let model = with(first.clone(), json!([light])).unwrap();
        assert_eq!((model.lights.len(), model.warnings), (0, vec![format!("light 0: {why}")]));
    }
}

#[test]
fn all_textures_that_are_looked_up_are_referred_to() {
    let texture = |index: usize| json!({ "index": index });
    let mut file = file(json!({
        "normalTexture": texture(0), "emissiveTexture": texture(1),
        "extensions": { "KHR_materials_sheen": { "sheenColorFactor": [1, 1, 1], "sheenColorTexture": texture(2) } },
    }));
    file.json["textures"] = json!([{ "source": 0 }, { "source": 1 }, { "source": 2 }]);
    file.json["images"] = json!([{ "uri": "normal.png" }, { "uri": "dark.png" }, { "uri": "sheen.png" }]);
    assert_eq!(model_references(ModelFormat::Gltf, &file.glb()).unwrap(), ["normal.png", "sheen.png"]);
}

#[test]
fn gloss_of_mtl_files_becomes_roughness_and_reflection() {
    let obj = obj::cube().replace("o cube", "mtllib a.mtl\nusemtl m");
    let read = |mtl: &str| {
        let parts: [(&str, &[u8]); 2] = [("a.mtl", mtl.as_bytes()), ("n.png", &small_png())];
        let model = load_with(ModelFormat::Obj, obj.as_bytes(), &parts).unwrap();
        check_promises(&model);
        assert_eq!(model.warnings.iter().filter(|warning| !warning.contains("coordinates")).count(), 0, "{:?}", model.warnings);
        model.materials[0].clone()
    };
    let matte = read("newmtl m\nKd 0.5 0.5 0.5\nKs 1 1 1\nNs 30\nillum 1\n");
    assert_eq!((matte.metallic, matte.specular.factor, matte.alpha), (0.0, 0.0, AlphaMode::Opaque));
    let gloss = read("newmtl m\nKs 0.5 0.25 0\nNs 30\nNi 1.3\nillum 2\nKe 3 2 -1\nd 0.75\n");
    assert_eq!((gloss.specular.factor, gloss.specular.color, gloss.ior), (1.0, [1.0, 0.5, 0.0], 1.3));
    // 2 / (30 + 2) = 1 / 16 = alpha^2 = roughness^4.
    assert_eq!((gloss.roughness, gloss.emission.radiance), (0.5, [3.0, 2.0, 0.0]));
    assert_eq!((gloss.alpha, gloss.base_color[3]), (AlphaMode::Blend, 0.75));
    let metal = read("newmtl m\nNs 1000\nPr 0.25\nPm 1\nPc 0.5\nPcr 0.125\nmap_Ke n.png\nnorm n.png\n");
    assert_eq!((metal.metallic, metal.roughness, metal.specular), (1.0, 0.25, Specular::default()));
    assert_eq!(metal.clearcoat.map(|coat| (coat.factor, coat.roughness)), Some((0.5, 0.125)));
    assert_eq!(metal.emission, ModelEmission { radiance: [1.0; 3], texture: Some(0) });
    assert_eq!(metal.normal, Some(NormalMap { texture: 1, scale: 1.0 }));
    let maps = b"newmtl m\nmap_Ke e.png\nnorm n.png\nmap_Bump b.png\n";
    assert_eq!(part_references("a.mtl", maps).unwrap(), ["e.png", "n.png"]);
}
