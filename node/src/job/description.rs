//! What a job script comes to: all that the farm needs, as plain data.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tessera_engine::description::{Aovs, AssetId, Frame};

use crate::schedule::{Assign, Probe, Split};

/// One job, as it is submitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobDescription {
    /// The script's file name without ending.
    pub name: String,
    /// What is pictured.
    pub frame: Frame,
    /// Every asset that the frame needs, in order of their ids, each once.
    pub assets: Vec<AssetId>,
    /// How costs are learned.
    pub probe: Probe,
    /// How the frame is split.
    pub split: Split,
    /// How parts are assigned.
    pub assign: Assign,
    /// Share of the parts that two nodes render, to compare their pixels: 0 to 1.
    pub audit: f64,
    /// Failures of a part, on different nodes where there are such, after which it is cut up or left out: 1 or more.
    pub attempts: u32,
    /// Seconds that it waits for a node when there is none; `None` for the farm's own patience.
    pub patience: Option<f64>,
    /// What is written.
    pub output: Output,
    /// The script itself, where a policy is one of its functions.
    pub script: Option<ScriptBundle>,
    /// Values given with `--set`.
    pub parameters: BTreeMap<String, String>,
    /// What the user should know: of files, what is not modelled.
    pub warnings: Vec<String>,
}

/// Frames of a sequence, each a job of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    /// Number of the first frame.
    pub first: u32,
    /// No frame has a higher number.
    pub last: u32,
    /// Distance of the numbers.
    pub step: u32,
    /// Whether each frame waits until the one before it is finished.
    pub in_order: bool,
}

impl Frames {
    /// The frames' numbers.
    pub fn numbers(&self) -> impl Iterator<Item = u32> + use<> {
        (self.first..=self.last).step_by(self.step as usize)
    }
}

impl std::fmt::Display for Frames {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} to {}", self.first, self.last)?;
        if self.step > 1 { write!(f, " in steps of {}", self.step) } else { Ok(()) }
    }
}

/// The files of a job: plain names, without a path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// The picture.
    pub exr: String,
    /// A preview.
    pub png: Option<String>,
    /// The manifest.
    pub manifest: String,
    /// How the EXR holds its pixels.
    pub pixel_type: PixelType,
    /// The preview's exposure in stops: radiance is multiplied by `2^exposure`.
    pub exposure: f64,
}

/// How the EXR holds its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum PixelType {
    /// 32-bit floats.
    Float,
    /// 16-bit floats.
    Half,
}

/// A job script and the modules that it required, by the names under which it required them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScriptBundle {
    /// The script's name as the user wrote it, for messages.
    pub name: String,
    /// Its source.
    pub source: String,
    /// Module name to (file name for messages, source).
    pub modules: BTreeMap<String, (String, String)>,
}

/// What keeps a picture that tells it from being extended to more samples, in words, if anything does.
pub fn not_extended(aovs: Aovs) -> Option<String> {
    let fixed: Vec<_> = aovs.iter().filter(|aov| !aov.can_be_extended()).map(|aov| format!("\"{}\"", aov.name())).collect();
    (!fixed.is_empty()).then(|| fixed.join(", "))
}
