//! Peers that have a certificate of the farm and mean it harm: a real coordinator against connections that keep to no rule. Its memory and its disk
//! stay bounded, and others' work goes on.

use std::{
    fs,
    net::SocketAddr,
    path::Path,
    time::{Duration, Instant},
};

use tessera_node::{
    farm::{Incarnation, JobId},
    limits::{CONNECTIONS_PER_CLIENT, CONTROL_BYTES, FRAME_PATIENCE, HELLO_BYTES},
    wire::{
        self, FromNode, Heartbeat, Hello, NodeStream,
        tls::{Identity, Role},
    },
};
use tessera_tests::farm::{Program, Running};
use tokio::time::{sleep, timeout};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

/// What an attack may cost the coordinator, in KiB: far below what it tries to make it hold.
const ALLOWED_KIB: u64 = 192 << 10;

/// The most memory that a process ever had, in KiB.
fn peak(process: &Running) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", process.pid())).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}

/// Bytes of all files below a folder.
fn size(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.map(|path| if path.is_dir() { size(&path) } else { fs::metadata(&path).map_or(0, |metadata| metadata.len()) }).sum()
}

/// A farm with a good node, an evil one's key, and an evil submitter's.
struct Farm {
    program: Program,
    coordinator: Running,
    address: String,
    socket: SocketAddr,
    _node: Running,
}

impl Farm {
    fn start(more: &[&str]) -> Self {
        let program = Program::new(BINARY);
        program.make_keys("keys", &["good", "evil"]);
        assert_eq!(program.run(&["keys", "issue", "--keys", "keys", "--role", "submitter", "--name", "eve"]).code, Some(0));
        let operator = "keys/operator-operator.pem";
        let (coordinator, address) = program.coordinator("keys", more);
        let node = program.node(&address, "keys/node-good.pem");
        program.wait_for_status(&address, operator, |status| status["nodes"][0]["state"] == "ready");
        let socket = address.parse().unwrap();
        Self { program, coordinator, address, socket, _node: node }
    }

    fn identity(&self, file: &str, role: Role) -> Identity {
        Identity::load(&self.program.path("keys").join(file), role).unwrap()
    }

    /// Does `attack` while a job of the operator's is rendered from its beginning to its end; then looks at what it cost.
    fn render_under(self, attack: impl Future<Output = ()> + Send + 'static) {
        let before = peak(&self.coordinator);
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
        let attack = runtime.spawn(attack);
        std::thread::sleep(Duration::from_millis(500));
        let access = ["--coordinator", &self.address, "--keys", "keys/operator-operator.pem", "--set", "samples=16"];
        let finished = self.program.run(&[&["submit", "job.lua", "--wait", "-o", "out"][..], &access].concat());
        assert!(!attack.is_finished(), "the attack lasts as long as the job");
        attack.abort();
        let after = peak(&self.coordinator);
        let log = self.coordinator.kill().errors;
        assert_eq!(finished.code, Some(0), "{}\n{log}", finished.errors);
        println!("{before} KiB before, {after} KiB after");
        assert!(after < before + ALLOWED_KIB, "{before} KiB before, {after} KiB after\n{log}");
        assert!(log.len() < 1 << 20, "the log is not flooded: {} bytes", log.len());
        assert!(size(&self.program.path("data")) < 64 << 20, "nor is the disk: {} bytes", size(&self.program.path("data")));
        let alone = self.program.run(&["render", "job.lua", "--threads", "1", "-o", "alone", "--set", "samples=16"]);
        assert_eq!(alone.code, Some(0), "{}", alone.errors);
        let picture = |folder: &str| fs::read(self.program.path(folder).join("job.exr")).unwrap();
        assert!(picture("out") == picture("alone"), "the picture is the same");
    }
}

