//! Pictures rendered several times, each time with other samples, on all processors.

use std::{
    ops::Range,
    sync::{Mutex, atomic::AtomicBool},
    thread,
};

use glam::DVec3;
use tessera_engine::{
    part::{self, Rect, RenderedPart, SampleRange},
    scene::Scene,
};

use crate::statistics::Estimate;

/// Rows that are rendered at once.
const ROWS: u32 = 8;

/// Sums over the pictures of several seeds, pixel by pixel: of their colours, of these squared, and of these cubed.
#[derive(Clone, Debug)]
pub struct Pictures {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// How many there are.
    pub count: u32,
    sums: Vec<[DVec3; 3]>,
}

/// One picture, with this many samples in each pixel. A fault may show as samples that are invalid, so there must be none.
pub fn picture(scene: &Scene, samples: SampleRange) -> Vec<[f32; 3]> {
    let (width, height) = (scene.film.width, scene.film.height);
    let mut pixels = vec![[0.0; 3]; width as usize * height as usize];
    let bands = Mutex::new(pixels.chunks_mut((width * ROWS) as usize).zip(0..));
    let work = || {
        loop {
            let Some((band, index)) = bands.lock().expect("nobody panicked").next() else { return };
            let y = index * ROWS;
            let rect = Rect { x: 0, y, width, height: ROWS.min(height - y) };
            let RenderedPart { pixels, counters, .. } =
                part::render(scene, rect, samples, &AtomicBool::new(false)).expect("nobody cancels it");
            assert_eq!(counters.invalid_samples, 0, "samples are invalid");
            band.copy_from_slice(&pixels);
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    pixels
}

/// Renders one picture a seed, with this many samples in each pixel.
pub fn pictures(scene: &mut Scene, seeds: Range<u64>, samples: u64) -> Pictures {
    let (width, height, count) = (scene.film.width, scene.film.height, (seeds.end - seeds.start) as u32);
    let mut sums = vec![[DVec3::ZERO; 3]; width as usize * height as usize];
    for seed in seeds {
        scene.seed = seed;
        for (sums, pixel) in sums.iter_mut().zip(picture(scene, SampleRange { first: 0, count: samples })) {
            let pixel = DVec3::from(pixel.map(f64::from));
            sums[0] += pixel;
            sums[1] += pixel * pixel;
            sums[2] += pixel * pixel * pixel;
        }
    }
    Pictures { width, height, count, sums }
}

impl Pictures {
    /// The mean of a rectangle's pixels in one channel, over all pictures.
    ///
    /// Its variance is that of each pixel over the pictures, added up: pixels are sampled independently of each other. So it is known with up to `pixels * (pictures - 1)` degrees of
    /// freedom, where the variance of the rectangle's own means would have `pictures - 1`; and where few pixels matter, those with rare bright samples, with as few as these give.
    pub fn mean(&self, rect: Rect, channel: usize) -> Estimate {
        let count = f64::from(self.count);
        let pixels = (rect.y..rect.y + rect.height).flat_map(|y| (rect.x..rect.x + rect.width).map(move |x| (x, y)));
        let of_pixel = |(x, y): (u32, u32)| {
            let [sum, squares, cubes] = self.sums[y as usize * self.width as usize + x as usize].map(|sum| sum[channel]);
            let mean = sum / count;
            let squares_about = (squares - sum * mean).max(0.0);
            Estimate::of_sums(count, mean, squares_about, cubes - 3.0 * mean * squares + 2.0 * sum * mean * mean)
        };
        Estimate::sum(pixels.map(of_pixel)).scaled(1.0 / rect.area() as f64)
    }

    /// The same of the whole picture, for all channels.
    pub fn all(&self) -> [Estimate; 3] {
        let rect = Rect { x: 0, y: 0, width: self.width, height: self.height };
        [0, 1, 2].map(|channel| self.mean(rect, channel))
    }
}
