//! The journal's database on a disk that tears what is on its way, loses what was not synced, or fails.

use std::io;
use std::sync::{Arc, Mutex, MutexGuard};

use redb::{Builder, StorageBackend};

use super::*;

/// What a database does to its disk.
#[derive(Clone, Debug)]
enum Operation {
    Write(usize, Vec<u8>),
    Length(usize),
    Sync,
}

impl Operation {
    /// Does it to a file, of a write only the first bytes.
    fn apply(&self, file: &mut Vec<u8>, first: usize) {
        match self {
            Self::Write(offset, bytes) => {
                let first = first.min(bytes.len());
                // A file grows by what is written behind its end, also by what comes before a torn end.
                file.resize(file.len().max(offset + first), 0);
                file[*offset..offset + first].copy_from_slice(&bytes[..first]);
            }
            Self::Length(length) => file.resize(*length, 0),
            Self::Sync => {}
        }
    }
}

#[derive(Debug, Default)]
struct State {
    file: Vec<u8>,
    operations: Vec<Operation>,
    /// Operations, reads among them, until one fails.
    fails_in: Option<usize>,
}

/// A disk in memory that remembers what was done to it.
#[derive(Clone, Debug, Default)]
struct Disk(Arc<Mutex<State>>);

impl Disk {
    fn holding(file: Vec<u8>) -> Self {
        Self(Arc::new(Mutex::new(State { file, ..State::default() })))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap()
    }

    /// A disk on which a journal has been begun, as [`begin`] does: whole or not at all.
    fn begun() -> Self {
        let disk = Self::default();
        put(&disk.open().unwrap(), 0, &[], None).unwrap();
        disk.state().operations.clear();
        disk
    }

    fn open(&self) -> Result<Database, redb::DatabaseError> {
        Builder::new().create_with_backend(self.clone())
    }

    /// The state, unless this operation is to fail. A write that fails leaves half of it.
    fn take(&self, operation: Option<Operation>) -> io::Result<MutexGuard<'_, State>> {
        let mut state = self.state();
        let fails = state.fails_in == Some(0);
        state.fails_in = state.fails_in.and_then(|left| left.checked_sub(1));
        if let Some(operation) = operation {
            let first = if fails { 100 } else { usize::MAX };
            let keeps = !fails || matches!(operation, Operation::Write(..));
            if keeps {
                operation.apply(&mut state.file, first);
                state.operations.push(operation);
            }
        }
        if fails { Err(io::Error::other("the disk fails")) } else { Ok(state) }
    }
}

impl StorageBackend for Disk {
    fn len(&self) -> io::Result<u64> {
        Ok(self.take(None)?.file.len() as u64)
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let state = self.take(None)?;
        let bytes = state.file.get(offset as usize..).and_then(|rest| rest.get(..out.len()));
        out.copy_from_slice(bytes.ok_or(io::ErrorKind::UnexpectedEof)?);
        Ok(())
    }

    fn set_len(&self, length: u64) -> io::Result<()> {
        self.take(Some(Operation::Length(length as usize))).map(drop)
    }

    fn sync_data(&self) -> io::Result<()> {
        self.take(Some(Operation::Sync)).map(drop)
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        self.take(Some(Operation::Write(offset as usize, data.to_vec()))).map(drop)
    }
}

/// What is asked of a journal in turn: some events are appended, or a snapshot takes the place of all of them.
enum Step {
    Append(Vec<(Duration, Event)>),
    Renew,
}

/// A life with a renewal in the middle.
fn steps() -> Vec<Step> {
    let mut life = life();
    let second = life.split_off(life.len() / 2);
    let group = |life: Vec<(Duration, Event)>| -> Vec<Step> { life.chunks(3).map(|some| Step::Append(some.to_vec())).collect() };
    group(life).into_iter().chain([Step::Renew]).chain(group(second)).collect()
}

/// A journal's database in use, as the coordinator uses it.
struct Use {
    disk: Disk,
    database: Option<Database>,
    farm: Farm,
    next: u64,
}

impl Use {
    fn of(disk: Disk) -> Self {
        Self { disk, database: None, farm: Farm::new(FarmConfig::default()), next: 0 }
    }

    /// Tries a step once; where the disk fails, nothing has changed for the coordinator.
    fn try_step(&mut self, step: &Step) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        let database = match self.database.take() {
            Some(database) => database,
            None => self.disk.open()?,
        };
        match step {
            Step::Append(events) => {
                put(&database, self.next, events, None)?;
                self.next += events.len() as u64;
                events.iter().for_each(|(at, event)| _ = self.farm.step(*at, event.clone()));
            }
            Step::Renew => {
                put(&database, 0, &[], Some(&postcard::to_stdvec(&self.farm)?))?;
                self.next = 0;
            }
        }
        self.database = Some(database);
        Ok(())
    }
}

