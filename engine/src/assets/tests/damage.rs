//! Files that were cut off or changed on their way: read or refused, but never a panic, and what is read keeps its promises.

use proptest::prelude::*;
use serde_json::json;

use super::{check_promises, glb::Gltf, load_with, obj, ply, small_png};
use crate::{
    assets::{model_references, part_references},
    description::ModelFormat,
};

/// A glb with everything that is read: hierarchy, lights, materials with all extensions, texture, normals, sparse and normalised accessors.
fn rich_glb() -> Vec<u8> {
    let mut file = Gltf::cube(json!({
        "nodes": [{ "children": [1, 2], "rotation": [0, 0.6, 0, 0.8] }, { "mesh": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "mesh": 0, "scale": [1, -2, 3], "extensions": { "KHR_lights_punctual": { "light": 1 } } },
        ],
        "scenes": [{ "nodes": [0] }], "scene": 0,
        "materials": [{
            "alphaMode": "MASK", "alphaCutoff": 0.5, "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 0 } },
            "normalTexture": { "index": 0, "texCoord": 1, "scale": 0.5, "extensions": { "KHR_texture_transform": { "rotation": 0.5, "scale": [2, 2] } } },
            "emissiveFactor": [0.5, 0, 0.5], "emissiveTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "offset": [0.5, 2] } } },
            "extensions": {
                "KHR_materials_ior": { "ior": 1.3 }, "KHR_materials_emissive_strength": { "emissiveStrength": 8 },
                "KHR_materials_specular": { "specularFactor": 0.5, "specularColorFactor": [1, 2, 0.5] },
                "KHR_materials_transmission": { "transmissionFactor": 0.8 },
                "KHR_materials_volume": { "thicknessFactor": 2, "attenuationDistance": 3, "attenuationColor": [0.5, 0.6, 0.7] },
                "KHR_materials_clearcoat": { "clearcoatFactor": 0.9, "clearcoatRoughnessFactor": 0.3, "clearcoatNormalTexture": { "index": 0 } },
                "KHR_materials_sheen": { "sheenColorFactor": [0.1, 0.2, 0.3], "sheenRoughnessFactor": 0.6 },
                "KHR_materials_anisotropy": { "anisotropyStrength": 0.7, "anisotropyRotation": -1 },
            },
        }],
        "extensions": { "KHR_lights_punctual": { "lights": [
            { "type": "point", "color": [1, 0.5, 0], "intensity": 10, "range": 3 },
            { "type": "spot", "spot": { "innerConeAngle": 0.25, "outerConeAngle": 0.5 } },
        ] } },
        "textures": [{ "source": 0, "sampler": 0 }], "samplers": [{ "wrapS": 33071 }],
    }));
    let png = file.view(&small_png());
    file.json["images"] = json!([{ "bufferView": png, "mimeType": "image/png" }]);
    let normals = file.floats(&[[0.0, 1.0, 0.0]; 8], "VEC3");
    let uvs = file.floats(&[[0.5, 0.5]; 8], "VEC2");
    let tangents = file.floats(&[[1.0, 0.0, 0.0, 1.0]; 8], "VEC4");
    let colors = file.accessor(&[200; 32], 5121, "VEC4", 8);
    let (indices, values) = (file.view(&[3]), file.view(&[0; 12]));
    file.json["accessors"][0]["sparse"] = json!({
        "count": 1, "indices": { "bufferView": indices, "componentType": 5121 }, "values": { "bufferView": values },
    });
    *file.attributes() =
        json!({ "POSITION": 0, "NORMAL": normals, "TEXCOORD_0": uvs, "COLOR_0": colors, "TEXCOORD_1": uvs, "TANGENT": tangents });
    file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    file.glb()
}

const MTL: &[u8] = b"newmtl a\nKd 1 0.5 0\nmap_Kd -o 1 2 3 -clamp on a.png\nd 0.5\nKe 1 1 1\nmap_Ke a.png\nnorm a.png\nKs 0.5 1 1\nNs 30\nNi 1.5\nillum 2\nPr 0.5\nPm 1\nPc 0.5\nPcr 0.2\nnewmtl b\nTr 0.25\n";

/// Every kind of file that is read.
fn files() -> Vec<(ModelFormat, Vec<u8>)> {
    let obj =
        format!("mtllib a.mtl\n{}vt 0 1\nvn 1 0 0\ns 2\nusemtl a\nf 1/1/1 2/1/1 3/-1/-1\nusemtl b\nf 1//1 3//1 \\\n 4//1\n", obj::cube());
    vec![
        (ModelFormat::Gltf, rich_glb()),
        (ModelFormat::Gltf, Gltf::cube(json!({ "nodes": [{ "mesh": 0 }] })).gltf(None).0),
        (ModelFormat::Obj, obj.into_bytes()),
        (ModelFormat::Ply, ply::ascii_cube().into_bytes()),
        (ModelFormat::Ply, ply::binary_cube(false)),
    ]
}

fn read(format: ModelFormat, bytes: &[u8], mtl: &[u8]) {
    let _ = model_references(format, bytes);
    let _ = part_references("a.mtl", mtl);
    if let Ok(model) = load_with(format, bytes, &[("a.mtl", mtl), ("a.png", &small_png())]) {
        check_promises(&model);
    }
}

#[test]
fn whole_files_are_read() {
    for (format, bytes) in files() {
        let model = load_with(format, &bytes, &[("a.mtl", MTL), ("a.png", &small_png())]).unwrap();
        check_promises(&model);
    }
}

#[test]
fn files_cut_off_anywhere_never_panic() {
    for (format, bytes) in files() {
        for length in 0..bytes.len() {
            read(format, &bytes[..length], MTL);
        }
    }
    for length in 0..MTL.len() {
        read(ModelFormat::Obj, b"mtllib a.mtl\n", &MTL[..length]);
    }
}

#[test]
fn a_cut_glb_is_always_refused() {
    let bytes = rich_glb();
    for length in 0..bytes.len() {
        assert!(load_with(ModelFormat::Gltf, &bytes[..length], &[]).is_err(), "{length}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn changed_files_never_panic(which in 0..5usize, changes in proptest::collection::vec((any::<usize>(), any::<u8>(), 0..4u8), 1..8)) {
        let (format, mut bytes) = files().swap_remove(which);
        for (at, value, kind) in changes {
            damage(&mut bytes, at, value, kind);
        }
        read(format, &bytes, MTL);
    }

    #[test]
    fn changed_materials_never_panic(changes in proptest::collection::vec((any::<usize>(), any::<u8>(), 0..4u8), 1..8)) {
        let mut mtl = MTL.to_vec();
        for (at, value, kind) in changes {
            damage(&mut mtl, at, value, kind);
        }
        read(ModelFormat::Obj, b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n", &mtl);
    }
}

/// Flips a bit, sets a byte, makes a digit another, or takes a byte away.
fn damage(bytes: &mut Vec<u8>, at: usize, value: u8, kind: u8) {
    if bytes.is_empty() {
        return;
    }
    let at = at % bytes.len();
    match kind {
        0 => bytes[at] ^= 1 << (value % 8),
        1 => bytes[at] = value,
        2 => {
            if let Some(digit) = bytes[at..].iter_mut().find(|byte| byte.is_ascii_digit()) {
                *digit = b'0' + value % 10;
            }
        }
        _ => {
            bytes.remove(at);
        }
    }
}
