//! Parts are handed out to nodes.

use super::job::{Job, Member, Phase};
use super::node::Nodes;
use super::part::{Lease, Place, Role};
use super::turn::Turn;
use super::{Command, Outcome, ToNode};
use crate::limits::{OVERDUE_AFTER, OVERDUE_FACTOR};
use crate::manifest::EventKind;
use crate::schedule::{Assign, NodeId, PartId};

impl Job {
    pub(super) fn advance_rendering(&mut self, turn: &mut Turn, nodes: &Nodes) {
        if self.phase != Phase::Rendering {
            return;
        }
        self.watch_progress(turn, nodes);
        self.redistribute(turn, nodes);
        let ids: Vec<NodeId> = self.members.keys().copied().collect();
        ids.iter().for_each(|id| self.fill(turn, nodes, *id));
        self.reconsider = None;
        if matches!(self.spec.assign, Assign::EarliestFinish) {
            self.steal(turn, nodes, &ids);
        }
        self.audit(turn, nodes, &ids);
        if matches!(self.spec.assign, Assign::EarliestFinish | Assign::Script) {
            self.shorten_tail(turn, nodes, &ids);
        }
        self.next_due = self.leases.values().filter(|lease| lease.role != Role::Stray).filter_map(|lease| lease.due).min();
        self.finish(turn, nodes);
    }

    /// All pixels are here: files can be written.
    fn finish(&mut self, turn: &mut Turn, nodes: &Nodes) {
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
    pub(super) fn fill(&mut self, turn: &mut Turn, nodes: &Nodes, id: NodeId) {
        while self.has_room(turn, nodes, id) {
            let Some(member) = self.members.get_mut(&id) else { return };
            let Some(part) = member.queue.front().copied().filter(|part| member.held.is_empty() || !self.parts[part.0 as usize].suspect)
            else {
                return;
            };
            member.queue.pop_front();
            self.hand_over(turn, nodes, id, part);
        }
    }

    pub(super) fn has_room(&self, turn: &Turn, nodes: &Nodes, id: NodeId) -> bool {
        let room = |member: &Member| member.held.len() < member.capacity(&turn.config) && !self.holds_suspect(member);
        self.usable(nodes, id) && self.members.get(&id).is_some_and(room)
    }

    /// Whether a node renders a part that it may die of: alone, so that no other part is blamed for it.
    fn holds_suspect(&self, member: &Member) -> bool {
        member.held.iter().filter_map(|lease| self.leases.get(lease)).any(|lease| self.part(lease.part).suspect)
    }

    /// Nodes that have nothing to do on some lane.
    pub(super) fn idle(&self, nodes: &Nodes, ids: &[NodeId]) -> Vec<NodeId> {
        let idle = |member: &Member| member.is_idle() && !self.holds_suspect(member);
        ids.iter().copied().filter(|id| self.usable(nodes, *id) && self.members.get(id).is_some_and(idle)).collect()
    }

    /// Hands a part, which is in no queue, to a node.
    pub(super) fn hand_over(&mut self, turn: &mut Turn, nodes: &Nodes, id: NodeId, part: PartId) {
        if let Some(lease) = self.lease(turn, nodes, id, part, Role::Main) {
            self.loose.remove(&part);
            self.part_mut(part).place = Place::Leased(lease);
        }
    }

    /// Lets a node attempt a part.
    pub(super) fn lease(&mut self, turn: &mut Turn, nodes: &Nodes, id: NodeId, part: PartId, role: Role) -> Option<super::LeaseId> {
        let (member, node) = (self.members.get_mut(&id)?, nodes.get(&id)?);
        let lease = turn.lease();
        member.held.push(lease);
        self.leases.insert(lease, Lease { part, node: id, incarnation: member.incarnation, role, begun: None, due: None });
        let state = self.part_mut(part);
        state.begin_attempt(lease, id, turn.now);
        let rect = state.rect;
        self.note_begun(turn, id);
        self.log.first_lease.get_or_insert(turn.now);
        turn.send(id, node, ToNode::Render { job: self.id, lease, rect, samples: self.all_samples() });
        Some(lease)
    }

    /// The first attempts that a node holds, as many as it has lanes, are taken to have begun.
    pub(super) fn note_begun(&mut self, turn: &Turn, id: NodeId) {
        let Some(member) = self.members.get(&id) else { return };
        for lease in member.held.iter().take(member.lanes()) {
            let Some(lease) = self.leases.get_mut(lease).filter(|lease| lease.begun.is_none()) else { continue };
            let predicted = self.parts[lease.part.0 as usize].expected / member.lane_speed();
            let patience = OVERDUE_AFTER.as_secs_f64().max(predicted * OVERDUE_FACTOR).min(1e9);
            lease.begun = Some(turn.now);
            lease.due = Some(turn.now + std::time::Duration::from_secs_f64(patience));
        }
    }
}
