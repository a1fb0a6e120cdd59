//! Parts are delivered and committed. A part is committed once, whoever else renders it too.

use std::time::Duration;

use super::job::Job;
use super::node::Nodes;
use super::part::{Lease, PartState, Place, Role};
use super::turn::Turn;
use super::{Command, DiscardReason, Farm, Incarnation, JobId, LeaseId, ToNode};
use crate::limits::ATTEMPTS_LISTED_PER_PART;
use crate::manifest::AttemptOutcome;
use crate::schedule::{NodeId, PartId};

/// Pixels that a node hands in; the shell holds them.
#[derive(Clone, Copy)]
pub(super) struct Delivery {
    pub node: NodeId,
    pub incarnation: Incarnation,
    pub lease: LeaseId,
    pub hash: [u8; 32],
    pub seconds: f64,
    pub invalid_samples: u64,
}

impl Farm {
    /// A node delivers a part. The shell must be told what becomes of its pixels.
    pub(super) fn rendered(&mut self, job: JobId, delivery: Delivery) {
        let alive = self.node_heard(delivery.node, delivery.incarnation);
        self.lane_is_free(delivery.node, job, delivery.lease);
        let known = self.jobs.get_mut(&job).filter(|job| job.outcome().is_none());
        let verdict = match known {
            _ if !alive => Err(DiscardReason::Dead),
            None => Err(DiscardReason::Unknown),
            Some(job) => job.deliver(&mut self.turn, &mut self.nodes, delivery),
        };
        if let Err(reason) = verdict {
            self.turn.put(Command::Discard { job, lease: delivery.lease, reason });
        }
        self.punish(job);
    }
}

impl Job {
    /// Takes the pixels of an attempt, if they are the first of their part.
    fn deliver(&mut self, turn: &mut Turn, nodes: &mut Nodes, delivery: Delivery) -> Result<(), DiscardReason> {
        let Delivery { node, incarnation, lease, hash, seconds, invalid_samples } = delivery;
        let Some(of) = self.leases.get(&lease).filter(|of| (of.node, of.incarnation) == (node, incarnation)) else {
            return Err(self.why_unknown(lease));
        };
        let (part, now, is_audit) = (of.part, turn.now, self.part(of.part).is_delivered());
        let free = of.begun.map_or(Duration::ZERO, |begun| now.saturating_sub(begun));
        if let Some(known) = nodes.get_mut(&node).filter(|_| of.role != Role::Stray) {
            known.depth.note(free, seconds, known.deep_capacity(&turn.config));
        }
        self.release_lease(turn, nodes, lease);
        let state = self.part_mut(part);
        state.votes.push((node, hash));
        if let Some(attempt) = state.attempt_mut(lease) {
            (attempt.end, attempt.seconds) = (Some(now), Some(seconds));
        }
        let cost = state.cost;
        if seconds.is_finite() && seconds >= 0.0 {
            self.taken = (self.taken.0 + 1, self.taken.1 + seconds);
        }
        self.members.entry(node).and_modify(|member| member.note_pace(cost, seconds));
        if is_audit {
            self.compare(lease, part);
            return Err(DiscardReason::Compared);
        }
        let samples = self.spec.samples;
        self.unplace(part);
        self.loose.remove(&part);
        self.committing.insert(lease, part);
        let state = self.part_mut(part);
        // Who says more than there are does not tell the truth.
        (state.place, state.invalid_samples) = (Place::Committing(lease), invalid_samples.min(state.rect.area().saturating_mul(samples)));
        self.cancel_attempts(turn, nodes, part, "another attempt was first");
        self.choose_for_audit(part);
        turn.put(Command::Commit { job: self.id, part, lease });
        Ok(())
    }

    /// An attempt that is not open: its part was delivered by another (or by itself, twice), or it never was.
    fn why_unknown(&self, lease: LeaseId) -> DiscardReason {
        let tried = |part: &&PartState| part.attempts.iter().any(|attempt| attempt.lease == lease);
        match self.parts.iter().find(tried) {
            Some(part) if part.is_delivered() => DiscardReason::Committed,
            _ => DiscardReason::Unknown,
        }
    }

