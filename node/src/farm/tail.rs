//! The end of a job: lanes that have nothing left to do make sure that nobody waits for the slowest attempt.
//!
//! An idle node renders a part that another one holds a second time where it is expected to be done sooner; the first result counts. Where several
//! lanes are idle and cutting the part up pays more than racing for it, its attempt is called back and the pieces are given out.

use std::time::Duration;

use tessera_engine::part::Rect;

use super::LeaseId;
use super::job::{Job, Member};
use super::node::{Node, Nodes};
use super::part::{Lease, PartState, Place, Role};
use super::turn::Turn;
use crate::limits::{PARTS_PER_JOB, PIECE_EDGE, PIECE_SECONDS, PIECES, STEAL_INTERVAL};
use crate::manifest::EventKind;
use crate::schedule::{NodeId, PartId};
use crate::schedule::{assign, split};

/// What is to be gained before anything is done twice: the share of the time that is left.
const GAIN: f64 = 0.8;

/// An attempt that others wait for.
struct Straggler {
    lease: LeaseId,
    part: PartId,
    /// Seconds until it is expected to end.
    left: f64,
}

impl Job {
    /// Lets idle lanes help with what others still render.
    pub(super) fn shorten_tail(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        if !self.loose.is_empty() || self.question.is_some() {
            return;
        }
        let idle = self.idle(turn, nodes);
        if idle.is_empty() {
            return;
        }
        let mut stragglers = self.stragglers(turn.now);
        if !stragglers.is_empty() {
            self.reconsider = Some(turn.now + STEAL_INTERVAL);
        }
        if let Some(last) = stragglers.first().filter(|last| self.pays_to_cut(nodes, &idle, last)) {
            let pieces = free_lanes(nodes, &idle) + 1;
            return self.cut(turn, nodes, last.part, pieces);
        }
        let needed = stragglers.iter().map(|straggler| self.speed_needed(straggler)).fold(f64::INFINITY, f64::min);
        for id in idle {
            let fast = |member: &Member| member.lane_speed() > needed;
            if !self.members.get(&id).is_some_and(fast) {
                continue;
            }
            let Some(at) = stragglers.iter().position(|straggler| self.pays_to_race(id, straggler)) else { continue };
            let straggler = stragglers.remove(at);
            if self.lease(turn, nodes, id, straggler.part, Role::Spare).is_some() {
                self.log.event(turn.now, EventKind::Speculated, Some(id), vec![straggler.part], "a second attempt");
            }
        }
    }

    /// Attempts that run alone, the one that is expected to end last first.
    fn stragglers(&self, now: Duration) -> Vec<Straggler> {
        let raced: std::collections::BTreeSet<PartId> =
            self.leases.values().filter(|lease| lease.role == Role::Spare).map(|lease| lease.part).collect();
        let alone = |(id, lease): (&LeaseId, &Lease)| {
            let member = self.members.get(&lease.node)?;
            let runs = lease.role == Role::Main && lease.begun.is_some() && !raced.contains(&lease.part);
            let left = self.left_of(now, member, lease) / member.lane_speed();
            runs.then_some(Straggler { lease: *id, part: lease.part, left })
        };
        let mut all: Vec<Straggler> = self.leases.iter().filter_map(alone).collect();
        all.sort_by(|a, b| b.left.total_cmp(&a.left).then(a.part.cmp(&b.part)));
        all
    }

    fn pays_to_race(&self, id: NodeId, straggler: &Straggler) -> bool {
        let (Some(member), part) = (self.members.get(&id), self.part(straggler.part)) else { return false };
        member.lane_speed() > self.speed_needed(straggler) && !part.failed_on(id) && !part.suspect
    }

    /// The speed of a lane above which a second attempt at a part pays.
    fn speed_needed(&self, straggler: &Straggler) -> f64 {
        self.part(straggler.part).expected / (straggler.left * GAIN)
    }

