//! A job: its phase, its nodes, its parts and its leases.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tessera_engine::part::SampleRange;

use super::gathering::Gathering;
use super::log::Log;
use super::node::{Node, Nodes};
use super::part::{Lease, PartState};
use super::planning::Pending;
use super::probing::{Pricing, Probing};
use super::turn::Turn;
use super::{Build, FarmConfig, Fixed, Incarnation, JobId, JobSpec, LeaseId, NodeInfo, Outcome};
use crate::schedule::{CostMap, NodeId, NodePower, PartId};

/// The share of a queue's cost below which what is left of it is summed up anew.
const LEAST_KEPT: f64 = 1e-6;

/// How far a job is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Phase {
    Waiting,
    Gathering(Gathering),
    Probing(Probing),
    Splitting,
    Assigning,
    Rendering,
    Assembling,
    Over(Outcome),
}

/// How far a node is with a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Stage {
    /// It compiles the scene, since then.
    Preparing(Duration),
    /// It cannot render this job.
    Failed(String),
    /// It can, but how fast is not known yet.
    Prepared,
    /// It gets work.
    Measured,
    /// It is lost.
    Away,
}

/// A node in a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Member {
    pub incarnation: Incarnation,
    pub info: NodeInfo,
    pub stage: Stage,
    /// Speed of a lane, relative to the reference, once it is known.
    pub speed: Option<f64>,
    pub probed: Vec<(u32, f64)>,
    /// Seconds that its latest parts took, over those predicted.
    pub pace: f64,
    /// Parts that wait for it, hardest first (on the film's order under the naive policy).
    pub queue: VecDeque<PartId>,
    /// Expected cost of those, up to rounding.
    pub queued_cost: f64,
}

