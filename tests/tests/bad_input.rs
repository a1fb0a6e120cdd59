//! Bad input through the whole program: each mistake has its message and its stable exit code, and leaves no file behind.

use std::fs;

use rustix::process::Signal;
use tessera_tests::farm::{Program, assert_each_part_committed_once, manifest, signal};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

/// A job with one sphere, with an object and further keys.
fn job(object: &str, rest: &str) -> String {
    format!(
        r#"local tessera = require("tessera")
return tessera.job {{
  scene = tessera.scene {{ objects = {{ {object} }}, lights = {{ tessera.point {{ position = {{3, 3, 3}}, intensity = 30 }} }} }},
  film = {{ width = 64, height = 48 }},
  {rest}
}}
"#
    )
}

fn sphere(material: &str) -> String {
    format!("tessera.sphere {{ material = {material} }}")
}

/// A glb whose header is right and whose contents are cut off.
fn cut_glb() -> Vec<u8> {
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend(400_u32.to_le_bytes());
    bytes
}

#[test]
fn each_mistake_has_its_message_and_its_exit_code() {
    let good = sphere("tessera.diffuse {}");
    let cases = [
        ("a script that is not there", None, 3, "cannot read bad.lua"),
        (
            "a module that is misspelt",
            Some(job(&good, "").replace(r#"require("tessera")"#, r#"require("tesera")"#)),
            3,
            r#"bad.lua:1: require: no module "tesera"; did you mean "tessera"?"#,
        ),
        ("a syntax error", Some("return tessera.job {".to_owned()), 3, "bad.lua:1: syntax error"),
        ("an unknown key", Some(job(&sphere("tessera.diffuse { reflectnce = 1 }"), "")), 3, "did you mean `reflectance`"),
        ("a film of size zero", Some(job(&good, "").replace("width = 64", "width = 0")), 3, "bad.lua:2: job: film: `width`"),
        ("a model that is not there", Some(job(r#"tessera.model { file = "gone.glb" }"#, "")), 3, "gone.glb"),
        ("a model that is cut off", Some(job(r#"tessera.model { file = "cut.glb" }"#, "")), 3, "cut.glb"),
        (
            "a texture with wrong bytes",
            Some(job(&sphere(r#"tessera.diffuse { reflectance = tessera.image { file = "wrong.png" } }"#), "")),
            3,
            "wrong.png",
        ),
        ("a policy that fails at the start", Some(job(&good, "assign = function() local x = nil; return x.y end")), 6, "bad.lua:5:"),
        (
            "a split with a gap",
            Some(job(&good, "split = function() return { { x = 0, y = 0, width = 64, height = 40 } } end")),
            6,
            "bad.lua:5:",
        ),
        ("a part without a node", Some(job(&good, "assign = function() return {} end")), 6, "bad.lua:5:"),
    ];
    for (what, script, code, message) in cases {
        let program = Program::new(BINARY);
        fs::write(program.path("cut.glb"), cut_glb()).unwrap();
        fs::write(program.path("wrong.png"), "this is no picture").unwrap();
        script.iter().for_each(|script| fs::write(program.path("bad.lua"), script).unwrap());
        let finished = program.run(&["render", "bad.lua", "--nodes", "1", "-o", "out"]);
        assert_eq!(finished.code, Some(code), "{what}: {}", finished.errors);
        assert!(finished.errors.contains(message), "{what}: {}", finished.errors);
        let left = fs::read_dir(program.path("out")).map_or(0, Iterator::count);
        assert_eq!(left, 0, "{what} left files behind");
    }
}

#[test]
fn what_is_no_file_is_not_waited_for() {
    let program = Program::new(BINARY);
    let pipe = program.path("pipe.lua");
    rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, rustix::fs::Mode::RUSR, 0).unwrap();
    for script in ["pipe.lua", "/dev/zero", "."] {
        let finished = program.run(&["check", script]);
        assert_eq!(finished.code, Some(3), "{script}: {}", finished.errors);
        assert!(finished.errors.contains("it is not a file"), "{script}: {}", finished.errors);
    }
}

/// What a model's file has and this program does not model is said once, at the beginning, and stands in the manifest.
#[test]
fn a_warning_is_said_once() {
    let program = Program::new(BINARY);
    let model = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl nowhere\nf 1 2 3\n";
    fs::write(program.path("model.obj"), model).unwrap();
    fs::write(program.path("warns.lua"), job(r#"tessera.model { file = "model.obj" }"#, "")).unwrap();
    let finished = program.run(&["render", "warns.lua", "-o", "out"]);
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
    let said = finished.lines.iter().map(String::as_str).chain(finished.errors.lines()).filter(|line| line.contains("warning:")).count();
    assert_eq!(said, 1, "{}\n{}", finished.errors, finished.lines.join("\n"));
    assert_eq!(manifest(&program.path("out/warns.manifest.json"))["warnings"].as_array().unwrap().len(), 1);
}

#[test]
fn a_black_picture_is_told() {
    let program = Program::new(BINARY);
    let lit = job(&sphere("tessera.diffuse {}"), "");
    for (name, script, is_black) in [("lit", lit.clone(), false), ("dark", lit.replace("intensity = 30", "intensity = 0"), true)] {
        fs::write(program.path("job.lua"), script).unwrap();
        for how in [["--nodes", "1"], ["--threads", "1"]] {
            let finished = program.run(&["render", "job.lua", how[0], how[1], "-o", "out"]);
            assert_eq!(finished.code, Some(0), "{name}: {}", finished.errors);
            let said = format!("{}{}", finished.lines.join("\n"), finished.errors);
            assert_eq!(said.matches("every pixel is black").count(), usize::from(is_black), "{name} {how:?}: {said}");
        }
        assert_eq!(manifest(&program.path("out/job.manifest.json"))["image"]["is_black"] == true, is_black);
    }
}

#[test]
fn a_number_that_is_none_and_a_coordinator_that_is_not_there_are_named() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &[]);
    let access = ["--coordinator", "127.0.0.1:9", "--keys", "keys"];
    let finished = program.run(&[&["watch", "abc"][..], &access].concat());
    assert_eq!(finished.code, Some(2), "{}", finished.errors);
    assert!(finished.errors.contains("a job's number is expected"), "{}", finished.errors);
    let finished = program.run(&[&["list"][..], &access].concat());
    assert_eq!(finished.code, Some(5), "{}", finished.errors);
    assert!(finished.errors.contains("connecting to 127.0.0.1:9: no answer yet\nerror: cannot reach"), "{}", finished.errors);
}

#[test]
fn a_policy_that_fails_when_parts_are_redistributed_is_replaced_and_the_manifest_says_so() {
    let program = Program::new(BINARY);
    let script = tessera_tests::farm::JOB.replace(
        "assign  = tessera.assign.paper,",
        r#"assign  = function(parts, nodes)
    if #nodes < 3 then error("three nodes or nothing") end
    local plan = {}
    for rank, part in parts do plan[part.id] = nodes[(rank - 1) % #nodes + 1].id end
    return plan
  end,"#,
    );
    fs::write(program.path("job.lua"), script).unwrap();
    // Long enough that the others are not done before the silence of the one that dies is noticed.
    let mut render = program.start(&["render", "job.lua", "--set", "samples=256", "--nodes", "3", "--lanes", "1", "-o", "out", "--json"]);
    render.progress(0.2);
    signal(render.node("node-2"), Signal::KILL);
    let finished = render.finish();
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
    let manifest = manifest(&program.path("out/job.manifest.json"));
    assert_each_part_committed_once(&manifest);
    let warnings = manifest["warnings"].to_string();
    assert!(warnings.contains("three nodes or nothing"), "{warnings} {}", manifest["events"]);
    assert!(manifest["events"].as_array().unwrap().iter().any(|event| event["kind"] == "policy_replaced"));
}

/// Neither a job that renders nor one that does not leaves anything among temporary files.
#[test]
fn no_farm_leaves_its_folder_behind() {
    let program = Program::new(BINARY);
    fs::create_dir(program.path("temporary")).unwrap();
    fs::write(program.path("broken.lua"), "error('no job')").unwrap();
    let temporary = format!("TMPDIR={}", program.path("temporary").display());
    for (script, code) in [("job.lua", 0), ("broken.lua", 3), ("job.lua", 0), ("broken.lua", 3)] {
        let run = program.start_other("env", &[&temporary, BINARY, "render", script, "--nodes", "3", "--lanes", "1", "-o", "out"]);
        let finished = run.finish();
        assert_eq!(finished.code, Some(code), "{}", finished.errors);
        let left: Vec<_> = fs::read_dir(program.path("temporary")).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert!(left.is_empty(), "{script} leaves {left:?}");
    }
}
