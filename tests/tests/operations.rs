//! What an operator sees and does: metrics, readiness, a disk that is full.

use std::{
    fs,
    io::{Read, Write},
    net::TcpStream,
    thread,
    time::{Duration, Instant},
};

use rustix::process::Signal;
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
