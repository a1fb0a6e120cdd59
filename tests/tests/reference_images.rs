//! The reference scenes S2 and S3, path traced, against pictures of Mitsuba 3: a second renderer that was given the scenes' definition in numbers.
//!
//! The repository holds means of these pictures over blocks of 16 x 16 pixels, and their variances: the references' own standard errors of each pixel, and what half floats round,
//! an even error of one unit in the last place. Where pixels vary by less than that, as in an even sky, all round alike: there half a unit is allowed. `TESSERA_REFERENCES=FOLDER cargo test --release -p tessera-tests --test reference_images -- --ignored` makes them from `s2.exr`, `s2_stderr.exr`
//! and so on in that folder.
//!
//! **The test.** Each scene is rendered with several seeds. Blocks of 16 x 16 pixels, squares of 2 x 2, 4 x 4 and so on of these up to the whole picture, are compared with the reference
//! by Welch's test, two-sided, in each channel. None of all may fail with a probability of 1 % (Sidak). Small blocks tell errors that stand somewhere, large ones errors that are small.
//! Variances are pooled from pixels ([`tessera_tests::seeds::Pictures::mean`]): means of few seeds would tell a variance with 7 degrees of freedom, and at the significance that thousands of
//! comparisons ask for, nothing would be seen any more. What rare bright paths do to that variance shows in its degrees of freedom, after Satterthwaite:
//! where these are few, the variance is taken to be at least that of the reference, for as many samples. It saw those paths, and it samples lights and directions as this renderer does.

use std::{env, fs, path::PathBuf};

use tessera_engine::{output, part::Rect, scene::Scene};
use tessera_tests::{
    jobs,
    seeds::{self, Pictures},
    statistics::{Estimate, SIGNIFICANCE, sidak},
};

const BLOCK: u32 = 16;

/// As many as a variance needs.
const SEEDS: u64 = 8;

/// Where the variance is known with fewer degrees of freedom, all hangs on few pixels that found rare bright paths, as in the shadow of glass, and most likely others were not found.
const FREEDOM: f64 = 1000.0;

/// The mean of the whole may be off by this share, and by so many of its own standard errors.
const ALLOWANCE: f64 = 1e-3;
const DEVIATIONS: f64 = 4.0;

/// A scene with a reference.
struct Case {
    name: &'static str,
    script: &'static str,
    size: [u32; 2],
    samples: u64,
    /// Those of the reference.
    reference_samples: u64,
    /// Where the reference is known to be wrong, and by which share at the most.
    biased: Option<(Rect, f64)>,
}

const S2: Case = Case { name: "s2", script: "s2_cornell.lua", size: [512, 512], samples: 16, reference_samples: 4224, biased: None };

/// The reference computes in single precision, and starts rays 2.5e-4 off the surface, where the knot's triangles are 5e-3 wide: it misses part of what they hide from each other. With rays that start
/// there, this renderer shows the same picture; as it is, the knot is 0.1 % (red) to 0.6 % (blue) darker.
const S3: Case = Case {
    name: "s3",
    script: "s3_mesh_env.lua",
    size: [960, 540],
    samples: 4,
    reference_samples: 1808,
    biased: Some((Rect { x: 144, y: 96, width: 672, height: 352 }, 0.008)),
};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

impl Case {
    fn scene(&self) -> Scene {
        jobs::scene(&format!("reference/{}", self.script))
    }

    fn table(&self) -> PathBuf {
        root().join("data").join(format!("{}.blocks", self.name))
    }

    fn columns(&self) -> u32 {
        self.size[0].div_ceil(BLOCK)
    }

    fn rows(&self) -> u32 {
        self.size[1].div_ceil(BLOCK)
    }

    /// The pixels of a square of `side` x `side` blocks.
    fn rect(&self, column: u32, row: u32, side: u32) -> Rect {
        let (x, y) = (column * BLOCK, row * BLOCK);
        let [width, height] = self.size;
        Rect { x, y, width: (side * BLOCK).min(width - x), height: (side * BLOCK).min(height - y) }
    }

