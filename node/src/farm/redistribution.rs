//! Parts lose their node and get another.

use super::job::{Job, Phase, Stage};
use super::node::Nodes;
use super::part::{Lease, Place, Role};
use super::turn::Turn;
use super::{LeaseId, Question};
use crate::manifest::{AttemptOutcome, EventKind};
use crate::schedule::assign;
use crate::schedule::{NodeId, Part, PartId, Plan};

impl Job {
    /// A node is silent: what it had to do goes to others. Its attempts may still end well.
    pub fn node_suspected(&mut self, turn: &mut Turn, nodes: &Nodes, id: NodeId) {
        self.strip(turn, id, "its node was suspected");
        self.probe_without(turn, nodes, id);
    }

    /// A node is heard again: attempts of it whose parts nobody has begun anew count again.
    pub fn node_recovered(&mut self, turn: &mut Turn, nodes: &Nodes, id: NodeId) {
        let strays: Vec<(LeaseId, PartId)> =
            self.leases.iter().filter(|(_, lease)| lease.node == id).map(|(lease, of)| (*lease, of.part)).collect();
        for (lease, part) in strays {
            let hangs = self.members.get(&id).is_some_and(|member| member.hanging.contains(&lease));
            if !hangs && matches!(self.part(part).place, Place::Loose | Place::Queued(_)) {
                self.unplace(part);
                self.loose.remove(&part);
                self.part_mut(part).place = Place::Leased(lease);
                self.leases.entry(lease).and_modify(|lease| lease.role = Role::Main);
                self.members.entry(id).and_modify(|member| member.held.push(lease));
            }
        }
        if self.members.get(&id).is_some_and(|member| member.stage == Stage::Prepared) {
            self.probe_latecomer(turn, nodes, id);
        }
        self.enlist(turn, nodes, id);
    }

    /// The life of a node is over: nothing of it counts any more.
    /// If it `crashed`, it may have been for what its lanes rendered.
    pub fn node_lost(&mut self, turn: &mut Turn, nodes: &Nodes, id: NodeId, reason: &str, crashed: bool) {
        self.strip(turn, id, "its node was lost");
        let void: Vec<(LeaseId, Lease)> =
            self.leases.iter().filter(|(_, lease)| lease.node == id).map(|(lease, of)| (*lease, of.clone())).collect();
        for (lease, of) in &void {
            self.close(turn, *lease, AttemptOutcome::Lost, reason);
            if crashed && of.begun.is_some() && of.role != Role::Audit {
                self.part_mut(of.part).failures.push((id, format!("it was lost meanwhile: {reason}")));
            }
        }
        if let Some(member) = self.members.get_mut(&id) {
            member.stage = Stage::Away;
            member.hanging.clear();
        }
        self.probe_without(turn, nodes, id);
        void.into_iter().for_each(|(_, of)| self.consider_failures(turn, nodes, of.part));
    }

    /// Takes everything undelivered from a node.
    pub(super) fn strip(&mut self, turn: &mut Turn, id: NodeId, why: &str) {
        let Some(member) = self.members.get_mut(&id) else { return };
        let (held, queued) = (std::mem::take(&mut member.held), member.queue.clone());
        let main = held.iter().filter_map(|lease| self.leases.get(lease)).filter(|lease| lease.role == Role::Main).map(|lease| lease.part);
        let parts: Vec<PartId> = main.chain(queued.iter().copied()).collect();
        held.into_iter().for_each(|lease| self.set_aside(lease));
        queued.into_iter().for_each(|part| self.unplace(part));
        if !parts.is_empty() {
            self.log.event(turn.now, EventKind::Reassigned, Some(id), parts, why);
        }
    }

    /// Takes a part out of its queue, if it is in one, and makes it loose.
    pub(super) fn unplace(&mut self, part: PartId) {
        if let Place::Queued(node) = self.part(part).place
            && let Some(member) = self.members.get_mut(&node)
        {
            member.queue.retain(|queued| *queued != part);
        }
        self.part_mut(part).place = Place::Loose;
        self.loose.insert(part);
    }

    /// Gives loose parts to the nodes that are there, by the job's own policy.
    pub(super) fn redistribute(&mut self, turn: &mut Turn, nodes: &Nodes) {
        if self.phase != Phase::Rendering || self.loose.is_empty() || self.question.is_some() {
            return;
        }
        let (parts, powers) = (self.hardest_first(), self.usable_powers(nodes));
        if powers.is_empty() {
            return;
        }
        match self.built_in(&parts, &powers) {
            Some(plan) => self.take_redistribution(turn, nodes, &parts, &plan),
            None => self.ask(turn, Question::Redistribute { parts, nodes: powers }),
        }
    }

    /// Carries out a plan for loose parts, but gives no part to a node that failed at it while there is another.
    pub(super) fn take_redistribution(&mut self, turn: &mut Turn, nodes: &Nodes, parts: &[Part], plan: &Plan) {
        let mut plan = plan.clone();
        let failed = |part: &&Part| plan.get(&part.id).is_some_and(|node| self.part(part.id).failed_on(*node));
        for part in parts.iter().filter(failed).collect::<Vec<_>>() {
            let mut others = self.usable_powers(nodes);
            others.retain(|node| !self.part(part.id).failed_on(node.id));
            plan.extend(assign::earliest_finish(std::slice::from_ref(part), &others, &self.backlog()));
        }
        self.carry_out(nodes, &plan);
        self.redistribute(turn, nodes); // what a node got that was lost while the policy thought
    }

    /// The job's own policy failed, or is late: the built-in one decides.
    pub(super) fn replace_policy(&mut self, turn: &mut Turn, nodes: &Nodes, reason: &str) {
        self.log.event(turn.now, EventKind::PolicyReplaced, None, Vec::from_iter(self.loose.iter().copied()), reason);
        self.log.warn(format!("parts were redistributed by earliest_finish instead of the job's own policy: {reason}"));
        let (parts, powers) = (self.hardest_first(), self.usable_powers(nodes));
        let plan = assign::earliest_finish(&parts, &powers, &self.backlog());
        self.take_redistribution(turn, nodes, &parts, &plan);
    }
}
