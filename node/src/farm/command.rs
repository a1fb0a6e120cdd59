//! What the farm's core wants done.

use serde::{Deserialize, Serialize};
use tessera_engine::part::{Rect, SampleRange};

use super::{Incarnation, JobId, LeaseId, PolicyId};
use crate::schedule::{CostMap, NodeId, NodePower, Part, PartId};

/// A message to a node; the shell puts it on the wire.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToNode {
    /// Render the canary part and say its hash.
    Prove,
    /// Fetch and compile a job's scene.
    Prepare {
        /// The job.
        job: JobId,
    },
    /// Measure these cells: in each, render one sample of the pixels of a lattice of step `stride`.
    Probe {
        /// The job.
        job: JobId,
        /// Cells by index, with their pixels.
        cells: Vec<(u32, Rect)>,
        /// Distance of the lattice's pixels.
        stride: u32,
    },
    /// Render a part.
    Render {
        /// The job.
        job: JobId,
        /// The attempt.
        lease: LeaseId,
        /// Its pixels.
        rect: Rect,
        /// Its samples.
        samples: SampleRange,
    },
    /// Stop an attempt, or forget it if it has not begun.
    Cancel {
        /// The job.
        job: JobId,
        /// The attempt.
        lease: LeaseId,
    },
    /// A job is over: its scene may be dropped.
    Release {
        /// The job.
        job: JobId,
    },
}

/// What a job's own policy is asked: a snapshot, so that the answer depends on nothing else.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Question {
    /// Split the frame into rectangles without gap or overlap.
    Split {
        /// Columns of the frame.
        width: u32,
        /// Rows of the frame.
        height: u32,
        /// What the probe measured.
        costs: CostMap,
        /// Nodes, most powerful first.
        nodes: Vec<NodePower>,
    },
    /// Give every part a node.
    Assign {
        /// Parts, hardest first.
        parts: Vec<Part>,
        /// Nodes, most powerful first.
        nodes: Vec<NodePower>,
    },
    /// The same for the parts of a lost node and the nodes that are left.
    Redistribute {
        /// Parts, hardest first.
        parts: Vec<Part>,
        /// Nodes, most powerful first.
        nodes: Vec<NodePower>,
    },
}

/// Why pixels that arrived are not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum DiscardReason {
    /// The part is committed already.
    Committed,
    /// The incarnation was declared dead.
    Dead,
    /// The job is over, or there never was such an attempt.
    Unknown,
    /// They were compared with those that are taken.
    Compared,
}

/// How a job ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// All parts are in the picture.
    Finished,
    /// All but some parts that nobody could render.
    Incomplete {
        /// How many.
        holes: usize,
    },
    /// It could not be done.
    Failed {
        /// Why, for people.
        reason: String,
    },
    /// It was not wanted any more.
    Cancelled {
        /// Who, or why.
        reason: String,
    },
}

/// What the shell is to do, in this order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Send a message to a node.
    Send {
        /// To whom.
        node: NodeId,
        /// In which life: if that is over, the message is dropped.
        incarnation: Incarnation,
        /// What.
        message: ToNode,
    },
    /// Close a node's connection.
    Close {
        /// Whose.
        node: NodeId,
        /// Of which life.
        incarnation: Incarnation,
        /// Said to the node and in the log.
        reason: String,
    },
    /// Ask the job's own policy; the answer comes back as [`super::Event::PolicyAnswered`].
    AskPolicy {
        /// The question's name.
        id: PolicyId,
        /// Whose policy.
        job: JobId,
        /// The question.
        question: Question,
    },
    /// Put the pixels of an attempt on disk, then say [`super::Event::Committed`].
    Commit {
        /// The job.
        job: JobId,
        /// The part.
        part: PartId,
        /// The attempt.
        lease: LeaseId,
    },
    /// Forget the pixels of an attempt.
    Discard {
        /// The job.
        job: JobId,
        /// The attempt.
        lease: LeaseId,
        /// Why.
        reason: DiscardReason,
    },
    /// Forget the pixels of an attempt that were to be, or are, on disk: they do not count any more.
    Revoke {
        /// The job.
        job: JobId,
        /// The part.
        part: PartId,
        /// The attempt.
        lease: LeaseId,
    },
    /// All parts are committed: write the outputs, then say [`super::Event::Assembled`].
    Assemble {
        /// The job.
        job: JobId,
    },
    /// The job is over.
    End {
        /// The job.
        job: JobId,
        /// How.
        outcome: Outcome,
    },
}
