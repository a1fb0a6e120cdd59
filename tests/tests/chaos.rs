//! Real processes, really hurt: whatever dies, the picture is the same to the byte, and every part is in it once.

use std::{
    fs,
    net::{Ipv4Addr, SocketAddr, UdpSocket},
    path::Path,
    sync::OnceLock,
    time::{Duration, Instant},
};

use rustix::process::Signal;
use serde_json::Value;
use tessera_node::{
    farm::Incarnation,
    limits::{CONTROL_BYTES, HELLO_BYTES},
    wire::{
        self, FromNode, Hello, NodeStream, ToNode,
        tls::{Identity, Role},
    },
};
use tessera_tests::farm::{Program, Running, assert_each_part_committed_once, lives, manifest, signal};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

/// The bytes of the EXR of an undisturbed run in one thread.
fn undisturbed() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| {
        let program = Program::new(BINARY);
        let finished = program.run(&["render", "job.lua", "--threads", "1", "-o", "out"]);
        assert_eq!(finished.code, Some(0), "{}", finished.errors);
        fs::read(program.path("out/job.exr")).unwrap()
    })
}

fn start_render(program: &Program) -> Running {
    program.start(&["render", "job.lua", "--nodes", "3", "--lanes", "1", "-o", "out", "--json"])
}

fn assert_undisturbed(program: &Program) {
    assert!(fs::read(program.path("out/job.exr")).unwrap() == undisturbed(), "the EXR's bytes differ from those of an undisturbed run");
}

/// Kills that of three nodes which holds most when a share of the parts is committed.
fn kill_at(share: f64) {
    let program = Program::new(BINARY);
    let mut render = start_render(&program);
    let event = render.progress(share);
    let nodes = event["nodes"].as_array().unwrap();
    let busiest = nodes.iter().max_by_key(|node| node["holds"].as_u64()).unwrap();
    signal(render.node(busiest["name"].as_str().unwrap()), Signal::KILL);
    let finished = render.finish();
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
    assert_undisturbed(&program);
    let manifest = manifest(&program.path("out/job.manifest.json"));
    assert_each_part_committed_once(&manifest);
    assert_noticed_within_a_second(&manifest, &busiest["id"]);
}

/// The promise of one second from the death to the suspicion. The silence that the coordinator noted began before the death.
fn assert_noticed_within_a_second(manifest: &Value, killed: &Value) {
    let attempts = |part: &Value| part["attempts"].as_array().unwrap().clone();
    let unfinished = |attempt: &Value| attempt["node"] == *killed && attempt["outcome"] != "committed";
    if !manifest["parts"].as_array().unwrap().iter().any(|part| attempts(part).iter().any(unfinished)) {
        // It handed in the last of its parts in the very moment of its death: there was nothing to be noticed.
        return;
    }
    let events = manifest["events"].as_array().unwrap();
    let suspicion = events.iter().find(|event| event["kind"] == "suspected" && event["node"] == *killed);
    let detail = suspicion.expect("the dead node's parts were given to others")["detail"].as_str().unwrap();
    let silence: f64 = detail.trim_start_matches("silent for ").trim_end_matches(" s").parse().unwrap();
    assert!(silence <= 1.0, "{detail}");
}

#[test]
fn a_node_killed_after_a_quarter_of_the_parts_changes_no_byte() {
    kill_at(0.25);
}

#[test]
fn a_node_killed_after_half_of_the_parts_changes_no_byte() {
    kill_at(0.5);
}

#[test]
fn a_node_killed_after_three_quarters_of_the_parts_changes_no_byte() {
    kill_at(0.75);
}

#[test]
fn a_zombie_commits_nothing_twice() {
    let program = Program::new(BINARY);
    let mut render = start_render(&program);
    render.progress(0.2);
    let zombie = render.node("node-3");
    signal(zombie, Signal::STOP);
    render.node_state("node-3", "suspected");
    signal(zombie, Signal::CONT);
    let finished = render.finish();
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
    assert_undisturbed(&program);
    assert_each_part_committed_once(&manifest(&program.path("out/job.manifest.json")));
}

#[test]
fn without_any_node_left_the_job_fails_and_earlier_output_stays() {
    let program = Program::new(BINARY);
    fs::create_dir(program.path("out")).unwrap();
    fs::write(program.path("out/job.exr"), "an earlier picture").unwrap();
    let mut render = start_render(&program);
    render.progress(0.1);
    render.nodes().into_iter().for_each(|pid| signal(pid, Signal::KILL));
    let finished = render.finish();
    assert_eq!(finished.code, Some(6), "{}", finished.errors);
    assert!(finished.errors.contains("no node is left"), "{}", finished.errors);
    assert_eq!(fs::read_to_string(program.path("out/job.exr")).unwrap(), "an earlier picture");
    assert_eq!(fs::read_dir(program.path("out")).unwrap().count(), 1, "no half files");
}

