use glam::{DVec2, DVec3};
use serde_json::json;

use super::{check_promises, cube_triangles, failure, glb::Gltf, load_with, small_png, triangles};
use crate::{
    assets::{AlphaMode, LoadedModel, ModelMaterial, model_references},
    description::{ModelFormat, Wrap},
    texture::Texture,
};

fn load(file: Gltf) -> LoadedModel {
    let model = load_with(ModelFormat::Gltf, &file.glb(), &[]).unwrap();
    check_promises(&model);
    model
}

fn error(file: Gltf) -> String {
    failure(load_with(ModelFormat::Gltf, &file.glb(), &[]))
}

/// A cube seen by one node, changed before it is written.
fn cube(change: impl FnOnce(&mut Gltf)) -> Gltf {
    let mut file = Gltf::cube(json!({ "nodes": [{ "mesh": 0 }] }));
    change(&mut file);
    file
}

#[test]
fn hierarchies_place_instances() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let nodes = json!([
        { "children": [1, 2], "translation": [10, 0, 0], "scale": [2, 2, 2] },
        { "mesh": 0, "rotation": [0, 0, half, half] },
        // Column-major: x and y exchanged, z mirrored, then moved by (0, 0, 5).
        { "mesh": 0, "matrix": [0, 1, 0, 0, 1, 0, 0, 0, 0, 0, -1, 0, 0, 0, 5, 1] },
        { "mesh": 0 },
    ]);
    let model = load(Gltf::cube(json!({ "nodes": nodes, "scenes": [{ "nodes": [3] }, { "nodes": [0] }], "scene": 1 })));
    assert_eq!((model.meshes.len(), model.instances.len()), (1, 2));
    let place = |instance: usize| model.instances[instance].transform.transform_point3(DVec3::new(1.0, 2.0, 3.0));
    // A quarter turn about z: (-2, 1, 3); then doubled and moved.
    assert!(place(0).distance(DVec3::new(6.0, 2.0, 6.0)) < 1e-6, "{}", place(0));
    assert_eq!(place(1), DVec3::new(2.0 * 2.0 + 10.0, 2.0 * 1.0, 2.0 * (5.0 - 3.0)));
    assert!(model.warnings[0].contains("has 2 scenes"), "{:?}", model.warnings);
}

#[test]
fn without_a_scene_all_root_nodes_are_drawn() {
    let model = load(Gltf::cube(json!({ "nodes": [{ "mesh": 0, "translation": [1, 0, 0] }, { "mesh": 0, "children": [0] }] })));
    let moved: Vec<f64> = model.instances.iter().map(|instance| instance.transform.translation.x).collect();
    assert_eq!(moved, [0.0, 1.0]);
}

#[test]
fn what_a_node_scales_to_nothing_is_left_out() {
    let model = load(Gltf::cube(json!({ "nodes": [{ "mesh": 0, "scale": [1, 0, 1], "name": "gone" }, { "mesh": 0 }] })));
    assert_eq!(model.instances.len(), 1);
    assert_eq!(model.warnings, ["node \"gone\": is scaled to nothing; left out"]);
}

#[test]
fn all_ways_to_list_triangles_agree() {
    let quad = [[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]];
    let shape = |points: &[[f32; 3]], mode: u32, indices: Option<(Vec<u8>, u32, usize)>| {
        let mut file = Gltf::new(json!({ "nodes": [{ "mesh": 0 }] }));
        let positions = file.floats(points, "VEC3");
        let mut primitive = json!({ "attributes": { "POSITION": positions }, "mode": mode });
        if let Some((bytes, component, count)) = indices {
            primitive["indices"] = json!(file.accessor(&bytes, component, "SCALAR", count));
        }
        file.json["meshes"] = json!([{ "primitives": [primitive] }]);
        triangles(&load(file))
    };
    let list = [0u8, 1, 2, 2, 1, 3];
    let expected = shape(&quad, 4, Some((list.to_vec(), 5121, 6)));
    assert_eq!(expected, [[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]], [[0., 1., 0.], [1., 0., 0.], [1., 1., 0.]]]);
    assert_eq!(shape(&quad, 4, Some((list.iter().flat_map(|&i| u16::from(i).to_le_bytes()).collect(), 5123, 6))), expected);
    assert_eq!(shape(&quad, 4, Some((list.iter().flat_map(|&i| u32::from(i).to_le_bytes()).collect(), 5125, 6))), expected);
    assert_eq!(shape(&list.map(|i| quad[usize::from(i)]), 4, None), expected);
    assert_eq!(shape(&quad, 5, None), expected);
    assert_eq!(shape(&[1, 3, 2, 0].map(|i: usize| quad[i]), 6, None), expected);
    // Stitched strips name vertices twice; such triangles have no area.
    assert_eq!(shape(&quad, 5, Some((vec![0, 0, 0, 1, 2, 3, 3], 5121, 7))).len(), 2);
}

