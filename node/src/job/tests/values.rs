//! What keys become in the description.

use tessera_engine::description::{
    Absorption, Aov, AssetSource, Bumps, Camera, ColorSpace, Environment, Falloff, Light, Material, MeshData, MetallicRoughness,
    ObjectKind, Render, Shape, Texture, TextureFilter, Wrap,
};

use super::{BUDGET, job_with, run, small_job};
use crate::{
    job::{LoadedJob, PixelType},
    schedule::{Assign, Probe, Split},
};

fn load(script: &str) -> LoadedJob {
    run(script, &[], &[], BUDGET).unwrap_or_else(|fault| panic!("{fault}\n{script}"))
}

/// A job of these objects, lights aside.
fn scene(objects: &str) -> LoadedJob {
    load(&job_with(&format!(
        "return tessera.job {{ scene = tessera.scene {{ objects = {{ {objects} }} }}, film = {{ width = 8, height = 8 }},
camera = tessera.perspective {{ eye = {{0, 0, 5}} }} }}"
    )))
}

#[test]
fn a_job_that_says_little_gets_the_defaults() {
    let description = load(&small_job("")).description;
    assert_eq!(description.frame.render, Render::Whitted { max_depth: 8, transparent_shadows: false, min_weight: 0.0 });
    assert_eq!((description.frame.quality.samples, description.frame.seed), (4, 0));
    assert_eq!(description.probe, Probe::Shared { scale: 1.0 / 16.0 });
    assert_eq!(description.split, Split::Grid { width: 64, height: 64 });
    assert_eq!(description.assign, Assign::EarliestFinish);
    let output = &description.output;
    assert_eq!((output.exr.as_str(), output.png.as_deref(), output.manifest.as_str()), ("job.exr", Some("job.png"), "job.manifest.json"));
    assert_eq!((output.pixel_type, output.exposure), (PixelType::Float, 0.0));
    assert!(description.script.is_none() && description.warnings.is_empty());
}

#[test]
fn built_in_policies_and_outputs_are_taken() {
    let description = load(&small_job(
        "split = tessera.split.grid { width = 8, height = 4 }, assign = tessera.assign.paper, probe = tessera.probe.every_node { scale = 0.5 },
output = { exr = 'a.exr', png = false, pixel_type = 'half', exposure = 1.5, aovs = { 'error', 'depth', 'error' } }, seed = 9, render = tessera.raycast()",
    ))
    .description;
    assert_eq!(description.split, Split::Grid { width: 8, height: 4 });
    assert_eq!((description.assign, description.probe), (Assign::Paper, Probe::EveryNode { scale: 0.5 }));
    assert_eq!((description.output.exr.as_str(), description.output.png.as_deref()), ("a.exr", None));
    assert_eq!((description.output.pixel_type, description.output.exposure), (PixelType::Half, 1.5));
    assert_eq!(description.frame.aovs.iter().collect::<Vec<_>>(), [Aov::Depth, Aov::Error]);
    assert_eq!((description.frame.seed, &description.frame.render), (9, &Render::Raycast));
    assert_eq!(load(&small_job("split = tessera.split.strips { count = 5 }")).description.split, Split::Strips { count: 5 });
}

/// sRGB by the standard's own numbers: byte 188 is the half-way grey 0.5029, byte 255 is 1.
#[test]
fn colours_become_linear() {
    let job = load(&job_with(
        "local white, grey188 = tessera.hex('#fff'), tessera.hex('bcbcbc')
assert(white[1] == 1 and math.abs(grey188[2] - 0.502886) < 1e-6)
local half = tessera.srgb(0.5, 0, 1)
assert(math.abs(half[1] - 0.214041) < 1e-6 and half[2] == 0 and half[3] == 1)
local linear = tessera.rgb(0.25, 2, 0)
assert(linear[1] == 0.25 and linear[2] == 2)
return tessera.job { scene = tessera.scene { objects = { tessera.sphere { material = grey } }, background = linear }, film = { width = 8, height = 8 } }",
    ));
    assert_eq!(job.description.frame.scene.background, Environment::Constant([0.25, 2.0, 0.0]));
}

