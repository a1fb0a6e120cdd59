//! Many jobs, sequences, and nodes that are told to go, with real processes.

use std::fs;

use rustix::process::Signal;
use tessera_tests::farm::{Finished, Program, Running, manifest, signal};

fn program() -> Program {
    Program::new(env!("CARGO_BIN_EXE_tessera-under-test"))
}

const SEQUENCE: &str = r#"
local tessera = require("tessera")
return tessera.job {
  frames = { first = 2, last = 6, step = 2, in_order = true },
  scene = function(frame)
    local ball = tessera.sphere { center = { frame / 4, 0, 0 }, radius = 1, material = tessera.diffuse { reflectance = 0.7 } }
    return tessera.scene { objects = { ball }, lights = { tessera.point { position = { -4, 6, -4 }, intensity = 120 } } }
  end,
  camera = tessera.perspective { eye = { 0, 1, -5 }, look_at = { 0, 0, 0 }, fov = 50 },
  film = { width = 64, height = 48 },
}
"#;

#[test]
fn every_frame_of_a_sequence_is_that_of_a_job_of_its_own() {
    let program = program();
    fs::write(program.path("walk.lua"), SEQUENCE).unwrap();
    let finished = program.run(&["render", "walk.lua", "--nodes", "2", "-o", "farm"]);
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
    let mut pictures = Vec::new();
    for frame in [2, 4, 6] {
        let alone = program.run(&["render", "walk.lua", "--threads", "1", "--set", &format!("frame={frame}"), "-o", "alone"]);
        assert_eq!(alone.code, Some(0), "{}", alone.errors);
        let name = format!("walk.{frame:04}.exr");
        let picture = fs::read(program.path("farm").join(&name)).unwrap();
        assert!(picture == fs::read(program.path("alone").join(&name)).unwrap(), "frame {frame} differs");
        pictures.push(picture);
        assert_eq!(
            manifest(&program.path("farm").join(format!("walk.{frame:04}.manifest.json")))["job"]["name"],
            format!("walk.{frame:04}")
        );
    }
    assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2], "the frames are alike");
    assert!(!program.path("farm/walk.0003.exr").exists());
}

/// The script fails for the last frame: those before it are pictures all the same, with a farm and without one.
#[test]
fn a_frame_that_fails_takes_none_before_it_along() {
    let program = program();
    fs::write(program.path("walk.lua"), SEQUENCE.replace("radius = 1", "radius = 5 - frame")).unwrap();
    for (folder, how) in [("farm", ["--nodes", "1"]), ("process", ["--threads", "1"])] {
        let finished = program.run(&["render", "walk.lua", how[0], how[1], "-o", folder]);
        assert_eq!(finished.code, Some(3), "{}", finished.errors);
        assert!(finished.errors.contains("frame 6: walk.lua:6: sphere: `radius`"), "{}", finished.errors);
        let pictures = [2, 4, 6].map(|frame| program.path(folder).join(format!("walk.{frame:04}.exr")).exists());
        assert_eq!(pictures, [true, true, false], "{folder}");
    }
}

/// A farm with one node, and clients of two roles.
struct Farm {
    program: Program,
    coordinator: Running,
    address: String,
}

impl Farm {
    fn new() -> Self {
        let program = program();
        program.make_keys("keys", &["one", "two"]);
        let issued = program.run(&["keys", "issue", "--keys", "keys", "--role", "submitter", "--name", "ann"]);
        assert_eq!(issued.code, Some(0), "{}", issued.errors);
        let (coordinator, address) = program.coordinator("keys/coordinator-coordinator.pem", &[]);
        Self { program, coordinator, address }
    }

    fn client(&self, key: &str, arguments: &[&str]) -> Finished {
        self.program.run(&[arguments, &["--coordinator", &self.address, "--keys", key]].concat())
    }

    fn operator(&self, arguments: &[&str]) -> Finished {
        let finished = self.client("keys/operator-operator.pem", arguments);
        assert_eq!(finished.code, Some(0), "{arguments:?}: {}", finished.errors);
        finished
    }

    fn submit(&self, arguments: &[&str]) -> String {
        self.operator(&[&["submit", "job.lua"], arguments].concat()).lines[0].clone()
    }

    /// Waits until a job is as wanted.
    fn wait_for_job(&self, job: &str, wanted: impl Fn(&serde_json::Value) -> bool) {
        self.program.wait_for_status(&self.address, "keys/operator-operator.pem", |status| {
            status["jobs"]
                .as_array()
                .is_some_and(|jobs| jobs.iter().any(|known| known["job"].as_u64() == job.parse().ok() && wanted(known)))
        });
    }
}

