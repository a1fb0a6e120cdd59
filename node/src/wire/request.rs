//! What clients ask and what the coordinator answers. Variants are numbered by their order: never reorder, only append.

use serde::{Deserialize, Serialize};
use tessera_engine::description::AssetId;

use crate::{
    farm::{JobId, NodeState},
    job::JobDescription,
    schedule::NodeId,
};

/// A client's request: the first frame on a bidirectional stream of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Take a job. The answer is [`Response::Wanted`]; the client sends those assets in that order, each as its length (u64, little-endian)
    /// and its bytes; the answer to that is [`Response::Submitted`].
    Submit {
        /// The job.
        description: Box<JobDescription>,
        /// How it stands in the queue.
        terms: Terms,
    },
    /// Say what there is: one [`Response::Status`].
    Status,
    /// Say how a job fares: [`Response::Job`] with the farm's nodes, now and at every change, until it has ended.
    Watch {
        /// The job.
        job: JobId,
    },
    /// Hand out a job's files: [`Response::Files`], then the bytes of each.
    Fetch {
        /// The job.
        job: JobId,
    },
    /// End a job: [`Response::Done`].
    Cancel {
        /// The job.
        job: JobId,
    },
    /// Say which jobs are kept: [`Response::Jobs`].
    List,
    /// Delete a job that is over, and what only it needs: [`Response::Done`].
    Delete {
        /// The job.
        job: JobId,
    },
    /// Let a node out of quarantine: [`Response::Done`].
    Release {
        /// Its name.
        node: String,
    },
    /// Give a job that waits or runs another place in the queue: [`Response::Done`].
    Move {
        /// The job.
        job: JobId,
        /// Where to.
        place: Place,
    },
}

/// How a job stands in the queue.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Terms {
    /// Nodes to wait for before the probe.
    pub min_nodes: u32,
    /// Its rank: jobs of higher ones go first.
    pub priority: i32,
    /// Jobs that have to be finished before it begins.
    pub after: Vec<JobId>,
}

impl Default for Terms {
    fn default() -> Self {
        Self { min_nodes: 1, priority: 0, after: Vec::new() }
    }
}

/// A place in the queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Place {
    /// It waits until it is resumed.
    Paused,
    /// It waits no more.
    Resumed,
    /// Among jobs of this priority.
    Ranked(i32),
}

/// The coordinator's answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Response {
    /// It was refused.
    Refused {
        /// Why.
        reason: String,
    },
    /// These assets are not here yet.
    Wanted(Vec<AssetId>),
    /// The job is taken.
    Submitted {
        /// Under this number.
        job: JobId,
    },
    /// Nodes and jobs.
    Status(Status),
    /// How a job fares, and the nodes of the farm.
    Job(JobStatus, Vec<NodeStatus>),
    /// The files that follow, in this order.
    Files(Vec<FileHeader>),
    /// It was done.
    Done,
    /// The role of who asks does not let it.
    Denied {
        /// Why.
        reason: String,
    },
    /// Jobs that are kept, oldest first.
    Jobs(Vec<KeptJob>),
}

/// A job that is kept.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptJob {
    /// Its number.
    pub job: JobId,
    /// Its name.
    pub name: String,
    /// Moment of submission, in seconds since 1970.
    pub submitted: u64,
    /// Where it stands, or how it ended.
    pub state: JobState,
    /// Bytes of its files and its description on the coordinator's disk; assets may serve several jobs, and are not among them.
    pub bytes: u64,
}

/// A file that follows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileHeader {
    /// Its plain name.
    pub name: String,
    /// Its bytes.
    pub length: u64,
}

/// Nodes and jobs of a farm.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// All nodes known, in order of their ids.
    pub nodes: Vec<NodeStatus>,
    /// All jobs known, oldest first.
    pub jobs: Vec<JobStatus>,
    /// Why no job is taken now, if so.
    pub refusal: Option<String>,
}

/// A node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeStatus {
    /// Its id.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// Rendering threads.
    pub lanes: u32,
    /// Where it connected from.
    pub address: String,
    /// Version and engine revision.
    pub build: String,
    /// Where it stands.
    pub state: NodeState,
    /// Why it is refused or lost; empty otherwise.
    pub reason: String,
    /// Parts that it holds.
    pub holds: u32,
}

/// A job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobStatus {
    /// Its number.
    pub job: JobId,
    /// Its name.
    pub name: String,
    /// Who submitted it.
    pub owner: String,
    /// Its rank.
    pub priority: i32,
    /// Whether nothing of it is handed out until it is resumed.
    pub paused: bool,
    /// Where it stands.
    pub state: JobState,
    /// Parts in all; 0 until it is split.
    pub parts: u32,
    /// Parts committed.
    pub committed: u32,
    /// Share of the predicted work that is committed, 0 to 1.
    pub progress: f64,
    /// Seconds since it was submitted, until it ended.
    pub seconds: f64,
    /// Seconds until all parts are committed, if the rest goes as what is committed went.
    pub left: Option<f64>,
    /// Why its files are not written, where the coordinator's disk refuses them.
    pub trouble: Option<String>,
}

/// Where a job stands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JobState {
    /// Another job runs, or no node is there.
    Waiting,
    /// Nodes gather, fetch and compile its scene.
    Preparing,
    /// Nodes measure its cost.
    Probing,
    /// It is split and assigned.
    Planning,
    /// Its parts are rendered.
    Rendering,
    /// Its files are written.
    Assembling,
    /// Its files stand.
    Finished,
    /// It could not be done.
    Failed(String),
    /// It was not wanted any more.
    Cancelled(String),
    /// Its files stand, but so many parts could not be rendered.
    Incomplete(u32),
}

impl JobState {
    /// Whether nothing more will come.
    pub fn is_over(&self) -> bool {
        matches!(self, Self::Finished | Self::Failed(_) | Self::Cancelled(_) | Self::Incomplete(_))
    }
}

/// Whether this can name an output file: no path, nothing hidden.
pub fn is_plain_name(name: &str) -> bool {
    !name.is_empty() && name.len() <= 255 && !name.starts_with('.') && !name.contains(['/', '\\', '\0'])
}
