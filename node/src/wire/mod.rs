//! What travels between the processes of a farm: identities, endpoints, frames, messages.
//!
//! A connection is QUIC with mutual TLS; the ALPN names the protocol. What a peer may say follows from the role in its certificate:
//!
//! | who opens | stream | what |
//! | --- | --- | --- |
//! | node | bidirectional, one | [`FromNode`] and [`ToNode`] frames until goodbye; the first frame is [`NodeStream::Control`] |
//! | node | bidirectional, one an asset | [`NodeStream::Asset`], answered by a length and the bytes |
//! | node | unidirectional, one a part | [`PartHeader`], then its pixels |
//! | node | datagrams | [`Heartbeat`] |
//! | submitter, observer, operator | bidirectional, one a request | a [`Request`], answered by [`Response`] frames |
//!
//! Joining, and renewing a key, has a protocol of its own: [`JoinRequest`] on one bidirectional stream, answered by a [`JoinResponse`].

mod endpoint;
mod frame;
mod join;
mod message;
mod refusal;
mod request;
pub mod tls;

pub use endpoint::{JOIN_ALPN, client, connect, renewer, server};
pub use frame::{FrameError, decode, encode, patience, read, read_exactly, write};
pub use join::{JoinRequest, JoinResponse, NewKey, joiner, requested_key};
pub use message::{FromNode, Heartbeat, Hello, NodeStream, PartHeader, ToNode};
pub use refusal::{Refusal, explain, explain_peer, peer_certificate};
pub use request::{FileHeader, JobState, JobStatus, KeptJob, NodeStatus, Place, Request, Response, Status, Terms, is_plain_name};

/// The protocol, as TLS negotiates it: peers that speak another one do not connect. Raise it with any change of a message.
pub const ALPN: &[u8] = b"tessera/1";

/// The name under which coordinators are certified.
pub const COORDINATOR_NAME: &str = "coordinator.tessera";

/// The code with which a coordinator closes connections when it ends itself: nodes keep what they hold and connect again. Any other code
/// ends a node's life.
pub const CLOSE_RESUME: u8 = 0;

/// The code with which a coordinator closes the connection of a node that is to begin anew; the reason stands beside it.
pub const CLOSE_ANEW: u8 = 1;

/// The code with which a coordinator closes the connection of a peer for whose certificate there is no place here; the reason stands beside it.
pub const CLOSE_DENIED: u8 = 2;

#[cfg(test)]
mod tests;
