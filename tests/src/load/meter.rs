//! What a process takes of its machine, as Linux tells in `/proc`.

use std::{collections::BTreeMap, fs, time::Instant};

/// Ticks of the kernel's clock in a second, the same on every Linux (`USER_HZ`).
const TICKS: f64 = 100.0;

/// Reads what a process took between two looks.
pub struct Meter {
    pid: i32,
    since: Instant,
    ticks: BTreeMap<String, f64>,
}

/// What a process took between two looks.
#[derive(Clone, Debug)]
pub struct Usage {
    /// Seconds between them.
    pub seconds: f64,
    /// Cores that it kept busy.
    pub cores: f64,
    /// The same by the names of its threads, the busiest first.
    pub threads: Vec<(String, f64)>,
    /// The most memory that it ever had, in bytes.
    pub peak_bytes: u64,
}

impl Meter {
    /// Looks at a process for the first time.
    pub fn new(pid: i32) -> Self {
        Self { pid, since: Instant::now(), ticks: ticks(pid) }
    }

    /// What it took since the last look.
    pub fn look(&mut self) -> Usage {
        let before = std::mem::replace(self, Self::new(self.pid));
        let seconds = (self.since - before.since).as_secs_f64();
        let cores = |(name, now): (&String, &f64)| (name.clone(), (now - before.ticks.get(name).unwrap_or(&0.0)) / TICKS / seconds);
        let mut threads: Vec<(String, f64)> = self.ticks.iter().map(cores).filter(|(_, cores)| *cores > 0.005).collect();
        threads.sort_by(|a, b| b.1.total_cmp(&a.1));
        Usage { seconds, cores: threads.iter().map(|(_, cores)| cores).sum(), threads, peak_bytes: peak(self.pid) }
    }
}

/// Ticks of all threads of a process that live, summed by name.
fn ticks(pid: i32) -> BTreeMap<String, f64> {
    let mut all = BTreeMap::new();
    for thread in fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten() {
        let Ok(line) = fs::read_to_string(thread.path().join("stat")) else { continue };
        // The name stands in parentheses and may hold anything (proc_pid_stat(5)); user and system time are the 14th and 15th field.
        let Some(((_, name), rest)) = line.rsplit_once(')').and_then(|(head, rest)| Some((head.split_once('(')?, rest))) else { continue };
        let field = |at: usize| rest.split_whitespace().nth(at - 3).and_then(|field| field.parse().ok()).unwrap_or(0.0);
        *all.entry(name.to_owned()).or_insert(0.0) += field(14) + field(15);
    }
    all
}

fn peak(pid: i32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()).unwrap_or(0) * 1024
}
