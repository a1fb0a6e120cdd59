//! Transitions of the state machine, one by one. Whole schedules of faults are the simulator's.

mod failing;
mod probing;
mod queue;

use std::collections::BTreeMap;
use std::time::Duration;

use super::*;
use crate::limits;
use crate::manifest::{AttemptOutcome, EventKind};
use crate::schedule::{Assign, CostMap, NodeId, PartId, Plan, Probe, Split};

const JOB: JobId = JobId(1);
const BUILD: Build = Build { revision: 1, canary: [7; 32] };

/// A farm, a clock, and what was commanded last.
struct Bench {
    farm: Farm,
    now: Duration,
    said: Vec<Command>,
}

impl Bench {
    /// Ready nodes of one lane, and a job of 16 equal parts that needs no probe.
    fn new(nodes: u32, assign: Assign) -> Self {
        let mut bench = Self { farm: Farm::new(FarmConfig::default()), now: Duration::ZERO, said: Vec::new() };
        bench.does(Event::Restarted { build: BUILD, stored: Vec::new() });
        bench.does(Event::JobSubmitted { job: JOB, spec: spec(assign, nodes) });
        (0..nodes).for_each(|node| bench.ready(node, 1));
        (0..nodes).for_each(|node| bench.prepared(node, 1));
        bench
    }

    fn does(&mut self, event: Event) {
        self.now += Duration::from_millis(1);
        self.said = self.farm.step(self.now, event);
        self.farm.check_invariants().unwrap();
    }

    fn ready(&mut self, node: u32, life: u64) {
        self.joins(node, life, 1);
    }

    fn joins(&mut self, node: u32, life: u64, lanes: u32) {
        let info = NodeInfo { name: format!("n{node}"), lanes, build: "b".into(), address: "a".into() };
        self.does(Event::NodeJoined { node: NodeId(node), incarnation: Incarnation(life), info });
        assert!(self.said.contains(&send(node, life, ToNode::Prove)));
        self.does(Event::NodeProved { node: NodeId(node), incarnation: Incarnation(life), canary: BUILD.canary });
    }

    fn prepared(&mut self, node: u32, life: u64) {
        self.does(Event::Prepared { node: NodeId(node), incarnation: Incarnation(life), job: JOB, result: Ok(()) });
    }

    fn rendered(&mut self, node: u32, life: u64, lease: LeaseId) {
        let (node, incarnation) = (NodeId(node), Incarnation(life));
        self.does(Event::Rendered { node, incarnation, job: JOB, lease, hash: [3; 32], seconds: 1.0, invalid_samples: 0 });
    }

    fn commits(&self) -> Vec<LeaseId> {
        let lease = |command: &Command| if let Command::Commit { lease, .. } = command { Some(*lease) } else { None };
        self.said.iter().filter_map(lease).collect()
    }

    fn discards(&self) -> Vec<DiscardReason> {
        let reason = |command: &Command| if let Command::Discard { reason, .. } = command { Some(*reason) } else { None };
        self.said.iter().filter_map(reason).collect()
    }

    /// Attempts of a node that run, as the record says.
    fn leases(&self, node: u32) -> Vec<LeaseId> {
        let record = self.farm.record(JOB).unwrap();
        let attempts = record.parts.iter().flat_map(|part| &part.attempts);
        attempts.filter(|a| a.node.0 == node && a.outcome == AttemptOutcome::Running && a.end.is_none()).map(|a| LeaseId(a.lease)).collect()
    }

    /// Time passes, in which only these nodes are heard.
    fn passes(&mut self, seconds: f64, heard: &[u32]) {
        let end = self.now + Duration::from_secs_f64(seconds);
        let mut all = Vec::new();
        while self.now < end {
            self.now += Duration::from_millis(50);
            for node in heard {
                all.extend(self.farm.step(self.now, Event::NodeHeard { node: NodeId(*node), incarnation: Incarnation(1) }));
            }
            all.extend(self.farm.step(self.now, Event::Tick));
            self.farm.check_invariants().unwrap();
        }
        self.said = all;
    }

