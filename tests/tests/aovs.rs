//! A job that asks for all that the picture can tell beside colours, on a farm of processes; and the same job without.

use std::fs;

use tessera_engine::{
    description::{Aov, Aovs},
    film::Film,
    output::exr,
};
use tessera_tests::farm::{Program, manifest};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

const WORDS: &str = r#"aovs = { "error", "albedo", "normal", "depth", "position", "object", "material", "samples", "residual" }"#;

/// A ball on a floor, seen from above with some sky; every part is rendered twice and compared.
fn job(output: &str) -> String {
    format!(
        r#"local tessera = require("tessera")
local grey = tessera.diffuse {{ reflectance = 0.5 }}
return tessera.job {{
  scene = tessera.scene {{
    objects = {{ tessera.plane {{ material = grey }}, tessera.sphere {{ center = {{100, 1, 0}}, material = tessera.mirror {{}} }} }},
    background = {{0.25, 0.5, 1}},
  }},
  camera = tessera.perspective {{ eye = {{100, 2, -6}}, look_at = {{100, 1.5, 0}}, fov = 60 }},
  film = {{ width = 48, height = 40, filter = "gaussian" }},
  render = tessera.path {{}},
  quality = {{ samples = tessera.param("samples", 5) }},
  seed = tessera.param("seed", 0),
  split = tessera.split.grid {{ size = 13 }},
  audit = 1,
  output = {{ {output} }},
}}"#
    )
}

fn render(program: &Program, script: &str, more: &[&str], folder: &str) {
    let finished = program.run(&[&["render", script, "-o", folder], more].concat());
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
}

