//! A case's rays: over all cores, the same in every run, with whatever failed.

use std::{
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
    time::Instant,
};

use glam::DVec3;
use tessera_engine::shape::Ray;

/// Rays that are made and traced together.
pub const CHUNK: u64 = 2048;

/// Failures of which every chunk keeps the replay.
const REPLAYS: usize = 3;

/// What came of a case.
#[derive(Default)]
pub struct Tally {
    /// Rays, or whatever else was checked.
    pub rays: u64,
    /// Those that failed.
    pub failures: u64,
    /// The first failures, in the order of the chunks.
    pub replays: Vec<(u64, String)>,
}

impl Tally {
    /// Counts a ray; `replay` tells how to repeat it.
    pub fn check(&mut self, holds: bool, replay: impl FnOnce() -> String) {
        self.rays += 1;
        if !holds {
            self.failures += 1;
            if self.replays.len() < REPLAYS {
                self.replays.push((0, replay()));
            }
        }
    }

    fn add(&mut self, chunk: u64, other: Self) {
        self.rays += other.rays;
        self.failures += other.failures;
        self.replays.extend(other.replays.into_iter().map(|(_, replay)| (chunk, replay)));
        self.replays.sort_by_key(|(chunk, _)| *chunk);
        self.replays.truncate(REPLAYS);
    }
}

/// Runs a case on so many rays: `chunk` is given numbers of its own and how many rays to check.
pub fn run(rays: u64, chunk: impl Fn(&mut Random, u64, &mut Tally) + Sync) -> Tally {
    let (next, total) = (AtomicU64::new(0), Mutex::new(Tally::default()));
    let begin = Instant::now();
    let worker = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let first = number * CHUNK;
            if first >= rays {
                return;
            }
            let mut tally = Tally::default();
            chunk(&mut Random::new(number), CHUNK.min(rays - first), &mut tally);
            // A panic elsewhere ends the program anyway.
            let Ok(mut total) = total.lock() else { return };
            total.add(number, tally);
            tell(&total, rays, begin);
        }
    };
    std::thread::scope(|scope| {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        (0..threads).for_each(|_| _ = scope.spawn(worker));
    });
    total.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn tell(total: &Tally, rays: u64, begin: Instant) {
    if (total.rays / CHUNK).is_multiple_of(512) {
        eprint!(
            "\r{:.1e} of {:.1e} rays, {} failures, {:.0} s \r",
            total.rays as f64,
            rays as f64,
            total.failures,
            begin.elapsed().as_secs_f64()
        );
    }
}

/// A ray in the bits of its numbers: origin, direction, `t_max`.
pub fn bits(ray: &Ray) -> String {
    let of = |v: DVec3| v.to_array().map(|x| format!("{:#018x}", x.to_bits())).join(" ");
    format!("ray [{}] [{}] {:#018x}", of(ray.origin), of(ray.direction), ray.t_max.to_bits())
}

/// Numbers that are random enough, the same in every run (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014).
pub struct Random(u64);

impl Random {
    /// A sequence of its own for every number.
    pub fn new(number: u64) -> Self {
        let mut mixed = Self(number ^ 0x5851_f42d_4c95_7f2d);
        Self(mixed.bits())
    }

    /// 64 of them.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (f64::EPSILON / 2.0)
    }

    /// In [-1, 1).
    pub fn signed(&mut self) -> f64 {
        self.unit() * 2.0 - 1.0
    }

    /// A power of ten with an exponent between these.
    pub fn power(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(low + (high - low) * self.unit())
    }

    /// In the cube of half side 1 about 0.
    pub fn point(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }

    /// A unit vector.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let p = self.point();
            if (1e-6..1.0).contains(&p.length_squared()) {
                return p.normalize();
            }
        }
    }
}
