//! The coordinator's memory, as a disk may give it back.

use std::{fs, sync::LazyLock, time::Duration};

use tessera_node::{
    farm::{Event, Farm, FarmConfig, JobId, JobSpec, LeaseId},
    journal::{Journal, Segment},
    limits::{LANES, LONGEST_PATIENCE, PIXELS_PER_FRAME, SAMPLES_PER_PIXEL},
    schedule::{PartId, Probe, Split},
};

use super::caught_of_libraries;

/// A segment of pixels: what it says to be stored can be read, and it goes on behind that.
pub fn segment(bytes: &[u8]) -> bool {
    const NEW: (PartId, LeaseId, &[u8]) = (PartId(7), LeaseId(u64::MAX), b"pixels");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("job-1.pixels");
    fs::write(&path, bytes).unwrap();
    let mut segment = Segment::open(&path).unwrap();
    let stored = segment.stored();
    assert!(fs::read(&path).unwrap().len() <= bytes.len());
    let mut reader = segment.reader(&path).unwrap();
    stored.iter().for_each(|(lease, _)| assert!(reader.check(*lease).unwrap() <= bytes.len() as u64));
    segment.append(NEW.0, NEW.1, NEW.2).unwrap();
    segment.sync().unwrap();
    let again = Segment::open(&path).unwrap();
    assert_eq!(again.stored().len(), stored.len() + usize::from(stored.iter().all(|(lease, _)| *lease != NEW.1)));
    again.reader(&path).unwrap().check(NEW.1).unwrap();
    !stored.is_empty()
}

/// A job as a submission may tell of it.
pub fn spec() -> JobSpec {
    JobSpec { probe: Probe::Shared { scale: 0.25 }, split: Split::Grid { width: 32, height: 32 }, ..JobSpec::plain("job", 64, 48, 4) }
}

/// Events with their times, one after another: a farm takes them in whatever order, and its books agree after each.
pub fn events(mut bytes: &[u8]) -> bool {
    let mut farm = Farm::new(FarmConfig::default());
    let mut now = Duration::ZERO;
    let mut taken = 0;
    while let Ok(((pause, event), rest)) = postcard::take_from_bytes::<(u16, Event)>(bytes) {
        bytes = rest;
        now += Duration::from_millis(pause.into());
        if !is_possible(&event) {
            continue;
        }
        farm.step(now, event);
        farm.check_invariants().unwrap_or_else(|wrong| panic!("{wrong}"));
        taken += 1;
    }
    taken > 0 && bytes.is_empty()
}

/// What the coordinator lets through to the core, of jobs that are small enough to be tried often.
fn is_possible(event: &Event) -> bool {
    let spec = match event {
        Event::JobSubmitted { spec, .. } => spec,
        Event::NodeJoined { info, .. } => return (1..=LANES).contains(&info.lanes),
        _ => return true,
    };
    let pixels = u64::from(spec.width) * u64::from(spec.height);
    (1..=PIXELS_PER_FRAME.min(1 << 14)).contains(&pixels)
        && (1..=u64::from(SAMPLES_PER_PIXEL)).contains(&spec.samples)
        && spec.min_nodes > 0
        && spec.attempts > 0
        && spec.patience.is_none_or(|patience| patience.as_secs_f64() <= LONGEST_PATIENCE)
}

/// The database's file as it is after three events.
static DATABASE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let (mut journal, _) = Journal::open(folder.path(), FarmConfig::default()).unwrap();
    for job in 1..=3 {
        journal.append(vec![(Duration::from_secs(job), Event::JobSubmitted { job: JobId(job), spec: spec() })]);
        journal.sync().unwrap();
    }
    drop(journal);
    fs::read(folder.path().join("events.redb")).unwrap()
});

/// A whole database with some of its bytes changed, each told by three bytes for its place and one that is added to it: it is opened or refused.
pub fn database(changes: &[u8]) -> bool {
    let mut file = DATABASE.clone();
    for change in changes.as_chunks::<4>().0.iter().take(64) {
        let [a, b, c, value] = *change;
        let place = u32::from_le_bytes([a, b, c, 0]) as usize % file.len();
        file[place] = file[place].wrapping_add(value);
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("events.redb"), &file).unwrap();
    caught_of_libraries(|| Journal::open(folder.path(), FarmConfig::default()).is_ok())
}
