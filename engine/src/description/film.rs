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
    /// The pixel's centre alone; where nothing else is left to chance, further samples repeat it.
    Point,
    /// A Gaussian of standard deviation 0.5 pixels, cut off 1.5 pixels from the centre and lowered so that it ends at 0.
    Gaussian,
    /// Blackman and Harris's window, 1.5 pixels to either side: much like a Gaussian, but ends smoothly.
    BlackmanHarris,
    /// Mitchell and Netravali's cubic with B = C = 1/3, 2 pixels to either side: sharper, with a slight dark rim beside bright edges.
    Mitchell,
}

/// How accurate the frame shall be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// Samples in every pixel, at least 1.
    pub samples: u32,
    /// Number of the first of them: pictures of other samples are independent of each other.
    pub first: u64,
}

impl Quality {
    /// So many samples from number 0 on.
    pub fn of(samples: u32) -> Self {
        Self { samples, first: 0 }
    }
}
