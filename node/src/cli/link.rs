//! A client's connection to a coordinator, which may go away and come back.

use std::{
    net::{SocketAddr, ToSocketAddrs},
    sync::{Mutex, PoisonError},
    time::Instant,
};

use quinn::{Connection, Endpoint};
use tokio::time::{sleep, timeout};

use super::progress::Progress;
use crate::{
    error::{Error, ExitCode, Result},
    farm::JobId,
    limits::{CONNECT_TIMEOUT, FAREWELL, RETURN_PATIENCE, RETURN_PAUSE, SILENCE_SAID_AFTER},
    wire::{self, Refusal, tls::Identity},
};

/// A connection, and how to make it anew.
pub struct Link {
    endpoint: Endpoint,
    address: String,
    connection: Mutex<Connection>,
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
        Ok(Self { endpoint, address: address.to_owned(), connection: Mutex::new(connection) })
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

    /// Waits for a coordinator that went away, and says so.
    ///
    /// # Errors
    /// When it does not come back for a long time, or refuses who asks: with what can be done for the job then.
    pub async fn restore(&self, job: JobId, error: &Error, progress: &Progress) -> Result<()> {
        progress.say(&format!("{}; waiting for it to come back with job {}", error.message, job.0));
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
                    let help =
                        format!("`tessera watch {0}` follows the job when it is back, and `tessera fetch {0}` brings its files", job.0);
                    return Err(unreachable(&self.address, refusal).with_help(help));
                }
                Err(_) => sleep(RETURN_PAUSE).await,
            }
        }
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
    let (code, what) = if refusal.denied { (ExitCode::Denied, "refused at") } else { (ExitCode::Farm, "cannot reach the coordinator at") };
    Error::new(code, format!("{what} {address}: {}", refusal.message))
        .with_help(refusal.help.unwrap_or("check the address, that the coordinator runs, and that the keys are of its farm"))
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
