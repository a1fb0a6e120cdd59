//! The journal's thread: events and pixels reach the disk in batches, so that no wait for it holds the core up.

use std::{
    path::Path,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
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
    journal::{Filter, Journal, PixelReader},
    limits::{DISK_RETRY, JOURNAL_BATCH},
    schedule::PartId,
    web::Metrics,
};

/// What the thread does, in this order.
enum Deed {
    Note(Vec<(Duration, Event)>),
    Store(JobId, PartId, LeaseId, Vec<u8>),
    Then(Box<dyn FnOnce() + Send>),
    Forget(JobId),
    Renew(Box<Farm>),
}

/// The way to the journal. What waits there is bounded by what was handed out: pixels of the running job, and the events around them.
pub struct Disk {
    deeds: Sender<Deed>,
    filter: Filter,
    /// Whether a snapshot is on its way.
    renewing: Arc<AtomicBool>,
    metrics: Arc<Metrics>,
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

    /// Reads pixels of a job, without holding up those that are stored.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn reader(&self, job: JobId) -> Result<PixelReader> {
        self.lock().reader(job)
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
    pub fn open(folder: &Path, config: FarmConfig, inputs: InputSender<Input>, metrics: Arc<Metrics>) -> Result<(Self, Farm)> {
        let (journal, recovered) = Journal::open(&folder.join("journal"), config)?;
        if recovered.events > 0 {
            tracing::info!(events = recovered.events, "the journal was replayed");
        }
        let pixels = Pixels(Arc::new(Mutex::new(journal)));
        let (deeds, received) = mpsc::channel();
        let renewing = Arc::new(AtomicBool::new(false));
        let mut thread = Writer { pixels: pixels.clone(), inputs, metrics: metrics.clone(), renewing: renewing.clone(), trouble: None };
        thread.measure();
        let started = thread::Builder::new().name("journal".to_owned()).spawn(move || thread.run(&received));
        started.map_err(|error| Error::new(ExitCode::Internal, format!("cannot start: {error}")))?;
        Ok((Self { deeds, filter: Filter::default(), renewing, metrics, pixels }, recovered.farm))
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

    /// Lets the journal begin with the farm as it stands, in place of all that was noted before.
    pub fn renew(&self, farm: &Farm) {
        // One at a time: where the disk refuses, they would pile up.
        if !self.renewing.swap(true, Ordering::Relaxed) {
            self.send(Deed::Renew(Box::new(farm.clone())));
        }
    }

    fn send(&self, deed: Deed) {
        self.metrics.disk_waiting.inc();
        if self.deeds.send(deed).is_err() {
            tracing::error!("the journal's thread is gone: nothing is stored any more");
        }
    }
}

struct Writer {
    pixels: Pixels,
    inputs: InputSender<Input>,
    metrics: Arc<Metrics>,
    renewing: Arc<AtomicBool>,
    /// Why the disk takes nothing, as the core was told.
    trouble: Option<String>,
}

impl Writer {
    /// Takes what waits, writes it, waits for the disk once, then says what is done.
    fn run(&mut self, deeds: &Receiver<Deed>) {
        while let Ok(first) = deeds.recv() {
            let batch = std::iter::once(first).chain(deeds.try_iter().take(JOURNAL_BATCH));
            if !self.write(batch) {
                return;
            }
        }
    }

    fn write(&mut self, batch: impl Iterator<Item = Deed>) -> bool {
        let (mut stored, mut over) = (Vec::new(), Vec::new());
        let mut then: Vec<Box<dyn FnOnce() + Send>> = Vec::new();
        for deed in batch {
            self.metrics.disk_waiting.dec();
            match deed {
                Deed::Note(entries) => self.pixels.lock().append(entries),
                Deed::Store(job, part, lease, bytes) => {
                    self.retry(|journal| journal.store_pixels(job, part, lease, &bytes));
                    stored.push(Event::Committed { job, lease });
                }
                Deed::Then(act) => then.push(act),
                Deed::Forget(job) => over.push(job),
                Deed::Renew(farm) => {
                    self.retry(|journal| journal.renew(&farm));
                    self.renewing.store(false, Ordering::Relaxed);
                }
            }
        }
        self.retry(Journal::sync);
        self.retry(Journal::sync_pixels);
        then.into_iter().for_each(|act| act());
        // Only now: until the end of a job is on disk, a start would go on with it.
        over.into_iter().for_each(|job| self.release(job));
        self.measure();
        stored.into_iter().all(|event| self.inputs.blocking_send(Input::Event(event)).is_ok())
    }

    /// A disk that is full has room again some time: nothing is given up, and nothing is acknowledged before.
    fn retry(&mut self, mut write: impl FnMut(&mut Journal) -> Result<()>) {
        let pixels = self.pixels.clone();
        loop {
            let written = write(&mut pixels.lock());
            let Err(error) = written else { break };
            self.metrics.disk_refusals.inc();
            self.tell(Some(error.message));
            thread::sleep(DISK_RETRY);
        }
        self.tell(None);
    }

    /// Tells the core and the log when the disk begins to refuse, and when it takes again.
    fn tell(&mut self, trouble: Option<String>) {
        if trouble == self.trouble {
            return;
        }
        match &trouble {
            Some(error) => tracing::error!(error, "nothing is acknowledged until the disk takes it"),
            None => tracing::info!("the disk takes what it is given again"),
        }
        self.trouble.clone_from(&trouble);
        let _ = self.inputs.blocking_send(Input::Disk(trouble));
    }

    fn release(&self, job: JobId) {
        if let Err(error) = self.pixels.lock().release_pixels(job) {
            tracing::warn!(%error, "pixels of a job that is over stay");
        }
    }

    fn measure(&self) {
        let (events, bytes) = self.pixels.lock().size();
        self.metrics.journal_events.set(events);
        self.metrics.journal_bytes.set(bytes);
    }
}
