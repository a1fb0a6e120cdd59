//! The farm's status, as clients see it.

use std::{collections::BTreeMap, time::Duration};

use crate::{
    farm::{Farm, JobId, JobPhase, JobSnapshot, NodeSnapshot, Outcome},
    wire::{JobState, JobStatus, NodeStatus, Status},
};

/// When a job's rendering was first seen, and how far it was: what the time left is reckoned from.
pub type Times = (Duration, f64);

/// The farm's status at the moment `now`.
///
/// `seen` tells of a job why its files are not written; of jobs that were deleted it knows nothing.
pub fn of(
    farm: &Farm,
    times: &mut BTreeMap<JobId, Times>,
    now: Duration,
    refusal: Option<String>,
    seen: impl Fn(JobId) -> Option<Option<String>>,
) -> Status {
    let jobs = farm.jobs();
    times.retain(|id, _| jobs.iter().any(|job| job.id == *id));
    Status {
        nodes: farm.nodes().into_iter().map(node).collect(),
        jobs: jobs.into_iter().filter_map(|snapshot| Some((seen(snapshot.id)?, snapshot))).map(|it| job(it.1, it.0, times, now)).collect(),
        refusal,
    }
}

fn node(node: NodeSnapshot) -> NodeStatus {
    let NodeSnapshot { id, name, lanes, build, address, state, reason, holds, .. } = node;
    NodeStatus { id, name, lanes, address, build, state, reason, holds: u32::try_from(holds).unwrap_or(u32::MAX) }
}

fn job(job: JobSnapshot, trouble: Option<String>, times: &mut BTreeMap<JobId, Times>, now: Duration) -> JobStatus {
    let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
    let left = (job.phase == JobPhase::Rendering).then(|| {
        let (since, before) = *times.entry(job.id).or_insert((now, job.progress));
        let done = job.progress - before;
        (done > 0.0).then(|| now.saturating_sub(since).as_secs_f64() / done * (1.0 - job.progress))
    });
    JobStatus {
        job: job.id,
        name: job.name,
        owner: job.owner,
        priority: job.priority,
        paused: job.paused,
        state: state(job.phase, job.outcome),
        parts: count(job.parts),
        committed: count(job.committed),
        progress: job.progress,
        seconds: job.seconds,
        left: left.flatten(),
        trouble,
    }
}

/// Where a job stands.
pub fn state_of(job: &JobSnapshot) -> JobState {
    state(job.phase, job.outcome.clone())
}

/// How a job ended, or that it has not, in words.
pub fn words(state: &JobState) -> String {
    match state {
        JobState::Finished => "it is finished".to_owned(),
        JobState::Failed(reason) => format!("it failed: {reason}"),
        JobState::Cancelled(reason) => format!("it was cancelled: {reason}"),
        JobState::Incomplete(holes) => format!("{holes} parts of it could not be rendered"),
        _ => "it is not over".to_owned(),
    }
}

fn state(phase: JobPhase, outcome: Option<Outcome>) -> JobState {
    match (phase, outcome) {
        (_, Some(Outcome::Finished)) => JobState::Finished,
        (_, Some(Outcome::Incomplete { holes })) => JobState::Incomplete(u32::try_from(holes).unwrap_or(u32::MAX)),
        (_, Some(Outcome::Failed { reason })) => JobState::Failed(reason),
        (_, Some(Outcome::Cancelled { reason })) => JobState::Cancelled(reason),
        (JobPhase::Waiting | JobPhase::Over, None) => JobState::Waiting,
        (JobPhase::Preparing, None) => JobState::Preparing,
        (JobPhase::Probing, None) => JobState::Probing,
        (JobPhase::Planning, None) => JobState::Planning,
        (JobPhase::Rendering, None) => JobState::Rendering,
        (JobPhase::Assembling, None) => JobState::Assembling,
    }
}
