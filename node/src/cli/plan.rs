//! `tessera plan`: what a farm would do with a job.

use std::time::Instant;

use serde::Serialize;
use tessera_engine::{
    part::{self, Rect},
    scene::Scene,
};

use super::{here, script::Script};
use crate::{
    error::{Error, ExitCode, Result},
    job::{JobDescription, Policies},
    limits, manifest,
    report::{self, Style, lined_up},
    schedule::{
        Assign, CostMap, NodeId, NodePower, Part, PartId, Plan, Probe, Split,
        assign::{self, Backlog},
        evaluate, forecast, probe, split,
    },
};

/// Probes a job in this process and shows its split, costs, assignment and predicted finish on a farm.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    script: Script,
    /// Nodes of the farm, each with one lane as fast as a thread here.
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    nodes: u32,
    /// Powers of the farm's nodes, in threads of this machine: `8,8,2.5`.
    #[arg(long, value_delimiter = ',', value_name = "POWER", conflicts_with = "nodes", value_parser = power)]
    powers: Vec<f64>,
    /// Prints the whole plan as JSON.
    #[arg(long)]
    json: bool,
}

fn power(text: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(power) if power > 0.0 && power <= 4096.0 => Ok(power),
        _ => Err("a power is a number above 0, up to 4096".to_owned()),
    }
}

/// Runs the subcommand.
pub fn run(args: Args) -> Result<()> {
    let (loaded, scene) = args.script.load()?;
    let job = &loaded.description;
    let start = Instant::now();
    let costs = costs(job, &part::prepared(scene.build()))?;
    let probe_seconds = start.elapsed().as_secs_f64();
    let nodes = farm(&args, &job.probe);
    let mut policies = job.script.as_ref().map(|script| Policies::new(script, &job.parameters)).transpose()?;
    let parts = parts(job, policies.as_mut(), &costs, &nodes)?;
    let plan = assigned(job, policies.as_mut(), &parts, &nodes)?;
    let outlook = Outlook::new(job, probe_seconds, &parts, &nodes, &plan);
    match args.json {
        true => println!("{}", serde_json::to_string_pretty(&outlook).map_err(|error| Error::new(ExitCode::Internal, error.to_string()))?),
        false => print!("{}", outlook.text(Style { color: std::io::IsTerminal::is_terminal(&std::io::stdout()) })),
    }
    Ok(())
}

/// The cost map: measured here, or known from an earlier run.
fn costs(job: &JobDescription, scene: &Scene) -> Result<CostMap> {
    let scale = match &job.probe {
        Probe::EveryNode { scale } | Probe::Shared { scale } => *scale,
        Probe::Known { costs, .. } => return Ok(costs.clone()),
    };
    let cells = probe::cells(scene.film.width, scene.film.height, scale);
    let measured = [(NodeId(0), here::probe(scene, &cells)?)].into();
    Ok(evaluate::evaluate(&cells, u64::from(scene.quality.samples), &measured).costs)
}

/// The farm's nodes, most powerful first. Where an earlier run is known, names that it knew have the powers that it measured.
fn farm(args: &Args, probe: &Probe) -> Vec<NodePower> {
    let powers = if args.powers.is_empty() { vec![1.0; args.nodes as usize] } else { args.powers.clone() };
    let node = |(id, power): (u32, f64)| {
        let name = format!("node-{}", id + 1);
        let known = match probe {
            Probe::Known { powers, .. } if args.powers.is_empty() => powers.get(&name).copied(),
            _ => None,
        };
        let lanes = if args.powers.is_empty() { 1 } else { power.round().max(1.0) as u32 };
        NodePower { id: NodeId(id), name, lanes, power: known.unwrap_or(power) }
    };
    let mut nodes: Vec<_> = (0..).zip(powers).map(node).collect();
    evaluate::rank(&mut nodes);
    nodes
}

/// The parts, hardest first.
fn parts(job: &JobDescription, policies: Option<&mut Policies>, costs: &CostMap, nodes: &[NodePower]) -> Result<Vec<Part>> {
    let (width, height) = (job.frame.film.width, job.frame.film.height);
    let rects: Vec<Rect> = match (&job.split, policies) {
        (Split::Grid { width: columns, height: rows }, _) => split::grid(width, height, *columns, *rows),
        (Split::Strips { count }, _) => split::strips(width, height, *count),
        (Split::Script, Some(policies)) => policies.split(width, height, costs, nodes, limits::POLICY_TIMEOUT).map_err(failed)?,
        (Split::Script, None) => return Err(failed("the job's split is a function, but the job has no script".to_owned())),
    };
    split::validate(&rects, width, height).map_err(|wrong| failed(format!("split: {wrong}")))?;
    let mut parts: Vec<_> = (0..).zip(rects).map(|(id, rect)| Part { id: PartId(id), rect, cost: split::cost_of(rect, costs) }).collect();
    parts.sort_by(|a, b| b.cost.total_cmp(&a.cost).then(a.id.cmp(&b.id)));
    Ok(parts)
}

