//! A farm of real processes under random faults for a while: job after job, and in the end every picture is that of an undisturbed run.
//!
//! The faults follow from a seed, which is printed. `TESSERA_CHAOS_SECONDS` says how long (hours, if you like), `TESSERA_CHAOS_SEED` repeats a
//! seed. A campaign that fails keeps its folder, with the logs of all processes.

use std::{
    collections::BTreeMap,
    fs,
    str::FromStr,
    thread,
    time::{Duration, Instant, SystemTime},
};

use rustix::process::Signal;
use serde_json::Value;
use tessera_node::simulate::Random;
use tessera_tests::{
    farm::{Finished, JOB, Program},
    relay::{BLOCKED, Way, Weather},
    rig::{Rig, assert_once, attempts, events, list, wait_until},
};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

/// Nodes with their lanes.
const NODES: [(&str, u32); 4] = [("attic", 1), ("barn", 1), ("cellar", 2), ("dairy", 3)];

/// Jobs that wait or run at once.
const OPEN_JOBS: usize = 3;

/// Faults at once: each leaves some of the farm to work.
const FAULTS: usize = 3;

const SAMPLES: [u32; 3] = [8, 24, 64];

fn setting<T: FromStr>(name: &str, otherwise: impl FnOnce() -> T) -> T {
    match std::env::var(name) {
        Ok(value) => value.parse().unwrap_or_else(|_| panic!("{name} is not a number: {value}")),
        Err(_) => otherwise(),
    }
}

fn clock() -> u64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_millis() as u64)
}

/// What hurts the farm, until it is mended.
#[derive(Clone, Debug)]
enum Fault {
    Killed(String),
    Stopped(String),
    Led,
    Partitioned(String, Option<Way>),
    Weather(String, Weather),
    Rebound(String),
}

impl Fault {
    fn kind(&self) -> &'static str {
        match self {
            Self::Killed(_) => "nodes killed",
            Self::Stopped(_) => "nodes stopped",
            Self::Led => "coordinators killed",
            Self::Partitioned(_, None) => "partitions",
            Self::Partitioned(_, Some(_)) => "one-way partitions",
            Self::Weather(..) => "bad networks",
            Self::Rebound(_) => "changed addresses",
        }
    }

    /// Two faults of one node would mend each other.
    fn subject(&self) -> &str {
        match self {
            Self::Killed(name) | Self::Stopped(name) | Self::Partitioned(name, _) | Self::Weather(name, _) | Self::Rebound(name) => name,
            Self::Led => "coordinator",
        }
    }
}

struct Campaign {
    rig: Rig,
    random: Random,
    faults: Vec<(Instant, Fault)>,
    happened: BTreeMap<&'static str, u32>,
}

impl Campaign {
    fn new(seed: u64) -> Self {
        let names = NODES.map(|(name, _)| name);
        let mut rig = Rig::new(BINARY, &names, seed);
        fs::write(rig.program.path("other.lua"), other_job()).unwrap();
        NODES.iter().for_each(|(name, lanes)| rig.start_with_lanes(name, *lanes));
        rig.wait_until_ready(&names);
        Self { rig, random: Random::new(seed), faults: Vec::new(), happened: BTreeMap::new() }
    }

    /// A fault, and how long it lasts.
    fn draw(&mut self) -> (Fault, Duration) {
        let name = NODES[self.random.below(4) as usize].0.to_owned();
        let random = &mut self.random;
        match random.below(8) {
            0 => (Fault::Killed(name), random.seconds(0.0, 2.0)),
            1 => (Fault::Stopped(name), random.seconds(0.05, 2.5)),
            2 => (Fault::Led, random.seconds(0.0, 1.0)),
            3 => (Fault::Partitioned(name, None), random.seconds(0.1, 5.0)),
            4 => (Fault::Partitioned(name, Some(if random.happens(0.5) { Way::Up } else { Way::Down })), random.seconds(0.1, 5.0)),
            5 => (Fault::Rebound(name), Duration::ZERO),
            _ => {
                let weather = Weather {
                    loss: random.between(0.0, 0.1),
                    duplicates: random.between(0.0, 0.2),
                    damage: random.between(0.0, 0.05),
                    reorder: random.between(0.0, 0.2),
                    jitter: random.seconds(0.0, 0.1),
                    blocked: false,
                };
                (Fault::Weather(name, weather), random.seconds(0.5, 4.0))
            }
        }
    }

    fn hurt(&mut self) {
        let (fault, lasts) = self.draw();
        if self.faults.len() >= FAULTS || self.faults.iter().any(|(_, other)| other.subject() == fault.subject()) {
            return;
        }
        *self.happened.entry(fault.kind()).or_default() += 1;
        match &fault {
            Fault::Killed(name) => self.rig.kill(name),
            Fault::Stopped(name) => self.rig.signal(name, Signal::STOP),
            Fault::Led => self.rig.kill_coordinator(),
            Fault::Partitioned(name, None) => self.rig.relay(name).set_both(BLOCKED),
            Fault::Partitioned(name, Some(way)) => self.rig.relay(name).set(*way, BLOCKED),
            Fault::Weather(name, weather) => self.rig.relay(name).set_both(*weather),
            Fault::Rebound(name) => self.rig.relay(name).rebind(),
        }
        self.faults.push((Instant::now() + lasts, fault));
    }

