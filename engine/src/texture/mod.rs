//! Textures, compiled: a colour for every uv.

mod coordinates;
mod footprint;
mod image;
mod noise;
mod pyramid;
mod srgb;
mod wrap;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::DVec2;

pub use self::{
    coordinates::{Coordinates, texture_transform},
    footprint::{Footprint, Uvs},
    image::Image,
    pyramid::Pyramid,
    srgb::srgb_to_linear,
};

use crate::description::{self, AssetError, AssetSource, Rgb, TextureFilter, Wrap};

/// A texture that is ready to be looked up. Clones share the image.
#[derive(Clone, Debug)]
pub enum Texture {
    /// Squares of two colours.
    Checker {
        /// Colour where `floor(u / size) + floor(v / size)` is even.
        even: Rgb,
        /// Colour elsewhere.
        odd: Rgb,
        /// Edge of a square.
        size: f64,
    },
    /// A colour that changes along a line.
    Gradient {
        /// Colour at the start.
        from: Rgb,
        /// Colour at the end.
        to: Rgb,
        /// Where it starts.
        start: DVec2,
        /// What a place from there is multiplied by to tell how far along the line it is.
        along: DVec2,
    },
    /// Clouds.
    Noise {
        /// Colour where the noise is lowest.
        low: Rgb,
        /// Colour where it is highest.
        high: Rgb,
        /// Distance of the largest octave's knots.
        size: f64,
        /// Octaves.
        octaves: u32,
        /// Chooses the pattern.
        seed: u64,
    },
    /// An image, interpolated in linear light.
    Image {
        /// Its pixels.
        image: Arc<Image>,
        /// Its smaller copies, if it is interpolated between these too.
        pyramid: Option<Arc<Pyramid>>,
        /// What lies beyond u in [0, 1] and v in [0, 1].
        wrap: [Wrap; 2],
        /// Which coordinates of a surface it takes.
        coordinates: Coordinates,
    },
}

/// The largest scale and offset of an image.
const FARTHEST: f64 = 1e9;

impl Texture {
    /// Decodes the texture's image, where it has one.
    ///
    /// # Errors
    /// The image is missing or cannot be decoded: names the kind of file and the reason.
    pub fn compile(texture: &description::Texture, assets: &dyn AssetSource) -> Result<Self, AssetError> {
        match texture {
            description::Texture::Checker { even, odd, size } => Ok(Self::Checker { even: *even, odd: *odd, size: *size }),
            description::Texture::Gradient { from, to, start, end } => {
                let (start, way) = (DVec2::from(*start), DVec2::from(*end) - DVec2::from(*start));
                let along = way / way.length_squared();
                if !(start.is_finite() && along.is_finite()) {
                    return Err(AssetError::new("the gradient's start and end must be finite, and not the same"));
                }
                Ok(Self::Gradient { from: *from, to: *to, start, along })
            }
            description::Texture::Noise { low, high, size, octaves, seed } => {
                if !(*size > 0.0 && size.is_finite() && (1..=16).contains(octaves)) {
                    return Err(AssetError::new("the noise's size must be above 0, and its octaves 1 to 16"));
                }
                Ok(Self::Noise { low: *low, high: *high, size: *size, octaves: *octaves, seed: *seed })
            }
            description::Texture::Image { file, color_space, wrap, filter, scale, offset, .. } => {
                // Products with coordinates stay finite, and so near to whole numbers that something is left between them.
                if !scale.iter().chain(offset).all(|number| number.abs() <= FARTHEST) {
                    return Err(AssetError::new(format!("the image's scale and offset must lie within -{FARTHEST:e} and {FARTHEST:e}")));
                }
                let is_moved = (*scale, *offset) != ([1.0; 2], [0.0; 2]);
                let transform = is_moved.then(|| texture_transform((*scale).into(), 0.0, (*offset).into()));
                let bytes = assets.bytes(*file).ok_or_else(|| AssetError::new(format!("the image's bytes ({file}) are not here")))?;
                let image = Arc::new(Image::decode(&bytes, *color_space)?);
                let pyramid = (*filter == TextureFilter::Trilinear).then(|| Arc::new(Pyramid::new(&image)));
                Ok(Self::Image { image, pyramid, wrap: *wrap, coordinates: Coordinates { transform, ..Coordinates::default() } })
            }
        }
    }

    /// The colour at a point of a surface whose texture coordinates are these (finite), or the mean of the footprint there: see [`Self::rgba`].
    #[inline]
    pub fn at(&self, uvs: Uvs) -> [f32; 4] {
        match self {
            Self::Image { image, pyramid: Some(pyramid), wrap, coordinates } => {
                pyramid.look(image, *wrap, coordinates.of(uvs.sets), &coordinates.footprint(uvs.footprints))
            }
            Self::Image { coordinates, .. } => self.rgba(coordinates.of(uvs.sets)),
            _ => self.rgba(uvs.sets[0]),
        }
    }

    /// Whether it looks at more than a point.
    pub fn is_filtered(&self) -> bool {
        matches!(self, Self::Image { pyramid: Some(_), .. })
    }

    /// Which coordinates of a surface it takes.
    pub fn coordinates(&self) -> Coordinates {
        match self {
            Self::Image { coordinates, .. } => *coordinates,
            _ => Coordinates::default(),
        }
    }

    /// The colour at a point of its own coordinates `uv` (finite): linear Rec. 709, and opacity in [0, 1].
    #[inline]
    pub fn rgba(&self, uv: DVec2) -> [f32; 4] {
        match self {
            Self::Checker { even, odd, size } => {
                let square = (uv.x / size).floor() + (uv.y / size).floor();
                // Even if half of it is whole: the remainder itself would be a call.
                let [r, g, b] = if (square * 0.5).floor() == square * 0.5 { *even } else { *odd };
                [r, g, b, 1.0]
            }
            Self::Gradient { from, to, start, along } => between(*from, *to, (uv - *start).dot(*along).clamp(0.0, 1.0)),
            Self::Noise { low, high, size, octaves, seed } => between(*low, *high, noise::fractal(uv / *size, *octaves, *seed)),
            Self::Image { image, wrap, .. } => bilinear(image, *wrap, uv),
        }
    }

    /// Whether some place of it may not be opaque.
    pub fn has_opacity(&self) -> bool {
        match self {
            Self::Image { image, .. } => image.has_opacity(),
            _ => false,
        }
    }
}

/// A colour between two others, opaque.
fn between(low: Rgb, high: Rgb, share: f64) -> [f32; 4] {
    let [r, g, b] = std::array::from_fn(|i| (1.0 - share as f32) * low[i] + share as f32 * high[i]);
    [r, g, b, 1.0]
}

fn bilinear(image: &Image, wrap: [Wrap; 2], uv: DVec2) -> [f32; 4] {
    let [width, height] = image.size();
    let ([left, right], s) = wrap::neighbours(uv.x, width, wrap[0]);
    let ([top, bottom], t) = wrap::neighbours(uv.y, height, wrap[1]);
    let upper = mix(image.pixel(left, top), image.pixel(right, top), s);
    let lower = mix(image.pixel(left, bottom), image.pixel(right, bottom), s);
    mix(upper, lower, t)
}

fn mix(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    std::array::from_fn(|i| (1.0 - t) * a[i] + t * b[i])
}
