//! A file of records, each whole or not there: magic, lengths, names, a hash over all of it, and the bytes.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

use crate::farm::LeaseId;
use crate::limits::PART_BYTES;
use crate::schedule::PartId;

const MAGIC: [u8; 4] = *b"TPX1";

/// Magic, part, lease, length, BLAKE3 of the three and of the bytes.
const HEADER_BYTES: usize = 4 + 4 + 8 + 8 + 32;

/// An open segment.
pub struct Segment {
    file: File,
    /// Length of all whole records.
    end: u64,
    dirty: bool,
    index: BTreeMap<LeaseId, Record>,
}

/// Where a record's bytes are.
#[derive(Clone, Copy)]
struct Record {
    part: PartId,
    at: u64,
    length: u64,
    hash: [u8; 32],
}

impl Segment {
    /// Opens a segment, or begins one. What follows the last whole record is cut off: it was never said to be stored.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        let mut segment = Self { file, end: 0, dirty: false, index: BTreeMap::new() };
        segment.scan()?;
        segment.file.set_len(segment.end)?;
        segment.file.sync_all()?;
        if let Some(folder) = path.parent() {
            File::open(folder)?.sync_all()?; // a new file's name
        }
        Ok(segment)
    }

    fn scan(&mut self) -> io::Result<()> {
        let length = self.file.metadata()?.len();
        let mut reader = BufReader::new(&self.file);
        let mut end = 0;
        while let Some((lease, record)) = next_record(&mut reader, end, length)? {
            end = record.at + record.length;
            self.index.entry(lease).or_insert(record);
        }
        self.end = end;
        Ok(())
    }

    /// Writes a record behind the last one. An attempt that failed half-way is overwritten by the next.
    pub fn append(&mut self, part: PartId, lease: LeaseId, bytes: &[u8]) -> io::Result<()> {
        if self.index.contains_key(&lease) {
            return Ok(());
        }
        let length = bytes.len() as u64;
        let hash = checksum(part, lease, length, &mut &*bytes)?;
        let mut header = Vec::with_capacity(HEADER_BYTES);
        header.extend(MAGIC);
        header.extend(part.0.to_le_bytes());
        header.extend(lease.0.to_le_bytes());
        header.extend(length.to_le_bytes());
        header.extend(hash);
        self.file.seek(SeekFrom::Start(self.end))?;
        self.file.write_all(&header)?;
        self.file.write_all(bytes)?;
        self.dirty = true;
        let at = self.end + HEADER_BYTES as u64;
        self.index.insert(lease, Record { part, at, length, hash });
        self.end = at + length;
        Ok(())
    }

    pub fn sync(&mut self) -> io::Result<()> {
        if self.dirty {
            self.file.sync_data()?;
            self.dirty = false;
        }
        Ok(())
    }

    /// A reader of what is in the segment by now.
    pub fn reader(&self, path: &Path) -> io::Result<PixelReader> {
        Ok(PixelReader { file: File::open(path)?, index: self.index.clone() })
    }

    pub fn stored(&self) -> Vec<(LeaseId, PartId)> {
        self.index.iter().map(|(lease, record)| (*lease, record.part)).collect()
    }
}

/// Reads pixels of a job, while others may be stored.
pub struct PixelReader {
    file: File,
    index: BTreeMap<LeaseId, Record>,
}

impl PixelReader {
    /// Reads all pixels of an attempt once, without keeping them, and says how many bytes they are.
    ///
    /// # Errors
    /// When they are not there, or are not what was stored.
    pub fn check(&mut self, lease: LeaseId) -> io::Result<u64> {
        let record = self.record(lease)?;
        self.file.seek(SeekFrom::Start(record.at))?;
        if checksum(record.part, lease, record.length, &mut self.file)? != record.hash {
            return Err(io::Error::new(io::ErrorKind::InvalidData, "they are not what was stored (the disk changed them)"));
        }
        Ok(record.length)
    }

    /// Reads the bytes of an attempt's pixels from `offset` on.
    ///
    /// # Errors
    /// When there are not so many.
    pub fn read(&mut self, lease: LeaseId, offset: u64, bytes: &mut [u8]) -> io::Result<()> {
        let record = self.record(lease)?;
        if offset.saturating_add(bytes.len() as u64) > record.length {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        self.file.seek(SeekFrom::Start(record.at + offset))?;
        self.file.read_exact(bytes)
    }

    fn record(&self, lease: LeaseId) -> io::Result<Record> {
        self.index.get(&lease).copied().ok_or_else(|| io::Error::new(io::ErrorKind::NotFound, "they are not there"))
    }
}

/// The record at `at`, if it is whole.
fn next_record(reader: &mut impl Read, at: u64, end: u64) -> io::Result<Option<(LeaseId, Record)>> {
    let mut header = [0; HEADER_BYTES];
    if end - at < HEADER_BYTES as u64 {
        return Ok(None);
    }
    reader.read_exact(&mut header)?;
    let number = |from: usize| header[from..from + 8].iter().rev().fold(0u64, |number, byte| number << 8 | u64::from(*byte));
    let (part, lease, length) = (PartId(number(4) as u32), LeaseId(number(8)), number(16));
    let at = at + HEADER_BYTES as u64;
    if header[..4] != MAGIC || length > PART_BYTES as u64 || length > end - at {
        return Ok(None);
    }
    let mut hash = [0; 32];
    hash.copy_from_slice(&header[24..]);
    let whole = checksum(part, lease, length, reader)? == hash;
    Ok(whole.then_some((lease, Record { part, at, length, hash })))
}

/// The hash of a record whose bytes come from `bytes`.
fn checksum(part: PartId, lease: LeaseId, length: u64, bytes: &mut impl Read) -> io::Result<[u8; 32]> {
    let mut hasher = blake3::Hasher::new();
    if io::copy(&mut bytes.take(length), &mut hasher)? < length {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    // Behind the pixels: before them it would shift these off the hash's blocks, which takes twice the time.
    hasher.update(&part.0.to_le_bytes());
    hasher.update(&lease.0.to_le_bytes());
    hasher.update(&length.to_le_bytes());
    Ok(*hasher.finalize().as_bytes())
}
