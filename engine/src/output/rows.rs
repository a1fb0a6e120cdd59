//! Where writers take a picture from: a band of rows at a time, so that none needs the whole in memory.

use std::io;

use crate::{description::Aovs, film::Film};

/// A picture whose rows can be read from the top; after the last one, from the top again.
pub trait Rows {
    /// Columns and rows.
    fn size(&self) -> (u32, u32);

    /// What it holds beside colours.
    fn aovs(&self) -> Aovs;

    /// Fills `band`, which is as many whole rows as there are from row `y` on, with their pixels; and `extra`, unless it is empty, with the numbers that
    /// these rows hold beside colours.
    ///
    /// # Errors
    /// When they cannot be had.
    fn read(&mut self, y: u32, band: &mut [[f32; 3]], extra: &mut [f32]) -> io::Result<()>;
}

impl Rows for &Film {
    fn size(&self) -> (u32, u32) {
        (self.width(), self.height())
    }

    fn aovs(&self) -> Aovs {
        Film::aovs(self)
    }

    fn read(&mut self, y: u32, band: &mut [[f32; 3]], extra: &mut [f32]) -> io::Result<()> {
        let start = y as usize * self.width() as usize;
        let pixels = self.pixels().get(start..start + band.len()).ok_or(io::ErrorKind::InvalidInput)?;
        band.copy_from_slice(pixels);
        let start = start * self.aovs().numbers();
        let numbers = self.extra().get(start..start + extra.len()).ok_or(io::ErrorKind::InvalidInput)?;
        extra.copy_from_slice(numbers);
        Ok(())
    }
}

impl<R: Rows> Rows for &mut R {
    fn size(&self) -> (u32, u32) {
        R::size(self)
    }

    fn aovs(&self) -> Aovs {
        R::aovs(self)
    }

    fn read(&mut self, y: u32, band: &mut [[f32; 3]], extra: &mut [f32]) -> io::Result<()> {
        R::read(self, y, band, extra)
    }
}
