//! Which jobs run, and which of them hands out next: by priority, then by how much their submitters have had, then in order of submission.
//!
//! A job with the first claim takes every lane that it has work for; what it leaves is for the next one, so that no lane waits for the last parts of
//! a frame. Submitters of equal priority share: each part that is handed out counts by the seconds that parts of its job take, and whoever has had least is next. Who comes
//! (again) is taken to have had as much as those who are there: nobody saves up, and nobody is punished for having been alone.
//! (Start-time fair queueing: Goyal, Vin, Cheng, 1996.)

use std::{cmp::Reverse, collections::BTreeMap, collections::BTreeSet};

use serde::{Deserialize, Serialize};

use super::job::{Job, Phase};
use super::{Event, Farm, JobId, JobSpec, Outcome};
use crate::limits::{JOBS_AT_ONCE, JOBS_KEPT, JOBS_WAITING, NODES_PER_TURN};
use crate::manifest::EventKind;

/// What the farm knows of its jobs' order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Queue {
    /// Jobs that have begun and are not over.
    pub open: BTreeSet<JobId>,
    /// Jobs that have not begun, and perhaps ended before they could.
    waiting: BTreeSet<JobId>,
    /// Lane seconds that each submitter with open jobs has had, on the clock of `served`.
    had: BTreeMap<String, f64>,
    /// What whoever was served last had had before: nobody counts as having had less.
    served: f64,
    /// Open jobs that have work for all lanes, as it was when the queue was last looked at.
    busy: BTreeSet<JobId>,
    /// Whether something else has happened since that may let a job begin.
    stale: bool,
}

impl Farm {
    pub(super) fn job_submitted(&mut self, id: JobId, spec: JobSpec) {
        if self.jobs.contains_key(&id) {
            return;
        }
        let waiting = self.jobs.values().filter(|job| job.outcome().is_none()).count();
        self.jobs.insert(id, Job::new(id, spec, self.turn.now));
        self.queue.waiting.insert(id);
        self.queue.stale = true;
        if waiting >= JOBS_WAITING {
            let reason = format!("{JOBS_WAITING} jobs wait already");
            self.with_job(id, |job, turn, nodes| job.end(turn, nodes, Outcome::Failed { reason }));
        }
        self.forget_jobs();
    }

    pub(super) fn job_cancelled(&mut self, id: JobId, reason: String) {
        self.with_job(id, |job, turn, nodes| job.end(turn, nodes, Outcome::Cancelled { reason }));
    }

    /// Whoever submitted a job, or an operator, changes its place in the queue.
    pub(super) fn job_moved(&mut self, event: Event) {
        self.queue.stale = true;
        match event {
            Event::JobPaused { job, reason, operator } => self.with_job(job, |job, turn, _| job.pause(turn, reason, operator)),
            Event::JobResumed { job, reason } => self.with_job(job, |job, turn, _| job.resume(turn, reason)),
            Event::JobRanked { job, priority, operator } => {
                self.with_job(job, |job, _, _| (job.spec.priority, job.fixed.rank) = (priority, operator));
            }
            _ => {}
        }
    }

    /// Jobs that are over are known for a while: the oldest go, but those that others wait for.
    fn forget_jobs(&mut self) {
        let over: Vec<JobId> = self.jobs.values().filter(|job| job.outcome().is_some()).map(|job| job.id).collect();
        if over.len() <= JOBS_KEPT {
            return;
        }
        let awaited: BTreeSet<JobId> = self.waiting_jobs().flat_map(|job| job.spec.after.iter().copied()).collect();
        let old = over.iter().take(over.len().saturating_sub(JOBS_KEPT));
        old.filter(|id| !awaited.contains(id)).for_each(|id| _ = self.jobs.remove(id));
    }

    /// Lets every open job do what it can, in order of their claims, and begins others while lanes are left.
    pub(super) fn advance(&mut self) {
        loop {
            self.note_begun();
            self.take_turns();
            self.note_ends();
            if self.strip_stuck() {
                continue;
            }
            if !self.begin_next() {
                break;
            }
        }
        self.note_begun();
    }