#[test]
fn transforms_compose_as_matrices_do() {
    let job = scene(
        "tessera.sphere { material = grey, transform = tessera.translate(1, 2, 3) * tessera.rotate({0, 0, 2}, 90) * tessera.scale(2) },
tessera.sphere { material = grey, transform = tessera.matrix { {1, 2, 0, 5}, {0, 1, 0, 6}, {0, 0, 1, 7} } },
tessera.sphere { material = grey, transform = tessera.look_at({0, 0, 9}, {0, 0, 0}) },
tessera.sphere { material = grey }",
    );
    let scene = &job.description.frame.scene;
    let transforms: Vec<_> = scene.groups[scene.root as usize].objects.iter().map(|object| object.transform).collect();
    // x goes to y, y to -x, all doubled, then moved.
    assert_eq!(transforms[0], Some([[0.0, -2.0, 0.0, 1.0], [2.0, 0.0, 0.0, 2.0], [0.0, 0.0, 2.0, 3.0]]));
    assert_eq!(transforms[1], Some([[1.0, 2.0, 0.0, 5.0], [0.0, 1.0, 0.0, 6.0], [0.0, 0.0, 1.0, 7.0]]));
    assert_eq!(transforms[2], Some([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 9.0]]));
    assert_eq!(transforms[3], None);
}

#[test]
fn shapes_groups_and_instances_keep_their_order() {
    let job = scene(
        "(function()
  local pair = tessera.group { tessera.sphere { material = grey }, { tessera.disc { radius = 2, material = grey } } }
  local four = tessera.group { pair, tessera.instance { group = pair, transform = tessera.translate(1, 0, 0) } }
  return { four, tessera.instance { group = four }, tessera.box { size = {2, 4, 6}, center = {1, 0, 0}, material = tessera.mirror {} } }
end)()",
    );
    let scene = &job.description.frame.scene;
    assert_eq!((scene.groups.len(), scene.root), (3, 2));
    let instances = |group: usize| -> Vec<u32> {
        let of = |kind: &ObjectKind| if let ObjectKind::Instance { group } = kind { Some(*group) } else { None };
        scene.groups[group].objects.iter().filter_map(|object| of(&object.kind)).collect()
    };
    assert_eq!((instances(0), instances(1), instances(2)), (vec![], vec![0, 0], vec![1, 1]));
    let ObjectKind::Shape { shape: Shape::Box { min, max }, material } = &scene.groups[2].objects[2].kind else { panic!() };
    assert_eq!((*min, *max, *material), ([0.0, -2.0, -3.0], [2.0, 2.0, 3.0], 1));
    // Equal materials are described once.
    assert_eq!(scene.materials.len(), 2);
}

#[test]
fn rectangles_cylinders_and_cones_are_described() {
    let job = scene(
        "tessera.rectangle { corner = {1, 2, 3}, edge_u = {2, 0, 0}, edge_v = {0, 4, 0}, material = grey },
tessera.rectangle { edge_u = {2, 0, 0}, edge_v = {0, 4, 0}, material = grey },
tessera.rectangle { center = {1, 2, 3}, edge_u = {2, 0, 0}, edge_v = {1, 4, 0}, material = grey },
tessera.cylinder { material = grey },
tessera.cylinder { from = {1, 2, 3}, to = {4, 5, 6}, radius = 0.5, capped = false, material = grey },
tessera.cone { material = grey },
tessera.cone { from = {1, 2, 3}, to = {4, 5, 6}, radius = 0, to_radius = 2, capped = false, material = grey }",
    );
    let scene = &job.description.frame.scene;
    let objects = &scene.groups[scene.root as usize].objects;
    let shapes: Vec<_> =
        objects.iter().filter_map(|o| if let ObjectKind::Shape { shape, .. } = &o.kind { Some(shape) } else { None }).collect();
    let rectangle = |corner, edge_u, edge_v| Shape::Rectangle { corner, edge_u, edge_v };
    assert_eq!(*shapes[0], rectangle([1.0, 2.0, 3.0], [2.0, 0.0, 0.0], [0.0, 4.0, 0.0]));
    assert_eq!(*shapes[1], rectangle([-1.0, -2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 4.0, 0.0]));
    assert_eq!(*shapes[2], rectangle([-0.5, 0.0, 3.0], [2.0, 0.0, 0.0], [1.0, 4.0, 0.0]));
    let (origin, up, from, to) = ([0.0; 3], [0.0, 1.0, 0.0], [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]);
    assert_eq!(*shapes[3], Shape::Cylinder { from: origin, to: up, radius: 1.0, capped: true });
    assert_eq!(*shapes[4], Shape::Cylinder { from, to, radius: 0.5, capped: false });
    assert_eq!(*shapes[5], Shape::Cone { from: origin, to: up, radius: 1.0, to_radius: 0.0, capped: true });
    assert_eq!(*shapes[6], Shape::Cone { from, to, radius: 0.0, to_radius: 2.0, capped: false });
}

