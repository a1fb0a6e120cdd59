//! The list of revoked certificates, read again whenever its file changes.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
    time::SystemTime,
};

use tokio::{sync::watch, time::interval};

use crate::{
    error::{Error, ExitCode, Result},
    limits::REVOCATION_INTERVAL,
    wire::tls::Revocations,
};

/// Reads the list; [`follow`] keeps what comes back up to date.
///
/// # Errors
/// When it is there and cannot be read: nobody is let in on a guess.
pub fn open(path: &Path) -> Result<watch::Sender<Arc<Revocations>>> {
    let list = Revocations::read(path).map_err(|error| {
        Error::new(ExitCode::File, format!("the list of revoked certificates: {error}"))
            .with_help("mend that line, and let the coordinator's user read the file")
    })?;
    if !list.is_empty() {
        tracing::info!(entries = list.len(), "certificates are revoked");
    }
    Ok(watch::Sender::new(Arc::new(list)))
}

/// What tells that a file has changed.
type Mark = Option<(SystemTime, u64)>;

fn mark(path: &Path) -> Mark {
    let metadata = fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

/// Reads the list again when it has changed and lies still, for ever: one that is half written may lack what it is to hold, and would let somebody in. A list that has gone, or cannot
/// be read, leaves the last one in force.
pub async fn follow(path: PathBuf, list: watch::Sender<Arc<Revocations>>) {
    let (mut known, mut seen) = (None, None);
    let mut tick = interval(REVOCATION_INTERVAL);
    loop {
        tick.tick().await;
        let now = mark(&path);
        let lies_still = std::mem::replace(&mut seen, now) == now;
        if now == known || !lies_still {
            continue;
        }
        known = now;
        match Revocations::read(&path) {
            Ok(_) if now.is_none() => {
                tracing::error!(path = %path.display(), "the list of revoked certificates is gone: the last one stays in force")
            }
            Ok(read) if read != **list.borrow() => {
                tracing::info!(entries = read.len(), "the list of revoked certificates was read again");
                list.send_replace(Arc::new(read));
            }
            Ok(_) => {}
            Err(error) => tracing::error!(error, "the list of revoked certificates cannot be read: the last one stays in force"),
        }
    }
}