    /// All squares of blocks: column, row, side.
    fn squares(&self) -> Vec<[u32; 3]> {
        let mut squares = Vec::new();
        let mut side = 1;
        loop {
            for row in (0..self.rows()).step_by(side as usize) {
                squares.extend((0..self.columns()).step_by(side as usize).map(|column| [column, row, side]));
            }
            if side >= self.columns().max(self.rows()) {
                return squares;
            }
            side *= 2;
        }
    }
}

/// What is known of the reference: mean and variance of each block in each channel.
struct Reference<'c> {
    case: &'c Case,
    /// Mean, its variance, and what is allowed for rounding, channel by channel, block by block.
    numbers: Vec<f64>,
}

impl<'c> Reference<'c> {
    fn read(case: &'c Case) -> Self {
        let bytes = fs::read(case.table()).unwrap();
        let (numbers, rest) = bytes.as_chunks::<4>();
        let numbers: Vec<_> = numbers.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes))).collect();
        assert!(rest.is_empty() && numbers.len() == (case.columns() * case.rows() * 9) as usize, "not the table of this scene");
        Self { case, numbers }
    }

    /// Mean, and what is allowed beyond its variance.
    fn block(&self, column: u32, row: u32, channel: usize) -> (Estimate, f64) {
        let at = (row * self.case.columns() + column) as usize * 9 + channel * 3;
        let [mean, variance, mut rounding] = [0, 1, 2].map(|k| self.numbers[at + k]);
        if let Some((rect, share)) = self.case.biased
            && (rect.x..rect.x + rect.width).contains(&(column * BLOCK))
            && (rect.y..rect.y + rect.height).contains(&(row * BLOCK))
        {
            rounding += share * mean;
        }
        (Estimate::known(mean, variance), rounding)
    }

    /// The same over a square of blocks; those at the border weigh less.
    fn mean(&self, [column, row, side]: [u32; 3], channel: usize) -> (Estimate, f64) {
        let area = |column, row, side| self.case.rect(column, row, side).area() as f64;
        let rows = row..(row + side).min(self.case.rows());
        let blocks: Vec<_> = rows
            .flat_map(|row| (column..(column + side).min(self.case.columns())).map(move |column| (column, row)))
            .map(|(column, row)| {
                let ((mean, rounding), share) = (self.block(column, row, channel), area(column, row, 1));
                (mean.scaled(share), rounding * share)
            })
            .collect();
        let whole = 1.0 / area(column, row, side);
        (Estimate::sum(blocks.iter().map(|block| block.0)).scaled(whole), blocks.iter().map(|block| block.1).sum::<f64>() * whole)
    }
}