/// Frames of 64 MiB on all streams of many connections at once, half of which never end.
#[test]
fn floods_of_large_frames_wait_their_turn() {
    let farm = Farm::start(&[]);
    let (identity, socket) = (farm.identity("submitter-eve.pem", Role::Submitter), farm.socket);
    farm.render_under(async move {
        let endpoint = wire::client(&identity, socket).unwrap();
        let mut connections = Vec::new();
        for _ in 0..4 {
            connections.push(wire::connect(&endpoint, socket).await.unwrap());
        }
        let streams = connections.iter().flat_map(|connection| (0..16).map(move |number| (connection.clone(), number)));
        let flood = streams.map(|(connection, number)| {
            tokio::spawn(async move {
                loop {
                    let Ok((mut send, _receive)) = connection.open_bi().await else { return sleep(Duration::from_secs(1)).await };
                    let _ = send.write_all(&(64_u32 << 20).to_le_bytes()).await;
                    let chunk = vec![0_u8; 1 << 16];
                    for _ in 0..(64 << 4) {
                        if send.write_all(&chunk).await.is_err() {
                            break;
                        }
                        if number % 2 == 0 {
                            sleep(Duration::from_millis(300)).await;
                        }
                    }
                }
            })
        });
        for task in flood.collect::<Vec<_>>() {
            let _ = task.await;
        }
        sleep(Duration::from_secs(600)).await;
    });
}

/// A node that answers what it was not asked, with the largest of messages, and beats without end.
#[test]
fn a_node_that_talks_without_end_fills_neither_queue_nor_journal() {
    let farm = Farm::start(&[]);
    let (identity, socket) = (farm.identity("node-evil.pem", Role::Node), farm.socket);
    farm.render_under(async move {
        let endpoint = wire::client(&identity, socket).unwrap();
        let cells: Vec<(u32, f64)> = (0..1_000_000).map(|cell| (cell, 1.0)).collect();
        let probed = wire::encode(&FromNode::Probed { job: JobId(1), cells }, CONTROL_BYTES).unwrap();
        let failed = wire::encode(&FromNode::Goodbye { reason: "x".repeat(1 << 20) }, CONTROL_BYTES).unwrap();
        loop {
            let Ok(connection) = wire::connect(&endpoint, socket).await else { continue };
            let Ok((mut send, _receive)) = connection.open_bi().await else { continue };
            let incarnation = Incarnation(wire::tls::random());
            let hello = Hello { incarnation, lanes: 1, build: "evil".to_owned(), revision: tessera_engine::REVISION };
            wire::write(&mut send, &NodeStream::Control(hello), HELLO_BYTES).await.unwrap();
            let beat = wire::encode(&Heartbeat { incarnation }, HELLO_BYTES).unwrap()[4..].to_vec();
            for _ in 0..50 {
                (0..2000).for_each(|_| drop(connection.send_datagram(beat.clone().into())));
                if send.write_all(&probed).await.is_err() {
                    break;
                }
            }
            let _ = send.write_all(&failed).await;
            connection.closed().await;
        }
    });
}

/// Streams that are opened and left, or filled with nonsense, as fast as it goes.
#[test]
fn floods_of_streams_end_their_connection_alone() {
    let farm = Farm::start(&[]);
    let (identity, socket) = (farm.identity("node-evil.pem", Role::Node), farm.socket);
    farm.render_under(async move {
        let endpoint = wire::client(&identity, socket).unwrap();
        loop {
            let Ok(connection) = wire::connect(&endpoint, socket).await else { continue };
            let Ok((mut send, _receive)) = connection.open_bi().await else { continue };
            let hello = Hello { incarnation: Incarnation(wire::tls::random()), lanes: 1, build: "evil".to_owned(), revision: 0 };
            let _ = wire::write(&mut send, &NodeStream::Control(hello), HELLO_BYTES).await;
            let opened = async {
                loop {
                    let Ok(mut part) = connection.open_uni().await else { return };
                    let _ = part.write_all(&[0x10, 0, 0, 0, 1, 2, 3]).await;
                    let Ok((mut asset, _receive)) = connection.open_bi().await else { return };
                    let _ = asset.write_all(&[0xff; 4]).await;
                }
            };
            let _ = timeout(Duration::from_secs(1), opened).await;
        }
    });
}

