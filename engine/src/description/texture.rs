//! Textures: colours that vary over a surface.

use serde::{Deserialize, Serialize};

use super::{AssetId, Rgb, SourceId};

/// Index into [`super::Scene::textures`].
pub type TextureId = u32;

/// A colour for every uv.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Texture {
    /// Squares of two colours: `even` where `floor(u / size) + floor(v / size)` is even.
    Checker {
        /// Colour of the even squares.
        even: Rgb,
        /// Colour of the odd squares.
        odd: Rgb,
        /// Edge of a square in units of uv, above 0.
        size: f64,
    },
    /// A colour that changes evenly along a line, and stays the same across it and beyond its ends.
    Gradient {
        /// Colour at the start.
        from: Rgb,
        /// Colour at the end.
        to: Rgb,
        /// Where it starts, in uv.
        start: [f64; 2],
        /// Where it ends, elsewhere than `start`.
        end: [f64; 2],
    },
    /// Clouds of two colours: Perlin's gradient noise, several octaves of it, each of half the size and half the strength of the one before.
    Noise {
        /// Colour where the noise is lowest.
        low: Rgb,
        /// Colour where it is highest.
        high: Rgb,
        /// Distance of the largest octave's knots in units of uv, above 0.
        size: f64,
        /// 1 to 16.
        octaves: u32,
        /// Chooses the pattern.
        seed: u64,
    },
    /// An image file (PNG, JPEG or Radiance HDR); its first row lies at v = 0 (glTF's convention).
    Image {
        /// The file.
        file: AssetId,
        /// How its numbers are coded.
        color_space: ColorSpace,
        /// What lies beyond u in [0, 1] and v in [0, 1].
        wrap: [Wrap; 2],
        /// What is between its pixels, and where they are smaller than the film's.
        filter: TextureFilter,
        /// What u and v are multiplied by before.
        scale: [f64; 2],
        /// What is added to them then.
        offset: [f64; 2],
        /// Where the script made it.
        #[serde(skip)]
        source: SourceId,
    },
}

/// How an image's numbers become linear colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ColorSpace {
    /// IEC 61966-2-1.
    Srgb,
    /// The numbers are linear.
    Linear,
}

/// How an image is interpolated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum TextureFilter {
    /// Between four pixels, however many lie within one of the film's: samples find their mean.
    #[default]
    Bilinear,
    /// Also between two smaller copies of the image, whose pixels are as large as the film's.
    Trilinear,
}

/// What lies beyond the edge of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// The image mirrored.
    Mirror,
    /// Its outermost pixels.
    Clamp,
}
