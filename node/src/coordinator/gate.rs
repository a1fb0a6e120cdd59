//! Who is let in, and how many at once. Nothing is read from a peer before it is through here.

use std::{
    collections::BTreeMap,
    net::SocketAddr,
    sync::{Arc, Mutex, PoisonError},
    time::{Instant, SystemTime},
};

use quinn::{Connection, Incoming, crypto::rustls::HandshakeData};
use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore, watch},
    time::{sleep, timeout},
};

use crate::{
    limits::{
        CLIENT_WINDOW_BYTES, CONNECT_TIMEOUT, CONNECTIONS, CONNECTIONS_PER_CLIENT, CONNECTIONS_PER_NODE, HANDSHAKES, RECEIVE_WINDOW_BYTES,
        REFUSAL_LOG_INTERVAL, REFUSALS_LOGGED, REQUESTS_PER_CLIENT, STREAMS_PER_PEER,
    },
    throttle::Throttle,
    web::Metrics,
    wire::{
        CLOSE_DENIED, JOIN_ALPN, explain_peer, peer_certificate,
        tls::{Certificate, Peer, Revocations, Role},
    },
};

/// The gate of a coordinator.
#[derive(Clone)]
pub struct Gate {
    handshakes: Arc<Semaphore>,
    inside: Arc<Mutex<Inside>>,
    refusals: Arc<Throttle>,
    metrics: Arc<Metrics>,
    revoked: watch::Receiver<Arc<Revocations>>,
}

/// Who got through.
pub enum Admitted {
    /// A peer with a certificate.
    Guest(Guest),
    /// Someone who wants a key certified.
    Joiner(Joiner),
}

/// Someone who wants a key certified, and may say nothing else.
pub struct Joiner {
    /// The way to it.
    pub connection: Connection,
    /// Where it is.
    pub address: SocketAddr,
    /// What it proved, if anything.
    pub certificate: Option<Certificate>,
}

/// Connections of those who were let in.
#[derive(Default)]
struct Inside {
    all: usize,
    by_peer: BTreeMap<Peer, Place>,
}

/// Connections of one peer.
struct Place {
    connections: usize,
    turn: Arc<Semaphore>,
}

/// A peer that was let in, for as long as this lives.
pub struct Guest {
    /// The way to it.
    pub connection: Connection,
    /// Where it is.
    pub address: SocketAddr,
    /// What it proved.
    pub certificate: Certificate,
    /// Taken by what the peer may do one at a time over all its connections: large frames, and submissions.
    pub turn: Arc<Semaphore>,
    inside: Arc<Mutex<Inside>>,
    revoked: watch::Receiver<Arc<Revocations>>,
}

impl Guest {
    /// Who it is.
    pub fn peer(&self) -> &Peer {
        &self.certificate.peer
    }

    /// Makes room for all that a node sends.
    pub fn open_wide(&self) {
        self.connection.set_receive_window(RECEIVE_WINDOW_BYTES.into());
        self.connection.set_max_concurrent_bi_streams(STREAMS_PER_PEER.into());
        self.connection.set_max_concurrent_uni_streams(STREAMS_PER_PEER.into());
    }

    /// Waits until it is no longer welcome, closes its connection, and says why.
    pub async fn turned_away(&self) -> String {
        let mut revoked = self.revoked.clone();
        let reason = loop {
            if let Some(reason) = revoked.borrow_and_update().refuse(&self.certificate) {
                break reason;
            }
            let left = self.certificate.expires.duration_since(SystemTime::now()).unwrap_or_default();
            tokio::select! {
                changed = revoked.changed() => if changed.is_err() { std::future::pending::<()>().await },
                () = sleep(left) => break format!("the certificate of {} expired", self.peer()),
            }
        };
        tracing::warn!(peer = %self.peer(), address = %self.address, reason, "a peer is sent away");
        self.connection.close(CLOSE_DENIED.into(), reason.as_bytes());
        reason
    }
}

impl Drop for Guest {
    fn drop(&mut self) {
        let mut inside = self.inside.lock().unwrap_or_else(PoisonError::into_inner);
        inside.all = inside.all.saturating_sub(1);
        if let Some(place) = inside.by_peer.get_mut(&self.certificate.peer) {
            place.connections = place.connections.saturating_sub(1);
            if place.connections == 0 {
                inside.by_peer.remove(&self.certificate.peer);
            }
        }
    }
}

impl Gate {
    /// A gate that nobody has passed yet, closed to whom this list names.
    pub fn new(metrics: Arc<Metrics>, revoked: watch::Receiver<Arc<Revocations>>) -> Self {
        Self {
            handshakes: Arc::new(Semaphore::new(HANDSHAKES)),
            inside: Arc::default(),
            refusals: Arc::new(Throttle::new(REFUSALS_LOGGED, REFUSAL_LOG_INTERVAL)),
            metrics,
            revoked,
        }
    }

