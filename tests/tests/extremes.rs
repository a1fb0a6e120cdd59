//! Pictures at the ends of what numbers can tell, from the program: nothing is lost, all that was changed is counted, and what is not to be trusted says so.

use std::fs;

use tessera_engine::output::exr;
use tessera_tests::farm::{Finished, Program, manifest};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

/// A lamp beyond half floats, in one channel by far, before a lit floor.
fn bright(pixel_type: &str) -> String {
    format!(
        r#"local tessera = require("tessera")
return tessera.job {{
  scene = tessera.scene {{
    objects = {{
      tessera.plane {{ material = tessera.diffuse {{ reflectance = 0.5 }} }},
      tessera.sphere {{ center = {{0, 1, 0}}, radius = 0.5, material = tessera.emitter {{ radiance = {{1e30, 70000, 65000}} }} }},
    }},
  }},
  camera = tessera.perspective {{ eye = {{0, 2, -6}}, look_at = {{0, 1, 0}}, fov = 40 }},
  film = {{ width = 40, height = 30 }},
  render = tessera.path {{ max_depth = 3 }},
  quality = {{ samples = 4 }},
  split = tessera.split.grid {{ size = 16 }},
  output = {{ pixel_type = "{pixel_type}" }},
}}"#
    )
}

#[test]
fn what_half_floats_cannot_hold_is_clamped_and_counted() {
    let program = Program::new(BINARY);
    for pixel_type in ["float", "half"] {
        let script = format!("{pixel_type}.lua");
        fs::write(program.path(&script), bright(pixel_type)).unwrap();
        let finished = program.run(&["render", &script, "--nodes", "1", "--lanes", "2"]);
        assert_eq!(finished.code, Some(0), "{}", finished.errors);
    }
    let read = |name: &str| exr::read(&program.path(name)).unwrap().film;
    let clamped = |name: &str| manifest(&program.path(name))["image"]["clamped"].as_u64().unwrap();
    let (full, half) = (read("float.exr"), read("half.exr"));
    let beyond = |channel: usize| full.pixels().iter().filter(|pixel| pixel[channel] > 65_504.0).count();
    // Red is beyond almost everywhere, blue where the lamp lights the floor beside itself at the most.
    assert!(beyond(0) > beyond(1) && beyond(1) > beyond(2) && beyond(1) > 0, "{:?}", [0, 1, 2].map(beyond));
    assert_eq!(clamped("half.manifest.json"), [0, 1, 2].map(beyond).iter().sum::<usize>() as u64);
    assert_eq!(clamped("float.manifest.json"), 0);
    for (half, full) in half.pixels().iter().flatten().zip(full.pixels().iter().flatten()) {
        let held = full.min(65_504.0);
        assert!((half - held).abs() <= held * 2.0_f32.powi(-11) + 1e-7, "{half} is not {full}");
    }
}

/// A light so near to what the middle of the frame sees that what arrives there is infinite: one pixel of `size * size`, and no other.
fn infinite(size: u32, integrator: &str) -> String {
    format!(
        r#"local tessera = require("tessera")
return tessera.job {{
  scene = tessera.scene {{
    objects = {{ tessera.plane {{ material = tessera.diffuse {{ reflectance = 0.5 }} }} }},
    lights = {{
      tessera.point {{ position = {{0, 1e-140, 0}}, intensity = 1e30 }},
      tessera.directional {{ direction = {{0.1, -1, 0}}, irradiance = 1 }},
    }},
  }},
  camera = tessera.orthographic {{ eye = {{0, 3e-140, 0}}, look_at = {{0, 0, 0}}, up = {{0, 0, 1}}, width = 2 }},
  film = {{ width = {size}, height = {size}, filter = "point" }},
  render = tessera.{integrator} {{}},
  quality = {{ samples = 2 }},
  split = tessera.split.grid {{ size = 64 }},
}}"#
    )
}

fn says_invalid(finished: &Finished, size: u32) {
    assert_eq!(finished.code, Some(10), "{}", finished.errors);
    let all = 2 * size * size;
    assert!(finished.errors.contains(&format!("2 of the picture's {all} samples are invalid")), "{}", finished.errors);
}

/// One pixel of 101 x 101 is less than a ten-thousandth, of 99 x 99 it is more. In both cases all files are there.
#[test]
fn invalid_samples_are_counted_and_too_many_are_an_error() {
    let program = Program::new(BINARY);
    for integrator in ["path", "whitted"] {
        for (size, code) in [(99, 10), (101, 0)] {
            let script = format!("{integrator}{size}.lua");
            fs::write(program.path(&script), infinite(size, integrator)).unwrap();
            let finished = program.run(&["render", &script, "--nodes", "1", "--lanes", "2"]);
            assert_eq!(finished.code, Some(code), "{}", finished.errors);
            if code == 10 {
                says_invalid(&finished, size);
                says_invalid(&program.run(&["render", &script, "--threads", "2", "-o", "alone"]), size);
                let alone = program.path(&format!("alone/{integrator}{size}.exr"));
                assert!(fs::read(alone).unwrap() == fs::read(program.path(&format!("{integrator}{size}.exr"))).unwrap());
            }
            let picture = exr::read(&program.path(&format!("{integrator}{size}.exr"))).unwrap().film;
            let black = picture.pixels().iter().filter(|pixel| **pixel == [0.0; 3]).count();
            assert_eq!((black, picture.pixels()[(size * size / 2) as usize]), (1, [0.0; 3]), "one sample spoils others, or none");
            let told = manifest(&program.path(&format!("{integrator}{size}.manifest.json")));
            assert_eq!(told["image"]["invalid_samples"].as_u64(), Some(2));
            let of_parts: Vec<u64> =
                told["parts"].as_array().unwrap().iter().map(|part| part["invalid_samples"].as_u64().unwrap()).collect();
            assert_eq!(of_parts, [2, 0, 0, 0], "the middle lies in the first part of 64 x 64");
            assert!(told["warnings"].to_string().contains("samples are invalid"), "{}", told["warnings"]);
        }
    }
}

/// Who fetches a picture from a farm hears of it too.
#[test]
fn who_fetches_a_picture_hears_that_it_is_not_to_be_trusted() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic"]);
    fs::write(program.path("bad.lua"), infinite(99, "path")).unwrap();
    let (_coordinator, address) = program.coordinator("keys/coordinator-coordinator.pem", &[]);
    let _node = program.node(&address, "keys/node-attic.pem");
    let farm = ["--coordinator", &address, "--keys", "keys/operator-operator.pem"];
    says_invalid(&program.run(&[&["render", "bad.lua", "-o", "rendered"][..], &farm].concat()), 99);
    says_invalid(&program.run(&[&["fetch", "1", "-o", "fetched"][..], &farm].concat()), 99);
    for name in ["bad.exr", "bad.manifest.json"] {
        let read = |folder: &str| fs::read(program.path(folder).join(name)).unwrap();
        assert!(read("rendered") == read("fetched"), "{name}");
    }
}
