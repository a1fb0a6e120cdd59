//! The wire against whoever does not keep to it.

use proptest::prelude::*;
use tessera_engine::{
    description::AssetId,
    part::{Rect, SampleRange},
};

use super::{FrameError, FromNode, Heartbeat, Hello, NodeStream, PartHeader, Request, Response, Status, ToNode, decode, encode, read};
use super::{
    Refusal, explain, peer_certificate,
    tls::{Authority, Identity, Peer, Role},
};
use crate::farm::{Incarnation, JobId, LeaseId};

const LIMIT: usize = 1 << 16;

fn from_node() -> Vec<FromNode> {
    let (job, lease) = (JobId(7), LeaseId(u64::MAX));
    vec![
        FromNode::Proof { hash: [9; 32] },
        FromNode::Prepared { job, result: Err("no room".to_owned()) },
        FromNode::Probed { job, cells: vec![(0, 1e-6), (u32::MAX, 0.5)] },
        FromNode::Failed { job, lease, reason: "it broke".to_owned() },
        FromNode::Cancelled { job, lease },
        FromNode::Goodbye { reason: String::new() },
    ]
}

fn to_node() -> Vec<ToNode> {
    let (job, lease) = (JobId(7), LeaseId(1 << 40));
    let rect = Rect { x: 64, y: 128, width: 64, height: 1 };
    vec![
        ToNode::Prove { seed: 3 },
        ToNode::Prepare { job, frame: AssetId([1; 32]), assets: vec![AssetId([2; 32])] },
        ToNode::Probe { job, cells: vec![(5, rect)], stride: 16 },
        ToNode::Render { job, lease, rect, samples: SampleRange { first: 0, count: 4 } },
        ToNode::Cancel { job, lease },
        ToNode::Settled { job, lease },
        ToNode::Release { job },
    ]
}

/// Reads one frame from bytes that have come.
fn read_now<T: serde::de::DeserializeOwned>(mut bytes: &[u8], limit: usize) -> Result<T, FrameError> {
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    runtime.block_on(read(&mut bytes, limit))
}

/// A message's number is its place among its kind for ever: peers of other builds read it.
#[test]
fn messages_keep_their_numbers_and_come_back() {
    for (number, message) in from_node().into_iter().enumerate() {
        let frame = encode(&message, LIMIT).unwrap();
        assert_eq!(usize::from(frame[4]), number);
        assert_eq!(read_now::<FromNode>(&frame, LIMIT).unwrap(), message);
    }
    for (number, message) in to_node().into_iter().enumerate() {
        let frame = encode(&message, LIMIT).unwrap();
        assert_eq!(usize::from(frame[4]), number);
        assert_eq!(read_now::<ToNode>(&frame, LIMIT).unwrap(), message);
    }
    let requests = [Request::Status, Request::Watch { job: JobId(1) }, Request::Fetch { job: JobId(1) }, Request::Cancel { job: JobId(1) }];
    for (number, request) in requests.into_iter().enumerate() {
        assert_eq!(usize::from(encode(&request, LIMIT).unwrap()[4]), number + 1);
    }
    assert_eq!(encode(&Response::Status(Status::default()), LIMIT).unwrap()[4], 3);
}

#[test]
fn a_truncated_frame_is_no_message() {
    for message in to_node() {
        let frame = encode(&message, LIMIT).unwrap();
        for length in 0..frame.len() {
            assert!(read_now::<ToNode>(&frame[..length], LIMIT).is_err());
        }
        // Nor is one that was cut before its length was written.
        let coded = &frame[4..frame.len() - 1];
        assert!(matches!(decode::<ToNode>(coded), Err(FrameError::Malformed(_))));
    }
}

#[test]
fn a_frame_with_something_behind_its_message_is_refused() {
    let mut coded = postcard::to_stdvec(&ToNode::Prove { seed: 3 }).unwrap();
    coded.push(0);
    assert!(matches!(decode::<ToNode>(&coded), Err(FrameError::Trailing(1))));
}

#[test]
fn an_oversized_frame_is_refused_before_anything_of_it_is_read() {
    let announced = u32::MAX.to_le_bytes();
    let error = read_now::<ToNode>(&announced, LIMIT).unwrap_err();
    assert!(matches!(error, FrameError::TooLong { length, limit: LIMIT } if length == u64::from(u32::MAX)), "{error}");
    let reason = "x".repeat(LIMIT);
    assert!(matches!(encode(&FromNode::Goodbye { reason }, LIMIT), Err(FrameError::TooLong { .. })));
}

proptest! {
    /// Whatever comes, reading ends with a message or an error, and what is a message is coded as it came.
    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let _ = decode::<NodeStream>(&bytes);
        let _ = decode::<Hello>(&bytes);
        let _ = decode::<ToNode>(&bytes);
        let _ = decode::<PartHeader>(&bytes);
        let _ = decode::<Heartbeat>(&bytes);
        let _ = decode::<Request>(&bytes);
        let _ = decode::<Response>(&bytes);
        let _ = read_now::<FromNode>(&bytes, 256);
        if let Ok(message) = decode::<FromNode>(&bytes) {
            let again = decode::<FromNode>(&postcard::to_stdvec(&message).unwrap());
            prop_assert_eq!(format!("{:?}", again.unwrap()), format!("{message:?}"));
        }
    }

    /// A length within a message that is longer than the message itself reserves no memory.
    #[test]
    fn announced_lengths_are_not_believed(count in 1_u64 << 20..1 << 60) {
        let mut coded = vec![2, 7];
        coded.extend(postcard::to_stdvec(&count).unwrap());
        prop_assert!(decode::<FromNode>(&coded).is_err());
    }
}

