use std::io::Cursor;

use glam::DVec2;
use image::{DynamicImage, ImageFormat};
use proptest::prelude::*;

use super::{Image, Texture, srgb_to_linear};
use crate::description::{self, ColorSpace, MemoryAssets, SourceId, TextureFilter, Wrap};

fn png(image: impl Into<DynamicImage>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn texture(file: &[u8], color_space: ColorSpace, wrap: [Wrap; 2]) -> Texture {
    let mut assets = MemoryAssets::default();
    let file = assets.insert(file.to_vec());
    let image = description::Texture::Image {
        file,
        color_space,
        wrap,
        filter: TextureFilter::default(),
        scale: [1.0; 2],
        offset: [0.0; 2],
        source: SourceId::default(),
    };
    Texture::compile(&image, &assets).unwrap()
}

fn error(file: &[u8]) -> String {
    let error = Image::decode(file, ColorSpace::Srgb).unwrap_err();
    format!("{error} / {}", error.help.clone().unwrap_or_default())
}

/// A baseline JPEG made by hand: two blocks of 8 x 8 grey pixels, 228 and 128 (a DC coefficient of 100 steps of 8, over 8 and above 128; then 0).
fn jpeg() -> Vec<u8> {
    let segment = |marker: u8, data: &[u8]| [&[0xff, marker, 0, data.len() as u8 + 2], data].concat();
    let quantization = segment(0xdb, &[&[0][..], &[8; 64]].concat());
    let frame = segment(0xc0, &[8, 0, 8, 0, 16, 1, 1, 0x11, 0]);
    // DC: code 0 stands for no change, code 10 for a change of 7 bits. AC: code 0 ends the block.
    let dc = segment(0xc4, &[&[0x00, 1, 1][..], &[0; 14], &[0, 7]].concat());
    let ac = segment(0xc4, &[&[0x10, 1][..], &[0; 15], &[0]].concat());
    let scan = segment(0xda, &[1, 1, 0, 0, 63, 0]);
    // 10 1100100 0 (up by 100), 10 0011011 0 (down by 100), padded with ones.
    let data = [0b1011_0010, 0b0010_0011, 0b0110_1111];
    [&[0xff, 0xd8][..], &quantization, &frame, &dc, &ac, &scan, &data, &[0xff, 0xd9]].concat()
}

#[test]
fn srgb_agrees_with_published_values_and_its_inverse() {
    // Published: 18 % grey is 118/255 in sRGB, and half the code value is 21.4 % of the light.
    assert!((srgb_to_linear(0.5) - 0.214_041_140_482).abs() < 1e-11);
    assert_eq!((srgb_to_linear(0.0), srgb_to_linear(1.0)), (0.0, 1.0));
    for code in 0..=255u8 {
        let pixel = png(image::GrayImage::from_pixel(1, 1, image::Luma([code])));
        let linear = f64::from(Image::decode(&pixel, ColorSpace::Srgb).unwrap().pixel(0, 0)[0]);
        let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        assert!((encoded * 255.0 - f64::from(code)).abs() < 1e-3, "{code}: {encoded}");
    }
}

#[test]
fn scale_and_offset_move_coordinates() {
    let mut assets = MemoryAssets::default();
    let file = assets.insert(png(image::GrayImage::from_fn(4, 4, |x, y| image::Luma([(16 * x + 4 * y) as u8]))));
    let of = |scale, offset| {
        let (color_space, wrap, filter) = (ColorSpace::Linear, [Wrap::Repeat; 2], TextureFilter::default());
        Texture::compile(
            &description::Texture::Image { file, color_space, wrap, filter, scale, offset, source: SourceId::default() },
            &assets,
        )
    };
    let (plain, moved) = (of([1.0; 2], [0.0; 2]).unwrap(), of([4.0, -2.0], [0.25, 0.5]).unwrap());
    for (u, v) in [(0.0, 0.0), (0.3, 0.9), (-1.7, 2.2)] {
        let (there, here) = (glam::DVec2::new(u, v), glam::DVec2::new(4.0 * u + 0.25, 0.5 - 2.0 * v));
        assert_eq!(moved.at([there; 2].into()), plain.at([here; 2].into()));
    }
    for wrong in [f64::NAN, f64::INFINITY, 1e10] {
        assert!(of([wrong, 1.0], [0.0; 2]).is_err() && of([1.0; 2], [0.0, wrong]).is_err(), "{wrong}");
    }
}

#[test]
fn opacity_is_linear_and_grey_spreads() {
    let rgba = Image::decode(&png(image::RgbaImage::from_pixel(1, 1, image::Rgba([0, 255, 0, 51]))), ColorSpace::Srgb).unwrap();
    assert_eq!(rgba.pixel(0, 0), [0.0, 1.0, 0.0, 0.2]);
    assert!(rgba.has_opacity());
    let grey = Image::decode(&png(image::GrayAlphaImage::from_pixel(1, 1, image::LumaA([51, 102]))), ColorSpace::Linear).unwrap();
    assert_eq!(grey.pixel(0, 0), [0.2, 0.2, 0.2, 0.4]);
    let deep: image::ImageBuffer<image::Rgb<u16>, _> = image::ImageBuffer::from_pixel(1, 1, image::Rgb([0, 13107, 65535u16]));
    let linear = Image::decode(&png(deep.clone()), ColorSpace::Linear).unwrap();
    assert_eq!(linear.pixel(0, 0), [0.0, 0.2, 1.0, 1.0]);
    let srgb = Image::decode(&png(deep), ColorSpace::Srgb).unwrap();
    assert!((f64::from(srgb.pixel(0, 0)[1]) - srgb_to_linear(0.2)).abs() < 1e-7);
    assert_eq!((rgba.memory(), srgb.memory()), (4, 6));
}

#[test]
fn first_row_lies_at_v_0() {
    let rows = image::GrayImage::from_fn(1, 2, |_, y| image::Luma([if y == 0 { 0 } else { 255 }]));
    let texture = texture(&png(rows), ColorSpace::Linear, [Wrap::Clamp; 2]);
    assert_eq!(texture.rgba(DVec2::new(0.5, 0.1))[0], 0.0);
    assert_eq!(texture.rgba(DVec2::new(0.5, 0.9))[0], 1.0);
}

#[test]
fn checker_alternates_also_below_zero() {
    let checker = Texture::Checker { even: [1.0; 3], odd: [0.0; 3], size: 0.5 };
    for (u, v, even) in
        [(0.1, 0.1, true), (0.6, 0.1, false), (0.6, 0.6, true), (-0.1, 0.1, false), (-0.1, -0.1, true), (1e9 + 0.1, 0.1, true)]
    {
        assert_eq!(checker.rgba(DVec2::new(u, v))[0] == 1.0, even, "{u} {v}");
    }
}

/// Where `u` falls in [0, 1], by the definition of each wrap in words: walk there one period at a time.
fn unwrap_slowly(mut u: f64, wrap: Wrap) -> f64 {
    match wrap {
        Wrap::Repeat => {
            while u < 0.0 {
                u += 1.0;
            }
            while u > 1.0 {
                u -= 1.0;
            }
            u
        }
        Wrap::Mirror => {
            while !(0.0..=1.0).contains(&u) {
                u = if u < 0.0 { -u } else { 2.0 - u };
            }
            u
        }
        Wrap::Clamp => u.clamp(0.0, 1.0),
    }
}

proptest! {
    /// An image of a ramp, interpolated, is the ramp itself wherever no edge is near: a closed form for filter and wrap together.
    #[test]
    fn interpolating_a_ramp_gives_the_ramp(u in -3.0..4.0f64, v in -3.0..4.0f64, mode in 0..3usize, width in 2u32..9, height in 2u32..9) {
        let wrap = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][mode];
        let ramp: image::ImageBuffer<image::Rgb<u16>, _> =
            image::ImageBuffer::from_fn(width, height, |x, y| image::Rgb([(x * 4096) as u16, (y * 4096) as u16, 0]));
        let [r, g, ..] = texture(&png(ramp), ColorSpace::Linear, [wrap; 2]).rgba(DVec2::new(u, v));
        for (value, coordinate, size) in [(r, u, width), (g, v, height)] {
            let position = unwrap_slowly(coordinate, wrap) * f64::from(size) - 0.5;
            let last = f64::from(size - 1);
            let expected = match wrap {
                Wrap::Repeat if position < 0.0 => -position * last,
                Wrap::Repeat if position > last => (last + 1.0 - position) * last,
                _ => position.clamp(0.0, last),
            };
            prop_assert!((f64::from(value) * 65535.0 / 4096.0 - expected).abs() < 1e-4, "{value} for {coordinate}: {expected}");
        }
    }

    #[test]
    fn damaged_images_never_panic(flips in proptest::collection::vec((0usize..1_000_000, 0u8..8), 1..6), which in 0..2usize) {
        let mut bytes = if which == 0 { jpeg() } else { png(image::RgbImage::from_fn(9, 7, |x, y| image::Rgb([x as u8 * 20, y as u8 * 30, 7]))) };
        for (at, bit) in flips {
            let at = at % bytes.len();
            bytes[at] ^= 1 << bit;
        }
        let _ = Image::decode(&bytes, ColorSpace::Srgb);
    }
}

