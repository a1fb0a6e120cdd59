//! The coordinator's folder: assets and frames by content id, and each job's description and output files.
//!
//! ```text
//! assets/HEX             an asset, or a frame's description
//! jobs/NUMBER/job        the job's description; the job in short stands beside it (see `kept`)
//! jobs/NUMBER/owner      the name of who submitted it
//! jobs/NUMBER/files/...  its output files
//! ```

use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::Arc,
};

use serde::{Deserialize, Serialize};
use tessera_engine::{description::AssetId, output::write_atomically};
use tokio::{
    io::{AsyncRead, AsyncReadExt, AsyncWriteExt},
    sync::RwLock,
    time::timeout,
};

use super::kept::Card;
use crate::{
    farm::JobId,
    job::JobDescription,
    limits::{ASSET_BYTES, ASSET_LEAST_BYTES, FRAME_PATIENCE, READ_CHUNK_BYTES},
    wire::patience,
};

/// A job as it was taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredJob {
    /// What was submitted.
    pub description: JobDescription,
    /// The frame's description as an asset.
    pub frame: AssetId,
    /// Moment of submission, in seconds since 1970.
    pub submitted: u64,
    /// The frame's hash and the engine's revision of the coordinator that took it: where a later one ends the job on nodes of that build, the picture
    /// is called after those.
    pub image_hash: String,
    /// See [`Self::image_hash`].
    pub revision: u32,
}

/// The folder.
#[derive(Clone, Debug)]
pub struct Store {
    pub(super) folder: PathBuf,
    /// Bytes that stay free.
    reserve: u64,
    /// Held for reading while a job is submitted: from the first look at its assets until it is here itself.
    pub(super) submitting: Arc<RwLock<()>>,
}

