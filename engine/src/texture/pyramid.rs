//! Smaller and smaller copies of an image, so that a pixel of the film that covers much of it needs to look at few of its pixels (Williams, "Pyramidal Parametrics", 1983).

use glam::DVec2;

use super::{Footprint, Image, bilinear, mix};
use crate::{description::Wrap, math::log2};

/// Copies of an image from half of its size down to a single pixel, each the mean of the one before, in linear light.
#[derive(Debug)]
pub struct Pyramid {
    levels: Vec<Image>,
}

impl Pyramid {
    /// Of an image; of a single pixel, none.
    pub fn new(image: &Image) -> Self {
        let mut levels: Vec<Image> = Vec::new();
        while let Some(next) = halved(levels.last().unwrap_or(image)) {
            levels.push(next);
        }
        Self { levels }
    }

    /// Bytes of memory that the copies take.
    pub fn memory(&self) -> usize {
        self.levels.iter().map(Image::memory).sum()
    }

    /// The colour at `uv`, between the two copies whose pixels are about as large as the longer side of a footprint (OpenGL 4.6, 8.14: level `log2` of its length in pixels).
    /// Where that is at most one pixel of the `image`, or no number as on triangles that show but a place or a line of it, it is bilinearly interpolated.
    pub(super) fn look(&self, image: &Image, wrap: [Wrap; 2], uv: DVec2, footprint: &Footprint) -> [f32; 4] {
        let level = level(image.size(), footprint);
        if level.is_nan() || level <= 0.0 {
            return bilinear(image, wrap, uv);
        }
        let level = level.min(self.levels.len() as f64);
        let finer = level.floor();
        let at = |level: usize| bilinear(level.checked_sub(1).map_or(image, |level| &self.levels[level]), wrap, uv);
        let (number, share) = (finer as usize, (level - finer) as f32);
        if share == 0.0 { at(number) } else { mix(at(number), at(number + 1), share) }
    }
}

/// `log2` of the longer side of a footprint in pixels of an image.
fn level([width, height]: [u32; 2], Footprint(sides): &Footprint) -> f64 {
    let pixels = DVec2::new(width.into(), height.into());
    let squared = sides.map(|side| (side.as_dvec2() * pixels).length_squared());
    0.5 * log2(if squared[0] > squared[1] { squared[0] } else { squared[1] })
}

/// An image of half the size, rounded down to whole pixels, at least one; `None` of a single pixel. Each of its pixels is the mean of what it covers, so that the mean of
/// all stays what it is, whatever the size.
fn halved(image: &Image) -> Option<Image> {
    let size = image.size();
    if size == [1, 1] {
        return None;
    }
    let smaller = size.map(|side| (side / 2).max(1));
    let columns: Vec<_> = (0..smaller[0]).map(|x| covered(x, size[0], smaller[0])).collect();
    let channels = image.channels();
    let mut samples = Vec::with_capacity(smaller[0] as usize * smaller[1] as usize * channels.len());
    for y in 0..smaller[1] {
        let rows = covered(y, size[1], smaller[1]);
        for columns in &columns {
            let mut sum = [0.0; 4];
            for &(row, of_row) in rows.iter().filter(|(_, share)| *share > 0.0) {
                for &(column, of_column) in columns.iter().filter(|(_, share)| *share > 0.0) {
                    let pixel = image.pixel(column, row);
                    sum = std::array::from_fn(|i| sum[i] + f64::from(pixel[i]) * (of_row * of_column));
                }
            }
            samples.extend(channels.iter().map(|&channel| sum[channel] as f32));
        }
    }
    Some(Image::linear(smaller, channels.len(), samples))
}

/// The pixels of a side of `from` that pixel `i` of half as long a side of `to` covers, and their shares of it: two, or three where that had to be rounded down.
fn covered(i: u32, from: u32, to: u32) -> [(u32, f64); 3] {
    // In units of 1 / (from to) of the side, so that nothing is rounded.
    let [i, from, to] = [i, from, to].map(u64::from);
    let (start, end) = (i * from, (i + 1) * from);
    std::array::from_fn(|n| {
        let pixel = (start / to + n as u64).min(from - 1);
        let overlap = ((pixel + 1) * to).min(end).saturating_sub((pixel * to).max(start));
        let again = start / to + n as u64 > pixel;
        (pixel as u32, if again { 0.0 } else { overlap as f64 / from as f64 })
    })
}

#[cfg(test)]
mod tests;
