//! What the status page shows: the farm at one moment.

use serde::Serialize;

use crate::{
    farm::{Farm, JobId, JobPhase, JobSnapshot, NodeSnapshot, NodeState, Outcome, PartSnapshot},
    limits::STATUS_PARTS,
    manifest,
    schedule::NodeId,
};

/// The farm at one moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Snapshot {
    /// Version and engine revision of the coordinator.
    pub program: String,
    /// Why no job is taken now, if so.
    pub refusal: Option<String>,
    /// Every node that is known.
    pub nodes: Vec<NodeStatus>,
    /// Jobs that wait, run, or ended lately, in order of submission.
    pub jobs: Vec<JobStatus>,
}

/// A node.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NodeStatus {
    /// Its id.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// Where it connected from.
    pub address: String,
    /// Rendering threads.
    pub lanes: u32,
    /// How it stands.
    pub state: NodeState,
    /// Why, where it gets no work.
    pub reason: String,
    /// Its power in the running job, where it was measured.
    pub power: Option<f64>,
    /// Parts that it holds now.
    pub holds: usize,
}

/// A job.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JobStatus {
    /// Its id.
    pub id: u64,
    /// Its name.
    pub name: String,
    /// Who submitted it.
    pub owner: String,
    /// Its rank.
    pub priority: i32,
    /// Whether it waits until someone resumes it.
    pub paused: bool,
    /// How far it is.
    pub phase: JobPhase,
    /// How it ended, in words; empty while it has not.
    pub outcome: String,
    /// Why its files are not written, where the disk refuses them.
    pub trouble: Option<String>,
    /// Columns of the frame.
    pub width: u32,
    /// Rows of the frame.
    pub height: u32,
    /// Seconds since its submission, until it ended.
    pub seconds: f64,
    /// Number of parts; 0 until the frame is split.
    pub total: usize,
    /// Parts that are on disk.
    pub committed: usize,
    /// All parts, unless there are more than [`STATUS_PARTS`].
    pub parts: Vec<PartSnapshot>,
}

impl Snapshot {
    /// The farm now. `seen` tells what its core does not know of a job: columns and rows of its frame, and why its files are not written. Jobs of which
    /// it knows nothing are left out: they were deleted.
    pub fn of(farm: &Farm, refusal: Option<String>, seen: impl Fn(JobId) -> Option<((u32, u32), Option<String>)>) -> Self {
        let job = |job: JobSnapshot| {
            let ((width, height), trouble) = seen(job.id)?;
            let parts = if job.parts <= STATUS_PARTS { farm.parts(job.id) } else { Vec::new() };
            let (phase, outcome) = (job.phase, outcome(job.outcome));
            let JobSnapshot { id, name, owner, priority, paused, seconds, parts: total, committed, .. } = job;
            Some(JobStatus {
                id: id.0,
                name,
                owner,
                priority,
                paused,
                phase,
                outcome,
                trouble,
                width,
                height,
                seconds,
                total,
                committed,
                parts,
            })
        };
        Self {
            program: manifest::program(),
            refusal,
            nodes: farm.nodes().into_iter().map(NodeStatus::from).collect(),
            jobs: farm.jobs().into_iter().filter_map(job).collect(),
        }
    }
}

impl From<NodeSnapshot> for NodeStatus {
    fn from(node: NodeSnapshot) -> Self {
        let NodeSnapshot { id, name, address, lanes, state, reason, power, holds, .. } = node;
        Self { id, name, address, lanes, state, reason, power, holds }
    }
}

fn outcome(outcome: Option<Outcome>) -> String {
    match outcome {
        None => String::new(),
        Some(Outcome::Finished) => "finished".to_owned(),
        Some(Outcome::Incomplete { holes }) => format!("incomplete: {holes} parts could not be rendered"),
        Some(Outcome::Failed { reason }) => format!("failed: {reason}"),
        Some(Outcome::Cancelled { reason }) => format!("cancelled: {reason}"),
    }
}
