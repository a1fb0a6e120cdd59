mod disk;

use super::*;
use crate::farm::{Build, Command, Incarnation, JobSpec, NodeInfo, ToNode};
use crate::schedule::{Assign, CostMap, NodeId, Probe, Split};

const BUILD: Build = Build { revision: 1, canary: [7; 32] };

fn spec() -> JobSpec {
    let costs = CostMap { cell: 64, columns: 1, rows: 1, seconds_per_pixel: vec![1.0] };
    JobSpec {
        probe: Probe::Known { costs, powers: BTreeMap::new() },
        split: Split::Grid { width: 16, height: 16 },
        assign: Assign::EarliestFinish,
        min_nodes: 1,
        ..JobSpec::plain("journaled", 64, 64, 1)
    }
}

/// The attempt of this number that a coordinator gives out after its first start.
fn lease(number: u64) -> LeaseId {
    LeaseId((1 << 40) + number)
}

/// One node up to its first parts, with heartbeats between.
fn life() -> Vec<(Duration, Event)> {
    let (node, incarnation, job) = (NodeId(0), Incarnation(7), JobId(1));
    let info = NodeInfo { name: "n".into(), lanes: 2, build: "b".into(), address: "a".into() };
    let mut events = vec![
        Event::Restarted { build: BUILD, stored: Vec::new() },
        Event::JobSubmitted { job, spec: spec() },
        Event::NodeJoined { node, incarnation, info },
        Event::NodeHeard { node, incarnation },
        Event::NodeProved { node, incarnation, canary: BUILD.canary },
        Event::Tick,
        Event::Prepared { node, incarnation, job, result: Ok(()) },
    ];
    for lease in (1..5).map(lease) {
        events.push(Event::Rendered { node, incarnation, job, lease, hash: [1; 32], seconds: 1.0, invalid_samples: 0 });
        events.push(Event::NodeHeard { node, incarnation });
        events.push(Event::Committed { job, lease });
    }
    (1..).map(|i| Duration::from_millis(i * 100)).zip(events).collect()
}

#[test]
fn a_replay_reaches_the_same_state() {
    let folder = tempfile::tempdir().unwrap();
    let (mut journal, recovered) = Journal::open(folder.path(), FarmConfig::default()).unwrap();
    let (mut farm, mut filter) = (recovered.farm, Filter::default());
    for (at, event) in life() {
        journal.append(filter.admit(&farm, at, &event));
        farm.step(at, event);
        journal.sync().unwrap();
    }
    farm.step(Duration::from_secs(9), Event::Tick); // silence: never journaled, so not in the replay
    drop(journal);
    let (mut journal, mut recovered) = Journal::open(folder.path(), FarmConfig::default()).unwrap();
    assert!(farm.difference(&recovered.farm).is_some());
    let mut again = Farm::new(FarmConfig::default());
    life().into_iter().for_each(|(at, event)| _ = again.step(at, event));
    assert_eq!(again.jobs()[0].committed, 4);
    // The last heartbeat was not written: no deadline struck after it. The next one tells the same.
    for farm in [&mut again, &mut recovered.farm] {
        farm.step(Duration::from_secs(2), Event::NodeHeard { node: NodeId(0), incarnation: Incarnation(7) });
    }
    assert_eq!(again.difference(&recovered.farm), None);
    assert!(recovered.events < life().len() as u64, "heartbeats and idle ticks are left out");
    // The journal goes on where it stopped.
    let left = Event::NodeLeft { node: NodeId(0), incarnation: Incarnation(7), reason: "bye".into() };
    for farm in [&mut again, &mut recovered.farm] {
        farm.step(Duration::from_secs(3), left.clone());
    }
    journal.append(vec![(Duration::from_secs(3), left)]);
    journal.sync().unwrap();
    drop(journal);
    assert_eq!(again.difference(&Journal::open(folder.path(), FarmConfig::default()).unwrap().1.farm), None);
}

#[test]
fn two_coordinators_cannot_share_a_journal() {
    let folder = tempfile::tempdir().unwrap();
    let _first = Journal::open(folder.path(), FarmConfig::default()).unwrap();
    let error = Journal::open(folder.path(), FarmConfig::default()).err().unwrap();
    assert!(error.message.contains("cannot open the journal"), "{error}");
}

#[test]
fn a_file_that_is_no_journal_is_refused_with_a_way_out_and_stays_as_it_is() {
    for bytes in [&b""[..], b"redb", &[7; 10_000]] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.redb");
        std::fs::write(&path, bytes).unwrap();
        let error = Journal::open(folder.path(), FarmConfig::default()).err().unwrap().to_string();
        assert!(error.contains("events.redb") && error.contains("move it away"), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
    }
}

