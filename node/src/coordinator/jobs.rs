//! Jobs in the hands of the core's task: they are taken, their files are written, the disk holds them up, they end.

use std::{collections::BTreeMap, sync::Arc, thread, time::Instant};

use tokio::sync::oneshot;

use super::{
    assemble::{self, Assembly, Refusal, identity},
    core::Core,
    input::Input,
    kept::{End, seconds_now},
    status,
    store::{Store, StoredJob},
    submission,
};
use crate::{
    farm::{Event, JobId, JobSnapshot, Outcome},
    job::JobDescription,
    limits::{DISK_RETRY, JOBS_FOR_OPERATORS, JOBS_PER_SUBMITTER, JOBS_WAITING, JOURNAL_EVENTS},
    wire::{JobState, Place, Terms},
};

/// Clients that wait to hear that their job is taken.
pub type Unanswered = BTreeMap<JobId, oneshot::Sender<Result<JobId, String>>>;

/// A job as this shell knows it.
pub struct Known {
    /// Columns and rows of its frame.
    pub size: (u32, u32),
    /// What was submitted, until it is over.
    pub stored: Option<Arc<StoredJob>>,
    /// Why its files are not written.
    pub trouble: Option<String>,
}

impl Known {
    /// A job that waits or runs.
    pub fn new(stored: StoredJob) -> Self {
        let film = &stored.description.frame.film;
        Self { size: (film.width, film.height), stored: Some(Arc::new(stored)), trouble: None }
    }

    /// A job of an earlier start, unless it was deleted. One that is over, or can be read no more, has its size alone.
    pub fn again(store: &Store, job: &JobSnapshot) -> Option<Self> {
        let card = store.card(job.id);
        if job.outcome.is_some() {
            return Some(Self { size: card.ok()?.size, stored: None, trouble: None });
        }
        let unread = Self { size: card.map_or((0, 0), |card| card.size), stored: None, trouble: None };
        Some(store.get_job(job.id).map_or(unread, Self::new))
    }
}

impl Core {
    /// Why no job is taken now, if so.
    pub(super) fn refusal(&self) -> Option<String> {
        self.disk_trouble.clone().or_else(|| self.no_space.clone())
    }

    pub(super) fn submit(&mut self, description: JobDescription, mut terms: Terms, owner: &str, limited: bool) -> Result<JobId, String> {
        let words = |error: &dyn std::fmt::Display| format!("the job could not be stored: {error}");
        if let Some(refusal) = self.refusal() {
            return Err(refusal);
        }
        let running: Vec<JobSnapshot> = self.farm.jobs().into_iter().filter(|job| job.outcome.is_none()).collect();
        if limited && running.iter().filter(|job| job.owner == owner).count() >= JOBS_PER_SUBMITTER {
            return Err(format!("{JOBS_PER_SUBMITTER} jobs of {owner} wait or run already"));
        }
        if running.len() >= JOBS_WAITING - if limited { JOBS_FOR_OPERATORS } else { 0 } {
            return Err(format!("{} jobs wait or run already", running.len()));
        }
        self.settle_dependencies(&mut terms)?;
        let job = self.shared.store.next_job().map_err(|error| words(&error))?;
        let frame = postcard::to_stdvec(&description.frame).map_err(|error| words(&error))?;
        let frame = self.shared.store.put(&frame).map_err(|error| words(&error))?;
        let submitted = seconds_now();
        let spec = submission::spec(&description, &terms, owner);
        let identity = identity(&description)?;
        let stored = StoredJob { description, frame, submitted, image_hash: identity.image_hash, revision: identity.engine_revision };
        self.shared.store.put_job(job, &stored, owner).map_err(|error| words(&error))?;
        tracing::info!(job = job.0, name = stored.description.name, owner, "a job was submitted");
        self.jobs.insert(job, Known::new(stored));
        self.step(Event::JobSubmitted { job, spec });
        self.publish();
        Ok(job)
    }

    /// Jobs that are finished and perhaps forgotten need not be waited for; such as came to no good end, or never were, cannot be.
    fn settle_dependencies(&self, terms: &mut Terms) -> Result<(), String> {
        let known: BTreeMap<JobId, JobState> = self.farm.jobs().iter().map(|job| (job.id, status::state_of(job))).collect();
        for job in terms.after.clone() {
            // What the farm has forgotten the store knows; the end of what has just ended may not be on disk yet.
            let state = known.get(&job).cloned().map_or_else(|| self.shared.store.end(job).map(|end| end.state), Ok);
            match state {
                Ok(state) if !state.is_over() => {}
                Ok(JobState::Finished) => terms.after.retain(|other| *other != job),
                Ok(state) => return Err(format!("it is to wait for job {}, which is not finished: {}", job.0, status::words(&state))),
                Err(_) => return Err(format!("it is to wait for job {}, and there is none; `tessera list` shows which there are", job.0)),
            }
        }
        Ok(())
    }

    /// Tells the core of something that happens to a job that waits or runs.
    pub(super) fn change_open(&mut self, job: JobId, event: Event) -> Result<(), String> {
        if !self.farm.jobs().iter().any(|known| known.id == job && known.outcome.is_none()) {
            return Err(format!("there is no job {} that runs or waits", job.0));
        }
        self.step(event);
        Ok(())
    }

