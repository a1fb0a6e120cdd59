//! The picture: scene-linear OpenEXR.

use std::{
    fs::File,
    io::{self, BufReader, Read, Seek},
    path::Path,
};

use ::exr::{
    block::{
        self,
        chunk::{Chunk, CompressedBlock, CompressedScanLineBlock},
        writer::ChunksWriter,
    },
    error::Error,
    image::{
        AnyChannels, FlatSamples, Image, Layer,
        read::{image::ReadLayers, layers::ReadChannels, read as reader},
    },
    math::Vec2,
    meta::{
        BlockDescription, MetaData,
        attribute::{AttributeValue, ChannelDescription, Chromaticities, LineOrder, SampleType, Text},
        header::{Header, LayerAttributes},
    },
    prelude::Compression,
};
use half::{f16, slice::HalfFloatSliceExt};
use serde::{Deserialize, Serialize};

use super::{OutputError, Rows, write_atomically, zip::Compressor};
use crate::{
    REVISION,
    description::{Aov, Aovs, FrameHash},
    film::{self, Film},
};

/// How the file holds its colours; what a frame tells beside them is always held as floats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelType {
    /// 32-bit floats: the film's own.
    Float,
    /// 16-bit floats, rounded to nearest.
    Half,
}

/// What a file says of itself, as JSON in its one text attribute `tessera`: what is pictured, not who rendered it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// The frame's hash in hexadecimal.
    pub image_hash: String,
    /// The frame's seed.
    pub seed: u64,
    /// The engine's revision.
    pub engine_revision: u32,
    /// Rectangles that are not rendered, `[x, y, width, height]`: the picture is black there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub holes: Vec<[u32; 4]>,
}

impl Identity {
    /// The identity of a frame that this engine rendered.
    pub fn new(hash: FrameHash, seed: u64) -> Self {
        Self { image_hash: hash.to_string(), seed, engine_revision: REVISION, holes: Vec::new() }
    }
}

const ATTRIBUTE: &str = "tessera";

/// The largest finite half float.
const HALF_MAX: f32 = 65_504.0;

/// What was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Written {
    /// BLAKE3 of the pixels as they stand in the file, in the order of [`Film::hash`].
    pub hash: [u8; 32],
    /// Numbers of colours that were too large for a half float and were clamped.
    pub clamped: u64,
    /// Whether all colours are 0.
    pub is_black: bool,
}

/// Writes a picture, of which it holds a few rows at a time; equal pictures and identities give equal bytes.
///
/// # Errors
/// If the file cannot be written, or rows cannot be read; an older file then stays as it was.
pub fn write(path: &Path, mut picture: impl Rows, pixel_type: PixelType, identity: &Identity) -> Result<Written, OutputError> {
    let channels = channels(picture.aovs());
    let header = header(picture.size(), &channels, pixel_type, identity);
    let mut chunks = Chunks::new(channels, pixel_type);
    write_atomically(path, |file| {
        let write = |_, writer: &mut _| chunks.write(writer, &mut picture);
        block::write(file, [header?].into_iter().collect(), true, write).map_err(io_error)
    })?;
    Ok(Written { hash: *chunks.hasher.finalize().as_bytes(), clamped: chunks.clamped, is_black: chunks.is_black })
}

/// Rows of one chunk of the compression ZIP16.
const ROWS: usize = 16;

/// Where a pixel of the film holds a channel.
#[derive(Clone, Copy)]
enum Place {
    /// Among the components of its colour.
    Color(usize),
    /// Among the numbers beside it.
    Beside(usize),
}

/// Channels in the order of the file, which is that of their names.
fn channels(aovs: Aovs) -> Vec<(&'static str, Place)> {
    let colors = ["R", "G", "B"].into_iter().enumerate().map(|(component, name)| (name, Place::Color(component)));
    let mut channels: Vec<_> = colors.chain(aovs.channels().enumerate().map(|(number, name)| (name, Place::Beside(number)))).collect();
    channels.sort_by_key(|(name, _)| *name);
    channels
}

