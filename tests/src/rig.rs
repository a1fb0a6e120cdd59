//! A standing farm that can be hurt: a coordinator, and nodes each behind a relay of its own.

use std::{
    collections::BTreeMap,
    fs,
    io::Write,
    path::PathBuf,
    sync::OnceLock,
    thread,
    time::{Duration, Instant},
};

use rustix::process::Signal;
use serde_json::Value;

use crate::{
    farm::{Finished, PATIENCE, Program, Running, manifest, signal},
    relay::Relay,
};

/// Samples of a pixel in tests with a rig: about two seconds of work for one lane.
pub const SAMPLES: &str = "samples=96";

/// The bytes of the EXR of [`crate::farm::JOB`] with [`SAMPLES`], from an undisturbed run in one thread.
pub fn undisturbed(binary: &'static str) -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| {
        let program = Program::new(binary);
        let finished = program.run(&["render", "job.lua", "--threads", "1", "--set", SAMPLES, "-o", "out"]);
        assert_eq!(finished.code, Some(0), "{}", finished.errors);
        fs::read(program.path("out/job.exr")).expect("a picture")
    })
}

/// The farm. Its processes end with it.
pub struct Rig {
    /// Its folder.
    pub program: Program,
    /// Where the coordinator listens; clients go there without a relay.
    pub address: String,
    coordinator: Option<Running>,
    /// What it is started with beyond address, folder and keys.
    pub coordinator_arguments: Vec<String>,
    nodes: BTreeMap<String, Member>,
}

struct Member {
    relay: Relay,
    process: Option<Running>,
}

/// What came of a job.
pub struct Outcome {
    /// Exit code of `tessera watch`.
    pub code: Option<i32>,
    /// What it said on stderr.
    pub errors: String,
    /// The manifest.
    pub manifest: Value,
    /// The picture.
    pub exr: PathBuf,
}

/// A test that fails leaves its folder, with what each process said in `logs`.
impl Drop for Rig {
    fn drop(&mut self) {
        if !thread::panicking() {
            return;
        }
        let running = self.nodes.iter().filter_map(|(name, member)| Some((name.as_str(), member.process.as_ref()?)));
        let running = running.chain(self.coordinator.as_ref().map(|coordinator| ("coordinator", coordinator)));
        running.for_each(|(name, process)| self.log(name, &process.complaints()));
        self.program.folder.disable_cleanup(true);
        eprintln!("the farm's folder with logs is kept: {}", self.program.folder.path().display());
    }
}

impl Rig {
    /// A coordinator, and keys and relays for these nodes, which do not run yet.
    pub fn new(binary: &'static str, nodes: &[&str], seed: u64) -> Self {
        Self::with(binary, nodes, seed, &[])
    }

    /// The same with more arguments for the coordinator.
    pub fn with(binary: &'static str, nodes: &[&str], seed: u64, more: &[&str]) -> Self {
        let program = Program::new(binary);
        program.make_keys("keys", nodes);
        let (coordinator, address) = program.coordinator("keys", more);
        let to = address.parse().expect("an address");
        let member = |number: usize| Member { relay: Relay::start(to, seed + number as u64), process: None };
        let nodes = nodes.iter().enumerate().map(|(number, name)| ((*name).to_owned(), member(number))).collect();
        let coordinator_arguments = more.iter().map(|&argument| argument.to_owned()).collect();
        Self { program, address, coordinator: Some(coordinator), coordinator_arguments, nodes }
    }

    /// The names of all nodes.
    pub fn names(&self) -> Vec<String> {
        self.nodes.keys().cloned().collect()
    }

    fn log(&self, name: &str, text: &str) {
        let folder = self.program.path("logs");
        let _ = fs::create_dir_all(&folder);
        let file = fs::OpenOptions::new().create(true).append(true).open(folder.join(format!("{name}.log")));
        let _ = file.and_then(|mut file| file.write_all(text.as_bytes()));
    }

    fn member(&mut self, name: &str) -> &mut Member {
        self.nodes.get_mut(name).expect("a node of the farm")
    }

