//! Where writers take a picture from: a band of rows at a time, so that none needs the whole in memory.

use std::io;

use crate::film::Film;

/// A picture whose rows can be read from the top; after the last one, from the top again.
pub trait Rows {
    /// Columns and rows.
    fn size(&self) -> (u32, u32);

    /// Fills `band`, which is as many whole rows as there are from row `y` on, with their pixels.
    ///
    /// # Errors
    /// When they cannot be had.
    fn read(&mut self, y: u32, band: &mut [[f32; 3]]) -> io::Result<()>;
}

impl Rows for &Film {
    fn size(&self) -> (u32, u32) {
        (self.width(), self.height())
    }

    fn read(&mut self, y: u32, band: &mut [[f32; 3]]) -> io::Result<()> {
        let start = y as usize * self.width() as usize;
        let pixels = self.pixels().get(start..start + band.len()).ok_or(io::ErrorKind::InvalidInput)?;
        band.copy_from_slice(pixels);
        Ok(())
    }
}

impl<R: Rows> Rows for &mut R {
    fn size(&self) -> (u32, u32) {
        R::size(self)
    }

    fn read(&mut self, y: u32, band: &mut [[f32; 3]]) -> io::Result<()> {
        R::read(self, y, band)
    }
}
