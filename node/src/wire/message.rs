//! What nodes and the coordinator say to each other. Postcard numbers an enum's variants in their order: never reorder, only append.

use serde::{Deserialize, Serialize};
use tessera_engine::{
    description::AssetId,
    part::{Rect, SampleRange},
};

use crate::farm::{Incarnation, JobId, LeaseId};

/// The first frame on every bidirectional stream that a node opens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum NodeStream {
    /// The control stream.
    Control(Hello),
    /// A question for an asset. The answer is its length (u64, little-endian; all ones where it is unknown) and its bytes.
    Asset(AssetId),
}

/// What a node says of itself; its name stands in its certificate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// Its life.
    pub incarnation: Incarnation,
    /// Rendering threads.
    pub lanes: u32,
    /// The program, for people.
    pub build: String,
    /// [`tessera_engine::REVISION`] of its engine.
    pub revision: u32,
}

/// Node to coordinator, on the control stream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FromNode {
    /// Answers [`ToNode::Prove`]: the hash of the canary part.
    Proof {
        /// BLAKE3 of its pixels.
        hash: [u8; 32],
    },
    /// Answers [`ToNode::Prepare`].
    Prepared {
        /// The job.
        job: JobId,
        /// Nothing, or why the scene cannot be compiled here.
        result: Result<(), String>,
    },
    /// Answers [`ToNode::Probe`].
    Probed {
        /// The job.
        job: JobId,
        /// Index of each cell and the seconds that one lane took for one sample of one pixel in it, on the average.
        cells: Vec<(u32, f64)>,
    },
    /// A part could not be rendered.
    Failed {
        /// The job.
        job: JobId,
        /// The attempt.
        lease: LeaseId,
        /// Why.
        reason: String,
    },
    /// An attempt was stopped, or had never begun, as [`ToNode::Cancel`] asked.
    Cancelled {
        /// The job.
        job: JobId,
        /// The attempt.
        lease: LeaseId,
    },
    /// The node ends; what it holds is to be given to others.
    Goodbye {
        /// Why.
        reason: String,
    },
    /// The node is about to go: it finishes what its lanes render, and wants nothing new.
    Draining,
}

/// Coordinator to node, on the control stream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToNode {
    /// Render the canary part.
    Prove {
        /// Chooses it.
        seed: u64,
    },
    /// Fetch what is missing of a frame and compile it.
    Prepare {
        /// The job.
        job: JobId,
        /// The coded [`tessera_engine::description::Frame`], as an asset.
        frame: AssetId,
        /// Every asset that it needs.
        assets: Vec<AssetId>,
    },
    /// Measure cells of a job's frame.
    Probe {
        /// The job.
        job: JobId,
        /// Cells by index, with their pixels.
        cells: Vec<(u32, Rect)>,
        /// Distance of the rendered pixels from each other, in both directions.
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
    /// Stop an attempt.
    Cancel {
        /// The job.
        job: JobId,
        /// The attempt.
        lease: LeaseId,
    },
    /// The result of an attempt is on disk here, or not wanted: the node may forget it.
    Settled {
        /// The job.
        job: JobId,
        /// The attempt.
        lease: LeaseId,
    },
    /// A job is over.
    Release {
        /// The job.
        job: JobId,
    },
}

/// Announces a part's pixels: `width x height` times RGB as f32, little-endian, row by row; they follow, until the stream ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartHeader {
    /// The job.
    pub job: JobId,
    /// The attempt.
    pub lease: LeaseId,
    /// The frame that was rendered: a number of a job can come again where a coordinator lost its data, a frame's id cannot.
    pub frame: AssetId,
    /// Seconds that the lane took.
    pub seconds: f64,
    /// As [`tessera_engine::part::RenderedPart::hash`] gives it: over rectangle and pixels.
    pub hash: [u8; 32],
    /// Samples that were invalid: see [`tessera_engine::part::Counters::invalid_samples`].
    pub invalid_samples: u64,
}

/// A sign of life, sent as a datagram so that no bulk stream holds it up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Heartbeat {
    /// Whose life.
    pub incarnation: Incarnation,
}