#[test]
fn a_job_that_finds_no_node_fails_after_the_stated_time() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &[]);
    let (_coordinator, address) = program.coordinator("keys", &["--no-node-timeout", "0.5"]);
    let finished = program.run(&["submit", "job.lua", "--wait", "-o", "out", "--coordinator", &address, "--keys", "keys"]);
    assert_eq!(finished.code, Some(6), "{}", finished.errors);
    assert!(finished.errors.contains("node"), "{}", finished.errors);
    assert_eq!(fs::read_dir(program.path("out")).unwrap().count(), 0);
}

#[test]
fn an_interrupt_ends_everything_at_once_and_leaves_nothing() {
    let program = Program::new(BINARY);
    let mut render = start_render(&program);
    render.progress(0.1);
    let nodes = render.nodes();
    signal(render.pid(), Signal::INT);
    let finished = render.finish();
    assert_eq!(finished.code, Some(130), "{}", finished.errors);
    assert_eq!(fs::read_dir(program.path("out")).unwrap().count(), 0, "no half files");
    assert_end_soon(&nodes);
}

#[test]
fn nodes_do_not_outlive_a_killed_render() {
    let program = Program::new(BINARY);
    let mut render = start_render(&program);
    render.progress(0.1);
    let nodes = render.nodes();
    render.kill();
    assert_end_soon(&nodes);
}

fn assert_end_soon(pids: &[i32]) {
    let begin = Instant::now();
    while pids.iter().any(|pid| lives(*pid)) {
        assert!(begin.elapsed() < Duration::from_secs(10), "a node's process is left over");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_taken_port_is_said_clearly() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &[]);
    let taken = UdpSocket::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, 0))).unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let finished = program.run(&["coordinator", "--listen", &address, "--data", "data", "--keys", "keys"]);
    assert_eq!(finished.code, Some(5), "{}", finished.errors);
    assert!(finished.errors.contains(&address) && finished.errors.contains("--listen"), "{}", finished.errors);
}

#[test]
fn an_unwritable_output_is_said_before_anything_is_rendered() {
    let program = Program::new(BINARY);
    fs::write(program.path("file"), "").unwrap();
    let finished = program.run(&["render", "job.lua", "--nodes", "1", "-o", "file/out"]);
    assert_eq!(finished.code, Some(4), "{}", finished.errors);
    assert!(finished.errors.contains("file/out"), "{}", finished.errors);
}

#[test]
fn a_farm_of_separate_processes_renders_the_same_bytes() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic", "cellar"]);
    let (_coordinator, address) = program.coordinator("keys", &[]);
    let _nodes = ["keys/node-attic.pem", "keys/node-cellar.pem"].map(|keys| program.node(&address, keys));
    let access = ["--coordinator", &address, "--keys", "keys"];
    let finished = program.run(&[&["submit", "job.lua", "--min-nodes", "2", "--wait", "-o", "out"][..], &access].concat());
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
    assert_undisturbed(&program);
    let number = finished.lines[0].clone();
    let fetched = program.run(&[&["fetch", &number, "-o", "again"][..], &access].concat());
    assert_eq!(fetched.code, Some(0), "{}", fetched.errors);
    assert_eq!(fs::read(program.path("again/job.exr")).unwrap(), undisturbed());
    let cancelled = program.run(&[&["cancel", &number][..], &access].concat());
    assert_eq!(cancelled.code, Some(5), "a job that is over cannot be cancelled");
}

/// The journal brings everything back: nodes go on meanwhile, and no committed part is rendered again.
#[test]
fn a_coordinator_killed_halfway_goes_on_where_it_was() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic", "cellar"]);
    let (coordinator, address) = program.coordinator("keys", &[]);
    let _nodes = ["keys/node-attic.pem", "keys/node-cellar.pem"].map(|keys| program.node(&address, keys));
    let access = ["--coordinator", &address, "--keys", "keys"];
    let submitted = program.run(&[&["submit", "job.lua", "--min-nodes", "2"][..], &access].concat());
    assert_eq!(submitted.code, Some(0), "{}", submitted.errors);
    let committed = |status: &Value| status["jobs"][0]["committed"].as_u64().unwrap_or(0);
    let before = program.wait_for_status(&address, "keys", |status| committed(status) >= 12);
    coordinator.kill();
    let (_coordinator, _) = program.coordinator_at(&address, "keys", &[]);
    let after = program.wait_for_status(&address, "keys", |_| true);
    assert!(committed(&after) >= committed(&before), "a part that was committed is not any more");
    let watched = program.run(&[&["watch", &submitted.lines[0], "--quiet"][..], &access].concat());
    assert_eq!(watched.code, Some(0), "{}", watched.errors);
    let fetched = program.run(&[&["fetch", &submitted.lines[0], "-o", "out"][..], &access].concat());
    assert_eq!(fetched.code, Some(0), "{}", fetched.errors);
    assert_undisturbed(&program);
    assert_each_part_committed_once(&manifest(&program.path("out/job.manifest.json")));
}

