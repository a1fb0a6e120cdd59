//! `tessera verify farm`: the scheduler under thousands of schedules of faults on virtual time, and what it costs to survive them.

use std::{num::NonZero, thread, time::Duration};

use super::real_farm;
use crate::{
    error::{Error, ExitCode, Result},
    manifest::{AttemptOutcome, EventKind},
    report::lined_up,
    schedule::{Assign, Split},
    simulate::{Campaign, Fault, Run, Scenario, World, shrink},
};

/// Arguments of `tessera verify farm`.
#[derive(clap::Args)]
pub struct Args {
    /// Schedules of faults to try: deaths, hangs, partitions, wrong pixels, a coordinator that dies or stands still, and more.
    #[arg(long, default_value_t = 10_000)]
    schedules: u64,
    /// The first schedule's number; a long run is cut into several with this.
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Instead, kills so many real node processes on this machine, and a coordinator now and then, and measures what that costs.
    #[arg(long, value_name = "DEATHS", conflicts_with_all = ["schedules", "first"], value_parser = clap::value_parser!(u32).range(1..=10_000))]
    real: Option<u32>,
}

/// Farms that each figure is measured on.
const FARMS: u64 = 20;

/// Nodes of such a farm.
const NODES: usize = 15;

/// Seconds of work on one lane of speed 1.
const WORK: f64 = 3000.0;

/// Runs the subcommand.
///
/// # Errors
/// When a schedule breaks a promise, or a figure misses its goal.
pub fn run(args: &Args) -> Result<()> {
    if let Some(deaths) = args.real {
        return real_farm::run(deaths);
    }
    let threads = thread::available_parallelism().map_or(1, NonZero::get) as u64;
    schedules(args, threads)?;
    let figures = figures();
    let rows: Vec<_> =
        std::iter::once(["figure", "goal", "measured", ""].map(str::to_owned).to_vec()).chain(figures.iter().map(Figure::row)).collect();
    lined_up(&rows).iter().for_each(|line| println!("{line}"));
    let missed: Vec<&str> = figures.iter().filter(|figure| !figure.holds()).map(|figure| figure.name).collect();
    if missed.is_empty() { Ok(()) } else { Err(Error::new(ExitCode::Verify, format!("missed: {}", missed.join(", ")))) }
}

fn schedules(args: &Args, threads: u64) -> Result<()> {
    let seeds = args.first..args.first.saturating_add(args.schedules);
    let campaign = Campaign::run(&seeds, threads);
    println!("{} schedules of faults, {} jobs finished, {} promises broken", args.schedules, campaign.finished, campaign.broken.len());
    let events: Vec<String> = campaign.events.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
    println!("{}\n", events.join(", "));
    let Some((seed, what)) = campaign.broken.first() else { return Ok(()) };
    let faults = shrink(Scenario::chaos(*seed)).faults;
    let message = format!("schedule {seed} breaks a promise: {what}; of its faults it takes {faults:?}");
    Err(Error::new(ExitCode::Internal, message).with_help(format!("replay it: tessera simulate --schedule {seed}")))
}

/// A figure and its goal.
struct Figure {
    name: &'static str,
    measured: f64,
    goal: Goal,
    unit: &'static str,
}

#[derive(Clone, Copy)]
enum Goal {
    AtMost(f64),
    AtLeast(f64),
    /// It depends on how long parts are.
    Known,
}

impl Figure {
    fn holds(&self) -> bool {
        match self.goal {
            Goal::AtMost(limit) => self.measured <= limit,
            Goal::AtLeast(limit) => self.measured >= limit,
            Goal::Known => true,
        }
    }

    fn row(&self) -> Vec<String> {
        let goal = match self.goal {
            Goal::AtMost(limit) => format!("<= {limit} {}", self.unit),
            Goal::AtLeast(limit) => format!(">= {limit} {}", self.unit),
            Goal::Known => String::new(),
        };
        let verdict = if self.holds() { "" } else { "missed" };
        vec![self.name.to_owned(), goal, format!("{:.4} {}", self.measured, self.unit), verdict.to_owned()]
    }
}

fn figures() -> Vec<Figure> {
    let at_most = |name, measured, limit, unit| Figure { name, measured, goal: Goal::AtMost(limit), unit };
    let at_least = |name, measured, limit| Figure { name, measured, goal: Goal::AtLeast(limit), unit: "" };
    let mut deaths = deaths();
    let calm: Vec<(f64, f64)> = (0..FARMS).map(calm).collect();
    let mut efficiencies: Vec<f64> = calm.iter().map(|(efficiency, _)| *efficiency).collect();
    let mut overbalances: Vec<f64> = calm.iter().map(|(_, overbalance)| *overbalance).collect();
    vec![
        at_most("a death is noticed (median; 200 ms jitter, 5 % loss)", share(&mut deaths.noticed, 0.5), 1.0, "s"),
        at_most("a death is noticed (99 of 100)", share(&mut deaths.noticed, 0.99), 1.0, "s"),
        Figure {
            name: "a lane is free for its part, after that (median)",
            measured: share(&mut deaths.reassigned, 0.5),
            goal: Goal::Known,
            unit: "s",
        },
        at_most("parts rendered again after the coordinator dies (most)", restarted(), 0.0, ""),
        at_least("efficiency of 15 unequal nodes (median)", share(&mut efficiencies, 0.5), 0.97),
        at_least("efficiency of 15 unequal nodes (5 of 100)", share(&mut efficiencies, 0.05), 0.95),
        at_most("overbalance of 15 unequal nodes (median)", share(&mut overbalances, 0.5), 0.02, ""),
        at_most("one of 15 dies: time over the survivors' ideal (median)", killed(1), 1.03, ""),
        at_most("five of 15 die: time over the survivors' ideal (median)", killed(5), 1.06, ""),
        at_most("one of 15 turns 60 % slower halfway: time over the ideal", slowed(), 1.01, ""),
    ]
}

