//! What the farm costs: two nodes of one lane against two threads of one process, the same job, wall time from start to finished files.
//!
//! `cargo bench -p tessera-tests --bench overhead` prints the medians and their ratio; goal: 1.02. Runs take turns, so that a machine
//! whose speed drifts is fair to both.

use std::{
    path::Path,
    process::{Command, Stdio},
    time::Instant,
};

const PAIRS: usize = 5;

/// Seconds of one run, from the start of the process to its end.
fn seconds(workers: &[&str], folder: &Path) -> f64 {
    let job = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/overhead.lua");
    let start = Instant::now();
    let status = Command::new(env!("CARGO_BIN_EXE_tessera-under-test"))
        .arg("render")
        .arg(job)
        .args(workers)
        .arg("-o")
        .arg(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    assert!(status.is_ok_and(|status| status.success()), "the job failed");
    start.elapsed().as_secs_f64()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() -> std::io::Result<()> {
    let folder = tempfile::tempdir()?;
    let (mut farm, mut threads, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for pair in 0..PAIRS {
        threads.push(seconds(&["--threads", "2"], &folder.path().join("threads")));
        farm.push(seconds(&["--nodes", "2", "--lanes", "1"], &folder.path().join("farm")));
        ratios.push(farm[pair] / threads[pair]);
        println!("two threads {:.2} s, two nodes {:.2} s, ratio {:.4}", threads[pair], farm[pair], ratios[pair]);
    }
    println!("two threads {:.2} s, two nodes {:.2} s, ratio {:.4} (medians of {PAIRS})", median(threads), median(farm), median(ratios));
    Ok(())
}
