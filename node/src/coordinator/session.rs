//! One connection of a node, seen from the coordinator.

use std::{
    collections::BTreeSet,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::Instant,
};

use quinn::{Connection, ConnectionError, RecvStream, SendStream};
use tessera_engine::{description::AssetId, part::hash_of_bytes};
use tokio::{
    io::AsyncWriteExt,
    sync::{mpsc, oneshot},
    time::{sleep, timeout},
};

use super::{
    Shared,
    gate::Guest,
    input::{Input, LinkId, Outgoing},
};
use crate::{
    farm::{Incarnation, JobId, LeaseId},
    limits::{
        CONNECT_TIMEOUT, CONTROL_BYTES, FRAME_PATIENCE, HASHED_AT_ONCE_BYTES, HEARTBEAT_INTERVAL, HEARTBEATS_PER_INTERVAL, HELLO_BYTES,
        LANES, NODE_REST, PART_BYTES, PART_HEADER_BYTES, PEER_QUEUE, REASON_BYTES,
    },
    wire::{self, CLOSE_ANEW, FrameError, FromNode, Heartbeat, Hello, NodeStream, PartHeader},
};

static LINKS: AtomicU64 = AtomicU64::new(0);

/// Serves a node until its connection ends.
pub async fn serve(shared: Shared, guest: Guest) {
    let (connection, address, name) = (guest.connection.clone(), guest.address, guest.peer().name.clone());
    let link = LINKS.fetch_add(1, Ordering::Relaxed);
    let reason = match timeout(CONNECT_TIMEOUT, hello(&connection)).await {
        Err(_) => "it did not say hello in time".to_owned(),
        Ok(Err(error)) => error,
        Ok(Ok((hello, send, receive))) => {
            let (outgoing, messages) = mpsc::channel(PEER_QUEUE);
            let (known, taken) = oneshot::channel();
            let incarnation = hello.incarnation;
            let joined = Input::Joined { link, name: name.clone(), hello, address, outgoing, known };
            if shared.inputs.send(joined).await.is_err() || taken.await.is_err() {
                return;
            }
            guest.open_wide();
            let reason = converse(&shared, &guest, (link, incarnation), send, receive, messages).await;
            let left =
                matches!(connection.close_reason(), None | Some(ConnectionError::ApplicationClosed(_) | ConnectionError::LocallyClosed));
            // Nobody is left to hear it when the coordinator itself ends.
            let _ = shared.inputs.send(Input::Gone(link, left.then(|| reason.clone()))).await;
            reason
        }
    };
    tracing::info!(node = name, %address, reason, "a node's connection ended");
    connection.close(CLOSE_ANEW.into(), reason.as_bytes());
    // Its place stays taken for a while: each life of a node is an entry in the journal.
    sleep(NODE_REST).await;
}

async fn hello(connection: &Connection) -> Result<(Hello, SendStream, RecvStream), String> {
    let (send, mut receive) = connection.accept_bi().await.map_err(|error| error.to_string())?;
    match wire::read(&mut receive, HELLO_BYTES).await.map_err(|error| error.to_string())? {
        NodeStream::Control(hello) if (1..=LANES).contains(&hello.lanes) => Ok((hello, send, receive)),
        NodeStream::Control(hello) => Err(format!("it has {} lanes; 1 to {LANES} are allowed", hello.lanes)),
        NodeStream::Asset(_) => Err("it did not say hello first".to_owned()),
    }
}

/// Everything on the connection at once; the first thing that ends ends it all, and says why.
async fn converse(
    shared: &Shared,
    guest: &Guest,
    (link, incarnation): (LinkId, Incarnation),
    send: SendStream,
    receive: RecvStream,
    messages: mpsc::Receiver<Outgoing>,
) -> String {
    let connection = &guest.connection;
    tokio::select! {
        reason = guest.turned_away() => reason,
        reason = say(connection, send, messages) => reason,
        reason = listen(shared, guest, link, receive) => reason,
        reason = hear_heartbeats(shared, link, connection) => reason,
        reason = accept_parts(shared, (link, incarnation), connection) => reason,
        reason = serve_assets(shared, connection) => reason,
    }
}

