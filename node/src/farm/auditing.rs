//! Wrong pixels: a share of the parts is rendered again on another node, and compared by hash.
//!
//! Where two nodes differ, a third one decides. A node that two others contradict is quarantined: it gets no work any more, and all that it
//! delivered is revoked and rendered again. With a share s audited, a node that got k parts wrong is found with a probability of 1 - (1 - s)^k.

use std::collections::BTreeSet;

use super::job::Job;
use super::node::{Node, NodeState, Nodes};
use super::part::{Place, Role};
use super::turn::Turn;
use super::{Command, Farm, JobId, LeaseId};
use crate::manifest::{AttemptOutcome, EventKind};
use crate::schedule::{NodeId, PartId};

impl Farm {
    /// Deals with nodes that delivered wrong pixels.
    pub(super) fn punish(&mut self, job: JobId) {
        let offenders = self.jobs.get_mut(&job).map(|job| std::mem::take(&mut job.offenders)).unwrap_or_default();
        for (node, reason) in offenders {
            let Some(known) = self.nodes.get_mut(&node).filter(|known| known.state != NodeState::Quarantined) else { continue };
            (known.state, known.heard) = (NodeState::Quarantined, self.turn.now);
            known.reason.clone_from(&reason);
            let incarnation = known.incarnation;
            self.with_open(|job, turn, nodes| job.distrust(turn, nodes, node, &reason));
            self.nodes.entry(node).and_modify(Node::empty);
            self.turn.put(Command::Close { node, incarnation, reason: quarantined(&reason) });
        }
    }

    /// An operator trusts a node again.
    pub(super) fn node_released(&mut self, node: NodeId) {
        if let Some(known) = self.nodes.get_mut(&node).filter(|known| known.state == NodeState::Quarantined) {
            (known.state, known.reason) = (NodeState::Lost, "released from quarantine".to_owned());
        }
    }
}

/// What a node in quarantine is told.
pub(super) fn quarantined(reason: &str) -> String {
    format!("this node is in quarantine: {reason}; test its memory and processor, then release it: tessera release NAME")
}

impl Job {
    /// Decides whether a part that was just delivered is to be rendered again for comparison: by its number, so that a replay decides alike.
    pub(super) fn choose_for_audit(&mut self, part: PartId) {
        let hash = blake3::hash(format!("{} {}", self.id.0, part.0).as_bytes());
        let number = u32::from_le_bytes(hash.as_bytes().first_chunk().copied().unwrap_or_default());
        if f64::from(number) < self.spec.audit * 2f64.powi(32) {
            self.audits.insert(part);
        }
    }

    /// Lets idle nodes render delivered parts again.
    pub(super) fn audit(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        if self.audits.is_empty() || !self.loose.is_empty() {
            return;
        }
        let mut busy = self.attempted();
        for id in self.idle(turn, nodes) {
            while self.is_idle(turn, nodes, id) {
                let free = |part: &PartId| self.may_audit(*part, id) && !busy.contains(&(*part, id));
                let Some(part) = self.audits.iter().copied().find(free) else { break };
                self.audits.remove(&part);
                busy.insert((part, id));
                self.lease(turn, nodes, id, part, Role::Audit);
            }
        }
    }

    fn may_audit(&self, part: PartId, id: NodeId) -> bool {
        !self.part(part).voted(id) && !self.part(part).failed_on(id)
    }

    /// Parts with the nodes that are at them, also in attempts that do not count any more: they need no second one there.
    fn attempted(&self) -> BTreeSet<(PartId, NodeId)> {
        self.leases.values().map(|lease| (lease.part, lease.node)).collect()
    }

    /// Whether a comparison is under way, or somebody is there for one.
    pub(super) fn awaits_audit(&self, nodes: &Nodes) -> bool {
        if self.audits.is_empty() && self.leases.is_empty() {
            return false;
        }
        let busy = self.attempted();
        let open = self.leases.values().any(|lease| lease.role == Role::Audit);
        let possible =
            |part: &PartId| nodes.keys().any(|id| self.usable(nodes, *id) && self.may_audit(*part, *id) && !busy.contains(&(*part, *id)));
        open || self.audits.iter().any(possible)
    }

    /// Nobody is left to compare with.
    pub(super) fn give_up_audits(&mut self, turn: &Turn, nodes: &Nodes) {
        let left = std::mem::take(&mut self.audits);
        let disputed = left.iter().filter(|part| self.part(**part).votes.len() > 1).count();
        if disputed > 0 {
            let who: Vec<&str> = nodes.values().map(|node| node.info.name.as_str()).collect();
            self.log.warn(format!(
                "{disputed} parts came out differently on two nodes, and there is no third to decide (nodes: {}): the picture may be wrong there",
                who.join(", ")
            ));
        }
        if left.len() > disputed {
            self.log.warn(format!("{} parts that were to be rendered twice were not: no other node was there", left.len() - disputed));
        }
        if !left.is_empty() {
            self.log.event(turn.now, EventKind::AuditSkipped, None, left.into_iter().collect(), "no other node was there");
        }
    }

