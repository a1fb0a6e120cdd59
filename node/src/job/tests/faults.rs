//! One mistake of every kind, and what the user reads.

use super::{BUDGET, job_with, run, small_job};

/// Files of the project that the scripts run in.
const FILES: &[(&str, &str)] = &[
    ("scenes/empty.lua", "local nothing = 1"),
    ("scenes/broken.lua", "local x = = 1"),
    ("scenes/circle.lua", "return require('scenes.circle')"),
    ("scenes/raises.lua", "\nerror('the scene is not ready')"),
    ("jobs/broken.glb", "this is no glTF"),
    ("jobs/broken.png", "this is no picture"),
    ("jobs/odd.manifest.json", "{}"),
];

/// What is wrong, the script, values given with `--set`.
type Mistake = (&'static str, String, Vec<(&'static str, &'static str)>);

fn mistakes() -> Vec<Mistake> {
    let object = |text: &str| job_with(&format!("\nlocal thing = {text}"));
    let film = |text: &str| small_job(&format!("film = {text}"));
    vec![
        ("syntax", "local x = = 1".to_owned(), vec![]),
        ("unfinished", "return tessera.job {".to_owned(), vec![]),
        ("nothing returned", "local tessera = require('tessera')".to_owned(), vec![]),
        ("another thing returned", job_with("return grey"), vec![]),
        ("nil indexed", "local x\nprint(x.y)".to_owned(), vec![]),
        ("own error", "error('spheres must be even')".to_owned(), vec![]),
        ("error object", "error({ code = 5 })".to_owned(), vec![]),
        ("unknown function", job_with("tessera.spere {}"), vec![]),
        ("unknown inner function", job_with("tessera.split.gird {}"), vec![]),
        ("unknown key", object("tessera.sphere { raduis = 2, material = grey }"), vec![]),
        ("unknown key without a near one", object("tessera.sphere { wobble = 2, material = grey }"), vec![]),
        ("named object", object("tessera.sphere { name = 'sun', radius = 'big', material = grey }"), vec![]),
        ("name that is no text", object("tessera.sphere { name = 5, material = grey }"), vec![]),
        ("missing key", object("tessera.sphere { radius = 2 }"), vec![]),
        ("wrong kind", object("tessera.sphere { material = tessera.point { position = {0, 0, 0}, intensity = 1 } }"), vec![]),
        ("shape as material", object("tessera.sphere { material = tessera.sphere { material = grey } }"), vec![]),
        ("constructor not called", object("tessera.sphere { material = tessera.mirror }"), vec![]),
        ("radius 0", object("tessera.sphere { radius = 0, material = grey }"), vec![]),
        ("NaN", object("tessera.sphere { radius = 0 / 0, material = grey }"), vec![]),
        ("infinite", object("tessera.sphere { center = {0, 1 / 0, 0}, material = grey }"), vec![]),
        ("two numbers", object("tessera.sphere { center = {0, 1}, material = grey }"), vec![]),
        ("keys instead of numbers", object("tessera.sphere { center = {x = 0, y = 1, z = 2}, material = grey }"), vec![]),
        ("text among numbers", object("tessera.sphere { center = {0, 'one', 0}, material = grey }"), vec![]),
        ("no table", object("tessera.sphere(1)"), vec![]),
        ("two tables", object("tessera.sphere({}, {})"), vec![]),
        ("list in a table", object("tessera.sphere { 1, 2, material = grey }"), vec![]),
        ("direction 0", object("tessera.plane { normal = {0, 0, 0}, material = grey }"), vec![]),
        ("box inside out", object("tessera.box { min = {0, 0, 0}, max = {1, -1, 1}, material = grey }"), vec![]),
        ("box half given", object("tessera.box { min = {0, 0, 0}, material = grey }"), vec![]),
        ("parallel edges", object("tessera.rectangle { edge_u = {1, 2, 3}, edge_v = {-2, -4, -6}, material = grey }"), vec![]),
        (
            "corner and center",
            object("tessera.rectangle { corner = {0, 0, 0}, center = {0, 0, 0}, edge_u = {1, 0, 0}, edge_v = {0, 1, 0}, material = grey }"),
            vec![],
        ),
        ("no axis", object("tessera.cylinder { to = {0, 0, 0}, material = grey }"), vec![]),
        ("cone without a radius", object("tessera.cone { radius = 0, material = grey }"), vec![]),
        ("cone inside out", object("tessera.cone { name = 'hat', to_radius = -1, material = grey }"), vec![]),
        ("negative colour", object("tessera.mirror { reflectance = {0.5, -0.1, 0.5} }"), vec![]),
        ("albedo above 1", object("tessera.diffuse { reflectance = 1.5 }"), vec![]),
        ("colour as text", object("tessera.diffuse { reflectance = '#ff8800' }"), vec![]),
        ("bad hex", object("tessera.hex('#ff88')"), vec![]),
        ("sRGB above 1", object("tessera.srgb(255, 128, 0)"), vec![]),
        ("light in objects", object("tessera.scene { objects = { tessera.point { position = {0, 1, 0}, intensity = 5 } } }"), vec![]),
        ("shape in lights", object("tessera.scene { objects = {}, lights = { tessera.sphere { material = grey } } }"), vec![]),
        ("wrong word", object("tessera.point { position = {0, 1, 0}, intensity = 5, falloff = 'inverse_squared' }"), vec![]),
        ("flat scale", object("tessera.scale(1, 0, 1)"), vec![]),
        ("singular matrix", object("tessera.matrix { {1, 0, 0, 0}, {0, 1, 0, 0}, {0, 1, 0, 0} }"), vec![]),
        ("composed with a number", object("tessera.translate(1, 2, 3) * 2"), vec![]),
        ("too many arguments", object("tessera.translate(1, 2, 3, 4)"), vec![]),
        ("missing argument", object("tessera.rotate({0, 1, 0})"), vec![]),
        ("keys of a handle", object("grey.reflectance"), vec![]),
        ("mesh index", object("tessera.mesh { positions = {{0,0,0},{1,0,0},{0,1,0}}, triangles = {{0, 1, 2}}, material = grey }"), vec![]),
        (
            "mesh index too high",
            object("tessera.mesh { positions = {{0,0,0},{1,0,0},{0,1,0}}, triangles = {{1, 2, 4}}, material = grey }"),
            vec![],
        ),
        (
            "mesh buffer length",
            object("tessera.mesh { positions = buffer.create(13), triangles = buffer.create(12), material = grey }"),
            vec![],
        ),
        (
            "mesh normals",
            object("tessera.mesh { positions = {{0,0,0},{1,0,0},{0,1,0}}, triangles = {{1,2,3}}, normals = {{0,0,1}}, material = grey }"),
            vec![],
        ),
        ("object under a name", object("tessera.scene { objects = { ball = tessera.sphere { material = grey } } }"), vec![]),
        (
            "object at 0",
            object("tessera.scene { objects = { [0] = tessera.sphere { material = grey }, tessera.sphere { material = grey } } }"),
            vec![],
        ),
        ("objects with a gap", object("tessera.group { name = 'row', [5] = tessera.sphere { material = grey } }"), vec![]),
        ("list in a list", object("tessera.group { { tessera.sphere { material = grey }, left = 5 } }"), vec![]),
        ("shape among lights", object("tessera.scene { objects = {}, lights = { tessera.sphere { material = grey } } }"), vec![]),
        ("samples of a job", small_job("samples = 16"), vec![]),
        ("colour of a material", object("tessera.diffuse { color = {1, 1, 1} }"), vec![]),
        ("residual of halves", small_job("output = { pixel_type = 'half', aovs = { 'residual' } }"), vec![]),
        ("missing file", object("tessera.model { file = 'duck.glb' }"), vec![]),
        ("unknown format", object("tessera.model { file = 'duck.blend' }"), vec![]),
        ("texture missing", object("tessera.image { file = 'wood.png' }"), vec![]),
        ("missing module", "require('scenes.nothing')".to_owned(), vec![]),
        ("module without value", "require('scenes.empty')".to_owned(), vec![]),
        ("broken module", "require('scenes.broken')".to_owned(), vec![]),
        ("module in a circle", "require('scenes.circle')".to_owned(), vec![]),
        ("error in a module", "require('scenes.raises')".to_owned(), vec![]),
        ("require without a name", "require(5)".to_owned(), vec![]),
        ("camera at its target", object("tessera.perspective { eye = {0, 0, 0}, look_at = {0, 0, 0} }"), vec![]),
        ("camera straight down", object("tessera.perspective { eye = {0, 5, 0}, look_at = {0, 0, 0} }"), vec![]),
        ("field of view", object("tessera.perspective { eye = {0, 5, 1}, fov = 180 }"), vec![]),
        ("zero film", film("{ width = 0, height = 12 }"), vec![]),
        ("half a pixel", film("{ width = 16.5, height = 12 }"), vec![]),
        ("film without height", film("{ width = 16 }"), vec![]),
        ("unknown film key", film("{ width = 16, heigth = 12 }"), vec![]),
        ("film as numbers", film("16"), vec![]),
        ("zero samples", small_job("quality = { samples = 0 }"), vec![]),
        ("quality key", small_job("quality = { sample = 4 }"), vec![]),
        ("unknown job key", small_job("cammera = 5"), vec![]),
        ("depth 0", small_job("render = tessera.whitted { max_depth = 0 }"), vec![]),
        ("split kind", small_job("split = tessera.assign.naive"), vec![]),
        ("too many parts", small_job("film = { width = 4096, height = 4096 }, split = tessera.split.grid { size = 1 }"), vec![]),
        ("too many strips", small_job("split = tessera.split.strips { count = 13 }"), vec![]),
        ("probe scale", small_job("probe = tessera.probe.shared { scale = 2 }"), vec![]),
        ("no manifest", small_job("probe = tessera.probe.from('last.manifest.json')"), vec![]),
        ("not a manifest", small_job("probe = tessera.probe.from('odd.manifest.json')"), vec![]),
        ("output elsewhere", small_job("output = { exr = '/tmp/picture.exr' }"), vec![]),
        ("output ending", small_job("output = { png = 'picture.jpg' }"), vec![]),
        ("unknown AOV", small_job("output = { aovs = { 'depth', 'normals' } }"), vec![]),
        ("AOVs as a word", small_job("output = { aovs = 'depth' }"), vec![]),
        ("AOVs as keys", small_job("output = { aovs = { depth = true } }"), vec![]),
        ("negative seed", small_job("seed = -1"), vec![]),
        ("unknown --set", job_with(&format!("tessera.param('spheres', 30)\n{}", small_job(""))), vec![("sheres", "3")]),
        ("--set without param", small_job(""), vec![("spheres", "3")]),
        ("--set of another type", job_with("tessera.param('spheres', 30)"), vec![("spheres", "many")]),
        ("parameter missing", job_with("tessera.param('model')"), vec![]),
        ("random bounds", object("tessera.random(1):integer(5, 1)"), vec![]),
        ("random seed", object("tessera.random('seed')"), vec![]),
        (
            "nothing to frame",
            job_with("return tessera.job { scene = tessera.scene { objects = {} }, film = { width = 8, height = 8 } }"),
            vec![],
        ),
    ]
}

#[test]
fn every_mistake_is_named_with_its_place_and_a_way_out() {
    let mut page = String::new();
    for (what, script, parameters) in mistakes() {
        let message = match run(&script, FILES, &parameters, BUDGET) {
            Ok(_) => "NO ERROR".to_owned(),
            Err(fault) => fault.to_string(),
        };
        for internal in ["NO ERROR", "stack traceback", "mlua", "callback", "runtime error", "userdata"] {
            assert!(!message.contains(internal), "{what}: {message}");
        }
        page.push_str(&format!("{what}\n  {message}\n"));
    }
    insta::assert_snapshot!(page);
}

/// Files with wrong bytes are wrong at the line that names them.
#[test]
fn broken_files_are_named_at_their_line() {
    for object in [
        "tessera.model { file = 'broken.glb' }",
        "tessera.sphere { material = tessera.diffuse { reflectance = tessera.image { file = 'broken.png' } } }",
    ] {
        let script = job_with(&format!(
            "return tessera.job {{ scene = tessera.scene {{ objects = {{ {object} }} }}, film = {{ width = 8, height = 8 }} }}"
        ));
        let fault = run(&script, FILES, &[], BUDGET).err().unwrap_or_else(|| panic!("{object}"));
        assert!(fault.message.starts_with("jobs/job.lua:3: ") && fault.message.contains("\"broken."), "{fault}");
    }
}

#[test]
fn a_missing_script_is_named() {
    let fault = super::load_file(std::path::Path::new("no/such/job.lua"), &[], BUDGET).err().unwrap();
    assert_eq!(fault.message, "cannot read no/such/job.lua: there is no such file");
    let error = crate::job::load(std::path::Path::new("no/such/job.lua"), &Default::default()).err().unwrap();
    assert_eq!(error.code, crate::error::ExitCode::Script);
}
