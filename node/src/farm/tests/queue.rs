//! Which jobs run, and which of them hands out next.

use super::*;

/// Ready nodes of one lane, and no job.
fn bench(nodes: u32) -> Bench {
    let mut bench = Bench { farm: Farm::new(FarmConfig::default()), now: Duration::ZERO, said: Vec::new() };
    bench.does(Event::Restarted { build: BUILD, stored: Vec::new() });
    (0..nodes).for_each(|node| bench.ready(node, 1));
    bench
}

impl Bench {
    /// A job is submitted, and prepared wherever it begins.
    fn submit(&mut self, job: u64, change: impl FnOnce(&mut JobSpec)) {
        let mut spec = spec(Assign::EarliestFinish, 1);
        change(&mut spec);
        self.does(Event::JobSubmitted { job: JobId(job), spec });
        self.prepare();
    }

    /// Nodes answer all that they were asked to prepare.
    fn prepare(&mut self) {
        let asked: Vec<_> = self
            .said
            .iter()
            .filter_map(|command| match command {
                Command::Send { node, incarnation, message: ToNode::Prepare { job } } => Some((*node, *incarnation, *job)),
                _ => None,
            })
            .collect();
        asked.into_iter().for_each(|(node, incarnation, job)| self.does(Event::Prepared { node, incarnation, job, result: Ok(()) }));
    }

    /// Attempts that run, by job.
    fn running(&self, job: u64) -> Vec<(NodeId, LeaseId)> {
        let parts = self.farm.record(JobId(job)).unwrap().parts;
        let attempts = parts.iter().flat_map(|part| &part.attempts);
        attempts.filter(|a| a.outcome == AttemptOutcome::Running && a.end.is_none()).map(|a| (a.node, LeaseId(a.lease))).collect()
    }

    /// The first attempt of a job is delivered and committed.
    fn deliver(&mut self, job: u64) {
        let (node, lease) = self.running(job)[0];
        let job = JobId(job);
        let area = self.farm.parts(job).iter().find(|part| part.id.0 == 0).unwrap().rect.area();
        self.does(Event::Rendered {
            node,
            incarnation: Incarnation(1),
            job,
            lease,
            hash: [3; 32],
            seconds: area as f64 / 256.0,
            invalid_samples: 0,
        });
        self.prepare();
        self.does(Event::Committed { job, lease });
        self.prepare();
    }

    fn finish(&mut self, job: u64) {
        while !self.running(job).is_empty() {
            self.deliver(job);
        }
        self.does(Event::Assembled { job: JobId(job), result: Ok(()) });
        self.prepare();
    }

    fn phase(&self, job: u64) -> JobPhase {
        self.farm.jobs().iter().find(|known| known.id.0 == job).unwrap().phase
    }

    fn ended(&self, job: u64) -> Option<Outcome> {
        self.farm.jobs().into_iter().find(|known| known.id.0 == job).unwrap().outcome
    }
}

#[test]
fn jobs_of_one_submitter_run_one_after_the_other_but_no_lane_waits_for_the_last_parts() {
    let mut bench = bench(2);
    bench.submit(1, |_| ());
    bench.submit(2, |_| ());
    assert_eq!((bench.running(1).len(), bench.phase(2)), (4, JobPhase::Waiting));
    for _ in 0..10 {
        bench.deliver(1);
    }
    assert_eq!(bench.phase(2), JobPhase::Rendering, "two parts of the first wait, no more than there are lanes");
    assert_eq!(bench.running(2).len(), 0, "and they go first");
    while bench.running(1).len() > 1 {
        bench.deliver(1);
    }
    assert!(bench.running(2).len() >= 2, "a lane waits: {:?}", bench.running(2));
}

#[test]
fn a_higher_priority_goes_first_whoever_came_before() {
    let mut bench = bench(1);
    bench.submit(1, |_| ());
    bench.submit(2, |spec| spec.priority = 10);
    assert_eq!((bench.phase(2), bench.running(2).len()), (JobPhase::Rendering, 0), "it has begun, and the lane is taken");
    bench.deliver(1);
    bench.deliver(1);
    assert_eq!((bench.running(1).len(), bench.running(2).len()), (0, 2));
    bench.does(Event::JobRanked { job: JobId(1), priority: 20, operator: false });
    bench.deliver(2);
    bench.deliver(2);
    assert_eq!((bench.running(1).len(), bench.running(2).len()), (2, 0));
}