/// The number that such a share of them does not exceed.
fn share(numbers: &mut [f64], share: f64) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let place = (numbers.len() as f64 * share).ceil() as usize;
    numbers.get(place.max(1) - 1).copied().unwrap_or(f64::NAN)
}

fn farm(seed: u64) -> (Scenario, f64) {
    let machines: Vec<(u32, f64)> = Scenario::speeds(seed, NODES).into_iter().map(|speed| (1, speed)).collect();
    let mut scenario = Scenario::plain(seed, &machines, Split::Grid { width: 32, height: 32 }, Assign::EarliestFinish);
    scenario.work = WORK;
    let work = scenario.work_of_frame();
    (scenario, work)
}

fn speed(scenario: &Scenario) -> f64 {
    scenario.machines.iter().map(|machine| machine.speed * f64::from(machine.lanes)).sum()
}

#[derive(Default)]
struct Deaths {
    noticed: Vec<f64>,
    reassigned: Vec<f64>,
}

/// Two of four nodes die, on a bad network.
fn deaths() -> Deaths {
    let mut all = Deaths::default();
    for seed in 0..10 * FARMS {
        let grid = Split::Grid { width: 96, height: 96 };
        let mut scenario = Scenario::plain(seed, &[(1, 1.0), (1, 1.0), (1, 1.0), (1, 1.0)], grid, Assign::EarliestFinish);
        (scenario.work, scenario.network.delay, scenario.network.loss) = (40.0, (0.001, 0.2), 0.05);
        let moment = |step: u64| Duration::from_millis(1_500 + step * 997 % 6_000);
        scenario.faults = vec![(moment(seed), Fault::Kill(1)), (moment(seed * 3 + 1), Fault::Kill(2))];
        let run = World::new(scenario).run();
        all.noticed.extend(run.detections.iter().map(Duration::as_secs_f64));
        all.reassigned.extend(reassigned(&run));
    }
    all
}

/// From the suspicion of a node to the next attempt at each of its parts.
fn reassigned(run: &Run) -> Vec<f64> {
    let events = run.record.events.iter().filter(|event| event.kind == EventKind::Reassigned);
    let next = |time: f64, part: usize| {
        let attempts = run.record.parts[part].attempts.iter().filter(|attempt| attempt.start >= time);
        attempts.map(|attempt| attempt.start - time).fold(f64::INFINITY, f64::min)
    };
    // The part that a lane rendered is the first of the list; those that waited wait their turn.
    events.filter_map(|event| event.parts.first().map(|part| next(event.time, part.0 as usize))).filter(|delay| delay.is_finite()).collect()
}

/// Committed parts that are rendered again when the coordinator is killed three times: the most of any farm.
fn restarted() -> f64 {
    let again = |seed| {
        let (mut scenario, work) = farm(seed);
        let third = work / speed(&scenario) / 4.0;
        scenario.faults = (1..4).map(|i| (Duration::from_secs_f64(third * f64::from(i)), Fault::RestartCoordinator)).collect();
        let run = World::new(scenario).run();
        let twice = run.record.parts.iter().filter(|part| {
            part.attempts.iter().filter(|attempt| attempt.outcome == AttemptOutcome::Committed).count() > 1 || run.outcome.is_none()
        });
        twice.count() as f64
    };
    (0..FARMS).map(again).fold(0.0, f64::max)
}

/// Efficiency and overbalance of a farm without faults.
fn calm(seed: u64) -> (f64, f64) {
    let (scenario, work) = farm(seed);
    let (_, efficiency, overbalance) = World::new(scenario).run().figures(work);
    (efficiency, overbalance)
}

/// Nodes die one after another: the time it takes, over that in which the survivors could have done it (the median of all farms).
fn killed(count: usize) -> f64 {
    let ratio = |seed| {
        let (mut scenario, work) = farm(seed);
        let all = speed(&scenario);
        let deaths: Vec<(f64, usize)> = (0..count).map(|i| ((i + 1) as f64 / (count + 1) as f64 * work / all, i)).collect();
        scenario.faults = deaths.iter().map(|(at, node)| (Duration::from_secs_f64(*at), Fault::Kill(*node))).collect();
        let ideal = ideal(work, all, deaths.iter().map(|(at, node)| (*at, scenario.machines[*node].speed)));
        World::new(scenario).run().makespan() / ideal
    };
    share(&mut (0..FARMS).map(ratio).collect::<Vec<_>>(), 0.5)
}

/// Seconds for the work at this speed, which falls by so much at these moments.
fn ideal(work: f64, speed: f64, falls: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut left, mut speed, mut now) = (work, speed, 0.0);
    for (at, fall) in falls {
        left -= (at - now) * speed;
        (now, speed) = (at, speed - fall);
    }
    now + left / speed
}

fn slowed() -> f64 {
    let ratio = |seed| {
        let (mut scenario, work) = farm(seed);
        let (all, slow, half) = (speed(&scenario), scenario.machines[3].speed, work / speed(&scenario) / 2.0);
        scenario.faults = vec![(Duration::from_secs_f64(half), Fault::Slow(3, 2.5))];
        World::new(scenario).run().makespan() / ideal(work, all, std::iter::once((half, 0.6 * slow)))
    };
    share(&mut (0..FARMS).map(ratio).collect::<Vec<_>>(), 0.5)
}
