//! Pictures that are read back to be verified.

use std::io::Cursor;

use tessera_engine::output::exr;

/// An OpenEXR file.
pub fn exr(bytes: &[u8]) -> bool {
    let Ok(picture) = exr::read_picture(Cursor::new(bytes), bytes.len() as u64) else { return false };
    let film = &picture.film;
    assert_eq!(film.pixels().len() as u64, u64::from(film.width()) * u64::from(film.height()));
    assert_eq!(film.extra().len(), film.pixels().len() * film.aovs().numbers());
    film.hash();
    true
}
