//! What a simulation begins with, and what goes wrong in it.

use std::time::Duration;

use tessera_engine::part::Rect;

use super::random::{Random, mix};
use crate::farm::{FarmConfig, JobId, JobSpec};
use crate::schedule::{Assign, Probe, Split};

/// A machine that runs a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Rendering threads.
    pub lanes: u32,
    /// Speed of one of them; 1 does a cost of 1 in a second.
    pub speed: f64,
    /// Times vary by this share, up and down.
    pub jitter: f64,
    /// When it starts.
    pub starts: Duration,
    /// Whether it cannot compile the scene.
    pub incapable: bool,
}

/// How messages travel.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// Shortest and longest delay in seconds.
    pub delay: (f64, f64),
    /// Probability that a datagram is lost.
    pub loss: f64,
    /// Probability that a delivery arrives twice.
    pub duplication: f64,
}

/// What goes wrong, by index of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The process dies without a word.
    Kill(usize),
    /// A process starts there, with a new incarnation; one that still runs dies.
    Start(usize),
    /// The process closes its connection and ends.
    Leave(usize),
    /// The process stands still for so long.
    Pause(usize, Duration),
    /// Nothing passes between the node and the coordinator for so long; then what was sent on streams arrives.
    Partition(usize, Duration),
    /// The same for what is sent to the node.
    Deafen(usize, Duration),
    /// The same for what the node sends.
    Mute(usize, Duration),
    /// The next part that a lane begins makes it hang for ever.
    Hang(usize),
    /// Pixels of the machine are wrong from now on.
    Corrupt(usize),
    /// The pixels of one part cannot be read back when the picture is put together.
    DamagePixels,
    /// The coordinator's process stands still for so long.
    Stall(Duration),
    /// The coordinator's disk takes nothing for so long.
    FullDisk(Duration),
    /// The coordinator's clock jumps forward by so much. (It goes back when the coordinator is started anew: to what its journal tells.)
    JumpClock(Duration),
    /// The machine's clock jumps while it renders its next part: that is taken to last so many seconds.
    JumpNodeClock(usize, f64),
    /// Parts take so many times longer from now on.
    Slow(usize, f64),
    /// The next part that the machine finishes fails instead.
    FailPart(usize),
    /// The coordinator is killed and started anew: what is not on disk is gone, or a part of it; connections are made anew.
    RestartCoordinator,
    /// A user cancels a job.
    Cancel(JobId),
    /// A user lets a job wait.
    PauseJob(JobId),
    /// It goes on.
    ResumeJob(JobId),
    /// A user gives a job another rank.
    Rank(JobId, i32),
    /// The node is told to end: it finishes what its lanes render, for so long at the most, and goes.
    Drain(usize, Duration),
    /// The coordinator is started anew as another build, and so is every node that starts from now on.
    Upgrade,
}

impl Fault {
    /// Whether it is a user who asks the coordinator for something, at an unlucky moment.
    pub fn is_of_user(&self) -> bool {
        matches!(self, Self::Cancel(_) | Self::PauseJob(_) | Self::ResumeJob(_) | Self::Rank(..))
    }
}

/// A place of the frame that no node can render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Poison {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// Whether the process dies of it (and is started again); otherwise it says that it failed.
    pub kills: bool,
}

impl Poison {
    pub(super) fn is_in(self, rect: Rect) -> bool {
        (rect.x..rect.x + rect.width).contains(&self.x) && (rect.y..rect.y + rect.height).contains(&self.y)
    }
}

/// How the job's own policy behaves when parts are redistributed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScriptPolicy {
    /// It answers in time.
    Good,
    /// It answers too late.
    Late,
    /// It never answers.
    Never,
    /// Its plan leaves a part out.
    Wrong,
    /// It fails with a message.
    Fails,
}

/// A simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Chooses everything that is random while it runs.
    pub seed: u64,
    /// The machines.
    pub machines: Vec<Machine>,
    /// The network.
    pub network: Network,
    /// What goes wrong, and when.
    pub faults: Vec<(Duration, Fault)>,
    /// The job: number 1.
    pub job: JobSpec,
    /// Jobs that are submitted later, from number 2 on.
    pub others: Vec<(Duration, JobSpec)>,
    /// What in the frame cannot be rendered.
    pub poison: Option<Poison>,
    /// How the job's own policy behaves.
    pub policy: ScriptPolicy,
    /// True cost of the whole frame: seconds on one lane of speed 1.
    pub work: f64,
    /// How much harder the hardest places are than the mean one.
    pub contrast: f64,
    /// Seconds that a commit takes.
    pub disk: f64,
    /// The farm's timeouts.
    pub config: FarmConfig,
    /// When the simulation ends, whatever is left to do.
    pub horizon: Duration,
}