    /// The pixels of an attempt are on disk.
    pub fn committed(&mut self, turn: &mut Turn, lease: LeaseId) {
        let Some(id) = self.committing.remove(&lease) else { return };
        let part = self.part_mut(id);
        part.place = Place::Committed(lease);
        let cost = part.cost;
        if let Some(attempt) = part.attempt_mut(lease) {
            attempt.outcome = AttemptOutcome::Committed;
        }
        self.committed += 1;
        self.cost.1 += cost;
        self.log.last_commit = Some(turn.now);
    }

    /// Calls back all open attempts at a part.
    pub(super) fn cancel_attempts(&mut self, turn: &mut Turn, nodes: &mut Nodes, part: PartId, reason: &str) {
        for lease in self.open_attempts(part) {
            self.call_back(turn, nodes, lease);
            self.close(turn, nodes, lease, AttemptOutcome::Cancelled, reason);
        }
    }

    /// Attempts at a part that may still end well.
    pub(super) fn open_attempts(&self, part: PartId) -> Vec<LeaseId> {
        let state = self.part(part);
        if state.attempts.len() < ATTEMPTS_LISTED_PER_PART {
            return state.attempts.iter().map(|attempt| attempt.lease).filter(|lease| self.leases.contains_key(lease)).collect();
        }
        self.leases.iter().filter(|(_, lease)| lease.part == part).map(|(lease, _)| *lease).collect()
    }

    /// Tells the node of an attempt to stop it.
    pub(super) fn call_back(&mut self, turn: &mut Turn, nodes: &Nodes, lease: LeaseId) {
        if let Some(of) = self.leases.get(&lease)
            && let Some(node) = nodes.get(&of.node).filter(|node| node.lives(of.incarnation))
        {
            turn.send(of.node, node, ToNode::Cancel { job: self.id, lease });
        }
    }

    /// An attempt is over without a result.
    pub(super) fn close(&mut self, turn: &mut Turn, nodes: &mut Nodes, lease: LeaseId, outcome: AttemptOutcome, reason: &str) {
        if let Some(of) = self.release_lease(turn, nodes, lease) {
            self.part_mut(of.part).end_attempt(lease, turn.now, outcome, reason);
            if of.role == Role::Audit {
                self.audits.insert(of.part);
            }
        }
    }

    /// Takes an attempt off the books; the next one of its node can have begun now.
    pub(super) fn release_lease(&mut self, turn: &mut Turn, nodes: &mut Nodes, lease: LeaseId) -> Option<Lease> {
        let of = self.leases.remove(&lease)?;
        self.let_go(turn, nodes, of.node, lease);
        self.note_begun(turn, nodes, of.node);
        Some(of)
    }

    /// A node does not hold an attempt any more, as far as its lanes are concerned; what it holds of other jobs may have begun now.
    fn let_go(&self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId, lease: LeaseId) {
        if let Some(node) = nodes.get_mut(&id) {
            node.held.retain(|held| held.lease != lease);
            turn.roomy.insert(id);
            if node.held.iter().any(|held| held.job != self.id) {
                turn.freed.insert(id);
            }
        }
    }

    /// An attempt does not count any more, but may still end well. Its part goes to another, unless one is at it already.
    pub(super) fn set_aside(&mut self, turn: &mut Turn, nodes: &mut Nodes, lease: LeaseId) {
        let Some(of) = self.leases.get_mut(&lease) else { return };
        let (part, role, node) = (of.part, std::mem::replace(&mut of.role, Role::Stray), of.node);
        self.let_go(turn, nodes, node, lease);
        match role {
            Role::Main => self.loosen(part),
            Role::Audit => _ = self.audits.insert(part),
            Role::Spare | Role::Stray => {}
        }
    }

    /// The main attempt at a part is gone: its spare one takes over, or it has no node.
    pub(super) fn loosen(&mut self, part: PartId) {
        let is_spare = |id: &LeaseId| self.leases.get(id).is_some_and(|lease| lease.role == Role::Spare);
        let spare = self.open_attempts(part).into_iter().find(is_spare);
        match spare {
            Some(id) => {
                self.leases.entry(id).and_modify(|lease| lease.role = Role::Main);
                self.loose.remove(&part);
                self.part_mut(part).place = Place::Leased(id);
            }
            None => self.unplace(part),
        }
    }
}
