//! The farm's core: a state machine without clocks, sockets, disks, threads or Lua. `step(now, event)` puts out commands.
//!
//! A job goes through phases, a file each: it waits its turn (`queue`), nodes gather and compile its scene (`gathering`), costs are measured
//! (`probing`), it is split and assigned (`planning`), its parts are handed out and come back (`rendering`, `delivering`), and it ends (`ending`).
//! Meanwhile parts move to who is free (`stealing`, `tail`) or still there (`redistribution`, `progress`), are cut up where nobody can render
//! them (`failing`), and are compared (`auditing`). Nodes come and go at any time (`presence`), connections and the coordinator itself begin anew (`restarting`), and
//! several jobs share the nodes (`queue`). Events change what is known; then `Job::advance` does all that has become possible.

mod auditing;
mod command;
mod config;
mod delivering;
mod depth;
mod ending;
mod event;
mod failing;
mod gathering;
mod id;
mod invariants;
mod job;
mod log;
mod node;
mod part;
mod planning;
mod presence;
mod probing;
mod progress;
mod queue;
mod record;
mod redistribution;
mod rendering;
mod restarting;
mod stealing;
mod tail;
#[cfg(test)]
mod tests;
mod turn;

use std::{collections::BTreeMap, time::Duration};

use serde::{Deserialize, Serialize};

pub use command::{Command, DiscardReason, Outcome, Question, ToNode};
pub use config::FarmConfig;
pub use event::{Answer, Build, Event, JobSpec, NodeInfo};
pub use id::{Incarnation, JobId, LeaseId, PolicyId};
pub use node::{NodeSnapshot, NodeState};
pub use record::{Fixed, JobPhase, JobRecord, JobSnapshot, PartPhase, PartSnapshot};

use delivering::Delivery;
use job::Job;
use node::Nodes;
use queue::Queue;
use turn::Turn;

/// The farm: nodes, and jobs that share them.
///
/// The shell calls [`Self::step`] with every event, in order, and carries out the commands in order; it sends [`Event::Tick`] when
/// [`Self::next_deadline`] is reached. Deadlines strike in ticks alone. The same events at the same times give the same commands and the same state.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Farm {
    turn: Turn,
    nodes: Nodes,
    jobs: BTreeMap<JobId, Job>,
    queue: Queue,
    /// Builds of earlier coordinators, of which jobs are that go on.
    earlier_builds: Vec<Build>,
}

impl Farm {
    /// A farm without nodes and jobs.
    pub fn new(config: FarmConfig) -> Self {
        Self { turn: Turn::new(config), nodes: Nodes::new(), jobs: BTreeMap::new(), queue: Queue::default(), earlier_builds: Vec::new() }
    }

    /// A farm that another process knew, with the timeouts of this one.
    pub fn resumed(mut self, config: FarmConfig) -> Self {
        self.turn.config = config;
        self
    }