impl Scenario {
    /// A frame on these lanes of these speeds, with nothing going wrong: the base of a plan.
    pub fn plain(seed: u64, machines: &[(u32, f64)], split: Split, assign: Assign) -> Self {
        let machine =
            |(lanes, speed): &(u32, f64)| Machine { lanes: *lanes, speed: *speed, jitter: 0.02, starts: Duration::ZERO, incapable: false };
        Self {
            seed,
            machines: machines.iter().map(machine).collect(),
            network: Network { delay: (0.0002, 0.001), loss: 0.0, duplication: 0.0 },
            faults: Vec::new(),
            job: JobSpec { split, assign, min_nodes: machines.len() as u32, ..JobSpec::plain("simulated", 1024, 768, 4) },
            others: Vec::new(),
            poison: None,
            policy: ScriptPolicy::Good,
            work: 600.0,
            contrast: 8.0,
            disk: 0.002,
            config: FarmConfig::default(),
            horizon: Duration::from_secs(100_000),
        }
    }

    /// Speeds of so many unequal machines, between 1/2 and 2; a smaller farm has the first of them.
    pub fn speeds(seed: u64, count: usize) -> Vec<f64> {
        let mut random = Random::new(seed);
        (0..count).map(|_| random.between(0.5, 2.0)).collect()
    }

    /// A schedule of faults from a seed, in which at least one machine is left alone (unless everything dies and some come back).
    pub fn chaos(seed: u64) -> Self {
        let mut random = Random::new(mix(seed ^ 0x0074_6573_7365_7261));
        let count = 1 + random.below(6) as usize;
        let machines: Vec<(u32, f64)> = (0..count).map(|_| (1 + random.below(3), random.between(0.5, 2.0))).collect();
        let assign = [Assign::EarliestFinish, Assign::Paper, Assign::Naive, Assign::Script][random.below(4) as usize];
        let mut scenario = Self::plain(seed, &machines, Split::Grid { width: 64, height: 64 }, assign);
        scenario.set_job(&mut random);
        for machine in &mut scenario.machines {
            machine.jitter = random.between(0.0, 0.3);
            machine.starts = if random.happens(0.2) { random.seconds(0.0, 4.0) } else { Duration::ZERO };
            machine.incapable = random.happens(0.04);
        }
        scenario.machines[0].incapable = false;
        let incapable = scenario.machines.iter().filter(|machine| machine.incapable).count() as u32;
        scenario.job.min_nodes = scenario.job.min_nodes.max(incapable + 1); // or a few that cannot end the job before the others come
        let delay = random.between(0.0005, 0.1);
        scenario.network = Network { delay: (delay * 0.2, delay), loss: random.between(0.0, 0.05), duplication: random.between(0.0, 0.2) };
        scenario.disk = random.between(0.0, 0.02);
        scenario.policy = [ScriptPolicy::Good, ScriptPolicy::Late, ScriptPolicy::Never, ScriptPolicy::Wrong, ScriptPolicy::Fails]
            [random.below(5) as usize];
        scenario.work = random.between(0.5, 10.0) * count as f64;
        scenario.horizon = Duration::from_secs(1_000);
        scenario.job.audit = [0.0, 0.0, 0.2, 1.0][random.below(4) as usize];
        if random.happens(0.1) {
            let (x, y) = (random.below(scenario.job.width), random.below(scenario.job.height));
            scenario.poison = Some(Poison { x, y, kills: random.happens(0.5) });
        }
        scenario.add_jobs(&mut random);
        let faults = random.below(7);
        (0..faults).for_each(|_| scenario.add_fault(&mut random));
        scenario
    }

    fn set_job(&mut self, random: &mut Random) {
        let job = &mut self.job;
        (job.width, job.height) = (64 + random.below(400), 64 + random.below(300));
        job.split = match random.below(4) {
            0 => Split::Strips { count: 1 + random.below(30) },
            1 if job.assign == Assign::Script => Split::Script,
            _ => Split::Grid { width: 24 + random.below(64), height: 24 + random.below(64) },
        };
        let scale = random.between(0.03, 0.3);
        job.probe = if random.happens(0.5) { Probe::EveryNode { scale } } else { Probe::Shared { scale } };
        job.min_nodes = 1 + random.below(self.machines.len() as u32);
    }

    /// Other jobs come while the first one runs, some of other submitters, ranks, or in a sequence; some have to wait for a while.
    fn add_jobs(&mut self, random: &mut Random) {
        for number in 2..2 + u64::from(random.below(6).saturating_sub(2)) {
            let mut job = JobSpec { owner: ["one", "two", "three"][random.below(3) as usize].into(), ..self.job.clone() };
            job.priority = [0, 0, 0, 10, -10][random.below(5) as usize];
            job.name = format!("simulated {number}");
            job.patience = random.happens(0.2).then(|| random.seconds(61.0, 200.0));
            if random.happens(0.2) {
                job.after = vec![JobId(number - 1)];
            }
            let at = random.seconds(0.0, 8.0);
            self.others.push((at, job));
            if random.happens(0.2) {
                let since = at + random.seconds(0.0, 5.0);
                self.faults.push((since, Fault::PauseJob(JobId(number))));
                self.faults.push((since + random.seconds(0.0, 10.0), Fault::ResumeJob(JobId(number))));
            }
            if random.happens(0.1) {
                self.faults.push((random.seconds(0.0, 8.0), Fault::Rank(JobId(number), 20)));
            }
        }
    }

