//! What scenes gain by not computing what they do not ask for: `cargo bench -p tessera-tests --bench shortcuts`.
//!
//! Renders parts from all over a picture on one thread, with and without each shortcut that the scene takes, in turns, because a machine's speed drifts, and prints the median of the
//! ratios of their times. A shortcut that gains nothing anywhere has no reason to be there. Names of scripts as arguments leave the others out.

use std::{sync::atomic::AtomicBool, time::Instant};

use tessera_engine::{
    part::{self, Rect, SampleRange},
    scene::{Scene, Shortcut},
};
use tessera_tests::jobs;

const SCRIPTS: [&str; 7] = [
    "reference/s1_whitted.lua",
    "reference/s2_cornell.lua",
    "reference/s3_mesh_env.lua",
    "still_life.lua",
    "interior.lua",
    "city.lua",
    "turntable.lua",
];

/// Turns of each comparison.
const TURNS: usize = 15;

/// Seconds that one rendering should take: long against what a clock and other programs disturb.
const SECONDS: f64 = 0.3;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let named = |script: &&str| arguments.iter().any(|argument| argument == script);
    let all = !SCRIPTS.iter().any(&named);
    println!("{:28}{:24}{:>8}", "script", "shortcut", "gain");
    for script in SCRIPTS.iter().filter(|script| all || named(script)) {
        let shortcuts: Vec<_> = Shortcut::ALL.into_iter().filter(|shortcut| jobs::scene(script).takes(*shortcut)).collect();
        for shortcut in shortcuts {
            let (with, mut without) = (jobs::scene(script), jobs::scene(script));
            without.close(shortcut);
            println!("{script:28}{:24}{:+7.1} %", shortcut.name(), 100.0 * (gain(&with, &without) - 1.0));
        }
    }
}

/// How many times as long the second scene takes.
fn gain(with: &Scene, without: &Scene) -> f64 {
    let once = seconds(with, 1);
    let samples = ((SECONDS / once).ceil() as u64).max(1);
    let mut ratios: Vec<f64> = (0..TURNS)
        .map(|turn| {
            // Whoever comes first finds memory in another state.
            let first = if turn % 2 == 0 { seconds(with, samples) } else { 0.0 };
            let other = seconds(without, samples);
            other / if turn % 2 == 0 { first } else { seconds(with, samples) }
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    ratios[TURNS / 2]
}

/// Of so many samples in each pixel of some parts.
fn seconds(scene: &Scene, samples: u64) -> f64 {
    let (width, height) = (scene.film.width, scene.film.height);
    let start = Instant::now();
    for i in 0..16 {
        let rect = Rect { x: i % 4 * (width / 4) + width / 8, y: i / 4 * (height / 4) + height / 8, width: 32, height: 32 };
        let part = part::render(scene, rect, SampleRange { first: 0, count: samples }, &AtomicBool::new(false));
        std::hint::black_box(part).expect("nobody cancels");
    }
    start.elapsed().as_secs_f64()
}