    /// The relay of a node.
    pub fn relay(&self, name: &str) -> &Relay {
        &self.nodes.get(name).expect("a node of the farm").relay
    }

    /// The process of a node.
    pub fn node(&mut self, name: &str) -> &mut Running {
        self.member(name).process.as_mut().expect("a node that runs")
    }

    /// Starts a node of one lane.
    pub fn start(&mut self, name: &str) {
        self.start_with_lanes(name, 1);
    }

    /// Starts a node.
    pub fn start_with_lanes(&mut self, name: &str, lanes: u32) {
        let (relay, keys) = (self.member(name).relay.address.to_string(), format!("keys/node-{name}.pem"));
        let process = self.program.start(&["node", "--coordinator", &relay, "--lanes", &lanes.to_string(), "--keys", &keys]);
        self.member(name).process = Some(process);
    }

    /// Starts a node of one lane that renders badly.
    pub fn start_saboteur(&mut self, binary: &str, name: &str, fault: &str) {
        let (relay, keys) = (self.member(name).relay.address.to_string(), format!("keys/node-{name}.pem"));
        let process = self.program.start_other(binary, &[fault, &relay, &keys]);
        self.member(name).process = Some(process);
    }

    /// Whether a node's process runs.
    pub fn runs(&mut self, name: &str) -> bool {
        self.member(name).process.as_mut().is_some_and(|process| !process.has_ended())
    }

    /// Kills a node (SIGKILL).
    pub fn kill(&mut self, name: &str) {
        if let Some(process) = self.member(name).process.take() {
            self.log(name, &process.kill().errors);
        }
    }

    /// Sends a signal to a node.
    pub fn signal(&mut self, name: &str, number: Signal) {
        signal(self.node(name).pid(), number);
    }

    /// The process of the coordinator.
    pub fn coordinator(&self) -> &Running {
        self.coordinator.as_ref().expect("a coordinator that runs")
    }

    /// Kills the coordinator (SIGKILL).
    pub fn kill_coordinator(&mut self) {
        if let Some(process) = self.coordinator.take() {
            self.log("coordinator", &process.kill().errors);
        }
    }

    /// Whether the coordinator's process runs.
    pub fn is_led(&mut self) -> bool {
        self.coordinator.as_mut().is_some_and(|process| !process.has_ended())
    }

    /// Starts it again on the same folder; returns how long that took until it listens.
    pub fn restart_coordinator(&mut self) -> Duration {
        let begin = Instant::now();
        let more: Vec<&str> = self.coordinator_arguments.iter().map(String::as_str).collect();
        let (coordinator, _) = self.program.coordinator_at(&self.address, "keys", &more);
        self.coordinator = Some(coordinator);
        begin.elapsed()
    }

    /// Runs a client's subcommand.
    pub fn client(&self, arguments: &[&str]) -> Finished {
        self.program.run(&[arguments, &["--coordinator", &self.address, "--keys", "keys"]].concat())
    }

    /// Submits the job with [`SAMPLES`]; returns its number.
    pub fn submit(&self, more: &[&str]) -> String {
        let submitted = self.client(&[&["submit", "job.lua", "--set", SAMPLES][..], more].concat());
        assert_eq!(submitted.code, Some(0), "{}", submitted.errors);
        submitted.lines[0].clone()
    }

    /// Waits until the farm's status is as wanted.
    pub fn wait(&self, wanted: impl Fn(&Value) -> bool) -> Value {
        self.program.wait_for_status(&self.address, "keys", wanted)
    }

    /// Waits until so many parts of the last job are committed.
    pub fn wait_for_parts(&self, count: u64) -> Value {
        self.wait(|status| status["jobs"].as_array().is_some_and(|jobs| jobs.last().is_some_and(|job| committed(job) >= count)))
    }

    /// Waits until a node is in this state.
    pub fn wait_for_node(&self, name: &str, state: &str) {
        self.wait(|status| is_in(status, name, state));
    }