#[test]
fn coordinates_without_a_place_still_give_a_colour() {
    let texture = texture(&png(image::GrayImage::from_pixel(3, 2, image::Luma([255]))), ColorSpace::Linear, [Wrap::Repeat, Wrap::Mirror]);
    for u in [f64::NAN, f64::INFINITY, -1e300, 1e300] {
        texture.rgba(DVec2::new(u, -u));
    }
    assert_eq!(texture.rgba(DVec2::new(1e300, -1e300))[0], 1.0);
}

#[test]
fn reads_jpeg_and_radiance_hdr() {
    let jpeg = Image::decode(&jpeg(), ColorSpace::Linear).unwrap();
    assert_eq!(jpeg.size(), [16, 8]);
    assert_eq!((jpeg.pixel(3, 4)[0], jpeg.pixel(12, 4)[2]), (228.0 / 255.0, 128.0 / 255.0));
    for name in ["RADIANCE", "RGBE"] {
        let mut hdr = format!("#?{name}\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n").into_bytes();
        hdr.extend([128, 64, 0, 129, 128, 128, 128, 136]);
        let hdr = Image::decode(&hdr, ColorSpace::Srgb).unwrap();
        assert_eq!(hdr.pixel(0, 0), [1.0, 0.5, 0.0, 1.0]);
        assert_eq!(hdr.pixel(1, 0), [128.0, 128.0, 128.0, 1.0]);
    }
}

