//! `tessera check`: runs a job script and says what would be rendered.

use serde::Serialize;
use tessera_engine::{
    description::{Aov, Render},
    scene::{Scene, Statistics},
};

use super::script::Script;
use crate::{
    error::{Error, ExitCode, Result},
    job::{JobDescription, LoadedJob, Policies},
    limits,
    schedule::{Assign, NodeId, NodePower, Part, PartId, Probe, Split, evaluate, split},
};

/// Runs a job script, tries its policies, and prints what would be rendered.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    script: Script,
    /// Prints the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the subcommand.
pub fn run(args: Args) -> Result<()> {
    let (job, scene) = args.script.load()?;
    let parts = try_policies(&job.description)?;
    let summary = Summary::of(&job, &scene.build(), parts)?;
    if args.json {
        let text = serde_json::to_string_pretty(&summary);
        println!("{}", text.map_err(|error| Error::new(ExitCode::Internal, format!("the summary cannot be coded: {error}")))?);
    } else {
        print!("{}", summary.text());
    }
    Ok(())
}

/// What a job comes to.
#[derive(Serialize)]
struct Summary {
    name: String,
    width: u32,
    height: u32,
    samples: u32,
    seed: u64,
    render: String,
    /// What rendering it will compute.
    modelled: Vec<String>,
    probe: String,
    split: String,
    parts: usize,
    assign: String,
    outputs: Vec<String>,
    /// What the picture tells beside colours.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    aovs: Vec<&'static str>,
    image_hash: String,
    scene: Contents,
    warnings: Vec<String>,
    /// Where it is one frame of several: which are there.
    frames: Option<String>,
}

/// What the scene is made of.
#[derive(Serialize)]
struct Contents {
    spheres: usize,
    planes: usize,
    boxes: usize,
    discs: usize,
    rectangles: usize,
    cylinders: usize,
    cones: usize,
    meshes: usize,
    instances: usize,
    triangles: usize,
    instanced_triangles: usize,
    lights: usize,
    materials: usize,
    textures: usize,
    memory_bytes: usize,
    assets: usize,
    asset_bytes: usize,
}

impl Summary {
    fn of(job: &LoadedJob, scene: &Scene, parts: usize) -> Result<Self> {
        let JobDescription { name, frame, output, probe, split, assign, warnings, .. } = &job.description;
        let hash = frame.hash().map_err(|error| Error::new(ExitCode::Internal, format!("the frame cannot be coded: {error}")))?;
        Ok(Self {
            name: name.clone(),
            width: frame.film.width,
            height: frame.film.height,
            samples: frame.quality.samples,
            seed: frame.seed,
            render: render_words(&frame.render),
            probe: probe_words(probe),
            split: split_words(split),
            parts,
            assign: assign_words(*assign).to_owned(),
            outputs: [Some(&output.exr), output.png.as_ref(), Some(&output.manifest)].into_iter().flatten().cloned().collect(),
            aovs: frame.aovs.iter().map(Aov::name).collect(),
            image_hash: hash.to_string(),
            modelled: scene.explain(),
            scene: Contents::of(job, &scene.statistics),
            warnings: warnings.clone(),
            frames: job.frames.map(|(frame, frames)| format!("{frame} alone, of {frames}; --set frame=NUMBER checks another")),
        })
    }

    fn text(&self) -> String {
        let Self { name, width, height, samples, seed, .. } = self;
        let mut text = format!("{name}: {width} x {height} pixels, {samples} samples each, seed {seed}\n");
        self.frames.iter().for_each(|frames| text.push_str(&format!("  {:<11} {frames}\n", "frame")));
        let mut lines = vec![
            ("scene", self.scene.text()),
            ("render", self.render.clone()),
            ("probe", self.probe.clone()),
            ("split", format!("{}: {} part{}", self.split, self.parts, if self.parts == 1 { "" } else { "s" })),
            ("assign", self.assign.clone()),
            ("output", self.outputs.join(", ")),
            ("image_hash", self.image_hash.clone()),
        ];
        if !self.aovs.is_empty() {
            lines.insert(lines.len() - 1, ("aovs", self.aovs.join(", ")));
        }
        for (what, value) in &lines {
            text.push_str(&format!("  {what:<11} {value}\n"));
            if *what == "render" {
                self.modelled.iter().for_each(|line| text.push_str(&format!("  {:<11} {line}\n", "")));
            }
        }
        self.warnings.iter().for_each(|warning| text.push_str(&format!("warning: {warning}\n")));
        text
    }
}

impl Contents {
    fn of(job: &LoadedJob, statistics: &Statistics) -> Self {
        let Statistics { spheres, planes, boxes, discs, rectangles, cylinders, cones, meshes, instances, triangles, .. } = *statistics;
        let scene = &job.description.frame.scene;
        Self {
            spheres,
            planes,
            boxes,
            discs,
            rectangles,
            cylinders,
            cones,
            meshes,
            instances,
            triangles,
            instanced_triangles: statistics.instanced_triangles,
            lights: scene.lights.len(),
            materials: scene.materials.len(),
            textures: scene.textures.len(),
            memory_bytes: statistics.bytes,
            assets: job.assets.iter().count(),
            asset_bytes: job.assets.iter().map(|(_, bytes)| bytes.len()).sum(),
        }
    }

