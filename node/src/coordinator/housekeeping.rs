//! What is done from time to time: looking how much room the disk has.

use tokio::{task::spawn_blocking, time::interval};

use super::{Shared, input::Input};
use crate::limits::SPACE_INTERVAL;

/// Keeps house until it is aborted, or nobody listens any more.
pub async fn keep(shared: Shared) {
    let mut looks = interval(SPACE_INTERVAL);
    let mut said = None;
    loop {
        looks.tick().await;
        let refusal = look(&shared).await;
        if refusal != said {
            said.clone_from(&refusal);
            if shared.inputs.send(Input::Space(refusal)).await.is_err() {
                return;
            }
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