/// Writes what waits in one go: a packet holds many messages.
async fn say(connection: &Connection, mut send: SendStream, mut messages: mpsc::Receiver<Outgoing>) -> String {
    let mut waiting = Vec::new();
    while messages.recv_many(&mut waiting, 256).await > 0 {
        let mut bytes = Vec::new();
        let mut close = None;
        for outgoing in waiting.drain(..) {
            match outgoing {
                Outgoing::Say(message) => match wire::encode(&message, CONTROL_BYTES) {
                    Ok(frame) => bytes.extend_from_slice(&frame),
                    Err(error) => close = Some(error.to_string()),
                },
                Outgoing::Close(reason) => close = Some(reason),
            }
        }
        if let Err(error) = send.write_all(&bytes).await {
            return error.to_string();
        }
        if let Some(reason) = close {
            // Before the streams end: the reason is to be the first that the node hears.
            connection.close(CLOSE_ANEW.into(), reason.as_bytes());
            return reason;
        }
    }
    "another connection of this node took over".to_owned()
}

async fn listen(shared: &Shared, guest: &Guest, link: LinkId, mut receive: RecvStream) -> String {
    loop {
        let heard = shared.room.read(&mut receive, CONTROL_BYTES, &guest.turn).await;
        match heard.map(|(message, room)| (shortened(message), room)) {
            Ok((FromNode::Goodbye { reason }, _)) => return reason,
            Ok((message, room)) => {
                if shared.inputs.send(Input::Said(link, message, room)).await.is_err() {
                    return "the coordinator ends".to_owned();
                }
            }
            Err(error) => return error.to_string(),
        }
    }
}

/// Reasons are kept and shown: what a node says there is cut to a bearable length.
fn shortened(mut message: FromNode) -> FromNode {
    if let FromNode::Prepared { result: Err(reason), .. } | FromNode::Failed { reason, .. } | FromNode::Goodbye { reason } = &mut message {
        reason.truncate(reason.floor_char_boundary(REASON_BYTES));
    }
    message
}

async fn hear_heartbeats(shared: &Shared, link: LinkId, connection: &Connection) -> String {
    let mut last: Option<Instant> = None;
    loop {
        match connection.read_datagram().await {
            Ok(datagram) => {
                if let Err(error) = wire::decode::<Heartbeat>(&datagram) {
                    return error.to_string();
                }
                // A node that beats faster gains nothing by it.
                if last.is_some_and(|last| last.elapsed() < HEARTBEAT_INTERVAL / HEARTBEATS_PER_INTERVAL) {
                    continue;
                }
                last = Some(Instant::now());
                if shared.inputs.send(Input::Heard(link)).await.is_err() {
                    return "the coordinator ends".to_owned();
                }
            }
            Err(error) => return error.to_string(),
        }
    }
}

/// Attempts that a connection hands in at this moment: each comes once.
type Arriving = Arc<Mutex<BTreeSet<(JobId, LeaseId)>>>;

async fn accept_parts(shared: &Shared, (link, incarnation): (LinkId, Incarnation), connection: &Connection) -> String {
    let arriving = Arriving::default();
    loop {
        match connection.accept_uni().await {
            Ok(stream) => {
                let from = Source { link, incarnation, arriving: arriving.clone() };
                drop(tokio::spawn(receive_part(shared.clone(), from, connection.clone(), stream)));
            }
            Err(error) => return error.to_string(),
        }
    }
}

/// Whom a part comes from.
struct Source {
    link: LinkId,
    incarnation: Incarnation,
    arriving: Arriving,
}

