//! The picture of a job's parts, read from disk a band at a time: memory does not grow with the frame.

use std::io;

use tessera_engine::{description::Aovs, output::Rows, part::Rect};

use crate::{farm::LeaseId, journal::PixelReader, schedule::PartId};

/// A part on disk.
struct Piece {
    part: PartId,
    rect: Rect,
    lease: LeaseId,
    /// Whether its pixels were found to be those that were stored.
    checked: bool,
}

impl Piece {
    fn low(&self) -> u32 {
        self.rect.y + self.rect.height
    }
}

/// The picture. Where no part is, it is black.
pub struct Bands {
    size: (u32, u32),
    aovs: Aovs,
    reader: PixelReader,
    /// From the top.
    pieces: Vec<Piece>,
    /// How many of them the rows so far have met.
    met: usize,
    /// Those among them that reach further down.
    open: Vec<usize>,
    bytes: Vec<u8>,
    /// The part whose pixels could not be read, and why.
    pub unreadable: Option<(PartId, String)>,
}

/// Of its colour; all colours of a part stand before what it tells beside them.
const COLOR_BYTES: u64 = 12;

impl Bands {
    /// A picture of this size, which tells so much beside colours, and of these parts, which do not overlap.
    pub fn new(size: (u32, u32), aovs: Aovs, reader: PixelReader, parts: &[(PartId, Rect, LeaseId)]) -> Self {
        let mut pieces: Vec<Piece> = parts.iter().map(|&(part, rect, lease)| Piece { part, rect, lease, checked: false }).collect();
        pieces.sort_by_key(|piece| (piece.rect.y, piece.rect.x));
        Self { size, aovs, reader, pieces, met: 0, open: Vec::new(), bytes: Vec::new(), unreadable: None }
    }

    /// Copies the rows from `y` on that a part has in a band.
    fn place(&mut self, at: usize, y: u32, band: &mut [[f32; 3]], extra: &mut [f32]) -> io::Result<()> {
        let piece = &mut self.pieces[at];
        let (rect, width) = (piece.rect, self.size.0 as usize);
        if !piece.checked {
            let fits = u64::from(rect.x) + u64::from(rect.width) <= u64::from(self.size.0);
            if self.reader.check(piece.lease)? != rect.area() * self.aovs.bytes_per_pixel() || !fits {
                return Err(io::Error::new(io::ErrorKind::InvalidData, format!("they are not those of {rect:?}")));
            }
            piece.checked = true;
        }
        let end = piece.low().min(y + (band.len() / width) as u32);
        let first = rect.y.max(y);
        let (lease, numbers) = (piece.lease, self.aovs.numbers());
        let (columns, rows, above) = (rect.width as usize, (first - y) as usize, u64::from(first - rect.y));
        self.fetch(lease, 0, above, end - first, u64::from(rect.width) * COLOR_BYTES)?;
        let (pixels, _) = self.bytes.as_chunks::<12>();
        for (row, pixels) in band.chunks_exact_mut(width).skip(rows).zip(pixels.chunks_exact(columns)) {
            row[rect.x as usize..][..columns].iter_mut().zip(pixels).for_each(|(to, from)| *to = pixel(from));
        }
        if extra.is_empty() {
            return Ok(());
        }
        self.fetch(lease, rect.area() * COLOR_BYTES, above, end - first, columns as u64 * numbers as u64 * 4)?;
        let (read, _) = self.bytes.as_chunks::<4>();
        for (row, read) in extra.chunks_exact_mut(width * numbers).skip(rows).zip(read.chunks_exact(columns * numbers)) {
            row[rect.x as usize * numbers..][..read.len()].iter_mut().zip(read).for_each(|(to, from)| *to = f32::from_le_bytes(*from));
        }
        Ok(())
    }

    /// Reads rows of a part that are so many bytes each, the first of which stands at `start`, from the row `above` others on.
    fn fetch(&mut self, lease: LeaseId, start: u64, above: u64, rows: u32, row_bytes: u64) -> io::Result<()> {
        self.bytes.resize((u64::from(rows) * row_bytes) as usize, 0);
        self.reader.read(lease, start + above * row_bytes, &mut self.bytes)
    }
}

impl Rows for Bands {
    fn size(&self) -> (u32, u32) {
        self.size
    }

    fn aovs(&self) -> Aovs {
        self.aovs
    }

    fn read(&mut self, y: u32, band: &mut [[f32; 3]], extra: &mut [f32]) -> io::Result<()> {
        if y == 0 {
            self.met = 0;
            self.open.clear();
        }
        let end = y + (band.len() / self.size.0.max(1) as usize) as u32;
        let news = self.pieces[self.met..].iter().take_while(|piece| piece.rect.y < end).count();
        self.open.extend(self.met..self.met + news);
        self.met += news;
        band.fill([0.0; 3]);
        extra.fill(0.0);
        for at in self.open.clone() {
            if let Err(error) = self.place(at, y, band, extra) {
                self.unreadable = Some((self.pieces[at].part, error.to_string()));
                return Err(error);
            }
        }
        self.open.retain(|at| self.pieces[*at].low() > end);
        Ok(())
    }
}

fn pixel(bytes: &[u8; 12]) -> [f32; 3] {
    let (numbers, _) = bytes.as_chunks::<4>();
    [0, 1, 2].map(|channel| f32::from_le_bytes(numbers[channel]))
}

#[cfg(test)]
mod tests {
    use tessera_engine::{
        description::{Aov, FrameHash},
        film::Film,
        output::{exr, png},
        part::{Counters, RenderedPart},
    };

