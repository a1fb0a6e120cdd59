//! One connection of a node, seen from the coordinator.

use std::sync::atomic::{AtomicU64, Ordering};

use quinn::{Connection, ConnectionError, RecvStream, SendStream};
use tessera_engine::{
    description::AssetId,
    part::{Counters, RenderedPart},
};
use tokio::{
    io::AsyncWriteExt,
    sync::{mpsc, oneshot},
    time::timeout,
};

use super::{
    Shared,
    gate::Guest,
    input::{Input, LinkId, Outgoing},
};
use crate::{
    limits::{CONNECT_TIMEOUT, CONTROL_BYTES, HELLO_BYTES, PART_BYTES, PART_HEADER_BYTES, PEER_QUEUE},
    wire::{self, CLOSE_ANEW, FromNode, Heartbeat, Hello, NodeStream, PartHeader},
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
            let joined = Input::Joined { link, name: name.clone(), hello, address, outgoing, known };
            if shared.inputs.send(joined).await.is_err() || taken.await.is_err() {
                return;
            }
            let reason = converse(&shared, &guest, link, send, receive, messages).await;
            let left =
                matches!(connection.close_reason(), None | Some(ConnectionError::ApplicationClosed(_) | ConnectionError::LocallyClosed));
            // Nobody is left to hear it when the coordinator itself ends.
            let _ = shared.inputs.send(Input::Gone(link, left.then(|| reason.clone()))).await;
            reason
        }
    };
    tracing::info!(node = name, %address, reason, "a node's connection ended");
    connection.close(CLOSE_ANEW.into(), reason.as_bytes());
}

async fn hello(connection: &Connection) -> Result<(Hello, SendStream, RecvStream), String> {
    let (send, mut receive) = connection.accept_bi().await.map_err(|error| error.to_string())?;
    match wire::read(&mut receive, HELLO_BYTES).await.map_err(|error| error.to_string())? {
        NodeStream::Control(hello) if hello.lanes > 0 => Ok((hello, send, receive)),
        NodeStream::Control(_) => Err("it has no lanes".to_owned()),
        NodeStream::Asset(_) => Err("it did not say hello first".to_owned()),
    }
}

/// Everything on the connection at once; the first thing that ends ends it all, and says why.
async fn converse(
    shared: &Shared,
    guest: &Guest,
    link: LinkId,
    send: SendStream,
    receive: RecvStream,
    messages: mpsc::Receiver<Outgoing>,
) -> String {
    let connection = &guest.connection;
    tokio::select! {
        reason = guest.turned_away() => reason,
        reason = say(send, messages) => reason,
        reason = listen(shared, link, receive) => reason,
        reason = hear_heartbeats(shared, link, connection) => reason,
        reason = accept_parts(shared, link, connection) => reason,
        reason = serve_assets(shared, connection) => reason,
    }
}

/// Writes what waits in one go: a packet holds many messages.
async fn say(mut send: SendStream, mut messages: mpsc::Receiver<Outgoing>) -> String {
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
            return reason;
        }
    }
    "another connection of this node took over".to_owned()
}

async fn listen(shared: &Shared, link: LinkId, mut receive: RecvStream) -> String {
    loop {
        match wire::read(&mut receive, CONTROL_BYTES).await {
            Ok(FromNode::Goodbye { reason }) => return reason,
            Ok(message) => {
                if shared.inputs.send(Input::Said(link, message)).await.is_err() {
                    return "the coordinator ends".to_owned();
                }
            }
            Err(error) => return error.to_string(),
        }
    }
}

async fn hear_heartbeats(shared: &Shared, link: LinkId, connection: &Connection) -> String {
    loop {
        match connection.read_datagram().await {
            Ok(datagram) => {
                if let Err(error) = wire::decode::<Heartbeat>(&datagram) {
                    return error.to_string();
                }
                if shared.inputs.send(Input::Heard(link)).await.is_err() {
                    return "the coordinator ends".to_owned();
                }
            }
            Err(error) => return error.to_string(),
        }
    }
}

async fn accept_parts(shared: &Shared, link: LinkId, connection: &Connection) -> String {
    loop {
        match connection.accept_uni().await {
            Ok(stream) => drop(tokio::spawn(receive_part(shared.clone(), link, connection.clone(), stream))),
            Err(error) => return error.to_string(),
        }
    }
}

async fn receive_part(shared: Shared, link: LinkId, connection: Connection, mut stream: RecvStream) {
    match read_part(&shared, &mut stream).await {
        Ok((header, Some(bytes))) => drop(shared.inputs.send(Input::Delivered(link, header, bytes)).await),
        Ok((header, None)) => drop(shared.inputs.send(Input::Damaged(link, header.job, header.lease)).await),
        Err(error) => {
            tracing::warn!(error, "a part could not be taken");
            connection.close(CLOSE_ANEW.into(), error.as_bytes());
        }
    }
}

/// A part's header and, if they are those that it announces, its pixels. Pixels of an attempt that is settled already are not read.
async fn read_part(shared: &Shared, stream: &mut RecvStream) -> Result<(PartHeader, Option<Vec<u8>>), String> {
    let header: PartHeader = wire::read(stream, PART_HEADER_BYTES).await.map_err(|error| error.to_string())?;
    let Some(lease) = shared.leases.get(header.job, header.lease).filter(|lease| lease.frame == header.frame) else {
        // The stream may be stopped: what it holds is not wanted.
        let _ = stream.stop(0_u8.into());
        return Ok((header, Some(Vec::new())));
    };
    let length = usize::try_from(lease.rect.area() * 12).ok().filter(|&length| length <= PART_BYTES).ok_or("a part that is too large")?;
    let bytes = stream.read_to_end(length).await.map_err(|error| error.to_string())?;
    let rect = lease.rect;
    let expected = header.hash;
    let check = move || {
        let part = RenderedPart::from_bytes(rect, Counters::default(), &bytes).ok()?;
        (part.hash() == expected).then_some(bytes)
    };
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
    match wire::read(&mut receive, HELLO_BYTES).await {
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