#[test]
fn meshes_from_tables_and_from_buffers_are_the_same_asset() {
    let job = scene(
        "tessera.mesh { positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, triangles = {{1, 2, 3}}, uvs = {{0, 0}, {1, 0}, {0, 1}}, normals = {{0, 0, 2}, {0, 0, 1}, {0, 0, 1}}, material = grey },
(function()
  local positions, triangles = buffer.create(36), buffer.create(12)
  buffer.writef32(positions, 12, 1) buffer.writef32(positions, 28, 1)
  buffer.writeu32(triangles, 4, 1) buffer.writeu32(triangles, 8, 2)
  return tessera.mesh { positions = positions, triangles = triangles, uvs = {{0, 0}, {1, 0}, {0, 1}}, normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}, material = grey }
end)()",
    );
    assert_eq!(job.description.assets.len(), 1);
    let bytes = job.assets.bytes(job.description.assets[0]).unwrap();
    let mesh: MeshData = postcard::from_bytes(&bytes).unwrap();
    assert_eq!(mesh.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!((mesh.triangles, mesh.normals[0]), (vec![[0, 1, 2]], [0.0, 0.0, 1.0]));
}

#[test]
fn lights_cameras_and_textures_are_described() {
    let png = tiny_png();
    let script = job_with(
        "return tessera.job {
  scene = tessera.scene {
    objects = { tessera.plane { material = tessera.diffuse { reflectance = tessera.image { file = 'tiny.png', wrap = {'clamp', 'mirror'}, scale = 3, offset = {0.5, -1}, color_space = 'linear', filter = 'trilinear' } } } },
    lights = { tessera.point { position = {1, 2, 3}, intensity = 5, falloff = 'none' }, tessera.directional { direction = {0, -1, 0}, irradiance = {1, 2, 3} } },
  },
  camera = tessera.perspective { eye = {0, 1, 5}, look_at = {0, 1, 0}, up = {0, 1, 0}, fov = 60 },
  film = { width = 8, height = 8, filter = 'point' },
}",
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("tiny.png"), png).unwrap();
    std::fs::write(folder.path().join("job.lua"), script).unwrap();
    let job = super::load_file(&folder.path().join("job.lua"), &[], BUDGET).unwrap_or_else(|fault| panic!("{fault}"));
    let frame = &job.description.frame;
    assert!(matches!(
        frame.scene.lights[0],
        Light::Point { position: [1.0, 2.0, 3.0], intensity: [5.0, 5.0, 5.0], falloff: Falloff::None, .. }
    ));
    assert!(matches!(frame.scene.lights[1], Light::Directional { irradiance: [1.0, 2.0, 3.0], .. }));
    assert!(matches!(frame.camera, Camera::Perspective { horizontal_fov: 60.0, .. }));
    let Texture::Image { wrap, color_space, filter, file, scale, offset, .. } = frame.scene.textures[0] else { panic!() };
    assert_eq!((wrap, color_space, filter), ([Wrap::Clamp, Wrap::Mirror], ColorSpace::Linear, TextureFilter::Trilinear));
    assert_eq!((scale, offset), ([3.0; 2], [0.5, -1.0]));
    assert_eq!(job.description.assets, [file]);
    assert!(matches!(frame.scene.materials[0], Material::Diffuse { texture: Some(0), .. }));
}