#[test]
fn hello_and_heartbeat_come_back() {
    let hello = Hello { incarnation: Incarnation(5), lanes: 8, build: "b".to_owned(), revision: 1 };
    let stream = NodeStream::Control(hello);
    assert_eq!(decode::<NodeStream>(&postcard::to_stdvec(&stream).unwrap()).unwrap(), stream);
    let heartbeat = Heartbeat { incarnation: Incarnation(u64::MAX) };
    let coded = postcard::to_stdvec(&heartbeat).unwrap();
    assert!(coded.len() <= 16, "a heartbeat is small");
    assert_eq!(decode::<Heartbeat>(&coded).unwrap(), heartbeat);
}

#[test]
fn only_plain_names_name_output_files() {
    for good in ["a.exr", "Bild 1.png", "x"] {
        assert!(super::is_plain_name(good), "{good}");
    }
    for bad in ["", ".", "..", ".hidden", "a/b", "/etc/passwd", "..\\x", "a\0"] {
        assert!(!super::is_plain_name(bad), "{bad}");
    }
}

/// Lets one identity connect to another: whom the one that listens sees, or what the other is told.
async fn meet(listens: &Identity, connects: &Identity) -> Result<Peer, Refusal> {
    let listening = super::server(std::net::SocketAddr::from(([127, 0, 0, 1], 0)), listens, false).unwrap();
    let address = listening.local_addr().unwrap();
    let accepting = listening.clone();
    let accepted = tokio::spawn(async move { accepting.accept().await.unwrap().await });
    let endpoint = super::client(connects, address).unwrap();
    let connection = super::connect(&endpoint, address).await?;
    match accepted.await.unwrap() {
        Ok(peer) => Ok(peer_certificate(&peer).unwrap().unwrap().peer),
        Err(_) => Err(explain(&connection.closed().await)),
    }
}

#[tokio::test]
async fn nobody_passes_for_another() {
    let (authority, foreign) = (Authority::new().unwrap(), Authority::new().unwrap());
    let coordinator = authority.issue(Role::Coordinator, "lead").unwrap();
    for role in [Role::Node, Role::Submitter, Role::Observer, Role::Operator] {
        let identity = authority.issue(role, "attic").unwrap();
        assert_eq!(meet(&coordinator, &identity).await.unwrap(), *identity.peer());
        let refusal = meet(&identity, &identity).await.unwrap_err();
        assert!(refusal.denied && refusal.message.contains("not that of a coordinator"), "{role} as coordinator: {refusal}");
        let refusal = meet(&coordinator, &foreign.issue(role, "attic").unwrap()).await.unwrap_err();
        assert!(refusal.denied && refusal.message.contains("farm"), "{refusal}");
    }
    let refusal = meet(&coordinator, &coordinator).await.unwrap_err();
    assert!(refusal.denied && refusal.message.contains("not that of a client or a node"), "a coordinator as client: {refusal}");
}

/// What a coordinator holds is worth no more than those who join: whoever steals it becomes neither operator nor coordinator.
#[tokio::test]
async fn an_issuer_certifies_those_who_join_and_nobody_else() {
    let authority = Authority::new().unwrap();
    let issuer = authority.delegate().unwrap();
    let coordinator = authority.issue(Role::Coordinator, "lead").unwrap();
    for &role in Role::JOINING {
        let joined = issuer.issue(role, "attic").unwrap();
        assert_eq!(meet(&coordinator, &joined).await.unwrap(), *joined.peer());
    }
    let refusal = meet(&coordinator, &issuer.issue(Role::Operator, "thief").unwrap()).await.unwrap_err();
    assert!(refusal.denied, "{refusal}");
    let node = authority.issue(Role::Node, "attic").unwrap();
    let refusal = meet(&issuer.issue(Role::Coordinator, "thief").unwrap(), &node).await.unwrap_err();
    assert!(refusal.denied, "{refusal}");
}

#[tokio::test]
async fn time_is_up_on_either_side_and_is_said() {
    let authority = Authority::new().unwrap();
    let (fresh, zero) = (crate::limits::CERTIFICATE_VALIDITY, std::time::Duration::ZERO);
    for (server, client) in [(zero, fresh), (fresh, zero)] {
        let listens = authority.issue_for(Role::Coordinator, "lead", server).unwrap();
        let connects = authority.issue_for(Role::Node, "attic", client).unwrap();
        tokio::time::sleep(std::time::Duration::from_secs(2)).await;
        let refusal = meet(&listens, &connects).await.unwrap_err();
        assert!(refusal.denied && refusal.message.contains("not valid now"), "{refusal}");
    }
}
