//! What survives the coordinator: events, and the pixels of parts.
//!
//! The core's thread asks a [`Filter`] what of an event is to be kept; the thread of the disk owns the [`Journal`], so that the core never waits for
//! the disk.
//!
//! Events stand in a database (redb) in the order in which the farm took them; a replay through the same `step` reaches the same state and reads no
//! pixels. A long journal is shortened: a snapshot of the farm takes the place of all events before it. Pixels stand in segments, append-only files of checksummed records; a torn tail is cut off when a segment is opened.

mod filter;
mod segment;

use std::collections::BTreeMap;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Duration;

use redb::backends::FileBackend;
use redb::{Database, ReadableDatabase, ReadableTable, ReadableTableMetadata, TableDefinition};

pub use filter::Filter;
pub use segment::PixelReader;
#[doc(hidden)]
pub use segment::Segment;

use tessera_engine::output::write_atomically;

use crate::error::{Error, ExitCode, Result};
use crate::farm::{Event, Farm, FarmConfig, JobId, LeaseId};
use crate::limits::{JOURNAL_COMPACTED_BYTES, JOURNAL_EVENTS};
use crate::schedule::PartId;

/// Number of an event to the farm's clock in nanoseconds and the event in postcard coding.
const EVENTS: TableDefinition<u64, (u64, &[u8])> = TableDefinition::new("events");

/// The [`FORMAT`] of what was written, and with it the farm before the first event, in postcard coding (nothing for a farm without a past).
const BEGINNING: TableDefinition<u32, &[u8]> = TableDefinition::new("beginning");

/// Changes with every change of what an event or a snapshot holds.
const FORMAT: u32 = 7;

/// The journal of one coordinator, in a folder of its own.
pub struct Journal {
    /// None after the disk refused something: a database takes nothing any more until it is opened again.
    database: Option<Database>,
    next: u64,
    pending: Vec<(Duration, Event)>,
    pixels: BTreeMap<JobId, Segment>,
    folder: std::path::PathBuf,
}

/// What a journal remembers.
pub struct Recovered {
    /// The farm as it was. Its clock tells when; a coordinator's clock goes on from there.
    pub farm: Farm,
    /// Events that were replayed.
    pub events: u64,
}

impl Journal {
    /// Opens the journal in a folder, or begins one, and replays it. After it, the coordinator steps through [`Event::Restarted`], with every attempt that
    /// [`Self::stored`] names and the farm does not call committed.
    ///
    /// # Errors
    /// When files cannot be read or written, or when another process holds the journal.
    ///
    /// A long journal is shortened.
    pub fn open(folder: &Path, config: FarmConfig) -> Result<(Self, Recovered)> {
        // redb believes what stands in its file, and panics where a disk has changed that.
        catch_unwind(AssertUnwindSafe(|| Self::open_believed(folder, config))).unwrap_or_else(|_| {
            Err(failed(&folder.join("events.redb"), "read the journal", "it is damaged")
                .with_help("move the file away: jobs that were running have to be submitted again"))
        })
    }

    fn open_believed(folder: &Path, config: FarmConfig) -> Result<(Self, Recovered)> {
        std::fs::create_dir_all(folder).map_err(|error| failed(folder, "make the folder", &error))?;
        let path = folder.join("events.redb");
        if !path.exists() {
            begin(&path)?;
        }
        let database = Database::open(&path).map_err(|error| match error {
            redb::DatabaseError::DatabaseAlreadyOpen => failed(&path, "open the journal", "another coordinator uses it")
                .with_help("end that one, or choose another folder with --data"),
            error => failed(&path, "open the journal", &error)
                .with_help("if the file is damaged, move it away: jobs that were running have to be submitted again"),
        })?;
        let read = replay(&database, config).map_err(|error| failed(&path, "read the journal", &*error))?;
        let Some((farm, events)) = read else {
            return Err(failed(&path, "read the journal", "another version of tessera wrote it")
                .with_help("let that version end its jobs, then move the folder `journal` away; finished jobs stay where they are"));
        };
        let mut journal =
            Self { database: Some(database), next: events, pending: Vec::new(), pixels: BTreeMap::new(), folder: folder.to_owned() };
        if events > JOURNAL_EVENTS {
            journal.renew(&farm)?;
        }
        let open: Vec<JobId> = farm.jobs().iter().filter(|job| job.outcome.is_none()).map(|job| job.id).collect();
        journal.drop_pixels_but_of(&open)?;
        open.into_iter().try_for_each(|job| journal.segment(job).map(drop))?;
        Ok((journal, Recovered { farm, events }))
    }