    /// Compares the pixels of all that rendered a part.
    pub(super) fn compare(&mut self, lease: LeaseId, id: PartId) {
        let votes = self.part(id).votes.clone();
        let support = |hash: &[u8; 32]| votes.iter().filter(|(_, other)| other == hash).count();
        let agreed = votes.iter().all(|(_, hash)| *hash == votes[0].1);
        if let Some(attempt) = self.part_mut(id).attempt_mut(lease) {
            attempt.outcome = AttemptOutcome::Compared;
            attempt.reason = Some(if agreed { "the same pixels" } else { "other pixels than another node's" }.to_owned());
        }
        self.audits.remove(&id);
        if agreed {
            return;
        }
        match votes.iter().find(|(_, hash)| support(hash) > 1) {
            None => _ = self.audits.insert(id),
            Some((_, right)) => {
                let wrong = votes.iter().filter(|(_, hash)| hash != right);
                let reason = format!("its pixels of part {} differ from those of two other nodes", id.0);
                self.offenders.extend(wrong.map(|(node, _)| (*node, reason.clone())));
            }
        }
    }

    /// Nothing that a node delivered counts any more.
    fn distrust(&mut self, turn: &mut Turn, nodes: &mut Nodes, node: NodeId, reason: &str) {
        self.log.event(turn.now, EventKind::Quarantined, Some(node), Vec::new(), reason);
        let name = nodes.get(&node).map_or("?", |node| node.info.name.as_str());
        self.log.warn(format!("node {name} was quarantined: {reason}; what it had rendered was rendered again"));
        self.node_lost(turn, nodes, node, reason, false);
        let by = |part: &super::part::PartState| part.is_delivered() && part.votes.first().is_some_and(|(first, _)| *first == node);
        let theirs: Vec<PartId> = self.parts.iter().filter(|part| by(part)).map(|part| part.id).collect();
        theirs.iter().for_each(|part| self.revoke(turn, *part, AttemptOutcome::Revoked, reason));
        self.parts.iter_mut().for_each(|part| part.votes.retain(|(voter, _)| *voter != node));
        if !theirs.is_empty() {
            self.log.event(turn.now, EventKind::Revoked, Some(node), theirs, reason);
        }
    }

    /// The pixels of a delivered part do not count any more: it is rendered again.
    pub(super) fn revoke(&mut self, turn: &mut Turn, id: PartId, outcome: AttemptOutcome, reason: &str) {
        if let Some(lease) = self.take_back(id, outcome, reason) {
            turn.put(Command::Revoke { job: self.id, part: id, lease });
        }
    }

    /// Takes a delivered part off the books; returns the attempt whose pixels it had.
    pub(super) fn take_back(&mut self, id: PartId, outcome: AttemptOutcome, reason: &str) -> Option<LeaseId> {
        let lease = match self.part(id).place {
            Place::Committing(lease) => {
                self.committing.remove(&lease);
                lease
            }
            Place::Committed(lease) => {
                self.committed -= 1;
                self.cost.1 -= self.part(id).cost;
                lease
            }
            _ => return None,
        };
        let audits: Vec<LeaseId> = self.leases.iter().filter(|(_, of)| of.part == id).map(|(lease, _)| *lease).collect();
        audits.into_iter().for_each(|audit| self.become_spare(audit));
        self.audits.remove(&id);
        self.part_mut(id).lose_pixels(lease, outcome, reason);
        self.loosen(id);
        Some(lease)
    }

    /// A comparison that runs may as well be the part's new attempt.
    fn become_spare(&mut self, lease: LeaseId) {
        if let Some(of) = self.leases.get_mut(&lease).filter(|of| of.role == Role::Audit) {
            of.role = Role::Spare;
        }
    }

    /// Pixels that were on disk cannot be read back.
    pub fn pixels_lost(&mut self, turn: &mut Turn, id: PartId, reason: &str) {
        if (id.0 as usize) < self.parts.len() && self.part(id).committed_by().is_some() {
            self.revoke(turn, id, AttemptOutcome::Lost, reason);
            self.log.event(turn.now, EventKind::Revoked, None, vec![id], reason);
            self.phase = super::job::Phase::Rendering;
        }
    }
}