    /// Room for one handshake. Whoever finds none is sent away before anything is spent on it.
    pub fn room(&self, incoming: Incoming) -> Option<(Incoming, OwnedSemaphorePermit)> {
        match self.handshakes.clone().try_acquire_owned() {
            Ok(permit) => Some((incoming, permit)),
            Err(_) => {
                let address = incoming.remote_address();
                incoming.refuse();
                self.refused(address, "too many handshakes at once")
            }
        }
    }

    /// What the list of revoked certificates says now.
    pub fn revoked(&self) -> Arc<Revocations> {
        self.revoked.borrow().clone()
    }

    /// Lets a peer in, if its certificate is one of this farm and there is room for it.
    pub async fn admit(&self, incoming: Incoming, room: OwnedSemaphorePermit) -> Option<Admitted> {
        let address = incoming.remote_address();
        let connection = match timeout(CONNECT_TIMEOUT, incoming).await {
            Ok(Ok(connection)) => connection,
            Ok(Err(error)) => return self.refused(address, &explain_peer(&error)),
            Err(_) => return self.refused(address, "its handshake took too long"),
        };
        drop(room);
        let admitted = match peer_certificate(&connection) {
            None if joins(&connection) => Ok(Admitted::Joiner(Joiner { connection: connection.clone(), address, certificate: None })),
            None => Err("it has no certificate".to_owned()),
            Some(certificate) => certificate.and_then(|certificate| self.enter(&connection, address, certificate)),
        };
        match admitted {
            Ok(admitted) => Some(admitted),
            Err(reason) => {
                connection.close(CLOSE_DENIED.into(), reason.as_bytes());
                self.refused(address, &reason)
            }
        }
    }

    fn enter(&self, connection: &Connection, address: SocketAddr, certificate: Certificate) -> Result<Admitted, String> {
        let soon = certificate.check_time(SystemTime::now())?;
        if let Some(reason) = self.revoked().refuse(&certificate) {
            return Err(reason);
        }
        if joins(connection) {
            return Ok(Admitted::Joiner(Joiner { connection: connection.clone(), address, certificate: Some(certificate) }));
        }
        let peer = certificate.peer.clone();
        let allowed = match peer.role {
            Role::Coordinator => return Err("a coordinator cannot connect to a coordinator".to_owned()),
            Role::Node => CONNECTIONS_PER_NODE,
            Role::Submitter | Role::Observer | Role::Operator => {
                connection.set_receive_window(CLIENT_WINDOW_BYTES.into());
                connection.set_send_window(CLIENT_WINDOW_BYTES.into());
                connection.set_max_concurrent_bi_streams(REQUESTS_PER_CLIENT.into());
                CONNECTIONS_PER_CLIENT
            }
        };
        let mut inside = self.inside.lock().unwrap_or_else(PoisonError::into_inner);
        if inside.all >= CONNECTIONS {
            return Err(format!("there are {CONNECTIONS} connections already"));
        }
        let place = inside.by_peer.entry(peer.clone()).or_insert_with(|| Place { connections: 0, turn: Arc::new(Semaphore::new(1)) });
        if place.connections >= allowed {
            return Err(format!("{peer} has {allowed} connections already"));
        }
        place.connections += 1;
        let turn = place.turn.clone();
        inside.all += 1;
        if let Some(warning) = soon.filter(|_| self.refusals.pass(Instant::now()).is_some()) {
            tracing::warn!(%address, warning, "renew it: tessera keys renew");
        }
        let (inside, revoked) = (self.inside.clone(), self.revoked.clone());
        Ok(Admitted::Guest(Guest { connection: connection.clone(), address, certificate, turn, inside, revoked }))
    }

    /// Notes a refusal: a flood of them must not drown what else is to be said.
    pub fn refused<T>(&self, address: SocketAddr, reason: &str) -> Option<T> {
        self.metrics.refused_peers.inc();
        match self.refusals.pass(Instant::now()) {
            Some(0) => tracing::warn!(%address, reason, "a peer was refused"),
            Some(more) => tracing::warn!(%address, reason, more, "a peer was refused, and others that are not listed"),
            None => {}
        }
        None
    }
}

/// Whether a peer speaks the protocol of those who want a key certified.
fn joins(connection: &Connection) -> bool {
    let data = connection.handshake_data().and_then(|data| data.downcast::<HandshakeData>().ok());
    data.and_then(|data| data.protocol).is_some_and(|protocol| protocol == JOIN_ALPN)
}