#[test]
fn missing_normals_mean_flat_shading_and_given_ones_become_unit() {
    assert!(load(cube(|_| {})).meshes[0].normals.is_empty());
    let model = load(cube(|file| {
        let mut normals = [[0.0, 3.0, 4.0]; 8];
        normals[6] = [0.0; 3];
        file.attributes()["NORMAL"] = json!(file.floats(&normals, "VEC3"));
    }));
    assert_eq!(model.meshes[0].normals[1], [0.0, 0.6, 0.8]);
    // The corner (1, 1, 1) without a normal: its three faces' mean.
    assert!(model.meshes[0].normals[6].iter().all(|x| *x > 0.3));
    assert!(model.warnings[0].contains("no direction"), "{:?}", model.warnings);
}

#[test]
fn integers_become_fractions_or_numbers() {
    let model = load(cube(|file| {
        let uvs: Vec<u8> = (0..16u16).flat_map(|i| (i * 4369).to_le_bytes()).collect();
        let uvs = file.accessor(&uvs, 5123, "VEC2", 8);
        file.json["accessors"][uvs]["normalized"] = json!(true);
        let colors = file.accessor(&[51; 24], 5121, "VEC3", 8);
        *file.attributes() = json!({ "POSITION": 0, "TEXCOORD_0": uvs, "COLOR_0": colors });
    }));
    assert_eq!(model.meshes[0].uvs[3], [6.0 / 15.0, 7.0 / 15.0]);
    assert_eq!(model.meshes[0].colors, [[0.2, 0.2, 0.2, 1.0]; 8]);
    // KHR_mesh_quantization: integer positions as they are, in steps of 4 bytes that the view states.
    let model = load(cube(|file| {
        let corners = [[0i8, 0, 0, 9], [-5, 0, 0, 9], [0, 7, 0, 9]];
        let corners = file.accessor(&corners.as_flattened().iter().map(|&x| x as u8).collect::<Vec<_>>(), 5120, "VEC3", 3);
        let view = file.json["accessors"][corners]["bufferView"].as_u64().unwrap() as usize;
        file.json["bufferViews"][view]["byteStride"] = json!(4);
        file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        file.json["meshes"][0]["primitives"] = json!([{ "attributes": { "POSITION": corners } }]);
    }));
    assert_eq!(model.meshes[0].positions, [[0., 0., 0.], [-5., 0., 0.], [0., 7., 0.]]);
}

#[test]
fn sparse_accessors_replace_elements() {
    let model = load(cube(|file| {
        let indices = file.view(&[2, 7]);
        let values: Vec<u8> = [5f32, 6., 7., 8., 9., 10.].iter().flat_map(|x| x.to_le_bytes()).collect();
        let values = file.view(&values);
        let sparse = json!({ "count": 2, "indices": { "bufferView": indices, "componentType": 5121 }, "values": { "bufferView": values } });
        file.json["accessors"][0]["sparse"] = sparse;
    }));
    assert_eq!(model.meshes[0].positions[1], [1.0, 0.0, 0.0]);
    assert_eq!((model.meshes[0].positions[2], model.meshes[0].positions[7]), ([5.0, 6.0, 7.0], [8.0, 9.0, 10.0]));
}

#[test]
fn a_mesh_keeps_only_the_vertices_that_it_uses() {
    let model = load(cube(|file| {
        let indices = file.accessor(&[1, 4, 6], 5121, "SCALAR", 3);
        let attributes = json!({ "POSITION": 0 });
        file.json["meshes"][0]["primitives"] = json!([{ "attributes": attributes, "indices": indices }]);
    }));
    assert_eq!(model.meshes[0].positions, [[1., 0., 0.], [0., 0., 1.], [1., 1., 1.]]);
    assert_eq!(model.meshes[0].triangles, [[0, 1, 2]]);
}

