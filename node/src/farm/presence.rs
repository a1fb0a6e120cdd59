//! Nodes come, fall silent, are heard again, and go.

use std::time::Duration;

use super::auditing::quarantined;
use super::node::{Node, NodeState};
use super::{Command, Farm, FarmConfig, Incarnation, JobId, NodeInfo, ToNode};
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
        let joined = Node { incarnation, info, state: NodeState::Proving, proved: false, reason: String::new(), heard };
        self.nodes.insert(node, joined);
        self.note(EventKind::Joined, node, format!("{name} joined"));
        self.send(node, ToNode::Prove);
    }

    /// A renewed connection may have swallowed what was said before.
    fn repeat_orders(&mut self, node: NodeId) {
        if self.nodes.get(&node).is_some_and(|known| known.state == NodeState::Proving) {
            self.send(node, ToNode::Prove);
        }
        self.with_running(|job, turn, nodes| job.repeat_orders(turn, nodes, node));
    }

    pub(super) fn node_proved(&mut self, node: NodeId, incarnation: Incarnation, verdict: Result<(), String>) {
        if !self.node_heard(node, incarnation) {
            return;
        }
        let Some(known) = self.nodes.get_mut(&node).filter(|known| known.state == NodeState::Proving) else { return };
        match verdict {
            Ok(()) => {
                (known.state, known.proved) = (NodeState::Ready, true);
                self.with_running(|job, turn, nodes| job.enlist(turn, nodes, node));
            }
            Err(reason) => {
                known.state = NodeState::Refused;
                known.reason.clone_from(&reason);
                self.note(EventKind::Refused, node, reason.clone());
                self.turn.put(Command::Close { node, incarnation, reason });
            }
        }
    }

    /// Takes note of a sign of life; says whether this life goes on.
    pub(super) fn node_heard(&mut self, node: NodeId, incarnation: Incarnation) -> bool {
        let Some(known) = self.nodes.get_mut(&node).filter(|known| known.lives(incarnation)) else { return false };
        known.heard = known.heard.max(self.turn.at);
        if known.state == NodeState::Suspected {
            known.state = if known.proved { NodeState::Ready } else { NodeState::Proving };
            self.note(EventKind::Recovered, node, "heard again".into());
            self.with_running(|job, turn, nodes| job.node_recovered(turn, nodes, node));
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
            self.with_running(|job, turn, nodes| job.node_suspected(turn, nodes, id));
        }
    }

    pub(super) fn next_silence(&self) -> Option<Duration> {
        self.nodes.values().filter_map(|node| node.next_silence(&self.turn.config)).min()
    }

    /// The coordinator was started anew: no connection is left, and names that it gave without having them on disk must not come again.
    pub(super) fn restarted(&mut self) {
        self.turn.next_epoch();
        let now = self.turn.now;
        self.nodes.values_mut().for_each(|node| node.heard = now);
        let jobs: Vec<JobId> = self.jobs.keys().copied().collect();
        for job in jobs {
            self.with_job(job, |job, turn, _| job.restarted(turn));
        }
    }

    /// The life of a node is over: it `crashed`, for all that is known, or went.
    fn lose(&mut self, node: NodeId, reason: &str, crashed: bool) {
        let Some(known) = self.nodes.get_mut(&node) else { return };
        let refused = known.state == NodeState::Refused;
        known.state = NodeState::Lost;
        known.proved = false;
        known.heard = self.turn.now;
        known.reason = reason.to_owned();
        if !refused {
            self.note(EventKind::Lost, node, reason.to_owned());
        }
        let reason = reason.to_owned();
        self.with_running(|job, turn, nodes| job.node_lost(turn, nodes, node, &reason, crashed));
    }

    fn note(&mut self, kind: EventKind, node: NodeId, detail: String) {
        self.with_running(|job, turn, _| job.log.event(turn.now, kind, Some(node), Vec::new(), detail));
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
            NodeState::Proving | NodeState::Ready => Some(self.heard + config.suspect_after),
            NodeState::Suspected | NodeState::Refused => Some(self.heard + config.dead_after),
            NodeState::Lost | NodeState::Quarantined => None,
        }
    }

    fn is_due(&self, config: &FarmConfig, now: Duration) -> bool {
        self.next_silence(config).is_some_and(|deadline| now >= deadline)
    }
}