    fn question(&self) -> (PolicyId, Question) {
        let asked =
            |command: &Command| if let Command::AskPolicy { id, question, .. } = command { Some((*id, question.clone())) } else { None };
        self.said.iter().find_map(asked).expect("a question")
    }

    fn outcome(&self) -> Option<Outcome> {
        self.farm.record(JOB).unwrap().outcome
    }

    fn count(&self, kind: EventKind) -> usize {
        self.farm.record(JOB).unwrap().events.iter().filter(|event| event.kind == kind).count()
    }
}

fn spec(assign: Assign, min_nodes: u32) -> JobSpec {
    let costs = CostMap { cell: 64, columns: 1, rows: 1, seconds_per_pixel: vec![0.01] };
    JobSpec {
        probe: Probe::Known { costs, powers: BTreeMap::new() },
        split: Split::Grid { width: 16, height: 16 },
        assign,
        min_nodes,
        ..JobSpec::plain("bench", 64, 64, 4)
    }
}

fn send(node: u32, life: u64, message: ToNode) -> Command {
    Command::Send { node: NodeId(node), incarnation: Incarnation(life), message }
}

fn everything_to(node: u32, question: &Question) -> Answer {
    let (Question::Assign { parts, .. } | Question::Redistribute { parts, .. }) = question else { panic!("{question:?}") };
    Answer::Plan(parts.iter().map(|part| (part.id, NodeId(node))).collect::<Plan>())
}

#[test]
fn a_node_holds_what_its_lanes_render_and_one_more_each() {
    let bench = Bench::new(2, Assign::Paper);
    assert_eq!((bench.leases(0).len(), bench.leases(1).len()), (2, 2));
}

#[test]
fn a_node_that_fails_the_canary_gets_no_work_and_hears_why() {
    let mut bench = Bench::new(1, Assign::Paper);
    let info = NodeInfo { name: "odd".into(), lanes: 1, build: "b".into(), address: "a".into() };
    let (node, incarnation) = (NodeId(7), Incarnation(1));
    bench.does(Event::NodeJoined { node, incarnation, info });
    bench.does(Event::NodeProved { node, incarnation, canary: [8; 32] });
    let [Command::Close { reason, .. }] = &bench.said[..] else { panic!("{:?}", bench.said) };
    assert!(reason.contains("other bytes than the coordinator"), "{reason}");
    assert_eq!(bench.count(EventKind::Refused), 1);
    assert_eq!(bench.farm.nodes().iter().find(|known| known.id == node).unwrap().state, NodeState::Refused);
}

#[test]
fn the_same_delivery_twice_is_committed_once() {
    let mut bench = Bench::new(1, Assign::Paper);
    let lease = bench.leases(0)[0];
    bench.rendered(0, 1, lease);
    assert_eq!(bench.commits(), [lease]);
    bench.rendered(0, 1, lease);
    assert_eq!((bench.commits(), bench.discards()), (vec![], vec![DiscardReason::Committed]));
    bench.does(Event::Committed { job: JOB, lease });
    bench.does(Event::Committed { job: JOB, lease });
    assert_eq!(bench.farm.jobs()[0].committed, 1);
    bench.rendered(0, 1, LeaseId(999));
    assert_eq!(bench.discards(), [DiscardReason::Unknown]);
}

#[test]
fn the_suspected_may_still_deliver_and_the_other_attempt_is_called_back() {
    let mut bench = Bench::new(2, Assign::Paper);
    let old = bench.leases(1);
    bench.passes(0.7, &[0]);
    assert_eq!((bench.count(EventKind::Suspected), bench.count(EventKind::Reassigned)), (1, 1));
    // Node 0 works until it holds the part that node 1 had begun.
    let part = |bench: &Bench, lease: LeaseId| {
        let record = bench.farm.record(JOB).unwrap();
        record.parts.iter().find(|part| part.attempts.iter().any(|a| a.lease == lease.0)).unwrap().clone()
    };
    while !part(&bench, old[0]).attempts.iter().any(|a| a.node.0 == 0) {
        let lease = bench.leases(0)[0];
        bench.rendered(0, 1, lease);
    }
    let rival = LeaseId(part(&bench, old[0]).attempts.iter().find(|a| a.node.0 == 0).unwrap().lease);
    bench.rendered(1, 1, old[0]);
    assert_eq!(bench.commits(), [old[0]]);
    assert!(bench.said.contains(&send(0, 1, ToNode::Cancel { job: JOB, lease: rival })));
    assert_eq!(bench.count(EventKind::Recovered), 1);
    bench.rendered(0, 1, rival);
    assert_eq!(bench.discards(), [DiscardReason::Committed]);
}