    /// Appends what [`Filter::admit`] says of events, in order. It is durable after the next [`Self::sync`].
    pub fn append(&mut self, entries: Vec<(Duration, Event)>) {
        self.pending.extend(entries);
    }

    /// Whether events wait for [`Self::sync`].
    pub fn is_dirty(&self) -> bool {
        !self.pending.is_empty()
    }

    /// Makes all events durable that were appended: one transaction, one wait for the disk.
    ///
    /// # Errors
    /// When the disk is full or fails; the events are kept, and the next call tries again.
    pub fn sync(&mut self) -> Result<()> {
        if self.pending.is_empty() {
            return Ok(());
        }
        let pending = std::mem::take(&mut self.pending);
        if let Err(error) = self.write(self.next, &pending, None) {
            self.pending = pending;
            return Err(failed(&self.folder, "write the journal", &*error));
        }
        self.next += pending.len() as u64;
        Ok(())
    }

    /// The database, opened again where it has to be.
    fn database(&mut self) -> Result<&mut Database, redb::DatabaseError> {
        let database = match self.database.take() {
            Some(database) => database,
            None => Database::open(self.folder.join("events.redb"))?,
        };
        Ok(self.database.insert(database))
    }

    /// Events in it, and their bytes on disk.
    pub fn size(&self) -> (u64, u64) {
        let bytes = std::fs::metadata(self.folder.join("events.redb")).map_or(0, |file| file.len());
        (self.next, bytes)
    }

    /// Puts a snapshot of the farm, as it was after all events that were appended, in their place: at once or not at all.
    ///
    /// # Errors
    /// When the disk is full or fails; nothing is lost by trying again.
    pub fn renew(&mut self, farm: &Farm) -> Result<()> {
        self.sync()?;
        let path = self.folder.join("events.redb");
        let coded = postcard::to_stdvec(farm).map_err(|error| failed(&path, "shorten the journal", &error))?;
        let replaced = self.write(0, &[], Some(&coded));
        replaced.map_err(|error| failed(&path, "shorten the journal", &*error))?;
        self.next = 0;
        tracing::info!(bytes = coded.len(), "the journal begins with a snapshot of the farm");
        // The room is taken again by later events where it cannot be given back now.
        if self.size().1 > JOURNAL_COMPACTED_BYTES
            && let Err(error) = self.compact()
        {
            tracing::warn!(%error, "the journal keeps its length on disk");
        }
        Ok(())
    }

    /// Removes pixels that a crash left of jobs that are over.
    fn drop_pixels_but_of(&self, open: &[JobId]) -> Result<()> {
        let unreadable = |error: io::Error| failed(&self.folder, "list pixels", &error);
        for entry in std::fs::read_dir(&self.folder).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            let job = name.strip_prefix("job-").and_then(|name| name.strip_suffix(".pixels")).and_then(|number| number.parse().ok());
            if job.is_some_and(|job| !open.contains(&JobId(job))) {
                std::fs::remove_file(&path).map_err(|error| failed(&path, "remove pixels", &error))?;
            }
        }
        Ok(())
    }

    fn compact(&mut self) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        let done = self.database()?.compact();
        if done.is_err() {
            self.database = None;
        }
        done?;
        Ok(())
    }

    /// Writes entries from the number `first` on, whole or not at all. Writing them again changes nothing: where the disk failed late, they may be there.
    fn write(
        &mut self,
        first: u64,
        entries: &[(Duration, Event)],
        snapshot: Option<&[u8]>,
    ) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        let written = put(self.database()?, first, entries, snapshot);
        if written.is_err() {
            self.database = None;
        }
        written
    }

    /// Appends the pixels of an attempt. They are durable after the next [`Self::sync_pixels`]; only then may the farm be told that they are committed.
    ///
    /// # Errors
    /// When the disk is full or fails; nothing is lost by trying again.
    pub fn store_pixels(&mut self, job: JobId, part: PartId, lease: LeaseId, bytes: &[u8]) -> Result<()> {
        let folder = self.folder.clone();
        self.segment(job)?.append(part, lease, bytes).map_err(|error| failed(&folder, "store pixels", &error))
    }

    /// Waits until all pixels that were stored are on disk: one wait for all of them.
    ///
    /// # Errors
    /// When the disk fails.
    pub fn sync_pixels(&mut self) -> Result<()> {
        let folder = self.folder.clone();
        self.pixels.values_mut().try_for_each(Segment::sync).map_err(|error| failed(&folder, "store pixels", &error))
    }

    /// A reader of a job's pixels that are stored by now.
    ///
    /// # Errors
    /// When the segment cannot be read.
    pub fn reader(&mut self, job: JobId) -> Result<PixelReader> {
        let path = self.path(job);
        self.segment(job)?.reader(&path).map_err(|error| failed(&path, "read pixels", &error))
    }

    /// Attempts of a job whose pixels are on disk, with their parts.
    ///
    /// # Errors
    /// When the segment cannot be read.
    pub fn stored(&mut self, job: JobId) -> Result<Vec<(LeaseId, PartId)>> {
        Ok(self.segment(job)?.stored())
    }

    /// Forgets the pixels of a job that is over.
    ///
    /// # Errors
    /// When the file cannot be removed.
    pub fn release_pixels(&mut self, job: JobId) -> Result<()> {
        self.pixels.remove(&job);
        let path = self.path(job);
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(failed(&path, "remove pixels", &error)),
            _ => Ok(()),
        }
    }

    fn segment(&mut self, job: JobId) -> Result<&mut Segment> {
        let path = self.path(job);
        match self.pixels.entry(job) {
            std::collections::btree_map::Entry::Occupied(entry) => Ok(entry.into_mut()),
            std::collections::btree_map::Entry::Vacant(entry) => {
                let segment = Segment::open(&path).map_err(|error| failed(&path, "open pixels", &error))?;
                Ok(entry.insert(segment))
            }
        }
    }

    fn path(&self, job: JobId) -> std::path::PathBuf {
        self.folder.join(format!("job-{}.pixels", job.0))
    }
}

