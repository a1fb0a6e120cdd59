//! Images, as textures decode them.

use tessera_engine::{description::ColorSpace, texture::Image};

use super::caught_of_libraries;

/// A PNG, JPEG or Radiance HDR file: its first bytes say which.
pub fn any(bytes: &[u8]) -> bool {
    let Ok(image) = caught_of_libraries(|| Image::decode(bytes, ColorSpace::Srgb)) else { return false };
    let [width, height] = image.size().map(|edge| edge as usize);
    assert!((1..=32_768).contains(&width) && (1..=32_768).contains(&height));
    let per_pixel = image.memory() / (width * height);
    assert_eq!(image.memory(), per_pixel * width * height);
    let allowed = if image.has_opacity() { [2, 4, 8, 16].as_slice() } else { &[1, 2, 3, 6, 12] };
    assert!(allowed.contains(&per_pixel), "{per_pixel} bytes a pixel");
    assert!(image.memory() <= 4 * 8256 * bytes.len(), "{} bytes of memory for a file of {}", image.memory(), bytes.len());
    true
}