    /// Hands out until nobody has anything to hand out: who shares with another submitter gives way after a few parts.
    fn take_turns(&mut self) {
        let mut rest: Vec<JobId> = self.queue.open.iter().copied().collect();
        while let Some(id) = rest.iter().copied().min_by(|a, b| self.compare_claims(*a, *b)) {
            let shares = rest.iter().any(|other| self.is_rival(id, *other));
            let quota = if shares { 1 + self.nodes.len() / NODES_PER_TURN } else { usize::MAX };
            (self.turn.quota, self.turn.handed_out) = (quota, (0, 0.0));
            self.with_job(id, |job, turn, nodes| job.advance(turn, nodes));
            let (count, seconds) = std::mem::take(&mut self.turn.handed_out);
            if count > 0 {
                self.charge(id, seconds);
            }
            if count < quota {
                rest.retain(|other| *other != id);
            }
        }
        self.turn.quota = 0;
    }

    fn charge(&mut self, id: JobId, seconds: f64) {
        let Some(owner) = self.jobs.get(&id).map(|job| job.spec.owner.clone()) else { return };
        let had = self.queue.had.entry(owner).or_default();
        self.queue.served = had.max(self.queue.served);
        *had = self.queue.served + seconds;
    }

    fn compare_claims(&self, a: JobId, b: JobId) -> std::cmp::Ordering {
        let claim = |id: JobId| {
            let spec = self.jobs.get(&id).map(|job| &job.spec);
            let had = spec.and_then(|spec| self.queue.had.get(&spec.owner)).copied().unwrap_or_default();
            (Reverse(spec.map(|spec| spec.priority)), had.max(self.queue.served))
        };
        let ((rank, had), (other_rank, other_had)) = (claim(a), claim(b));
        rank.cmp(&other_rank).then(had.total_cmp(&other_had)).then(a.cmp(&b))
    }

    /// Whether two jobs are of equal priority and of different submitters.
    fn is_rival(&self, a: JobId, b: JobId) -> bool {
        let (Some(a), Some(b)) = (self.jobs.get(&a), self.jobs.get(&b)) else { return false };
        a.spec.priority == b.spec.priority && a.spec.owner != b.spec.owner
    }

    /// Attempts that come to the front of what their nodes hold may have begun.
    fn note_begun(&mut self) {
        for id in std::mem::take(&mut self.turn.freed) {
            self.with_open(|job, turn, nodes| job.note_begun(turn, nodes, id));
        }
    }

    /// Nodes whose last lane hangs hold nothing of any job any more. Says whether there are any.
    fn strip_stuck(&mut self) -> bool {
        let stuck = std::mem::take(&mut self.turn.stuck);
        for id in &stuck {
            self.with_open(|job, turn, nodes| job.strip(turn, nodes, *id, "no lane of its node makes progress"));
        }
        !stuck.is_empty()
    }

    /// Takes jobs that are over off the books. What the latest of them did is known until another ends.
    fn note_ends(&mut self) {
        if !std::mem::take(&mut self.turn.ended) {
            return;
        }
        self.queue.stale = true;
        let over = |id: &JobId| self.jobs.get(id).is_none_or(|job| job.outcome().is_some());
        let ended: Vec<JobId> = self.queue.open.iter().copied().filter(over).collect();
        ended.iter().for_each(|id| _ = self.queue.open.remove(id));
        self.queue.waiting.retain(|id| self.jobs.get(id).is_some_and(|job| job.phase == Phase::Waiting));
        let owners: BTreeSet<&String> = self.open_jobs().map(|job| &job.spec.owner).collect();
        let had = self.queue.had.iter().filter(|(owner, _)| owners.contains(owner)).map(|(owner, had)| (owner.clone(), *had)).collect();
        self.queue.had = had;
        let now = self.turn.now;
        self.jobs.values_mut().filter(|job| job.log.ended.is_some_and(|at| at < now)).for_each(Job::forget_details);
    }

    pub(super) fn open_jobs(&self) -> impl Iterator<Item = &Job> {
        self.queue.open.iter().filter_map(|id| self.jobs.get(id))
    }

    fn waiting_jobs(&self) -> impl Iterator<Item = &Job> {
        self.queue.waiting.iter().filter_map(|id| self.jobs.get(id)).filter(|job| job.phase == Phase::Waiting)
    }

