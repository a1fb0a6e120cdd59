use std::fmt::Write;

use super::{CUBE_CORNERS, CUBE_FACES, check_promises, failure, load_with, obj, triangles};
use crate::{assets::LoadedModel, description::ModelFormat, texture::srgb_to_linear};

fn load(bytes: &[u8]) -> LoadedModel {
    let model = load_with(ModelFormat::Ply, bytes, &[]).unwrap();
    check_promises(&model);
    model
}

fn error(text: &str) -> String {
    failure(load_with(ModelFormat::Ply, text.as_bytes(), &[]))
}

fn header(format: &str, vertex: &str, index: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment by hand\nelement vertex 8\nproperty {vertex} x\nproperty {vertex} y\nproperty {vertex} z\n\
         property uchar quality\nelement face 6\nproperty list uchar {index} vertex_indices\nend_header\n"
    )
}

/// The unit cube as text.
pub fn ascii_cube() -> String {
    let mut text = header("ascii", "float", "int");
    CUBE_CORNERS.iter().for_each(|[x, y, z]| writeln!(text, "{x} {y} {z} 7").unwrap());
    CUBE_FACES.iter().for_each(|[a, b, c, d]| writeln!(text, "4 {a} {b} {c} {d}").unwrap());
    text
}

/// The unit cube in binary with doubles and 16-bit indices.
pub fn binary_cube(big_endian: bool) -> Vec<u8> {
    let mut bytes = header(if big_endian { "binary_big_endian" } else { "binary_little_endian" }, "double", "ushort").into_bytes();
    for corner in CUBE_CORNERS {
        let coordinate = |x: f32| if big_endian { f64::from(x).to_be_bytes() } else { f64::from(x).to_le_bytes() };
        corner.iter().for_each(|&x| bytes.extend(coordinate(x)));
        bytes.push(7);
    }
    for face in CUBE_FACES {
        bytes.push(4);
        face.iter().for_each(|&i| bytes.extend(if big_endian { (i as u16).to_be_bytes() } else { (i as u16).to_le_bytes() }));
    }
    bytes
}

#[test]
fn a_cube_is_the_same_as_in_obj() {
    let expected = load_with(ModelFormat::Obj, obj::cube().as_bytes(), &[]).unwrap();
    for bytes in [ascii_cube().into_bytes(), binary_cube(false), binary_cube(true)] {
        let model = load(&bytes);
        assert_eq!(triangles(&model), triangles(&expected));
        assert_eq!(model.meshes[0].normals, expected.meshes[0].normals);
        assert!(model.materials[0].double_sided);
    }
}

#[test]
fn attributes_of_vertices_are_read() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n\
                property float ny\nproperty float nz\nproperty float s\nproperty float t\nproperty uchar red\nproperty uchar green\n\
                property uchar blue\nproperty uchar alpha\nelement face 1\nproperty list uchar int vertex_index\nend_header\n\
                0 0 0 0 0 2 0.25 0.25 255 0 51 102\n1 0 0 0 0 2 1 0 0 0 0 255\n0 1 0 0 2 0 0 1 0 0 0 255\n3 0 1 2\n";
    let model = load(text.as_bytes());
    let mesh = &model.meshes[0];
    assert_eq!(mesh.normals, [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]);
    assert_eq!(mesh.uvs, [[0.25, 0.75], [1.0, 1.0], [0.0, 0.0]]);
    assert_eq!(mesh.colors[0], [1.0, 0.0, srgb_to_linear(0.2) as f32, 0.4]);
    assert_eq!(model.materials[0].base_color, [1.0; 4]);
    let floats = text.replace("uchar red", "float red").replace("uchar green", "float green").replace("uchar blue", "float blue");
    let floats = floats.replace("255 0 51 102", "1 0 0.2 102").replace("uchar alpha\n", "uchar other\n");
    assert_eq!(load(floats.as_bytes()).meshes[0].colors[0], [1.0, 0.0, srgb_to_linear(0.2) as f32, 1.0]);
}

#[test]
fn what_is_not_modelled_is_named() {
    let text = ascii_cube()
        .replace("comment by hand", "comment TextureFile wood.png")
        .replace("vertex_indices\n", "vertex_indices\nproperty list uchar float texcoord\nelement edge 1\nproperty int a\n")
        .lines()
        .map(|line| if line.starts_with("4 ") { format!("{line} 0\n") } else { format!("{line}\n") })
        .collect::<String>()
        + "5\n";
    insta::assert_snapshot!(load(text.as_bytes()).warnings.join("\n"));
}

#[test]
fn errors_name_the_place() {
    let cube = ascii_cube();
    let cases = [
        String::new(),
        "plx\n".into(),
        "ply\nformat ascii 1.0\n".into(),
        "ply\nformat ascii 1.0\nelement nonsense\nend_header\n".into(),
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n".into(),
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n".into(),
        cube.replace("face 6", "face 4000000000"),
        cube.replace("vertex 8", "vertex 18446744073709551615"),
        cube.replace("face 6", "face 60"),
        cube.replace("4 0 3 2 1", "4 0 3 2 8"),
        cube.replace("4 0 3 2 1", "4 0 3 2 -1"),
        cube.replace("4 0 3 2 1", "40 0 3 2 1"),
        cube.replace("1 1 1 7", "1 nan 1 7"),
        cube.replace("1 1 1 7", "1 1e60 1 7"),
        cube.replace("list uchar int", "list uchar float"),
        cube.replace("float x", "float u"),
        cube.replace("element vertex 8\n", "element face 1\nproperty int a\nelement vertex 8\n").replace("element face 6", "element f 6"),
    ];
    insta::assert_snapshot!(cases.iter().map(|case| error(case)).collect::<Vec<_>>().join("\n"));
}
