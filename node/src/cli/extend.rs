//! `tessera render --extend`: further samples for a picture that stands in the folder, without taking again those that it has.
//!
//! Each step renders as many samples as the picture has, as a job of its own, and joins both. What stands in the folder is a picture after each step: the same bytes that a job
//! with so many samples writes.

use std::path::{Path, PathBuf};

use tessera_engine::{
    description::{Aov, Quality},
    film::Film,
    output::exr,
};

use super::{
    client::Client,
    farewell::Farewell,
    progress::Show,
    render::{outcome, report},
    script::Script,
    sequence::{self, Submitted},
};
use crate::{
    coordinator::{identity, write_pictures},
    error::{Error, ExitCode, Result},
    job::{JobDescription, LoadedJob, PixelType, not_extended},
    manifest::{self, ImageEntry, Manifest},
    wire::Terms,
};

/// A picture that is extended to that of a description.
struct Extension<'a> {
    description: &'a JobDescription,
    folder: &'a Path,
    film: Film,
    samples: u32,
    /// Samples of the picture at the beginning.
    from: u32,
    /// Invalid samples that it has, as far as its manifest says.
    invalid: u64,
}

/// Extends the picture in a folder to that of a job, and shows what came of it.
///
/// # Errors
/// [`ExitCode::Usage`] when the job is none that can be extended, [`ExitCode::File`] when there is no picture of it with fewer samples; those of the jobs.
pub async fn extend(
    client: &Client,
    script: &Script,
    loaded: LoadedJob,
    terms: Terms,
    show: Show,
    folder: &Path,
    farewell: &Farewell,
) -> Result<()> {
    if loaded.sequence(&script.parameters()).is_some() {
        return Err(refused("a sequence of frames").with_help("choose one of them with --set frame=NUMBER"));
    }
    let LoadedJob { description, assets, .. } = loaded;
    let mut extension = Extension::begin(&description, folder)?;
    let mut progress = show.progress();
    progress.say(&format!("{}: has {} of {} samples", description.output.exr, extension.samples, description.frame.quality.samples));
    let mut files = Vec::new();
    while let Some(step) = extension.step() {
        let job = client.submit_patiently(&step, &assets, &terms, &progress).await?;
        progress.submitted(job.0);
        farewell.now(job.0);
        let begun = Submitted::alone(job, &step);
        let parts = tempfile::Builder::new()
            .prefix("tessera-")
            .tempdir()
            .map_err(|error| Error::new(ExitCode::File, format!("a temporary folder: {error}")))?;
        outcome(sequence::watch(client, &begun, show).await?)?;
        client.fetch(job, parts.path(), &mut progress).await?;
        files = extension.add(&step, parts.path())?;
    }
    if files.is_empty() {
        return extension.complete();
    }
    report(show, &files, &folder.join(&description.output.manifest), &description.warnings)
}