#[test]
fn the_dead_have_nothing_to_say() {
    let mut bench = Bench::new(2, Assign::Paper);
    let old = bench.leases(1)[0];
    bench.passes(10.2, &[0]);
    assert!(bench.said.iter().any(|command| matches!(command, Command::Close { node: NodeId(1), .. })));
    bench.rendered(1, 1, old);
    assert_eq!((bench.commits(), bench.discards()), (vec![], vec![DiscardReason::Dead]));
    let info = NodeInfo { name: "n1".into(), lanes: 1, build: "b".into(), address: "a".into() };
    bench.does(Event::NodeJoined { node: NodeId(1), incarnation: Incarnation(1), info });
    assert!(matches!(&bench.said[..], [Command::Close { reason, .. }] if reason.contains("welcome with a new one")));
}

#[test]
fn a_new_life_voids_the_old_one_at_once() {
    let mut bench = Bench::new(2, Assign::Paper);
    let old = bench.leases(1)[0];
    bench.ready(1, 2);
    assert!(bench.said.contains(&send(1, 2, ToNode::Prepare { job: JOB })));
    bench.rendered(1, 1, old);
    assert_eq!(bench.discards(), [DiscardReason::Dead]);
    assert_eq!((bench.count(EventKind::Lost), bench.count(EventKind::Suspected)), (1, 0));
}

#[test]
fn a_goodbye_redistributes_at_once() {
    let mut bench = Bench::new(2, Assign::Naive);
    bench.does(Event::NodeLeft { node: NodeId(0), incarnation: Incarnation(1), reason: "bye".into() });
    assert_eq!(bench.farm.nodes()[1].queued + bench.farm.nodes()[1].holds, 16);
}

/// Orders of attempts that count, and of those that do not any more because their lane seems to hang.
#[test]
fn orders_are_repeated_when_a_connection_is_renewed() {
    for (seconds, overdue) in [(0.0, 0), (60.0, 1)] {
        let mut bench = Bench::new(1, Assign::Paper);
        bench.passes(seconds, &[0]);
        assert_eq!(bench.count(EventKind::Overdue), overdue);
        let open = bench.leases(0);
        let info = NodeInfo { name: "n0".into(), lanes: 1, build: "b".into(), address: "elsewhere".into() };
        bench.does(Event::NodeJoined { node: NodeId(0), incarnation: Incarnation(1), info });
        let again =
            |command: &Command| matches!(command, Command::Send { message: ToNode::Render { lease, .. }, .. } if open.contains(lease));
        assert_eq!(bench.said.iter().filter(|command| again(command)).count(), 2);
        assert_eq!(bench.count(EventKind::Lost), 0);
    }
}

/// Two nodes are asked for, the prepared one dies while the other one still compiles: nothing is due before that one answers.
#[test]
fn a_prepared_node_that_dies_takes_its_deadline_with_it() {
    let mut bench = Bench { farm: Farm::new(FarmConfig::default()), now: Duration::ZERO, said: Vec::new() };
    bench.does(Event::Restarted { build: BUILD, stored: Vec::new() });
    bench.does(Event::JobSubmitted { job: JOB, spec: spec(Assign::Paper, 2) });
    (0..2).for_each(|node| bench.ready(node, 1));
    bench.prepared(0, 1);
    bench.does(Event::NodeLeft { node: NodeId(0), incarnation: Incarnation(1), reason: "bye".into() });
    bench.passes(6.0, &[1]);
    assert_eq!(bench.count(EventKind::ProbeStarted) + bench.count(EventKind::RenderStarted), 0);
    bench.prepared(1, 1);
    assert_eq!(bench.count(EventKind::ProbeStarted), 1);
}