fn header((width, height): (u32, u32), channels: &[(&str, Place)], pixel_type: PixelType, identity: &Identity) -> io::Result<Header> {
    let sample_type = match pixel_type {
        PixelType::Float => SampleType::F32,
        PixelType::Half => SampleType::F16,
    };
    let described = channels.iter().map(|(name, place)| match place {
        Place::Color(_) => ChannelDescription::named(*name, sample_type),
        Place::Beside(_) => ChannelDescription::named(*name, SampleType::F32),
    });
    let channels = described.collect();
    let mut header = Header::new(text(ATTRIBUTE)?, (width as usize, height as usize), channels)
        .with_encoding(Compression::ZIP16, BlockDescription::ScanLines, LineOrder::Increasing)
        .with_attributes(LayerAttributes::default());
    header.shared_attributes.pixel_aspect = 1.0;
    header.shared_attributes.chromaticities = Some(rec_709());
    // One attribute and no more: the crate keeps them in a hash map, whose order would differ between runs.
    let json = serde_json::to_string(identity)?;
    header.shared_attributes.other.insert(text(ATTRIBUTE)?, AttributeValue::Text(text(&json)?));
    Ok(header)
}

/// Makes chunks out of rows. The crate would compress them by itself, but four times slower than [`Compressor`] for files that are not much smaller.
struct Chunks {
    channels: Vec<(&'static str, Place)>,
    pixel_type: PixelType,
    compressor: Compressor,
    hasher: blake3::Hasher,
    clamped: u64,
    is_black: bool,
    /// Of one channel of one row.
    numbers: Vec<f32>,
    halves: Vec<f16>,
    /// Of one chunk.
    bytes: Vec<u8>,
}

impl Chunks {
    fn new(channels: Vec<(&'static str, Place)>, pixel_type: PixelType) -> Self {
        let (numbers, halves, bytes) = (Vec::new(), Vec::new(), Vec::new());
        let (compressor, hasher) = (Compressor::new(), blake3::Hasher::new());
        Self { channels, pixel_type, compressor, hasher, clamped: 0, is_black: true, numbers, halves, bytes }
    }

    fn write(&mut self, writer: &mut impl ChunksWriter, picture: &mut impl Rows) -> Result<(), Error> {
        let (width, height) = picture.size();
        let numbers = picture.aovs().numbers();
        let mut band = vec![[0.0; 3]; width as usize * ROWS.min(height as usize)];
        let mut extra = vec![0.0; band.len() * numbers];
        for (index, y) in (0..height).step_by(ROWS).enumerate() {
            let band = &mut band[..width as usize * ROWS.min((height - y) as usize)];
            let extra = &mut extra[..band.len() * numbers];
            picture.read(y, band, extra)?;
            self.bytes.clear();
            let width = width as usize;
            for (row, pixels) in band.chunks_mut(width).enumerate() {
                self.add(pixels, &extra[row * width * numbers..][..width * numbers]);
            }
            let compressed_pixels_le = self.compressor.compress(&self.bytes);
            let block = CompressedScanLineBlock { y_coordinate: y as i32, compressed_pixels_le };
            writer.write_chunk(index, Chunk { layer_index: 0, compressed_block: CompressedBlock::ScanLine(block) })?;
        }
        Ok(())
    }

    /// Adds a row to the chunk, channel by channel, and to the hash as it then stands in the file.
    fn add(&mut self, row: &mut [[f32; 3]], extra: &[f32]) {
        for (_, place) in &self.channels {
            self.numbers.clear();
            match *place {
                Place::Color(component) => self.numbers.extend(row.iter().map(|pixel| pixel[component])),
                Place::Beside(number) => self.numbers.extend(extra.iter().skip(number).step_by(extra.len() / row.len())),
            }
            match (self.pixel_type, *place) {
                (PixelType::Half, Place::Color(component)) => {
                    self.clamped += round_to_halves(&mut self.numbers, &mut self.halves);
                    append(&mut self.bytes, &self.halves, f16::to_le_bytes);
                    row.iter_mut().zip(&self.halves).for_each(|(pixel, half)| pixel[component] = half.to_f32());
                }
                _ => append(&mut self.bytes, &self.numbers, f32::to_le_bytes),
            }
        }
        self.is_black &= row.iter().all(|pixel| *pixel == [0.0; 3]);
        film::hash_row(&mut self.hasher, row.as_flattened());
        film::hash_row(&mut self.hasher, extra);
    }
}

/// Appends the bytes of numbers.
fn append<T: Copy, const N: usize>(bytes: &mut Vec<u8>, numbers: &[T], to_bytes: impl Fn(T) -> [u8; N]) {
    let start = bytes.len();
    bytes.resize(start + N * numbers.len(), 0);
    let (places, _) = bytes[start..].as_chunks_mut::<N>();
    places.iter_mut().zip(numbers).for_each(|(place, &number)| *place = to_bytes(number));
}

/// The nearest halves, ties to even; numbers beyond the largest half become it, and are counted.
fn round_to_halves(numbers: &mut [f32], halves: &mut Vec<f16>) -> u64 {
    let clamped = numbers.iter().map(|&number| u64::from(number > HALF_MAX)).sum();
    numbers.iter_mut().for_each(|number| *number = number.min(HALF_MAX));
    halves.resize(numbers.len(), f16::ZERO);
    halves.convert_from_f32_slice(numbers);
    clamped
}

/// Primaries and white of Rec. 709 (ITU-R BT.709-6, 1.3 and 1.4).
fn rec_709() -> Chromaticities {
    Chromaticities { red: Vec2(0.64, 0.33), green: Vec2(0.30, 0.60), blue: Vec2(0.15, 0.06), white: Vec2(0.3127, 0.3290) }
}

fn text(string: &str) -> io::Result<Text> {
    Text::new_or_none(string).ok_or_else(|| io::Error::other("an attribute holds letters that EXR does not know"))
}

fn io_error(error: Error) -> io::Error {
    match error {
        Error::Io(error) => error,
        other => io::Error::new(io::ErrorKind::InvalidData, other.to_string()),
    }
}

/// A file that was read back.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Its pixels.
    pub film: Film,
    /// What it says of itself; `None` in files made elsewhere.
    pub identity: Option<Identity>,
}

/// Reads the channels R, G and B of a file's first layer, and those beside them whose names this program gives.
///
/// # Errors
/// If the file cannot be read or has no such channels.
pub fn read(path: &Path) -> Result<Picture, OutputError> {
    let read = || {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        read_picture(BufReader::new(file), length)
    };
    read().map_err(|reason| OutputError { path: path.to_owned(), doing: "read", reason })
}

/// As [`read`], of `length` bytes.
#[doc(hidden)]
pub fn read_picture(mut bytes: impl Read + Seek, length: u64) -> io::Result<Picture> {
    let headers = MetaData::read_from_buffered(&mut bytes, false).map_err(io_error)?;
    check_size(&headers, length)?;
    check_compression(&headers)?;
    bytes.rewind()?;
    let reader = reader().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let image = reader.all_attributes().from_buffered(bytes).map_err(io_error)?;
    let mut attributes = image.attributes.other.iter().chain(&image.layer_data.attributes.other);
    let identity = match attributes.find(|(name, _)| Text::eq(name, ATTRIBUTE)) {
        Some((_, AttributeValue::Text(json))) => Some(serde_json::from_str(&json.to_string())?),
        _ => None,
    };
    Ok(Picture { film: film_of(&image)?, identity })
}

/// What one byte of a file can become at the most: deflate's best ratio is 1032, and PXR24 leaves one byte of four out before it.
const MAX_RATIO: u128 = 2048;

/// Refuses a file that cannot hold the pixels that its headers promise: the crate takes memory for all of them before it looks at one.
fn check_size(file: &MetaData, length: u64) -> io::Result<()> {
    let bytes = |header: &Header| header.layer_size.0 as u128 * header.layer_size.1 as u128 * header.channels.bytes_per_pixel as u128;
    match file.headers.iter().find(|header| bytes(header) > MAX_RATIO * u128::from(length)) {
        Some(Header { layer_size: Vec2(width, height), .. }) => {
            let message = format!("{width} x {height} pixels cannot be in a file of {length} bytes");
            Err(io::Error::new(io::ErrorKind::InvalidData, message))
        }
        None => Ok(()),
    }
}

/// Refuses what the crate's decoder fails at, rather than to say what is wrong, where a file is damaged; nothing that needs to be exact is compressed so.
fn check_compression(file: &MetaData) -> io::Result<()> {
    let is_lossy = |header: &&Header| matches!(header.compression, Compression::B44 | Compression::B44A);
    match file.headers.iter().find(is_lossy) {
        Some(header) => {
            Err(io::Error::new(io::ErrorKind::InvalidData, format!("pictures compressed by {} are not read", header.compression)))
        }
        None => Ok(()),
    }
}

/// An image of one layer, as the crate reads it.
type FlatImage = Image<Layer<AnyChannels<FlatSamples>>>;

fn film_of(image: &FlatImage) -> io::Result<Film> {
    let channels = &image.layer_data.channel_data.list;
    let find = |name: &str| channels.iter().find(|channel| Text::eq(&channel.name, name) && channel.sampling == Vec2(1, 1));
    let channel = |name: &str| {
        let found = find(name).ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, format!("it has no channel {name}")))?;
        io::Result::Ok(found.sample_data.values_as_f32().collect::<Vec<f32>>())
    };
    let (red, green, blue) = (channel("R")?, channel("G")?, channel("B")?);
    let is_whole = |aov: &Aov| aov.channels().iter().all(|name| find(name).is_some());
    let aovs: Aovs = Aov::ALL.into_iter().filter(is_whole).collect();
    let mut extra = vec![0.0; red.len() * aovs.numbers()];
    for (number, name) in aovs.channels().enumerate() {
        let places = extra.iter_mut().skip(number).step_by(aovs.numbers());
        places.zip(channel(name)?).for_each(|(place, read)| *place = read);
    }
    let pixels = red.iter().zip(&green).zip(&blue).map(|((&r, &g), &b)| [r, g, b]).collect();
    let Vec2(width, height) = image.layer_data.size;
    let size = u32::try_from(width).ok().zip(u32::try_from(height).ok());
    let film = size.and_then(|(width, height)| Film::from_numbers(width, height, pixels, aovs, extra));
    film.ok_or_else(|| io::Error::from(io::ErrorKind::InvalidData))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn identity() -> Identity {
        Identity::new(FrameHash([0xab; 32]), u64::MAX)
    }

    fn film() -> Film {
        let pixels = (0..37 * 21).map(|i| [i as f32 * 1e-3, 1.0 / (i + 1) as f32, if i % 5 == 0 { 1e30 } else { 0.25 }]).collect();
        Film::from_pixels(37, 21, pixels).unwrap()
    }

    fn written(pixel_type: PixelType) -> (Written, Vec<u8>, Picture) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.exr");
        let written = write(&path, &film(), pixel_type, &identity()).unwrap();
        let picture = read(&path).unwrap();
        assert_eq!(written.hash, picture.film.hash(), "the hash is not that of what stands in the file");
        (written, fs::read(&path).unwrap(), picture)
    }

    #[test]
    fn floats_come_back_to_the_bit() {
        let (written, _, picture) = written(PixelType::Float);
        assert_eq!(written.clamped, 0);
        assert!(picture.film == film(), "the pixels differ");
        assert_eq!(picture.identity, Some(identity()));
    }

    /// Halves have 11 bits: the nearest lies within 2^-11 of the number.
    #[test]
    fn halves_are_rounded_and_clamped_and_the_clamped_are_counted() {
        let (written, _, picture) = written(PixelType::Half);
        assert_eq!(written.clamped, film().pixels().iter().filter(|pixel| pixel[2] > 1e29).count() as u64);
        for (half, full) in picture.film.pixels().iter().flatten().zip(film().pixels().iter().flatten()) {
            let full = full.min(65_504.0);
            assert!((half - full).abs() <= full * 2.0_f32.powi(-11) + 1e-7, "{half} is not {full}");
        }
        assert!(picture.film.pixels().iter().flatten().any(|&number| number == 65_504.0));
    }

    /// What the format's own specification ("OpenEXR File Layout") says of the header, looked up in the bytes.
    #[test]
    fn the_header_says_what_others_need() {
        let (_, bytes, _) = written(PixelType::Float);
        let value = |name: &str, kind: &str| {
            let key = [name.as_bytes(), b"\0", kind.as_bytes(), b"\0"].concat();
            let at = bytes.windows(key.len()).position(|window| window == key).unwrap_or_else(|| panic!("no {name}")) + key.len();
            let length = u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
            &bytes[at + 4..at + 4 + length]
        };
        let floats = |bytes: &[u8]| bytes.chunks(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect::<Vec<_>>();
        assert_eq!(&bytes[..4], &[0x76, 0x2f, 0x31, 0x01]);
        assert_eq!(value("compression", "compression"), [3], "ZIP of 16 lines");
        assert_eq!(value("lineOrder", "lineOrder"), [0], "increasing");
        assert_eq!(floats(value("pixelAspectRatio", "float")), [1.0]);
        assert_eq!(floats(value("chromaticities", "chromaticities")), [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329]);
        let json: serde_json::Value = serde_json::from_slice(value("tessera", "string")).unwrap();
        assert_eq!(json, serde_json::json!({"image_hash": "ab".repeat(32), "seed": u64::MAX, "engine_revision": REVISION}));
    }

    /// Numbers beside colours stay floats, to the bit, whatever the colours become; and the file is the same as ever where there are none.
    #[test]
    fn what_is_told_beside_colours_comes_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.exr");
        for aovs in
            [Aov::ALL.into_iter().collect::<Aovs>(), [Aov::Object].into_iter().collect(), [Aov::Normal, Aov::Depth].into_iter().collect()]
        {
            let extra =
                (0..37 * 21 * aovs.numbers()).map(|i| if i % 3 == 0 { 16_777_215.0 - i as f32 } else { -1.0 / (i as f32 + 1.0) }).collect();
            let film = Film::from_numbers(37, 21, film().pixels().to_vec(), aovs, extra).unwrap();
            for pixel_type in [PixelType::Float, PixelType::Half] {
                let written = write(&path, &film, pixel_type, &identity()).unwrap();
                let read = read(&path).unwrap().film;
                assert_eq!((read.aovs(), read.hash()), (aovs, written.hash));
                assert!(read.extra() == film.extra());
                assert_eq!(read.pixels() == film.pixels(), pixel_type == PixelType::Float);
            }
            let headers = MetaData::read_from_file(&path, false).unwrap().headers;
            let names: Vec<String> = headers[0].channels.list.iter().map(|channel| channel.name.to_string()).collect();
            assert_eq!(names.len(), 3 + aovs.numbers());
            assert!(names.is_sorted(), "{names:?}");
        }
    }

    #[test]
    fn equal_films_give_equal_bytes() {
        let (_, bytes, _) = written(PixelType::Float);
        for _ in 0..8 {
            assert_eq!(written(PixelType::Float).1, bytes);
        }
    }

    #[test]
    fn a_broken_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("broken.exr");
        fs::write(&path, b"no picture").unwrap();
        let error = read(&path).unwrap_err().to_string();
        assert!(error.starts_with(&format!("cannot read {}: ", path.display())), "{error}");
        write(&path, &film(), PixelType::Float, &identity()).unwrap();
        let whole = fs::read(&path).unwrap();
        fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        assert!(read(&path).is_err());
    }
}
