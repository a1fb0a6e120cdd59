//! What an operator sees and does: metrics, readiness, a disk that is full.

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use rustix::process::{Pid, Resource, Rlimit, Signal, getrlimit, prlimit};
use serde_json::Value;
use tessera_tests::farm::{PATIENCE, Program, Running, signal};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

/// Head and body of what the status page's server answers.
fn get(page: &str, path: &str) -> (String, String) {
    let mut stream = TcpStream::connect(page).unwrap();
    stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: {page}\r\nConnection: close\r\n\r\n").as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer.split_once("\r\n\r\n").map(|(head, body)| (head.to_owned(), body.to_owned())).unwrap()
}

fn metric(page: &str, name: &str) -> f64 {
    let (_, text) = get(page, "/metrics");
    let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    line.unwrap_or_else(|| panic!("no {name} in {text}")).parse().unwrap()
}

fn wait_for(what: &str, holds: impl Fn() -> bool) {
    let begin = Instant::now();
    while !holds() {
        assert!(begin.elapsed() < PATIENCE, "never: {what}");
        thread::sleep(Duration::from_millis(50));
    }
}

/// A coordinator with a status page: it, its address, the page's address.
fn with_page(program: &Program, more: &[&str]) -> (Running, String, String) {
    let (mut coordinator, address) = program.coordinator("keys", &[&["--web", "127.0.0.1:0"], more].concat());
    let line = coordinator.line(|line| line.starts_with("status page at "));
    let page = line.trim_start_matches("status page at http://").trim_end_matches('/').to_owned();
    (coordinator, address, page)
}

#[test]
fn metrics_tell_what_happened_to_a_job_and_its_nodes() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic", "cellar"]);
    let (_coordinator, address, page) = with_page(&program, &[]);
    assert!(get(&page, "/readyz").0.starts_with("HTTP/1.1 200"));
    let nodes = ["attic", "cellar"].map(|name| program.node(&address, &format!("keys/node-{name}.pem")));
    wait_for("two nodes are ready", || metric(&page, "tessera_nodes{state=\"ready\"}") == 2.0);
    assert_eq!(metric(&page, "tessera_lanes"), 2.0);
    let render = ["render", "job.lua", "--coordinator", &address, "--keys", "keys", "-o", "out", "-q", "--set", "samples=4"];
    let finished = program.run(&render);
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
    wait_for("the end is published", || metric(&page, "tessera_parts_left") == 0.0);
    let file = program.path("out/job.exr");
    assert!(fs::metadata(file).unwrap().len() > 0);
    for (name, value) in [
        ("tessera_parts_committed_total", 48.0),
        ("tessera_pixels_stored_bytes_total", f64::from(256 * 192 * 12)),
        ("tessera_commit_latency_seconds_count", 48.0),
        ("tessera_prediction_error_ratio_count", 48.0),
        ("tessera_jobs_ended_total{outcome=\"finished\"}", 1.0),
        ("tessera_jobs{state=\"rendering\"}", 0.0),
        ("tessera_suspicions_total", 0.0),
        ("tessera_disk_waiting", 0.0),
    ] {
        assert_eq!(metric(&page, name), value, "{name}");
    }
    let efficiency = metric(&page, "tessera_last_job_efficiency_ratio");
    assert!(efficiency > 0.0 && efficiency <= 1.0, "{efficiency}");
    assert!(metric(&page, "tessera_attempts_total") >= 48.0 && metric(&page, "tessera_events_total") > 100.0);
    assert!(metric(&page, "tessera_journal_events") > 48.0 && metric(&page, "tessera_journal_size_bytes") > 0.0);
    assert!(metric(&page, "tessera_disk_free_bytes") > 0.0);

    signal(nodes[0].pid(), Signal::KILL);
    wait_for("the dead node is suspected", || metric(&page, "tessera_suspicions_total") == 1.0);
    let silence = metric(&page, "tessera_detection_latency_seconds_sum");
    assert!((0.4..5.0).contains(&silence), "{silence}");
    let _again = program.node(&address, "keys/node-attic.pem");
    wait_for("its life is over", || metric(&page, "tessera_deaths_total") == 1.0);
}

