//! Farms of real processes: starting them, watching what they say, and hurting them.
use std::{
    fs,
    io::{BufRead, BufReader, Read},
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::{
        Arc, Mutex,
        mpsc::{self, Receiver, RecvTimeoutError},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use rustix::process::{Pid, Signal, kill_process, test_kill_process};
use serde_json::Value;

/// How long a test waits for something that has to come: long enough for a machine with other things to do.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A job whose parts take long enough to be interrupted: mirrors and glass, 48 parts.
pub const JOB: &str = r#"
local tessera = require("tessera")
local objects = { tessera.plane { material = tessera.diffuse { reflectance = tessera.checker { even = 0.8, odd = 0.2, size = 0.5 } } } }
for i = 0, 24 do
  local material = i % 2 == 0 and tessera.mirror { reflectance = 0.9 } or tessera.glass { ior = 1.5 }
  table.insert(objects, tessera.sphere { center = { i % 5 - 2, 0.4, i // 5 - 1 }, radius = 0.4, material = material })
end
return tessera.job {
  scene   = tessera.scene {
    objects = objects,
    lights = { tessera.point { position = {-4, 6, -4}, intensity = {120, 115, 105} } },
    background = {0.25, 0.40, 0.70},
  },
  camera  = tessera.perspective { eye = {0, 1.6, -5}, look_at = {0, 0.4, 0}, fov = 50 },
  film    = { width = 256, height = 192 },
  render  = tessera.whitted { max_depth = 8 },
  quality = { samples = tessera.param("samples", 64) },
  probe   = tessera.probe.shared { scale = 1 / 16 },
  split   = tessera.split.grid { size = 32 },
  audit   = tessera.param("audit", 0),
  assign  = tessera.assign.paper,
  output  = { exr = "job.exr", png = "job.png" },
}
"#;

/// A pixel in the middle of [`JOB`]: `tessera-saboteur crashes` dies of the parts that it is in.
pub const POISON: [u32; 2] = [131, 99];

/// The program, and a folder to work in.
pub struct Program {
    binary: &'static str,
    /// The folder; it goes with the test.
    pub folder: tempfile::TempDir,
}

impl Program {
    /// The program at `binary`, with [`JOB`] as `job.lua` in a new folder.
    pub fn new(binary: &'static str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("job.lua"), JOB).expect("the job is written");
        Self { binary, folder }
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, binary: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(binary);
        command.current_dir(self.folder.path()).args(arguments).stdin(Stdio::null());
        for name in ["KEYS", "COORDINATOR", "CONFIG", "CACHE", "DATA", "LISTEN", "LANES", "LOG"] {
            command.env_remove(format!("TESSERA_{name}"));
        }
        command
    }

    /// Runs a subcommand to its end.
    pub fn run(&self, arguments: &[&str]) -> Finished {
        self.start(arguments).finish()
    }

    /// Starts a subcommand.
    pub fn start(&self, arguments: &[&str]) -> Running {
        self.start_other(self.binary, arguments)
    }

    /// Starts another program in the folder.
    pub fn start_other(&self, binary: &str, arguments: &[&str]) -> Running {
        let mut child = self.command(binary, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
        let (sender, lines) = mpsc::channel();
        let stdout = child.stdout.take().expect("a pipe");
        thread::spawn(move || BufReader::new(stdout).lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
        let mut stderr = child.stderr.take().expect("a pipe");
        let complaints = Arc::new(Mutex::new(Vec::new()));
        let heard = complaints.clone();
        let listener = thread::spawn(move || {
            let mut some = [0; 4096];
            while let Ok(length @ 1..) = stderr.read(&mut some) {
                heard.lock().expect("no panic").extend_from_slice(&some[..length]);
            }
        });
        Running { child, lines, complaints, listener: Some(listener), nodes: Vec::new(), said: Vec::new() }
    }

    /// A farm's keys in the folder `keys`, with an identity for each of these nodes.
    pub fn make_keys(&self, folder: &str, nodes: &[&str]) {
        assert_eq!(self.run(&["keys", "init", folder]).code, Some(0));
        for name in nodes {
            assert_eq!(self.run(&["keys", "issue", "--keys", folder, "--role", "node", "--name", name]).code, Some(0));
        }
    }

    /// Starts a coordinator with the keys in `keys`; returns it and its address.
    pub fn coordinator(&self, keys: &str, more: &[&str]) -> (Running, String) {
        self.coordinator_at("127.0.0.1:0", keys, more)
    }

    /// The same at a given address.
    pub fn coordinator_at(&self, listen: &str, keys: &str, more: &[&str]) -> (Running, String) {
        let arguments = ["coordinator", "--listen", listen, "--data", "data", "--keys", keys];
        let mut running = self.start(&[&arguments, more].concat());
        let line = running.line(|line| line.starts_with("listening on "));
        let address = line.trim_start_matches("listening on ").to_owned();
        (running, address)
    }

    /// Starts a node of one lane.
    pub fn node(&self, address: &str, keys: &str) -> Running {
        self.start(&["node", "--coordinator", address, "--lanes", "1", "--keys", keys])
    }

    /// Waits until the farm's status is as wanted.
    pub fn wait_for_status(&self, address: &str, keys: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let begin = Instant::now();
        loop {
            let finished = self.run(&["status", "--json", "--coordinator", address, "--keys", keys]);
            assert_eq!(finished.code, Some(0), "{}", finished.errors);
            let status: Value = serde_json::from_str(&finished.lines.concat()).expect("JSON");
            if wanted(&status) {
                return status;
            }
            assert!(begin.elapsed() < PATIENCE, "the farm never came to the wanted state: {status:#}");
            thread::sleep(Duration::from_millis(50));
        }
    }
}

/// A process that runs. It is killed with the test.
pub struct Running {
    child: Child,
    lines: Receiver<String>,
    complaints: Arc<Mutex<Vec<u8>>>,
    listener: Option<JoinHandle<()>>,
    nodes: Vec<(String, i32)>,
    said: Vec<String>,
}

/// A process that ended.
#[derive(Debug)]
pub struct Finished {
    /// Its exit code; none if a signal ended it.
    pub code: Option<i32>,
    /// What it printed on stdout.
    pub lines: Vec<String>,
    /// What it printed on stderr.
    pub errors: String,
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Running {
    /// The process.
    pub fn pid(&self) -> i32 {
        i32::try_from(self.child.id()).expect("a process id")
    }

    /// The process of a node that `render --json` started.
    pub fn node(&self, name: &str) -> i32 {
        self.nodes.iter().find(|(known, _)| known == name).map(|(_, pid)| *pid).expect("a node that was started")
    }

    /// All nodes that `render --json` started.
    pub fn nodes(&self) -> Vec<i32> {
        self.nodes.iter().map(|(_, pid)| *pid).collect()
    }

    /// Waits for a line on stdout.
    pub fn line(&mut self, wanted: impl Fn(&str) -> bool) -> String {
        let begin = Instant::now();
        loop {
            match self.lines.recv_timeout(PATIENCE.saturating_sub(begin.elapsed())) {
                Ok(line) => {
                    self.said.push(line.clone());
                    if wanted(&line) {
                        return line;
                    }
                }
                Err(RecvTimeoutError::Timeout) => panic!("the wanted line never came; these did: {:#?}", self.said),
                Err(RecvTimeoutError::Disconnected) => {
                    panic!("the process ended without the wanted line; stderr: {}", self.errors())
                }
            }
        }
    }

    /// Waits for an event of `--json`.
    pub fn event(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        loop {
            let line = self.line(|_| true);
            let event: Value = serde_json::from_str(&line).expect("JSON");
            if event["event"] == "started" {
                let pid = event["pid"].as_i64().and_then(|pid| i32::try_from(pid).ok()).expect("a process id");
                self.nodes.push((event["node"].as_str().expect("a name").to_owned(), pid));
            }
            if wanted(&event) {
                return event;
            }
        }
    }

    /// Waits until a share of the parts is committed.
    pub fn progress(&mut self, share: f64) -> Value {
        self.event(|event| {
            let (parts, committed) = (event["job"]["parts"].as_f64().unwrap_or(0.0), event["job"]["committed"].as_f64().unwrap_or(0.0));
            parts > 0.0 && committed >= share * parts
        })
    }

    /// Waits until a node is in this state.
    pub fn node_state(&mut self, name: &str, state: &str) -> Value {
        self.event(|event| {
            event["nodes"].as_array().is_some_and(|nodes| nodes.iter().any(|node| node["name"] == name && node["state"] == state))
        })
    }

    /// All that it said on stderr; it has ended.
    fn errors(&mut self) -> String {
        self.listener.take().into_iter().for_each(|listener| listener.join().unwrap_or_default());
        String::from_utf8_lossy(&self.complaints.lock().expect("no panic")).into_owned()
    }

    /// Whether it has ended.
    pub fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_some()
    }

    /// What it has said on stderr so far.
    pub fn complaints(&self) -> String {
        String::from_utf8_lossy(&self.complaints.lock().expect("no panic")).into_owned()
    }

    /// Waits until it has said this on stderr.
    pub fn wait_for_complaint(&self, said: &str) {
        let begin = Instant::now();
        loop {
            let text = self.complaints();
            if text.contains(said) {
                return;
            }
            assert!(begin.elapsed() < PATIENCE, "it never said {said:?}: {text}");
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits for the end.
    pub fn finish(mut self) -> Finished {
        let begin = Instant::now();
        let status: ExitStatus = loop {
            match self.child.try_wait().expect("a child") {
                Some(status) => break status,
                None if begin.elapsed() < PATIENCE => thread::sleep(Duration::from_millis(10)),
                None => panic!("the process does not end"),
            }
        };
        let errors = self.errors();
        let mut lines = std::mem::take(&mut self.said);
        lines.extend(self.lines.iter());
        Finished { code: status.code(), lines, errors }
    }

    /// Kills it (SIGKILL), and returns what it had printed.
    pub fn kill(mut self) -> Finished {
        let _ = self.child.kill();
        self.finish()
    }
}

/// Sends a signal to a process.
pub fn signal(pid: i32, signal: Signal) {
    kill_process(Pid::from_raw(pid).expect("a process id"), signal).expect("the process lives");
}

/// Whether a process lives.
pub fn lives(pid: i32) -> bool {
    test_kill_process(Pid::from_raw(pid).expect("a process id")).is_ok()
}

/// Reads a manifest as JSON.
pub fn manifest(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("a manifest")).expect("JSON")
}

/// Asserts that every part of [`JOB`] was committed exactly once, or was cut up: then its pieces were, and together they are the frame.
pub fn assert_each_part_committed_once(manifest: &Value) {
    let parts = manifest["parts"].as_array().expect("parts");
    assert!(parts.len() >= 48, "{} parts", parts.len());
    let mut pixels = 0;
    for part in parts {
        let whole = part["replaced_by"].as_array().is_none_or(Vec::is_empty);
        let committed = part["attempts"].as_array().expect("attempts").iter().filter(|attempt| attempt["outcome"] == "committed").count();
        assert_eq!(committed, usize::from(whole), "{part:#}");
        let edge = |index: usize| part["rect"][index].as_u64().expect("a rectangle");
        pixels += if whole { edge(2) * edge(3) } else { 0 };
    }
    assert_eq!(pixels, 256 * 192);
}
