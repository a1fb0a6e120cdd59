//! Under `earliest_finish`, a node that runs out takes a part from the node that is expected to finish last.
//!
//! Expected times rest on the probe, corrected by how fast a node's latest parts really were. A part moves only if it is then expected to be done
//! before the other node is done with all it has. Attempts that no lane can have begun are called back and move too.

use std::time::Duration;

use super::job::{Job, Member};
use super::node::Nodes;
use super::part::Place;
use super::turn::Turn;
use super::{
    LeaseId,
    part::{Lease, Role},
};
use crate::limits::STEAL_INTERVAL;
use crate::manifest::AttemptOutcome;
use crate::schedule::{NodeId, PartId};

/// How much a part's time tells of the next one's.
const PACE_WEIGHT: f64 = 0.3;

/// Bounds of the correction by real times.
const PACE_RANGE: (f64, f64) = (0.05, 50.0);

/// A lane that is overdue by some time is expected to need this share of it more.
const OVERDUE: f64 = 0.5;

impl Member {
    /// Cost that one lane does in a second, by the latest parts.
    pub fn lane_speed(&self) -> f64 {
        self.speed.unwrap_or(1.0) / self.pace
    }

    /// Takes note of how long a part really took.
    pub fn note_pace(&mut self, cost: f64, seconds: f64) {
        let predicted = cost / self.speed.unwrap_or(1.0);
        if predicted > 0.0 && seconds.is_finite() {
            let pace = (1.0 - PACE_WEIGHT) * self.pace + PACE_WEIGHT * (seconds / predicted);
            self.pace = pace.clamp(PACE_RANGE.0, PACE_RANGE.1);
        }
    }
}

/// What a node may lose.
struct Victim {
    id: NodeId,
    /// Seconds until it is done with all it has.
    finish: f64,
}

impl Job {
    /// Lets nodes with room take parts from others; asks to be woken while some find nothing that is worth it.
    pub(super) fn steal(&mut self, turn: &mut Turn, nodes: &mut Nodes, thieves: Vec<NodeId>) {
        let mut victims: Vec<Victim> = self.members.keys().filter_map(|id| self.victim(turn.now, nodes, *id)).collect();
        for thief in thieves {
            while self.has_room(turn, nodes, thief) && self.steal_one(turn, nodes, thief, &mut victims) {}
        }
        if !victims.is_empty() {
            self.reconsider = Some(turn.now + STEAL_INTERVAL);
        }
    }

    fn steal_one(&mut self, turn: &mut Turn, nodes: &mut Nodes, thief: NodeId, victims: &mut Vec<Victim>) -> bool {
        let Some(at) =
            (0..victims.len()).filter(|i| victims[*i].id != thief).max_by(|a, b| victims[*a].finish.total_cmp(&victims[*b].finish))
        else {
            return false;
        };
        let victim = &victims[at];
        let Some(part) = self.loot(turn.now, nodes, thief, victim) else { return false };
        let from = victim.id;
        self.take_away(turn, nodes, from, part);
        self.hand_over(turn, nodes, thief, part);
        match self.victim(turn.now, nodes, from) {
            Some(victim) => victims[at] = victim,
            None => _ = victims.swap_remove(at),
        }
        true
    }

    /// The hardest part that the thief would finish before the victim finishes all.
    fn loot(&self, now: Duration, nodes: &Nodes, thief: NodeId, victim: &Victim) -> Option<PartId> {
        let (member, from, node) = (self.members.get(&thief)?, self.members.get(&victim.id)?, nodes.get(&thief)?);
        let idle = node.free_lanes() > 0;
        let delay = if idle { 0.0 } else { self.held_cost(now, nodes, thief) / (member.lane_speed() * node.lanes().max(1) as f64) };
        let pays = |part: &PartId| {
            let state = self.part(*part);
            delay + state.expected / member.lane_speed() < victim.finish
                && !state.failed_on(thief)
                && (!state.suspect || node.held.is_empty())
        };
        let queued = from.queue.iter().copied().find(pays);
        queued.or_else(|| idle.then(|| self.not_begun(nodes, victim.id)).flatten().map(|(_, lease)| lease.part).filter(pays))
    }

    fn take_away(&mut self, turn: &mut Turn, nodes: &mut Nodes, from: NodeId, part: PartId) {
        if let Place::Leased(lease) = self.part(part).place {
            self.call_back(turn, nodes, lease);
            self.close(turn, nodes, lease, AttemptOutcome::Cancelled, "another node was free");
        }
        self.take_out(from, part);
    }

    /// The last attempt that a node holds, if no lane can have begun it.
    fn not_begun(&self, nodes: &Nodes, id: NodeId) -> Option<(LeaseId, &Lease)> {
        let last = nodes.get(&id)?.held_of(self.id).next_back()?;
        self.leases.get(&last).filter(|lease| lease.begun.is_none() && lease.role == Role::Main).map(|lease| (last, lease))
    }

    /// A node as a victim, if there is something to take.
    fn victim(&self, now: Duration, nodes: &Nodes, id: NodeId) -> Option<Victim> {
        let (member, node) = (self.members.get(&id)?, nodes.get(&id)?);
        let last = member.queue.back().copied().or_else(|| self.not_begun(nodes, id).map(|(_, lease)| lease.part))?;
        let cost = self.held_cost(now, nodes, id) + member.queued_cost;
        let (last, speed) = (self.part(last).expected, member.lane_speed());
        Some(Victim { id, finish: (cost - last).max(0.0) / (speed * node.lanes().max(1) as f64) + last / speed })
    }

    /// Cost that is left of what a node holds.
    fn held_cost(&self, now: Duration, nodes: &Nodes, id: NodeId) -> f64 {
        let Some(member) = self.members.get(&id) else { return 0.0 };
        self.held_by(nodes, id).map(|lease| self.left_of(now, member, lease)).sum()
    }

    /// Cost that is left of an attempt, as far as that can be told.
    pub(super) fn left_of(&self, now: Duration, member: &Member, lease: &Lease) -> f64 {
        let done = lease.begun.map_or(0.0, |begun| now.saturating_sub(begun).as_secs_f64() * member.lane_speed());
        let left = self.part(lease.part).expected - done;
        if left >= 0.0 { left } else { -left * OVERDUE }
    }
}
