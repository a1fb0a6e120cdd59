//! What stands in a manifest. Times are seconds on the job's own time line, 0 at its submission.

use std::{collections::BTreeMap, ops::Not};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::schedule::{NodeId, PartId};

/// Raised when a reader of an earlier version could misread a manifest.
pub const VERSION: u32 = 1;

/// The whole manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// [`VERSION`].
    pub version: u32,
    /// Version and engine revision of the program that wrote it.
    pub program: String,
    /// What was asked for.
    pub job: JobEntry,
    /// The picture.
    pub image: ImageEntry,
    /// How costs were learned.
    pub probe: ProbeEntry,
    /// Every node that took part, in order of its id.
    pub nodes: Vec<NodeEntry>,
    /// Every part, in order of its id.
    pub parts: Vec<PartEntry>,
    /// The paper's table S_n: parts, hardest first.
    pub difficulty: Vec<PartId>,
    /// The paper's table R_p: nodes that were measured, most powerful first.
    pub power: Vec<NodeId>,
    /// What happened, in order of time.
    pub events: Vec<EventEntry>,
    /// What came of it.
    pub report: ReportEntry,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// What was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JobEntry {
    /// The coordinator's number for it.
    pub id: u64,
    /// Its name: the script's file name without ending.
    pub name: String,
    /// Values given with `--set`.
    pub parameters: BTreeMap<String, String>,
    /// Moment of submission, RFC 3339 in UTC.
    pub submitted: String,
    /// How it was split, in words.
    pub split: String,
    /// How it was assigned, in words.
    pub assign: String,
    /// `finished`, `failed: ...` or `cancelled: ...`.
    pub outcome: String,
}

/// The picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImageEntry {
    /// File name of the EXR.
    pub exr: String,
    /// File name of the PNG preview.
    pub png: Option<String>,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples a pixel.
    pub samples: u64,
    /// Samples a pixel of the picture that this one was extended from, step by step; what this manifest tells beside the picture is of the last step, which doubled them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extended_from: Option<u64>,
    /// Chooses the sample pattern.
    pub seed: u64,
    /// Identity of what is pictured, in hexadecimal.
    pub image_hash: String,
    /// How the EXR holds its numbers.
    pub pixel_type: PixelType,
    /// What the EXR tells beside colours, in the order in which a pixel's numbers are hashed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub aovs: Vec<String>,
    /// BLAKE3 of the pixels as they are read from the EXR (float32, little-endian, RGB, row by row; behind each row what it tells beside colours, pixel by
    /// pixel), in hexadecimal.
    pub pixels_hash: String,
    /// Rectangles that nobody could render: `[x, y, width, height]`. They are black in the EXR and magenta in the preview.
    #[serde(default)]
    pub holes: Vec<[u32; 4]>,
    /// Values that half floats could not hold and that were clamped, where the EXR holds half floats.
    pub clamped: u64,
    /// Whether every pixel is black; left out where not.
    #[serde(default, skip_serializing_if = "Not::not")]
    pub is_black: bool,
    /// Samples with a component that was negative or no finite number: they count as black.
    #[serde(default)]
    pub invalid_samples: u64,
}

impl ImageEntry {
    /// Samples of all pixels.
    pub fn sample_count(&self) -> u64 {
        u64::from(self.width).saturating_mul(self.height.into()).saturating_mul(self.samples)
    }
}

/// How an EXR holds its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PixelType {
    /// 32-bit floats: those that were rendered.
    Float,
    /// 16-bit floats, rounded to nearest.
    Half,
}

/// How costs were learned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeEntry {
    /// `every_node`, `shared` or `known`.
    pub mode: String,
    /// Linear fraction of the resolution.
    pub scale: Option<f64>,
    /// Seconds from the first probe message to the last answer.
    pub seconds: f64,
    /// Edge of a cell in pixels.
    pub cell: u32,
    /// Cells in a row.
    pub columns: u32,
    /// Rows of cells.
    pub rows: u32,
    /// Predicted seconds per pixel in each cell, on a node of power 1, row by row.
    pub seconds_per_pixel: Vec<f64>,
}

/// A node that took part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodeEntry {
    /// Its id.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// Rendering threads.
    pub lanes: u32,
    /// Version and engine revision.
    pub build: String,
    /// Throughput by the probe: its entry in the table R_p. 0 where it never was measured.
    pub power: f64,
    /// Parts of it that were committed.
    pub parts: u32,
    /// Seconds that its lanes spent on committed parts.
    pub busy: f64,
    /// Moment of its last commit.
    pub finish: f64,
    /// Seconds it was measured to take for each probe cell, per sample of a pixel: `[cell, seconds]`.
    pub probed: Vec<(u32, f64)>,
}

