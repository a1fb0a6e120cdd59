//! Attempts that take far longer than predicted: their lanes hang, or their parts are harder than they looked.
//!
//! Either way another lane tries too, and the first result counts. A lane that hangs gets no more work until it answers, and a node without
//! any other lane none at all. The part's cost is taken to be at least what it took by then, so that a part that is only hard is
//! tried again less and less eagerly.

use super::job::Job;
use super::node::Nodes;
use super::part::Role;
use super::turn::Turn;
use super::{Farm, Incarnation, JobId, LeaseId};
use crate::manifest::EventKind;
use crate::schedule::NodeId;

impl Farm {
    /// A node has stopped an attempt, as it was told: the lane goes on.
    pub(super) fn stopped(&mut self, node: NodeId, incarnation: Incarnation, job: JobId, lease: LeaseId) {
        if self.node_heard(node, incarnation) {
            self.lane_is_free(node, job, lease);
        }
    }

    /// A lane answered: it does not hang.
    pub(super) fn lane_is_free(&mut self, id: NodeId, job: JobId, lease: LeaseId) {
        if self.nodes.get_mut(&id).is_some_and(|node| node.hanging.remove(&(job, lease))) {
            self.turn.freed.insert(id);
            self.turn.roomy.insert(id);
        }
    }
}

impl Job {
    pub(super) fn watch_progress(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        if !turn.ticks {
            return;
        }
        let late = |due: std::time::Duration| turn.strikes(due);
        let open = self.leases.iter().filter(|(_, lease)| lease.role != Role::Stray);
        let overdue: Vec<LeaseId> = open.filter(|(_, lease)| lease.due.is_some_and(late)).map(|(id, _)| *id).collect();
        overdue.into_iter().for_each(|lease| self.is_overdue(turn, nodes, lease));
        self.look_for_due();
    }

    /// When the next attempt will have taken suspiciously long.
    pub(super) fn look_for_due(&mut self) {
        self.next_due = self.leases.values().filter(|lease| lease.role != Role::Stray).filter_map(|lease| lease.due).min();
    }

    fn is_overdue(&mut self, turn: &mut Turn, nodes: &mut Nodes, lease: LeaseId) {
        let Some((part, node, begun)) = self.leases.get(&lease).map(|of| (of.part, of.node, of.begun)) else { return };
        let Some(member) = self.members.get(&node) else { return };
        let seconds = begun.map_or(0.0, |begun| turn.now.saturating_sub(begun).as_secs_f64());
        let took = seconds * member.lane_speed();
        let state = self.part_mut(part);
        let detail = format!("{seconds:.1} s for what should take {:.1} s", state.expected * seconds / took.max(f64::MIN_POSITIVE));
        state.expected = state.expected.max(took);
        self.log.event(turn.now, EventKind::Overdue, Some(node), vec![part], detail);
        self.take_to_hang(turn, nodes, node, lease);
        self.set_aside(turn, nodes, lease);
    }

    /// The lane of an attempt gets nothing before it answers; without another one, its node holds nothing.
    pub(super) fn take_to_hang(&self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId, lease: LeaseId) {
        let Some(node) = nodes.get_mut(&id) else { return };
        node.hanging.insert((self.id, lease));
        if node.lanes() == 0 {
            turn.stuck.insert(id);
        }
    }
}
