//! From committed parts to files.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant, UNIX_EPOCH},
};

use tessera_engine::{
    output::{Rows, exr, png},
    part::Rect,
};

use super::{bands::Bands, disk::Pixels, store::StoredJob};
use crate::{
    farm::{JobId, JobRecord, LeaseId},
    job::{JobDescription, PixelType},
    manifest::{self, ImageEntry, ReportEntry, Submission},
    schedule::{Assign, PartId, Split},
};

/// All that the files of a job are made of.
pub struct Assembly {
    /// The job.
    pub job: JobId,
    /// What was submitted.
    pub stored: Arc<StoredJob>,
    /// What happened.
    pub record: JobRecord,
    /// Where the pixels are.
    pub parts: Vec<(PartId, Rect, LeaseId)>,
    /// What no node could render.
    pub holes: Vec<Rect>,
    /// Where the files go.
    pub files: PathBuf,
    /// When `record` was made.
    pub made: Instant,
}

/// Why there are no files, in words.
pub enum Refusal {
    /// The pixels of a part cannot be read back: they never will.
    Pixels(PartId, String),
    /// The disk refuses the files: it may have room again.
    Files(String),
}

/// Writes EXR, PNG and manifest, each whole or not at all; the manifest last, so that where it stands all stand. Returns what came of the job.
///
/// # Errors
/// Pixels that cannot be read back, or a disk that refuses.
pub fn write(assembly: &Assembly, pixels: &Pixels) -> Result<ReportEntry, Refusal> {
    let frame = &assembly.stored.description.frame;
    let reader = pixels.reader(assembly.job).map_err(|error| Refusal::Files(error.to_string()))?;
    let mut bands = Bands::new((frame.film.width, frame.film.height), frame.aovs, reader, &assembly.parts);
    write_files(assembly, &mut bands).map_err(|reason| match bands.unreadable {
        Some((part, reason)) => Refusal::Pixels(part, reason),
        None => Refusal::Files(reason),
    })
}

fn write_files(assembly: &Assembly, picture: &mut Bands) -> Result<ReportEntry, String> {
    let Assembly { job, stored, record, .. } = assembly;
    // Whoever puts the picture together may be of a later build than those who rendered it.
    let mut identity = identity(&stored.description)?;
    if record.build.is_some_and(|build| build.revision == stored.revision) {
        (identity.image_hash, identity.engine_revision) = (stored.image_hash.clone(), stored.revision);
    }
    let mut image = write_pictures(&stored.description, &identity, picture, &assembly.holes, &assembly.files)?;
    image.invalid_samples = record.parts.iter().map(|part| part.invalid_samples).sum();
    let submission = Submission {
        id: job.0,
        name: stored.description.name.clone(),
        parameters: stored.description.parameters.clone(),
        submitted: UNIX_EPOCH + Duration::from_secs(stored.submitted),
        warnings: stored.description.warnings.clone(),
    };
    let total = record.seconds + assembly.made.elapsed().as_secs_f64();
    let manifest = manifest::build(submission, image, facts(&stored.description, record.clone()), total);
    manifest::write(&assembly.files.join(&stored.description.output.manifest), &manifest).map_err(|error| error.to_string())?;
    Ok(manifest.report)
}

/// What the picture of a job is called, if this build renders it.
///
/// # Errors
/// In words, when its description cannot be coded.
pub fn identity(description: &JobDescription) -> Result<exr::Identity, String> {
    let hash = description.frame.hash().map_err(|error| error.to_string())?;
    Ok(exr::Identity::new(hash, description.frame.seed))
}

/// Writes the EXR and the preview into a folder, and says what there is to know of them but for samples that were invalid: pixels do not tell. Holes are black in the one, and marked in the other.
///
/// # Errors
/// In words, when the disk refuses.
pub fn write_pictures(
    description: &JobDescription,
    identity: &exr::Identity,
    mut picture: impl Rows,
    holes: &[Rect],
    folder: &Path,
) -> Result<ImageEntry, String> {
    let JobDescription { frame, output, .. } = description;
    let (written, noted) = match output.pixel_type {
        PixelType::Float => (exr::PixelType::Float, manifest::PixelType::Float),
        PixelType::Half => (exr::PixelType::Half, manifest::PixelType::Half),
    };
    let path = folder.join(&output.exr);
    let holes: Vec<[u32; 4]> = holes.iter().map(|hole| [hole.x, hole.y, hole.width, hole.height]).collect();
    let identity = exr::Identity { holes: holes.clone(), ..identity.clone() };
    let exr::Written { hash: pixels_hash, clamped, is_black } =
        exr::write(&path, &mut picture, written, &identity).map_err(|error| error.to_string())?;
    let (width, height) = picture.size();
    if let Some(name) = &output.png {
        png::write(&folder.join(name), &mut picture, &holes, output.exposure).map_err(|error| error.to_string())?;
    }
    Ok(ImageEntry {
        exr: output.exr.clone(),
        png: output.png.clone(),
        width,
        height,
        samples: u64::from(frame.quality.samples),
        extended_from: None,
        seed: frame.seed,
        image_hash: identity.image_hash,
        pixel_type: noted,
        aovs: picture.aovs().iter().map(|aov| aov.name().to_owned()).collect(),
        pixels_hash: blake3::Hash::from_bytes(pixels_hash).to_string(),
        clamped,
        is_black,
        invalid_samples: 0,
        holes,
    })
}

fn facts(description: &JobDescription, record: JobRecord) -> manifest::JobRecord {
    manifest::JobRecord {
        split: split_words(&description.split),
        assign: assign_words(description.assign).to_owned(),
        outcome: if record.holes == 0 { "finished".to_owned() } else { format!("incomplete: {} holes", record.holes) },
        probe: record.probe,
        nodes: record.nodes,
        parts: record.parts,
        events: record.events,
        warnings: record.warnings,
    }
}

/// A split in words.
pub fn split_words(split: &Split) -> String {
    match split {
        Split::Grid { width, height } => format!("grid of {width} x {height} pixels"),
        Split::Strips { count } => format!("{count} strips"),
        Split::Script => "the script's own".to_owned(),
    }
}

/// An assignment in words.
pub fn assign_words(assign: Assign) -> &'static str {
    match assign {
        Assign::Naive => "naive",
        Assign::Paper => "paper",
        Assign::EarliestFinish => "earliest_finish",
        Assign::Script => "the script's own",
    }
}