    /// Waits until these nodes are ready.
    pub fn wait_until_ready(&self, names: &[&str]) {
        self.wait(|status| names.iter().all(|name| is_in(status, name, "ready")));
    }

    /// Follows a job to its end, and fetches its files.
    pub fn outcome(&self, job: &str) -> Outcome {
        let watched = self.client(&["watch", job, "--quiet"]);
        self.fetched(job, watched)
    }

    /// The files of a job that is over.
    pub fn fetched(&self, job: &str, watched: Finished) -> Outcome {
        let folder = format!("out-{job}");
        let fetched = self.client(&["fetch", job, "-o", &folder]);
        assert_eq!(fetched.code, Some(0), "{}\n{}", watched.errors, fetched.errors);
        let folder = self.program.path(&folder);
        let mut files = fs::read_dir(&folder).expect("a folder").map(|entry| entry.expect("an entry").path());
        let path = files.find(|path| path.to_string_lossy().ends_with(".manifest.json")).expect("a manifest");
        Outcome { code: watched.code, errors: watched.errors, manifest: manifest(&path), exr: folder.join("job.exr") }
    }

    /// The same for one that has to end well: the undisturbed bytes, and each part once.
    pub fn finished(&self, job: &str, binary: &'static str) -> Value {
        let outcome = self.outcome(job);
        assert_eq!(outcome.code, Some(0), "{}", outcome.errors);
        assert!(
            fs::read(&outcome.exr).expect("a picture") == undisturbed(binary),
            "the EXR's bytes differ from those of an undisturbed run"
        );
        assert_once(&outcome.manifest);
        outcome.manifest
    }
}

/// Committed parts of a job as `tessera status` tells of it.
pub fn committed(job: &Value) -> u64 {
    job["committed"].as_u64().unwrap_or(0)
}

/// Whether a node is in this state, by `tessera status`.
pub fn is_in(status: &Value, name: &str, state: &str) -> bool {
    status["nodes"].as_array().is_some_and(|nodes| nodes.iter().any(|node| node["name"] == name && node["state"] == state))
}

/// Asserts that each part of the picture was committed exactly once, and that nobody began it again afterwards, but for comparison where the job
/// asks for that.
pub fn assert_once(manifest: &Value) {
    let compared = manifest["job"]["parameters"]["audit"].is_string();
    let holes = list(&manifest["image"]["holes"]);
    for part in list(&manifest["parts"]) {
        let attempts = list(&part["attempts"]);
        let committed: Vec<&Value> = attempts.iter().filter(|attempt| attempt["outcome"] == "committed").collect();
        let expected = usize::from(list(&part["replaced_by"]).is_empty() && !holes.contains(&part["rect"]));
        assert_eq!(committed.len(), expected, "{part:#}");
        let end = committed.first().and_then(|attempt| attempt["end"].as_f64()).unwrap_or(f64::INFINITY);
        let again = attempts.iter().any(|attempt| attempt["start"].as_f64().is_some_and(|start| start > end));
        assert!(compared || !again, "rendered again: {part:#}");
    }
}

/// A JSON list's entries.
pub fn list(value: &Value) -> Vec<Value> {
    value.as_array().cloned().unwrap_or_default()
}

/// Every attempt at any part.
pub fn attempts(manifest: &Value) -> Vec<Value> {
    list(&manifest["parts"]).iter().flat_map(|part| list(&part["attempts"])).collect()
}

/// Events of this kind.
pub fn events(manifest: &Value, kind: &str) -> Vec<Value> {
    list(&manifest["events"]).into_iter().filter(|event| event["kind"] == kind).collect()
}

/// The id of a node.
pub fn id(manifest: &Value, name: &str) -> Value {
    let nodes = list(&manifest["nodes"]);
    nodes.iter().find(|node| node["name"] == name).unwrap_or_else(|| panic!("no node {name} took part"))["id"].clone()
}

/// Waits until something holds.
pub fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !holds() {
        assert!(begin.elapsed() < PATIENCE, "never: {what}");
        thread::sleep(Duration::from_millis(20));
    }
}