    fn pays_to_cut(&self, nodes: &Nodes, idle: &[NodeId], straggler: &Straggler) -> bool {
        let part = self.part(straggler.part);
        if part.suspect {
            return false;
        }
        let speed = |id: &NodeId| self.members.get(id).map_or(0.0, |member| member.lane_speed() * free_lanes(nodes, &[*id]) as f64);
        let holder = self.leases.get(&straggler.lease).map(|lease| lease.node).filter(|id| self.usable(nodes, *id));
        let speeds: f64 =
            idle.iter().map(speed).sum::<f64>() + holder.and_then(|id| self.members.get(&id)).map_or(0.0, |member| member.lane_speed());
        let alone = idle
            .iter()
            .filter_map(|id| self.members.get(id))
            .map(|member| part.expected / member.lane_speed())
            .fold(straggler.left, f64::min);
        let together = part.expected / speeds + PIECE_SECONDS.as_secs_f64();
        together < alone * GAIN && cut_up(part.rect, 2, PIECE_EDGE).len() > 1
    }

    /// Calls a part back and gives it out in pieces.
    fn cut(&mut self, turn: &mut Turn, nodes: &mut Nodes, part: PartId, pieces: usize) {
        self.cancel_attempts(turn, nodes, part, "its part was cut up for idle lanes");
        self.replace(turn, part, &cut_up(self.part(part).rect, pieces.min(PIECES), PIECE_EDGE), "for idle lanes");
        // There is no time to ask a job's own policy, and little to decide.
        let (parts, powers) = (self.hardest_first(), self.usable_powers(nodes));
        let plan = assign::earliest_finish(&parts, &powers, &self.backlog(nodes));
        self.take_redistribution(turn, nodes, &parts, &plan);
        let ids: Vec<NodeId> = self.members.keys().copied().collect();
        ids.iter().for_each(|id| self.fill(turn, nodes, *id));
    }

    /// Puts smaller parts in the place of one that has no attempt any more. Says whether there was room for them.
    pub(super) fn replace(&mut self, turn: &Turn, part: PartId, rects: &[Rect], why: &str) -> bool {
        if rects.len() < 2 || self.parts.len() + rects.len() > PARTS_PER_JOB {
            return false;
        }
        self.unplace(part);
        self.loose.remove(&part);
        let first = self.parts.len() as u32;
        let (parent, whole) = (self.part(part).clone(), split::cost_of(self.part(part).rect, &self.costs));
        let ids: Vec<PartId> = (first..).zip(rects).map(|(id, _)| PartId(id)).collect();
        for (id, rect) in ids.iter().zip(rects) {
            // What was learned of the whole holds for its pieces.
            let share = split::cost_of(*rect, &self.costs) / whole;
            let share = if share.is_finite() { share } else { rect.area() as f64 / parent.rect.area() as f64 };
            let mut piece = PartState::new(*id, *rect, parent.cost * share);
            piece.expected = parent.expected * share;
            self.parts.push(piece);
            self.loose.insert(*id);
        }
        let state = self.part_mut(part);
        (state.place, state.replaced_by) = (Place::Replaced, ids.clone());
        (self.dropped, self.split_into) = (self.dropped + 1, self.split_into + ids.len() - 1);
        self.log.event(turn.now, EventKind::Cut, None, vec![part], format!("into {} parts {why}", ids.len()));
        true
    }
}

fn free_lanes(nodes: &Nodes, ids: &[NodeId]) -> usize {
    ids.iter().filter_map(|id| nodes.get(id)).map(Node::free_lanes).sum()
}

/// A rectangle in about so many pieces, as square as they come, with no edge below `least` where it can be helped.
pub(super) fn cut_up(rect: Rect, pieces: usize, least: u32) -> Vec<Rect> {
    let (mut columns, mut rows) = (1_u32, 1_u32);
    while ((columns * rows) as usize) < pieces {
        let (width, height) = (rect.width / (columns + 1), rect.height / (rows + 1));
        let wider = rect.width / columns >= rect.height / rows;
        match (width >= least, height >= least) {
            (true, fits) if wider || !fits => columns += 1,
            (_, true) => rows += 1,
            _ => break,
        }
    }
    let at = |index: u32, count: u32, length: u32| (u64::from(length) * u64::from(index) / u64::from(count)) as u32;
    let mut rects = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let (x, y) = (at(column, columns, rect.width), at(row, rows, rect.height));
            let (right, low) = (at(column + 1, columns, rect.width), at(row + 1, rows, rect.height));
            rects.push(Rect { x: rect.x + x, y: rect.y + y, width: right - x, height: low - y });
        }
    }
    rects
}