impl Drop for Journal {
    /// A damaged database that could be opened may still panic when it is closed.
    fn drop(&mut self) {
        let database = self.database.take();
        let _ = catch_unwind(AssertUnwindSafe(|| drop(database)));
    }
}

/// Makes the file of a journal in which nothing stands yet. What a crash leaves of a database that is being made cannot be opened: so it takes its name when
/// it is whole.
fn begin(path: &Path) -> Result<()> {
    let made = write_atomically(path, |file| {
        let database = Database::builder()
            .create_with_backend(FileBackend::new(file.get_ref().try_clone()?).map_err(io::Error::other)?)
            .map_err(io::Error::other)?;
        put(&database, 0, &[], None).map_err(io::Error::other)
    });
    made.map_err(|error| failed(path, "begin the journal", &error.reason))
}

/// The farm as events, and a snapshot before them, tell; and how many events. `None` if they are of another format.
fn replay(database: &Database, config: FarmConfig) -> Result<Option<(Farm, u64)>, Box<dyn std::error::Error + Send + Sync>> {
    let reading = database.begin_read()?;
    let table = match reading.open_table(EVENTS) {
        Ok(table) => table,
        Err(redb::TableError::TableDoesNotExist(_)) => return Ok(Some((Farm::new(config), 0))),
        Err(error) => return Err(error.into()),
    };
    let beginning = match reading.open_table(BEGINNING) {
        Ok(beginning) => beginning.get(FORMAT)?,
        Err(redb::TableError::TableDoesNotExist(_)) => None,
        Err(error) => return Err(error.into()),
    };
    let Some(beginning) = beginning else { return Ok(None) };
    let mut farm = match beginning.value() {
        [] => Farm::new(config),
        coded => postcard::from_bytes::<Farm>(coded)?.resumed(config),
    };
    let mut count = 0;
    for entry in table.iter()? {
        let (number, value) = entry?;
        let (at, coded) = value.value();
        farm.step(Duration::from_nanos(at), postcard::from_bytes(coded)?);
        count = number.value() + 1;
    }
    Ok(Some((farm, count)))
}

fn put(
    database: &Database,
    first: u64,
    entries: &[(Duration, Event)],
    snapshot: Option<&[u8]>,
) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let writing = database.begin_write()?;
    if snapshot.is_some() {
        writing.delete_table(EVENTS)?;
    }
    {
        let mut beginning = writing.open_table(BEGINNING)?;
        if snapshot.is_some() || beginning.is_empty()? {
            beginning.insert(FORMAT, snapshot.unwrap_or_default())?;
        }
        let mut table = writing.open_table(EVENTS)?;
        for (number, (at, event)) in (first..).zip(entries) {
            table.insert(number, (u64::try_from(at.as_nanos())?, postcard::to_stdvec(event)?.as_slice()))?;
        }
    }
    writing.commit()?;
    Ok(())
}

fn failed(path: &Path, what: &str, error: &(impl std::fmt::Display + ?Sized)) -> Error {
    Error::new(ExitCode::File, format!("{}: cannot {what}: {error}", path.display()))
}

#[cfg(test)]
mod tests;