impl Store {
    /// Opens the folder, made where it is missing. Jobs for which fewer than `reserve` bytes would stay free are refused.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn open(folder: &Path, reserve: u64) -> io::Result<Self> {
        fs::create_dir_all(folder.join("assets"))?;
        fs::create_dir_all(folder.join("jobs"))?;
        Ok(Self { folder: folder.to_owned(), reserve, submitting: Arc::default() })
    }

    /// Bytes that are free where the folder is.
    ///
    /// # Errors
    /// When the system does not say.
    pub fn free(&self) -> io::Result<u64> {
        let system = rustix::fs::statvfs(&self.folder)?;
        Ok(system.f_bavail.saturating_mul(system.f_frsize))
    }

    /// Whether a frame of so many pixels can be stored and written.
    ///
    /// # Errors
    /// In words, when too little would stay free. A disk that does not say how much is free has room.
    pub fn room_for(&self, bytes: u64) -> Result<(), String> {
        let free = self.free().unwrap_or(u64::MAX);
        // Once as parts, once as a picture; a preview and the manifest are small beside them.
        let needed = bytes.saturating_mul(2);
        if free.saturating_sub(needed) >= self.reserve {
            return Ok(());
        }
        let mega = |bytes: u64| bytes.div_ceil(1 << 20);
        Err(format!(
            "{} MiB are free on the coordinator's disk, where {} must stay free and a frame takes {}: delete old jobs (`tessera list`, `tessera delete`) or \
             make room",
            free >> 20,
            mega(self.reserve),
            mega(needed)
        ))
    }

    /// Where an asset lies, if it is here.
    pub fn asset(&self, id: AssetId) -> PathBuf {
        self.folder.join("assets").join(id.to_string())
    }

    /// Keeps an asset.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn put(&self, bytes: &[u8]) -> io::Result<AssetId> {
        let id = AssetId::of(bytes);
        if !self.asset(id).exists() {
            write_atomically(&self.asset(id), |file| io::Write::write_all(file, bytes)).map_err(io::Error::other)?;
        }
        Ok(id)
    }

    /// Keeps an asset as it comes: its length, which is returned, then its bytes. Memory stays small however long it is.
    ///
    /// # Errors
    /// [`io::ErrorKind::QuotaExceeded`] when it is longer than `left`. When it is longer than any may be or comes too slowly, when its bytes do not
    /// agree with its id, or when the disk refuses.
    pub async fn receive(&self, id: AssetId, stream: &mut (impl AsyncRead + Unpin), left: u64) -> io::Result<u64> {
        let length = timeout(FRAME_PATIENCE, stream.read_u64_le()).await??;
        if length > ASSET_BYTES as u64 {
            return Err(io::Error::other(format!("an asset of {length} bytes where {ASSET_BYTES} are allowed")));
        }
        if length.max(ASSET_LEAST_BYTES) > left {
            return Err(io::ErrorKind::QuotaExceeded.into());
        }
        timeout(patience(length), self.receive_bytes(id, stream, length)).await??;
        Ok(length)
    }

    async fn receive_bytes(&self, id: AssetId, stream: &mut (impl AsyncRead + Unpin), length: u64) -> io::Result<()> {
        let temporary = tempfile::NamedTempFile::new_in(self.folder.join("assets"))?;
        let mut file = tokio::fs::File::from_std(temporary.reopen()?);
        let mut hasher = blake3::Hasher::new();
        let mut chunk = vec![0; READ_CHUNK_BYTES];
        let mut left = length;
        while left > 0 {
            let wanted = usize::try_from(left).unwrap_or(READ_CHUNK_BYTES).min(READ_CHUNK_BYTES);
            let read = stream.read(&mut chunk[..wanted]).await?;
            if read == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            hasher.update(&chunk[..read]);
            file.write_all(&chunk[..read]).await?;
            left -= read as u64;
        }
        file.sync_all().await?;
        if *hasher.finalize().as_bytes() != id.0 {
            return Err(io::Error::other(format!("asset {id} was damaged on its way")));
        }
        temporary.persist(self.asset(id))?;
        Ok(())
    }

    /// A number above those of all jobs that were ever kept here.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn next_job(&self) -> io::Result<JobId> {
        let mut last = self.last_deleted();
        for entry in fs::read_dir(self.folder.join("jobs"))? {
            let number = entry?.file_name().to_str().and_then(|name| name.parse().ok());
            last = last.max(number.unwrap_or(0));
        }
        Ok(JobId(last + 1))
    }

    /// Keeps a job's description.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn put_job(&self, job: JobId, stored: &StoredJob, owner: &str) -> io::Result<()> {
        fs::create_dir_all(self.files(job))?;
        self.put_card(job, &Card::of(stored))?;
        let bytes = postcard::to_stdvec(stored).map_err(io::Error::other)?;
        write_atomically(&self.job(job).join("owner"), |file| io::Write::write_all(file, owner.as_bytes())).map_err(io::Error::other)?;
        write_atomically(&self.job(job).join("job"), |file| io::Write::write_all(file, &bytes)).map_err(io::Error::other)
    }

    /// Who submitted a job, if that is known.
    pub fn owner(&self, job: JobId) -> Option<String> {
        fs::read_to_string(self.job(job).join("owner")).ok()
    }

    /// A job's description.
    ///
    /// # Errors
    /// When it is not here or cannot be read.
    pub fn get_job(&self, job: JobId) -> io::Result<StoredJob> {
        postcard::from_bytes(&fs::read(self.job(job).join("job"))?).map_err(io::Error::other)
    }

    /// The folder of a job's output files.
    pub fn files(&self, job: JobId) -> PathBuf {
        self.job(job).join("files")
    }

    /// The folder of a job.
    pub(super) fn job(&self, job: JobId) -> PathBuf {
        self.folder.join("jobs").join(job.0.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    async fn receive(store: &Store, id: AssetId, bytes: &[u8]) -> io::Result<()> {
        let mut stream = (bytes.len() as u64).to_le_bytes().to_vec();
        stream.extend_from_slice(bytes);
        store.receive(id, &mut stream.as_slice(), u64::MAX).await.map(drop)
    }

    #[tokio::test]
    async fn only_whole_and_true_assets_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), 0).unwrap();
        let bytes = vec![7; 3 * READ_CHUNK_BYTES + 5];
        let id = AssetId::of(&bytes);
        let short = store.receive(id, &mut [&9_u64.to_le_bytes()[..], &[7; 8]].concat().as_slice(), u64::MAX).await;
        assert_eq!(short.unwrap_err().kind(), io::ErrorKind::UnexpectedEof);
        assert!(receive(&store, id, &bytes[1..]).await.unwrap_err().to_string().contains("damaged"));
        let endless = store.receive(id, &mut u64::MAX.to_le_bytes().as_slice(), u64::MAX).await;
        assert!(endless.unwrap_err().to_string().contains("allowed"));
        let above = store.receive(id, &mut 5000_u64.to_le_bytes().as_slice(), 4999).await;
        assert_eq!(above.unwrap_err().kind(), io::ErrorKind::QuotaExceeded, "said before a byte of it is read");
        assert_eq!(fs::read_dir(folder.path().join("assets")).unwrap().count(), 0, "nothing stays of what failed");
        receive(&store, id, &bytes).await.unwrap();
        assert_eq!(fs::read(store.asset(id)).unwrap(), bytes);
    }
}