/// What happens without faults.
struct Undisturbed {
    /// The farm after every step; the first is that of a journal that was just begun.
    farms: Vec<Farm>,
    /// Operations of the disk that were done by then.
    done: Vec<usize>,
    operations: Vec<Operation>,
    /// The disk before the first of them.
    begun: Vec<u8>,
}

impl Undisturbed {
    /// Steps that had been acknowledged before an operation.
    fn acknowledged(&self, operation: usize) -> usize {
        self.done.iter().rposition(|done| *done <= operation).unwrap()
    }
}

fn undisturbed() -> Undisturbed {
    let mut journal = Use::of(Disk::begun());
    let begun = journal.disk.state().file.clone();
    let (mut farms, mut done) = (vec![journal.farm.clone()], vec![0]);
    for step in steps() {
        journal.try_step(&step).unwrap();
        farms.push(journal.farm.clone());
        done.push(journal.disk.state().operations.len());
    }
    // A closed database writes once more.
    journal.database = None;
    let operations = std::mem::take(&mut journal.disk.state().operations);
    Undisturbed { farms, done, operations, begun }
}

/// Opens what a crash left in a file, and tells how many steps it knows: not fewer than were acknowledged, and no more than were begun.
fn known(file: Vec<u8>, farms: &[Farm], acknowledged: usize, what: &str) -> Disk {
    let disk = Disk::holding(file);
    let database = disk.open().unwrap_or_else(|error| panic!("{what}: {error}"));
    let (farm, _) = replay(&database, FarmConfig::default()).unwrap_or_else(|error| panic!("{what}: {error}")).expect("of this format");
    let mut possible = farms[acknowledged..].iter().take(2);
    assert!(possible.any(|other| other.difference(&farm).is_none()), "{what}: not the farm of step {acknowledged} or the next");
    drop(database);
    disk
}

/// Every write to the disk is torn at every byte that it changes.
#[test]
fn a_write_that_is_torn_at_any_byte_loses_nothing_that_was_acknowledged() {
    let life = undisturbed();
    let (mut file, mut tried) = (life.begun.clone(), 0);
    for (index, operation) in life.operations.iter().enumerate() {
        let acknowledged = life.acknowledged(index);
        if let Operation::Write(offset, bytes) = operation {
            let changes = |at: usize| file.get(offset + at) != Some(&bytes[at]);
            for first in (0..bytes.len()).filter(|at| changes(*at)) {
                let mut torn = file.clone();
                operation.apply(&mut torn, first);
                known(torn, &life.farms, acknowledged, &format!("operation {index} torn at byte {first}"));
                tried += 1;
            }
        }
        operation.apply(&mut file, usize::MAX);
    }
    println!("{tried} torn states of {} operations", life.operations.len());
    assert!(tried > 1000, "{tried}");
    known(file, &life.farms, life.farms.len() - 1, "in the end");
}

/// What was written since the last sync reaches the disk in part, in any order, and torn.
#[test]
fn a_crash_that_loses_any_of_what_was_not_synced_loses_nothing_that_was_acknowledged() {
    let life = undisturbed();
    let operations = &life.operations;
    for index in 0..=operations.len() {
        let acknowledged = life.acknowledged(index);
        let synced = operations[..index].iter().rposition(|it| matches!(it, Operation::Sync)).map_or(0, |at| at + 1);
        for seed in 0..20u8 {
            let draw = |at: usize, what: u8| blake3::hash(&[seed, index as u8, at as u8, what]).as_bytes()[0] as usize;
            let mut file = life.begun.clone();
            operations[..synced].iter().for_each(|operation| operation.apply(&mut file, usize::MAX));
            for (at, operation) in operations[..index].iter().enumerate().skip(synced) {
                match (operation, draw(at, 0) % 3) {
                    // The file's length is in order: a file system's own journal sees to that.
                    (Operation::Write(..), 0) => {}
                    (Operation::Write(_, bytes), 1) => operation.apply(&mut file, bytes.len() * draw(at, 1) / 256),
                    _ => operation.apply(&mut file, usize::MAX),
                }
            }
            known(file, &life.farms, acknowledged, &format!("crash after operation {index}, seed {seed}"));
        }
    }
}

/// Each operation of the disk fails once. What was asked for is tried again, as the coordinator does, and nothing is lost or twice there.
#[test]
fn a_disk_that_fails_at_any_operation_loses_nothing() {
    let life = undisturbed();
    let mut failures = 0;
    for fails_in in 0.. {
        let disk = Disk::begun();
        disk.state().fails_in = Some(fails_in);
        let mut journal = Use::of(disk.clone());
        for step in steps() {
            if journal.try_step(&step).is_err() {
                failures += 1;
                journal.try_step(&step).unwrap_or_else(|error| panic!("operation {fails_in}, tried again: {error}"));
            }
        }
        journal.database = None;
        let over = disk.state().fails_in.is_some();
        disk.state().fails_in = None;
        let file = disk.state().file.clone();
        known(file, &life.farms, life.farms.len() - 1, &format!("operation {fails_in} fails"));
        if over {
            break;
        }
    }
    assert!(failures > 20, "{failures}");
}