/// More connections than a client may have, renewed for ever.
#[test]
fn floods_of_connections_are_turned_away() {
    let farm = Farm::start(&[]);
    let (identity, socket) = (farm.identity("submitter-eve.pem", Role::Submitter), farm.socket);
    farm.render_under(async move {
        let endpoint = wire::client(&identity, socket).unwrap();
        let mut kept = Vec::new();
        while kept.len() < 2 * CONNECTIONS_PER_CLIENT {
            kept.extend(wire::connect(&endpoint, socket).await.ok());
        }
        sleep(Duration::from_millis(500)).await;
        let alive = kept.iter().filter(|connection| connection.close_reason().is_none()).count();
        assert!(alive <= CONNECTIONS_PER_CLIENT, "{alive} connections of one key");
        loop {
            let _ = wire::connect(&endpoint, socket).await;
        }
    });
}

/// A stream that sends a byte a second is given up, however little it takes.
#[test]
fn a_byte_a_second_is_not_waited_for() {
    let farm = Farm::start(&[]);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let identity = farm.identity("submitter-eve.pem", Role::Submitter);
    runtime.block_on(async {
        let endpoint = wire::client(&identity, farm.socket).unwrap();
        let connection = wire::connect(&endpoint, farm.socket).await.unwrap();
        let (mut send, _receive) = connection.open_bi().await.unwrap();
        send.write_all(&1000_u32.to_le_bytes()).await.unwrap();
        let begin = Instant::now();
        while send.write_all(&[0]).await.is_ok() {
            assert!(begin.elapsed() < 4 * FRAME_PATIENCE, "it is still waited for");
            sleep(Duration::from_secs(1)).await;
        }
        assert!(connection.close_reason().is_none(), "the rest of the connection is let be");
    });
}

/// A job whose model is a file of its own of so many MiB.
fn submit_large(farm: &Farm, key: &str, name: &str, mebibytes: usize) -> Option<i32> {
    let program = &farm.program;
    let mut model = format!("# {name} {}\n", "x".repeat(100)).repeat((mebibytes << 20) / (105 + name.len()));
    model.push_str("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    fs::write(program.path(&format!("{name}.obj")), model).unwrap();
    let job = format!(
        "local tessera = require('tessera')\nreturn tessera.job {{ scene = tessera.scene {{ objects = {{ tessera.model {{ file = '{name}.obj' }} }}, \
         lights = {{ tessera.point {{ position = {{3, 3, 3}}, intensity = 30 }} }} }}, film = {{ width = 8, height = 8 }} }}\n"
    );
    fs::write(program.path(&format!("{name}.lua")), job).unwrap();
    let finished = program.run(&["submit", &format!("{name}.lua"), "--coordinator", &farm.address, "--keys", key]);
    if finished.code != Some(0) {
        assert!(finished.errors.contains("--submitter-bytes"), "{}", finished.errors);
    }
    finished.code
}

#[test]
fn a_submitter_fills_its_share_of_the_disk_and_no_more() {
    let farm = Farm::start(&["--submitter-bytes", "8388608"]);
    let eve = "keys/submitter-eve.pem";
    assert_eq!(submit_large(&farm, eve, "huge", 9), Some(8));
    for (name, code) in [("a", Some(0)), ("b", Some(0)), ("c", Some(8))] {
        assert_eq!(submit_large(&farm, eve, name, 3), code, "{name}");
    }
    assert!(size(&farm.program.path("data/assets")) < 9 << 20, "nothing is kept of what was refused");
    assert_eq!(submit_large(&farm, "keys/operator-operator.pem", "d", 9), Some(0), "an operator has no such limit");
}
