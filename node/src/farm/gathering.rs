//! A job begins: nodes gather, fetch its assets and compile its scene.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::job::{Job, Member, Phase, Stage};
use super::node::Nodes;
use super::turn::Turn;
use super::{NodeState, Outcome, ToNode};
use crate::manifest::EventKind;
use crate::schedule::NodeId;

/// What a job waits for before its probe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Gathering {
    /// When it stops waiting for the nodes it asked for; `None` once it has.
    until: Option<Duration>,
    /// When nodes that still compile stop holding up the others.
    grace: Option<Duration>,
}

impl Gathering {
    pub fn next_deadline(&self) -> Option<Duration> {
        self.until.into_iter().chain(self.grace).min()
    }
}

impl Job {
    /// The job's turn has come.
    pub fn begin(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        self.build = turn.build;
        self.phase = Phase::Gathering(Gathering { until: Some(turn.now + turn.config.gather_timeout), grace: None });
        let ready: Vec<NodeId> = nodes.iter().filter(|(_, node)| node.is_ready()).map(|(id, _)| *id).collect();
        ready.into_iter().for_each(|node| self.enlist(turn, nodes, node));
    }

    /// A node is ready: it gets the scene, unless this life of it has it.
    pub fn enlist(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId) {
        let Some(node) = nodes.get(&id).filter(|node| node.is_ready() && self.is_of_build(node)) else { return };
        if self.members.get(&id).is_some_and(|member| member.incarnation == node.incarnation && member.stage != Stage::Away) {
            return;
        }
        let member = Member {
            incarnation: node.incarnation,
            info: node.info.clone(),
            stage: Stage::Preparing(turn.now),
            speed: None,
            probed: Vec::new(),
            pace: 1.0,
            queue: Default::default(),
            queued_cost: 0.0,
        };
        self.members.insert(id, member);
        turn.send(id, node, ToNode::Prepare { job: self.id });
    }

    /// A node has compiled the scene, or cannot; or it was to probe it, and has it no more.
    pub fn prepared(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId, result: Result<(), String>) {
        let Some(member) = self.members.get_mut(&id) else { return };
        match (&member.stage, result) {
            (Stage::Preparing(_), Ok(())) => {
                member.stage = Stage::Prepared;
                self.probe_latecomer(turn, nodes, id);
            }
            (Stage::Preparing(_), Err(reason)) => self.leave_out(turn, id, reason),
            (Stage::Prepared, Err(reason)) => {
                self.leave_out(turn, id, reason);
                self.probe_without(turn, nodes, id);
            }
            _ => {}
        }
    }

    /// A node that compiles for too long is left out.
    pub(super) fn watch_preparation(&mut self, turn: &mut Turn) {
        if !turn.ticks {
            return;
        }
        let limit = turn.config.prepare_timeout;
        let late = |member: &Member| matches!(member.stage, Stage::Preparing(since) if turn.strikes(since + limit));
        let late: Vec<NodeId> = self.members.iter().filter(|(_, member)| late(member)).map(|(id, _)| *id).collect();
        for id in late {
            self.leave_out(turn, id, format!("it did not compile the scene within {} s", limit.as_secs_f64()));
        }
    }

    fn leave_out(&mut self, turn: &Turn, id: NodeId, reason: String) {
        let Some(member) = self.members.get_mut(&id) else { return };
        self.log.warn(format!("node {} takes no part in the job: {reason}", member.info.name));
        self.log.event(turn.now, EventKind::Refused, Some(id), Vec::new(), reason.clone());
        member.stage = Stage::Failed(reason);
    }

    pub(super) fn advance_gathering(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        let Phase::Gathering(gathering) = &mut self.phase else { return };
        let stages: Vec<&Stage> = self
            .members
            .iter()
            .filter(|(id, member)| nodes.get(id).is_some_and(|node| node.is_ready() && node.incarnation == member.incarnation))
            .map(|(_, member)| &member.stage)
            .collect();
        let count = |wanted: fn(&Stage) -> bool| stages.iter().filter(|stage| wanted(stage)).count();
        let prepared = count(|stage| matches!(stage, Stage::Prepared));
        let preparing = count(|stage| matches!(stage, Stage::Preparing(_)));
        let enough = stages.len() >= self.spec.min_nodes as usize || gathering.until.is_none_or(|until| turn.strikes(until));
        if !enough {
            return;
        }
        gathering.until = None;
        if prepared == 0 {
            gathering.grace = None; // whoever was prepared is gone
            if preparing == 0 && stages.len() >= self.spec.min_nodes as usize {
                self.fail_if_nobody_can(turn, nodes);
            }
            return;
        }
        let grace = *gathering.grace.get_or_insert(turn.now + turn.config.prepare_grace);
        if preparing == 0 || turn.strikes(grace) {
            self.begin_probe(turn, nodes);
        }
    }

    /// As many nodes as the job asked for cannot render it, and no other is in sight.
    fn fail_if_nobody_can(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        let in_sight = nodes.values().any(|node| matches!(node.state, NodeState::Proving | NodeState::Suspected));
        if !in_sight {
            let reason = format!("no node can render it: {}", self.failures());
            self.end(turn, nodes, Outcome::Failed { reason });
        }
    }

    /// Why nodes cannot render this job.
    pub(super) fn failures(&self) -> String {
        let failure = |member: &Member| match &member.stage {
            Stage::Failed(reason) => Some(format!("{}: {reason}", member.info.name)),
            _ => None,
        };
        self.members.values().filter_map(failure).collect::<Vec<_>>().join("; ")
    }
}