/// A part and every attempt at it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartEntry {
    /// Its id.
    pub id: PartId,
    /// `[x, y, width, height]` in pixels.
    pub rect: [u32; 4],
    /// Predicted seconds on a node of power 1.
    pub predicted: f64,
    /// Whom the plan gave it to at first.
    pub planned: Option<NodeId>,
    /// BLAKE3 of its rectangle (four little-endian u32) and its pixels (as in [`ImageEntry::pixels_hash`], but never rounded to half floats, and with all
    /// that it tells beside colours behind all of these), in hexadecimal, once it is committed.
    pub hash: Option<String>,
    /// Samples of its pixels that are invalid: see [`ImageEntry::invalid_samples`].
    #[serde(default)]
    pub invalid_samples: u64,
    /// Attempts in order of their start.
    pub attempts: Vec<AttemptEntry>,
    /// Smaller parts that took its place, where it was cut up.
    #[serde(default)]
    pub replaced_by: Vec<PartId>,
}

/// One attempt at a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AttemptEntry {
    /// Number of the lease.
    pub lease: u64,
    /// By whom.
    pub node: NodeId,
    /// Moment at which it was handed out.
    pub start: f64,
    /// Moment at which it ended, if it did.
    pub end: Option<f64>,
    /// Seconds that the lane took, where it was delivered.
    pub seconds: Option<f64>,
    /// How it ended.
    pub outcome: AttemptOutcome,
    /// Why, where it was not committed.
    pub reason: Option<String>,
}

/// How an attempt ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AttemptOutcome {
    /// Not yet.
    Running,
    /// Its pixels are in the picture.
    Committed,
    /// Another attempt was first, or its incarnation was void.
    Discarded,
    /// The node said that it could not.
    Failed,
    /// The node was lost while it ran.
    Lost,
    /// It was called back.
    Cancelled,
    /// Its pixels were compared with those of another attempt.
    Compared,
    /// Its node turned out to deliver wrong pixels.
    Revoked,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EventEntry {
    /// When.
    pub time: f64,
    /// What.
    pub kind: EventKind,
    /// Which node, where one is concerned.
    pub node: Option<NodeId>,
    /// Which parts, where some are concerned.
    pub parts: Vec<PartId>,
    /// In words.
    pub detail: String,
}

/// Kinds of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// A node joined.
    Joined,
    /// A node was refused work.
    Refused,
    /// A node was silent for too long; its parts go to others.
    Suspected,
    /// A suspected node was heard again.
    Recovered,
    /// A node was declared dead, or said goodbye.
    Lost,
    /// Parts were given to other nodes.
    Reassigned,
    /// Probing began.
    ProbeStarted,
    /// Probing ended.
    ProbeFinished,
    /// The frame was split and assigned; rendering began.
    RenderStarted,
    /// All parts are committed.
    RenderFinished,
    /// The job's own policy failed or was late; a built-in one decided.
    PolicyReplaced,
    /// An attempt took far longer than predicted; another lane tries too.
    Overdue,
    /// An idle node renders a part that another one holds too.
    Speculated,
    /// A part was replaced by smaller ones.
    Cut,
    /// A part that nobody could render was left out of the picture.
    LeftOut,
    /// A node delivered wrong pixels; it gets no work any more.
    Quarantined,
    /// Committed parts do not count any more, and are rendered again.
    Revoked,
    /// Parts that were to be rendered twice were not.
    AuditSkipped,
    /// Somebody wanted the job to wait.
    Paused,
    /// It went on.
    Resumed,
    /// A node was about to go: it finished what its lanes rendered.
    Draining,
    /// No node of the build on which the job began was left: it began anew on another.
    BegunAnew,
}

/// What came of it, in the paper's terms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReportEntry {
    /// Seconds from submission to the finished file.
    pub total: f64,
    /// Seconds from the first part handed out to the last commit: T_n.
    pub makespan: f64,
    /// Lane seconds of all committed parts.
    pub work: f64,
    /// Speedup S = T_1 / T_n over the mean node: T_1 is what a node of mean power would take alone.
    pub speedup: f64,
    /// Efficiency E: work done over what all nodes could have done in the makespan, by their measured powers.
    pub efficiency: f64,
    /// Overbalance L = (max - min) / min of the nodes' finish times, counted from the first part handed out.
    pub overbalance: f64,
}
