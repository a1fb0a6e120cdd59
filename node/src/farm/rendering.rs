//! Parts are handed out to nodes.

use std::time::Duration;

use super::job::{Job, Phase};
use super::node::{Held, Node, Nodes};
use super::part::{Lease, Place, Role};
use super::turn::Turn;
use super::{Command, FarmConfig, Outcome, ToNode};
use crate::limits::{HELP_PAUSE_PER_NODE, OVERDUE_AFTER, OVERDUE_FACTOR};
use crate::manifest::EventKind;
use crate::schedule::{Assign, NodeId, PartId};

/// Bounds of what an attempt counts in its submitter's share, in seconds.
const LEAST_CHARGE: f64 = 1e-3;
const MOST_CHARGE: f64 = 1e5;

impl Job {
    pub(super) fn advance_rendering(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        if self.phase != Phase::Rendering {
            return;
        }
        self.watch_progress(turn, nodes);
        self.redistribute(turn, nodes);
        if self.queued > 0 {
            let roomy: Vec<NodeId> = turn.roomy.iter().copied().collect();
            roomy.into_iter().for_each(|id| self.fill(turn, nodes, id));
        }
        self.help_others(turn, nodes);
        self.finish(turn, nodes);
    }

    /// Nodes that run out help others. To look through all nodes for every part that comes in would take a large farm's coordinator more time than it
    /// has, so it is done now and then: the more nodes, the more rarely.
    fn help_others(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        self.reconsider = None;
        if turn.roomy.is_empty() || !self.may_hand_out(turn) {
            return;
        }
        if turn.now < self.help_after {
            self.reconsider = Some(self.help_after);
            return;
        }
        let helpers = self.not_full(turn, nodes);
        if helpers.is_empty() {
            return;
        }
        self.help_after = turn.now + HELP_PAUSE_PER_NODE * u32::try_from(self.members.len()).unwrap_or(u32::MAX);
        if matches!(self.spec.assign, Assign::EarliestFinish) {
            self.steal(turn, nodes, helpers);
        }
        self.audit(turn, nodes);
        if matches!(self.spec.assign, Assign::EarliestFinish | Assign::Script) {
            self.shorten_tail(turn, nodes);
        }
    }

    /// All pixels are here: files can be written.
    fn finish(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        if !self.is_settled() || self.parts.is_empty() || self.awaits_audit(nodes) {
            return;
        }
        self.give_up_audits(turn, nodes);
        if self.committed == 0 {
            let reason = format!("no part could be rendered: {}", self.first_failures());
            return self.end(turn, nodes, Outcome::Failed { reason });
        }
        self.log.event(turn.now, EventKind::RenderFinished, None, Vec::new(), "");
        (self.phase, self.reconsider, self.next_due) = (Phase::Assembling, None, None);
        turn.put(Command::Assemble { job: self.id });
    }

    /// Hands a node as many parts of its own queue as it may hold.
    pub(super) fn fill(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId) {
        while self.has_depth(turn, nodes, id) {
            let Some(part) = self.members.get(&id).and_then(|member| member.queue.front().copied()) else { return };
            if self.part(part).suspect && !self.is_alone(nodes, id) {
                return;
            }
            self.take_out(id, part);
            self.hand_over(turn, nodes, id, part);
        }
    }

    /// Whether a node may get a part of this job now.
    pub(super) fn has_room(&self, turn: &Turn, nodes: &Nodes, id: NodeId) -> bool {
        self.holds_less(turn, nodes, id, Node::capacity)
    }

    /// Whether a node may get a part of its own queue now.
    fn has_depth(&self, turn: &Turn, nodes: &Nodes, id: NodeId) -> bool {
        self.holds_less(turn, nodes, id, Node::deep_capacity)
    }

    fn holds_less(&self, turn: &Turn, nodes: &Nodes, id: NodeId, capacity: fn(&Node, &FarmConfig) -> usize) -> bool {
        let room = |node: &Node| node.held.len() < capacity(node, &turn.config) && !node.is_isolated();
        self.may_hand_out(turn) && self.usable(nodes, id) && nodes.get(&id).is_some_and(room)
    }