/// A job's pixels with three parts; where the last one begins, and the whole file.
fn pixels(folder: &Path) -> (usize, Vec<u8>) {
    let path = folder.join("job-1.pixels");
    let mut segment = Segment::open(&path).unwrap();
    segment.append(PartId(0), LeaseId(10), &[1, 2, 3]).unwrap();
    segment.append(PartId(1), LeaseId(11), &[]).unwrap();
    let last = std::fs::metadata(&path).unwrap().len() as usize;
    segment.append(PartId(2), LeaseId(12), &[9; 40]).unwrap();
    segment.sync().unwrap();
    (last, std::fs::read(path).unwrap())
}

/// All pixels of an attempt.
fn all(mut reader: PixelReader, lease: u64) -> std::io::Result<Vec<u8>> {
    let mut bytes = vec![0; reader.check(LeaseId(lease))? as usize];
    reader.read(LeaseId(lease), 0, &mut bytes)?;
    Ok(bytes)
}

#[test]
fn a_torn_tail_is_cut_wherever_it_is_torn() {
    let folder = tempfile::tempdir().unwrap();
    let (last, whole) = pixels(folder.path());
    let path = folder.path().join("job-1.pixels");
    for length in last..whole.len() {
        std::fs::write(&path, &whole[..length]).unwrap();
        let mut segment = Segment::open(&path).unwrap();
        assert_eq!(segment.stored(), [(LeaseId(10), PartId(0)), (LeaseId(11), PartId(1))], "torn at {length}");
        assert_eq!(std::fs::metadata(&path).unwrap().len() as usize, last);
        assert!(all(segment.reader(&path).unwrap(), 12).is_err());
        segment.append(PartId(2), LeaseId(13), &[7; 40]).unwrap();
        drop(segment);
        let segment = Segment::open(&path).unwrap();
        assert_eq!(all(segment.reader(&path).unwrap(), 10).unwrap(), [1, 2, 3]);
        assert_eq!(all(segment.reader(&path).unwrap(), 13).unwrap(), [7; 40]);
    }
}

#[test]
fn a_flipped_bit_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let (last, whole) = pixels(folder.path());
    let path = folder.path().join("job-1.pixels");
    for at in last..whole.len() {
        let mut bad = whole.clone();
        bad[at] ^= 0x10;
        std::fs::write(&path, &bad).unwrap();
        assert_eq!(Segment::open(&path).unwrap().stored().len(), 2, "byte {at}");
    }
    // Also after it was opened.
    std::fs::write(&path, &whole).unwrap();
    let segment = Segment::open(&path).unwrap();
    let mut bad = whole;
    bad[last - 60] ^= 1;
    *bad.last_mut().unwrap() ^= 1;
    std::fs::write(&path, &bad).unwrap();
    assert!(all(segment.reader(&path).unwrap(), 12).unwrap_err().to_string().contains("not what was stored"));
}

#[test]
fn pixels_come_back_and_go_with_their_job() {
    let folder = tempfile::tempdir().unwrap();
    let (mut journal, _) = Journal::open(folder.path(), FarmConfig::default()).unwrap();
    let job = JobId(3);
    journal.store_pixels(job, PartId(5), LeaseId(1), b"first").unwrap();
    journal.store_pixels(job, PartId(5), LeaseId(1), b"again").unwrap(); // a repeated commit changes nothing
    journal.sync_pixels().unwrap();
    assert_eq!(all(journal.reader(job).unwrap(), 1).unwrap(), b"first");
    assert_eq!(journal.stored(job).unwrap(), [(LeaseId(1), PartId(5))]);
    journal.release_pixels(job).unwrap();
    journal.release_pixels(job).unwrap();
    assert!(journal.stored(job).unwrap().is_empty());
}

#[test]
fn pixels_on_disk_are_not_rendered_again_after_a_crash_before_their_commit() {
    let mut farm = Farm::new(FarmConfig::default());
    let events = life();
    let delivered = events.iter().position(|(_, event)| matches!(event, Event::Rendered { .. })).unwrap();
    events[..=delivered].iter().for_each(|(at, event)| _ = farm.step(*at, event.clone()));
    // Lost: the pixels were in memory. Kept: the journal's segment has them, and the coordinator says so.
    let orders = |stored: Vec<(JobId, LeaseId)>| -> usize {
        let mut farm = farm.clone();
        farm.step(Duration::from_secs(2), Event::Restarted { build: BUILD, stored });
        let (node, incarnation) = (NodeId(0), Incarnation(8));
        let info = NodeInfo { name: "n".into(), lanes: 16, build: "b".into(), address: "a".into() };
        let mut commands = farm.step(Duration::from_secs(2), Event::NodeJoined { node, incarnation, info });
        commands.extend(farm.step(Duration::from_secs(2), Event::NodeProved { node, incarnation, canary: BUILD.canary }));
        commands.extend(farm.step(Duration::from_secs(2), Event::Prepared { node, incarnation, job: JobId(1), result: Ok(()) }));
        farm.check_invariants().unwrap();
        commands.iter().filter(|command| matches!(command, Command::Send { message: ToNode::Render { .. }, .. })).count()
    };
    assert_eq!((orders(Vec::new()), orders(vec![(JobId(1), lease(1))])), (16, 15));
}