    /// Something goes wrong somewhere; who was killed often comes back. Machine 0 comes back always.
    fn add_fault(&mut self, random: &mut Random) {
        let (at, machine) = (random.seconds(0.0, 8.0), random.below(self.machines.len() as u32) as usize);
        let fault = match random.below(36) {
            0..=5 => Fault::Kill(machine),
            6 => Fault::Leave(machine),
            7..=10 => Fault::Pause(machine, random.seconds(0.1, 15.0)),
            11..=14 => Fault::Partition(machine, random.seconds(0.1, 15.0)),
            15 => Fault::Slow(machine, random.between(0.3, 5.0)),
            16 => Fault::FailPart(machine),
            17 => Fault::Start(machine),
            18 => Fault::RestartCoordinator,
            19 => Fault::Deafen(machine, random.seconds(0.1, 15.0)),
            20 => Fault::Mute(machine, random.seconds(0.1, 15.0)),
            21 => Fault::Hang(machine),
            22 | 23 if machine > 0 => Fault::Corrupt(machine),
            24 => Fault::DamagePixels,
            25 => Fault::Stall(random.seconds(0.05, 20.0)),
            26 => Fault::Drain(machine, random.seconds(0.0, 5.0)),
            27 => Fault::Upgrade,
            28 | 29 => Fault::FullDisk(random.seconds(0.05, 20.0)),
            30 => Fault::JumpClock(random.seconds(0.0, 10.0)),
            31 => Fault::JumpClock(random.seconds(10.0, 10_000.0)),
            32 => Fault::JumpNodeClock(machine, [0.0, 1e-9, 1e6, 1e300][random.below(4) as usize]),
            _ if random.happens(0.1) => Fault::Cancel(JobId(1 + u64::from(random.below(1 + self.others.len() as u32)))),
            _ => Fault::RestartCoordinator,
        };
        self.faults.push((at, fault));
        let ends = matches!(fault, Fault::Kill(_) | Fault::Leave(_) | Fault::Hang(_) | Fault::Drain(..));
        if ends && (machine == 0 || random.happens(0.6)) {
            self.faults.push((at + random.seconds(0.05, 20.0), Fault::Start(machine)));
        }
        if fault == Fault::Upgrade {
            // Nodes follow, one after the other; the first one always.
            for machine in 0..self.machines.len() {
                if machine == 0 || random.happens(0.7) {
                    self.faults.push((at + random.seconds(0.5, 20.0), Fault::Start(machine)));
                }
            }
        }
    }

    /// True seconds per sample of a pixel on a lane of speed 1: a floor and three bright places.
    pub fn cost_at(&self, x: f64, y: f64) -> f64 {
        let (width, height) = (f64::from(self.job.width), f64::from(self.job.height));
        let hill = |i: u64| {
            let place = mix(self.seed.wrapping_add(i));
            let (cx, cy) = (f64::from(place as u16) / 65_536.0, f64::from((place >> 16) as u16) / 65_536.0);
            let (dx, dy) = (x / width - cx, y / height - cy);
            1.0 / (1.0 + 60.0 * (dx * dx + dy * dy))
        };
        let mean = self.work / (width * height * self.job.samples as f64);
        mean * (0.1 + self.contrast * (1..4).map(hill).sum::<f64>() / 3.0)
    }

    /// True seconds of the whole frame on a lane of speed 1, however it is split (a closer look than [`Self::cost_of`] takes at large rectangles).
    pub fn work_of_frame(&self) -> f64 {
        crate::schedule::split::grid(self.job.width, self.job.height, 8, 8).into_iter().map(|rect| self.cost_of(rect)).sum()
    }

    /// True seconds of a rectangle on a lane of speed 1, from a lattice of at most 8 x 8 points.
    pub fn cost_of(&self, rect: Rect) -> f64 {
        let (columns, rows) = (rect.width.min(8), rect.height.min(8));
        let mut sum = 0.0;
        for i in 0..columns * rows {
            let place = |index: u32, count: u32, from: u32, length: u32| {
                f64::from(from) + (f64::from(index) + 0.5) * f64::from(length) / f64::from(count)
            };
            sum += self.cost_at(place(i % columns, columns, rect.x, rect.width), place(i / columns, rows, rect.y, rect.height));
        }
        sum / f64::from(columns * rows) * rect.area() as f64 * self.job.samples as f64
    }
}
