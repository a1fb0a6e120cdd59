//! The preview: 8-bit sRGB.
//!
//! Tone mapping: radiance is multiplied by `2^exposure` and clipped to [0, 1]; there is no curve, so that the preview shows the EXR's own colours.

use std::{
    io::{self, Write},
    path::Path,
};

use png::{BitDepth, ColorType, Compression, Encoder, Filter, chunk};

use super::{OutputError, Rows, write_atomically};

/// Writes a picture as PNG, row by row; `exposure` is in stops. Rectangles `[x, y, width, height]` that are not rendered become magenta.
///
/// # Errors
/// If the file cannot be written, or rows cannot be read; an older file then stays as it was.
pub fn write(path: &Path, picture: impl Rows, holes: &[[u32; 4]], exposure: f64) -> Result<(), OutputError> {
    write_atomically(path, |file| encode(file, picture, holes, exposure))
}

/// Bytes of compressed pixels that stand in one chunk of the file.
const CHUNK_BYTES: usize = 1 << 20;

/// Perceptual intent (PNG specification, 11.3.2.5).
const PERCEPTUAL: u8 = 0;

/// No surface is as loud as this.
const HOLE: [u8; 3] = [255, 0, 255];

fn encode(file: &mut impl Write, mut picture: impl Rows, holes: &[[u32; 4]], exposure: f64) -> io::Result<()> {
    let (width, height) = picture.size();
    let (scale, quantizer) = (libm::exp2(exposure), Quantizer::new());
    let mut encoder = Encoder::new(file, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fast);
    encoder.set_filter(Filter::Adaptive);
    let mut writer = encoder.write_header()?;
    writer.write_chunk(chunk::sRGB, &[PERCEPTUAL])?;
    let mut stream = writer.stream_writer_with_size(CHUNK_BYTES)?;
    let (mut row, mut bytes) = (vec![[0.0; 3]; width as usize], Vec::new());
    for y in 0..height {
        picture.read(y, &mut row, &mut [])?;
        bytes.clear();
        bytes.extend(row.iter().flatten().map(|&component| quantizer.byte(f64::from(component) * scale)));
        holes.iter().for_each(|hole| mark(&mut bytes, y, *hole));
        stream.write_all(&bytes)?;
    }
    stream.finish()?;
    Ok(writer.finish()?)
}

/// Marks what row `y` has of a hole.
fn mark(bytes: &mut [u8], y: u32, [x, top, columns, rows]: [u32; 4]) {
    if (top..top.saturating_add(rows)).contains(&y) {
        bytes.chunks_exact_mut(3).skip(x as usize).take(columns as usize).for_each(|pixel| pixel.copy_from_slice(&HOLE));
    }
}

/// Rounds linear values to the nearest of the 256 sRGB codes.
struct Quantizer {
    /// The linear value half a code above each code.
    bounds: [f64; 255],
}

impl Quantizer {
    fn new() -> Self {
        Self { bounds: std::array::from_fn(|code| srgb_to_linear((code as f64 + 0.5) / 255.0)) }
    }

    fn byte(&self, linear: f64) -> u8 {
        self.bounds.partition_point(|&bound| bound <= linear) as u8
    }
}

/// The electro-optical transfer function of IEC 61966-2-1.
fn srgb_to_linear(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { libm::pow((code + 0.055) / 1.055, 2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Film;

    fn film(pixels: &[[f32; 3]]) -> Film {
        Film::from_pixels(pixels.len() as u32, 1, pixels.to_vec()).unwrap()
    }

    fn encode(film: &Film, holes: &[[u32; 4]], exposure: f64) -> io::Result<Vec<u8>> {
        let mut coded = Vec::new();
        super::encode(&mut coded, film, holes, exposure)?;
        Ok(coded)
    }

    #[test]
    fn colours_come_out_as_srgb_codes() {
        // 0.5 -> 188 and 0.2140 -> 127.5 are textbook values of the curve; beyond 1 is clipped.
        let coded = encode(&film(&[[0.0, 1.0, 7.0], [0.5, 0.25, 0.0031308]]), &[], 0.0).unwrap();
        let image = image::load_from_memory(&coded).unwrap().into_rgb8();
        assert_eq!(image.as_raw(), &[0, 255, 255, 188, 137, 10]);
        let darker = encode(&film(&[[0.0, 1.0, 7.0], [1.0, 0.5, 0.0062616]]), &[], -1.0).unwrap();
        assert_eq!(image::load_from_memory(&darker).unwrap().into_rgb8().as_raw(), &[0, 188, 255, 188, 137, 10]);
    }

    #[test]
    fn holes_are_marked() {
        let coded = encode(&film(&[[0.0; 3]; 2]), &[[1, 0, 1, 1]], 0.0).unwrap();
        assert_eq!(image::load_from_memory(&coded).unwrap().into_rgb8().as_raw(), &[0, 0, 0, 255, 0, 255]);
    }

    #[test]
    fn every_code_survives() {
        let quantizer = Quantizer::new();
        for code in 0..=255_u8 {
            assert_eq!(quantizer.byte(srgb_to_linear(f64::from(code) / 255.0)), code);
        }
    }

    #[test]
    fn the_file_says_that_it_is_srgb() {
        let coded = encode(&film(&[[0.5; 3]]), &[], 0.0).unwrap();
        assert_eq!(&coded[12..16], b"IHDR");
        assert_eq!(&coded[33..42], b"\0\0\0\x01sRGB\0");
        assert_eq!(&coded[42..46], crc32(&coded[37..42]).to_be_bytes());
        assert_eq!(&coded[50..54], b"IDAT");
    }

    /// The PNG specification's own checksum, bit by bit (annex D).
    fn crc32(bytes: &[u8]) -> u32 {
        let step = |crc: u32, _| if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
        !bytes.iter().fold(u32::MAX, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
    }
}
