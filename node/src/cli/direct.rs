//! Rendering in this process without a farm: the plainest way from a job to its picture, against which the farm is held.

use std::path::{Path, PathBuf};

use tessera_engine::{
    description::Quality,
    part::{self, Rect, SampleRange},
    scene::Unbuilt,
};

use super::{here, progress::Show, render::check_samples};
use crate::{
    coordinator::{identity, write_pictures},
    error::{Error, ExitCode, Result},
    job::{JobDescription, Policies},
    limits::POLICY_TIMEOUT,
    manifest,
    schedule::{CostMap, NodeId, NodePower, Split, split},
};

/// Renders with `threads` threads, which take parts in the order of the split, and writes EXR and PNG.
///
/// # Errors
/// When the job's own split fails, or the folder refuses the files; or, when they stand, if too many samples are invalid.
pub fn render(description: &JobDescription, scene: Unbuilt, threads: u32, folder: &Path, show: Show) -> Result<Vec<PathBuf>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).build();
    let scene = pool.map_err(|error| Error::new(ExitCode::Internal, error.to_string()))?.install(|| part::prepared(scene.build()));
    let parts = parts(description, threads)?;
    let Quality { samples, first } = description.frame.quality;
    let samples = SampleRange { first, count: samples.into() };
    let (film, counters) = here::parts(&scene, &parts, samples, threads as usize, |_| ())?;
    let identity = identity(description).map_err(|error| Error::new(ExitCode::Internal, error))?;
    let image = write_pictures(description, &identity, &film, &[], folder).map_err(|error| Error::new(ExitCode::File, error))?;
    manifest::blackness(&image).into_iter().for_each(|warning| show.progress().say(&format!("warning: {warning}")));
    check_samples(counters.invalid_samples, counters.camera_rays)?;
    Ok([Some(&description.output.exr), description.output.png.as_ref()].into_iter().flatten().map(|name| folder.join(name)).collect())
}

fn parts(description: &JobDescription, threads: u32) -> Result<Vec<Rect>> {
    let (width, height) = (description.frame.film.width, description.frame.film.height);
    match (&description.split, &description.script) {
        (Split::Script, Some(bundle)) => {
            let this = NodePower { id: NodeId(0), name: "this process".to_owned(), lanes: threads, power: 1.0 };
            let even = CostMap { cell: width.max(height), columns: 1, rows: 1, seconds_per_pixel: vec![1.0] };
            Policies::new(bundle, &description.parameters)?
                .split(width, height, &even, &[this], POLICY_TIMEOUT)
                .map_err(|error| Error::new(ExitCode::Job, error))
        }
        (Split::Script, None) => Err(Error::new(ExitCode::Internal, "a split by a script that is not there")),
        (Split::Grid { width: columns, height: rows }, _) => Ok(split::grid(width, height, *columns, *rows)),
        (Split::Strips { count }, _) => Ok(split::strips(width, height, *count)),
    }
}
