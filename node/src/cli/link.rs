//! A client's connection to a coordinator, which may go away and come back.

use std::{
    net::{SocketAddr, ToSocketAddrs},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Instant,
};

use quinn::{Connection, Endpoint};
use tokio::time::{sleep, timeout};

use super::progress::Progress;
use crate::{
    error::{Error, ExitCode, Result},
    limits::{CONNECT_TIMEOUT, FAREWELL, RETURN_PATIENCE, RETURN_PAUSE, SILENCE_SAID_AFTER},
    wire::{self, Refusal, tls::Identity},
};

/// A connection, and how to make it anew.
pub struct Link {
    endpoint: Endpoint,
    address: String,
    connection: Mutex<Connection>,
    given_up: AtomicBool,
}

impl Link {
    /// Connects.
    ///
    /// # Errors
    /// When the coordinator cannot be reached, or either side refuses the other's certificate.
    pub async fn new(address: &str, identity: &Identity) -> Result<Self> {
        let refused = |refusal| unreachable(address, refusal);
        let endpoint = wire::client(identity, resolve(address).map_err(|error| refused(Refusal::other(error)))?)?;
        let connection = patiently(address, dial(&endpoint, address)).await.map_err(refused)?;
        Ok(Self { endpoint, address: address.to_owned(), connection: Mutex::new(connection), given_up: AtomicBool::new(false) })
    }

    /// Where the coordinator is.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// The connection, which may have ended.
    pub fn connection(&self) -> Connection {
        self.connection.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// What became of a request that was not answered.
    pub fn lost(&self, error: impl std::fmt::Display) -> Error {
        let refusal = self.connection().close_reason().map_or_else(|| Refusal::other(error.to_string()), |reason| wire::explain(&reason));
        if refusal.denied {
            return unreachable(&self.address, refusal);
        }
        Error::new(ExitCode::Farm, format!("the coordinator at {} is lost: {refusal}", self.address))
    }

    /// Whether the coordinator went away, and not because of who asks.
    pub fn is_down(&self) -> bool {
        self.connection().close_reason().is_some_and(|reason| !wire::explain(&reason).denied)
    }

    /// Waits for a coordinator that went away, and says so, and for what: once. Who has waited in vain does not wait again.
    ///
    /// # Errors
    /// When it does not come back for a long time, or refuses who asks.
    pub async fn restore(&self, what: &str, error: Error, progress: &Progress) -> Result<()> {
        if self.has_given_up() {
            return Err(error);
        }
        progress.say(&format!("{}; waiting for it to come back {what}", error.message));
        let end = Instant::now() + RETURN_PATIENCE;
        loop {
            match dial(&self.endpoint, &self.address).await {
                Ok(connection) => {
                    *self.connection.lock().unwrap_or_else(PoisonError::into_inner) = connection;
                    progress.say(&format!("the coordinator at {} is back", self.address));
                    return Ok(());
                }
                // Where there is help, waiting is none: it is another version now, or does not take this key.
                Err(refusal) if refusal.denied || refusal.help.is_some() || Instant::now() >= end => {
                    self.given_up.store(true, Ordering::Relaxed);
                    return Err(unreachable(&self.address, refusal));
                }
                Err(_) => sleep(RETURN_PAUSE).await,
            }
        }
    }

    /// Whether somebody has waited in vain.
    pub fn has_given_up(&self) -> bool {
        self.given_up.load(Ordering::Relaxed)
    }

    /// Ends the connection.
    pub async fn close(&self) {
        self.connection().close(0_u8.into(), b"");
        let _ = timeout(FAREWELL, self.endpoint.wait_idle()).await;
    }
}

/// Connects, within a time. The address may be another machine's by now.
async fn dial(endpoint: &Endpoint, address: &str) -> Result<Connection, Refusal> {
    let socket = resolve(address).map_err(Refusal::other)?;
    let late = |_| Refusal::other(format!("no answer within {} s", CONNECT_TIMEOUT.as_secs()));
    timeout(CONNECT_TIMEOUT, wire::connect(endpoint, socket)).await.map_err(late)?
}

/// Waits for a connection, and says so where that takes long.
async fn patiently<T>(address: &str, connecting: impl Future<Output = T>) -> T {
    tokio::pin!(connecting);
    tokio::select! {
        done = &mut connecting => return done,
        () = sleep(SILENCE_SAID_AFTER) => {}
    }
    eprintln!("connecting to {address}: no answer yet");
    connecting.await
}

/// No connection, and why.
pub fn unreachable(address: &str, refusal: Refusal) -> Error {
    let (code, what, help) = match refusal.denied {
        true => (ExitCode::Denied, "refused at", "ask who keeps the farm's keys for another one (tessera keys issue)"),
        false => (
            ExitCode::Farm,
            "cannot reach the coordinator at",
            "check the address, that the coordinator runs, and that the keys are of its farm",
        ),
    };
    Error::new(code, format!("{what} {address}: {}", refusal.message)).with_help(refusal.help.unwrap_or(help))
}

/// The address of a host and port.
///
/// # Errors
/// In words, when it has none.
pub fn resolve(address: &str) -> Result<SocketAddr, String> {
    let mut found = address.to_socket_addrs().map_err(|error| match error.kind() {
        std::io::ErrorKind::InvalidInput => "it is not HOST:PORT, such as lead:7143".to_owned(),
        _ => error.to_string(),
    })?;
    found.next().ok_or_else(|| "it has no address".to_owned())
}
