use std::fmt::Write;

use glam::DVec3;
use serde_json::json;

use super::{CUBE_CORNERS, CUBE_FACES, check_promises, failure, glb::Gltf, load_with, small_png, triangles};
use crate::{
    assets::{AlphaMode, LoadedModel, model_references, part_references},
    description::{ModelFormat, Wrap},
    texture::{Texture, srgb_to_linear},
};

fn load(text: &str, parts: &[(&str, &[u8])]) -> LoadedModel {
    let model = load_with(ModelFormat::Obj, text.as_bytes(), parts).unwrap();
    check_promises(&model);
    model
}

fn error(text: &str) -> String {
    failure(load_with(ModelFormat::Obj, text.as_bytes(), &[]))
}

/// The unit cube with quads.
pub fn cube() -> String {
    let mut text = String::from("# a cube\no cube\n");
    CUBE_CORNERS.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
    CUBE_FACES.iter().for_each(|face| writeln!(text, "f {} {} {} {}", face[0] + 1, face[1] + 1, face[2] + 1, face[3] + 1).unwrap());
    text
}

#[test]
fn a_cube_is_the_same_as_in_gltf() {
    let expected = load_with(ModelFormat::Gltf, &Gltf::cube(json!({ "nodes": [{ "mesh": 0 }] })).glb(), &[]).unwrap();
    assert_eq!(triangles(&load(&cube(), &[])), triangles(&expected));
    let with_line_ends = cube().replace('\n', "\r\n");
    assert_eq!(triangles(&load(&with_line_ends, &[])), triangles(&expected));
    // The same faces counted back from the end.
    let cube = cube();
    let backwards = cube.lines().map(|line| match line.strip_prefix("f ") {
        Some(face) => format!("f {}", face.split(' ').map(|i| (i.parse::<i32>().unwrap() - 9).to_string()).collect::<Vec<_>>().join(" ")),
        None => line.to_owned(),
    });
    assert_eq!(triangles(&load(&backwards.collect::<Vec<_>>().join("\n"), &[])), triangles(&expected));
}

#[test]
fn cubes_stay_sharp_and_spheres_become_smooth() {
    for mesh in load(&cube(), &[]).meshes {
        for (triangle, normal) in mesh.triangles.iter().flat_map(|triangle| triangle.map(|index| (triangle, mesh.normals[index as usize])))
        {
            let [a, b, c] = triangle.map(|index| DVec3::from_array(mesh.positions[index as usize].map(f64::from)));
            assert_eq!((b - a).cross(c - a).normalize().to_array().map(|x| x as f32), normal);
        }
    }
    let (rings, sectors) = (24, 48);
    let mut text = String::new();
    for ring in 0..=rings {
        for sector in 0..sectors {
            let (theta, phi) =
                (std::f64::consts::PI * f64::from(ring) / f64::from(rings), std::f64::consts::TAU * f64::from(sector) / f64::from(sectors));
            writeln!(text, "v {} {} {}", theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()).unwrap();
        }
    }
    for ring in 0..rings {
        for sector in 0..sectors {
            let at = |ring: i32, sector: i32| ring * sectors + sector % sectors + 1;
            writeln!(text, "f {} {} {} {}", at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1), at(ring, sector + 1))
                .unwrap();
        }
    }
    let sphere = &load(&text, &[]).meshes[0];
    assert_eq!(sphere.positions.len(), ((rings + 1) * sectors) as usize);
    for (position, normal) in sphere.positions.iter().zip(&sphere.normals) {
        let cosine: f32 = position.iter().zip(normal).map(|(a, b)| a * b).sum();
        assert!(cosine > 0.995, "{position:?} {normal:?}");
    }
}

#[test]
fn smoothing_groups_decide_where_a_file_has_them() {
    let normals = |group: &str| load(&cube().replacen("f ", &format!("s {group}\nf "), 1), &[]).meshes[0].normals.clone();
    assert_eq!(normals("off").len(), 24);
    assert_eq!(normals("0").len(), 24);
    let smooth = normals("1");
    assert_eq!(smooth.len(), 8);
    // Corner (0, 0, 0) by whatever areas its triangles have: out along all three axes.
    assert!(smooth.iter().any(|normal| normal.iter().all(|&x| x < -0.3)));
}

#[test]
fn corners_name_position_texture_and_normal_apart() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0 # a comment\nvt 0 0\nvt 0.5 0.25\nvn 0 0 2\nvn 0 1 0\n\
                f 1/1/1 2/2/1 3/1/1\nf 3//2 2//2 4//2\n";
    let model = load(text, &[]);
    let mesh = &model.meshes[0];
    assert_eq!(mesh.positions.len(), 6);
    assert_eq!((mesh.uvs[1], mesh.normals[1]), ([0.5, 0.75], [0.0, 0.0, 1.0]));
    assert_eq!(mesh.normals[3], [0.0, 1.0, 0.0]);
    // A face without normals among faces with them: its own are made.
    let mixed = load(&text.replace("3//2 2//2 4//2", "3 2 4"), &[]);
    assert_eq!(mixed.meshes[0].normals[3], [0.0, 0.0, 1.0]);
}

