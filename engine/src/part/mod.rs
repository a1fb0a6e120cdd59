//! Parts: what a node is asked to render, and the rendering of one.

mod aovs;
mod canary;
mod counters;
mod pairwise;
mod pixels;
mod render;
mod rendered;
mod spread;
mod wave;
#[cfg(test)]
mod aovs_tests;
#[cfg(test)]
mod extremes_tests;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

pub use canary::{CanaryError, canary, canary_hash};
pub use counters::Counters;
pub use pairwise::{PairwiseSum, joined};
pub use render::{prepared, probe, render};
pub use rendered::{RenderedPart, WrongLength, hash_of_bytes};

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Rect {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Rect {
    /// Number of pixels.
    pub fn area(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// An aligned range of the samples of every pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct SampleRange {
    /// Index of the first sample.
    pub first: u64,
    /// Number of samples, at least 1.
    pub count: u64,
}

/// Rendering was told to stop; what it had done is dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("rendering was cancelled")]
pub struct Cancelled;