#[test]
fn jobs_are_ranked_paused_resumed_and_wait_for_each_other() {
    let farm = Farm::new();
    let denied = farm.client("keys/submitter-ann.pem", &["submit", "job.lua", "--priority", "5"]);
    assert!(denied.code == Some(8) && denied.errors.contains("above 0 that takes an operator's key"), "{denied:?}");
    let nothing = farm.client("keys/operator-operator.pem", &["submit", "job.lua", "--after", "77"]);
    assert!(nothing.code == Some(5) && nothing.errors.contains("job 77, and there is none"), "{nothing:?}");

    let first = farm.submit(&["--set", "samples=4"]);
    let second = farm.submit(&["--set", "samples=5"]);
    let third = farm.submit(&["--set", "samples=6", "--after", &first]);
    farm.operator(&["pause", &first]);
    let stranger = farm.client("keys/submitter-ann.pem", &["resume", &first]);
    assert!(stranger.code == Some(8) && stranger.errors.contains("of its own alone"), "{stranger:?}");
    farm.operator(&["rank", "--priority", "-3", &second]);
    farm.wait_for_job(&first, |job| job["paused"] == true);
    let _node = farm.program.node(&farm.address, "keys/node-one.pem");
    farm.wait_for_job(&second, |job| job["state"] == "finished" && job["priority"] == -3);
    farm.wait_for_job(&first, |job| job["committed"] == 0 && job["state"] != "finished");
    farm.wait_for_job(&third, |job| job["state"] == "waiting");
    farm.operator(&["resume", &format!("{first}-{first}")]);
    farm.wait_for_job(&third, |job| job["state"] == "finished");
    let late = farm.client("keys/operator-operator.pem", &["pause", &first]);
    assert!(late.code == Some(5) && late.errors.contains("that runs or waits"), "{late:?}");
    farm.coordinator.kill();
}

/// A node that is told to go in the middle of its parts hands in what its lane renders: nothing is rendered in vain, and it ends in order.
#[test]
fn a_node_that_is_told_to_end_hands_in_what_it_renders() {
    let farm = Farm::new();
    let (one, _two) = (farm.program.node(&farm.address, "keys/node-one.pem"), farm.program.node(&farm.address, "keys/node-two.pem"));
    let job = farm.submit(&["--set", "samples=256", "--min-nodes", "2"]);
    farm.program.wait_for_status(&farm.address, "keys/operator-operator.pem", |status| {
        status["nodes"].as_array().is_some_and(|nodes| nodes.iter().any(|node| node["name"] == "one" && node["holds"].as_u64() > Some(0)))
    });
    signal(one.pid(), Signal::TERM);
    let ended = one.finish();
    assert_eq!(ended.code, Some(0), "{}", ended.errors);
    farm.wait_for_job(&job, |job| job["state"] == "finished");
    farm.operator(&["fetch", &job, "-o", "out"]);
    let manifest = manifest(&farm.program.path("out/job.manifest.json"));
    let events: Vec<&str> = manifest["events"].as_array().unwrap().iter().filter_map(|event| event["kind"].as_str()).collect();
    assert!(events.contains(&"draining"), "{events:?}");
    let attempts = manifest["parts"].as_array().unwrap().iter().flat_map(|part| part["attempts"].as_array().unwrap());
    let vain: Vec<_> = attempts.filter(|attempt| attempt["outcome"] == "lost").collect();
    assert!(vain.is_empty(), "{vain:?}");
    farm.coordinator.kill();
}

/// What an operator says of a job's place in the queue, its submitter does not change; what the submitter said, it does.
#[test]
fn an_operators_word_on_a_job_stays() {
    let farm = Farm::new();
    let ann = |arguments: &[&str]| farm.client("keys/submitter-ann.pem", arguments);
    let job = ann(&["submit", "job.lua"]).lines[0].clone();
    for command in [["pause", &job], ["resume", &job]] {
        assert_eq!(ann(&command).code, Some(0), "{command:?}");
    }
    assert_eq!(ann(&["rank", "--priority", "-7", &job]).code, Some(0));
    farm.operator(&["pause", &job]);
    farm.operator(&["rank", "--priority", "-3", &job]);
    for (command, said) in [(vec!["resume", &job], "paused it"), (vec!["rank", "--priority", "-1", &job], "gave it its priority")] {
        let refused = ann(&command);
        assert!(refused.code != Some(0) && refused.errors.contains(&format!("an operator {said}")), "{refused:?}");
    }
    farm.wait_for_job(&job, |known| known["paused"] == true && known["priority"] == -3);
    farm.operator(&["resume", &job]);
    farm.wait_for_job(&job, |known| known["paused"] == false);
    for command in [["pause", &job], ["cancel", &job]] {
        assert_eq!(ann(&command).code, Some(0), "{command:?}");
    }
    farm.coordinator.kill();
}