    fn text(&self) -> String {
        let counts = [
            (self.spheres, "sphere", "spheres"),
            (self.planes, "plane", "planes"),
            (self.boxes, "box", "boxes"),
            (self.discs, "disc", "discs"),
            (self.rectangles, "rectangle", "rectangles"),
            (self.cylinders, "cylinder", "cylinders"),
            (self.cones, "cone", "cones"),
            (self.meshes, "mesh", "meshes"),
            (self.instances, "instance of them", "instances of them"),
            (self.instanced_triangles, "triangle", "triangles"),
            (self.lights, "light", "lights"),
            (self.materials, "material", "materials"),
            (self.textures, "texture", "textures"),
        ];
        let words: Vec<String> = (counts.iter().filter(|(count, ..)| *count > 0))
            .map(|(count, one, many)| format!("{count} {}", if *count == 1 { one } else { many }))
            .collect();
        let what = if words.is_empty() { "nothing".to_owned() } else { words.join(", ") };
        format!("{what}; {:.1} MiB", self.memory_bytes as f64 / f64::from(1 << 20))
    }
}

fn render_words(render: &Render) -> String {
    match render {
        Render::Raycast => "raycast".to_owned(),
        Render::Whitted { max_depth, transparent_shadows, min_weight } => {
            format!("whitted, max_depth {max_depth}, transparent_shadows {transparent_shadows}, min_weight {min_weight}")
        }
        Render::Path { max_depth, roulette_depth, smooth_terminator } => {
            let biased = if *smooth_terminator { ", smooth_terminator (biased)" } else { "" };
            format!("path, max_depth {max_depth}, roulette_depth {roulette_depth}{biased}")
        }
    }
}

fn probe_words(probe: &Probe) -> String {
    match probe {
        Probe::EveryNode { scale } => format!("every node, scale {scale}"),
        Probe::Shared { scale } => format!("shared, scale {scale}"),
        Probe::Known { powers, .. } => format!("from a manifest that knows {} nodes", powers.len()),
    }
}

fn split_words(split: &Split) -> String {
    match split {
        Split::Grid { width, height } => format!("grid of {width} x {height}"),
        Split::Strips { .. } => "strips".to_owned(),
        Split::Script => "the script's own function (tried with 3 equal nodes)".to_owned(),
    }
}

fn assign_words(assign: Assign) -> &'static str {
    match assign {
        Assign::Naive => "naive",
        Assign::Paper => "paper",
        Assign::EarliestFinish => "earliest_finish",
        Assign::Script => "the script's own function",
    }
}

/// Asks the job's own policies as a farm of three equal nodes would, so that their mistakes show before any farm is asked. Returns the
/// number of parts.
fn try_policies(job: &JobDescription) -> Result<usize> {
    let (width, height) = (job.frame.film.width, job.frame.film.height);
    let costs = evaluate::uniform(width, height);
    let nodes: Vec<_> = (0..3).map(|id| NodePower { id: NodeId(id), name: format!("node-{id}"), lanes: 1, power: 1.0 }).collect();
    let mut policies = job.script.as_ref().map(|script| Policies::new(script, &job.parameters)).transpose()?;
    let failed = |what: String| Error::new(ExitCode::Script, what);
    let rects = match (&job.split, policies.as_mut()) {
        (Split::Grid { width: columns, height: rows }, _) => split::grid(width, height, *columns, *rows),
        (Split::Strips { count }, _) => split::strips(width, height, *count),
        (Split::Script, Some(policies)) => policies.split(width, height, &costs, &nodes, limits::POLICY_TIMEOUT).map_err(failed)?,
        (Split::Script, None) => Vec::new(),
    };
    if let (Assign::Script, Some(policies)) = (job.assign, policies.as_mut()) {
        let part = |(id, rect)| Part { id: PartId(id), rect, cost: split::cost_of(rect, &costs) };
        let mut parts: Vec<Part> = (0..).zip(rects.iter().copied()).map(part).collect();
        parts.sort_by(|a, b| b.cost.total_cmp(&a.cost));
        policies.assign(&parts, &nodes, limits::POLICY_TIMEOUT).map_err(failed)?;
    }
    Ok(rects.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(assign: &str) -> Result<()> {
        let script = format!(
            "local tessera = require('tessera')
return tessera.job {{
  scene = tessera.scene {{ objects = {{ tessera.sphere {{ material = tessera.mirror {{}} }} }} }},
  film = {{ width = 100, height = 70 }},
  assign = function(parts, nodes) {assign} end,
}}"
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("job.lua");
        std::fs::write(&path, script).unwrap();
        run(Args { script: Script { path, parameters: Vec::new() }, json: true })
    }

    #[test]
    fn policies_are_tried_before_any_farm_is_asked() {
        check("local plan = {} for _, part in parts do plan[part.id] = nodes[#nodes].id end return plan").unwrap();
        let error = check("return { [0] = nodes[1].id }").unwrap_err();
        assert_eq!(error.code, ExitCode::Script);
        assert!(error.message.contains("job.lua:5: assign: the plan gives part 1 to no node"), "{error}");
    }
}