fn assigned(job: &JobDescription, policies: Option<&mut Policies>, parts: &[Part], nodes: &[NodePower]) -> Result<Plan> {
    let plan = match (job.assign, policies) {
        (Assign::Naive, _) => assign::naive(parts, nodes),
        (Assign::Paper, _) => assign::paper(parts, nodes, &Backlog::new()),
        (Assign::EarliestFinish, _) => assign::earliest_finish(parts, nodes, &Backlog::new()),
        (Assign::Script, Some(policies)) => policies.assign(parts, nodes, limits::POLICY_TIMEOUT).map_err(failed)?,
        (Assign::Script, None) => return Err(failed("the job's assign is a function, but the job has no script".to_owned())),
    };
    assign::validate(&plan, parts, nodes).map_err(|wrong| failed(format!("assign: {wrong}")))?;
    Ok(plan)
}

fn failed(message: String) -> Error {
    Error::new(ExitCode::Script, message)
}

/// What is to be expected, in seconds of this machine's threads.
#[derive(Serialize)]
struct Outlook {
    job: String,
    width: u32,
    height: u32,
    samples: u32,
    probe_seconds: f64,
    /// Cost of all parts: seconds of one thread here.
    cost: f64,
    /// From the first part handed out to the last commit.
    makespan: f64,
    speedup: f64,
    efficiency: f64,
    overbalance: f64,
    /// Most powerful first.
    nodes: Vec<NodeOutlook>,
    /// Hardest first.
    parts: Vec<PartOutlook>,
}

#[derive(Serialize)]
struct NodeOutlook {
    id: NodeId,
    name: String,
    power: f64,
    parts: usize,
    cost: f64,
    finish: f64,
}

#[derive(Serialize)]
struct PartOutlook {
    id: PartId,
    rect: [u32; 4],
    cost: f64,
    node: Option<NodeId>,
}

impl Outlook {
    fn new(job: &JobDescription, probe_seconds: f64, parts: &[Part], nodes: &[NodePower], plan: &Plan) -> Self {
        let finish = forecast::finish_times(plan, parts, nodes);
        let of_node = |id| parts.iter().filter(move |part| plan.get(&part.id) == Some(&id));
        let node = |node: &NodePower| NodeOutlook {
            id: node.id,
            name: node.name.clone(),
            power: node.power,
            parts: of_node(node.id).count(),
            cost: of_node(node.id).map(|part| part.cost).sum(),
            finish: finish.get(&node.id).copied().unwrap_or(0.0),
        };
        let part = |part: &Part| PartOutlook {
            id: part.id,
            rect: [part.rect.x, part.rect.y, part.rect.width, part.rect.height],
            cost: part.cost,
            node: plan.get(&part.id).copied(),
        };
        let nodes: Vec<_> = nodes.iter().map(node).collect();
        let (cost, power): (f64, f64) = (parts.iter().map(|part| part.cost).sum(), nodes.iter().map(|node| node.power).sum());
        let makespan = finish.values().copied().fold(0.0, f64::max);
        let efficiency = if makespan > 0.0 { cost / (power * makespan) } else { 0.0 };
        Self {
            job: job.name.clone(),
            width: job.frame.film.width,
            height: job.frame.film.height,
            samples: job.frame.quality.samples,
            probe_seconds,
            cost,
            makespan,
            speedup: efficiency * nodes.len() as f64,
            efficiency,
            overbalance: manifest::overbalance(nodes.iter().filter(|node| node.parts > 0).map(|node| node.finish)),
            nodes,
            parts: parts.iter().map(part).collect(),
        }
    }

    fn text(&self, style: Style) -> String {
        let Self { job, width, height, samples, cost, probe_seconds, .. } = self;
        let time = report::seconds;
        let mut text = format!(
            "{}  {width} x {height}, {samples} samples a pixel; {} parts, {} for one thread here (probed in {})\n\n",
            style.bold(job),
            self.parts.len(),
            time(*cost),
            time(*probe_seconds)
        );
        let mut rows = vec![["node", "power", "parts", "cost s", "finish s"].map(str::to_owned).to_vec()];
        rows.extend(self.nodes.iter().map(|node| {
            vec![
                node.name.clone(),
                format!("{:.3}", node.power),
                node.parts.to_string(),
                format!("{:.3}", node.cost),
                format!("{:.3}", node.finish),
            ]
        }));
        lined_up(&rows).iter().for_each(|line| text.push_str(&format!("  {line}\n")));
        let figures = format!("speedup {:.2}, efficiency {:.3}, overbalance {:.3}", self.speedup, self.efficiency, self.overbalance);
        text.push_str(&format!("\n{}; finish after {}\n", style.bold(&format!("predicted: {figures}")), time(self.makespan)));
        if let (Some(hardest), Some(easiest)) = (self.parts.first(), self.parts.last()) {
            let [x, y, width, height] = hardest.rect;
            let hardest = format!("hardest part: {width} x {height} at {x}, {y}, {:.3} s", hardest.cost);
            text.push_str(&format!("{hardest}; easiest {:.3} s\n", easiest.cost));
        }
        text
    }
}
