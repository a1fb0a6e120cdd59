//! What the coordinator's folder holds of jobs, in short, and how they leave it.
//!
//! ```text
//! jobs/NUMBER/card     the job in short
//! jobs/NUMBER/end      when and how it ended; only once the journal says so on disk
//! jobs/NUMBER.deleted  a job on its way out
//! jobs/last            the highest number that a deleted job had
//! ```

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    path::{Path, PathBuf},
    time::{SystemTime, UNIX_EPOCH},
};

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use tessera_engine::{description::AssetId, output::write_atomically};

use super::{
    status,
    store::{Store, StoredJob},
};
use crate::{
    farm::{JobId, JobSnapshot},
    wire::JobState,
};

/// What lists and the sweep need to know of a job: its description may be large.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Card {
    /// Its name.
    pub name: String,
    /// Moment of submission, in seconds since 1970.
    pub submitted: u64,
    /// Columns and rows of its frame.
    pub size: (u32, u32),
    /// Assets that it needs, its frame's description among them.
    pub assets: BTreeSet<AssetId>,
}

impl Card {
    /// Of a job as it was taken.
    pub fn of(job: &StoredJob) -> Self {
        let film = &job.description.frame.film;
        Self {
            name: job.description.name.clone(),
            submitted: job.submitted,
            size: (film.width, film.height),
            assets: job.description.assets.iter().copied().chain([job.frame]).collect(),
        }
    }
}

/// When a job ended, in seconds since 1970, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// When.
    pub at: u64,
    /// How.
    pub state: JobState,
}

impl End {
    /// It ends now.
    pub fn now(state: JobState) -> Self {
        Self { at: seconds_now(), state }
    }
}

/// Seconds since 1970.
pub fn seconds_now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs()
}

/// A job in the folder.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    /// The job.
    pub job: JobId,
    /// The job in short.
    pub card: Card,
    /// How it ended, if it did.
    pub end: Option<End>,
    /// Bytes of its files and its description.
    pub bytes: u64,
}

impl Store {
    /// Numbers of all jobs that are here, in their order.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn numbers(&self) -> io::Result<Vec<JobId>> {
        let mut numbers = Vec::new();
        for entry in fs::read_dir(self.jobs())? {
            numbers.extend(entry?.file_name().to_str().and_then(|name| name.parse().ok()).map(JobId));
        }
        numbers.sort_unstable();
        Ok(numbers)
    }

    /// All jobs that are here whole.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn kept(&self) -> io::Result<Vec<Kept>> {
        let kept = |job| Some(Kept { job, card: self.card(job).ok()?, end: self.end(job).ok(), bytes: bytes_below(&self.job(job)) });
        Ok(self.numbers()?.into_iter().filter_map(kept).collect())
    }

    /// A job in short.
    ///
    /// # Errors
    /// When it is not here, or cannot be read.
    pub fn card(&self, job: JobId) -> io::Result<Card> {
        read(&self.job(job).join("card"))
    }

    /// How a job ended.
    ///
    /// # Errors
    /// When it has not, or that cannot be read.
    pub fn end(&self, job: JobId) -> io::Result<End> {
        read(&self.job(job).join("end"))
    }

    /// Keeps a job in short.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn put_card(&self, job: JobId, card: &Card) -> io::Result<()> {
        write(&self.job(job).join("card"), card)
    }

    /// Keeps how a job ended. From now on it may be deleted, so its end must be in the journal, on disk.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn put_end(&self, job: JobId, end: &End) -> io::Result<()> {
        write(&self.job(job).join("end"), end)
    }

    /// Deletes a job that is over. Its number never comes again. Assets are left to [`Self::drop_unused_assets`].
    ///
    /// # Errors
    /// When the disk refuses; the rest goes with the next start.
    pub fn delete(&self, job: JobId) -> io::Result<()> {
        let last = self.last_deleted().max(job.0);
        write_atomically(&self.jobs().join("last"), |file| io::Write::write_all(file, last.to_string().as_bytes()))
            .map_err(io::Error::other)?;
        let out = self.jobs().join(format!("{}.deleted", job.0));
        fs::rename(self.job(job), &out)?;
        fs::remove_dir_all(out)
    }

    /// The highest number that a deleted job had.
    pub fn last_deleted(&self) -> u64 {
        fs::read_to_string(self.jobs().join("last")).ok().and_then(|text| text.trim().parse().ok()).unwrap_or(0)
    }

    /// Sizes of all assets that are here.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn assets(&self) -> io::Result<BTreeMap<String, u64>> {
        let mut assets = BTreeMap::new();
        for entry in fs::read_dir(self.asset_folder())? {
            let entry = entry?;
            assets.insert(entry.file_name().to_string_lossy().into_owned(), entry.metadata()?.len());
        }
        Ok(assets)
    }

    /// Removes assets that no job needs, and what broken transfers left; says how many bytes that were. While a job is submitted nothing is removed:
    /// its assets may be here already, and it is not yet. Nor is anything where a job cannot be read.
    ///
    /// # Errors
    /// When the disk refuses, or a job cannot be read.
    pub fn drop_unused_assets(&self) -> io::Result<u64> {
        let Ok(_alone) = self.submitting.try_write() else { return Ok(0) };
        let mut needed = BTreeSet::new();
        for job in self.numbers()? {
            let card = match self.card(job) {
                Ok(card) => card,
                Err(_) if !self.job(job).exists() => continue, // deleted meanwhile
                Err(error) => return Err(io::Error::other(format!("job {} cannot be read: {error}", job.0))),
            };
            needed.extend(card.assets.iter().map(AssetId::to_string));
        }
        let mut bytes = 0;
        for (name, length) in self.assets()?.into_iter().filter(|(name, _)| !needed.contains(name)) {
            fs::remove_file(self.asset_folder().join(name))?;
            bytes += length;
        }
        Ok(bytes)
    }

    /// After a start: jobs that left half-way go, and those that are over, as the farm says, get their end if it did not reach the disk.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn settle(&self, farm: &[JobSnapshot]) -> io::Result<()> {
        for entry in fs::read_dir(self.jobs())? {
            let path = entry?.path();
            if path.extension().is_some_and(|ending| ending == "deleted") {
                fs::remove_dir_all(path)?;
            }
        }
        for job in self.numbers()? {
            let known = farm.iter().find(|known| known.id == job);
            let open = known.is_some_and(|known| known.outcome.is_none());
            match (self.card(job), self.get_job(job)) {
                (Ok(_), _) => {}
                (Err(_), Ok(stored)) => self.put_card(job, &Card::of(&stored))?,
                (Err(_), Err(_)) if open => continue,
                // It was never there whole, so nobody was told its number.
                (Err(_), Err(_)) => {
                    self.delete(job)?;
                    continue;
                }
            }
            if !open && self.end(job).is_err() {
                self.put_end(job, &End::now(known.map_or_else(|| self.presumed(job), status::state_of)))?;
            }
        }
        Ok(())
    }

    /// How a job ended of which the farm knows nothing.
    fn presumed(&self, job: JobId) -> JobState {
        if fs::read_dir(self.files(job)).is_ok_and(|mut files| files.next().is_some()) {
            JobState::Finished
        } else {
            JobState::Failed("the coordinator ended before it had taken the job".to_owned())
        }
    }
}

