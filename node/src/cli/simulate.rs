//! `tessera simulate`: the farm's own scheduler on virtual time, to plan a farm or to replay a schedule of faults.

use std::time::Duration;

use crate::error::{Error, ExitCode, Result};
use crate::farm::Outcome;
use crate::manifest::EventKind;
use crate::schedule::{Assign, Split};
use crate::simulate::{Fault, Run, Scenario, World, broken_by, shrink};

/// Arguments of `tessera simulate`.
#[derive(clap::Args)]
pub struct Args {
    /// Nodes of the farm; their speeds lie between 1/2 and 2, chosen by the seed.
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    nodes: u32,
    /// Rendering threads of each node.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    lanes: u32,
    /// Speeds of the nodes' threads, instead of those chosen by the seed: `1,1,0.5`.
    #[arg(long, value_delimiter = ',', conflicts_with_all = ["nodes", "paper"])]
    speeds: Vec<f64>,
    /// Edge of a part in pixels, on a frame of 1024 x 768.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=1024))]
    size: u32,
    /// How parts are assigned.
    #[arg(long, value_enum, default_value = "earliest-finish")]
    assign: Policy,
    /// Seconds that one thread of speed 1 needs for the frame.
    #[arg(long, default_value_t = 6000.0)]
    work: f64,
    /// Nodes that die while the frame is rendered, evenly over the time.
    #[arg(long, default_value_t = 0)]
    kill: u32,
    /// Chooses speeds, the scene's costs and all chance.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Replay a schedule of faults of the test suite, and say what happens.
    #[arg(long, value_name = "SEED", conflicts_with_all = ["paper", "kill"])]
    schedule: Option<u64>,
    /// The paper's table: 1, 2, 5, 10, 15 nodes by three policies.
    #[arg(long)]
    paper: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Policy {
    /// Contiguous segments, by power alone.
    Naive,
    /// The hardest part to the most powerful node.
    Paper,
    /// Each part to the node that would finish it first, and stealing.
    EarliestFinish,
}

impl From<Policy> for Assign {
    fn from(policy: Policy) -> Self {
        match policy {
            Policy::Naive => Self::Naive,
            Policy::Paper => Self::Paper,
            Policy::EarliestFinish => Self::EarliestFinish,
        }
    }
}

/// Runs the subcommand.
///
/// # Errors
/// When arguments make no farm, or when a promise of the farm is broken.
pub fn run(args: Args) -> Result<()> {
    match args.schedule {
        Some(seed) => replay(seed),
        None if args.paper => paper(&args),
        None => plan(&args),
    }
}

fn replay(seed: u64) -> Result<()> {
    let scenario = Scenario::chaos(seed);
    println!("{scenario:#?}");
    let run = World::new(scenario.clone()).run();
    for event in &run.record.events {
        let node = event.node.map_or(String::new(), |node| format!(" node {}", node.0));
        println!("{:9.3} s {:?}{node} {} ({} parts)", event.time, event.kind, event.detail, event.parts.len());
    }
    run.record.warnings.iter().for_each(|warning| println!("warning: {warning}"));
    println!("{} after {:.3} s, {} steps; trace {}", told(run.outcome.as_ref()), run.record.seconds, run.steps, hex(&run.trace));
    let Some(broken) = broken_by(&scenario, &run) else { return Ok(()) };
    println!("what it takes of its faults: {:?}", shrink(scenario).faults);
    Err(Error::new(ExitCode::Internal, broken))
}

fn told(outcome: Option<&Outcome>) -> String {
    match outcome {
        Some(Outcome::Finished) => "finished".to_owned(),
        Some(Outcome::Incomplete { holes }) => format!("finished with {holes} holes"),
        Some(Outcome::Failed { reason }) => format!("failed: {reason}"),
        Some(Outcome::Cancelled { reason }) => format!("cancelled: {reason}"),
        None => "still running".to_owned(),
    }
}

fn plan(args: &Args) -> Result<()> {
    let mut scenario = scenario(args, args.nodes as usize, Split::Grid { width: args.size, height: args.size }, args.assign.into())?;
    let work = scenario.work_of_frame();
    if args.kill >= scenario.machines.len() as u32 {
        return Err(Error::new(ExitCode::Usage, "--kill leaves no node").with_help("kill fewer nodes than there are"));
    }
    let power: f64 = scenario.machines.iter().map(|machine| machine.speed * f64::from(machine.lanes)).sum();
    for i in 0..args.kill {
        let share = f64::from(i + 1) / f64::from(args.kill + 1);
        scenario.faults.push((Duration::from_secs_f64(1.0 + share * work / power), Fault::Kill(i as usize)));
    }
    let run = World::new(scenario).run();
    judge(&run)?;
    let (speedup, efficiency, overbalance) = run.figures(work);
    println!("parts        {:>10}", run.record.parts.len());
    println!("probe        {:>10.3} s", run.record.probe.seconds);
    println!("makespan     {:>10.3} s", run.makespan());
    println!("speedup      {speedup:>10.3}");
    println!("efficiency   {efficiency:>10.4} (of all nodes, those that die included)");
    println!("overbalance  {overbalance:>10.4}");
    println!("nodes lost   {:>10}", run.count(EventKind::Lost).max(run.count(EventKind::Suspected)));
    println!("outcome      {:>10}", told(run.outcome.as_ref()));
    Ok(())
}

/// The paper's table 1 and 2: time, speedup, efficiency and overbalance on 1, 2, 5, 10 and 15 nodes.
fn paper(args: &Args) -> Result<()> {
    let grid = Split::Grid { width: args.size, height: args.size };
    println!("{:<34} {:>5} {:>10} {:>8} {:>10} {:>11}", "policy", "nodes", "time s", "speedup", "efficiency", "overbalance");
    for nodes in [1, 2, 5, 10, 15] {
        let strips = Split::Strips { count: nodes };
        let policies = [
            ("naive, a strip a node", strips.clone(), Assign::Naive),
            ("paper, a strip a node", strips, Assign::Paper),
            ("paper, many parts", grid.clone(), Assign::Paper),
            ("earliest_finish, many parts", grid.clone(), Assign::EarliestFinish),
        ];
        for (name, split, assign) in policies {
            let scenario = scenario(args, nodes as usize, split, assign)?;
            let work = scenario.work_of_frame();
            let run = World::new(scenario).run();
            judge(&run)?;
            let (speedup, efficiency, overbalance) = run.figures(work);
            println!("{name:<34} {nodes:>5} {:>10.1} {speedup:>8.2} {efficiency:>10.3} {overbalance:>11.3}", run.makespan());
        }
    }
    Ok(())
}

fn scenario(args: &Args, nodes: usize, split: Split, assign: Assign) -> Result<Scenario> {
    if let Some(speed) = args.speeds.iter().find(|speed| !(speed.is_finite() && **speed > 0.0)) {
        return Err(Error::new(ExitCode::Usage, format!("--speeds: {speed} is not a speed")).with_help("speeds are above 0"));
    }
    if !(args.work > 0.0 && args.work <= 1e9) {
        return Err(
            Error::new(ExitCode::Usage, format!("--work: {} is no number of seconds", args.work)).with_help("it is above 0, up to 1e9")
        );
    }
    let speeds = if args.speeds.is_empty() { Scenario::speeds(args.seed, nodes) } else { args.speeds.clone() };
    let machines: Vec<(u32, f64)> = speeds.into_iter().map(|speed| (args.lanes, speed)).collect();
    let mut scenario = Scenario::plain(args.seed, &machines, split, assign);
    scenario.work = args.work;
    Ok(scenario)
}

fn judge(run: &Run) -> Result<()> {
    match &run.outcome {
        _ if !run.violations.is_empty() => Err(Error::new(ExitCode::Internal, run.violations.join("\n"))),
        Some(Outcome::Failed { reason }) => Err(Error::new(ExitCode::Job, reason.as_str())),
        _ => Ok(()),
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
