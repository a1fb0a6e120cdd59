//! The finished pixels of a part, and their coding as bytes.

use super::{Counters, Rect};
use crate::description::Aovs;

/// Finished pixels of a rectangle.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderedPart {
    /// Where the pixels stand in the frame.
    pub rect: Rect,
    /// Linear RGB, row by row from the top, `rect.area()` pixels; finite and not negative.
    pub pixels: Vec<[f32; 3]>,
    /// What the frame tells beside colours, pixel by pixel, each in the order of [`Aovs::channels`]; finite. Empty where it tells nothing.
    pub extra: Vec<f32>,
    /// The work that was done.
    pub counters: Counters,
}

/// Bytes that are not the pixels of the rectangle that they are said to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found} bytes of pixels where the rectangle has {expected}")]
pub struct WrongLength {
    /// Bytes that the rectangle's pixels take.
    pub expected: u64,
    /// Bytes that were there.
    pub found: u64,
}

impl RenderedPart {
    /// The pixels as little-endian f32: red, green, blue, row by row; then all that is told beside them.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.pixels.as_flattened().iter().chain(&self.extra).flat_map(|number| number.to_le_bytes()).collect()
    }

    /// The part whose pixels, of a frame that tells so much beside colours, were coded by [`Self::to_bytes`].
    ///
    /// # Errors
    /// If there are more or fewer bytes than `rect` has pixels for.
    pub fn from_bytes(rect: Rect, aovs: Aovs, counters: Counters, bytes: &[u8]) -> Result<Self, WrongLength> {
        let expected = rect.area().saturating_mul(aovs.bytes_per_pixel());
        if bytes.len() as u64 != expected {
            return Err(WrongLength { expected, found: bytes.len() as u64 });
        }
        // All bytes are there, so there is memory for so many pixels.
        let (pixels, extra) = bytes.split_at(rect.area() as usize * 12);
        let (pixels, _) = pixels.as_chunks::<4>().0.as_chunks::<3>();
        let extra = extra.as_chunks::<4>().0.iter().map(|number| f32::from_le_bytes(*number)).collect();
        Ok(Self { rect, pixels: pixels.iter().map(|pixel| pixel.map(f32::from_le_bytes)).collect(), extra, counters })
    }

    /// BLAKE3 over the rectangle (x, y, width, height as little-endian u32) and the bytes of [`Self::to_bytes`].
    pub fn hash(&self) -> [u8; 32] {
        hash_of_bytes(self.rect, &self.to_bytes())
    }
}

/// [`RenderedPart::hash`] of the part whose pixels are coded as these bytes.
pub fn hash_of_bytes(rect: Rect, bytes: &[u8]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    let Rect { x, y, width, height } = rect;
    for number in [x, y, width, height] {
        hasher.update(&number.to_le_bytes());
    }
    *hasher.update(bytes).finalize().as_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Aov;

    fn part() -> RenderedPart {
        let rect = Rect { x: 5, y: 7, width: 2, height: 3 };
        let pixels = (0..6_u8).map(|i| [f32::from(i), 0.1, 1e-30]).collect();
        RenderedPart { rect, pixels, extra: Vec::new(), counters: Counters::default() }
    }

    #[test]
    fn bytes_come_back_as_they_were() {
        let part = part();
        let bytes = part.to_bytes();
        assert_eq!(&bytes[12..16], &1.0_f32.to_le_bytes());
        assert_eq!(RenderedPart::from_bytes(part.rect, Aovs::NONE, part.counters, &bytes).unwrap(), part);
        let short = RenderedPart::from_bytes(part.rect, Aovs::NONE, part.counters, &bytes[1..]).unwrap_err();
        assert_eq!(short, WrongLength { expected: 72, found: 71 });
    }

    #[test]
    fn what_is_told_beside_colours_stands_behind_them() {
        let aovs: Aovs = [Aov::Depth, Aov::Object].into_iter().collect();
        let part = RenderedPart { extra: (0..12_u8).map(f32::from).collect(), ..part() };
        let bytes = part.to_bytes();
        assert_eq!(bytes.len() as u64, part.rect.area() * aovs.bytes_per_pixel());
        assert_eq!(RenderedPart::from_bytes(part.rect, aovs, part.counters, &bytes).unwrap(), part);
        assert!(RenderedPart::from_bytes(part.rect, Aovs::NONE, part.counters, &bytes).is_err());
        let mut changed = part.clone();
        changed.extra[11] = -0.0;
        assert_ne!(changed.hash(), part.hash());
    }

    #[test]
    fn the_hash_covers_place_and_pixels_but_not_the_work() {
        let part = part();
        let moved = RenderedPart { rect: Rect { x: 6, ..part.rect }, ..part.clone() };
        let mut changed = part.clone();
        changed.pixels[3][2] = 1.1e-30;
        let busier = RenderedPart { counters: Counters { camera_rays: 9, ..Counters::default() }, ..part.clone() };
        assert_ne!(part.hash(), moved.hash());
        assert_ne!(part.hash(), changed.hash());
        assert_eq!(part.hash(), busier.hash());
    }
}