/// A disk that is full when the picture is to be written: here, a folder that is none for a while.
#[test]
fn files_that_cannot_be_written_yet_lose_no_part() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic"]);
    let (coordinator, address) = program.coordinator("keys", &[]);
    let access = ["--coordinator", &address, "--keys", "keys"];
    let submitted = program.run(&[&["submit", "job.lua"][..], &access].concat());
    assert_eq!(submitted.code, Some(0), "{}", submitted.errors);
    let files = program.path("data/jobs").join(&submitted.lines[0]).join("files");
    fs::remove_dir(&files).unwrap();
    fs::write(&files, "in the way").unwrap();
    let _node = program.node(&address, "keys/node-attic.pem");
    program.wait_for_status(&address, "keys", |status| status["jobs"][0]["committed"] == 48);
    coordinator.wait_for_complaint("until the disk takes its files");
    fs::remove_file(&files).unwrap();
    fs::create_dir(&files).unwrap();
    let watched = program.run(&[&["watch", &submitted.lines[0], "--quiet"][..], &access].concat());
    assert_eq!(watched.code, Some(0), "{}", watched.errors);
    assert!(fs::read(files.join("job.exr")).unwrap() == undisturbed(), "the EXR's bytes differ from those of an undisturbed run");
}

#[test]
fn a_node_of_another_farm_is_refused_and_both_say_why() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &[]);
    program.make_keys("other", &["stranger"]);
    let (coordinator, address) = program.coordinator("keys", &[]);
    let node = program.node(&address, "other/node-stranger.pem");
    node.wait_for_complaint("not connected");
    coordinator.wait_for_complaint("a peer was refused");
    let status = program.wait_for_status(&address, "keys", |_| true);
    assert_eq!(status["nodes"].as_array().unwrap().len(), 0);
    let (node, coordinator) = (node.kill(), coordinator.kill());
    assert!(node.errors.contains("not connected") && node.errors.contains("certificate"), "{}", node.errors);
    assert!(
        node.errors.contains("different farms") && node.errors.contains("tessera keys issue"),
        "it says how to mend it: {}",
        node.errors
    );
    assert!(coordinator.errors.contains("a peer was refused") && coordinator.errors.contains("certificate"), "{}", coordinator.errors);
}

#[test]
fn a_key_that_others_may_read_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic"]);
    let key = program.path("keys/node-attic.pem");
    fs::set_permissions(&key, fs::Permissions::from_mode(0o640)).unwrap();
    let finished = program.run(&["node", "--coordinator", "127.0.0.1:1", "--keys", "keys/node-attic.pem"]);
    assert_eq!(finished.code, Some(4), "{}", finished.errors);
    assert!(finished.errors.contains("chmod 600"), "{}", finished.errors);
}

/// A node that computes something else: it says hello, and answers the canary with wrong bytes. Returns why it was sent away.
async fn wrong_canary(address: SocketAddr, keys: &Path) -> String {
    let endpoint = wire::client(&Identity::load(keys, Role::Node).unwrap(), address).unwrap();
    let connection = wire::connect(&endpoint, address).await.unwrap();
    let (mut send, mut receive) = connection.open_bi().await.unwrap();
    let hello = Hello { incarnation: Incarnation(7), lanes: 1, build: "another build".to_owned(), revision: tessera_engine::REVISION };
    wire::write(&mut send, &NodeStream::Control(hello), HELLO_BYTES).await.unwrap();
    let question: ToNode = wire::read(&mut receive, CONTROL_BYTES).await.unwrap();
    assert!(matches!(question, ToNode::Prove { .. }));
    wire::write(&mut send, &FromNode::Proof { hash: [0; 32] }, CONTROL_BYTES).await.unwrap();
    connection.closed().await.to_string()
}

#[test]
fn a_node_that_computes_otherwise_gets_no_work() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["odd"]);
    let (coordinator, address) = program.coordinator("keys", &[]);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let reason = runtime.block_on(wrong_canary(address.parse().unwrap(), &program.path("keys/node-odd.pem")));
    assert!(reason.contains("canary"), "{reason}");
    let status = program.wait_for_status(&address, "keys", |status| status["nodes"][0]["name"] == "odd");
    assert_ne!(status["nodes"][0]["state"], "ready");
    let log = coordinator.kill().errors;
    assert!(log.contains("canary"), "{log}");
}

#[test]
fn garbage_closes_one_connection_and_no_other() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["odd", "good"]);
    let (_coordinator, address) = program.coordinator("keys", &[]);
    let _node = program.node(&address, "keys/node-good.pem");
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let socket: SocketAddr = address.parse().unwrap();
    let closed = runtime.block_on(async {
        let endpoint = wire::client(&Identity::load(&program.path("keys/node-odd.pem"), Role::Node).unwrap(), socket).unwrap();
        let connection = wire::connect(&endpoint, socket).await.unwrap();
        let (mut send, _receive) = connection.open_bi().await.unwrap();
        // A frame of 4 GiB, announced.
        send.write_all(&[0xff; 64]).await.unwrap();
        connection.closed().await.to_string()
    });
    assert!(closed.contains("allowed"), "{closed}");
    let status = program.wait_for_status(&address, "keys", |status| status["nodes"][0]["state"] == "ready");
    assert_eq!(status["nodes"].as_array().unwrap().len(), 1);
}
