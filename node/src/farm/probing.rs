//! The probe: cells are handed out, measured, and become costs and powers.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::ToNode;
use super::job::{Job, Phase, Stage};
use super::node::Nodes;
use super::turn::Turn;
use crate::manifest::EventKind;
use crate::schedule::evaluate::{self, Measured};
use crate::schedule::probe::{self, Cells};
use crate::schedule::{NodeId, Probe};

/// A running probe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Probing {
    pub cells: Cells,
    started: Duration,
    /// Cells that each node has still to measure.
    outstanding: BTreeMap<NodeId, BTreeSet<u32>>,
    measured: Measured,
    /// When it ends with what there is.
    pub deadline: Option<Duration>,
    /// Whether the deadline is that of stragglers.
    straggling: bool,
}

/// How the speed of a node that comes later becomes known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Pricing {
    /// Not yet.
    Unknown,
    /// By the common patch of these cells.
    Patch(Cells),
    /// By its name in an earlier manifest, or as the mean node there.
    Known { speeds: BTreeMap<String, f64> },
    /// All lanes count as equal: nobody answered the probe.
    Equal,
}

impl Job {
    pub(super) fn begin_probe(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        self.log.event(turn.now, EventKind::ProbeStarted, None, Vec::new(), "");
        let scale = match &self.spec.probe {
            Probe::EveryNode { scale } | Probe::Shared { scale } => *scale,
            Probe::Known { costs, powers } => {
                self.costs = costs.clone();
                self.pricing = Pricing::Known { speeds: powers.clone() };
                return self.end_probe(turn, Duration::ZERO);
            }
        };
        let cells = probe::cells(self.spec.width, self.spec.height, scale);
        let deadline = Some(turn.now + turn.config.probe_timeout);
        let (outstanding, measured) = (BTreeMap::new(), Measured::new());
        self.phase = Phase::Probing(Probing { cells, started: turn.now, outstanding, measured, deadline, straggling: false });
        let prepared: Vec<(NodeId, u32)> = self
            .members
            .iter()
            .filter(|(id, member)| member.stage == Stage::Prepared && nodes.get(id).is_some_and(|node| node.is_ready()))
            .map(|(id, member)| (*id, member.info.lanes))
            .collect();
        let shares = match self.spec.probe {
            Probe::Shared { .. } => probe::shared(&cells, &prepared),
            _ => probe::every_node(&cells, &prepared),
        };
        shares.iter().for_each(|(node, share)| self.hand_out(turn, nodes, *node, share));
    }

    fn hand_out(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId, share: &[u32]) {
        let (Phase::Probing(probing), Some(node)) = (&mut self.phase, nodes.get(&id)) else { return };
        if !share.is_empty() {
            probing.outstanding.entry(id).or_default().extend(share);
            turn.send(id, node, probe_message(self.id, &probing.cells, share));
        }
    }

    /// A node has the scene: if the probe is on or over, it is measured by the common patch, where a measurement is needed.
    pub(super) fn probe_latecomer(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId) {
        match (&self.phase, &self.pricing) {
            (Phase::Probing(probing), _) => {
                let (cells, share) = (probing.cells, self.unmeasured());
                let share: BTreeSet<u32> = cells.patch().into_iter().chain(share).collect();
                self.hand_out(turn, nodes, id, &Vec::from_iter(share));
            }
            (_, Pricing::Patch(cells)) => {
                if let Some(node) = nodes.get(&id) {
                    turn.send(id, node, probe_message(self.id, cells, &cells.patch()));
                }
            }
            _ => self.price(id),
        }
    }

    /// A node's connection was renewed, which may have swallowed its answer: what it has not answered is asked once more.
    pub(super) fn probe_again(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId) {
        match &self.phase {
            Phase::Probing(Probing { cells, outstanding, .. }) if outstanding.contains_key(&id) => {
                let share: Vec<u32> = outstanding.get(&id).into_iter().flatten().copied().collect();
                if let Some(node) = nodes.get(&id).filter(|_| !share.is_empty()) {
                    turn.send(id, node, probe_message(self.id, cells, &share));
                }
            }
            _ => self.probe_latecomer(turn, nodes, id),
        }
    }

    /// Cells that no node has measured, or is about to.
    fn unmeasured(&self) -> Vec<u32> {
        let Phase::Probing(probing) = &self.phase else { return Vec::new() };
        let measured = probing.measured.values().flatten().map(|(cell, _)| *cell);
        let taken: BTreeSet<u32> = probing.outstanding.values().flatten().copied().chain(measured).collect();
        (0..probing.cells.count()).filter(|cell| !taken.contains(cell)).collect()
    }

