//! What happens to the farm.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use tessera_engine::part::Rect;

use super::{Incarnation, JobId, LeaseId, PolicyId};
use crate::limits::ATTEMPTS_PER_PART;
use crate::schedule::{Assign, NodeId, PartId, Plan, Probe, Split};

/// What the core needs to know of a job; the picture itself is not its business.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobSpec {
    /// Name for people.
    pub name: String,
    /// Columns of the frame.
    pub width: u32,
    /// Rows of the frame.
    pub height: u32,
    /// Samples a pixel.
    pub samples: u64,
    /// Number of the first of them.
    pub first_sample: u64,
    /// How costs are learned.
    pub probe: Probe,
    /// How the frame is split.
    pub split: Split,
    /// How parts are assigned.
    pub assign: Assign,
    /// Nodes to wait for before the probe (for at most the stated limit): 1 or more.
    pub min_nodes: u32,
    /// Share of the parts that two nodes render, to compare their pixels: 0 to 1.
    pub audit: f64,
    /// Who submitted it: submitters of equal priority share the farm.
    pub owner: String,
    /// Its rank among jobs: higher ones go first.
    pub priority: i32,
    /// Jobs that have to be finished before it begins.
    pub after: Vec<JobId>,
    /// Failures of a part, on different nodes where there are such, after which it is cut up or left out: 1 or more.
    pub attempts: u32,
    /// How long it waits for a node when there is none; `None` for the farm's own patience.
    pub patience: Option<Duration>,
}

impl JobSpec {
    /// A job that asks for nothing in particular.
    pub fn plain(name: &str, width: u32, height: u32, samples: u64) -> Self {
        Self {
            name: name.to_owned(),
            width,
            height,
            samples,
            first_sample: 0,
            probe: Probe::Shared { scale: 1.0 / 16.0 },
            split: Split::Grid { width: 64, height: 64 },
            assign: Assign::EarliestFinish,
            min_nodes: 1,
            audit: 0.0,
            owner: "someone".to_owned(),
            priority: 0,
            after: Vec::new(),
            attempts: ATTEMPTS_PER_PART,
            patience: None,
        }
    }
}

/// What a program computes with: nodes of one build give the same pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Build {
    /// [`tessera_engine::REVISION`] of its engine.
    pub revision: u32,
    /// What it renders the canary part to.
    pub canary: [u8; 32],
}

/// What a node says of itself when it joins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeInfo {
    /// The name in its certificate.
    pub name: String,
    /// Rendering threads.
    pub lanes: u32,
    /// Version and engine revision.
    pub build: String,
    /// Where it connected from.
    pub address: String,
}

/// An answer of a job's own policy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Answer {
    /// To [`super::Question::Split`].
    Split(Vec<Rect>),
    /// To [`super::Question::Assign`] and [`super::Question::Redistribute`].
    Plan(Plan),
}