/// A textured quad-like cube whose material is `material`.
fn textured(material: serde_json::Value, sampler: serde_json::Value) -> Gltf {
    cube(|file| {
        let png = file.view(&small_png());
        let first = file.floats(&[[0.25, 0.75]; 8], "VEC2");
        let second = file.floats(&[[0.5, 1.0]; 8], "VEC2");
        *file.attributes() = json!({ "POSITION": 0, "TEXCOORD_0": first, "TEXCOORD_1": second });
        file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
        file.json["materials"] = json!([material]);
        file.json["samplers"] = json!([sampler]);
        file.json["images"] = json!([{ "bufferView": png, "mimeType": "image/png" }]);
        file.json["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    })
}

#[test]
fn materials_carry_colour_texture_mask_and_sides() {
    let material = json!({
        "name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.3, "doubleSided": true,
        "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 1, 0.75], "baseColorTexture": { "index": 0 }, "metallicFactor": 0 },
    });
    let model = load(textured(material, json!({ "wrapS": 33071, "wrapT": 33648 })));
    let leaf = &model.materials[model.meshes[0].material];
    assert_eq!((leaf.name.as_str(), leaf.base_color), ("leaf", [0.5, 0.25, 1.0, 0.75]));
    assert_eq!((leaf.alpha, leaf.double_sided), (AlphaMode::Mask(0.3), true));
    let Texture::Image { wrap, .. } = &model.textures[leaf.base_color_texture.unwrap()] else { panic!("an image is expected") };
    assert_eq!(*wrap, [Wrap::Clamp, Wrap::Mirror]);
    let texture = &model.textures[0];
    assert_eq!(texture.rgba(DVec2::new(0.25, 0.25)), [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(texture.rgba(DVec2::new(0.25, 0.75)), [0.0, 0.0, 1.0, 1.0]);
    assert_eq!(texture.rgba(DVec2::new(0.75, 0.75)), [1.0, 1.0, 1.0, 128.0 / 255.0]);
    assert_eq!(model.warnings, [] as [&str; 0]);
    let plain = load(cube(|_| {}));
    let default = &plain.materials[plain.meshes[0].material];
    assert_eq!(*default, ModelMaterial::new("default"));
}

#[test]
fn smaller_copies_are_made_where_a_sampler_asks_for_mipmaps() {
    for (filter, asks) in [
        (None, false),
        (Some(9728), false),
        (Some(9729), false),
        (Some(9984), true),
        (Some(9985), true),
        (Some(9986), true),
        (Some(9987), true),
    ] {
        let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicFactor": 0 } });
        let model = load(textured(material, filter.map_or(json!({}), |filter| json!({ "minFilter": filter }))));
        assert_eq!(model.textures[0].is_filtered(), asks, "{filter:?}");
    }
}

#[test]
fn texture_coordinates_are_those_that_the_texture_asks_for() {
    let uv = |info: serde_json::Value| {
        let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": info, "metallicFactor": 0 } });
        let model = load(textured(material, json!({})));
        let [u, v] = model.meshes[0].uvs[0].map(f64::from);
        let DVec2 { x, y } = model.textures[0].coordinates().of([DVec2::new(u, v), DVec2::NAN]);
        [x, y]
    };
    assert_eq!(uv(json!({ "index": 0 })), [0.25, 0.75]);
    assert_eq!(uv(json!({ "index": 0, "texCoord": 1 })), [0.5, 1.0]);
    // The extension's own example: the lower left quadrant, turned clockwise. (0.25, 0.75) halved is (0.125, 0.375).
    let transform = json!({ "offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5] });
    let [u, v] = uv(json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } }));
    assert!((u - 0.375).abs() < 1e-6 && (v - 0.875).abs() < 1e-6, "{u} {v}");
    let other_set = json!({ "scale": [1, -1], "offset": [0, 1], "texCoord": 1 });
    assert_eq!(uv(json!({ "index": 0, "extensions": { "KHR_texture_transform": other_set } })), [0.5, 0.0]);
}

#[test]
fn buffers_come_from_data_uris_and_from_files() {
    let expected = triangles(&load(cube(|_| {})));
    let (file, _) = cube(|_| {}).gltf(None);
    assert_eq!(triangles(&load_with(ModelFormat::Gltf, &file, &[]).unwrap()), expected);
    assert_eq!(model_references(ModelFormat::Gltf, &file).unwrap(), [] as [&str; 0]);
    let (file, bin) = cube(|_| {}).gltf(Some("./sub%20folder/cube.bin"));
    assert_eq!(model_references(ModelFormat::Gltf, &file).unwrap(), ["sub folder/cube.bin"]);
    assert_eq!(triangles(&load_with(ModelFormat::Gltf, &file, &[("sub folder/cube.bin", &bin)]).unwrap()), expected);
}

#[test]
fn only_needed_images_are_referred_to() {
    let mut file =
        textured(json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } }, "occlusionTexture": { "index": 1 } }), json!({}));
    file.json["images"] = json!([{ "uri": "color.png" }, { "uri": "occlusion.png" }]);
    file.json["textures"] = json!([{ "source": 0 }, { "source": 1 }]);
    let (bytes, bin) = file.gltf(Some("b.bin"));
    assert_eq!(model_references(ModelFormat::Gltf, &bytes).unwrap(), ["b.bin", "color.png"]);
    let model = load_with(ModelFormat::Gltf, &bytes, &[("b.bin", &bin), ("color.png", &small_png())]).unwrap();
    assert_eq!(model.textures.len(), 1);
}