#[test]
fn wrong_bytes_are_named() {
    let whole = png(image::RgbImage::new(40, 40));
    insta::assert_snapshot!(
        [
            error(b""),
            error(b"<html>not found</html>"),
            error(b"RIFF\0\0\0\0WEBPVP8 "),
            error(&whole[..whole.len() / 2]),
            error(&whole[..20]),
            error(&jpeg()[..100]),
            error(b"#?RADIANCE\n\n-Y 30000 +X 30000\n"),
        ]
        .join("\n")
    );
}

#[test]
fn images_cut_off_anywhere_are_errors() {
    let png = png(image::RgbImage::from_fn(9, 7, |x, y| image::Rgb([x as u8 * 20, y as u8 * 30, 7])));
    let jpeg = jpeg();
    // The last 12 bytes of a PNG, and the last 3 of this JPEG, hold no pixels.
    for (bytes, needed) in [(&png, png.len() - 16), (&jpeg, jpeg.len() - 5)] {
        for length in 0..needed {
            assert!(Image::decode(&bytes[..length], ColorSpace::Srgb).is_err(), "{length} of {}", bytes.len());
        }
        assert!(Image::decode(bytes, ColorSpace::Srgb).is_ok());
    }
}

#[test]
fn a_small_file_cannot_ask_for_much_memory() {
    let mut huge = png(image::GrayImage::new(1, 1));
    // Width and height in IHDR, and its checksum (CRC-32 of "IHDR" and the fields).
    huge[16..24].copy_from_slice(&[0, 0, 0x7f, 0xff, 0, 0, 0x7f, 0xff]);
    let mut crc = !0u32;
    for &byte in &huge[12..29] {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
        }
    }
    huge[29..33].copy_from_slice(&(!crc).to_be_bytes());
    assert!(error(&huge).contains("cannot be in a file"), "{}", error(&huge));
}