    fn mend(&mut self, now: Instant) {
        for (due, fault) in std::mem::take(&mut self.faults) {
            if due > now {
                self.faults.push((due, fault));
                continue;
            }
            match &fault {
                Fault::Killed(name) => {
                    let lanes = NODES.iter().find(|(known, _)| known == name).map_or(1, |(_, lanes)| *lanes);
                    self.rig.start_with_lanes(name, lanes);
                }
                Fault::Stopped(name) => self.rig.signal(name, Signal::CONT),
                Fault::Led => drop(self.rig.restart_coordinator()),
                Fault::Partitioned(name, _) | Fault::Weather(name, _) => self.rig.relay(name).set_both(Weather::default()),
                Fault::Rebound(_) => {}
            }
        }
    }

    /// Hands in another job where few are open; a coordinator that is away is asked later.
    fn submit(&mut self) {
        let open = self.jobs().iter().filter(|job| !is_over(job)).count();
        if !self.rig.is_led() || open >= OPEN_JOBS {
            return;
        }
        let script = if self.random.happens(0.5) { "job.lua" } else { "other.lua" };
        let samples = format!("samples={}", SAMPLES[self.random.below(3) as usize]);
        let audit = format!("audit={}", f64::from(self.random.below(3)) / 10.0);
        let submitted = self.rig.client(&["submit", script, "--set", &samples, "--set", &audit]);
        assert_eq!(submitted.code, Some(0), "{}", submitted.errors);
    }

    /// All jobs that the coordinator keeps, if it is there.
    fn jobs(&mut self) -> Vec<Value> {
        if !self.rig.is_led() {
            return Vec::new();
        }
        let listed: Finished = self.rig.client(&["list", "--json"]);
        assert_eq!(listed.code, Some(0), "{}", listed.errors);
        list(&serde_json::from_str(&listed.lines.concat()).unwrap())
    }

    fn run(&mut self, length: Duration) {
        let end = Instant::now() + length;
        while Instant::now() < end {
            self.submit();
            self.hurt();
            thread::sleep(self.random.seconds(0.05, 0.6));
            self.mend(Instant::now());
        }
        self.mend(end + Duration::from_secs(3600));
    }
}

fn is_over(job: &Value) -> bool {
    job["state"] == "finished" || job["state"].is_object()
}

/// Another picture, cut and dealt out otherwise.
fn other_job() -> String {
    JOB.replace("max_depth = 8", "max_depth = 3").replace("assign.paper", "assign.earliest_finish").replace("size = 32", "size = 24")
}

/// The pictures of undisturbed runs, by script and samples.
#[derive(Default)]
struct Undisturbed(BTreeMap<(String, String), Vec<u8>>);

impl Undisturbed {
    fn of(&mut self, manifest: &Value) -> &[u8] {
        let text = |value: &Value| value.as_str().unwrap().to_owned();
        let key = (text(&manifest["job"]["name"]), text(&manifest["job"]["parameters"]["samples"]));
        self.0.entry(key).or_insert_with_key(|(name, samples)| {
            let program = Program::new(BINARY);
            fs::write(program.path("other.lua"), other_job()).unwrap();
            let (script, set) = (format!("{name}.lua"), format!("samples={samples}"));
            let finished = program.run(&["render", &script, "--threads", "1", "--set", &set, "-o", "out"]);
            assert_eq!(finished.code, Some(0), "{}", finished.errors);
            fs::read(program.path("out/job.exr")).unwrap()
        })
    }
}

/// From a list of seconds: least, median, 99 of 100, most.
fn distribution(mut seconds: Vec<f64>) -> String {
    seconds.sort_by(f64::total_cmp);
    let Some(last) = seconds.len().checked_sub(1) else { return "none".to_owned() };
    let at = |share: f64| seconds[(share * last as f64).ceil() as usize];
    format!("{} times; least {:.3} s, median {:.3} s, 99 of 100 {:.3} s, most {:.3} s", seconds.len(), at(0.0), at(0.5), at(0.99), at(1.0))
}

fn silence(event: &Value) -> Option<f64> {
    event["detail"].as_str()?.strip_prefix("silent for ")?.strip_suffix(" s")?.parse().ok()
}

#[test]
fn whatever_happens_every_picture_is_that_of_an_undisturbed_run() {
    let seconds = setting("TESSERA_CHAOS_SECONDS", || 20.0);
    let seed = setting("TESSERA_CHAOS_SEED", clock);
    println!("{seconds} s of faults; repeat them: TESSERA_CHAOS_SEED={seed} cargo test --release -p tessera-tests --test campaign");
    let mut campaign = Campaign::new(seed);
    campaign.run(Duration::from_secs_f64(seconds));
    println!("faults: {:?}", campaign.happened);
    wait_until("all jobs are over", || campaign.jobs().iter().all(is_over));
    let (mut undisturbed, mut silences, mut parts, mut tries) = (Undisturbed::default(), Vec::new(), 0, 0);
    let jobs = campaign.jobs();
    assert!(!jobs.is_empty());
    for job in &jobs {
        let number = job["job"].to_string();
        let outcome = campaign.rig.outcome(&number);
        assert_eq!(outcome.code, Some(0), "seed {seed}, job {number}: {}", outcome.errors);
        assert_once(&outcome.manifest);
        let same = fs::read(&outcome.exr).unwrap() == undisturbed.of(&outcome.manifest);
        assert!(same, "seed {seed}, job {number}: the EXR's bytes differ from those of an undisturbed run");
        silences.extend(events(&outcome.manifest, "suspected").iter().filter_map(silence));
        parts += list(&outcome.manifest["parts"]).len();
        tries += attempts(&outcome.manifest).len();
    }
    println!("{} jobs, {parts} parts, {tries} attempts: all pictures are as they should be, each part once", jobs.len());
    println!("silence at suspicion: {}", distribution(silences));
}
