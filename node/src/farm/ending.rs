//! Jobs end, or are left by all nodes.

use super::job::{Job, Phase, Stage};
use super::node::{Node, NodeState, Nodes};
use super::part::{PartState, Place};
use super::turn::Turn;
use super::{Build, Command, Outcome, ToNode};
use crate::manifest::AttemptOutcome;
use crate::schedule::NodeId;

impl Job {
    /// The job is over: everything that it holds is released.
    pub(super) fn end(&mut self, turn: &mut Turn, nodes: &mut Nodes, outcome: Outcome) {
        let open: Vec<_> = self.leases.keys().copied().collect();
        open.into_iter().for_each(|lease| self.close(turn, nodes, lease, AttemptOutcome::Cancelled, "the job is over"));
        for (id, member) in &mut self.members {
            member.queue.clear();
            member.queued_cost = 0.0;
            if let Some(node) = nodes.get(id).filter(|node| node.lives(member.incarnation) && member.stage != Stage::Away) {
                turn.send(*id, node, ToNode::Release { job: self.id });
            }
        }
        self.loose.clear();
        self.queued = 0;
        self.audits.clear();
        (self.reconsider, self.next_due) = (None, None);
        self.question = None;
        (self.deserted, self.gives_up) = (None, None);
        self.paused = false;
        self.log.ended = Some(turn.now);
        self.phase = Phase::Over(outcome.clone());
        turn.ended = true;
        turn.put(Command::End { job: self.id, outcome });
    }

    /// The output files stand, or cannot be written.
    pub fn assembled(&mut self, turn: &mut Turn, nodes: &mut Nodes, result: Result<(), String>) {
        if self.phase == Phase::Assembling {
            // Pixels were revoked meanwhile: the files are made again when they are here.
            if !self.is_settled() {
                self.phase = Phase::Rendering;
                return;
            }
            let holes = self.holes().count();
            let whole = if holes == 0 { Outcome::Finished } else { Outcome::Incomplete { holes } };
            self.end(turn, nodes, result.map_or_else(|reason| Outcome::Failed { reason }, |()| whole));
        }
    }

    /// Parts that nobody could render.
    pub(super) fn holes(&self) -> impl Iterator<Item = &PartState> {
        self.parts.iter().filter(|part| part.place == Place::Hole)
    }

    /// Fails a job that no node has been there for, for long.
    pub(super) fn watch_desertion(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        let able = |id: &NodeId| self.members.get(id).is_none_or(|member| !matches!(member.stage, Stage::Failed(_)));
        let delivered = !self.parts.is_empty() && self.parts.len() == self.committed + self.dropped + self.committing.len();
        let wants = !matches!(self.phase, Phase::Waiting | Phase::Assembling | Phase::Over(_)) && !delivered;
        let of_build = |node: &Node| node.proof.is_none() || self.is_of_build(node);
        // A lane that seems to hang may only be slow: that is reason enough to go elsewhere, but not to give up.
        let outdated = self.is_outdated(turn, nodes);
        let finishes = |node: &Node| node.state == NodeState::Draining && node.held_of(self.id).next().is_some();
        let works = |node: &Node| (node.is_hopeful() || finishes(node)) && (node.lanes() > 0 || !outdated);
        if !wants || self.paused || nodes.iter().any(|(id, node)| works(node) && of_build(node) && able(id)) {
            (self.deserted, self.gives_up) = (None, None);
            return;
        }
        let since = *self.deserted.get_or_insert(turn.now);
        let patience = self.spec.patience.unwrap_or(turn.config.no_node_timeout);
        let patience = if outdated { patience.min(turn.config.no_node_timeout) } else { patience };
        self.gives_up = Some(since + patience);
        if turn.strikes(since + patience) {
            if outdated {
                self.begin_anew(turn, nodes);
            } else {
                self.end(turn, nodes, Outcome::Failed { reason: self.desertion(patience.as_secs_f64()) });
            }
        }
    }

    /// Whether nodes of the coordinator's build are there, and it began on another.
    fn is_outdated(&self, turn: &Turn, nodes: &Nodes) -> bool {
        let current = |build: &Build| nodes.values().any(|node| node.is_ready() && node.proof == Some(build.canary));
        self.build != turn.build && turn.build.as_ref().is_some_and(current)
    }

    fn desertion(&self, seconds: f64) -> String {
        let what = match (self.members.is_empty(), self.members.values().all(|member| matches!(member.stage, Stage::Failed(_)))) {
            (true, _) => "no node joined".to_owned(),
            (_, true) => format!("no node can render it ({})", self.failures()),
            _ => "all nodes died".to_owned(),
        };
        let parts =
            if self.parts.is_empty() { String::new() } else { format!("; {} of {} parts were done", self.committed, self.parts.len()) };
        format!("{what}, and none came within {seconds} s{parts}")
    }
}
