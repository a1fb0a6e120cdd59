//! The film: what the samples of a frame are gathered on, and how many there are.

use serde::{Deserialize, Serialize};

/// Size of the frame and its pixel filter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Film {
    /// Columns, 1 to 65,536.
    pub width: u32,
    /// Rows, 1 to 65,536.
    pub height: u32,
    /// Which points of the image plane a pixel averages.
    pub filter: Filter,
}

/// The pixel filter, sampled by importance: a sample belongs to one pixel alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Filter {
    /// The pixel's own square, evenly.
    Box,
    /// The pixel's centre alone; further samples repeat it.
    Point,
}

/// How accurate the frame shall be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// Samples in every pixel, at least 1.
    pub samples: u32,
}
