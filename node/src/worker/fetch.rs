//! Fetching a frame with its assets, each once, and compiling it on a lane.

use std::{collections::BTreeMap, sync::Arc};

use quinn::Connection;
use tessera_engine::{
    description::{AssetId, AssetSource, Frame},
    part,
    scene::Scene,
};
use tokio::{io::AsyncReadExt, sync::mpsc, task::spawn_blocking};

use super::{cache::Cache, lanes::Lanes, life::Done};
use crate::{
    farm::JobId,
    limits::{ASSET_BYTES, HELLO_BYTES},
    wire::{self, NodeStream},
};

/// The assets of one job.
#[derive(Default)]
struct Assets(BTreeMap<AssetId, Arc<[u8]>>);

impl AssetSource for Assets {
    fn bytes(&self, id: AssetId) -> Option<Arc<[u8]>> {
        self.0.get(&id).cloned()
    }
}

/// What fetching needs.
#[derive(Clone)]
pub struct Fetcher {
    /// Whom to ask.
    pub connection: Connection,
    /// Where to look first.
    pub cache: Cache,
    /// Who compiles.
    pub lanes: Lanes,
    /// Where the result goes.
    pub done: mpsc::UnboundedSender<Done>,
}

impl Fetcher {
    /// Fetches what is missing and compiles; says [`Done::Compiled`] in the end.
    pub async fn prepare(self, job: JobId, frame: AssetId, ids: Vec<AssetId>) {
        let compiled = move |result| Done::Compiled(job, frame, result);
        match self.fetch_all(frame, ids).await {
            Ok((description, assets)) => {
                let done = self.done;
                let compile =
                    move || Scene::compile(&description, &assets).map(part::prepared).map(Arc::new).map_err(|error| error.to_string());
                self.lanes.add_first(self.lanes.shared(compile), move |result| drop(done.send(compiled(result.and_then(|result| result)))));
            }
            Err(error) => drop(self.done.send(compiled(Err(error)))),
        }
    }

    async fn fetch_all(&self, frame: AssetId, ids: Vec<AssetId>) -> Result<(Frame, Assets), String> {
        let description = wire::decode(&self.fetch(frame).await?).map_err(|error| format!("the frame's description: {error}"))?;
        let mut assets = Assets::default();
        for id in ids {
            assets.0.insert(id, self.fetch(id).await?);
        }
        Ok((description, assets))
    }

    async fn fetch(&self, id: AssetId) -> Result<Arc<[u8]>, String> {
        let cache = self.cache.clone();
        if let Some(bytes) = spawn_blocking(move || cache.get(id)).await.map_err(|error| error.to_string())? {
            return Ok(bytes);
        }
        let bytes = self.download(id).await.map_err(|error| format!("asset {id}: {error}"))?;
        let cache = self.cache.clone();
        let check = move || {
            let bytes: Arc<[u8]> = bytes.into();
            let intact = AssetId::of(&bytes) == id;
            intact.then(|| cache.put(id, &bytes)).map(|()| bytes)
        };
        spawn_blocking(check).await.map_err(|error| error.to_string())?.ok_or_else(|| format!("asset {id}: damaged on its way"))
    }

    async fn download(&self, id: AssetId) -> Result<Vec<u8>, String> {
        let (mut send, mut receive) = self.connection.open_bi().await.map_err(|error| error.to_string())?;
        wire::write(&mut send, &NodeStream::Asset(id), HELLO_BYTES).await.map_err(|error| error.to_string())?;
        let length = receive.read_u64_le().await.map_err(|error| error.to_string())?;
        if length == u64::MAX {
            return Err("the coordinator does not have it".to_owned());
        }
        wire::read_exactly(&mut receive, length, ASSET_BYTES).await.map_err(|error| error.to_string())
    }
}