#[test]
fn names_outside_of_the_folder_are_refused() {
    for uri in
        ["../secret.bin", "/etc/passwd", "C:/x.bin", "a/../../b.bin", "%2e%2e/b.bin", "https://example.org/b.bin", "..\\b.bin", "%00", ""]
    {
        let (file, _) = cube(|_| {}).gltf(Some(uri));
        assert!(model_references(ModelFormat::Gltf, &file).is_err(), "{uri}");
    }
}

#[test]
fn what_is_not_modelled_is_named() {
    let mut file = textured(
        json!({ "name": "glass", "alphaMode": "BLEND", "emissiveFactor": [0, 1, 0], "normalTexture": { "index": 0 }, "extensions": { "KHR_materials_unlit": {} } }),
        json!({ "magFilter": 9728 }),
    );
    let metal = |name: usize| json!({ "name": format!("metal {name}") });
    for name in 0..6 {
        file.push("materials", metal(name));
    }
    file.json["materials"][0]["pbrMetallicRoughness"] =
        json!({ "metallicFactor": 0, "roughnessFactor": 0.5, "baseColorTexture": { "index": 0, "texCoord": 3 } });
    file.json["extensionsUsed"] = json!(["KHR_texture_transform", "KHR_materials_iridescence", "KHR_lights_punctual"]);
    file.json["animations"] = json!([{ "channels": [], "samplers": [] }]);
    file.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1, "znear": 1 } }]);
    file.json["skins"] = json!([{ "joints": [0] }]);
    file.json["nodes"] = json!([{ "mesh": 0, "skin": 0, "name": "body" }]);
    let primitives = file.json["meshes"][0]["primitives"].as_array_mut().unwrap();
    primitives[0]["targets"] = json!([{ "POSITION": 0 }]);
    primitives.push(json!({ "attributes": { "POSITION": 0 }, "mode": 1 }));
    primitives.push(json!({ "attributes": {} }));
    insta::assert_snapshot!(load(file).warnings.join("\n"));
}

