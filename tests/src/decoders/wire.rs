//! Frames, and messages of either direction.

use std::{
    pin::pin,
    task::{Context, Poll, Waker},
};

use serde::{Serialize, de::DeserializeOwned};
use tessera_engine::{
    description::Aovs,
    part::{Counters, Rect, RenderedPart},
};
use tessera_node::{
    coordinator::submission,
    limits::{HELLO_BYTES, PART_HEADER_BYTES},
    wire::{
        self, FromNode, Heartbeat, JoinRequest, JoinResponse, NodeStream, PartHeader, Request, Response, ToNode, requested_key,
        tls::{Identity, Token},
    },
};

/// What a message is once it was decoded. What was decoded is coded in no more bytes, and these are decoded to the same; compared as bytes,
/// for a number may be none.
pub(super) fn message<T: Serialize + DeserializeOwned>(bytes: &[u8]) -> Option<T> {
    let message: T = wire::decode(bytes).ok()?;
    let coded = wire::encode(&message, bytes.len()).expect("a message is coded in no more bytes than it came in");
    let again: T = wire::decode(&coded[4..]).expect("what is coded is decoded");
    assert!(wire::encode(&again, bytes.len()).unwrap() == coded, "a message changed on its way");
    Some(message)
}

/// Frame after frame of a stream, until one is refused; the first decides.
pub fn frame(bytes: &[u8]) -> bool {
    let mut stream = bytes;
    let mut accepted = 0;
    loop {
        let before = stream;
        let read = now(wire::read::<NodeStream>(&mut stream, HELLO_BYTES));
        let announced = before.first_chunk().map(|length| u32::from_le_bytes(*length) as usize);
        let body = announced.filter(|length| *length <= HELLO_BYTES).and_then(|length| before[4..].get(..length));
        let whole = body.is_some_and(|body| wire::decode::<NodeStream>(body).is_ok());
        assert_eq!(read.is_ok(), whole, "a frame is taken if it is whole, short enough and a message");
        if !whole {
            return accepted > 0;
        }
        assert_eq!(before.len() - stream.len(), 4 + body.map_or(0, <[u8]>::len), "a frame is taken whole, and nothing beyond it");
        accepted += 1;
    }
}

/// The result of what need not wait: all its bytes are there.
fn now<T>(future: impl Future<Output = T>) -> T {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(result) => result,
        Poll::Pending => panic!("it waits for bytes that never come"),
    }
}

/// The first frame on a node's stream, and its heartbeats.
pub fn hello(bytes: &[u8]) -> bool {
    message::<NodeStream>(bytes).is_some() | message::<Heartbeat>(bytes).is_some()
}

/// What nodes and the coordinator say to each other.
pub fn control(bytes: &[u8]) -> bool {
    message::<FromNode>(bytes).is_some() | message::<ToNode>(bytes).is_some()
}

/// A part as it is handed in: its header, then its pixels. Taken for one of those rectangles that have so many pixels.
pub fn part(bytes: &[u8]) -> bool {
    message::<PartHeader>(bytes);
    let mut stream = bytes;
    let Ok(header) = now(wire::read::<PartHeader>(&mut stream, PART_HEADER_BYTES)) else { return false };
    let rect = Rect { x: header.job.0 as u32, y: header.lease.0 as u32, width: stream.len() as u32 / 12, height: 1 };
    let Ok(part) = RenderedPart::from_bytes(rect, Aovs::NONE, Counters::default(), stream) else {
        assert_ne!(stream.len() % 12, 0, "pixels are taken if their number is right");
        return false;
    };
    assert_eq!(part.pixels.len() as u64, rect.area());
    assert!(part.to_bytes() == stream, "pixels changed on their way");
    part.hash() == header.hash
}

/// What clients ask for. A job that is accepted can be told to the farm's core, and its scene be compiled or refused.
pub fn request(bytes: &[u8]) -> bool {
    let request = message::<Request>(bytes);
    if let Some(Request::Submit { description, terms }) = &request
        && submission::check(description, terms).is_ok()
    {
        let spec = submission::spec(description, terms, "someone");
        assert!(spec.min_nodes > 0 && spec.width > 0 && spec.height > 0);
        super::scene::compiles(&description.frame);
    }
    request.is_some()
}

/// What the coordinator answers.
pub fn response(bytes: &[u8]) -> bool {
    message::<Response>(bytes).is_some()
}

/// Joining, in both directions.
pub fn join(bytes: &[u8]) -> bool {
    let request = message::<JoinRequest>(bytes);
    if let Some(JoinRequest { token, key, .. }) = &request {
        let _ = token.as_deref().map(Token::read);
        let _ = requested_key(key.clone());
    }
    let response = message::<JoinResponse>(bytes);
    if let Some(JoinResponse::Certified { chain }) = &response {
        let _ = Identity::parse(chain);
    }
    request.is_some() | response.is_some()
}