impl<'a> Extension<'a> {
    /// Of the picture in a folder.
    fn begin(description: &'a JobDescription, folder: &'a Path) -> Result<Self> {
        let JobDescription { frame, output, .. } = description;
        let Quality { samples: wanted, first } = frame.quality;
        let path = folder.join(&output.exr);
        match () {
            () if !wanted.is_power_of_two() => {
                return Err(refused(&format!("a picture to {wanted} samples")).with_help("take a power of two: 64, 128, 256, ..."));
            }
            () if first != 0 => return Err(refused("a job whose samples do not begin at number 0")),
            () if !frame.aovs.contains(Aov::Residual) || output.pixel_type != PixelType::Float => {
                return Err(refused("a picture that does not tell its sums").with_help(
                    "ask for output = { aovs = { \"residual\" } }, with floats of 32 bits, before the first samples are taken",
                ));
            }
            () => {}
        }
        if let Some(fixed) = not_extended(frame.aovs) {
            return Err(refused(&format!("what {fixed} tells")).with_help("leave that out, and render it by a job of its own"));
        }
        let exr::Picture { film, identity: found } = exr::read(&path).map_err(|error| {
            Error::new(ExitCode::File, error.to_string()).with_help("--extend adds to a picture that an earlier run left in this folder")
        })?;
        let other = |why: &str| Error::new(ExitCode::File, format!("{}: {why}", path.display()));
        let found = found.ok_or_else(|| other("not a picture of this program"))?;
        if !found.holes.is_empty() {
            return Err(other("it has holes, which further samples do not fill").with_help("render it anew, without --extend"));
        }
        let is_named =
            |samples: &u32| identity(&with(description, Quality::of(*samples))).is_ok_and(|name| name.image_hash == found.image_hash);
        let samples = (0..=wanted.trailing_zeros()).rev().map(|power| 1 << power).find(is_named);
        let samples = samples.ok_or_else(|| {
            other(&format!("it is not the picture of this job with {wanted} samples, nor with a half, a quarter and so on of them"))
                .with_help("only samples may differ: not the scene, its parameters, the seed, or the program's revision")
        })?;
        // That of an earlier picture, where a run ended between the files.
        let told = manifest::read(&folder.join(&output.manifest)).ok().filter(|told| told.image.image_hash == found.image_hash);
        if told.as_ref().is_some_and(|told| told.image.pixels_hash != blake3::Hash::from_bytes(film.hash()).to_string()) {
            return Err(Error::new(ExitCode::Verify, format!("{}: its pixels are not those that were rendered", path.display()))
                .with_help("it was changed since, or is damaged: render it anew, without --extend"));
        }
        let invalid = told.map_or(0, |told| told.image.invalid_samples);
        Ok(Self { description, folder, film, samples, from: samples, invalid })
    }

    /// The job whose samples double those that there are; `None` where there are enough.
    fn step(&self) -> Option<JobDescription> {
        let quality = Quality { samples: self.samples, first: self.samples.into() };
        (self.samples < self.description.frame.quality.samples).then(|| with(self.description, quality))
    }

    /// Writes what may be missing beside a picture that has all samples.
    fn complete(&self) -> Result<()> {
        let path = self.folder.join(&self.description.output.manifest);
        match manifest::read(&path) {
            Ok(told) => self.write(told).map(drop),
            Err(_) => self.write_pictures().map(drop),
        }
    }

    /// Joins what a step came to, and writes the picture. Returns the files.
    fn add(&mut self, step: &JobDescription, parts: &Path) -> Result<Vec<PathBuf>> {
        let read = exr::read(&parts.join(&step.output.exr)).map_err(|error| Error::new(ExitCode::File, error.to_string()))?;
        let told = manifest::read(&parts.join(&step.output.manifest))?;
        let joined = self.film.joined(&read.film, self.samples.into());
        self.film = joined.ok_or_else(|| Error::new(ExitCode::File, "the pictures of both halves do not fit each other"))?;
        (self.samples, self.invalid) = (self.samples * 2, self.invalid + told.image.invalid_samples);
        self.write(told)
    }

    /// Writes the picture, and a manifest that tells how it came to be. Returns the files.
    fn write(&self, mut told: Manifest) -> Result<Vec<PathBuf>> {
        let image = self.write_pictures()?;
        let is_known = told.image.image_hash == image.image_hash;
        let extended_from = if is_known { told.image.extended_from } else { Some(self.from.into()) };
        told.image = ImageEntry { invalid_samples: self.invalid, extended_from, ..image };
        let output = &self.description.output;
        let path = self.folder.join(&output.manifest);
        manifest::write(&path, &told)?;
        let pictures = [Some(&output.exr), output.png.as_ref()].into_iter().flatten().map(|name| self.folder.join(name));
        Ok(pictures.chain([path]).collect())
    }

    fn write_pictures(&self) -> Result<ImageEntry> {
        let whole = with(self.description, Quality::of(self.samples));
        let identity = identity(&whole).map_err(|error| Error::new(ExitCode::Internal, error))?;
        write_pictures(&whole, &identity, &self.film, &[], self.folder).map_err(|error| Error::new(ExitCode::File, error))
    }
}

/// The same job with other samples.
fn with(description: &JobDescription, quality: Quality) -> JobDescription {
    let mut description = description.clone();
    description.frame.quality = quality;
    description
}

fn refused(what: &str) -> Error {
    Error::new(ExitCode::Usage, format!("--extend does not extend {what}"))
}