    /// What an operator said of a job's place in the queue, others do not change.
    pub(super) fn may_move(&self, job: JobId, place: Place, operator: bool) -> Result<(), String> {
        let fixed = self.farm.fixed(job);
        let said = match place {
            Place::Resumed if fixed.pause => "paused it",
            Place::Ranked(_) if fixed.rank => "gave it its priority",
            _ => return Ok(()),
        };
        if operator { Ok(()) } else { Err(format!("job {}: an operator {said}, and an operator alone changes that", job.0)) }
    }

    /// Answers a client when what was done is on disk, or no crash could take it back; at once where the disk refuses, for that may last.
    pub(super) fn answer(&self, reply: oneshot::Sender<Result<(), String>>, done: Result<(), String>) {
        if done.is_err() || self.disk_trouble.is_some() {
            return drop(reply.send(done));
        }
        self.disk.then(move || drop(reply.send(done)));
    }

    pub(super) fn answer_when_taken(&mut self, job: JobId, reply: oneshot::Sender<Result<JobId, String>>) {
        self.unanswered.insert(job, reply);
        let inputs = self.shared.inputs.clone();
        self.disk.then(move || drop(inputs.blocking_send(Input::Taken(job))));
    }

    /// The disk begins or ceases to refuse. Jobs that it has not taken yet are refused: their clients may try again, and need not wait.
    pub(super) fn disk_refuses(&mut self, trouble: Option<String>) {
        self.changed = true;
        self.disk_trouble.clone_from(&trouble);
        let Some(trouble) = trouble else { return };
        for (job, reply) in std::mem::take(&mut self.unanswered) {
            let reason = format!("the coordinator's disk does not take it: {trouble}");
            self.step(Event::JobCancelled { job, reason: reason.clone() });
            let _ = reply.send(Err(reason));
        }
    }

    /// The disk refuses a job's files. It holds up those behind it, so everyone who looks is told.
    pub(super) fn held_up(&mut self, job: JobId, reason: String) {
        let Some(known) = self.jobs.get_mut(&job).filter(|known| known.stored.is_some()) else { return };
        let trouble = format!("its files cannot be written: {reason}");
        if known.trouble.as_ref() != Some(&trouble) {
            tracing::error!(
                job = job.0,
                reason,
                "the job keeps its parts until the disk takes its files, and others wait; `tessera cancel` ends it"
            );
            known.trouble = Some(trouble);
            self.changed = true;
        }
    }

    pub(super) fn ended(&mut self, job: JobId, outcome: &Outcome) {
        if let Some(record) = self.farm.record(job) {
            self.shared.metrics.ended(outcome, &record);
        }
        if let Some(known) = self.jobs.get_mut(&job) {
            (known.stored, known.trouble) = (None, None);
        }
        let farm = self.farm.jobs();
        // What the farm has forgotten is forgotten here too.
        self.jobs.retain(|id, _| farm.iter().any(|known| known.id == *id));
        let Some(state) = farm.iter().find(|known| known.id == job).map(status::state_of) else { return };
        let store = self.shared.store.clone();
        self.disk.then(move || {
            if let Err(error) = store.put_end(job, &End::now(state)) {
                tracing::warn!(job = job.0, %error, "the end of a job could not be noted: it is kept until the next start");
            }
        });
    }

    /// Shortens a long journal: a bound of the time that a start takes.
    pub(super) fn shorten_journal(&mut self) {
        if self.shared.metrics.journal_events.get() > JOURNAL_EVENTS {
            self.disk.renew(&self.farm);
        }
    }

    /// Whether a job may be deleted; then nobody is told of it from now on.
    pub(super) fn delete(&mut self, job: JobId) -> Result<(), String> {
        if self.farm.jobs().iter().any(|known| known.id == job && known.outcome.is_none()) {
            return Err(format!("job {0} waits or runs: `tessera cancel {0}` ends it", job.0));
        }
        if self.shared.store.end(job).is_err() {
            return Err(format!("there is no job {} that is over, or its end is not on disk yet", job.0));
        }
        tracing::info!(job = job.0, "a job is deleted");
        self.jobs.remove(&job);
        self.changed = true;
        Ok(())
    }

    pub(super) fn assemble(&mut self, job: JobId) {
        let stored = self.jobs.get(&job).and_then(|known| known.stored.clone());
        let (Some(stored), Some(record)) = (stored, self.farm.record(job)) else { return };
        let (parts, holes) = (self.farm.committed(job), self.farm.holes(job));
        let assembly = Assembly { job, stored, record, parts, holes, files: self.shared.store.files(job), made: Instant::now() };
        let (pixels, inputs, metrics) = (self.disk.pixels.clone(), self.shared.inputs.clone(), self.shared.metrics.clone());
        tokio::task::spawn_blocking(move || {
            let input = match assemble::write(&assembly, &pixels) {
                Ok(report) => {
                    metrics.finished(&report);
                    Input::Event(Event::Assembled { job, result: Ok(()) })
                }
                Err(Refusal::Pixels(part, reason)) => {
                    tracing::error!(job = job.0, part = part.0, reason, "pixels cannot be read back: the part is rendered again");
                    Input::Event(Event::PixelsLost { job, part, reason })
                }
                Err(Refusal::Files(reason)) => {
                    metrics.disk_refusals.inc();
                    drop(inputs.blocking_send(Input::HeldUp(job, reason)));
                    thread::sleep(DISK_RETRY);
                    Input::Assemble(job)
                }
            };
            drop(inputs.blocking_send(input));
        });
    }
}
