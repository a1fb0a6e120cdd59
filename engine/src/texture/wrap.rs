//! From a texture coordinate to the two pixels that it lies between.

use crate::description::Wrap;

/// The pixels at both sides of `coordinate` along an axis of `size` pixels (at least 1), and the weight of the second in [0, 1).
///
/// Pixel i covers [i / size, (i + 1) / size] and has its colour in the middle. Any coordinate, even one that is not finite, gives
/// pixels that are there.
pub(super) fn neighbours(coordinate: f64, size: u32, wrap: Wrap) -> ([u32; 2], f32) {
    let inside = match wrap {
        Wrap::Repeat => coordinate - coordinate.floor(),
        Wrap::Mirror => {
            let period = coordinate - 2.0 * (coordinate * 0.5).floor();
            if period > 1.0 { 2.0 - period } else { period }
        }
        Wrap::Clamp => coordinate.clamp(0.0, 1.0),
    };
    let position = inside * f64::from(size) - 0.5;
    let first = position.floor();
    let last = i64::from(size) - 1;
    // Beyond its edge an image that repeats shows its other edge; one that is clamped or mirrored shows the same edge.
    let pixel = |index: i64| match wrap {
        Wrap::Repeat if index < 0 => last,
        Wrap::Repeat if index > last => 0,
        _ => index.clamp(0, last),
    };
    let index = (first as i64).clamp(-1, last);
    ([pixel(index) as u32, pixel(index + 1) as u32], (position - first) as f32)
}