#[test]
fn submitters_of_equal_priority_share_by_the_time_that_their_parts_take() {
    let mut bench = bench(1);
    // Parts of the second take four times as long, whatever it says of them.
    bench.submit(1, |spec| spec.owner = "ann".into());
    bench.submit(2, |spec| {
        spec.owner = "ben".into();
        spec.split = Split::Grid { width: 32, height: 32 };
        spec.probe =
            Probe::Known { costs: CostMap { cell: 64, columns: 1, rows: 1, seconds_per_pixel: vec![0.0] }, powers: BTreeMap::new() };
    });
    let mut handed_out = BTreeMap::from([(1, 0), (2, 0)]);
    for _ in 0..12 {
        // Nodes render in the order in which they were given.
        let next = [1, 2].into_iter().flat_map(|job| bench.running(job).into_iter().map(move |(_, lease)| (lease, job))).min().unwrap().1;
        *handed_out.entry(next).or_default() += 1;
        bench.deliver(next);
    }
    assert!((8..=10).contains(&handed_out[&1]) && (2..=4).contains(&handed_out[&2]), "{handed_out:?}");
}

#[test]
fn who_comes_late_makes_up_for_nothing() {
    let mut bench = bench(1);
    bench.submit(1, |spec| spec.owner = "ann".into());
    for _ in 0..8 {
        bench.deliver(1);
    }
    bench.submit(2, |spec| spec.owner = "ben".into());
    let mut ann = 0;
    for _ in 0..8 {
        let next = [1, 2].into_iter().flat_map(|job| bench.running(job).into_iter().map(move |(_, lease)| (lease, job))).min().unwrap().1;
        ann += usize::from(next == 1);
        bench.deliver(next);
    }
    assert!((3..=6).contains(&ann), "{ann} of 8");
}

#[test]
fn a_paused_job_gets_nothing_new_and_keeps_what_it_has() {
    let mut bench = bench(1);
    bench.submit(1, |_| ());
    bench.does(Event::JobPaused { job: JobId(1), reason: "by ann".into(), operator: false });
    bench.deliver(1);
    bench.deliver(1);
    assert_eq!(bench.running(1).len(), 0);
    assert!(bench.farm.jobs()[0].paused && bench.farm.jobs()[0].committed == 2);
    bench.submit(2, |_| ());
    assert_eq!(bench.running(2).len(), 2, "another one runs meanwhile");
    bench.passes(100.0, &[]);
    assert_eq!(bench.ended(1), None, "it does not give up while it waits");
    bench.ready(0, 2);
    bench.prepare();
    bench.does(Event::JobResumed { job: JobId(1), reason: "by ann".into() });
    bench.prepare();
    assert_eq!(bench.running(1).len(), 2);
    let kinds = bench.farm.record(JobId(1)).unwrap().events.into_iter().map(|event| event.kind);
    assert_eq!(kinds.filter(|kind| matches!(kind, EventKind::Paused | EventKind::Resumed)).count(), 2);
}

#[test]
fn a_job_waits_for_others_and_fails_with_them() {
    let mut bench = bench(1);
    bench.submit(1, |_| ());
    bench.submit(2, |spec| spec.after = vec![JobId(1)]);
    bench.submit(3, |spec| (spec.after, spec.priority) = (vec![JobId(2)], 50));
    bench.submit(4, |spec| spec.after = vec![JobId(3)]);
    assert_eq!([2, 3, 4].map(|job| bench.phase(job)), [JobPhase::Waiting; 3]);
    bench.finish(1);
    assert_eq!((bench.phase(2), bench.phase(3)), (JobPhase::Rendering, JobPhase::Waiting));
    bench.does(Event::JobCancelled { job: JobId(2), reason: "enough".into() });
    let failed = |wanted: &str, outcome| matches!(outcome, Some(Outcome::Failed { reason }) if reason == wanted);
    assert!(failed("job 2, which it waits for, was cancelled", bench.ended(3)));
    assert!(failed("job 3, which it waits for, failed", bench.ended(4)));
}

#[test]
fn a_node_that_drains_finishes_what_its_lane_renders_and_gets_nothing_new() {
    let mut bench = bench(2);
    bench.submit(1, |_| ());
    let [(_, begun), (_, waiting)] = bench.running(1).into_iter().filter(|(node, _)| node.0 == 0).collect::<Vec<_>>()[..] else {
        panic!("two attempts")
    };
    bench.does(Event::NodeDraining { node: NodeId(0), incarnation: Incarnation(1) });
    assert!(bench.said.contains(&send(0, 1, ToNode::Cancel { job: JobId(1), lease: waiting })));
    assert_eq!(bench.farm.nodes()[0].state, NodeState::Draining);
    bench.rendered(0, 1, begun);
    assert_eq!(bench.commits(), [begun]);
    assert!(bench.running(1).iter().all(|(node, _)| node.0 == 1));
    bench.does(Event::NodeLeft { node: NodeId(0), incarnation: Incarnation(1), reason: "goodbye".into() });
    bench.does(Event::Committed { job: JobId(1), lease: begun });
    bench.finish(1);
    let record = bench.farm.record(JobId(1)).unwrap();
    assert_eq!(record.outcome, Some(Outcome::Finished));
    let lost = record.parts.iter().flat_map(|part| &part.attempts).filter(|attempt| attempt.outcome == AttemptOutcome::Lost).count();
    assert_eq!(lost, 0, "nothing was rendered in vain");
}

