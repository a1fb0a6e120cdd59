//! What is done from time to time: looking how much room the disk has, and removing what is kept for nobody.

use tokio::{
    sync::oneshot,
    task::spawn_blocking,
    time::{Instant, interval},
};

use super::{Shared, input::Input, kept::seconds_now, retention::Retention};
use crate::{
    farm::JobId,
    limits::{SPACE_INTERVAL, SWEEP_INTERVAL},
};

/// Keeps house until it is aborted, or nobody listens any more.
pub async fn keep(shared: Shared, retention: Retention) {
    let mut looks = interval(SPACE_INTERVAL);
    let (mut full, mut next) = (false, Instant::now());
    loop {
        looks.tick().await;
        let refusal = look(&shared).await;
        if refusal.is_some() != full {
            full = !full;
            if shared.inputs.send(Input::Space(refusal)).await.is_err() {
                return;
            }
        }
        if shared.inputs.send(Input::Rest).await.is_err() {
            return;
        }
        if Instant::now() >= next {
            sweep(&shared, retention).await;
            next = Instant::now() + SWEEP_INTERVAL;
        }
    }
}

/// Why there is no room for any job, if so.
async fn look(shared: &Shared) -> Option<String> {
    let store = shared.store.clone();
    let (free, refusal) = spawn_blocking(move || (store.free(), store.room_for(0).err())).await.ok()?;
    if let Ok(free) = free {
        shared.metrics.disk_free.set(free);
    }
    refusal
}

/// Removes jobs beyond what is kept, then assets that nobody needs.
async fn sweep(shared: &Shared, retention: Retention) {
    let store = shared.store.clone();
    let surplus = spawn_blocking(move || Ok::<_, std::io::Error>(retention.surplus(&store.kept()?, &store.assets()?, seconds_now()))).await;
    match surplus {
        Ok(Ok(surplus)) => {
            for job in surplus {
                if let Err(reason) = delete(shared, job).await {
                    tracing::warn!(job = job.0, reason, "an old job stays");
                }
            }
        }
        Ok(Err(error)) => tracing::warn!(%error, "old jobs stay"),
        Err(error) => tracing::warn!(%error, "old jobs stay"),
    }
    drop_assets(shared).await;
}

/// Deletes a job, if the core says that it is over.
///
/// # Errors
/// In words, when it is not, or the disk refuses.
pub async fn delete(shared: &Shared, job: JobId) -> Result<(), String> {
    let (reply, answer) = oneshot::channel();
    shared.ask(Input::Delete { job, reply }, answer).await?;
    let store = shared.store.clone();
    let deleted = spawn_blocking(move || store.delete(job)).await.map_err(|error| error.to_string())?;
    deleted.map_err(|error| format!("job {} could not be deleted: {error}", job.0))
}

/// Removes assets that no job needs.
pub async fn drop_assets(shared: &Shared) {
    let store = shared.store.clone();
    match spawn_blocking(move || store.drop_unused_assets()).await {
        Ok(Ok(0)) => {}
        Ok(Ok(bytes)) => tracing::info!(bytes, "assets that no job needs were removed"),
        Ok(Err(error)) => tracing::warn!(%error, "assets that no job needs stay"),
        Err(error) => tracing::warn!(%error, "assets that no job needs stay"),
    }
}