impl Member {
    /// Throughput, once it is known (see [`crate::schedule::evaluate`]).
    pub fn power(&self) -> Option<f64> {
        self.speed.map(|speed| speed * f64::from(self.info.lanes.max(1)))
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Job {
    pub id: JobId,
    pub spec: JobSpec,
    pub phase: Phase,
    /// What nodes that render it have rendered the canary part to, once it has begun: its pixels are those of one build.
    pub build: Option<Build>,
    /// Whether nothing of it is handed out, for someone wants it to wait.
    pub paused: bool,
    /// What of its place in the queue an operator said.
    pub fixed: Fixed,
    pub members: BTreeMap<NodeId, Member>,
    pub pricing: Pricing,
    pub costs: CostMap,
    pub parts: Vec<PartState>,
    /// Parts with no node.
    pub loose: BTreeSet<PartId>,
    pub leases: BTreeMap<LeaseId, Lease>,
    /// Number of parts in the queues of all nodes.
    pub queued: usize,
    /// Attempts whose pixels are on their way to the disk, with their parts.
    pub committing: BTreeMap<LeaseId, PartId>,
    pub committed: usize,
    /// Parts that are replaced by smaller ones, or are holes.
    pub dropped: usize,
    /// Parts whose pixels another node is to render again, for comparison.
    pub audits: BTreeSet<PartId>,
    /// Nodes that delivered wrong pixels, with what is to be said of it, until the farm has dealt with them.
    pub offenders: Vec<(NodeId, String)>,
    /// Parts that were cut up, or given up, because nobody could render them.
    pub narrowed: usize,
    /// Cost of all parts, and of those on disk.
    pub cost: (f64, f64),
    /// Number of parts; they themselves are forgotten some time after the end.
    pub split_into: usize,
    /// The question to the job's own policy that is not answered yet.
    pub question: Option<Pending>,
    /// Since when no node is there that has, or may get, work.
    pub deserted: Option<Duration>,
    /// When nodes with nothing to do look again for something to take.
    pub reconsider: Option<Duration>,
    /// Parts that were delivered, and the seconds that lanes took for them.
    pub taken: (u32, f64),
    /// When it gives up waiting for a node.
    pub gives_up: Option<Duration>,
    /// When nodes that run out may help others again.
    pub help_after: Duration,
    /// When the next attempt will have taken suspiciously long.
    pub next_due: Option<Duration>,
    pub log: Log,
}

impl Job {
    pub fn new(id: JobId, spec: JobSpec, now: Duration) -> Self {
        Self {
            id,
            spec,
            phase: Phase::Waiting,
            build: None,
            paused: false,
            fixed: Fixed::default(),
            members: BTreeMap::new(),
            pricing: Pricing::Unknown,
            costs: CostMap::default(),
            parts: Vec::new(),
            loose: BTreeSet::new(),
            queued: 0,
            leases: BTreeMap::new(),
            committing: BTreeMap::new(),
            committed: 0,
            dropped: 0,
            audits: BTreeSet::new(),
            offenders: Vec::new(),
            narrowed: 0,
            cost: (0.0, 0.0),
            split_into: 0,
            reconsider: None,
            help_after: Duration::ZERO,
            taken: (0, 0.0),
            gives_up: None,
            next_due: None,
            question: None,
            deserted: None,
            log: Log { submitted: now, ..Log::default() },
        }
    }

    pub fn outcome(&self) -> Option<&Outcome> {
        if let Phase::Over(outcome) = &self.phase { Some(outcome) } else { None }
    }

    /// Forgets all but what the status page shows.
    pub fn forget_details(&mut self) {
        self.parts = Vec::new();
        self.members = BTreeMap::new();
        self.costs = CostMap::default();
        self.log.events = Vec::new();
    }

    /// Does all that has become possible.
    pub fn advance(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        self.watch_desertion(turn, nodes);
        self.watch_preparation(turn);
        self.watch_question(turn, nodes);
        self.advance_gathering(turn, nodes);
        self.advance_probing(turn, nodes);
        self.advance_planning(turn, nodes);
        self.advance_rendering(turn, nodes);
    }

    pub fn next_deadline(&self, config: &FarmConfig) -> Option<Duration> {
        let preparing = self.members.values().filter_map(|member| match member.stage {
            Stage::Preparing(since) => Some(since + config.prepare_timeout),
            _ => None,
        });
        let phase = match &self.phase {
            Phase::Gathering(gathering) => gathering.next_deadline(),
            Phase::Probing(probing) => probing.deadline,
            _ => None,
        };
        let question = self.question.as_ref().map(|question| question.deadline);
        preparing.chain(phase).chain(self.gives_up).chain(question).chain(self.reconsider).chain(self.next_due).min()
    }

    /// Nodes that get work now: there, with the scene, measured, and with a lane that works.
    pub fn usable(&self, nodes: &Nodes, id: NodeId) -> bool {
        let able = |member: &Member| member.stage == Stage::Measured;
        self.members.get(&id).is_some_and(able) && nodes.get(&id).is_some_and(|node| node.is_ready() && node.lanes() > 0)
    }

    /// Usable nodes with their power, most powerful first.
    pub fn usable_powers(&self, nodes: &Nodes) -> Vec<NodePower> {
        let mut powers = self.powers();
        powers.retain(|node| self.usable(nodes, node.id));
        crate::schedule::evaluate::rank(&mut powers);
        powers
    }

    /// All measured nodes with their power, in order of their ids.
    pub fn powers(&self) -> Vec<NodePower> {
        let power = |(id, member): (&NodeId, &Member)| {
            let (name, lanes) = (member.info.name.clone(), member.info.lanes);
            member.power().map(|power| NodePower { id: *id, name, lanes, power })
        };
        self.members.iter().filter_map(power).collect()
    }

    /// Whether a node has rendered the canary part as those that this job began on.
    pub fn is_of_build(&self, node: &Node) -> bool {
        node.proof.is_some() && node.proof == self.build.map(|build| build.canary)
    }

    /// Attempts of the job that a node holds, in the order in which they were handed out.
    pub fn held_by<'a>(&'a self, nodes: &'a Nodes, id: NodeId) -> impl DoubleEndedIterator<Item = &'a Lease> {
        nodes.get(&id).into_iter().flat_map(|node| node.held_of(self.id)).filter_map(|lease| self.leases.get(&lease))
    }

    /// Parts that no node holds.
    pub fn waiting_parts(&self) -> usize {
        self.loose.len() + self.queued
    }

    /// Puts a part at the end of the queue of a node.
    pub fn put_in(&mut self, id: NodeId, part: PartId) {
        let expected = self.part(part).expected;
        let Some(member) = self.members.get_mut(&id) else { return };
        member.queue.push_back(part);
        member.queued_cost += expected;
        self.queued += 1;
    }

    /// Takes a part out of the queue of a node: one near either end, as a rule.
    pub fn take_out(&mut self, id: NodeId, part: PartId) {
        let expected = self.part(part).expected;
        let Some(member) = self.members.get_mut(&id) else { return };
        let Some(at) = member.queue.iter().position(|queued| *queued == part) else { return };
        member.queue.remove(at);
        self.queued -= 1;
        let (all, left) = (member.queued_cost, member.queued_cost - expected);
        // Beside a part that was nearly all of it, what is left was lost in rounding.
        let kept = left > all * LEAST_KEPT;
        member.queued_cost = if kept { left } else { member.queue.iter().map(|part| self.parts[part.0 as usize].expected).sum() };
    }

    /// The samples of a whole part.
    pub fn all_samples(&self) -> SampleRange {
        SampleRange { first: self.spec.first_sample, count: self.spec.samples }
    }

    /// Whether every part is in the picture, or never will be.
    pub fn is_settled(&self) -> bool {
        self.committed + self.dropped == self.parts.len()
    }

    pub fn part(&self, id: PartId) -> &PartState {
        &self.parts[id.0 as usize]
    }

    pub fn part_mut(&mut self, id: PartId) -> &mut PartState {
        &mut self.parts[id.0 as usize]
    }
}
