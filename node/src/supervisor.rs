//! The service manager, where there is one: what it hands over, and what it is told.

use std::{
    cell::Cell,
    net::TcpListener,
    time::{Duration, Instant},
};

use listenfd::ListenFd;
use sd_notify::NotifyState;

use crate::{
    error::{Error, ExitCode, Result},
    limits::WATCHDOG_FEEDS,
};

/// Says that the service does what it is for.
pub fn ready() {
    let _ = sd_notify::notify(&[NotifyState::Ready]);
}

/// Says that the service ends in order.
pub fn stopping() {
    let _ = sd_notify::notify(&[NotifyState::Stopping]);
}

/// The socket on which the service manager lets this process listen, if it has one for it.
///
/// # Errors
/// When it hands over something other than a TCP socket.
pub fn listener() -> Result<Option<TcpListener>> {
    let wrong = |error: std::io::Error| {
        Error::new(ExitCode::Farm, format!("what the service manager handed over cannot be listened on: {error}"))
            .with_help("its socket unit is to say ListenStream=ADDRESS:PORT, once")
    };
    let listener = ListenFd::from_env().take_tcp_listener(0).map_err(wrong)?;
    listener.map(|listener| listener.set_nonblocking(true).map(|()| listener)).transpose().map_err(wrong)
}

/// The watchdog: a service that does not feed it in time is killed and started anew. Food proves something only where the work goes on, so it is fed
/// from there, and not by a timer.
pub struct Watchdog {
    pause: Option<Duration>,
    fed: Cell<Option<Instant>>,
}

impl Watchdog {
    /// The watchdog of this process; without one, feeding does nothing.
    #[must_use]
    pub fn new() -> Self {
        Self { pause: sd_notify::watchdog_enabled().map(|patience| patience / WATCHDOG_FEEDS), fed: Cell::new(None) }
    }

    /// How often it wants food, if it is there.
    pub fn pause(&self) -> Option<Duration> {
        self.pause
    }

    /// Feeds it. It may be called as often as work goes on; it takes food no oftener than it wants it.
    pub fn feed(&self) {
        let Some(pause) = self.pause else { return };
        if self.fed.get().is_none_or(|fed| fed.elapsed() >= pause) {
            let _ = sd_notify::notify(&[NotifyState::Watchdog]);
            self.fed.set(Some(Instant::now()));
        }
    }
}

impl Default for Watchdog {
    fn default() -> Self {
        Self::new()
    }
}