#[test]
fn a_farm_tells_all_that_one_process_tells_and_colours_stay_what_they_are() {
    let program = Program::new(BINARY);
    fs::write(program.path("all.lua"), job(WORDS)).unwrap();
    // The residual, the last of all, belongs to floats.
    fs::write(program.path("half.lua"), job(&format!("pixel_type = 'half', {}", WORDS.replace(r#", "residual""#, "")))).unwrap();
    fs::write(program.path("plain.lua"), job("")).unwrap();
    render(&program, "all.lua", &["--nodes", "2", "--lanes", "1"], "farm");
    render(&program, "all.lua", &["--threads", "1"], "alone");
    render(&program, "half.lua", &["--threads", "1"], "alone");
    render(&program, "plain.lua", &["--nodes", "2", "--lanes", "1"], "farm");
    assert!(fs::read(program.path("farm/all.exr")).unwrap() == fs::read(program.path("alone/all.exr")).unwrap());

    let read = |name: &str| exr::read(&program.path(name)).unwrap().film;
    let (all, half, plain) = (read("farm/all.exr"), read("alone/half.exr"), read("farm/plain.exr"));
    assert_eq!((all.aovs(), plain.aovs()), (Aov::ALL.into_iter().collect(), Aovs::NONE));
    assert!(all.pixels() == plain.pixels(), "colours depend on what is told beside them");
    let told = |film: &Film| -> Vec<f32> {
        film.extra().chunks(film.aovs().numbers()).flat_map(|numbers| numbers[..half.aovs().numbers()].to_vec()).collect()
    };
    assert!(all.pixels() != half.pixels() && told(&all) == told(&half), "what is told beside colours is never rounded");
    assert!(fs::read(program.path("farm/all.png")).unwrap() == fs::read(program.path("farm/plain.png")).unwrap());

    let at = |x: usize, y: usize, name: &str| {
        let number = all.aovs().channels().position(|channel| channel == name).unwrap();
        f64::from(all.extra()[(y * 48 + x) * all.aovs().numbers() + number])
    };
    // The sky; the ball, 5 units away; the floor.
    assert_eq!(
        ["depth.Z", "object.ID", "material.ID", "samples.N", "normal.Y"].map(|name| at(24, 0, name)),
        [f64::from(Aov::FARTHEST), 0.0, 0.0, 5.0, 0.0]
    );
    assert_eq!(["object.ID", "material.ID", "albedo.R"].map(|name| at(24, 24, name)), [2.0, 2.0, at(24, 24, "albedo.G")]);
    assert!((at(24, 24, "depth.Z") - 5.1).abs() < 0.2 && (at(24, 24, "position.X") - 100.0).abs() < 0.2);
    assert_eq!(["object.ID", "material.ID", "albedo.R", "normal.Y", "position.Y"].map(|name| at(24, 39, name)), [1.0, 1.0, 0.5, 1.0, 0.0]);
    assert!((0..48 * 40).any(|i| at(i % 48, i / 48, "error.G") > 0.0));

    assert_eq!(manifest(&program.path("farm/all.manifest.json"))["image"]["aovs"].as_array().map(Vec::len), Some(9));
    assert!(manifest(&program.path("farm/plain.manifest.json"))["image"]["aovs"].is_null());
    for name in ["farm/all.exr", "farm/plain.exr"] {
        let verified = program.run(&["verify", name]);
        assert_eq!(verified.code, Some(0), "{}", verified.errors);
    }
    fs::copy(program.path("farm/plain.exr"), program.path("farm/all.exr")).unwrap();
    let verified = program.run(&["verify", "farm/all.manifest.json"]);
    assert!(verified.code != Some(0) && verified.errors.contains("should tell {albedo, normal,"), "{}", verified.errors);

    let checked = |script: &str| program.run(&["check", script]).lines.concat();
    assert!(checked("all.lua").contains("albedo, normal, depth, position, object, material, samples, error"), "{}", checked("all.lua"));
    assert!(!checked("plain.lua").contains("aovs"), "{}", checked("plain.lua"));
}

#[test]
fn a_picture_is_extended_to_the_bytes_of_all_samples_at_once() {
    let program = Program::new(BINARY);
    fs::write(program.path("job.lua"), job(r#"aovs = { "samples", "residual" }"#)).unwrap();
    fs::write(program.path("plain.lua"), job("")).unwrap();
    let farm = ["--nodes", "2", "--lanes", "1"];
    let with = |samples: &'static str| [&["--set", samples][..], &farm].concat();
    let extend = |script: &str, samples: &str, more: &[&str]| {
        program.run(&[&["render", script, "-o", "out", "--extend", "--set", samples], &farm[..], more].concat())
    };
    let missing = extend("job.lua", "samples=8", &[]);
    assert!(missing.code == Some(4) && missing.errors.contains("an earlier run left"), "{}", missing.errors);
    render(&program, "job.lua", &with("samples=2"), "out");
    let two = fs::read(program.path("out/job.exr")).unwrap();
    for (script, samples, more, code, says) in [
        ("job.lua", "samples=12", &[][..], 2, "a power of two"),
        ("plain.lua", "samples=8", &[], 2, "residual"),
        ("job.lua", "samples=8", &["--set", "seed=1"], 4, "only samples may differ"),
    ] {
        let refused = extend(script, samples, more);
        assert!(refused.code == Some(code) && refused.errors.contains(says), "{:?} {}", refused.code, refused.errors);
        assert!(fs::read(program.path("out/job.exr")).unwrap() == two, "a refusal changed the picture");
    }
    // Whoever changed the picture since, it is no longer what was rendered.
    let mut picture = exr::read(&program.path("out/job.exr")).unwrap();
    let pixels = picture.film.pixels().iter().map(|pixel| pixel.map(|component| component * 0.5)).collect();
    picture.film = Film::from_numbers(48, 40, pixels, picture.film.aovs(), picture.film.extra().to_vec()).unwrap();
    exr::write(&program.path("out/job.exr"), &picture.film, exr::PixelType::Float, &picture.identity.unwrap()).unwrap();
    let changed = extend("job.lua", "samples=8", &[]);
    assert!(changed.code == Some(7) && changed.errors.contains("not those that were rendered"), "{}", changed.errors);
    fs::write(program.path("out/job.exr"), &two).unwrap();
    render(&program, "job.lua", &with("samples=16"), "whole");
    for _ in 0..2 {
        let extended = extend("job.lua", "samples=16", &[]);
        assert_eq!(extended.code, Some(0), "{}", extended.errors);
        for name in ["job.exr", "job.png"] {
            let of = |folder: &str| fs::read(program.path(&format!("{folder}/{name}"))).unwrap();
            assert!(of("out") == of("whole"), "{name} is not that of all samples at once");
        }
    }
    // As a run leaves it that ended after the first of three files.
    fs::remove_file(program.path("out/job.png")).unwrap();
    let extended = extend("job.lua", "samples=16", &[]);
    assert!(extended.code == Some(0) && program.path("out/job.png").exists(), "{}", extended.errors);
    let told = &manifest(&program.path("out/job.manifest.json"))["image"];
    assert_eq!((told["samples"].as_u64(), told["extended_from"].as_u64()), (Some(16), Some(2)));
    assert_eq!(program.run(&["verify", "out/job.exr"]).code, Some(0));
}
