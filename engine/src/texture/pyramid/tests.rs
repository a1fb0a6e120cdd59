use glam::{DVec2, Vec2};
use proptest::prelude::*;

use super::{Footprint, Image, Pyramid, bilinear};
use crate::description::Wrap;

/// Any numbers, the same in every run.
fn noise(size: [u32; 2], channels: usize) -> Image {
    let count = (size[0] * size[1]) as usize * channels;
    let numbers = (0..count).map(|i| (i as u32).wrapping_mul(2_654_435_761).rotate_left(7) as f32 / u32::MAX as f32);
    Image::linear(size, channels, numbers.collect())
}

/// The mean of all pixels in a rectangle of an image, in units of its sides, by cutting each pixel into so small ones that the rectangle covers whole ones.
fn mean(image: &Image, from: [u32; 2], to: [u32; 2], of: [u32; 2]) -> [f64; 4] {
    let [width, height] = image.size();
    let (mut sum, mut count) = ([0.0; 4], 0.0);
    for y in from[1] * height..to[1] * height {
        for x in from[0] * width..to[0] * width {
            let pixel = image.pixel(x / of[0], y / of[1]);
            sum = std::array::from_fn(|i| sum[i] + f64::from(pixel[i]));
            count += 1.0;
        }
    }
    sum.map(|sum| sum / count)
}

proptest! {
    #[test]
    fn every_copy_is_the_mean_of_the_one_before(width in 1u32..14, height in 1u32..14, channels in 1usize..=4) {
        let image = noise([width, height], channels);
        let whole = mean(&image, [0, 0], [1, 1], [1, 1]);
        let pyramid = Pyramid::new(&image);
        let mut before = &image;
        for level in &pyramid.levels {
            let [w, h] = level.size();
            prop_assert_eq!([w, h], before.size().map(|side| (side / 2).max(1)));
            for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
                let expected = mean(before, [x, y], [x + 1, y + 1], [w, h]);
                let pixel = level.pixel(x, y);
                prop_assert!((0..4).all(|i| (f64::from(pixel[i]) - expected[i]).abs() < 1e-7), "{pixel:?} {expected:?}");
            }
            let all = mean(level, [0, 0], [1, 1], [1, 1]);
            prop_assert!((0..4).all(|i| (all[i] - whole[i]).abs() < 1e-6), "{all:?} {whole:?}");
            before = level;
        }
        prop_assert_eq!(before.size(), [1, 1]);
    }
}

#[test]
fn the_longer_side_of_the_footprint_chooses_the_copies() {
    let image = noise([24, 10], 3);
    let pyramid = Pyramid::new(&image);
    let (wrap, uv) = ([Wrap::Repeat, Wrap::Clamp], DVec2::new(0.31, 0.77));
    // So many pixels to the right, and so many down.
    let look =
        |right: f32, down: f32| pyramid.look(&image, wrap, uv, &Footprint([Vec2::new(right / 24.0, 0.0), Vec2::new(0.0, down / 10.0)]));
    let level = |number: usize| if number == 0 { bilinear(&image, wrap, uv) } else { bilinear(&pyramid.levels[number - 1], wrap, uv) };
    let near = |a: [f32; 4], b: [f32; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
    for small in [0.0, 0.5, 1.0 - 1e-6] {
        assert_eq!(look(small, small), level(0));
    }
    assert_eq!(look(f32::NAN, f32::NAN), level(0));
    for number in 0..=4 {
        let side = (1 << number) as f32;
        assert!(near(look(side, 0.1), level(number)) && near(look(0.1, side), level(number)), "{number}");
        if number < 4 {
            let middle = std::array::from_fn(|i| 0.5 * (level(number)[i] + level(number + 1)[i]));
            assert!(near(look(side * 2f32.sqrt(), side), middle), "{number}");
        }
    }
    for large in [100.0, 1e30, f32::INFINITY] {
        assert_eq!(look(large, 1.0), level(4));
    }
    assert_eq!(pyramid.levels[3].size(), [1, 1]);
}
