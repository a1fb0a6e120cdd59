//! The film: the whole frame, put together from parts.

use crate::{
    description::{Aov, Aovs},
    part::{Rect, RenderedPart, joined},
};

/// The pixels of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
    aovs: Aovs,
    /// Their numbers, pixel by pixel.
    extra: Vec<f32>,
}

/// A part that lies beyond the film, whose pixels are not as many as its rectangle says, or who holds other numbers beside colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a part of {pixels} pixels at {rect:?} does not fit on a film of {width} x {height} pixels")]
pub struct Misplaced {
    /// Where the part was to stand.
    pub rect: Rect,
    /// Pixels that it has.
    pub pixels: usize,
    /// Columns of the film.
    pub width: u32,
    /// Rows of the film.
    pub height: u32,
}

impl Film {
    /// A black film.
    pub fn new(width: u32, height: u32) -> Self {
        Self::with_aovs(width, height, Aovs::NONE)
    }

    /// A film that holds these numbers beside colours too; all are 0.
    pub fn with_aovs(width: u32, height: u32, aovs: Aovs) -> Self {
        let area = width as usize * height as usize;
        Self { width, height, pixels: vec![[0.0; 3]; area], aovs, extra: vec![0.0; area * aovs.numbers()] }
    }

    /// A film of these pixels, row by row from the top; `None` if they are not `width * height`.
    pub fn from_pixels(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Option<Self> {
        Self::from_numbers(width, height, pixels, Aovs::NONE, Vec::new())
    }

    /// The same with numbers beside colours, pixel by pixel; `None` if they are not as many as they should be.
    pub fn from_numbers(width: u32, height: u32, pixels: Vec<[f32; 3]>, aovs: Aovs, extra: Vec<f32>) -> Option<Self> {
        let fits = pixels.len() as u64 == u64::from(width) * u64::from(height) && extra.len() == pixels.len() * aovs.numbers();
        fits.then_some(Self { width, height, pixels, aovs, extra })
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Linear RGB, row by row from the top.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// What it holds beside colours.
    pub fn aovs(&self) -> Aovs {
        self.aovs
    }

    /// Their numbers, pixel by pixel, each in the order of [`Aovs::channels`].
    pub fn extra(&self) -> &[f32] {
        &self.extra
    }

    /// Puts a part at its place, over what was there.
    ///
    /// # Errors
    /// If the part does not fit on the film; nothing is changed then.
    pub fn place(&mut self, part: &RenderedPart) -> Result<(), Misplaced> {
        let Rect { x, y, width, height } = part.rect;
        let inside =
            x.checked_add(width).is_some_and(|right| right <= self.width) && y.checked_add(height).is_some_and(|low| low <= self.height);
        let numbers = self.aovs.numbers();
        if !inside || part.pixels.len() as u64 != part.rect.area() || part.extra.len() != part.pixels.len() * numbers {
            return Err(Misplaced { rect: part.rect, pixels: part.pixels.len(), width: self.width, height: self.height });
        }
        if part.pixels.is_empty() {
            return Ok(());
        }
        let rows = self.pixels.chunks_exact_mut(self.width as usize).skip(y as usize);
        for (row, part_row) in rows.zip(part.pixels.chunks_exact(width as usize)) {
            row[x as usize..][..width as usize].copy_from_slice(part_row);
        }
        if numbers > 0 {
            let rows = self.extra.chunks_exact_mut(self.width as usize * numbers).skip(y as usize);
            for (row, part_row) in rows.zip(part.extra.chunks_exact(width as usize * numbers)) {
                row[x as usize * numbers..][..part_row.len()].copy_from_slice(part_row);
            }
        }
        Ok(())
    }

    /// The film of twice as many samples, of which `second` holds the later half; each half is of `count` samples, a power of two. It has the bits of one for which all samples were taken at once,
    /// where pixels lie between 2^-126 and 2^120. Both hold the residual beside colours; `None` if they hold what
    /// cannot be extended ([`Aov::can_be_extended`]), or are of different sizes.
    pub fn joined(&self, second: &Self, count: u64) -> Option<Self> {
        let alike = (self.width, self.height, self.aovs) == (second.width, second.height, second.aovs);
        if !alike || !self.aovs.contains(Aov::Residual) || !self.aovs.iter().all(Aov::can_be_extended) {
            return None;
        }
        let numbers = self.aovs.numbers();
        // The last of all, and so of these.
        let residual = numbers - Aov::Residual.channels().len();
        let samples = self.aovs.channels().position(|channel| Aov::Samples.channels().contains(&channel));
        let mut film = self.clone();
        let pixels = film.pixels.iter_mut().zip(film.extra.chunks_exact_mut(numbers));
        for ((pixel, extra), (other, beside)) in pixels.zip(second.pixels.iter().zip(second.extra.chunks_exact(numbers))) {
            let low = |extra: &[f32]| std::array::from_fn(|i| extra[residual + i]);
            let [high, rest] = joined([[*pixel, low(extra)], [*other, low(beside)]], count);
            *pixel = high;
            extra[residual..].copy_from_slice(&rest);
            samples.into_iter().for_each(|at| extra[at] += beside[at]);
        }
        Some(film)
    }

    /// BLAKE3 of the pixels: little-endian f32, red, green, blue, row by row from the top; behind each row the numbers that it has beside colours.
    pub fn hash(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        let width = self.width.max(1) as usize;
        let numbers = width * self.aovs.numbers();
        for (y, row) in self.pixels.chunks(width).enumerate() {
            hash_row(&mut hasher, row.as_flattened());
            hash_row(&mut hasher, &self.extra[y * numbers..][..numbers]);
        }
        *hasher.finalize().as_bytes()
    }
}

/// Adds numbers of a row to a hash of pixels.
pub(crate) fn hash_row(hasher: &mut blake3::Hasher, row: &[f32]) {
    // A few numbers at a time: as many bytes as lie on the stack.
    for numbers in row.chunks(768) {
        let mut bytes = [0; 768 * 4];
        let (places, _) = bytes.as_chunks_mut::<4>();
        places.iter_mut().zip(numbers).for_each(|(place, number)| *place = number.to_le_bytes());
        hasher.update(&bytes[..numbers.len() * 4]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::Counters;

    /// A part whose pixels tell their own place.
    fn part(x: u32, y: u32, width: u32, height: u32) -> RenderedPart {
        let pixels = (0..height).flat_map(|row| (0..width).map(move |column| [(x + column) as f32, (y + row) as f32, 1.0])).collect();
        RenderedPart { rect: Rect { x, y, width, height }, pixels, extra: Vec::new(), counters: Counters::default() }
    }

    #[test]
    fn parts_come_to_their_place_in_any_order() {
        let mut parts = [part(0, 0, 3, 2), part(3, 0, 4, 5), part(0, 2, 3, 3)];
        let mut film = Film::new(7, 5);
        parts.iter().for_each(|part| film.place(part).unwrap());
        assert!(film.pixels().iter().enumerate().all(|(i, pixel)| *pixel == [(i % 7) as f32, (i / 7) as f32, 1.0]));
        parts.reverse();
        let mut other = Film::new(7, 5);
        parts.iter().for_each(|part| other.place(part).unwrap());
        assert_eq!(film.hash(), other.hash());
        assert_ne!(film.hash(), Film::new(7, 5).hash());
    }

    #[test]
    fn numbers_beside_colours_come_along() {
        let aovs: Aovs = [Aov::Depth, Aov::Error].into_iter().collect();
        let with = |x: u32, y: u32, width: u32, height: u32| {
            let extra = (0..height).flat_map(|row| (0..width).flat_map(move |column| [(x + column) as f32, (y + row) as f32, 2.0, 3.0]));
            RenderedPart { extra: extra.collect(), ..part(x, y, width, height) }
        };
        let mut film = Film::with_aovs(7, 5, aovs);
        [with(3, 0, 4, 5), with(0, 2, 3, 3), with(0, 0, 3, 2)].iter().for_each(|part| film.place(part).unwrap());
        assert!(film.extra().chunks(4).enumerate().all(|(i, numbers)| *numbers == [(i % 7) as f32, (i / 7) as f32, 2.0, 3.0]));
        let mut whole = Film::with_aovs(7, 5, aovs);
        whole.place(&with(0, 0, 7, 5)).unwrap();
        assert_eq!(film.hash(), whole.hash());
        let mut plain = Film::new(7, 5);
        plain.place(&part(0, 0, 7, 5)).unwrap();
        assert_ne!(plain.hash(), whole.hash());
        assert!(plain.place(&with(0, 0, 1, 1)).is_err() && whole.place(&part(0, 0, 1, 1)).is_err());
        let again = Film::from_numbers(7, 5, whole.pixels().to_vec(), aovs, whole.extra().to_vec()).unwrap();
        assert_eq!(again.hash(), whole.hash());
        assert!(Film::from_numbers(7, 5, whole.pixels().to_vec(), aovs, Vec::new()).is_none());
    }

    #[test]
    fn what_does_not_fit_changes_nothing() {
        let mut film = Film::new(7, 5);
        for misfit in [part(5, 0, 3, 1), part(0, 5, 1, 1), RenderedPart { pixels: vec![[1.0; 3]; 5], ..part(0, 0, 2, 2) }] {
            assert_eq!(film.place(&misfit).unwrap_err().rect, misfit.rect);
        }
        film.place(&part(1, 1, 0, 2)).unwrap();
        let beyond = RenderedPart { rect: Rect { x: u32::MAX, y: 0, width: 2, height: 1 }, ..part(0, 0, 2, 1) };
        assert!(film.place(&beyond).is_err());
        assert_eq!(film, Film::new(7, 5));
    }
}
