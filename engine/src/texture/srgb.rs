//! The sRGB transfer function, IEC 61966-2-1:1999, section 5.2.

use std::sync::LazyLock;

use crate::math::pow;

/// An sRGB value in [0, 1] as linear light in [0, 1].
pub fn srgb_to_linear(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { pow((value + 0.055) / 1.055, 2.4) }
}

/// Linear light of every 8-bit sRGB value.
pub(super) static SRGB_8: LazyLock<Box<[f32]>> = LazyLock::new(|| table(u8::MAX.into(), srgb_to_linear));

/// Linear light of every 16-bit sRGB value.
pub(super) static SRGB_16: LazyLock<Box<[f32]>> = LazyLock::new(|| table(u16::MAX.into(), srgb_to_linear));

/// Every 8-bit value as a fraction.
pub(super) static LINEAR_8: LazyLock<Box<[f32]>> = LazyLock::new(|| table(u8::MAX.into(), |value| value));

/// Every 16-bit value as a fraction.
pub(super) static LINEAR_16: LazyLock<Box<[f32]>> = LazyLock::new(|| table(u16::MAX.into(), |value| value));

fn table(max: u32, decode: impl Fn(f64) -> f64) -> Box<[f32]> {
    (0..=max).map(|code| decode(f64::from(code) / f64::from(max)) as f32).collect()
}
