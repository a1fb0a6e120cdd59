//! The published schema of manifests: it takes what the program writes, and nothing else.

use std::fs;

use serde_json::{Value, json};
use tessera_tests::farm::Program;

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

const JOB: &str = r#"local tessera = require("tessera")
return tessera.job {
  scene = tessera.scene { objects = { tessera.plane { material = tessera.diffuse { reflectance = 0.5 } } }, background = {1, 1, 1} },
  camera = tessera.perspective { eye = {0, 1, 5}, look_at = {0, 0, 0}, fov = 40 },
  film = { width = 32, height = 24 },
  render = tessera.raycast {},
  split = tessera.split.grid { size = 8 },
}"#;

fn parsed(path: impl AsRef<std::path::Path>) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn the_schema_takes_what_is_written_and_refuses_what_is_not_a_manifest() {
    let program = Program::new(BINARY);
    fs::write(program.path("job.lua"), JOB).unwrap();
    let finished = program.run(&["render", "job.lua", "--nodes", "2", "--lanes", "1", "-o", "out"]);
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
    let good = parsed(program.path("out/job.manifest.json"));
    let schema = parsed(concat!(env!("CARGO_MANIFEST_DIR"), "/../node/src/manifest/schema.json"));
    let validator = jsonschema::validator_for(&schema).unwrap();
    assert!(validator.validate(&good).is_ok(), "{:?}", validator.iter_errors(&good).map(|e| e.to_string()).collect::<Vec<_>>());
    let broken: [(&str, Value); 7] = [
        ("/version", "one".into()),
        ("/nodes/0/lanes", (-1).into()),
        ("/parts/0/rect", json!([0, 0, 32])),
        ("/parts/0/attempts/0/outcome", "vanished".into()),
        ("/events", Value::Null),
        ("/report/efficiency", "high".into()),
        ("/image", json!({ "exr": "a.exr" })),
    ];
    for (pointer, value) in broken {
        let mut bad = good.clone();
        *bad.pointer_mut(pointer).unwrap() = value;
        assert!(!validator.is_valid(&bad), "{pointer} was taken");
    }
    let mut unknown = good;
    unknown["report"]["speed"] = 1.into();
    assert!(!validator.is_valid(&unknown), "an unknown key was taken");
}