    /// Begins the job whose turn it is, if there is one. Says whether anything has changed.
    fn begin_next(&mut self) -> bool {
        if self.queue.waiting.is_empty() {
            return false;
        }
        let lanes: usize = self.nodes.values().filter(|node| node.is_ready()).map(|node| node.lanes()).sum();
        let busy: BTreeSet<JobId> = self.open_jobs().filter(|job| job.is_busy(lanes)).map(|job| job.id).collect();
        if !self.queue.stale && busy == self.queue.busy {
            return false;
        }
        self.queue.busy = busy;
        if self.fail_orphans() {
            return true;
        }
        let Some(id) = self.next_to_begin() else {
            self.queue.stale = false;
            return false;
        };
        self.join_queue(id);
        self.with_job(id, |job, turn, nodes| job.begin(turn, nodes));
        true
    }

    /// Fails jobs that wait for one that came to no good end.
    fn fail_orphans(&mut self) -> bool {
        let orphans: Vec<(JobId, String)> = self.waiting_jobs().filter_map(|job| Some((job.id, self.trouble_ahead(job)?))).collect();
        for (id, reason) in &orphans {
            self.with_job(*id, |job, turn, nodes| job.end(turn, nodes, Outcome::Failed { reason: reason.clone() }));
        }
        self.note_ends();
        !orphans.is_empty()
    }

    fn trouble_ahead(&self, job: &Job) -> Option<String> {
        let bad = |id: &JobId| match self.jobs.get(id)?.outcome()? {
            Outcome::Finished => None,
            Outcome::Incomplete { .. } => Some(format!("job {}, which it waits for, came out incomplete", id.0)),
            Outcome::Failed { .. } => Some(format!("job {}, which it waits for, failed", id.0)),
            Outcome::Cancelled { .. } => Some(format!("job {}, which it waits for, was cancelled", id.0)),
        };
        job.spec.after.iter().find_map(bad)
    }

    /// The waiting job with the first claim that nothing holds back.
    fn next_to_begin(&self) -> Option<JobId> {
        // Who lets jobs wait holds up nobody but themselves, and nobody holds up those of higher rank.
        let full = |job: &Job| {
            self.open_jobs().filter(|other| other.is_active() && other.spec.priority >= job.spec.priority).count() >= JOBS_AT_ONCE
        };
        let own = |job: &Job| self.open_jobs().filter(|other| other.spec.owner == job.spec.owner).count();
        let due = self
            .waiting_jobs()
            .filter(|job| !job.paused)
            .filter(|job| !job.spec.after.iter().any(|id| self.jobs.get(id).is_some_and(|other| other.outcome().is_none())));
        due.filter(|job| !full(job) && own(job) < JOBS_AT_ONCE && !self.is_held_back(job))
            .map(|job| job.id)
            .min_by(|a, b| self.compare_claims(*a, *b))
    }

    /// Whether another job has work for all lanes, and a claim before this one. Submitters of equal priority run side by side.
    fn is_held_back(&self, job: &Job) -> bool {
        let before = |other: &Job| {
            let (rank, own) = (other.spec.priority, job.spec.priority);
            rank > own || rank == own && other.spec.owner == job.spec.owner
        };
        self.queue.busy.iter().filter_map(|id| self.jobs.get(id)).any(before)
    }

    fn join_queue(&mut self, id: JobId) {
        self.queue.open.insert(id);
        self.queue.waiting.remove(&id);
    }
}

impl Job {
    /// Whether it has work, or will soon have, for more lanes than the farm has.
    fn is_busy(&self, lanes: usize) -> bool {
        if !self.is_active() {
            return false;
        }
        match self.phase {
            Phase::Waiting | Phase::Assembling | Phase::Over(_) => false,
            Phase::Gathering(_) | Phase::Probing(_) | Phase::Splitting | Phase::Assigning => true,
            Phase::Rendering => self.waiting_parts() > lanes,
        }
    }

    /// Whether it uses nodes, or would if it could.
    fn is_active(&self) -> bool {
        !self.paused && self.deserted.is_none()
    }

    /// Nothing of it is handed out any more; what nodes hold they finish.
    fn pause(&mut self, turn: &super::turn::Turn, reason: String, operator: bool) {
        self.fixed.pause |= operator;
        if !std::mem::replace(&mut self.paused, true) {
            self.log.event(turn.now, EventKind::Paused, None, Vec::new(), reason);
        }
    }

    fn resume(&mut self, turn: &super::turn::Turn, reason: String) {
        self.fixed.pause = false;
        if std::mem::take(&mut self.paused) {
            self.log.event(turn.now, EventKind::Resumed, None, Vec::new(), reason);
        }
    }
}