async fn receive_part(shared: Shared, from: Source, connection: Connection, mut stream: RecvStream) {
    let link = from.link;
    match read_part(&shared, &from, &mut stream).await {
        Ok((header, Some(bytes))) => drop(shared.inputs.send(Input::Delivered(link, header, bytes)).await),
        Ok((header, None)) => drop(shared.inputs.send(Input::Damaged(link, header.job, header.lease)).await),
        Err(error) => {
            if connection.close_reason().is_none() {
                tracing::warn!(error, "a part could not be taken");
            }
            connection.close(CLOSE_ANEW.into(), error.as_bytes());
        }
    }
}

/// A part's header and, if they are those that it announces, its pixels. Pixels of an attempt that is settled already are not read.
async fn read_part(shared: &Shared, from: &Source, stream: &mut RecvStream) -> Result<(PartHeader, Option<Vec<u8>>), String> {
    let header = timeout(FRAME_PATIENCE, wire::read::<PartHeader>(stream, PART_HEADER_BYTES)).await;
    let header = header.map_err(|_| "a part that came too slowly")?.map_err(|error| error.to_string())?;
    let lease = shared.leases.get(header.job, header.lease);
    let Some(lease) = lease.filter(|lease| lease.frame == header.frame && lease.incarnation == from.incarnation) else {
        // The stream may be stopped: what it holds is not wanted.
        let _ = stream.stop(0_u8.into());
        return Ok((header, Some(Vec::new())));
    };
    let length = lease.rect.area().saturating_mul(lease.aovs.bytes_per_pixel());
    let length = usize::try_from(length).ok().filter(|&length| length <= PART_BYTES).ok_or("a part that is too large")?;
    let attempt = (header.job, header.lease);
    if !from.arriving.lock().unwrap_or_else(PoisonError::into_inner).insert(attempt) {
        return Err("the same part twice at once".to_owned());
    }
    let read = timeout(wire::patience(length as u64), stream.read_to_end(length)).await;
    from.arriving.lock().unwrap_or_else(PoisonError::into_inner).remove(&attempt);
    let bytes = read.map_err(|_| "a part that came too slowly")?.map_err(|error| error.to_string())?;
    let (rect, expected) = (lease.rect, header.hash);
    let check = move || (bytes.len() == length && hash_of_bytes(rect, &bytes) == expected).then_some(bytes);
    if length <= HASHED_AT_ONCE_BYTES {
        return Ok((header, check()));
    }
    let checked = tokio::task::spawn_blocking(check).await.map_err(|error| error.to_string())?;
    Ok((header, checked))
}

async fn serve_assets(shared: &Shared, connection: &Connection) -> String {
    loop {
        match connection.accept_bi().await {
            Ok((send, receive)) => drop(tokio::spawn(serve_asset(shared.clone(), connection.clone(), send, receive))),
            Err(error) => return error.to_string(),
        }
    }
}

async fn serve_asset(shared: Shared, connection: Connection, mut send: SendStream, mut receive: RecvStream) {
    let question = timeout(FRAME_PATIENCE, wire::read(&mut receive, HELLO_BYTES)).await;
    match question.unwrap_or(Err(FrameError::TooSlow)) {
        Ok(NodeStream::Asset(id)) => {
            if let Err(error) = send_asset(&shared, id, &mut send).await {
                tracing::warn!(%error, asset = %id, "an asset could not be sent");
            }
        }
        Ok(NodeStream::Control(_)) => connection.close(CLOSE_ANEW.into(), b"it said hello twice"),
        Err(error) => connection.close(CLOSE_ANEW.into(), error.to_string().as_bytes()),
    }
}

async fn send_asset(shared: &Shared, id: AssetId, send: &mut SendStream) -> std::io::Result<()> {
    match tokio::fs::File::open(shared.store.asset(id)).await {
        Ok(mut file) => {
            send.write_u64_le(file.metadata().await?.len()).await?;
            tokio::io::copy(&mut file, send).await?;
        }
        Err(_) => send.write_u64_le(u64::MAX).await?,
    }
    send.finish().map_err(std::io::Error::other)
}
