//! Decoded images, kept as compact as their files store them: 8-bit images stay 8-bit and are made linear by a table.

use std::{
    io::Cursor,
    panic::{AssertUnwindSafe, catch_unwind},
};

use image::{ColorType, ImageDecoder, codecs::hdr::HdrDecoder, codecs::png::PngDecoder};
use zune_core::{bytestream::ZCursor, colorspace::ColorSpace as JpegColorSpace, options::DecoderOptions};
use zune_jpeg::JpegDecoder;

use super::srgb::{LINEAR_8, LINEAR_16, SRGB_8, SRGB_16};
use crate::description::{AssetError, ColorSpace};

/// Longest edge of an image, in pixels.
const MAX_EDGE: u32 = 32_768;

/// Most bytes that an image may decode to.
const MAX_BYTES: u64 = 2 << 30;

/// What one byte of a file can decode to at the most: deflate's best ratio (1032) for a palette of one-bit pixels that become one byte each.
const MAX_RATIO: u64 = 8 * 1032;

/// Pixels, row by row from the first row of the file.
#[derive(Debug)]
pub struct Image {
    width: u32,
    height: u32,
    /// 1: grey; 2: grey and opacity; 3: colour; 4: colour and opacity.
    channels: usize,
    samples: Samples,
}

#[derive(Debug)]
enum Samples {
    Byte { samples: Vec<u8>, table: &'static [f32] },
    Short { samples: Vec<u16>, table: &'static [f32] },
    Float { samples: Vec<f32> },
}

impl Image {
    /// Decodes a PNG, JPEG or Radiance HDR file, recognised by its first bytes. The numbers of an HDR file are linear, whatever
    /// `color_space` says.
    ///
    /// # Errors
    /// Names the kind of file and what is wrong with it.
    pub fn decode(bytes: &[u8], color_space: ColorSpace) -> Result<Self, AssetError> {
        let kind = Kind::of(bytes)?;
        // The libraries have been seen to panic at damaged files, which must cost nobody more than an error.
        catch_unwind(AssertUnwindSafe(|| Self::decode_as(kind, bytes, color_space)))
            .unwrap_or_else(|_| Err(broken("this", &"it makes its decoder fail")))
    }

    fn decode_as(kind: Kind, bytes: &[u8], color_space: ColorSpace) -> Result<Self, AssetError> {
        match kind {
            Kind::Png => {
                let decoder = PngDecoder::with_limits(Cursor::new(bytes), limits()).map_err(|e| broken("PNG", &e))?;
                decode_with("PNG", decoder, bytes.len(), color_space)
            }
            Kind::Hdr => {
                // The decoder knows the second name of the format only where it is told not to look.
                let strict = !bytes.starts_with(b"#?RGBE");
                let decoder = HdrDecoder::with_strictness(Cursor::new(bytes), strict).map_err(|e| broken("Radiance HDR", &e))?;
                decode_with("Radiance HDR", decoder, bytes.len(), color_space)
            }
            Kind::Jpeg => decode_jpeg(bytes, color_space),
        }
    }

    /// Linear numbers, as many as there are pixels times channels.
    pub(super) fn linear([width, height]: [u32; 2], channels: usize, samples: Vec<f32>) -> Self {
        debug_assert_eq!(samples.len(), width as usize * height as usize * channels);
        Self { width, height, channels, samples: Samples::Float { samples } }
    }

    /// Which of a pixel's numbers the file stores.
    pub(super) fn channels(&self) -> &'static [usize] {
        [&[0][..], &[0, 3], &[0, 1, 2], &[0, 1, 2, 3]][self.channels.clamp(1, 4) - 1]
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Whether the file stores opacity.
    pub fn has_opacity(&self) -> bool {
        self.channels == 2 || self.channels == 4
    }

    /// Bytes of memory that the pixels take.
    pub fn memory(&self) -> usize {
        match &self.samples {
            Samples::Byte { samples, .. } => samples.len(),
            Samples::Short { samples, .. } => 2 * samples.len(),
            Samples::Float { samples } => 4 * samples.len(),
        }
    }

    /// The pixel in column `x` and row `y`: linear Rec. 709 and opacity.
    pub(crate) fn pixel(&self, x: u32, y: u32) -> [f32; 4] {
        let start = (y as usize * self.width as usize + x as usize) * self.channels;
        let range = start..start + self.channels;
        match &self.samples {
            Samples::Byte { samples, table } => spread(&samples[range], |code| table[usize::from(code)], |code| f32::from(code) / 255.0),
            Samples::Short { samples, table } => spread(&samples[range], |code| table[usize::from(code)], |code| f32::from(code) / 65535.0),
            Samples::Float { samples } => spread(&samples[range], |value| value, |value| value),
        }
    }

    /// Builds an image of samples of which there are as many as its size says.
    fn new(kind: &str, [width, height]: [u32; 2], channels: usize, samples: Samples) -> Result<Self, AssetError> {
        let count = match &samples {
            Samples::Byte { samples, .. } => samples.len(),
            Samples::Short { samples, .. } => samples.len(),
            Samples::Float { samples } => samples.len(),
        };
        if width == 0 || height == 0 || count != width as usize * height as usize * channels {
            return Err(AssetError::new(format!("{kind} image: {width} x {height} pixels, but {count} numbers")));
        }
        Ok(Self { width, height, channels, samples })
    }
}

/// Grey or colour, with or without opacity, as colour and opacity.
fn spread<T: Copy>(samples: &[T], color: impl Fn(T) -> f32, opacity: impl Fn(T) -> f32) -> [f32; 4] {
    match *samples {
        [grey] => [color(grey), color(grey), color(grey), 1.0],
        [grey, a] => [color(grey), color(grey), color(grey), opacity(a)],
        [r, g, b] => [color(r), color(g), color(b), 1.0],
        [r, g, b, a] => [color(r), color(g), color(b), opacity(a)],
        _ => [0.0, 0.0, 0.0, 1.0],
    }
}

/// Kinds of image files.
enum Kind {
    Png,
    Jpeg,
    Hdr,
}

impl Kind {
    fn of(bytes: &[u8]) -> Result<Self, AssetError> {
        let starts = |magic: &[u8]| bytes.starts_with(magic);
        let other = match () {
            () if starts(b"\x89PNG\r\n\x1a\n") => return Ok(Self::Png),
            () if starts(b"\xff\xd8\xff") => return Ok(Self::Jpeg),
            () if starts(b"#?RADIANCE") || starts(b"#?RGBE") => return Ok(Self::Hdr),
            () if bytes.is_empty() => "the image file is empty",
            () if starts(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") => "WebP images are not read",
            () if starts(b"\xabKTX") => "KTX images are not read",
            () if starts(b"DDS ") => "DDS images are not read",
            () if starts(b"\x76\x2f\x31\x01") => "OpenEXR images are not read as textures",
            () if starts(b"GIF8") => "GIF images are not read",
            () if starts(b"II*\0") || starts(b"MM\0*") => "TIFF images are not read",
            () if starts(b"BM") => "BMP images are not read",
            () => "this is not an image file that is known",
        };
        Err(AssetError::new(other).with_help("convert it to PNG, JPEG or Radiance HDR"))
    }
}

fn limits() -> image::Limits {
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_EDGE);
    limits.max_image_height = Some(MAX_EDGE);
    limits.max_alloc = Some(MAX_BYTES);
    limits
}

/// Refuses an image before memory is taken for it, if it is too large or its file cannot hold it.
fn check_size(kind: &str, size: [u32; 2], bytes: u64, file: usize) -> Result<(), AssetError> {
    let [width, height] = size;
    if width > MAX_EDGE || height > MAX_EDGE || bytes > MAX_BYTES {
        return Err(AssetError::new(format!("{kind} image: {width} x {height} pixels are too many"))
            .with_help(format!("at most {MAX_EDGE} pixels an edge and {} MiB in memory", MAX_BYTES >> 20)));
    }
    if bytes > MAX_RATIO * file as u64 {
        return Err(AssetError::new(format!("{kind} image: {width} x {height} pixels cannot be in a file of {file} bytes")));
    }
    Ok(())
}

fn broken(kind: &str, error: &dyn std::fmt::Display) -> AssetError {
    let reason = error.to_string();
    AssetError::new(format!("{kind} image: {}", reason.trim().trim_matches('"')))
        .with_help("the file is damaged or was cut off; export it again")
}

fn decode_with(kind: &str, mut decoder: impl ImageDecoder, file: usize, color_space: ColorSpace) -> Result<Image, AssetError> {
    let (width, height) = decoder.dimensions();
    check_size(kind, [width, height], decoder.total_bytes(), file)?;
    decoder.set_limits(limits()).map_err(|e| broken(kind, &e))?;
    let color_type = decoder.color_type();
    let mut bytes = vec![0; decoder.total_bytes() as usize];
    decoder.read_image(&mut bytes).map_err(|e| broken(kind, &e))?;
    let samples = match color_type {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => byte_samples(bytes, color_space),
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => Samples::Short {
            samples: bytes.as_chunks().0.iter().map(|&pair| u16::from_ne_bytes(pair)).collect(),
            table: match color_space {
                ColorSpace::Srgb => &SRGB_16,
                ColorSpace::Linear => &LINEAR_16,
            },
        },
        ColorType::Rgb32F | ColorType::Rgba32F => {
            Samples::Float { samples: bytes.as_chunks().0.iter().map(|&word| f32::from_ne_bytes(word)).collect() }
        }
        other => return Err(AssetError::new(format!("{kind} image: pixels of type {other:?} are not read"))),
    };
    Image::new(kind, [width, height], usize::from(color_type.channel_count()), samples)
}

fn byte_samples(samples: Vec<u8>, color_space: ColorSpace) -> Samples {
    let table: &'static [f32] = match color_space {
        ColorSpace::Srgb => &SRGB_8,
        ColorSpace::Linear => &LINEAR_8,
    };
    Samples::Byte { samples, table }
}

/// Strict, because a file that was cut off would otherwise become a picture that is partly grey.
fn decode_jpeg(bytes: &[u8], color_space: ColorSpace) -> Result<Image, AssetError> {
    let kind = "JPEG";
    let options = DecoderOptions::default().set_strict_mode(true).set_max_width(MAX_EDGE as usize).set_max_height(MAX_EDGE as usize);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|e| broken(kind, &e))?;
    let (Some(info), Some(input)) = (decoder.info(), decoder.input_colorspace()) else {
        return Err(AssetError::new("JPEG image: no header"));
    };
    let (channels, output) = match input {
        JpegColorSpace::Luma => (1, JpegColorSpace::Luma),
        _ => (3, JpegColorSpace::RGB),
    };
    decoder.set_options(options.jpeg_set_out_colorspace(output));
    let size = [u32::from(info.width), u32::from(info.height)];
    let count = size[0] as usize * size[1] as usize * channels;
    check_size(kind, size, count as u64, bytes.len())?;
    let mut samples = vec![0; count];
    decoder.decode_into(&mut samples).map_err(|e| broken(kind, &e))?;
    Image::new(kind, size, channels, byte_samples(samples, color_space))
}
