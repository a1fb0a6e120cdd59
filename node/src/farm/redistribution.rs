//! Parts lose their node and get another.

use std::collections::BTreeSet;

use super::job::{Job, Phase, Stage};
use super::node::{Held, Nodes};
use super::part::{Lease, Place, Role};
use super::turn::Turn;
use super::{LeaseId, Question};
use crate::manifest::{AttemptOutcome, EventKind};
use crate::schedule::assign;
use crate::schedule::{NodeId, Part, PartId, Plan};

impl Job {
    /// A node is silent: what it had to do goes to others. Its attempts may still end well.
    pub fn node_suspected(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId) {
        self.strip(turn, nodes, id, "its node was suspected");
        self.probe_without(turn, nodes, id);
    }

    /// A node is about to go: what its lanes have not begun goes to others.
    pub fn node_drains(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId) {
        let waiting = |lease: &LeaseId| self.leases.get(lease).is_some_and(|of| of.begun.is_none());
        let held: Vec<LeaseId> = nodes.get(&id).map(|node| node.held_of(self.id).filter(waiting).collect()).unwrap_or_default();
        let queued: Vec<PartId> = self.members.get(&id).map(|member| member.queue.iter().copied().collect()).unwrap_or_default();
        let mut parts = queued.clone();
        for lease in held {
            self.call_back(turn, nodes, lease);
            let Some((part, role)) = self.leases.get(&lease).map(|of| (of.part, of.role)) else { continue };
            self.close(turn, nodes, lease, AttemptOutcome::Cancelled, "its node is about to go");
            if role == Role::Main {
                self.loosen(part);
                parts.push(part);
            }
        }
        queued.into_iter().for_each(|part| self.unplace(part));
        if !parts.is_empty() {
            self.log.event(turn.now, EventKind::Reassigned, Some(id), parts, "its node is about to go");
        }
        self.probe_without(turn, nodes, id);
    }

    /// A node is heard again: attempts of it whose parts nobody has begun anew count again.
    pub fn node_recovered(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId) {
        let strays: Vec<(LeaseId, PartId)> =
            self.leases.iter().filter(|(_, lease)| lease.node == id).map(|(lease, of)| (*lease, of.part)).collect();
        for (lease, part) in strays {
            // Nobody would notice if a node whose lanes all hang did not get to it.
            let hangs = nodes.get(&id).is_none_or(|node| node.lanes() == 0 || node.hanging.contains(&(self.id, lease)));
            if !hangs && matches!(self.part(part).place, Place::Loose | Place::Queued(_)) {
                self.unplace(part);
                self.loose.remove(&part);
                self.part_mut(part).place = Place::Leased(lease);
                self.leases.entry(lease).and_modify(|lease| lease.role = Role::Main);
                let held = Held { job: self.id, lease, suspect: self.part(part).suspect };
                nodes.entry(id).and_modify(|node| node.held.push(held));
            }
        }
        if self.members.get(&id).is_some_and(|member| member.stage == Stage::Prepared) {
            self.probe_latecomer(turn, nodes, id);
        }
        self.note_begun(turn, nodes, id);
        self.look_for_due();
        self.enlist(turn, nodes, id);
    }

    /// The life of a node is over: nothing of it counts any more.
    /// If it `crashed`, it may have been for what its lanes rendered.
    pub fn node_lost(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId, reason: &str, crashed: bool) {
        self.strip(turn, nodes, id, "its node was lost");
        let void: Vec<(LeaseId, Lease)> =
            self.leases.iter().filter(|(_, lease)| lease.node == id).map(|(lease, of)| (*lease, of.clone())).collect();
        let mut blamed = BTreeSet::new();
        for (lease, of) in &void {
            self.close(turn, nodes, *lease, AttemptOutcome::Lost, reason);
            // A node dies once, however many attempts at a part it had.
            if crashed && of.begun.is_some() && of.role != Role::Audit && blamed.insert(of.part) {
                self.part_mut(of.part).failures.push((id, format!("it was lost meanwhile: {reason}")));
            }
        }
        if let Some(member) = self.members.get_mut(&id) {
            member.stage = Stage::Away;
        }
        self.probe_without(turn, nodes, id);
        void.into_iter().for_each(|(_, of)| self.consider_failures(turn, nodes, of.part));
    }

    /// Takes everything undelivered from a node.
    pub(super) fn strip(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId, why: &str) {
        let Some(queued) = self.members.get(&id).map(|member| member.queue.clone()) else { return };
        let held: Vec<LeaseId> = nodes.get(&id).map(|node| node.held_of(self.id).collect()).unwrap_or_default();
        let main = held.iter().filter_map(|lease| self.leases.get(lease)).filter(|lease| lease.role == Role::Main).map(|lease| lease.part);
        let parts: Vec<PartId> = main.chain(queued.iter().copied()).collect();
        held.into_iter().for_each(|lease| self.set_aside(turn, nodes, lease));
        queued.into_iter().for_each(|part| self.unplace(part));
        if !parts.is_empty() {
            self.log.event(turn.now, EventKind::Reassigned, Some(id), parts, why);
        }
    }

    /// Takes a part out of its queue, if it is in one, and makes it loose.
    pub(super) fn unplace(&mut self, part: PartId) {
        if let Place::Queued(node) = self.part(part).place {
            self.take_out(node, part);
        }
        self.part_mut(part).place = Place::Loose;
        self.loose.insert(part);
    }

    /// Gives loose parts to the nodes that are there, by the job's own policy.
    pub(super) fn redistribute(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        if self.phase != Phase::Rendering || self.loose.is_empty() || self.question.is_some() {
            return;
        }
        let (parts, powers) = (self.hardest_first(), self.usable_powers(nodes));
        if powers.is_empty() {
            return;
        }
        match self.built_in(nodes, &parts, &powers) {
            Some(plan) => self.take_redistribution(turn, nodes, &parts, &plan),
            None => self.ask(turn, Question::Redistribute { parts, nodes: powers }),
        }
    }

    /// Carries out a plan for loose parts, but gives no part to a node that failed at it while there is another.
    pub(super) fn take_redistribution(&mut self, turn: &mut Turn, nodes: &mut Nodes, parts: &[Part], plan: &Plan) {
        let mut plan = plan.clone();
        let failed = |part: &&Part| plan.get(&part.id).is_some_and(|node| self.part(part.id).failed_on(*node));
        for part in parts.iter().filter(failed).collect::<Vec<_>>() {
            let mut others = self.usable_powers(nodes);
            others.retain(|node| !self.part(part.id).failed_on(node.id));
            plan.extend(assign::earliest_finish(std::slice::from_ref(part), &others, &self.backlog(nodes)));
        }
        self.carry_out(nodes, &plan);
        self.redistribute(turn, nodes); // what a node got that was lost while the policy thought
    }

    /// The job's own policy failed, or is late: the built-in one decides.
    pub(super) fn replace_policy(&mut self, turn: &mut Turn, nodes: &mut Nodes, reason: &str) {
        self.log.event(turn.now, EventKind::PolicyReplaced, None, Vec::from_iter(self.loose.iter().copied()), reason);
        self.log.warn(format!("parts were redistributed by earliest_finish instead of the job's own policy: {reason}"));
        let (parts, powers) = (self.hardest_first(), self.usable_powers(nodes));
        let plan = assign::earliest_finish(&parts, &powers, &self.backlog(nodes));
        self.take_redistribution(turn, nodes, &parts, &plan);
    }
}