    /// Takes note of an event at the moment `now` (since any fixed moment; it never goes back) and says what is to be done.
    pub fn step(&mut self, now: Duration, event: Event) -> Vec<Command> {
        self.turn.now = self.turn.now.max(now);
        self.turn.at = now;
        self.turn.ticks = event == Event::Tick;
        if let Event::NodeHeard { node, incarnation } = event
            && !self.is_suspected(node)
        {
            self.node_heard(node, incarnation); // by far the most frequent event, and it makes nothing possible
            return Vec::new();
        }
        match event {
            Event::JobSubmitted { job, spec } => self.job_submitted(job, spec),
            Event::JobCancelled { job, reason } => self.job_cancelled(job, reason),
            event @ (Event::JobPaused { .. } | Event::JobResumed { .. } | Event::JobRanked { .. }) => self.job_moved(event),
            Event::NodeJoined { node, incarnation, info } => self.node_joined(node, incarnation, info),
            Event::NodeProved { node, incarnation, canary } => self.node_proved(node, incarnation, canary),
            Event::NodeDraining { node, incarnation } => self.node_drains(node, incarnation),
            Event::NodeHeard { node, incarnation } => _ = self.node_heard(node, incarnation),
            Event::NodeLeft { node, incarnation, reason } => self.node_left(node, incarnation, &reason),
            Event::Restarted { build, stored } => self.restarted(build, &stored),
            Event::Tick => self.watch_nodes(),
            Event::PolicyAnswered { id, answer } => self.policy_answered(id, answer),
            Event::Prepared { node, incarnation, job, result } => {
                self.of_node(node, incarnation, job, |job, turn, nodes| job.prepared(turn, nodes, node, result))
            }
            Event::Probed { node, incarnation, job, cells } => {
                self.of_node(node, incarnation, job, |job, _, _| job.probed(node, &cells));
            }
            Event::Rendered { node, incarnation, job, lease, hash, seconds, invalid_samples } => {
                self.rendered(job, Delivery { node, incarnation, lease, hash, seconds, invalid_samples });
            }
            Event::RenderFailed { node, incarnation, job, lease, reason } => {
                self.stopped(node, incarnation, job, lease);
                self.of_node(node, incarnation, job, |job, turn, nodes| job.render_failed(turn, nodes, node, lease, &reason));
            }
            Event::Stopped { node, incarnation, job, lease } => self.stopped(node, incarnation, job, lease),
            Event::NodeReleased { node } => self.node_released(node),
            Event::PixelsLost { job, part, reason } => self.with_job(job, |job, turn, _| job.pixels_lost(turn, part, &reason)),
            Event::Committed { job, lease } => self.with_job(job, |job, turn, _| job.committed(turn, lease)),
            Event::Assembled { job, result } => self.with_job(job, |job, turn, nodes| job.assembled(turn, nodes, result)),
        }
        self.advance();
        std::mem::take(&mut self.turn.commands)
    }

    /// When the next [`Event::Tick`] is due; `None` while nothing but events can change anything.
    pub fn next_deadline(&self) -> Option<Duration> {
        let jobs = self.open_jobs().filter_map(|job| job.next_deadline(&self.turn.config));
        self.next_silence().into_iter().chain(jobs).min()
    }

    /// The farm's clock: the latest moment that it was told.
    pub fn now(&self) -> Duration {
        self.turn.now
    }

    /// Whether the lane of an attempt is taken to hang: then even an answer that comes too late to count tells something.
    pub fn hangs(&self, node: crate::schedule::NodeId, job: JobId, lease: LeaseId) -> bool {
        self.nodes.get(&node).is_some_and(|node| node.hanging.contains(&(job, lease)))
    }

    /// Whether a node is suspected: then a sign of life changes more than a time.
    pub fn is_suspected(&self, node: crate::schedule::NodeId) -> bool {
        self.nodes.get(&node).is_some_and(|node| node.state == NodeState::Suspected)
    }

    fn with_job(&mut self, id: JobId, act: impl FnOnce(&mut Job, &mut Turn, &mut Nodes)) {
        if let Some(job) = self.jobs.get_mut(&id).filter(|job| job.outcome().is_none()) {
            act(job, &mut self.turn, &mut self.nodes);
        }
    }

    fn with_open(&mut self, mut act: impl FnMut(&mut Job, &mut Turn, &mut Nodes)) {
        for id in &self.queue.open {
            if let Some(job) = self.jobs.get_mut(id).filter(|job| job.outcome().is_none()) {
                act(job, &mut self.turn, &mut self.nodes);
            }
        }
    }

    /// Handles what a node says of a job; it is a sign of life too. A life that is over has nothing to say.
    fn of_node(
        &mut self,
        node: crate::schedule::NodeId,
        incarnation: Incarnation,
        job: JobId,
        act: impl FnOnce(&mut Job, &mut Turn, &mut Nodes),
    ) {
        if self.node_heard(node, incarnation) {
            self.with_job(job, act);
        }
    }
}
