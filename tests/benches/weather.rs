//! What a bad network costs: a job on two nodes of one lane, each behind a relay that loses, delays, doubles, damages and reorders packets.
//!
//! `cargo bench -p tessera-tests --bench weather` prints what each weather adds to a fine network's makespan; goal: 3 %. A makespan counts in
//! seconds of rendering (lanes x makespan / sum of the parts' seconds), so that a machine whose speed drifts is fair to all. `-- SAMPLES` makes
//! the job longer or shorter, for what a way to the coordinator and back costs is the same for all jobs; `-- WEATHER` leaves the others out.

use std::time::Duration;

use tessera_tests::{
    farm::JOB,
    relay::Weather,
    rig::{Rig, attempts, events},
};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

const NODES: [&str; 2] = ["attic", "cellar"];

/// Half a minute on two lanes.
const SAMPLES: u32 = 3000;

const TURNS: u64 = 3;

fn weathers() -> [(&'static str, Weather); 6] {
    let fine = Weather::default();
    let jitter = Duration::from_millis(200);
    [
        ("fine", fine),
        ("5 % loss", Weather { loss: 0.05, ..fine }),
        ("200 ms jitter", Weather { jitter, ..fine }),
        ("reordering", Weather { reorder: 0.2, ..fine }),
        ("duplicates", Weather { duplicates: 0.3, ..fine }),
        ("all of it", Weather { loss: 0.05, jitter, reorder: 0.1, duplicates: 0.1, damage: 0.02, ..fine }),
    ]
}

/// What came of a run.
struct Run {
    /// The makespan in seconds of rendering.
    cost: f64,
    /// In seconds.
    makespan: f64,
    suspicions: usize,
    exr: Vec<u8>,
}

fn run(samples: u32, seed: u64, weather: Weather) -> Run {
    let mut rig = Rig::new(BINARY, &NODES, seed);
    NODES.iter().for_each(|name| rig.relay(name).set_both(weather));
    NODES.iter().for_each(|name| rig.start(name));
    rig.wait_until_ready(&NODES);
    // What a probe gets wrong on a noisy machine would hide what is looked for: nobody waits for it under this policy.
    let job = JOB.replace("tessera.assign.paper", "tessera.assign.earliest_finish");
    std::fs::write(rig.program.path("job.lua"), job).expect("the job is written");
    let submitted = rig.client(&["submit", "job.lua", "--min-nodes", "2", "--set", &format!("samples={samples}")]);
    let outcome = rig.outcome(&submitted.lines[0]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.errors);
    let seconds: f64 = attempts(&outcome.manifest).iter().filter_map(|attempt| attempt["seconds"].as_f64()).sum();
    let makespan = outcome.manifest["report"]["makespan"].as_f64().expect("a makespan");
    Run {
        cost: NODES.len() as f64 * makespan / seconds,
        makespan,
        suspicions: events(&outcome.manifest, "suspected").len(),
        exr: std::fs::read(&outcome.exr).expect("a picture"),
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let samples = arguments.iter().find_map(|argument| argument.parse().ok()).unwrap_or(SAMPLES);
    let named = |name: &str| arguments.iter().any(|argument| argument == name);
    let all = !weathers().iter().any(|(name, _)| named(name));
    let mut costs = weathers().map(|_| Vec::new());
    let mut picture = None;
    for turn in 0..TURNS {
        for (index, (name, weather)) in weathers().into_iter().enumerate().filter(|(index, (name, _))| *index == 0 || all || named(name)) {
            let run = run(samples, turn * 10 + index as u64, weather);
            println!("{name:<14} {:.4} of the rendering's seconds, {:.1} s, {} suspicions", run.cost, run.makespan, run.suspicions);
            costs[index].push(run.cost);
            assert!(*picture.get_or_insert_with(|| run.exr.clone()) == run.exr, "the picture differs");
        }
    }
    let fine = median(costs[0].clone());
    for ((name, _), costs) in weathers().into_iter().zip(costs).filter(|(_, costs)| !costs.is_empty()) {
        println!("{name:<14} x {:.4} (medians of {TURNS})", median(costs) / fine);
    }
}