    use super::*;
    use crate::{
        farm::{FarmConfig, JobId},
        journal::Journal,
    };

    const SIZE: (u32, u32) = (83, 70);

    /// Pixels that tell their own place; some are beyond half floats.
    fn part(rect: Rect, aovs: Aovs) -> RenderedPart {
        let pixel = |x: u32, y: u32| [x as f32 * 0.37, 1.0 / (y + 1) as f32, if (x + y).is_multiple_of(7) { 1e9 } else { 0.5 }];
        let pixels = (rect.y..rect.y + rect.height).flat_map(|y| (rect.x..rect.x + rect.width).map(move |x| pixel(x, y))).collect();
        let numbers = |x: u32, y: u32| (0..aovs.numbers()).map(move |number| (y * SIZE.0 + x) as f32 + number as f32 * 0.01);
        let extra = (rect.y..rect.y + rect.height).flat_map(|y| (rect.x..rect.x + rect.width).flat_map(move |x| numbers(x, y))).collect();
        RenderedPart { rect, pixels, extra, counters: Counters::default() }
    }

    fn rect(x: u32, y: u32, width: u32, height: u32) -> Rect {
        Rect { x, y, width, height }
    }

    /// A journal with these parts in the order given, and their names.
    fn stored(folder: &std::path::Path, rects: &[Rect], aovs: Aovs) -> (Journal, Vec<(PartId, Rect, LeaseId)>) {
        let (mut journal, _) = Journal::open(folder, FarmConfig::default()).unwrap();
        let parts: Vec<_> = (0..).zip(rects).map(|(i, rect)| (PartId(i), *rect, LeaseId(u64::from(i) + 7))).collect();
        for (id, rect, lease) in &parts {
            journal.store_pixels(JobId(1), *id, *lease, &part(*rect, aovs).to_bytes()).unwrap();
        }
        journal.sync_pixels().unwrap();
        (journal, parts)
    }

    fn layouts() -> Vec<Vec<Rect>> {
        let columns = (0..SIZE.0).step_by(5).map(|x| rect(x, 0, 5.min(SIZE.0 - x), SIZE.1)).collect();
        let grid =
            (0..SIZE.1).step_by(32).flat_map(|y| (0..SIZE.0).step_by(32).map(move |x| rect(x, y, 32.min(SIZE.0 - x), 32.min(SIZE.1 - y))));
        let mut ragged = vec![rect(60, 1, 23, 69), rect(0, 0, 60, 1), rect(0, 17, 31, 53), rect(60, 0, 23, 1), rect(31, 1, 29, 16)];
        ragged.extend([rect(0, 1, 31, 16), rect(31, 49, 29, 21)]); // and a hole between
        vec![columns, grid.collect(), ragged, vec![rect(0, 0, SIZE.0, SIZE.1)], Vec::new()]
    }

    #[test]
    fn files_are_the_same_whether_the_picture_is_streamed_or_whole() {
        let sets = [Aovs::NONE, [Aov::Depth].into_iter().collect(), Aov::ALL.into_iter().collect()];
        for (layout, aovs) in layouts().into_iter().flat_map(|layout| sets.map(|aovs| (layout.clone(), aovs))) {
            let folder = tempfile::tempdir().unwrap();
            let (mut journal, parts) = stored(folder.path(), &layout, aovs);
            let mut bands = Bands::new(SIZE, aovs, journal.reader(JobId(1)).unwrap(), &parts);
            let mut film = Film::with_aovs(SIZE.0, SIZE.1, aovs);
            layout.iter().for_each(|rect| film.place(&part(*rect, aovs)).unwrap());
            let (streamed, whole) = (folder.path().join("streamed"), folder.path().join("whole"));
            let same = || assert!(std::fs::read(&streamed).unwrap() == std::fs::read(&whole).unwrap(), "{layout:?}");
            for pixel_type in [exr::PixelType::Float, exr::PixelType::Half] {
                let identity = exr::Identity::new(FrameHash([1; 32]), 5);
                let written = exr::write(&streamed, &mut bands, pixel_type, &identity).unwrap();
                assert_eq!(written, exr::write(&whole, &film, pixel_type, &identity).unwrap());
                assert_eq!(written.hash, exr::read(&whole).unwrap().film.hash());
                same();
            }
            png::write(&streamed, &mut bands, &[[31, 17, 29, 32]], 0.5).unwrap();
            png::write(&whole, &film, &[[31, 17, 29, 32]], 0.5).unwrap();
            same();
        }
    }

    #[test]
    fn the_part_that_the_disk_changed_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let (mut journal, parts) = stored(folder.path(), &layouts()[0], Aovs::NONE);
        let segment = folder.path().join("job-1.pixels");
        let mut bytes = std::fs::read(&segment).unwrap();
        let near_the_end_of_the_last = bytes.len() - 5;
        bytes[near_the_end_of_the_last] ^= 4;
        std::fs::write(&segment, bytes).unwrap();
        let mut bands = Bands::new(SIZE, Aovs::NONE, journal.reader(JobId(1)).unwrap(), &parts);
        let file = folder.path().join("picture");
        assert!(exr::write(&file, &mut bands, exr::PixelType::Float, &exr::Identity::new(FrameHash([1; 32]), 5)).is_err());
        assert_eq!(bands.unreadable.map(|(part, _)| part), parts.last().map(|(part, ..)| *part));
        assert!(!file.exists());
    }
}
