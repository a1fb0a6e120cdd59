//! What the farm knows of a node, whatever job runs.

use std::{collections::BTreeMap, time::Duration};

use serde::{Deserialize, Serialize};

use super::{Incarnation, NodeInfo};
use crate::schedule::NodeId;

/// All nodes that ever joined, by id.
pub(super) type Nodes = BTreeMap<NodeId, Node>;

/// A node in its latest life.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    pub incarnation: Incarnation,
    pub info: NodeInfo,
    pub state: NodeState,
    /// Whether it proved itself: what it is again when a suspicion turns out wrong.
    pub proved: bool,
    /// Why it is refused or lost.
    pub reason: String,
    /// Last sign of life.
    pub heard: Duration,
}

/// Where a node stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NodeState {
    /// It renders the canary part.
    Proving,
    /// It may get work.
    Ready,
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
    /// Throughput in the running job, once it is measured.
    pub power: Option<f64>,
    /// Parts it holds.
    pub holds: usize,
    /// Parts that wait for it.
    pub queued: usize,
}
