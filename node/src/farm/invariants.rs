//! What always holds, whatever happens. The simulator checks it after every step.

use std::collections::BTreeMap;

use super::Farm;
use super::job::{Job, Phase};
use super::node::{Held, Nodes};
use super::part::{Place, Role};
use crate::schedule::{NodeId, PartId};

impl Farm {
    /// Checks the farm's books.
    ///
    /// # Errors
    /// What does not agree.
    pub fn check_invariants(&self) -> Result<(), String> {
        let open = self.jobs.values().filter(|job| !matches!(job.phase, Phase::Waiting | Phase::Over(_)));
        for job in open {
            if !self.queue.open.contains(&job.id) {
                return Err(format!("job {} has begun and is not among those that have", job.id.0));
            }
            let void = job.leases.values().find(|lease| !self.nodes.get(&lease.node).is_some_and(|node| node.lives(lease.incarnation)));
            if let Some(lease) = void {
                return Err(format!("part {} is leased to a life of node {} that is over", lease.part.0, lease.node.0));
            }
            job.check_places().and_then(|()| job.check_leases(&self.nodes)).map_err(|wrong| format!("job {}: {wrong}", job.id.0))?;
        }
        self.check_nodes()?;
        match self.next_deadline() {
            Some(at) if self.turn.ticks && at <= self.turn.now => Err("a deadline has struck and is still there".into()),
            _ => Ok(()),
        }
    }

    /// Nodes hold what open jobs have handed out to them, and nothing else.
    fn check_nodes(&self) -> Result<(), String> {
        for (id, node) in &self.nodes {
            let known = |held: &Held| {
                let lease = self.jobs.get(&held.job).and_then(|job| job.leases.get(&held.lease));
                lease.is_some_and(|lease| lease.node == *id && lease.role != Role::Stray)
            };
            if let Some(held) = node.held.iter().find(|held| !known(held)) {
                return Err(format!("node {} holds lease {} of job {}, which is not its own", id.0, held.lease.0, held.job.0));
            }
            if node.lanes() == 0 && !node.held.is_empty() {
                return Err(format!("node {} holds attempts, and all its lanes hang", id.0));
            }
        }
        Ok(())
    }
}

impl Farm {
    /// What distinguishes the state of another farm from that of this one, if anything does; clocks aside.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let node = self.nodes.iter().find(|(id, node)| other.nodes.get(id) != Some(node));
        let job = self.jobs.iter().find(|(id, job)| other.jobs.get(id) != Some(job));
        let node = node.map(|(id, node)| apart(&Some(node), &other.nodes.get(id)));
        let job = job.map(|(id, job)| format!("job {}: {}", id.0, apart(&Some(job), &other.jobs.get(id))));
        let names = (self.turn.last_name, self.turn.build, &self.earlier_builds, &self.queue, self.nodes.len(), self.jobs.len());
        let others = (other.turn.last_name, other.turn.build, &other.earlier_builds, &other.queue, other.nodes.len(), other.jobs.len());
        node.or(job).or_else(|| (names != others).then(|| format!("{names:?} against {others:?}")))
    }
}

impl Job {
    /// Every part is in one place: loose, in one queue, with one lease that counts, or delivered.
    fn check_places(&self) -> Result<(), String> {
        let queued = |(id, member): (&NodeId, &super::job::Member)| member.queue.iter().map(|part| (*part, *id)).collect::<Vec<_>>();
        let queued: Vec<(PartId, NodeId)> = self.members.iter().flat_map(queued).collect();
        let queue_of: BTreeMap<PartId, NodeId> = queued.iter().copied().collect();
        expect(queued.len() == queue_of.len(), "a part waits in two queues")?;
        expect(queued.len() == self.queued, "parts in queues are miscounted")?;
        expect(self.members.values().all(|member| self.knows_cost(member)), "the cost of a queue is wrong")?;
        let (mut committed, mut dropped, mut leased, mut loose) = (0, 0, 0, 0);
        for part in &self.parts {
            let agrees = match part.place {
                Place::Loose => self.loose.contains(&part.id),
                Place::Queued(node) => queue_of.get(&part.id) == Some(&node),
                Place::Leased(lease) => self.leases.get(&lease).is_some_and(|of| of.part == part.id),
                Place::Committing(lease) => self.committing.get(&lease) == Some(&part.id),
                Place::Committed(_) | Place::Hole => true,
                Place::Replaced => !part.replaced_by.is_empty(),
            };
            expect(agrees, &format!("part {} is not where the books say: {:?}", part.id.0, part.place))?;
            committed += usize::from(part.committed_by().is_some());
            dropped += usize::from(matches!(part.place, Place::Replaced | Place::Hole));
            leased += usize::from(matches!(part.place, Place::Leased(_)));
            loose += usize::from(part.place == Place::Loose);
        }
        expect(committed == self.committed, "parts on disk are miscounted")?;
        expect(loose == self.loose.len(), "a part that has a place is called loose")?;
        expect(dropped == self.dropped, "parts that are replaced or left out are miscounted")?;
        let main = self.leases.values().filter(|lease| lease.role == Role::Main).count();
        expect(main == leased, "nodes hold other leases than parts say")?;
        let audited = |part: &PartId| self.part(*part).is_delivered();
        expect(self.audits.iter().all(audited), "a part that is not delivered is to be compared")?;
        expect(leased + committed + dropped + loose + queued.len() + self.committing.len() == self.parts.len(), "parts do not add up")
    }

    fn knows_cost(&self, member: &super::job::Member) -> bool {
        let cost: f64 = member.queue.iter().map(|part| self.part(*part).expected).sum();
        (cost - member.queued_cost).abs() <= 1e-6 * (1.0 + cost) || !cost.is_finite()
    }

    /// Every lease does what its role says, and nodes hold exactly those that are not stray.
    fn check_leases(&self, nodes: &Nodes) -> Result<(), String> {
        for (id, lease) in &self.leases {
            let part = self.part(lease.part);
            let agrees = match lease.role {
                Role::Main => part.place == Place::Leased(*id),
                Role::Spare => matches!(part.place, Place::Leased(_)),
                Role::Audit => part.is_delivered() && !part.voted(lease.node),
                Role::Stray => !part.is_settled() || part.committed_by().is_some(),
            };
            expect(agrees, &format!("lease {} is {:?}, but its part is {:?}", id.0, lease.role, part.place))?;
        }
        let held: usize = nodes.values().map(|node| node.held_of(self.id).count()).sum();
        expect(held == self.leases.values().filter(|lease| lease.role != Role::Stray).count(), "an attempt that counts is held by nobody")
    }
}

/// The first lines in which two things, printed, differ.
fn apart<T: std::fmt::Debug>(one: &T, other: &T) -> String {
    let (one, other) = (format!("{one:#?}"), format!("{other:#?}"));
    let at = one.lines().zip(other.lines()).take_while(|(a, b)| a == b).count();
    let from = |text: &str| text.lines().skip(at.saturating_sub(3)).take(6).map(str::trim).collect::<Vec<_>>().join(" ");
    format!("{} against {}", from(&one), from(&other))
}

fn expect(holds: bool, wrong: &str) -> Result<(), String> {
    if holds { Ok(()) } else { Err(wrong.to_owned()) }
}