    /// Whether the job may hand out anything now.
    fn may_hand_out(&self, turn: &Turn) -> bool {
        !self.paused && turn.quota > 0
    }

    /// Whether a node holds nothing, so that no other part is blamed if it dies of one.
    pub(super) fn is_alone(&self, nodes: &Nodes, id: NodeId) -> bool {
        nodes.get(&id).is_some_and(|node| node.held.is_empty())
    }

    /// Whether a lane of a node has nothing to do.
    pub(super) fn is_idle(&self, turn: &Turn, nodes: &Nodes, id: NodeId) -> bool {
        let waits = self.members.get(&id).is_some_and(|member| !member.queue.is_empty());
        !waits && self.has_room(turn, nodes, id) && nodes.get(&id).is_some_and(|node| node.free_lanes() > 0)
    }

    /// Nodes that may get a part of this job now: at most moments a few among all.
    pub(super) fn not_full(&self, turn: &Turn, nodes: &Nodes) -> Vec<NodeId> {
        if !self.may_hand_out(turn) {
            return Vec::new();
        }
        turn.roomy.iter().copied().filter(|id| self.has_room(turn, nodes, *id)).collect()
    }

    /// Nodes that have nothing to do on some lane.
    pub(super) fn idle(&self, turn: &Turn, nodes: &Nodes) -> Vec<NodeId> {
        turn.roomy.iter().copied().filter(|id| self.is_idle(turn, nodes, *id)).collect()
    }

    /// Hands a part, which is in no queue, to a node.
    pub(super) fn hand_over(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId, part: PartId) {
        if let Some(lease) = self.lease(turn, nodes, id, part, Role::Main) {
            self.loose.remove(&part);
            self.part_mut(part).place = Place::Leased(lease);
        }
    }

    /// Seconds that lanes took for a part, on the average: measured by the farm, for a submitter could say anything of costs.
    fn usual_seconds(&self) -> Option<f64> {
        let (count, seconds) = self.taken;
        (count > 0).then(|| (seconds / f64::from(count)).clamp(LEAST_CHARGE, MOST_CHARGE))
    }

    /// Lets a node attempt a part.
    pub(super) fn lease(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId, part: PartId, role: Role) -> Option<super::LeaseId> {
        let node = nodes.get_mut(&id)?;
        let lease = turn.lease();
        self.leases.insert(lease, Lease { part, node: id, incarnation: node.incarnation, role, begun: None, due: None });
        let state = self.part_mut(part);
        state.begin_attempt(lease, id, turn.now);
        let (rect, suspect, seconds) = (state.rect, state.suspect, state.expected);
        let seconds = self.usual_seconds().unwrap_or(seconds.clamp(LEAST_CHARGE, MOST_CHARGE));
        node.held.push(Held { job: self.id, lease, suspect });
        if node.held.len() >= node.deep_capacity(&turn.config) {
            turn.roomy.remove(&id);
        }
        turn.quota = turn.quota.saturating_sub(1);
        turn.handed_out = (turn.handed_out.0 + 1, turn.handed_out.1 + seconds);
        turn.send(id, node, ToNode::Render { job: self.id, lease, rect, samples: self.all_samples() });
        self.note_begun(turn, nodes, id);
        self.log.first_lease.get_or_insert(turn.now);
        Some(lease)
    }

    /// The first attempts that a node holds, as many as it has lanes, are taken to have begun, of whatever job they are.
    pub(super) fn note_begun(&mut self, turn: &Turn, nodes: &Nodes, id: NodeId) {
        let (Some(member), Some(node)) = (self.members.get(&id), nodes.get(&id)) else { return };
        for held in node.held.iter().take(node.lanes()).filter(|held| held.job == self.id) {
            let Some(lease) = self.leases.get_mut(&held.lease).filter(|lease| lease.begun.is_none()) else { continue };
            let predicted = self.parts[lease.part.0 as usize].expected / member.lane_speed();
            let patience = OVERDUE_AFTER.as_secs_f64().max(predicted * OVERDUE_FACTOR).min(1e9);
            let due = turn.now + Duration::from_secs_f64(patience);
            (lease.begun, lease.due) = (Some(turn.now), Some(due));
            self.next_due = Some(self.next_due.map_or(due, |next| next.min(due)));
        }
    }
}
