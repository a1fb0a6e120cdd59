//! `tessera tradeoff`: error against time for each knob of a job.

use std::{
    io::IsTerminal as _,
    path::{Path, PathBuf},
    time::Instant,
};

use indicatif::{ProgressBar, ProgressStyle};
use tessera_engine::{
    description::{Filter, Render},
    film::Film,
    part,
    scene::Scene,
};

use super::{here, script::Script};
use crate::{
    error::{Error, ExitCode, Result},
    files,
    report::{self, Rung, Style, Tradeoff},
};

/// Renders a job with ladders of samples and depths, in this process, and compares each rung with the best.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    script: Script,
    /// Samples a pixel of the best rung [default: the job's own, but at least 64].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    best: Option<u64>,
    /// Folder of the table (CSV and JSON) and the plot (SVG), made where it is missing.
    #[arg(long, short, default_value = ".", value_name = "DIR")]
    output: PathBuf,
    /// Prints the table as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the subcommand.
pub fn run(args: Args) -> Result<()> {
    let (loaded, scene) = args.script.load()?;
    let mut scene = part::prepared(scene.build());
    std::fs::create_dir_all(&args.output)
        .map_err(|error| Error::new(ExitCode::File, format!("{}: cannot be made: {error}", args.output.display())))?;
    let (name, exposure) = (loaded.description.name, loaded.description.output.exposure);
    let (width, height, samples) = (scene.film.width, scene.film.height, u64::from(scene.quality.samples));
    let pixels = u64::from(width) * u64::from(height);
    let ladder = Ladder { knob: "samples", values: sample_ladder(&scene, args.best), exposure, pixels };
    let mut rungs = ladder.climb(|count, bar| here::frame(&scene, count, |rect| bar.inc(rect.area())))?;
    if let Render::Whitted { max_depth, .. } | Render::Path { max_depth, .. } = scene.render {
        let whole = scene.render.clone();
        let ladder = Ladder { knob: "max_depth", values: report::ladder(u64::from(max_depth), 2), ..ladder };
        rungs.extend(ladder.climb(|depth, bar| {
            scene.render = limited(&whole, depth);
            here::frame(&scene, samples, |rect| bar.inc(rect.area()))
        })?);
    }
    let tradeoff = Tradeoff { job: name, width, height, threads: here::threads(), rungs };
    let json = serde_json::to_string_pretty(&tradeoff)
        .map_err(|error| Error::new(ExitCode::Internal, format!("the table cannot be coded: {error}")))?;
    let written = write(&tradeoff, &json, &args.output)?;
    if args.json {
        println!("{json}");
    } else {
        print!("{}", tradeoff.text(Style { color: std::io::stdout().is_terminal() }));
        written.iter().for_each(|path| println!("{}", path.display()));
    }
    Ok(())
}

/// Where nothing but the place in the pixel is left to chance, further samples of the filter `point` repeat the first.
fn sample_ladder(scene: &Scene, best: Option<u64>) -> Vec<u64> {
    if scene.film.filter == Filter::Point && !matches!(scene.render, Render::Path { .. }) {
        return vec![1];
    }
    report::ladder(best.unwrap_or(u64::from(scene.quality.samples).max(64)), 4)
}

fn limited(render: &Render, depth: u64) -> Render {
    let mut limited = render.clone();
    if let Render::Whitted { max_depth, .. } | Render::Path { max_depth, .. } = &mut limited {
        *max_depth = u32::try_from(depth).unwrap_or(u32::MAX);
    }
    limited
}

/// The settings of one knob, the cheapest first.
struct Ladder {
    knob: &'static str,
    values: Vec<u64>,
    exposure: f64,
    pixels: u64,
}

impl Ladder {
    /// Renders all rungs and compares them with the last. Once before, unmeasured, the cheapest warms the caches up.
    fn climb(&self, mut render: impl FnMut(u64, &ProgressBar) -> Result<Film>) -> Result<Vec<Rung>> {
        let mut films = Vec::new();
        for (i, &value) in self.values.iter().enumerate() {
            if i == 0 {
                render(value, &ProgressBar::hidden())?;
            }
            let bar = self.progress(value);
            let start = Instant::now();
            let film = render(value, &bar)?;
            films.push((value, start.elapsed().as_secs_f64(), film));
            bar.finish_and_clear();
        }
        let Some((_, _, best)) = films.last() else { return Ok(Vec::new()) };
        let rung = |(value, seconds, film): &(u64, f64, Film)| {
            let difference = report::difference(film, best, self.exposure)?;
            Some(Rung { knob: self.knob, value: *value, seconds: *seconds, difference })
        };
        Ok(films.iter().filter_map(rung).collect())
    }

    /// A bar over the pixels of a frame where there is a terminal; else a line.
    fn progress(&self, value: u64) -> ProgressBar {
        let what = format!("{} {value}", self.knob);
        if !std::io::stderr().is_terminal() {
            eprintln!("{what}");
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{prefix:>14} [{bar:40}] {elapsed}").unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::new(self.pixels).with_style(style.progress_chars("=> ")).with_prefix(what)
    }
}

fn write(tradeoff: &Tradeoff, json: &str, folder: &Path) -> Result<Vec<PathBuf>> {
    let outputs = [("csv", tradeoff.csv()), ("json", json.to_owned() + "\n"), ("svg", tradeoff.svg())];
    let write = |(ending, text): (&str, String)| {
        let path = folder.join(format!("{}.tradeoff.{ending}", tradeoff.job));
        files::write_whole(&path, text.as_bytes()).map(|()| path)
    };
    outputs.into_iter().map(write).collect()
}