#[test]
fn the_metallic_roughness_model_is_described_by_gltf_s_names() {
    let script = job_with(
        "local bumps = tessera.image { file = 'tiny.png', color_space = 'linear' }
local all = tessera.metallic_roughness {
  base_color = tessera.checker {}, metallic = 0.25, roughness = 0.5, metallic_roughness = bumps, normal = bumps, normal_scale = 2,
  emissive = {1, 2, 3}, ior = 1.75, specular = 0.5, specular_color = {1, 0.5, 2}, transmission = 0.125, volume = true, attenuation_color = {0.5, 1, 0.25},
  attenuation_distance = 4, clearcoat = 0.75, clearcoat_roughness = 0.0625, clearcoat_normal = tessera.noise {}, clearcoat_normal_scale = -1,
  sheen_color = {0, 0.5, 1}, sheen_roughness = 0.375, anisotropy = 0.625, anisotropy_rotation = 450,
}
return tessera.job {
  scene = tessera.scene { objects = { tessera.sphere { material = tessera.metallic_roughness {} }, tessera.sphere { material = all } } },
  film = { width = 8, height = 8 },
}",
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("tiny.png"), tiny_png()).unwrap();
    std::fs::write(folder.path().join("job.lua"), script).unwrap();
    let job = super::load_file(&folder.path().join("job.lua"), &[], BUDGET).unwrap_or_else(|fault| panic!("{fault}"));
    let scene = &job.description.frame.scene;
    assert_eq!(scene.materials[0], Material::MetallicRoughness(Box::default()));
    let Material::MetallicRoughness(model) = &scene.materials[1] else { panic!() };
    assert!(matches!(scene.textures[..], [Texture::Checker { .. }, Texture::Image { .. }, Texture::Noise { .. }]));
    let expected = MetallicRoughness {
        base_color: [1.0; 3],
        base_color_texture: Some(0),
        metallic: 0.25,
        roughness: 0.5,
        metallic_roughness_texture: Some(1),
        normal: Some(Bumps { texture: 1, scale: 2.0 }),
        emissive: [1.0, 2.0, 3.0],
        emissive_texture: None,
        ior: 1.75,
        specular: 0.5,
        specular_color: [1.0, 0.5, 2.0],
        transmission: 0.125,
        volume: Some(Absorption { color: [0.5, 1.0, 0.25], distance: 4.0 }),
        clearcoat: 0.75,
        clearcoat_roughness: 0.0625,
        clearcoat_normal: Some(Bumps { texture: 2, scale: -1.0 }),
        sheen_color: [0.0, 0.5, 1.0],
        sheen_roughness: 0.375,
        anisotropy: 0.625,
        anisotropy_rotation: std::f32::consts::FRAC_PI_2,
    };
    assert_eq!(**model, expected);
}

#[test]
fn numbers_of_the_metallic_roughness_model_are_no_colours() {
    for (keys, message) in [
        ("normal = tessera.image { file = 'tiny.png' }", "`normal` holds numbers, not colours"),
        ("normal = {1, 2, 3}", "`normal` must be a texture"),
        ("normal_scale = 2", "`normal_scale` goes with `normal`"),
        ("attenuation_distance = 2", "go with `volume = true`"),
        ("ior = 0.5", "`ior` must be a number from 1 to 10"),
    ] {
        let script = job_with(&format!(
            "return tessera.job {{ scene = tessera.scene {{ objects = {{ tessera.sphere {{ material = tessera.metallic_roughness {{ {keys} }} }} }} }} }}"
        ));
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("tiny.png"), tiny_png()).unwrap();
        std::fs::write(folder.path().join("job.lua"), script).unwrap();
        let Err(fault) = super::load_file(&folder.path().join("job.lua"), &[], BUDGET) else { panic!("{keys} is taken") };
        assert!(fault.to_string().contains(message), "{fault}");
    }
}

