//! What a job script comes to: all that the farm needs, as plain data.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tessera_engine::description::{AssetId, Frame};

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
    /// What is written.
    pub output: Output,
    /// The script itself, where a policy is one of its functions.
    pub script: Option<ScriptBundle>,
    /// Values given with `--set`.
    pub parameters: BTreeMap<String, String>,
    /// What the user should know: of files, what is not modelled.
    pub warnings: Vec<String>,
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