fn compare(case: &Case) {
    let mut scene = case.scene();
    assert_eq!([scene.film.width, scene.film.height], case.size);
    let pictures = seeds::pictures(&mut scene, 0..SEEDS, case.samples);
    let reference = Reference::read(case);
    let squares = case.squares();
    whole(&pictures, &reference, *squares.last().unwrap());
    let significance = sidak(SIGNIFICANCE, 3 * squares.len());
    let mut found: Vec<_> = squares
        .iter()
        .flat_map(|square| (0..3).map(move |channel| (*square, channel)))
        .map(|(square, channel)| {
            let [column, row, side] = square;
            let mut ours = pictures.mean(case.rect(column, row, side), channel);
            let (mut expected, rounding) = reference.mean(square, channel);
            expected.mean += (ours.mean - expected.mean).clamp(-rounding, rounding);
            let as_noisy = expected.variance * case.reference_samples as f64 / (SEEDS * case.samples) as f64;
            if ours.freedom < FREEDOM && ours.variance < as_noisy {
                (ours.variance, ours.freedom) = (as_noisy, f64::INFINITY);
            }
            let (deviations, probability) = ours.compared(expected);
            (probability, deviations, square, channel, ours, expected)
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (probability, deviations, [column, row, side], channel, ours, expected) in &found[..8] {
        println!(
            "p {probability:.2e}, {deviations:+.2} standard errors at block ({column}, {row}) of side {side}, channel {channel}: {:.6} is {:.6}, freedom {:.0}",
            ours.mean, expected.mean, ours.freedom
        );
    }
    let failed = found.iter().filter(|found| found.0 < significance).count();
    println!("{}: {} comparisons, {failed} below the significance {significance:.2e}", case.name, found.len());
    assert_eq!(failed, 0, "blocks differ from the reference");
}

/// The mean of the whole picture.
fn whole(pictures: &Pictures, reference: &Reference, square: [u32; 3]) {
    for (channel, ours) in pictures.all().into_iter().enumerate() {
        let (expected, _) = reference.mean(square, channel);
        let ratio = ours.mean / expected.mean;
        let error = (ours.variance + expected.variance).sqrt() / expected.mean;
        println!(
            "channel {channel}: {:.6}, {:+.3} % of the reference's mean, standard error {:.3} %",
            ours.mean,
            100.0 * (ratio - 1.0),
            100.0 * error
        );
        assert!((ratio - 1.0).abs() <= ALLOWANCE + DEVIATIONS * error, "channel {channel}: {ratio} times the reference");
    }
}

#[test]
fn a_room_with_glass_and_a_mirror_is_that_of_another_renderer() {
    compare(&S2);
}

#[test]
fn a_metal_knot_under_an_even_sky_is_that_of_another_renderer() {
    compare(&S3);
}

/// Writes the tables anew.
#[test]
#[ignore = "makes the tables that the others read"]
fn make_tables() {
    let folder = PathBuf::from(env::var_os("TESSERA_REFERENCES").expect("the folder of the reference pictures"));
    for case in [S2, S3] {
        let read = |name: String| output::exr::read(&folder.join(name)).unwrap().film;
        let (means, errors) = (read(format!("{}.exr", case.name)), read(format!("{}_stderr.exr", case.name)));
        let mut bytes = Vec::new();
        for row in 0..case.rows() {
            for column in 0..case.columns() {
                for channel in 0..3 {
                    let rect = case.rect(column, row, 1);
                    let pixel = |x: u32, y: u32| {
                        let at = (y * case.size[0] + x) as usize;
                        let (mean, error) = (f64::from(means.pixels()[at][channel]), f64::from(errors.pixels()[at][channel]));
                        let unit = unit(mean);
                        let alike = error < unit;
                        let variance = error * error + if alike { 0.0 } else { unit * unit / 12.0 };
                        (Estimate::known(mean, variance), if alike { 0.5 * unit } else { 0.0 })
                    };
                    let pixels = (rect.y..rect.y + rect.height).flat_map(|y| (rect.x..rect.x + rect.width).map(move |x| (x, y)));
                    let pixels: Vec<_> = pixels.map(|(x, y)| pixel(x, y)).collect();
                    let share = 1.0 / rect.area() as f64;
                    let block = Estimate::sum(pixels.iter().map(|pixel| pixel.0)).scaled(share);
                    let rounding = pixels.iter().map(|pixel| pixel.1).sum::<f64>() * share;
                    bytes.extend([block.mean, block.variance, rounding].into_iter().flat_map(|number| (number as f32).to_le_bytes()));
                }
            }
        }
        fs::create_dir_all(root().join("data")).unwrap();
        fs::write(case.table(), bytes).unwrap();
    }
}

/// The unit in the last place of a half float: it has 11 binary digits, and none beyond 2^-24.
fn unit(value: f64) -> f64 {
    (value.abs().max(f64::MIN_POSITIVE).log2().floor() - 10.0).max(-24.0).exp2()
}