fn read<T: DeserializeOwned>(path: &Path) -> io::Result<T> {
    postcard::from_bytes(&fs::read(path)?).map_err(io::Error::other)
}

fn write<T: Serialize>(path: &Path, value: &T) -> io::Result<()> {
    let bytes = postcard::to_stdvec(value).map_err(io::Error::other)?;
    write_atomically(path, |file| io::Write::write_all(file, &bytes)).map_err(io::Error::other)
}

/// Bytes of all files below a folder, as far as it can be read.
fn bytes_below(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|entry| match entry.metadata() {
            Ok(metadata) if metadata.is_dir() => bytes_below(&entry.path()),
            Ok(metadata) => metadata.len(),
            Err(_) => 0,
        })
        .sum()
}

/// Where the jobs and the assets are.
impl Store {
    fn jobs(&self) -> PathBuf {
        self.folder.join("jobs")
    }

    fn asset_folder(&self) -> PathBuf {
        self.folder.join("assets")
    }
}

#[cfg(test)]
mod tests {
    use std::{sync::Arc, thread};

    use super::*;

    fn card(assets: &[AssetId]) -> Card {
        Card { name: "job".into(), submitted: 5, size: (4, 3), assets: assets.iter().copied().collect() }
    }

    /// A job as far as the folder's own rules go.
    fn put(store: &Store, job: u64, assets: &[AssetId]) {
        fs::create_dir_all(store.files(JobId(job))).unwrap();
        store.put_card(JobId(job), &card(assets)).unwrap();
    }

    fn has(store: &Store, asset: AssetId) -> bool {
        store.asset(asset).exists()
    }