#[test]
fn a_disk_without_room_takes_no_job_and_says_so_everywhere() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &[]);
    fs::write(program.path("farm.toml"), "[coordinator]\nfree_bytes = 9000000000000000000\n").unwrap();
    let (_coordinator, address, page) = with_page(&program, &["--config", "farm.toml"]);
    let access = ["--coordinator", &address, "--keys", "keys"];
    let submitted = program.run(&[&["submit", "job.lua"][..], &access].concat());
    assert_eq!(submitted.code, Some(5), "{}", submitted.errors);
    assert!(submitted.errors.contains("must stay free") && submitted.errors.contains("make room"), "{}", submitted.errors);
    wait_for("it is not ready", || get(&page, "/readyz").0.starts_with("HTTP/1.1 503"));
    assert!(get(&page, "/healthz").0.starts_with("HTTP/1.1 200"));
    assert_eq!(metric(&page, "tessera_refuses_jobs"), 1.0);
    let status = program.run(&[&["status"][..], &access].concat());
    assert!(status.lines[0].contains("no job is taken now"), "{:?}", status.lines);
}

fn jobs(program: &Program, address: &str) -> Vec<(u64, String)> {
    let listed = program.run(&["list", "--json", "--coordinator", address, "--keys", "keys"]);
    assert_eq!(listed.code, Some(0), "{}", listed.errors);
    let jobs: Value = serde_json::from_str(&listed.lines.concat()).unwrap();
    let word = |state: &Value| state.as_str().map_or_else(|| state.as_object().unwrap().keys().next().unwrap().clone(), str::to_owned);
    jobs.as_array().unwrap().iter().map(|job| (job["job"].as_u64().unwrap(), word(&job["state"]))).collect()
}

fn assets(program: &Program) -> usize {
    fs::read_dir(program.path("data/assets")).unwrap().count()
}

/// The same picture again and again: all jobs share their assets. What one leaves behind is what the other lives on.
#[test]
fn deleting_a_job_takes_nothing_from_another_that_waits_and_all_goes_with_the_last() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic"]);
    let (coordinator, address) = program.coordinator("keys", &[]);
    let access = ["--coordinator", &address, "--keys", "keys"];
    let run = |arguments: &[&str]| program.run(&[arguments, &access].concat());
    let node = program.node(&address, "keys/node-attic.pem");
    let first = run(&["render", "job.lua", "-o", "first", "-q", "--set", "samples=1", "--min-nodes", "1"]);
    assert_eq!(first.code, Some(0), "{}", first.errors);
    node.kill();
    assert_eq!(jobs(&program, &address), [(1, "finished".to_owned())]);
    let submitted = run(&["submit", "job.lua", "--set", "samples=1"]);
    assert_eq!(submitted.lines, ["2"], "{}", submitted.errors);
    assert_eq!(assets(&program), 1, "both have one frame");

    let refused = run(&["delete", "2"]);
    assert_eq!(refused.code, Some(5), "{}", refused.errors);
    assert!(refused.errors.contains("waits or runs: `tessera cancel 2`"), "{}", refused.errors);
    let deleted = run(&["delete", "1"]);
    assert_eq!((deleted.code, deleted.lines.concat()), (Some(0), "job 1 is deleted".to_owned()), "{}", deleted.errors);
    assert_eq!(assets(&program), 1, "job 2 needs it");
    assert!(jobs(&program, &address).iter().all(|(job, _)| *job == 2));
    assert!(!program.path("data/jobs/1").exists());
    assert_eq!(run(&["fetch", "1", "-o", "gone"]).code, Some(5));
    assert_eq!(run(&["watch", "1"]).code, Some(5));

    // The node must fetch the frame anew; the coordinator must know job 2 after a start, and nothing of job 1.
    coordinator.kill();
    let (coordinator, _) = program.coordinator_at(&address, "keys", &[]);
    let node = program.node(&address, "keys/node-attic.pem");
    let watched = run(&["watch", "2", "-q"]);
    assert_eq!(watched.code, Some(0), "{}", watched.errors);
    assert_eq!(run(&["fetch", "2", "-o", "second"]).code, Some(0));
    assert!(fs::read(program.path("first/job.exr")).unwrap() == fs::read(program.path("second/job.exr")).unwrap());
    assert_eq!(jobs(&program, &address), [(2, "finished".to_owned())]);

    assert_eq!(run(&["delete", "2"]).code, Some(0));
    assert_eq!((jobs(&program, &address).len(), assets(&program)), (0, 0));
    let status = program.wait_for_status(&address, "keys", |status| status["jobs"].as_array().unwrap().is_empty());
    assert!(status["refusal"].is_null());
    // Nobody is to have rendered the next job before it is cancelled.
    node.kill();
    coordinator.kill();
    let (_coordinator, _) = program.coordinator_at(&address, "keys", &[]);
    let submitted = run(&["submit", "job.lua", "--set", "samples=1"]);
    assert_eq!(submitted.lines, ["3"], "a number comes once: {}", submitted.errors);
    let cancelled = run(&["cancel", "3"]);
    assert_eq!(cancelled.lines, ["job 3 is cancelled"], "{}", cancelled.errors);
    wait_for("its end is on disk", || jobs(&program, &address) == [(3, "cancelled".to_owned())]);
}

