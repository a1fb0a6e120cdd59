//! Parts that nodes cannot render, or die of.
//!
//! A part that failed on several nodes is cut into quarters; a piece of it that fails is cut again at once, until what is left is small. What then
//! fails on several nodes still is left out: the rest of the picture is delivered, with a hole that is marked and reported.

use super::job::Job;
use super::node::Nodes;
use super::part::{Place, Role};
use super::tail::cut_up;
use super::turn::Turn;
use super::{LeaseId, Outcome};
use crate::limits::{HOLE_EDGE, NARROWED_PER_JOB};
use crate::manifest::{AttemptOutcome, EventKind};
use crate::schedule::{NodeId, PartId};

impl Job {
    /// A node could not render a part: others try.
    pub fn render_failed(&mut self, turn: &mut Turn, nodes: &mut Nodes, node: NodeId, lease: LeaseId, reason: &str) {
        let Some(of) = self.leases.get(&lease).filter(|of| of.node == node) else { return };
        let (part, role) = (of.part, of.role);
        self.close(turn, nodes, lease, AttemptOutcome::Failed, reason);
        self.part_mut(part).failures.push((node, reason.to_owned()));
        if role == Role::Main {
            self.loosen(part);
            self.log.event(turn.now, EventKind::Reassigned, Some(node), vec![part], format!("failed: {reason}"));
        }
        self.consider_failures(turn, nodes, part);
    }

    /// Cuts a part up, or gives it up, if it has failed too often.
    pub(super) fn consider_failures(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: PartId) {
        let part = self.part(id);
        let small = part.rect.width <= HOLE_EDGE && part.rect.height <= HOLE_EDGE;
        let enough = if part.suspect && !small { 1 } else { self.spec.attempts.max(1) as usize };
        if part.is_delivered() || part.is_settled() || part.failures.len() < enough {
            return;
        }
        let quarters = cut_up(part.rect, 4, HOLE_EDGE.div_ceil(2));
        self.narrowed += 1;
        if self.narrowed > NARROWED_PER_JOB {
            let reason = format!("{NARROWED_PER_JOB} parts could not be rendered: {}", self.first_failures());
            return self.end(turn, nodes, Outcome::Failed { reason });
        }
        self.await_lanes(turn, nodes, id);
        self.cancel_attempts(turn, nodes, id, "its part failed on others");
        let first = PartId(self.parts.len() as u32);
        if !small && self.replace(turn, id, &quarters, "because it failed") {
            self.parts[first.0 as usize..].iter_mut().for_each(|piece| piece.suspect = true);
        } else {
            self.give_up(turn, id);
        }
    }

    /// Lanes that still render a part that failed on others get nothing else before they let go of it: their nodes may be dying of it.
    fn await_lanes(&self, turn: &mut Turn, nodes: &mut Nodes, id: PartId) {
        for lease in self.open_attempts(id) {
            if let Some(of) = self.leases.get(&lease).filter(|of| of.begun.is_some()) {
                self.take_to_hang(turn, nodes, of.node, lease);
            }
        }
    }

    fn give_up(&mut self, turn: &Turn, id: PartId) {
        self.unplace(id);
        self.loose.remove(&id);
        self.part_mut(id).place = Place::Hole;
        self.dropped += 1;
        let why = self.told_failures(id);
        self.log.warn(format!("the picture has a hole: {why}"));
        self.log.event(turn.now, EventKind::LeftOut, None, vec![id], why);
    }

    /// The failures of the first part that has any.
    pub(super) fn first_failures(&self) -> String {
        let first = self
            .parts
            .iter()
            .find(|part| part.failures.len() >= self.spec.attempts as usize)
            .or_else(|| self.parts.iter().find(|part| !part.failures.is_empty()));
        first.map_or_else(|| "nobody says why".to_owned(), |part| self.told_failures(part.id))
    }

    fn told_failures(&self, id: PartId) -> String {
        let name = |id: &NodeId| self.members.get(id).map_or_else(|| format!("node {}", id.0), |member| member.info.name.clone());
        let state = self.part(id);
        let reasons: Vec<String> = state.failures.iter().map(|(node, reason)| format!("{}: {reason}", name(node))).collect();
        let r = state.rect;
        format!(
            "part {} (x = {}, y = {}, width = {}, height = {}) failed {} times: {}",
            id.0,
            r.x,
            r.y,
            r.width,
            r.height,
            reasons.len(),
            reasons.join("; ")
        )
    }
}
