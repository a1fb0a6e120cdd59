//! Nodes come, fall silent, are heard again, and go.

use std::time::Duration;

use super::auditing::quarantined;
use super::node::{Node, NodeState};
use super::{Command, Farm, FarmConfig, Incarnation, JobId, LeaseId, NodeInfo, ToNode};
use crate::limits::NODES;
use crate::manifest::EventKind;
use crate::schedule::NodeId;

impl Farm {
    /// A node connects. A new life voids the old one; the same life again is a node whose connection was renewed.
    pub(super) fn node_joined(&mut self, node: NodeId, incarnation: Incarnation, info: NodeInfo) {
        match self.nodes.get(&node) {
            Some(known) if known.lives(incarnation) => {
                self.node_heard(node, incarnation);
                return self.repeat_orders(node);
            }
            Some(known) if known.state == NodeState::Quarantined => {
                let reason = quarantined(&known.reason);
                return self.turn.put(Command::Close { node, incarnation, reason });
            }
            Some(known) if known.incarnation == incarnation => {
                let reason = format!("this life of the node is over ({}); it is welcome with a new one", known.reason);
                return self.turn.put(Command::Close { node, incarnation, reason });
            }
            Some(known) if known.state != NodeState::Lost => {
                let old = known.incarnation;
                self.lose(node, "it started anew", true);
                self.turn.put(Command::Close { node, incarnation: old, reason: "a newer life of this node has joined".into() });
            }
            None if self.nodes.len() >= NODES => {
                let reason = format!("the farm knows {NODES} nodes, and takes no more");
                return self.turn.put(Command::Close { node, incarnation, reason });
            }
            _ => {}
        }
        let (name, heard) = (info.name.clone(), self.turn.now);
        self.nodes.insert(node, Node::new(incarnation, info, heard));
        self.turn.roomy.insert(node);
        self.note(EventKind::Joined, node, format!("{name} joined"));
        self.send(node, ToNode::Prove);
    }

    /// A node has rendered the canary part: to what coordinators of this farm rendered it to, or not.
    pub(super) fn node_proved(&mut self, node: NodeId, incarnation: Incarnation, canary: [u8; 32]) {
        if !self.node_heard(node, incarnation) {
            return;
        }
        let mut builds = self.earlier_builds.iter().chain(&self.turn.build);
        let right = builds.any(|build| build.canary == canary);
        let Some(known) = self.nodes.get_mut(&node).filter(|known| known.state == NodeState::Proving) else { return };
        if right {
            known.proof = Some(canary);
            known.state = known.present();
            self.with_open(|job, turn, nodes| job.enlist(turn, nodes, node));
            return;
        }
        let reason = format!(
            "it renders the canary part to other bytes than the coordinator: its build ({}) or its processor computes differently; nodes are upgraded after their coordinator",
            known.info.build
        );
        known.state = NodeState::Refused;
        known.reason.clone_from(&reason);
        self.note(EventKind::Refused, node, reason.clone());
        self.turn.put(Command::Close { node, incarnation, reason });
    }

    /// A node is about to go: it gets nothing new, and gives back what its lanes have not begun.
    pub(super) fn node_drains(&mut self, node: NodeId, incarnation: Incarnation) {
        if !self.node_heard(node, incarnation) {
            return;
        }
        let Some(known) = self.nodes.get_mut(&node).filter(|known| !known.leaving) else { return };
        known.leaving = true;
        if known.proof.is_some() {
            known.state = NodeState::Draining;
        }
        self.note(EventKind::Draining, node, "it finishes what its lanes render, then goes".into());
        self.with_open(|job, turn, nodes| job.node_drains(turn, nodes, node));
    }

    /// Takes note of a sign of life; says whether this life goes on.
    pub(super) fn node_heard(&mut self, node: NodeId, incarnation: Incarnation) -> bool {
        let Some(known) = self.nodes.get_mut(&node).filter(|known| known.lives(incarnation)) else { return false };
        known.heard = known.heard.max(self.turn.at);
        if known.state == NodeState::Suspected {
            known.state = known.present();
            self.note(EventKind::Recovered, node, "heard again".into());
            self.with_open(|job, turn, nodes| job.node_recovered(turn, nodes, node));
        }
        true
    }

