//! The coordinator's disk: what is on its way there, what a crash at any moment leaves of it, and what must be there when the coordinator comes back.

use std::collections::BTreeMap;
use std::time::Duration;

use super::World;
use super::machine::canary;
use super::world::Happening;
use crate::farm::{Event, Farm, JobId, LeaseId, Outcome};
use crate::journal::Filter;
use crate::schedule::PartId;

/// What a crash of the coordinator leaves, and what it may take.
pub(super) struct Disk {
    pub journal: Vec<(Duration, Event)>,
    /// Entries of it that no crash takes any more.
    pub synced: usize,
    /// Whether a wait for the disk is under way.
    pub syncing: bool,
    /// Until when it refuses everything.
    pub full: Duration,
    /// Pixels in segments, by job and attempt.
    pub pixels: BTreeMap<(JobId, LeaseId), PartId>,
    /// Pixels on their way there.
    pub coming: BTreeMap<(JobId, LeaseId), PartId>,
    /// Ends of jobs that are told of when so many entries are synced.
    pub ends: Vec<(usize, JobId, Outcome)>,
}

impl World {
    /// Pixels are on disk, and what was noted before them.
    pub(super) fn store(&mut self, job: JobId, lease: LeaseId, part: PartId) {
        self.disk.coming.remove(&(job, lease));
        self.disk.pixels.insert((job, lease), part);
        self.settle(job, lease, part);
    }

    fn settle(&mut self, job: JobId, lease: LeaseId, part: PartId) {
        if self.revoked.contains(&lease) {
            return;
        }
        if let Some(first) = self.settled.insert((job, part), lease) {
            self.violation(format!("part {} is committed twice, by leases {} and {}", part.0, first.0, lease.0));
        }
    }

    /// Appends to the journal, and sees to it that it comes to the disk.
    pub(super) fn note(&mut self, news: Vec<(Duration, Event)>) {
        self.disk.journal.extend(news);
        let entries = self.disk.journal.len();
        if entries > self.disk.synced && !self.disk.syncing {
            self.disk.syncing = true;
            let at = self.now + Duration::from_secs_f64(self.scenario.disk * self.random.between(0.5, 2.0));
            self.plan(at, Happening::Synced(entries, self.epoch));
        }
    }

    /// What waited for the disk is done.
    pub(super) fn synced(&mut self, entries: usize) {
        self.disk.synced = self.disk.synced.max(entries);
        self.disk.syncing = false;
        let synced = self.disk.synced;
        for (_, job, outcome) in self.disk.ends.extract_if(.., |(at, ..)| *at <= synced).collect::<Vec<_>>() {
            self.end(job, outcome);
        }
        self.note(Vec::new());
    }

    /// The coordinator dies and comes back with what is on its disk: all that was synced, and perhaps some of what was on its way.
    pub(super) fn restart(&mut self) {
        self.check_replay();
        let unsynced = (self.disk.journal.len() - self.disk.synced) as u32;
        let lost = self.disk.journal.split_off(self.disk.synced + self.random.below(unsynced + 1) as usize);
        self.disk.ends.retain(|(at, ..)| *at <= self.disk.journal.len());
        self.farm = self.replayed();
        self.filter = Filter::default();
        (self.epoch, self.disk.syncing) = (self.epoch + 1, false);
        self.ahead = self.farm.now().as_nanos() as i64 - self.now.as_nanos() as i64;
        let before = std::mem::take(&mut self.settled);
        let stored = self.recover_pixels();
        self.settle_again(&stored);
        self.step(Event::Restarted { build: canary(self.build), stored });
        self.check_settled(&before);
        self.open.clear();
        self.synced(self.disk.journal.len());
        // Who was not answered asks again.
        lost.into_iter().map(|(_, event)| event).filter(is_of_user).for_each(|event| self.step(event));
        for node in 0..self.nodes.len() {
            if self.nodes[node].alive {
                let joined = self.nodes[node].joined();
                let seconds = self.random.between(0.05, 1.0);
                self.say(node, seconds, joined);
            }
        }
    }

    fn replayed(&self) -> Farm {
        let mut farm = Farm::new(self.scenario.config.clone());
        for (at, event) in &self.disk.journal {
            farm.step(*at, event.clone());
        }
        farm
    }

    /// The whole journal tells what the farm knows.
    fn check_replay(&mut self) {
        let entries = self.disk.journal.len();
        self.disk.journal.extend(self.filter.flush());
        if let Some(difference) = self.farm.difference(&self.replayed()) {
            self.violation(format!("the replayed journal differs: {difference}"));
        }
        self.disk.journal.truncate(entries);
    }

    /// Attempts whose pixels reached the disk when their commit did not; those on their way may have or not.
    fn recover_pixels(&mut self) -> Vec<(JobId, LeaseId)> {
        for ((job, lease), part) in std::mem::take(&mut self.disk.coming) {
            if self.random.happens(0.5) {
                self.disk.pixels.insert((job, lease), part);
            }
        }
        let open: Vec<JobId> = self.farm.jobs().into_iter().filter(|job| job.outcome.is_none()).map(|job| job.id).collect();
        let is_new = |job: JobId, lease: LeaseId| !self.farm.committed(job).iter().any(|(_, _, committed)| *committed == lease);
        let stored = self.disk.pixels.keys().filter(|(job, _)| open.contains(job));
        stored.filter(|(job, lease)| is_new(*job, *lease)).copied().collect()
    }

    /// What the farm is about to take for committed: what the journal tells, and what was found on disk.
    fn settle_again(&mut self, stored: &[(JobId, LeaseId)]) {
        let mut farm = self.farm.clone();
        farm.step(self.clock(), Event::Restarted { build: canary(self.build), stored: stored.to_vec() });
        for job in farm.jobs().into_iter().map(|job| job.id) {
            for (part, _, lease) in farm.committed(job) {
                // What a crash took may have revoked it.
                self.revoked.remove(&lease);
                self.settled.insert((job, part), lease);
            }
        }
    }

    /// No part that was committed is to be rendered again, and what is taken for committed is on disk.
    fn check_settled(&mut self, before: &BTreeMap<(JobId, PartId), LeaseId>) {
        for job in self.farm.jobs().into_iter().filter(|job| job.outcome.is_none()).map(|job| job.id) {
            for (part, _, lease) in self.farm.committed(job) {
                if !self.disk.pixels.contains_key(&(job, lease)) {
                    self.violation(format!("part {} of job {} is taken for committed, and is not on disk", part.0, job.0));
                }
            }
            let lost = before.iter().find(|((of, part), lease)| *of == job && self.settled.get(&(job, *part)) != Some(lease));
            if let Some(((_, part), lease)) = lost {
                self.violation(format!("part {} of job {}, committed by lease {}, is lost with the coordinator", part.0, job.0, lease.0));
            }
        }
    }
}

/// Whether a user said it, who waits for an answer until it is on disk.
fn is_of_user(event: &Event) -> bool {
    matches!(
        event,
        Event::JobSubmitted { .. }
            | Event::JobCancelled { .. }
            | Event::JobPaused { .. }
            | Event::JobResumed { .. }
            | Event::JobRanked { .. }
    )
}
