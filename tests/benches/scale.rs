//! What one coordinator bears: nodes, heartbeats, parts and pixels. The load is [`tessera_tests::load`]; it renders nothing.
//!
//! `cargo bench -p tessera-tests --bench scale` connects 1,000 nodes and gives them a job of 102,400 parts of 64 x 64 pixels, which they deliver at
//! 2,000 a second and then faster and faster, until the coordinator no longer follows. It prints what the coordinator's process took of
//! the machine, by its own account in `/proc`: load and coordinator share the cores, so wall time would tell little. `-- --nodes N`, `--edge PIXELS`,
//! `--rate PARTS` and `--seconds S` (of each measurement) change that. It needs a machine with two cores and nothing else to do: where the load itself
//! is held up, nodes fall silent, and what is measured is how the farm survives that.

use std::{
    net::SocketAddr,
    thread,
    time::{Duration, Instant},
};

use tessera_tests::{
    farm::{Program, Running},
    load::{Fleet, Meter, Usage, quantile},
};

/// Parts a second that one coordinator is to take, if no `--rate` is given, and the goals beside it.
const GOAL: f64 = 2000.0;
const CORES: f64 = 1.0;
const BYTES: f64 = (1_u64 << 30) as f64;

/// Rates beyond the goal, until one is not reached.
const BEYOND: [f64; 5] = [1.5, 2.0, 3.0, 4.0, 6.0];

/// The share of a rate that counts as reaching it.
const REACHED: f64 = 0.95;

fn argument(name: &str, default: f64) -> f64 {
    let mut arguments = std::env::args().skip_while(|argument| argument != name);
    arguments.nth(1).map_or(default, |value| value.parse().unwrap_or_else(|_| panic!("{name} takes a number, not {value:?}")))
}

/// The coordinator and its load.
struct Bench {
    fleet: Fleet,
    meter: Meter,
    own: Meter,
    nodes: usize,
}

/// What a stretch of time brought.
struct Stretch {
    usage: Usage,
    own: f64,
    beats: f64,
    settled: f64,
    waits: Vec<f64>,
    ends: Vec<String>,
}

impl Bench {
    fn measure(&mut self, seconds: f64) -> Stretch {
        self.measure_until(|| thread::sleep(Duration::from_secs_f64(seconds)))
    }

    /// The last parts of the job, when most nodes have nothing left to do: three for each node, or what there is.
    fn tail(&mut self, rate: f64, parts: u64) -> Stretch {
        let tally = self.fleet.tally.clone();
        let left = move |many: u64| tally.settled() + many >= parts;
        wait_until("the job comes to its end", 1800, || left(3 * self.nodes as u64));
        self.ask(rate);
        let stretch = self.measure_until(|| wait_until("all parts are on disk", 300, || left(0)));
        print("the last parts", &stretch);
        stretch
    }

    fn measure_until(&mut self, over: impl FnOnce()) -> Stretch {
        let (beats, settled) = (self.fleet.tally.beats(), self.fleet.tally.settled());
        drop(self.fleet.tally.take_waits());
        self.meter.look();
        self.own.look();
        over();
        let (usage, own) = (self.meter.look(), self.own.look().cores);
        let rate = |now: u64, before: u64| (now - before) as f64 / usage.seconds;
        let (beats, settled) = (rate(self.fleet.tally.beats(), beats), rate(self.fleet.tally.settled(), settled));
        Stretch { own, beats, settled, waits: self.fleet.tally.take_waits(), ends: self.fleet.tally.ends(), usage }
    }

    /// Sets the load to so many parts a second.
    fn ask(&self, rate: f64) {
        self.fleet.tally.set_seconds(self.nodes as f64 / rate);
    }
}

fn print(what: &str, stretch: &Stretch) {
    let Stretch { usage, own, beats, settled, waits, ends } = stretch;
    let milliseconds = |share| quantile(waits, share) * 1e3;
    println!(
        "{what}: {settled:.0} parts/s on disk, {beats:.0} heartbeats/s, {:.2} cores, peak {:.0} MiB, acknowledged after {:.0} ms (p99 {:.0} ms); the load took {own:.2} cores",
        usage.cores,
        usage.peak_bytes as f64 / f64::from(1 << 20),
        milliseconds(0.5),
        milliseconds(0.99)
    );
    if !ends.is_empty() {
        println!("    {} connections ended so far, as: {}", ends.len(), ends[ends.len() - 1]);
    }
    let threads: Vec<String> = usage.threads.iter().take(6).map(|(name, cores)| format!("{name} {cores:.2}")).collect();
    println!("    threads: {}", threads.join(", "));
}