    /// A node has measured cells.
    pub fn probed(&mut self, id: NodeId, cells: &[(u32, f64)]) {
        let Some(member) = self.members.get_mut(&id).filter(|member| matches!(member.stage, Stage::Prepared)) else { return };
        if let Phase::Probing(probing) = &mut self.phase {
            let Some(asked) = probing.outstanding.get_mut(&id) else { return };
            let news: Vec<(u32, f64)> = cells.iter().filter(|(cell, _)| asked.remove(cell)).copied().collect();
            member.probed.extend(&news);
            probing.measured.entry(id).or_default().extend(news);
        } else if matches!(self.pricing, Pricing::Patch(_)) {
            member.probed = cells.iter().filter(|(cell, _)| (*cell as usize) < self.costs.seconds_per_pixel.len()).copied().collect();
            self.price(id);
        }
    }

    /// Settles the speed of a prepared node, if it can be known.
    fn price(&mut self, id: NodeId) {
        let Some(member) = self.members.get_mut(&id).filter(|member| member.stage == Stage::Prepared) else { return };
        let speed = match &self.pricing {
            Pricing::Unknown => None,
            Pricing::Patch(_) => evaluate::calibrate(&member.probed, &self.costs, self.spec.samples),
            Pricing::Known { speeds } => Some(evaluate::speed_by_name(speeds, &member.info.name, member.info.lanes)),
            Pricing::Equal => Some(1.0),
        };
        if speed.is_some() {
            (member.speed, member.stage) = (speed, Stage::Measured);
        }
    }

    /// A node is lost while the probe is on: its cells go to the others.
    pub(super) fn probe_without(&mut self, turn: &mut Turn, nodes: &mut Nodes, lost: NodeId) {
        let Phase::Probing(probing) = &mut self.phase else { return };
        probing.outstanding.remove(&lost);
        let others: Vec<(NodeId, u32)> = self
            .members
            .iter()
            .filter(|(id, member)| **id != lost && member.stage == Stage::Prepared && nodes.get(id).is_some_and(|node| node.is_ready()))
            .map(|(id, member)| (*id, member.info.lanes))
            .collect();
        for (node, share) in probe::deal(&self.unmeasured(), &others) {
            self.hand_out(turn, nodes, node, &share);
        }
    }

    pub(super) fn advance_probing(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        let Phase::Probing(probing) = &mut self.phase else { return };
        let done = |id: &NodeId, cells: &BTreeSet<u32>| cells.is_empty() && nodes.get(id).is_some_and(|node| node.is_ready());
        let (asked, answered) = (probing.outstanding.len(), probing.outstanding.iter().filter(|(id, cells)| done(id, cells)).count());
        let elapsed = turn.now.saturating_sub(probing.started);
        if answered > 0 && answered == asked {
            return self.evaluate_probe(turn, elapsed);
        }
        if answered * 2 >= asked && answered > 0 && !probing.straggling {
            probing.straggling = true;
            probing.deadline = Some(turn.now + turn.config.probe_grace.max(elapsed * 2));
        }
        if probing.deadline.is_some_and(|deadline| turn.strikes(deadline)) {
            self.evaluate_probe(turn, elapsed);
        }
    }

    fn evaluate_probe(&mut self, turn: &mut Turn, elapsed: Duration) {
        let Phase::Probing(probing) = &self.phase else { return };
        let found = evaluate::evaluate(&probing.cells, self.spec.samples, &probing.measured);
        if found.speeds.is_empty() {
            self.log.warn("no node answered the probe: all pixels count as equally hard, and all lanes as equally fast".into());
            self.costs = evaluate::uniform(self.spec.width, self.spec.height);
            self.pricing = Pricing::Equal;
        } else {
            (self.costs, self.pricing) = (found.costs, Pricing::Patch(probing.cells));
        }
        for (id, speed) in found.speeds {
            if let Some(member) = self.members.get_mut(&id).filter(|member| member.stage == Stage::Prepared) {
                (member.speed, member.stage) = (Some(speed), Stage::Measured);
            }
        }
        self.end_probe(turn, elapsed);
    }

    fn end_probe(&mut self, turn: &Turn, elapsed: Duration) {
        self.log.probe_seconds = elapsed.as_secs_f64();
        self.log.event(turn.now, EventKind::ProbeFinished, None, Vec::new(), "");
        self.phase = Phase::Splitting;
        if !matches!(self.pricing, Pricing::Patch(_)) {
            Vec::from_iter(self.members.keys().copied()).into_iter().for_each(|id| self.price(id));
        }
    }
}

fn probe_message(job: super::JobId, cells: &Cells, share: &[u32]) -> ToNode {
    ToNode::Probe { job, cells: share.iter().map(|cell| (*cell, cells.rect(*cell))).collect(), stride: cells.stride }
}
