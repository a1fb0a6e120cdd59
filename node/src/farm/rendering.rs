//! Parts are handed out, delivered and committed. A part is committed once, whoever else renders it too.

use super::job::{Job, Phase};
use super::node::Nodes;
use super::part::{Lease, Place};
use super::turn::Turn;
use super::{Command, DiscardReason, Farm, Incarnation, JobId, LeaseId, Outcome, ToNode};
use crate::limits::FAILURES_PER_PART;
use crate::manifest::{AttemptOutcome, EventKind};
use crate::schedule::{Assign, NodeId, PartId};

impl Farm {
    /// A node delivers a part. The shell holds the pixels, and must be told what becomes of them.
    pub(super) fn rendered(&mut self, node: NodeId, incarnation: Incarnation, job: JobId, lease: LeaseId, hash: [u8; 32], seconds: f64) {
        let alive = self.node_heard(node, incarnation);
        let known = self.jobs.get_mut(&job).filter(|job| job.outcome().is_none());
        let verdict = match known {
            _ if !alive => Err(DiscardReason::Dead),
            None => Err(DiscardReason::Unknown),
            Some(job) => job.deliver(&mut self.turn, &self.nodes, (node, incarnation), lease, hash, seconds),
        };
        if let Err(reason) = verdict {
            self.turn.put(Command::Discard { job, lease, reason });
        }
    }
}

impl Job {
    /// Takes the pixels of an attempt, if they are the first of their part.
    fn deliver(
        &mut self,
        turn: &mut Turn,
        nodes: &Nodes,
        by: (NodeId, Incarnation),
        lease: LeaseId,
        hash: [u8; 32],
        seconds: f64,
    ) -> Result<(), DiscardReason> {
        let Some(of) = self.leases.get(&lease).filter(|of| (of.node, of.incarnation) == by) else {
            return Err(self.why_unknown(lease));
        };
        let (part, now) = (of.part, turn.now);
        self.unplace(part);
        self.loose.remove(&part);
        self.release_lease(turn, lease);
        self.committing.insert(lease, part);
        let state = self.part_mut(part);
        state.place = Place::Committing(lease);
        state.hash = Some(hash);
        if let Some(attempt) = state.attempt_mut(lease) {
            (attempt.end, attempt.seconds) = (Some(now), Some(seconds));
        }
        let cost = state.cost;
        self.members.entry(by.0).and_modify(|member| member.note_pace(cost, seconds));
        self.cancel_others(turn, nodes, part);
        turn.put(Command::Commit { job: self.id, part, lease });
        Ok(())
    }

    /// An attempt that is not open: its part was delivered by another (or by itself, twice), or it never was.
    fn why_unknown(&self, lease: LeaseId) -> DiscardReason {
        let tried = |part: &&super::part::PartState| part.attempts.iter().any(|attempt| attempt.lease == lease);
        match self.parts.iter().find(tried) {
            Some(part) if part.is_delivered() => DiscardReason::Committed,
            _ => DiscardReason::Unknown,
        }
    }

