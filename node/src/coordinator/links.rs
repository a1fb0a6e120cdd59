//! Nodes and their connections, as the core's task knows them.

use std::time::Instant;

use tokio::sync::mpsc;

use super::{
    core::Core,
    input::{LinkId, Outgoing},
};
use crate::{
    farm::{Event, Incarnation, NodeInfo, NodeSnapshot, NodeState},
    limits::TWIN_SILENCE,
    schedule::NodeId,
    wire::{Hello, ToNode},
};

/// A node's latest connection.
pub struct Link {
    pub id: LinkId,
    pub incarnation: Incarnation,
    pub address: String,
    pub outgoing: mpsc::Sender<Outgoing>,
    /// When it last gave a sign of life, and whether it was suspected or given up since.
    pub heard: Instant,
    pub suspected: bool,
    pub dead: bool,
}

impl Link {
    /// Whether the process at its other end lives, beyond doubt.
    pub fn lives(&self) -> bool {
        !self.outgoing.is_closed() && self.heard.elapsed() < TWIN_SILENCE
    }
}

impl Core {
    pub(super) fn joined(&mut self, id: LinkId, name: String, hello: Hello, address: String, outgoing: mpsc::Sender<Outgoing>) {
        let next = NodeId(u32::try_from(self.ids.len()).unwrap_or(u32::MAX));
        let node = *self.ids.entry(name.clone()).or_insert(next);
        let incarnation = hello.incarnation;
        if let Some(twin) = self.links.get(&node).filter(|link| link.incarnation != incarnation && link.lives()) {
            let reason = format!(
                "another process with the key of {name} is connected, from {}: give each process a key of its own, or end one of them",
                twin.address
            );
            self.shared.metrics.refused_peers.inc();
            tracing::warn!(node = name, address, reason, "a node is turned away");
            let _ = outgoing.try_send(Outgoing::Close(reason));
            return;
        }
        tracing::info!(node = name, address, lanes = hello.lanes, build = hello.build, "a node joined");
        if self.links.get(&node).is_none_or(|link| link.incarnation != incarnation) {
            self.asked.forget_node(node);
        }
        self.nodes.insert(id, node);
        let link = Link { id, incarnation, outgoing, address: address.clone(), heard: Instant::now(), suspected: false, dead: false };
        if self.links.insert(node, link).is_some_and(|earlier| earlier.incarnation != incarnation && !earlier.dead) {
            self.shared.metrics.deaths.inc();
        }
        let info = NodeInfo { name, lanes: hello.lanes, build: hello.build, address };
        self.step(Event::NodeJoined { node, incarnation, info });
    }

    /// A node that said goodbye, or was sent away, has left. One whose connection broke is only silent: it may come back with what it holds.
    pub(super) fn gone(&mut self, link: LinkId, left: Option<String>) {
        let latest = self.at(link);
        self.nodes.remove(&link);
        if let (Some((node, incarnation)), Some(reason)) = (latest, left) {
            self.links.remove(&node);
            self.step(Event::NodeLeft { node, incarnation, reason });
        }
    }

    /// A node is sent away: it was silent for too long, may not render, or has a newer life.
    pub(super) fn sent_away(&mut self, node: NodeId, incarnation: Incarnation, silence: bool) {
        let latest = self.links.get_mut(&node).filter(|link| link.incarnation == incarnation);
        if silence {
            self.shared.metrics.deaths.inc();
            latest.into_iter().for_each(|link| link.dead = true);
        } else if latest.is_some() {
            self.shared.metrics.refused_peers.inc();
        }
    }

    pub(super) fn release(&mut self, name: &str) -> std::result::Result<(), String> {
        let held = |node: &NodeSnapshot| node.name == name && node.state == NodeState::Quarantined;
        let node = self.farm.nodes().into_iter().find(held).ok_or_else(|| format!("no node {name} is in quarantine"))?;
        self.step(Event::NodeReleased { node: node.id });
        Ok(())
    }

    pub(super) fn close(&mut self, node: NodeId, incarnation: Incarnation, reason: String) {
        let name = self.ids.iter().find(|(_, id)| **id == node).map_or("?", |(name, _)| name.as_str());
        tracing::warn!(node = name, reason, "a node is sent away");
        if let Some(link) = self.link_of(node, incarnation) {
            let _ = link.outgoing.try_send(Outgoing::Close(reason));
        }
    }

    pub(super) fn say(&mut self, node: NodeId, incarnation: Incarnation, message: ToNode) {
        self.asked.note(node, &message);
        let Some(link) = self.link_of(node, incarnation) else { return };
        if link.outgoing.try_send(Outgoing::Say(message)).is_err() {
            tracing::debug!(node = node.0, "a message could not be handed to its connection");
        }
    }

    pub(super) fn link_of(&mut self, node: NodeId, incarnation: Incarnation) -> Option<&mut Link> {
        self.links.get_mut(&node).filter(|link| link.incarnation == incarnation)
    }
}