    #[test]
    fn an_asset_goes_with_the_last_job_that_needs_it() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), 0).unwrap();
        let [shared, own, stray] = [&b"shared"[..], b"own", b"stray"].map(|bytes| store.put(bytes).unwrap());
        put(&store, 1, &[shared, own]);
        put(&store, 2, &[shared]);
        fs::write(folder.path().join("assets/.tmpXYZ"), "half an asset").unwrap();
        assert_eq!(store.drop_unused_assets().unwrap(), 5 + 13);
        assert!(has(&store, shared) && has(&store, own) && !has(&store, stray));
        store.delete(JobId(1)).unwrap();
        assert_eq!(store.drop_unused_assets().unwrap(), 3);
        assert!(has(&store, shared) && !has(&store, own));
        store.delete(JobId(2)).unwrap();
        store.drop_unused_assets().unwrap();
        assert!(store.assets().unwrap().is_empty());
        assert_eq!(store.next_job().unwrap(), JobId(3), "a number comes once");
    }

    #[test]
    fn where_a_job_cannot_be_read_no_asset_goes() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), 0).unwrap();
        let asset = store.put(b"asset").unwrap();
        put(&store, 1, &[asset]);
        let path = folder.path().join("jobs/1/card");
        let whole = fs::read(&path).unwrap();
        for length in 0..whole.len() {
            fs::write(&path, &whole[..length]).unwrap();
            assert!(store.drop_unused_assets().unwrap_err().to_string().contains("job 1"), "cut at {length}");
            assert!(has(&store, asset));
        }
    }

    /// Jobs come and go while the sweep runs: none of those that stay ever lacks an asset, although all share some.
    #[test]
    fn a_sweep_never_takes_what_a_job_needs_that_comes_meanwhile() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), 0).unwrap();
        let submit = |store: &Store, job: u64| {
            let _taking = store.submitting.blocking_read();
            // What is here already is not sent again.
            let assets: Vec<AssetId> = (0..3).map(|i| store.put(format!("asset {}", (job + i) % 5).as_bytes()).unwrap()).collect();
            thread::yield_now();
            assert!(assets.iter().all(|asset| has(store, *asset)), "an asset went while job {job} was submitted");
            put(store, job, &assets);
            assets
        };
        let done = Arc::new(std::sync::atomic::AtomicBool::new(false));
        let sweeper = {
            let (store, done) = (store.clone(), done.clone());
            thread::spawn(move || {
                let mut swept = 0;
                while !done.load(std::sync::atomic::Ordering::Relaxed) {
                    swept += store.drop_unused_assets().unwrap();
                }
                swept
            })
        };
        let workers: Vec<_> = (0..3)
            .map(|worker| {
                let store = store.clone();
                thread::spawn(move || {
                    for turn in 0..30 {
                        let job = 1 + worker + 3 * turn;
                        let assets = submit(&store, job);
                        thread::yield_now();
                        assert!(assets.iter().all(|asset| has(&store, *asset)), "job {job} lacks an asset");
                        store.put_end(JobId(job), &End::now(JobState::Finished)).unwrap();
                        store.delete(JobId(job)).unwrap();
                    }
                })
            })
            .collect();
        workers.into_iter().for_each(|worker| worker.join().unwrap());
        done.store(true, std::sync::atomic::Ordering::Relaxed);
        sweeper.join().unwrap();
        store.drop_unused_assets().unwrap();
        assert!(store.assets().unwrap().is_empty());
    }

    #[test]
    fn a_start_puts_in_order_what_a_crash_left() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), 0).unwrap();
        put(&store, 1, &[]); // over, but its end is not on disk
        put(&store, 2, &[]); // still open
        put(&store, 3, &[]); // its files stand, and the farm knows nothing of it
        fs::write(store.files(JobId(3)).join("job.exr"), "picture").unwrap();
        fs::create_dir_all(store.files(JobId(4))).unwrap(); // never taken whole
        fs::create_dir_all(folder.path().join("jobs/5.deleted/files")).unwrap(); // on its way out
        let snapshot = |id, outcome| JobSnapshot {
            id: JobId(id),
            name: "job".into(),
            owner: "someone".into(),
            priority: 0,
            paused: false,
            phase: crate::farm::JobPhase::Waiting,
            outcome,
            parts: 0,
            committed: 0,
            progress: 0.0,
            seconds: 0.0,
        };
        let cancelled = crate::farm::Outcome::Cancelled { reason: "by me".into() };
        store.settle(&[snapshot(1, Some(cancelled)), snapshot(2, None)]).unwrap();
        assert_eq!(store.numbers().unwrap(), [JobId(1), JobId(2), JobId(3)]);
        assert_eq!(store.end(JobId(1)).unwrap().state, JobState::Cancelled("by me".into()));
        assert!(store.end(JobId(2)).is_err());
        assert_eq!(store.end(JobId(3)).unwrap().state, JobState::Finished);
        assert!(!folder.path().join("jobs/5.deleted").exists());
        assert_eq!(store.next_job().unwrap(), JobId(5));
    }
}