#[test]
fn errors_name_the_place() {
    type Change = fn(&mut Gltf);
    let changes: [(&str, Change); 21] = [
        ("accessor too long", |f| f.json["accessors"][0]["count"] = json!(9)),
        ("accessor huge", |f| f.json["accessors"][0]["count"] = json!(1u64 << 62)),
        ("no elements of no buffer view", |f| {
            f.json["accessors"][0] = json!({ "count": 1u64 << 40, "componentType": 5126, "type": "VEC3" })
        }),
        ("unindexed elements of no buffer view", |f| {
            f.json["accessors"][0] = json!({ "count": 1u64 << 31, "componentType": 5126, "type": "VEC3" });
            f.json["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 } });
        }),
        ("view outside", |f| f.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX)),
        ("view of no buffer", |f| f.json["bufferViews"][0]["buffer"] = json!(3)),
        ("no accessor", |f| f.attributes()["POSITION"] = json!(77)),
        ("index outside", |f| f.bin[96] = 200),
        ("not finite", |f| f.bin[12..16].copy_from_slice(&f32::NAN.to_le_bytes())),
        ("wrong type", |f| f.json["accessors"][0]["type"] = json!("VEC2")),
        ("unknown type", |f| f.json["accessors"][0]["type"] = json!("VEC9")),
        ("float indices", |f| f.json["accessors"][1] = json!({ "bufferView": 0, "componentType": 5126, "type": "SCALAR", "count": 3 })),
        ("short uvs", |f| {
            let uvs = f.floats(&[[0.0, 0.0]; 7], "VEC2");
            f.attributes()["TEXCOORD_0"] = json!(uvs);
        }),
        ("no material", |f| f.json["meshes"][0]["primitives"][0]["material"] = json!(4)),
        ("no mesh", |f| f.json["nodes"][0]["mesh"] = json!(1)),
        ("cycle", |f| {
            f.json["nodes"] = json!([{ "children": [1] }, { "children": [0], "name": "a" }]);
            f.json["scenes"] = json!([{ "nodes": [1] }]);
        }),
        ("two parents", |f| f.json["nodes"] = json!([{ "children": [1, 1] }, { "mesh": 0 }])),
        ("projection", |f| f.json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1])),
        ("draco", |f| f.json["extensionsRequired"] = json!(["KHR_texture_transform", "KHR_draco_mesh_compression"])),
        ("nothing", |f| f.json["nodes"] = json!([])),
        ("no number", |f| f.json["accessors"][0]["count"] = json!("eight")),
    ];
    let errors: Vec<String> = changes.into_iter().map(|(name, change)| format!("{name}: {}", error(cube(change)))).collect();
    insta::assert_snapshot!(errors.join("\n"));
}

#[test]
fn damaged_containers_and_textures_are_named() {
    let whole = cube(|_| {}).glb();
    let mut wrong_version = whole.clone();
    wrong_version[4] = 1;
    let mut long_chunk = whole.clone();
    long_chunk[13] = 0xff;
    let mut texture = textured(json!({ "name": "wood", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }), json!({}));
    let start = texture.json["bufferViews"][2]["byteOffset"].as_u64().unwrap() as usize;
    texture.bin[start..start + 8].copy_from_slice(b"GIF89a  ");
    let load = |bytes: &[u8]| failure(load_with(ModelFormat::Gltf, bytes, &[]));
    let (missing, _) = cube(|_| {}).gltf(Some("gone.bin"));
    let (short, bin) = cube(|_| {}).gltf(Some("short.bin"));
    let errors = [
        load(b""),
        load(b"glTF"),
        load(&whole[..whole.len() - 1]),
        load(&wrong_version),
        load(&long_chunk),
        load(b"{ \"asset\": {"),
        load(b"\x89PNG"),
        error(texture),
        load(&missing),
        failure(load_with(ModelFormat::Gltf, &short, &[("short.bin", &bin[..50])])),
    ];
    insta::assert_snapshot!(errors.join("\n"));
}

#[test]
fn many_meshes_of_the_same_data_stay_within_bounds() {
    // A thousand primitives may share one list of triangles of a file this small only as long as they together mean little.
    let mut file = Gltf::new(json!({ "nodes": [{ "mesh": 0 }] }));
    let positions = file.floats(&[[1.0; 3]; 20_000], "VEC3");
    let primitive = json!({ "attributes": { "POSITION": positions } });
    file.json["meshes"] = json!([{ "primitives": vec![primitive; 1000] }]);
    assert!(error(file).contains("more than a file of"));
}

#[test]
fn deep_hierarchies_need_no_deep_stack() {
    let count = 200_000;
    let mut nodes: Vec<_> = (1..count).map(|child| json!({ "children": [child] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    assert_eq!(load(Gltf::cube(json!({ "nodes": nodes }))).instances.len(), 1);
}

#[test]
fn cubes_have_twelve_triangles() {
    let model = load(cube(|_| {}));
    assert_eq!(model.meshes[0].triangles.len(), cube_triangles().len());
    assert_eq!(model.meshes[0].name, "cube");
}
