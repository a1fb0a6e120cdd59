//! Jobs are submitted, wait for their turn, and end.

use super::job::{Job, Phase, Stage};
use super::node::Nodes;
use super::part::{PartState, Place};
use super::turn::Turn;
use super::{Command, Farm, JobId, JobSpec, Outcome, ToNode};
use crate::limits::{JOBS_KEPT, JOBS_WAITING};
use crate::manifest::AttemptOutcome;
use crate::schedule::{NodeId, PartId};

impl Farm {
    pub(super) fn job_submitted(&mut self, id: JobId, spec: JobSpec) {
        if self.jobs.contains_key(&id) {
            return;
        }
        let waiting = self.jobs.values().filter(|job| job.outcome().is_none()).count();
        self.jobs.insert(id, Job::new(id, spec, self.turn.now));
        if waiting >= JOBS_WAITING {
            let reason = format!("{JOBS_WAITING} jobs wait already");
            self.with_job(id, |job, turn, nodes| job.end(turn, nodes, Outcome::Failed { reason }));
        }
        let over: Vec<JobId> = self.jobs.values().filter(|job| job.outcome().is_some()).map(|job| job.id).collect();
        over.iter().take(over.len().saturating_sub(JOBS_KEPT)).for_each(|id| _ = self.jobs.remove(id));
    }

    pub(super) fn job_cancelled(&mut self, id: JobId, reason: String) {
        self.with_job(id, |job, turn, nodes| job.end(turn, nodes, Outcome::Cancelled { reason }));
    }

    /// Begins the next job, if there is one.
    pub(super) fn start_next(&mut self) -> bool {
        let ended = self.running;
        self.jobs.values_mut().filter(|job| job.outcome().is_some() && Some(job.id) != ended).for_each(Job::forget_details);
        self.running = self.jobs.values().find(|job| job.outcome().is_none()).map(|job| job.id);
        self.with_running(|job, turn, nodes| job.begin(turn, nodes));
        self.running.is_some()
    }
}

impl Job {
    /// The job is over: everything that it holds is released.
    pub(super) fn end(&mut self, turn: &mut Turn, nodes: &Nodes, outcome: Outcome) {
        let open: Vec<_> = self.leases.keys().copied().collect();
        open.into_iter().for_each(|lease| self.close(turn, lease, AttemptOutcome::Cancelled, "the job is over"));
        for (id, member) in &mut self.members {
            member.queue.clear();
            if let Some(node) = nodes.get(id).filter(|node| node.lives(member.incarnation) && member.stage != Stage::Away) {
                turn.send(*id, node, ToNode::Release { job: self.id });
            }
        }
        self.loose.clear();
        self.audits.clear();
        (self.reconsider, self.next_due) = (None, None);
        self.question = None;
        self.deserted = None;
        self.log.ended = Some(turn.now);
        self.phase = Phase::Over(outcome.clone());
        turn.put(Command::End { job: self.id, outcome });
    }

    /// The output files stand, or cannot be written.
    pub fn assembled(&mut self, turn: &mut Turn, nodes: &Nodes, result: Result<(), String>) {
        if self.phase == Phase::Assembling {
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
    pub(super) fn watch_desertion(&mut self, turn: &mut Turn, nodes: &Nodes) {
        let able = |id: &NodeId| self.members.get(id).is_none_or(|member| !matches!(member.stage, Stage::Failed(_)));
        let delivered = !self.parts.is_empty() && self.parts.len() == self.committed + self.dropped + self.committing.len();
        let wants = !matches!(self.phase, Phase::Waiting | Phase::Assembling | Phase::Over(_)) && !delivered;
        if !wants || nodes.iter().any(|(id, node)| node.is_hopeful() && able(id)) {
            self.deserted = None;
            return;
        }
        let since = *self.deserted.get_or_insert(turn.now);
        if turn.strikes(since + turn.config.no_node_timeout) {
            let reason = self.desertion(turn.config.no_node_timeout.as_secs_f64());
            self.end(turn, nodes, Outcome::Failed { reason });
        }
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

    /// The coordinator was started anew: pixels that were not on disk are gone, and what was asked has to be asked again.
    pub fn restarted(&mut self, turn: &mut Turn) {
        self.question = None;
        self.deserted = None;
        let gone: Vec<PartId> = self.committing.values().copied().collect();
        for part in gone {
            self.take_back(part, AttemptOutcome::Lost, "the coordinator was started anew");
        }
        if self.phase == Phase::Assembling {
            turn.put(Command::Assemble { job: self.id });
        }
    }

    /// A node's connection was renewed: what it may not have heard is said again. Nodes take a repeated order as one.
    pub fn repeat_orders(&mut self, turn: &mut Turn, nodes: &Nodes, id: NodeId) {
        let (Some(member), Some(node)) = (self.members.get(&id), nodes.get(&id)) else { return };
        match member.stage {
            Stage::Preparing(_) => turn.send(id, node, ToNode::Prepare { job: self.id }),
            Stage::Prepared => self.probe_latecomer(turn, nodes, id),
            _ => {}
        }
        let Some(member) = self.members.get(&id) else { return };
        for lease in member.held.iter().chain(&member.hanging) {
            let message = match self.leases.get(lease) {
                Some(of) => ToNode::Render { job: self.id, lease: *lease, rect: self.part(of.part).rect, samples: self.all_samples() },
                None => ToNode::Cancel { job: self.id, lease: *lease },
            };
            turn.send(id, node, message);
        }
    }
}