    pub(super) fn node_left(&mut self, node: NodeId, incarnation: Incarnation, reason: &str) {
        if self.nodes.get(&node).is_some_and(|known| known.lives(incarnation)) {
            self.lose(node, reason, false);
        }
    }

    /// Suspects the silent, and gives up those that are silent for long.
    pub(super) fn watch_nodes(&mut self) {
        let (now, config) = (self.turn.now, self.turn.config.clone());
        let silent: Vec<NodeId> = self.nodes.iter().filter(|(_, node)| node.is_due(&config, now)).map(|(id, _)| *id).collect();
        for id in silent {
            let Some(node) = self.nodes.get_mut(&id) else { continue };
            let silence = now.saturating_sub(node.heard).as_secs_f64();
            if now >= node.heard + config.dead_after {
                let (incarnation, reason) = (node.incarnation, format!("silent for {silence:.1} s"));
                self.lose(id, &reason, true);
                self.turn.put(Command::Close { node: id, incarnation, reason });
                continue;
            }
            node.state = NodeState::Suspected;
            self.note(EventKind::Suspected, id, format!("silent for {silence:.2} s"));
            self.with_open(|job, turn, nodes| job.node_suspected(turn, nodes, id));
        }
    }

    pub(super) fn next_silence(&self) -> Option<Duration> {
        self.nodes.values().filter_map(|node| node.next_silence(&self.turn.config)).min()
    }

    /// The life of a node is over: it `crashed`, for all that is known, or went.
    fn lose(&mut self, node: NodeId, reason: &str, crashed: bool) {
        let Some(known) = self.nodes.get_mut(&node) else { return };
        let refused = known.state == NodeState::Refused;
        known.state = NodeState::Lost;
        known.proof = None;
        known.leaving = false;
        known.heard = self.turn.now;
        known.reason = reason.to_owned();
        if !refused {
            self.note(EventKind::Lost, node, reason.to_owned());
        }
        let reason = reason.to_owned();
        // It may have died of what it was told to stop: then nothing else is to blame.
        let crashed = crashed && self.nodes.get(&node).is_some_and(|known| self.not_let_go(known).is_empty());
        self.with_open(|job, turn, nodes| job.node_lost(turn, nodes, node, &reason, crashed));
        self.nodes.entry(node).and_modify(Node::empty);
    }

    /// Attempts that do not count any more, and that a node, told to stop them, may still be at.
    pub(super) fn not_let_go(&self, node: &Node) -> Vec<(JobId, LeaseId)> {
        let open = |job: &JobId, lease| self.jobs.get(job).is_some_and(|job| job.leases.contains_key(lease));
        node.hanging.iter().filter(|(job, lease)| !open(job, lease)).copied().collect()
    }

    fn note(&mut self, kind: EventKind, node: NodeId, detail: String) {
        self.with_open(|job, turn, _| job.log.event(turn.now, kind, Some(node), Vec::new(), detail.clone()));
    }

    fn send(&mut self, node: NodeId, message: ToNode) {
        if let Some(to) = self.nodes.get(&node) {
            self.turn.send(node, to, message);
        }
    }
}

impl Node {
    /// When its silence will mean more than it does now.
    fn next_silence(&self, config: &FarmConfig) -> Option<Duration> {
        match self.state {
            NodeState::Proving | NodeState::Ready | NodeState::Draining => Some(self.heard + config.suspect_after),
            NodeState::Suspected | NodeState::Refused => Some(self.heard + config.dead_after),
            NodeState::Lost | NodeState::Quarantined => None,
        }
    }

    fn is_due(&self, config: &FarmConfig, now: Duration) -> bool {
        self.next_silence(config).is_some_and(|deadline| now >= deadline)
    }
}