#[test]
fn jobs_run_one_after_the_other_and_cancelling_releases_everything() {
    let mut bench = Bench::new(1, Assign::Paper);
    bench.does(Event::JobSubmitted { job: JobId(2), spec: spec(Assign::Paper, 1) });
    assert_eq!((bench.said.len(), bench.farm.jobs()[1].phase), (0, JobPhase::Waiting));
    bench.does(Event::JobCancelled { job: JOB, reason: "enough".into() });
    assert_eq!(
        bench.said,
        [
            send(0, 1, ToNode::Release { job: JOB }),
            Command::End { job: JOB, outcome: Outcome::Cancelled { reason: "enough".into() } },
            send(0, 1, ToNode::Prepare { job: JobId(2) }),
        ]
    );
    bench.does(Event::JobCancelled { job: JOB, reason: "again".into() });
    assert!(bench.said.is_empty());
}

#[test]
fn a_policy_that_fails_before_rendering_fails_the_job_with_its_message() {
    let bad = [Err("job.lua:3: no".to_owned()), Ok(Answer::Plan(Plan::from([(PartId(0), NodeId(0))]))), Ok(Answer::Split(Vec::new()))];
    let says = ["job.lua:3: no", "assign: the plan gives part 1 to no node; every part needs one", "assign: the answer is not a plan"];
    for (answer, message) in bad.into_iter().zip(says) {
        let mut bench = Bench::new(1, Assign::Script);
        let (id, _) = bench.question();
        bench.does(Event::PolicyAnswered { id, answer });
        assert_eq!(bench.outcome(), Some(Outcome::Failed { reason: message.into() }));
    }
    let mut late = Bench::new(1, Assign::Script);
    late.passes(limits::POLICY_PATIENCE.as_secs_f64() + 0.1, &[0]);
    assert!(matches!(late.outcome(), Some(Outcome::Failed { reason }) if reason.contains("took too long")));
}

#[test]
fn what_a_policy_gives_to_a_node_that_died_meanwhile_is_asked_again() {
    let mut bench = Bench::new(3, Assign::Script);
    let (id, question) = bench.question();
    bench.does(Event::NodeLeft { node: NodeId(1), incarnation: Incarnation(1), reason: "bye".into() });
    bench.does(Event::PolicyAnswered { id, answer: Ok(everything_to(1, &question)) });
    let (id, question) = bench.question();
    assert!(matches!(&question, Question::Redistribute { parts, nodes } if parts.len() == 16 && nodes.len() == 2));
    bench.does(Event::PolicyAnswered { id, answer: Ok(everything_to(2, &question)) });
    assert_eq!(bench.farm.nodes()[2].queued + bench.farm.nodes()[2].holds, 16);
    assert_eq!(bench.count(EventKind::PolicyReplaced), 0);
}

#[test]
fn a_late_answer_to_a_redistribution_changes_nothing() {
    let mut bench = Bench::new(3, Assign::Script);
    let (id, question) = bench.question();
    bench.does(Event::PolicyAnswered { id, answer: Ok(everything_to(0, &question)) });
    bench.does(Event::NodeLeft { node: NodeId(0), incarnation: Incarnation(1), reason: "bye".into() });
    let (id, question) = bench.question();
    bench.passes(0.1, &[1, 2]);
    assert_eq!(bench.count(EventKind::PolicyReplaced), 1);
    let before = bench.farm.clone();
    bench.does(Event::PolicyAnswered { id, answer: Ok(everything_to(1, &question)) });
    assert_eq!(bench.farm.difference(&before), None);
}

#[test]
fn outputs_that_cannot_be_written_fail_the_job() {
    let mut bench = Bench::new(1, Assign::EarliestFinish);
    while let Some(lease) = bench.leases(0).first().copied() {
        bench.rendered(0, 1, lease);
        bench.does(Event::Committed { job: JOB, lease });
    }
    assert!(bench.said.contains(&Command::Assemble { job: JOB }));
    assert_eq!(bench.farm.committed(JOB).len(), 16);
    bench.does(Event::Assembled { job: JOB, result: Err("disk full".into()) });
    assert_eq!(bench.outcome(), Some(Outcome::Failed { reason: "disk full".into() }));
}
