//! `tessera report`: what came of jobs.

use std::{io::IsTerminal as _, path::PathBuf};

use crate::{
    error::{Error, ExitCode, Result},
    files,
    manifest::{self, Manifest},
    report::{self, Style},
};

/// Prints what came of a job, or the paper's table over several.
#[derive(clap::Args)]
pub struct Args {
    /// Manifests, as they stand beside pictures. With several of one picture, T_1 is taken from the run on one node.
    #[arg(required = true, value_name = "MANIFEST")]
    manifests: Vec<PathBuf>,
    /// Writes a page with timeline, cost maps and predictions against measurements.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Prints the figures as JSON: a list with one object a run.
    #[arg(long)]
    json: bool,
}

/// Runs the subcommand.
pub fn run(args: Args) -> Result<()> {
    let manifests: Vec<Manifest> = args.manifests.iter().map(|path| manifest::read(path)).collect::<Result<_>>()?;
    if let Some(path) = &args.html {
        files::write_whole(path, report::html(&manifests).as_bytes())?;
        eprintln!("wrote {}", path.display());
    }
    if args.json {
        let text = serde_json::to_string_pretty(&report::runs(&manifests));
        println!("{}", text.map_err(|error| Error::new(ExitCode::Internal, format!("the report cannot be coded: {error}")))?);
        return Ok(());
    }
    let style = Style { color: std::io::stdout().is_terminal() };
    if let [manifest] = manifests.as_slice() {
        println!("{}", report::text(manifest, &[], style));
    }
    print!("{}", report::table(&manifests, style));
    Ok(())
}