/// An upgrade: the job that has begun goes on where it began, the next one on what is new, and neither is mixed.
#[test]
fn each_job_stays_on_nodes_of_one_build() {
    const NEW: Build = Build { revision: 2, canary: [9; 32] };
    let mut bench = bench(2);
    bench.submit(1, |_| ());
    bench.does(Event::Restarted { build: NEW, stored: Vec::new() });
    // Node 1 is upgraded too, and comes back.
    let info = NodeInfo { name: "n1".into(), lanes: 1, build: "new".into(), address: "a".into() };
    bench.does(Event::NodeJoined { node: NodeId(1), incarnation: Incarnation(2), info });
    bench.does(Event::NodeProved { node: NodeId(1), incarnation: Incarnation(2), canary: NEW.canary });
    assert!(!bench.said.iter().any(|command| matches!(command, Command::Send { message: ToNode::Prepare { .. }, .. })));
    bench.submit(2, |spec| spec.priority = 10);
    assert!(bench.running(1).iter().all(|(node, _)| node.0 == 0) && !bench.running(1).is_empty());
    assert!(bench.running(2).iter().all(|(node, _)| node.0 == 1) && !bench.running(2).is_empty());
    assert_eq!([1, 2].map(|job| bench.farm.record(JobId(job)).unwrap().build), [Some(BUILD), Some(NEW)]);
    // The last node of the old build goes: after a while the job begins anew, rather than fail or be mixed.
    bench.deliver(1);
    bench.does(Event::NodeLeft { node: NodeId(0), incarnation: Incarnation(1), reason: "goodbye".into() });
    let end = bench.now + Duration::from_secs(61);
    while bench.now < end {
        bench.now += Duration::from_millis(50);
        bench.farm.step(bench.now, Event::NodeHeard { node: NodeId(1), incarnation: Incarnation(2) });
        bench.said = bench.farm.step(bench.now, Event::Tick);
        bench.prepare();
    }
    let record = bench.farm.record(JobId(1)).unwrap();
    assert_eq!((record.build, record.outcome), (Some(NEW), None));
    assert_eq!(bench.farm.jobs()[0].committed, 0);
    assert!(record.events.iter().any(|event| event.kind == EventKind::BegunAnew));
}

/// A node turns out to deliver wrong pixels while another job's files are written: those do not count, and are made again without its pixels.
#[test]
fn files_that_hold_pixels_of_a_quarantined_node_are_made_again() {
    let mut bench = bench(3);
    bench.submit(1, |_| ());
    while !bench.running(1).is_empty() {
        bench.deliver(1);
    }
    assert_eq!(bench.phase(1), JobPhase::Assembling);
    bench.submit(2, |spec| spec.audit = 1.0);
    let bad = |bench: &Bench| bench.farm.nodes()[0].state == NodeState::Quarantined;
    while !bad(&bench) {
        let (node, lease) = bench.running(2)[0];
        let hash = if node.0 == 0 { [9; 32] } else { [3; 32] };
        bench.does(Event::Rendered { node, incarnation: Incarnation(1), job: JobId(2), lease, hash, seconds: 1.0, invalid_samples: 0 });
        bench.does(Event::Committed { job: JobId(2), lease });
    }
    let left = bench.farm.jobs()[0].committed;
    assert!(left < 16, "what it had delivered is revoked");
    bench.does(Event::Assembled { job: JobId(1), result: Ok(()) });
    assert_eq!((bench.ended(1), bench.phase(1)), (None, JobPhase::Rendering));
    bench.does(Event::JobCancelled { job: JobId(2), reason: "it has shown enough".into() });
    while bench.farm.jobs()[0].committed < 16 {
        bench.deliver(1);
    }
    assert_eq!(bench.phase(1), JobPhase::Assembling);
    bench.does(Event::Assembled { job: JobId(1), result: Ok(()) });
    assert_eq!(bench.ended(1), Some(Outcome::Finished));
}

/// Jobs that wait for someone hold nobody up but their submitter, and a rank above all others is never held up.
#[test]
fn no_submitter_holds_up_the_others() {
    let mut bench = bench(1);
    for job in 1..=8 {
        bench.submit(job, |spec| spec.owner = "ann".into());
        bench.does(Event::JobPaused { job: JobId(job), reason: "by ann".into(), operator: false });
        bench.prepare();
    }
    bench.submit(9, |spec| spec.owner = "ann".into());
    assert_eq!(bench.phase(9), JobPhase::Waiting, "as many of hers have begun as may");
    for (job, owner) in (10..18).zip(["b", "c", "d", "e", "f", "g", "h", "i"]) {
        bench.submit(job, |spec| spec.owner = owner.into());
        assert_eq!(bench.phase(job), JobPhase::Rendering);
    }
    bench.submit(18, |spec| spec.owner = "j".into());
    assert_eq!(bench.phase(18), JobPhase::Waiting);
    bench.submit(19, |spec| (spec.owner, spec.priority) = ("operator".into(), 1));
    assert_eq!(bench.phase(19), JobPhase::Rendering);
}