/// One white pixel.
fn tiny_png() -> Vec<u8> {
    const HEX: &str = "89504e470d0a1a0a0000000d4948445200000001000000010802000000907753de0000000c49444154789c63f8ffff3f0005fe02fe0def46b80000000049454e44ae426082";
    (0..HEX.len()).step_by(2).map(|at| u8::from_str_radix(&HEX[at..at + 2], 16).unwrap()).collect()
}

#[test]
fn parameters_take_the_type_of_their_default() {
    let script = job_with(
        "assert(tessera.param('count', 30) == 12 and tessera.param('fast', false) == true and tessera.param('word', 'a') == 'b')
assert(tessera.param('unset', 5) == 5 and tessera.param('text') == '7')
return tessera.job { scene = tessera.scene { objects = { tessera.sphere { material = grey } } }, film = { width = 8, height = 8 } }",
    );
    let given = [("count", "12"), ("fast", "true"), ("word", "b"), ("text", "7")];
    let job = run(&script, &[], &given, BUDGET).unwrap_or_else(|fault| panic!("{fault}"));
    assert_eq!(job.description.parameters.len(), 4);
}

/// The first numbers of SplitMix64 with state 0, from its authors' reference.
#[test]
fn random_numbers_are_the_published_ones() {
    load(&job_with(
        "local random = tessera.random(0)
assert(random:uniform() == 0.8833108082136426)
for _ = 1, 1000 do
  local p = random:in_sphere(2)
  assert(p[1] ^ 2 + p[2] ^ 2 + p[3] ^ 2 <= 4)
  local q = random:on_sphere(2)
  assert(math.abs(q[1] ^ 2 + q[2] ^ 2 + q[3] ^ 2 - 4) < 1e-12)
  local d = random:in_disc(3)
  assert(d[2] == 0 and d[1] ^ 2 + d[3] ^ 2 <= 9)
  local i = random:integer(-2, 2)
  assert(i >= -2 and i <= 2 and i % 1 == 0)
  assert(random:choice({'a', 'b'}) ~= nil)
end
local sum, squares = 0, 0
for _ = 1, 10000 do local x = random:normal(3, 2) sum = sum + x squares = squares + (x - 3) ^ 2 end
assert(math.abs(sum / 10000 - 3) < 0.1 and math.abs(squares / 10000 - 4) < 0.3)
local list = random:shuffle({1, 2, 3, 4, 5})
table.sort(list)
assert(table.concat(list) == '12345')
return tessera.job { scene = tessera.scene { objects = { tessera.sphere { material = grey } } }, film = { width = 8, height = 8 } }",
    ));
}

#[test]
fn replaced_library_functions_keep_their_meaning() {
    load(&job_with(
        "assert(string.find('a.b.c', '.', 2, true) == 2 and string.find('abc', 'c') == 3 and string.find('abc', 'x') == nil)
assert(string.find('abc', 'b', -2) == 2 and string.find('abc', '', 4) == 4 and string.find('abc', '', 5) == nil)
assert(('key = value'):find('(%w+) = (%w+)') == 1)
assert(table.concat(string.split('a--b--', '--'), '|') == 'a|b|' and table.concat(('a,b'):split(','), '|') == 'a|b')
local list = table.move({1, 2, 3}, 1, 3, 2)
assert(table.concat(list, ' ') == '1 1 2 3')
local many = {}
for i = 1, 70000 do many[i] = (i * 7919) % 70001 end
table.sort(many)
for i = 2, #many do assert(many[i - 1] <= many[i]) end
local ok, message = pcall(function() error({ code = 5 }) end)
assert(not ok and message.code == 5)
return tessera.job { scene = tessera.scene { objects = { tessera.sphere { material = grey } } }, film = { width = 8, height = 8 } }",
    ));
}
