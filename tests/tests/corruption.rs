//! A node whose memory or network flips bits: what it delivers is caught by its hash, always, and rendered elsewhere.

use std::{fs, net::SocketAddr, path::Path};

use tessera_engine::{
    REVISION,
    description::Aovs,
    part::{self, Counters, Rect, RenderedPart},
};
use tessera_node::{
    farm::Incarnation,
    limits::{CONTROL_BYTES, HELLO_BYTES, PART_HEADER_BYTES},
    wire::{
        self, FromNode, Heartbeat, Hello, NodeStream, PartHeader, ToNode,
        tls::{Identity, Role},
    },
};
use tessera_tests::farm::{Program, assert_each_part_committed_once, manifest};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");
const LIFE: Incarnation = Incarnation(7);

/// The bytes and the hash of a black part, and then one bit of the bytes flipped.
fn flipped(rect: Rect) -> (Vec<u8>, [u8; 32]) {
    let mut bytes = vec![0; usize::try_from(rect.area() * 12).unwrap()];
    let hash = RenderedPart::from_bytes(rect, Aovs::NONE, Counters::default(), &bytes).unwrap().hash();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    (bytes, hash)
}

/// A node that does all that is asked of it, at no cost, and whose pixels have a flipped bit. Runs until its connection ends.
async fn flaky_node(address: SocketAddr, keys: &Path) {
    let endpoint = wire::client(&Identity::load(keys, Role::Node).unwrap(), address).unwrap();
    let connection = wire::connect(&endpoint, address).await.unwrap();
    let (mut send, mut receive) = connection.open_bi().await.unwrap();
    let hello = Hello { incarnation: LIFE, lanes: 1, build: "flaky".to_owned(), revision: REVISION };
    wire::write(&mut send, &NodeStream::Control(hello), HELLO_BYTES).await.unwrap();
    let beats = connection.clone();
    // A datagram needs no length before it.
    let beat = wire::encode(&Heartbeat { incarnation: LIFE }, CONTROL_BYTES).unwrap().split_off(4);
    tokio::spawn(async move {
        while beats.send_datagram(beat.clone().into()).is_ok() {
            tokio::time::sleep(tessera_node::limits::HEARTBEAT_INTERVAL).await;
        }
    });
    let mut pictured = None;
    while let Ok(asked) = wire::read::<ToNode>(&mut receive, CONTROL_BYTES).await {
        let answer = match asked {
            ToNode::Prove { seed } => FromNode::Proof { hash: part::canary_hash(seed).unwrap() },
            ToNode::Prepare { job, frame, .. } => {
                pictured = Some(frame);
                FromNode::Prepared { job, result: Ok(()) }
            }
            ToNode::Probe { job, cells, .. } => FromNode::Probed { job, cells: cells.iter().map(|(cell, _)| (*cell, 1e-6)).collect() },
            ToNode::Render { job, lease, rect, .. } => {
                let (bytes, hash) = flipped(rect);
                let header = PartHeader { job, lease, frame: pictured.unwrap(), seconds: 1e-3, hash, invalid_samples: 0 };
                let mut stream = connection.open_uni().await.unwrap();
                wire::write(&mut stream, &header, PART_HEADER_BYTES).await.unwrap();
                stream.write_all(&bytes).await.unwrap();
                stream.finish().unwrap();
                continue;
            }
            ToNode::Cancel { job, lease } => FromNode::Cancelled { job, lease },
            ToNode::Settled { .. } | ToNode::Release { .. } => continue,
        };
        wire::write(&mut send, &answer, CONTROL_BYTES).await.unwrap();
    }
}

#[test]
fn flipped_bits_are_caught_and_their_parts_rendered_elsewhere() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["flaky", "sound"]);
    let (_coordinator, address) = program.coordinator("keys", &[]);
    let (socket, keys) = (address.parse().unwrap(), program.path("keys/node-flaky.pem"));
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(flaky_node(socket, &keys));
    });
    let _sound = program.node(&address, "keys/node-sound.pem");
    let ready = |status: &serde_json::Value| {
        status["nodes"].as_array().is_some_and(|nodes| nodes.iter().filter(|node| node["state"] == "ready").count() == 2)
    };
    program.wait_for_status(&address, "keys", ready);
    let finished = program.run(&["submit", "job.lua", "--wait", "-o", "out", "--coordinator", &address, "--keys", "keys"]);
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
    let undisturbed = program.run(&["render", "job.lua", "--threads", "1", "-o", "undisturbed"]);
    assert_eq!(undisturbed.code, Some(0), "{}", undisturbed.errors);
    assert!(
        fs::read(program.path("out/job.exr")).unwrap() == fs::read(program.path("undisturbed/job.exr")).unwrap(),
        "a flipped bit is in the picture"
    );
    let manifest = manifest(&program.path("out/job.manifest.json"));
    assert_each_part_committed_once(&manifest);
    let attempts = manifest["parts"].as_array().unwrap().iter().flat_map(|part| part["attempts"].as_array().unwrap());
    let caught = attempts.filter(|attempt| attempt["reason"].as_str().is_some_and(|reason| reason.contains("hash"))).count();
    assert!(caught > 0, "the flaky node was asked for nothing");
}
