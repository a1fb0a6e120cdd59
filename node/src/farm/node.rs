//! What the farm knows of a node, whatever job runs.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use serde::{Deserialize, Serialize};

use super::depth::Depth;
use super::{FarmConfig, Incarnation, JobId, LeaseId, NodeInfo};
use crate::schedule::NodeId;

/// All nodes that ever joined, by id.
pub(super) type Nodes = BTreeMap<NodeId, Node>;

/// A node in its latest life.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Node {
    pub incarnation: Incarnation,
    pub info: NodeInfo,
    pub state: NodeState,
    /// What it rendered the canary part to, once it proved itself: it gets work of jobs that began on the same build.
    pub proof: Option<[u8; 32]>,
    /// Whether it is about to go: it finishes what its lanes render, and gets nothing new.
    pub leaving: bool,
    /// Why it is refused or lost.
    pub reason: String,
    /// Last sign of life.
    pub heard: Duration,
    /// Attempts that it holds and that are not stray, of all jobs, in the order in which they were handed out.
    pub held: Vec<Held>,
    /// Attempts whose lanes are taken to hang: they took too long, or their parts failed on others.
    pub hanging: BTreeSet<(JobId, LeaseId)>,
    /// What it gets in advance.
    pub depth: Depth,
}

/// An attempt that a node holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Held {
    pub job: JobId,
    pub lease: LeaseId,
    /// Whether the node may die of its part.
    pub suspect: bool,
}

/// Where a node stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NodeState {
    /// It renders the canary part.
    Proving,
    /// It may get work.
    Ready,
    /// It finishes what its lanes render, then goes.
    Draining,
    /// It gets no work.
    Refused,
    /// It has been silent for too long; its parts went to others.
    Suspected,
    /// Its life is over.
    Lost,
    /// It delivered wrong pixels: it gets no work until an operator releases it.
    Quarantined,
}

impl Node {
    /// A node that joins.
    pub fn new(incarnation: Incarnation, info: NodeInfo, now: Duration) -> Self {
        Self {
            incarnation,
            info,
            state: NodeState::Proving,
            proof: None,
            leaving: false,
            reason: String::new(),
            heard: now,
            held: Vec::new(),
            hanging: BTreeSet::new(),
            depth: Depth::default(),
        }
    }

    /// Where it stands while it is heard.
    pub fn present(&self) -> NodeState {
        match (self.leaving, self.proof) {
            (true, _) => NodeState::Draining,
            (false, Some(_)) => NodeState::Ready,
            (false, None) => NodeState::Proving,
        }
    }

    /// Its life is over, and with it all that it held.
    pub fn empty(&mut self) {
        self.held.clear();
        self.hanging.clear();
    }

    /// Lanes that work.
    pub fn lanes(&self) -> usize {
        (self.info.lanes.max(1) as usize).saturating_sub(self.hanging.len())
    }

    /// Lanes that have nothing to do.
    pub fn free_lanes(&self) -> usize {
        self.lanes().saturating_sub(self.held.len())
    }

    /// Attempts that it may hold of whatever it gets: more than its lanes render, so that none waits for the network.
    pub fn capacity(&self, config: &FarmConfig) -> usize {
        self.lanes() * (1 + config.prefetch_per_lane)
    }

    /// Attempts that it may hold of its own queue: what is handed out can hardly be given to another any more.
    pub fn deep_capacity(&self, config: &FarmConfig) -> usize {
        self.capacity(config) + self.lanes() * self.depth.extra
    }

    /// Whether it renders a part that it may die of: alone, so that no other part is blamed for it.
    pub fn is_isolated(&self) -> bool {
        self.held.iter().any(|held| held.suspect)
    }

    /// Attempts of a job that it holds, in the order in which they were handed out.
    pub fn held_of(&self, job: JobId) -> impl DoubleEndedIterator<Item = LeaseId> {
        self.held.iter().filter(move |held| held.job == job).map(|held| held.lease)
    }

    /// Whether it may get work now.
    pub fn is_ready(&self) -> bool {
        self.state == NodeState::Ready
    }

    /// Whether it may get work now or soon.
    pub fn is_hopeful(&self) -> bool {
        matches!(self.state, NodeState::Proving | NodeState::Ready)
    }

    /// Whether this life of it goes on, as far as the farm knows.
    pub fn lives(&self, incarnation: Incarnation) -> bool {
        self.incarnation == incarnation && !matches!(self.state, NodeState::Lost | NodeState::Quarantined)
    }
}

/// A node, for the status page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NodeSnapshot {
    /// Its id.
    pub id: NodeId,
    /// Its life.
    pub incarnation: Incarnation,
    /// Its name.
    pub name: String,
    /// Rendering threads.
    pub lanes: u32,
    /// Version and engine revision.
    pub build: String,
    /// Where it connected from.
    pub address: String,
    /// Where it stands.
    pub state: NodeState,
    /// Why it is refused or lost; empty otherwise.
    pub reason: String,
    /// Throughput in the job that it renders, or else in the latest that measured it.
    pub power: Option<f64>,
    /// Parts it holds.
    pub holds: usize,
    /// Parts that wait for it.
    pub queued: usize,
}
