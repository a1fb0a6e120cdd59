//! Who is let in, and how many at once. Nothing is read from a peer before it is through here.

use std::{
    collections::BTreeMap,
    net::SocketAddr,
    sync::{Arc, Mutex, PoisonError},
    time::{Instant, SystemTime},
};

use quinn::{Connection, Incoming};
use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore},
    time::timeout,
};

use crate::{
    limits::{
        CLIENT_WINDOW_BYTES, CONNECT_TIMEOUT, CONNECTIONS, CONNECTIONS_PER_CLIENT, CONNECTIONS_PER_NODE, HANDSHAKES, REFUSAL_LOG_INTERVAL,
        REFUSALS_LOGGED,
    },
    throttle::Throttle,
    web::Metrics,
    wire::{
        CLOSE_DENIED, explain_peer, peer_certificate,
        tls::{Certificate, Peer, Role},
    },
};

/// The gate of a coordinator.
#[derive(Clone)]
pub struct Gate {
    handshakes: Arc<Semaphore>,
    inside: Arc<Mutex<Inside>>,
    refusals: Arc<Throttle>,
    metrics: Arc<Metrics>,
}

/// Connections of those who were let in.
#[derive(Default)]
struct Inside {
    all: usize,
    by_peer: BTreeMap<Peer, usize>,
}

/// A peer that was let in, for as long as this lives.
pub struct Guest {
    /// The way to it.
    pub connection: Connection,
    /// Where it is.
    pub address: SocketAddr,
    /// What it proved.
    pub certificate: Certificate,
    inside: Arc<Mutex<Inside>>,
}

impl Guest {
    /// Who it is.
    pub fn peer(&self) -> &Peer {
        &self.certificate.peer
    }
}

impl Drop for Guest {
    fn drop(&mut self) {
        let mut inside = self.inside.lock().unwrap_or_else(PoisonError::into_inner);
        inside.all = inside.all.saturating_sub(1);
        if let Some(count) = inside.by_peer.get_mut(&self.certificate.peer) {
            *count = count.saturating_sub(1);
        }
        inside.by_peer.retain(|_, count| *count > 0);
    }
}

impl Gate {
    /// A gate that nobody has passed yet.
    pub fn new(metrics: Arc<Metrics>) -> Self {
        Self {
            handshakes: Arc::new(Semaphore::new(HANDSHAKES)),
            inside: Arc::default(),
            refusals: Arc::new(Throttle::new(REFUSALS_LOGGED, REFUSAL_LOG_INTERVAL)),
            metrics,
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

    /// Lets a peer in, if its certificate is one of this farm and there is room for it.
    pub async fn admit(&self, incoming: Incoming, room: OwnedSemaphorePermit) -> Option<Guest> {
        let address = incoming.remote_address();
        let connection = match timeout(CONNECT_TIMEOUT, incoming).await {
            Ok(Ok(connection)) => connection,
            Ok(Err(error)) => return self.refused(address, &explain_peer(&error)),
            Err(_) => return self.refused(address, "its handshake took too long"),
        };
        drop(room);
        let certificate = peer_certificate(&connection).unwrap_or_else(|| Err("it has no certificate".to_owned()));
        match certificate.and_then(|certificate| self.enter(&connection, address, certificate)) {
            Ok(guest) => Some(guest),
            Err(reason) => {
                connection.close(CLOSE_DENIED.into(), reason.as_bytes());
                self.refused(address, &reason)
            }
        }
    }

    fn enter(&self, connection: &Connection, address: SocketAddr, certificate: Certificate) -> Result<Guest, String> {
        let soon = certificate.check_time(SystemTime::now())?;
        let peer = certificate.peer.clone();
        let allowed = match peer.role {
            Role::Coordinator => return Err("a coordinator cannot connect to a coordinator".to_owned()),
            Role::Node => CONNECTIONS_PER_NODE,
            Role::Submitter | Role::Observer | Role::Operator => {
                connection.set_receive_window(CLIENT_WINDOW_BYTES.into());
                connection.set_send_window(CLIENT_WINDOW_BYTES.into());
                CONNECTIONS_PER_CLIENT
            }
        };
        let mut inside = self.inside.lock().unwrap_or_else(PoisonError::into_inner);
        if inside.all >= CONNECTIONS {
            return Err(format!("there are {CONNECTIONS} connections already"));
        }
        let count = inside.by_peer.entry(peer.clone()).or_default();
        if *count >= allowed {
            return Err(format!("{peer} has {allowed} connections already"));
        }
        *count += 1;
        inside.all += 1;
        if let Some(warning) = soon.filter(|_| self.refusals.pass(Instant::now()).is_some()) {
            tracing::warn!(%address, warning, "renew it: tessera keys renew");
        }
        Ok(Guest { connection: connection.clone(), address, certificate, inside: self.inside.clone() })
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