#[test]
fn a_job_whose_folder_refuses_its_files_is_named_wherever_one_looks() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic"]);
    let (coordinator, address, page) = with_page(&program, &[]);
    let access = ["--coordinator", &address, "--keys", "keys"];
    let submitted = program.run(&[&["submit", "job.lua", "--set", "samples=1"][..], &access].concat());
    assert_eq!(submitted.code, Some(0), "{}", submitted.errors);
    let files = program.path("data/jobs/1/files");
    fs::remove_dir(&files).unwrap();
    fs::write(&files, "in the way").unwrap();
    let _node = program.node(&address, "keys/node-attic.pem");
    let status = program.wait_for_status(&address, "keys", |status| status["jobs"][0]["trouble"].is_string());
    assert!(status["jobs"][0]["trouble"].as_str().unwrap().contains("its files cannot be written"), "{status:#}");
    wait_for("the page says it", || metric(&page, "tessera_jobs_held_up") == 1.0);
    assert!(get(&page, "/status.json").1.contains("its files cannot be written"));
    let status = program.run(&[&["status"][..], &access].concat());
    assert!(status.lines.iter().any(|line| line.contains("writing: its files cannot be written")), "{:?}", status.lines);
    let cancelled = program.run(&[&["cancel", "1"][..], &access].concat());
    assert_eq!(cancelled.code, Some(0), "{}", cancelled.errors);
    wait_for("others go on", || metric(&page, "tessera_jobs_held_up") == 0.0);
    let log = coordinator.kill().errors;
    assert_eq!(log.matches("until the disk takes its files").count(), 1, "once, not every second: {log}");
}

/// A coordinator that outlives writes beyond what it may write (and goes with the test), its address and its page.
struct Limited(Child, String, String);

impl Limited {
    fn start(program: &Program) -> Self {
        let arguments = ["coordinator", "--listen", "127.0.0.1:0", "--data", "data", "--keys", "keys", "--web", "127.0.0.1:0"];
        let mut command = Command::new("sh");
        command.args(["-c", "trap '' XFSZ; exec \"$0\" \"$@\"", BINARY]).args(arguments).current_dir(program.folder.path());
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
        let mut told = |start: &str| lines.find_map(|line| line.strip_prefix(start).map(str::to_owned)).unwrap();
        let (address, page) = (told("listening on "), told("status page at http://"));
        Self(child, address, page.trim_end_matches('/').to_owned())
    }

    /// Its files may grow to so many bytes; `None`: as far as there is room.
    fn may_write(&self, bytes: Option<u64>) {
        let pid = Pid::from_raw(i32::try_from(self.0.id()).unwrap());
        let maximum = getrlimit(Resource::Fsize).maximum;
        prlimit(pid, Resource::Fsize, Rlimit { current: bytes.or(maximum), maximum }).unwrap();
    }
}

impl Drop for Limited {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What the disk refuses for a while is written when it takes it again: by the same process, and nothing is missing at the next start.
#[test]
fn a_disk_that_was_full_for_a_while_loses_nothing() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic"]);
    let coordinator = Limited::start(&program);
    let (address, page) = (coordinator.1.clone(), coordinator.2.clone());
    let access = ["--coordinator", &address, "--keys", "keys"];
    let run = |arguments: &[&str]| program.run(&[arguments, &access].concat());
    coordinator.may_write(Some(1));
    let _node = program.node(&address, "keys/node-attic.pem");
    wait_for("the journal is refused", || get(&page, "/readyz").0.starts_with("HTTP/1.1 503"));
    let refused = run(&["submit", "job.lua"]);
    assert_eq!(refused.code, Some(5), "{}", refused.errors);
    assert!(refused.errors.contains("cannot write the journal"), "{}", refused.errors);
    wait_for("it tries again, in vain", || metric(&page, "tessera_disk_refusals_total") >= 2.0);
    coordinator.may_write(None);
    wait_for("it goes on by itself", || get(&page, "/readyz").0.starts_with("HTTP/1.1 200"));
    let rendered = run(&["render", "job.lua", "-o", "out", "-q", "--set", "samples=1"]);
    assert_eq!(rendered.code, Some(0), "{}", rendered.errors);
    drop(coordinator);
    let (_coordinator, _) = program.coordinator_at(&address, "keys", &[]);
    let status = program.wait_for_status(&address, "keys", |status| status["nodes"][0]["state"] == "ready");
    assert_eq!((status["jobs"][0]["state"].as_str(), status["nodes"][0]["name"].as_str()), (Some("finished"), Some("attic")));
}