/// Everything that can happen to the farm. Each is journaled before its commands are carried out where it matters for recovery.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Event {
    /// A job was accepted; its description and assets are stored.
    JobSubmitted {
        /// The job's new id, above all earlier ones.
        job: JobId,
        /// What is to be done.
        spec: JobSpec,
    },
    /// Someone no longer wants the job.
    JobCancelled {
        /// The job.
        job: JobId,
        /// Who, or why.
        reason: String,
    },
    /// Someone wants the job to wait.
    JobPaused {
        /// The job.
        job: JobId,
        /// Who, or why.
        reason: String,
        /// Whether an operator says so: then nobody else lets it go on (see [`Farm::fixed`](super::Farm::fixed)).
        operator: bool,
    },
    /// It need not wait any more.
    JobResumed {
        /// The job.
        job: JobId,
        /// Who, or why.
        reason: String,
    },
    /// Someone gives the job another rank.
    JobRanked {
        /// The job.
        job: JobId,
        /// Its new priority.
        priority: i32,
        /// Whether an operator says so: then nobody else changes it.
        operator: bool,
    },
    /// A node connected and proved its certificate.
    NodeJoined {
        /// Its id (the same name has the same id).
        node: NodeId,
        /// Its life.
        incarnation: Incarnation,
        /// What it says of itself.
        info: NodeInfo,
    },
    /// A node rendered the canary part.
    NodeProved {
        /// The node.
        node: NodeId,
        /// Its life.
        incarnation: Incarnation,
        /// What it came to.
        canary: [u8; 32],
    },
    /// A node is about to go: it finishes what its lanes render.
    NodeDraining {
        /// The node.
        node: NodeId,
        /// Its life.
        incarnation: Incarnation,
    },
    /// Any authenticated sign of life.
    NodeHeard {
        /// The node.
        node: NodeId,
        /// Its life.
        incarnation: Incarnation,
    },
    /// A node's connection closed (it said goodbye, or the transport gave up).
    NodeLeft {
        /// The node.
        node: NodeId,
        /// Its life.
        incarnation: Incarnation,
        /// Why.
        reason: String,
    },
    /// A node has fetched and compiled a job's scene, or could not.
    Prepared {
        /// The node.
        node: NodeId,
        /// Its life.
        incarnation: Incarnation,
        /// The job.
        job: JobId,
        /// Nothing, or why it cannot render this job.
        result: Result<(), String>,
    },
    /// A node has measured probe cells.
    Probed {
        /// The node.
        node: NodeId,
        /// Its life.
        incarnation: Incarnation,
        /// The job.
        job: JobId,
        /// Index of each cell and the seconds that one lane took for one sample of one pixel in it, on the average.
        cells: Vec<(u32, f64)>,
    },
    /// A node delivered a part: the shell holds its pixels, checked against their hash.
    Rendered {
        /// The node.
        node: NodeId,
        /// Its life.
        incarnation: Incarnation,
        /// The job.
        job: JobId,
        /// The attempt.
        lease: LeaseId,
        /// Hash of the pixels.
        hash: [u8; 32],
        /// Seconds that the lane took.
        seconds: f64,
        /// Samples that were invalid, and count as black.
        invalid_samples: u64,
    },
    /// A node could not render a part.
    RenderFailed {
        /// The node.
        node: NodeId,
        /// Its life.
        incarnation: Incarnation,
        /// The job.
        job: JobId,
        /// The attempt.
        lease: LeaseId,
        /// Why.
        reason: String,
    },
    /// A node has stopped an attempt, as it was told.
    Stopped {
        /// The node.
        node: NodeId,
        /// Its life.
        incarnation: Incarnation,
        /// The job.
        job: JobId,
        /// The attempt.
        lease: LeaseId,
    },
    /// An operator lets a node out of quarantine.
    NodeReleased {
        /// The node.
        node: NodeId,
    },
    /// Pixels that were on disk cannot be read back.
    PixelsLost {
        /// The job.
        job: JobId,
        /// The part.
        part: PartId,
        /// What is wrong with them.
        reason: String,
    },
    /// The pixels of an attempt are on disk.
    Committed {
        /// The job.
        job: JobId,
        /// The attempt.
        lease: LeaseId,
    },
    /// A job's own policy answered, or failed with a message that names its place in the script.
    PolicyAnswered {
        /// The question.
        id: PolicyId,
        /// The answer.
        answer: Result<Answer, String>,
    },
    /// The output files stand, or could not be written.
    Assembled {
        /// The job.
        job: JobId,
        /// Nothing, or why not.
        result: Result<(), String>,
    },
    /// The coordinator was started anew and has replayed its journal.
    Restarted {
        /// What it computes with.
        build: Build,
        /// Attempts of open jobs whose pixels were found on disk, and that the farm does not call committed. They come with the restart, and not before
        /// it: names that the farm gives until it knows of that may be those of attempts that the crash made it forget.
        stored: Vec<(JobId, LeaseId)>,
    },
    /// Nothing but time has passed: send it when [`super::Farm::next_deadline`] is reached.
    Tick,
}