    /// Calls back all open attempts at a part.
    fn cancel_others(&mut self, turn: &mut Turn, nodes: &Nodes, part: PartId) {
        let others: Vec<LeaseId> = self.leases.iter().filter(|(_, lease)| lease.part == part).map(|(lease, _)| *lease).collect();
        for lease in others {
            self.call_back(turn, nodes, lease);
            self.close(turn, lease, AttemptOutcome::Cancelled, "another attempt was first");
        }
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
    pub(super) fn close(&mut self, turn: &mut Turn, lease: LeaseId, outcome: AttemptOutcome, reason: &str) {
        if let Some(of) = self.release_lease(turn, lease) {
            self.part_mut(of.part).end_attempt(lease, turn.now, outcome, reason);
        }
    }

    /// Takes an attempt off the books; the next one of its node can have begun now.
    fn release_lease(&mut self, turn: &Turn, lease: LeaseId) -> Option<Lease> {
        let of = self.leases.remove(&lease)?;
        if let Some(member) = self.members.get_mut(&of.node) {
            member.held.retain(|held| *held != lease);
        }
        self.note_begun(turn, of.node);
        Some(of)
    }

    /// The first attempts that a node holds, as many as it has lanes, are taken to have begun.
    fn note_begun(&mut self, turn: &Turn, id: NodeId) {
        let Some(member) = self.members.get(&id) else { return };
        for lease in member.held.iter().take(member.info.lanes.max(1) as usize) {
            if let Some(lease) = self.leases.get_mut(lease) {
                lease.begun.get_or_insert(turn.now);
            }
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
        if self.committed == self.parts.len() {
            self.log.event(turn.now, EventKind::RenderFinished, None, Vec::new(), "");
            self.phase = Phase::Assembling;
            turn.put(Command::Assemble { job: self.id });
        }
    }

    /// A node could not render a part: others try.
    pub fn render_failed(&mut self, turn: &mut Turn, nodes: &Nodes, node: NodeId, lease: LeaseId, reason: &str) {
        let Some(of) = self.leases.get(&lease).filter(|of| of.node == node) else { return };
        let part = of.part;
        let counts = self.part(part).place == Place::Leased(lease);
        self.close(turn, lease, AttemptOutcome::Failed, reason);
        self.part_mut(part).failures.push((node, reason.to_owned()));
        if self.part(part).failures.len() >= FAILURES_PER_PART {
            return self.give_up(turn, nodes, part);
        }
        if counts {
            self.unplace(part);
            self.log.event(turn.now, EventKind::Reassigned, Some(node), vec![part], format!("failed: {reason}"));
        }
    }

    fn give_up(&mut self, turn: &mut Turn, nodes: &Nodes, part: PartId) {
        let name = |id: &NodeId| self.members.get(id).map_or_else(|| format!("node {}", id.0), |member| member.info.name.clone());
        let state = self.part(part);
        let reasons: Vec<String> = state.failures.iter().map(|(node, reason)| format!("{}: {reason}", name(node))).collect();
        let r = state.rect;
        let reason = format!(
            "part {} (x = {}, y = {}, width = {}, height = {}) failed {} times: {}",
            part.0,
            r.x,
            r.y,
            r.width,
            r.height,
            reasons.len(),
            reasons.join("; ")
        );
        self.end(turn, nodes, Outcome::Failed { reason });
    }

    pub(super) fn advance_rendering(&mut self, turn: &mut Turn, nodes: &Nodes) {
        if self.phase != Phase::Rendering {
            return;
        }
        self.redistribute(turn, nodes);
        let ids: Vec<NodeId> = self.members.keys().copied().collect();
        ids.iter().for_each(|id| self.fill(turn, nodes, *id));
        if self.spec.assign == Assign::EarliestFinish {
            self.steal(turn, nodes, &ids);
        }
    }

    /// Hands a node as many parts of its own queue as it may hold.
    pub(super) fn fill(&mut self, turn: &mut Turn, nodes: &Nodes, id: NodeId) {
        while self.has_room(turn, nodes, id) {
            let Some(part) = self.members.get_mut(&id).and_then(|member| member.queue.pop_front()) else { return };
            self.hand_over(turn, nodes, id, part);
        }
    }

    pub(super) fn has_room(&self, turn: &Turn, nodes: &Nodes, id: NodeId) -> bool {
        self.usable(nodes, id) && self.members.get(&id).is_some_and(|member| member.held.len() < member.capacity(&turn.config))
    }

    /// Hands a part, which is in no queue, to a node.
    pub(super) fn hand_over(&mut self, turn: &mut Turn, nodes: &Nodes, id: NodeId, part: PartId) {
        let (Some(member), Some(node)) = (self.members.get_mut(&id), nodes.get(&id)) else { return };
        let lease = turn.lease();
        member.held.push(lease);
        self.leases.insert(lease, Lease { part, node: id, incarnation: member.incarnation, begun: None });
        self.loose.remove(&part);
        let state = self.part_mut(part);
        state.place = Place::Leased(lease);
        state.begin_attempt(lease, id, turn.now);
        let rect = state.rect;
        self.note_begun(turn, id);
        self.log.first_lease.get_or_insert(turn.now);
        turn.send(id, node, ToNode::Render { job: self.id, lease, rect, samples: self.all_samples() });
    }
}
