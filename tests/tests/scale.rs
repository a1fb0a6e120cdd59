//! Many nodes at once, with the load that the benchmark `scale` uses: every part once, and the picture as it has to be.

use std::{fs, net::SocketAddr};

use tessera_engine::{film::Film, output::exr};
use tessera_tests::{
    farm::{Program, manifest},
    load::{Fleet, noise},
};

const NODES: usize = 50;
const EDGE: u32 = 1440;
/// A grid of 32 x 32 pixels.
const PARTS: usize = 45 * 45;

const JOB: &str = r#"
local tessera = require("tessera")
return tessera.job {
  scene = tessera.scene {
    objects = { tessera.sphere { center = {0, 0, 0}, radius = 1, material = tessera.diffuse { reflectance = 0.5 } } },
    background = {0.5, 0.5, 0.5},
  },
  camera = tessera.perspective { eye = {0, 0, -5}, look_at = {0, 0, 0}, fov = 40 },
  film = { width = 1440, height = 1440 },
  quality = { samples = 1 },
  split = tessera.split.grid { size = 32 },
  output = { exr = "noise.exr", png = "noise.png" },
}
"#;

fn expected() -> Film {
    let pixels = (0..EDGE).flat_map(|y| (0..EDGE).map(move |x| noise(x, y))).collect();
    Film::from_pixels(EDGE, EDGE, pixels).unwrap()
}

#[test]
fn fifty_nodes_commit_each_part_once_and_the_file_is_as_expected() {
    let program = Program::new(env!("CARGO_BIN_EXE_tessera-under-test"));
    fs::write(program.path("noise.lua"), JOB).unwrap();
    program.make_keys("keys", &[]);
    let (_coordinator, address) = program.coordinator("keys", &[]);
    let to: SocketAddr = address.parse().unwrap();
    let fleet = Fleet::start(NODES, &program.path("keys"), to, 0.05);
    let nodes = NODES.to_string();
    let arguments = ["submit", "noise.lua", "--wait", "-o", "out", "--min-nodes", &nodes, "--coordinator", &address, "--keys", "keys"];
    let finished = program.run(&arguments);
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
    assert!(fleet.tally.settled() > 0);

    let manifest = manifest(&program.path("out/noise.manifest.json"));
    let parts: Vec<_> =
        manifest["parts"].as_array().unwrap().iter().filter(|part| part["replaced_by"].as_array().unwrap().is_empty()).collect();
    assert!(parts.len() >= PARTS, "{} parts", parts.len());
    for part in parts {
        let committed = part["attempts"].as_array().unwrap().iter().filter(|attempt| attempt["outcome"] == "committed").count();
        assert_eq!(committed, 1, "{part:#}");
    }
    let identity = exr::read(&program.path("out/noise.exr")).unwrap().identity.unwrap();
    let written = exr::write(&program.path("expected.exr"), &expected(), exr::PixelType::Float, &identity).unwrap();
    assert!(fs::read(program.path("out/noise.exr")).unwrap() == fs::read(program.path("expected.exr")).unwrap(), "other bytes");
    let hash: String = written.hash.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(manifest["image"]["pixels_hash"], hash);
}
