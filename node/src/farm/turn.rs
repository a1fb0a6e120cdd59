//! What one step works with: the time, the limits, and the commands that it puts out.

use std::{collections::BTreeSet, time::Duration};

use serde::{Deserialize, Serialize};

use super::node::Node;
use super::{Build, Command, FarmConfig, LeaseId, PolicyId, ToNode};
use crate::schedule::NodeId;

/// Restarts of the coordinator are counted in the upper bits of leases and questions, so that names given before a crash, but not journaled,
/// are never given again.
const EPOCH_SHIFT: u32 = 40;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Turn {
    #[serde(skip)]
    pub config: FarmConfig,
    pub now: Duration,
    /// When the event at hand happened; before `now` where a journal tells of it belatedly.
    #[serde(skip)]
    pub at: Duration,
    /// Whether deadlines may strike: only ticks let them, so that a journal of events replays exactly.
    #[serde(skip)]
    pub ticks: bool,
    #[serde(skip)]
    pub commands: Vec<Command>,
    pub last_name: u64,
    /// Attempts that the job at hand may still hand out, before others have their turn.
    #[serde(skip)]
    pub quota: usize,
    /// Attempts that it has handed out, and the seconds that lanes will take for them.
    #[serde(skip)]
    pub handed_out: (usize, f64),
    /// Nodes that may have room for an attempt; all others have none.
    pub roomy: BTreeSet<NodeId>,
    /// Whether a job has ended in this step.
    #[serde(skip)]
    pub ended: bool,
    /// What the coordinator is built of.
    pub build: Option<Build>,
    /// Nodes that let go of an attempt of one job and hold attempts of others, which may have begun now.
    #[serde(skip)]
    pub freed: BTreeSet<NodeId>,
    /// Nodes whose last lane hangs since this step.
    #[serde(skip)]
    pub stuck: BTreeSet<NodeId>,
}

impl Turn {
    pub fn new(config: FarmConfig) -> Self {
        Self {
            config,
            now: Duration::ZERO,
            at: Duration::ZERO,
            ticks: false,
            commands: Vec::new(),
            last_name: 0,
            quota: 0,
            handed_out: (0, 0.0),
            roomy: BTreeSet::new(),
            ended: false,
            build: None,
            freed: BTreeSet::new(),
            stuck: BTreeSet::new(),
        }
    }

    /// Whether a deadline strikes in this step.
    pub fn strikes(&self, deadline: Duration) -> bool {
        self.ticks && self.now >= deadline
    }

    pub fn put(&mut self, command: Command) {
        self.commands.push(command);
    }

    pub fn send(&mut self, node: NodeId, to: &Node, message: ToNode) {
        self.put(Command::Send { node, incarnation: to.incarnation, message });
    }

    pub fn lease(&mut self) -> LeaseId {
        self.last_name += 1;
        LeaseId(self.last_name)
    }

    pub fn question(&mut self) -> PolicyId {
        self.last_name += 1;
        PolicyId(self.last_name)
    }

    pub fn next_epoch(&mut self) {
        self.last_name = ((self.last_name >> EPOCH_SHIFT) + 1) << EPOCH_SHIFT;
    }
}
