//! What one step works with: the time, the limits, and the commands that it puts out.

use std::time::Duration;

use super::node::Node;
use super::{Command, FarmConfig, LeaseId, PolicyId, ToNode};
use crate::schedule::NodeId;

/// Restarts of the coordinator are counted in the upper bits of leases and questions, so that names given before a crash, but not journaled,
/// are never given again.
const EPOCH_SHIFT: u32 = 40;

#[derive(Clone, Debug)]
pub(super) struct Turn {
    pub config: FarmConfig,
    pub now: Duration,
    /// When the event at hand happened; before `now` where a journal tells of it belatedly.
    pub at: Duration,
    /// Whether deadlines may strike: only ticks let them, so that a journal of events replays exactly.
    pub ticks: bool,
    pub commands: Vec<Command>,
    pub last_name: u64,
}

impl Turn {
    pub fn new(config: FarmConfig) -> Self {
        Self { config, now: Duration::ZERO, at: Duration::ZERO, ticks: false, commands: Vec::new(), last_name: 0 }
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
