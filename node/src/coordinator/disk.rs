//! The journal's thread: events and pixels reach the disk in batches, so that no wait for it holds the core up.

use std::{
    path::Path,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        mpsc::{self, Receiver, Sender},
    },
    thread,
    time::Duration,
};

use tokio::sync::mpsc::Sender as InputSender;

use super::input::Input;
use crate::{
    error::{Error, ExitCode, Result},
    farm::{Event, Farm, FarmConfig, JobId, LeaseId},
    journal::{Filter, Journal},
    limits::{DISK_RETRY, JOURNAL_BATCH},
    schedule::PartId,
};

/// What the thread does, in this order.
enum Deed {
    Note(Vec<(Duration, Event)>),
    Store(JobId, PartId, LeaseId, Vec<u8>),
    Then(Box<dyn FnOnce() + Send>),
    Forget(JobId),
}

/// The way to the journal. What waits there is bounded by what was handed out: pixels of the running job, and the events around them.
pub struct Disk {
    deeds: Sender<Deed>,
    filter: Filter,
    /// For reading pixels back.
    pub pixels: Pixels,
}

/// Pixels that are on disk.
#[derive(Clone)]
pub struct Pixels(Arc<Mutex<Journal>>);

impl Pixels {
    fn lock(&self) -> MutexGuard<'_, Journal> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The pixels of an attempt, as they were stored.
    ///
    /// # Errors
    /// When they are not there any more, or were changed.
    pub fn read(&self, job: JobId, lease: LeaseId) -> Result<Vec<u8>> {
        self.lock().read_pixels(job, lease)
    }

    /// Attempts of a job whose pixels are on disk.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn stored(&self, job: JobId) -> Result<Vec<LeaseId>> {
        Ok(self.lock().stored(job)?.into_iter().map(|(lease, _)| lease).collect())
    }
}

impl Disk {
    /// Opens the journal and starts its thread; returns the farm as the journal remembers it. [`Event::Committed`] goes to `inputs`.
    ///
    /// # Errors
    /// When the journal cannot be read, or another process holds it.
    pub fn open(folder: &Path, config: FarmConfig, inputs: InputSender<Input>) -> Result<(Self, Farm)> {
        let (journal, recovered) = Journal::open(&folder.join("journal"), config)?;
        if recovered.events > 0 {
            tracing::info!(events = recovered.events, "the journal was replayed");
        }
        let pixels = Pixels(Arc::new(Mutex::new(journal)));
        let (deeds, received) = mpsc::channel();
        let thread = Writer { pixels: pixels.clone(), inputs };
        let started = thread::Builder::new().name("journal".to_owned()).spawn(move || thread.run(&received));
        started.map_err(|error| Error::new(ExitCode::Internal, format!("cannot start: {error}")))?;
        Ok((Self { deeds, filter: Filter::default(), pixels }, recovered.farm))
    }

    /// Notes an event that `farm` is about to take.
    pub fn note(&mut self, farm: &Farm, now: Duration, event: &Event) {
        let entries = self.filter.admit(farm, now, event);
        if !entries.is_empty() {
            self.send(Deed::Note(entries));
        }
    }

    /// Stores pixels; when they are on disk, [`Event::Committed`] comes.
    pub fn commit(&self, job: JobId, part: PartId, lease: LeaseId, bytes: Vec<u8>) {
        self.send(Deed::Store(job, part, lease, bytes));
    }

    /// Does something when all that was said before is on disk.
    pub fn then(&self, act: impl FnOnce() + Send + 'static) {
        self.send(Deed::Then(Box::new(act)));
    }

    /// Forgets the pixels of a job that is over.
    pub fn forget(&self, job: JobId) {
        self.send(Deed::Forget(job));
    }

    fn send(&self, deed: Deed) {
        if self.deeds.send(deed).is_err() {
            tracing::error!("the journal's thread is gone: nothing is stored any more");
        }
    }
}

struct Writer {
    pixels: Pixels,
    inputs: InputSender<Input>,
}

impl Writer {
    /// Takes what waits, writes it, waits for the disk once, then says what is done.
    fn run(&self, deeds: &Receiver<Deed>) {
        while let Ok(first) = deeds.recv() {
            let batch = std::iter::once(first).chain(deeds.try_iter().take(JOURNAL_BATCH));
            if !self.write(batch) {
                return;
            }
        }
    }

    fn write(&self, batch: impl Iterator<Item = Deed>) -> bool {
        let mut stored = Vec::new();
        let mut then: Vec<Box<dyn FnOnce() + Send>> = Vec::new();
        for deed in batch {
            match deed {
                Deed::Note(entries) => self.pixels.lock().append(entries),
                Deed::Store(job, part, lease, bytes) => {
                    retry(|| self.pixels.lock().store_pixels(job, part, lease, &bytes));
                    stored.push(Event::Committed { job, lease });
                }
                Deed::Then(act) => then.push(act),
                Deed::Forget(job) => {
                    if let Err(error) = self.pixels.lock().release_pixels(job) {
                        tracing::warn!(%error, "pixels of a job that is over stay");
                    }
                }
            }
        }
        retry(|| self.pixels.lock().sync());
        retry(|| self.pixels.lock().sync_pixels());
        then.into_iter().for_each(|act| act());
        stored.into_iter().all(|event| self.inputs.blocking_send(Input::Event(event)).is_ok())
    }
}

/// A disk that is full has room again some time: nothing is given up, and nothing is acknowledged before.
fn retry(mut write: impl FnMut() -> Result<()>) {
    while let Err(error) = write() {
        tracing::error!(%error, "nothing is acknowledged until the disk takes it");
        thread::sleep(DISK_RETRY);
    }
}