#[test]
fn concave_polygons_and_joined_lines_are_read() {
    let text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.5 0\nv 0 2 0\nf 1 2 \\\n3 4 5\n";
    assert_eq!(load(text, &[]).meshes[0].triangles.len(), 3);
}

#[test]
fn colours_of_vertices_are_srgb() {
    let model = load("v 0 0 0 1 0 0.5\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nv 1 1 0\nf 1 2 3\nf 3 2 4\n", &[]);
    assert_eq!(model.meshes[0].colors[0], [1.0, 0.0, srgb_to_linear(0.5) as f32, 1.0]);
    assert_eq!(model.meshes[0].colors[3], [1.0; 4]);
    assert_eq!(model.materials[0].base_color, [1.0; 4]);
    assert_eq!(load(&cube(), &[]).materials[0].base_color, [0.8, 0.8, 0.8, 1.0]);
}

#[test]
fn materials_come_from_libraries() {
    let obj = cube().replace("o cube", "mtllib sub/my materials.mtl\nusemtl wood\nvt 0.5 0.5").replacen("f 5", "usemtl leaf\nf 5", 1);
    let mtl = "# made by hand\nnewmtl wood\nKd 0.5 0.25 1\nKs 0 0 0\nmap_Kd -clamp on -s 1 1 1 ../pictures/wood 1.png\n\
               newmtl leaf\nmap_Kd leaf.png\nmap_d leaf.png\nillum 2\n";
    assert_eq!(model_references(ModelFormat::Obj, obj.as_bytes()).unwrap(), ["sub/my materials.mtl"]);
    assert_eq!(part_references("sub/my materials.mtl", mtl.as_bytes()).unwrap(), ["pictures/wood 1.png", "sub/leaf.png"]);
    let png = small_png();
    let parts: [(&str, &[u8]); 3] = [("sub/my materials.mtl", mtl.as_bytes()), ("pictures/wood 1.png", &png), ("sub/leaf.png", &png)];
    let model = load(&obj, &parts);
    assert_eq!(model.meshes.iter().map(|mesh| mesh.triangles.len()).collect::<Vec<_>>(), [2, 10]);
    let [wood, leaf] = &model.materials[..] else { panic!("two materials are expected") };
    assert_eq!((wood.name.as_str(), wood.base_color, wood.alpha), ("wood", [0.5, 0.25, 1.0, 1.0], AlphaMode::Opaque));
    assert_eq!((leaf.name.as_str(), leaf.base_color, leaf.alpha), ("leaf", [1.0; 4], AlphaMode::Blend));
    let wraps = model.textures.iter().map(|texture| match texture {
        Texture::Image { wrap, .. } => *wrap,
        _ => panic!("an image is expected"),
    });
    assert_eq!(wraps.collect::<Vec<_>>(), [[Wrap::Clamp; 2], [Wrap::Repeat; 2]]);
    assert_eq!(model.warnings, ["material \"wood\": the texture option -s is not modelled"]);
}

#[test]
fn what_is_missing_or_not_modelled_is_named() {
    let obj = cube().replace("o cube", "mtllib here.mtl\nmtllib gone.mtl\nusemtl glass")
        + "usemtl lost\nf 1 2 3\nl 1 2\nf 1 2\ncurv 0 1 1 2\nshadow_obj x\n";
    let mtl = "newmtl glass\nKd 0 0 0\nKs 1 1 1\nKe 1 1 1\nd 0.2\nmap_Kd lost.png\nmap_Bump b.png\nmap_d d.png\n";
    insta::assert_snapshot!(load(&obj, &[("here.mtl", mtl.as_bytes())]).warnings.join("\n"));
}

#[test]
fn errors_name_the_line() {
    let cases = [
        "",
        "v 0 0 0\n",
        "v 0 0\n",
        "v 0 nan 0\n",
        "\n\nv 0 inf 0\n",
        "v 1 x 0\n",
        "vn 1\n",
        "vt\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//9223372036854775807 2//1 3//1\n",
        "v 0 0 0\nf a b c\n",
        "v 0 0 0\nf 1/1/1/1\n",
        "mtllib ../x.mtl\n",
        "mtllib /x.mtl\n",
    ];
    insta::assert_snapshot!(cases.map(error).join("\n"));
    let mtl = b"newmtl a\nKd 1 1 1\n\nd inf\n".as_slice();
    let wrong = failure(load_with(ModelFormat::Obj, b"mtllib a.mtl\n", &[("a.mtl", mtl)]));
    assert_eq!(wrong, "line 1: a.mtl, line 4: \"inf\" is not a finite number");
    let broken = b"newmtl a\nmap_Kd a.png\n".as_slice();
    let wrong = failure(load_with(ModelFormat::Obj, b"mtllib a.mtl\n", &[("a.mtl", broken), ("a.png", b"no picture")]));
    assert!(wrong.starts_with("line 1: a.mtl: material \"a\": a.png: this is not an image"), "{wrong}");
}

#[test]
fn text_that_is_not_utf8_is_no_obstacle() {
    let mut bytes = b"# Gr\xfc\xdfe\n".to_vec();
    bytes.extend(cube().into_bytes());
    assert_eq!(load_with(ModelFormat::Obj, &bytes, &[]).unwrap().meshes[0].triangles.len(), 12);
}