fn wait_until(what: &str, seconds: u64, reached: impl Fn() -> bool) {
    let begin = Instant::now();
    while !reached() {
        assert!(begin.elapsed() < Duration::from_secs(seconds), "it never came to this: {what}");
        thread::sleep(Duration::from_millis(20));
    }
}

fn submit(program: &Program, address: &str, edge: usize) -> Running {
    let script = format!("{}/benches/scale.lua", env!("CARGO_MANIFEST_DIR"));
    let (width, height) = (format!("width={edge}"), format!("height={edge}"));
    program.start(&["submit", &script, "--set", &width, "--set", &height, "--coordinator", address, "--keys", "keys"])
}

fn main() {
    let (nodes, edge) = (argument("--nodes", 1000.0) as usize, argument("--edge", 20_480.0) as usize);
    let (rate, seconds) = (argument("--rate", GOAL), argument("--seconds", 20.0));
    let program = Program::new(env!("CARGO_BIN_EXE_tessera-under-test"));
    program.make_keys("keys", &[]);
    let (coordinator, address) = program.coordinator("keys", &[]);
    let to: SocketAddr = address.parse().expect("an address");
    let begin = Instant::now();
    let fleet = Fleet::start(nodes, &program.path("keys"), to, nodes as f64 / rate);
    let mut bench = Bench { fleet, meter: Meter::new(coordinator.pid()), own: Meter::new(std::process::id() as i32), nodes };
    wait_until("all nodes are connected", 60, || bench.fleet.tally.connected() as f64 >= REACHED * nodes as f64);
    println!("{nodes} nodes connected in {:.1} s", begin.elapsed().as_secs_f64());
    thread::sleep(Duration::from_secs(5));
    let idle = bench.measure(seconds / 2.0);
    print("heartbeats alone", &idle);

    let begin = Instant::now();
    let submitted = submit(&program, &address, edge).finish();
    assert_eq!(submitted.code, Some(0), "{}", submitted.errors);
    wait_until("the first part is on disk", 300, || bench.fleet.tally.settled() > 0);
    println!("{} parts, the first on disk after {:.1} s", edge.div_ceil(64).pow(2), begin.elapsed().as_secs_f64());
    thread::sleep(Duration::from_secs(2));
    let steady = bench.measure(seconds);
    print(&format!("asked for {rate:.0} parts/s"), &steady);
    let mut most = steady.settled;
    for factor in BEYOND {
        bench.ask(rate * factor);
        thread::sleep(Duration::from_secs(1));
        let stretch = bench.measure(seconds / 4.0);
        print(&format!("asked for {:.0} parts/s", rate * factor), &stretch);
        most = most.max(stretch.settled);
        if stretch.settled < REACHED * rate * factor {
            break;
        }
    }
    let tail = bench.tail(rate, edge.div_ceil(64).pow(2) as u64);
    let begin = Instant::now();
    wait_until("the job is over", 1800, || manifest(&program).exists());
    println!("its files: {:.1} s", begin.elapsed().as_secs_f64());
    print("since then", &bench.measure(1.0));
    let end = bench.meter.look();
    println!("\n| what | goal | found | ratio |\n| --- | --- | --- | --- |");
    let row =
        |what: &str, goal: f64, found: f64, unit: &str| println!("| {what} | {goal:.0}{unit} | {found:.2}{unit} | {:.2} |", found / goal);
    row("parts a second on disk", rate, steady.settled, "");
    row("cores at that rate", CORES, steady.usage.cores, "");
    row("cores while the last parts run", CORES, tail.usage.cores, "");
    row("peak memory, files included (MiB)", BYTES / f64::from(1 << 20), end.peak_bytes as f64 / f64::from(1 << 20), "");
    row("most parts a second", rate, most, "");
}

fn manifest(program: &Program) -> std::path::PathBuf {
    program.path("data/jobs/1/files/scale.manifest.json")
}