/// A journal that is begun anew while nodes are there brings back the very farm that goes on, whatever happens next.
#[test]
fn a_renewed_journal_goes_on_as_the_farm_does() {
    let folder = tempfile::tempdir().unwrap();
    let (mut journal, recovered) = Journal::open(folder.path(), FarmConfig::default()).unwrap();
    let (mut farm, mut filter) = (recovered.farm, Filter::default());
    let mut takes = |journal: &mut Journal, farm: &mut Farm, at: u64, event: Event| {
        let at = Duration::from_secs(at);
        journal.append(filter.admit(farm, at, &event));
        farm.step(at, event);
    };
    let life = life();
    assert!(life.iter().all(|(at, _)| *at < Duration::from_secs(5)));
    for (_, event) in life {
        takes(&mut journal, &mut farm, 5, event);
    }
    journal.sync().unwrap();
    let before = journal.size().0;
    journal.renew(&farm).unwrap();
    assert!(before > 10 && journal.size().0 == 0);

    // Everything goes on: the job that runs, a node that comes, the end of a journal that is opened in the middle of it.
    let (node, incarnation, job) = (NodeId(0), Incarnation(7), JobId(1));
    let open = |farm: &Farm, job| farm.record(job).unwrap().parts.iter().flat_map(|part| part.attempts.clone()).find(|it| it.end.is_none());
    for at in 6..10 {
        let lease = LeaseId(open(&farm, job).unwrap().lease);
        takes(
            &mut journal,
            &mut farm,
            at,
            Event::Rendered { node, incarnation, job, lease, hash: [1; 32], seconds: 1.0, invalid_samples: 0 },
        );
        takes(&mut journal, &mut farm, at, Event::Committed { job, lease });
    }
    let info = NodeInfo { name: "second".into(), lanes: 1, build: "b".into(), address: "a".into() };
    takes(&mut journal, &mut farm, 10, Event::NodeJoined { node: NodeId(1), incarnation: Incarnation(9), info });
    journal.sync().unwrap();
    assert_eq!(farm.jobs()[0].committed, 8);
    drop(journal);
    let (mut journal, recovered) = Journal::open(folder.path(), FarmConfig::default()).unwrap();
    assert_eq!(farm.difference(&recovered.farm), None);
    assert!(recovered.events < 15, "{}", recovered.events);
    // And once more, with nothing after it.
    journal.renew(&farm).unwrap();
    drop(journal);
    let (_, recovered) = Journal::open(folder.path(), FarmConfig::default()).unwrap();
    assert_eq!((farm.difference(&recovered.farm), recovered.events), (None, 0));
}

/// What another version wrote is neither misread nor touched.
#[test]
fn a_journal_of_another_version_is_refused_with_a_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let (mut journal, _) = Journal::open(folder.path(), FarmConfig::default()).unwrap();
    journal.append(life());
    journal.sync().unwrap();
    let writing = journal.database().unwrap().begin_write().unwrap();
    writing.delete_table(BEGINNING).unwrap();
    writing.open_table(BEGINNING).unwrap().insert(FORMAT + 1, &[][..]).unwrap();
    writing.commit().unwrap();
    drop(journal);
    let error = Journal::open(folder.path(), FarmConfig::default()).err().unwrap().to_string();
    assert!(error.contains("another version of tessera wrote it") && error.contains("move the folder `journal` away"), "{error}");
}

#[test]
fn pixels_that_a_crash_left_of_a_job_that_is_over_go_at_the_next_start_and_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let (mut journal, _) = Journal::open(folder.path(), FarmConfig::default()).unwrap();
    for job in 1..3 {
        journal.append(vec![(Duration::ZERO, Event::JobSubmitted { job: JobId(job), spec: spec() })]);
    }
    journal.append(vec![(Duration::ZERO, Event::JobCancelled { job: JobId(1), reason: "enough".into() })]);
    for job in 1..4 {
        journal.store_pixels(JobId(job), PartId(0), LeaseId(1), b"pixels").unwrap();
    }
    journal.sync().unwrap();
    drop(journal);
    let (mut journal, _) = Journal::open(folder.path(), FarmConfig::default()).unwrap();
    let left: Vec<bool> = (1..4).map(|job| folder.path().join(format!("job-{job}.pixels")).exists()).collect();
    assert_eq!(left, [false, true, false]);
    assert_eq!(all(journal.reader(JobId(2)).unwrap(), 1).unwrap(), b"pixels");
}
