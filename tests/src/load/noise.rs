//! The pixels of the load.

use tessera_engine::part::Rect;

/// The pixel at a place: numbers in [0, 1) without any pattern that a compressor would find.
pub fn noise(x: u32, y: u32) -> [f32; 3] {
    // SplitMix64 (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
    let mut bits = (u64::from(y) << 32 | u64::from(x)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    [bits, bits >> 20, bits >> 40].map(|bits| (bits & 0x00ff_ffff) as f32 / 16_777_216.0)
}

/// The bytes of a part's pixels, and the hash with which they are announced.
pub fn part(rect: Rect) -> (Vec<u8>, [u8; 32]) {
    let mut bytes = Vec::with_capacity(rect.area() as usize * 12);
    for y in rect.y..rect.y + rect.height {
        for x in rect.x..rect.x + rect.width {
            noise(x, y).iter().for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
        }
    }
    let mut hasher = blake3::Hasher::new();
    [rect.x, rect.y, rect.width, rect.height].iter().for_each(|number| _ = hasher.update(&number.to_le_bytes()));
    let hash = *hasher.update(&bytes).finalize().as_bytes();
    (bytes, hash)
}
