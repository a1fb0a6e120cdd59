//! `tessera verify`: an output against its manifest, or the farm against its promises.

use std::{
    io::ErrorKind,
    path::{Path, PathBuf},
};

use tessera_engine::{
    REVISION,
    description::Aov,
    film::Film,
    output::exr::{self, Picture},
    part::{Counters, Rect, RenderedPart},
};

use super::verify_farm;
use crate::{
    error::{Error, ExitCode, Result},
    manifest::{self, Manifest, PartEntry, PixelType},
};

const AGAIN: &str = "render it again: the bytes of a picture are the same every time";

/// Checks a picture against its manifest: size, identity, every pixel, and every part. Or, with `farm`, the farm itself.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Args {
    #[command(subcommand)]
    instead: Option<Instead>,
    /// The manifest, or the EXR beside which it stands.
    #[arg(value_name = "MANIFEST|EXR", required = true)]
    path: Option<PathBuf>,
    /// Prints the findings as JSON: a list of disagreements.
    #[arg(long)]
    json: bool,
}

/// What else can be verified.
#[derive(clap::Subcommand)]
enum Instead {
    /// Lets the scheduler survive thousands of schedules of faults on virtual time, and measures how well.
    Farm(verify_farm::Args),
}

/// Runs the subcommand.
pub fn run(args: Args) -> Result<()> {
    match (args.instead, args.path) {
        (Some(Instead::Farm(farm)), _) => verify_farm::run(&farm),
        (None, Some(path)) => picture(path, args.json),
        (None, None) => Err(Error::new(ExitCode::Usage, "neither a picture nor its manifest is named")),
    }
}

fn picture(named: PathBuf, json: bool) -> Result<()> {
    let path = manifest_beside(&named);
    let manifest = manifest::read(&path)?;
    let picture_path = match path == named {
        true => path.with_file_name(&manifest.image.exr),
        false => named,
    };
    let picture = exr::read(&picture_path).map_err(|error| match error.reason.kind() {
        ErrorKind::NotFound | ErrorKind::PermissionDenied => Error::new(ExitCode::File, error.to_string())
            .with_help("the picture has to stand beside its manifest, under the name that it was given"),
        _ => Error::new(ExitCode::Verify, format!("{} is damaged: {}", picture_path.display(), error.reason)).with_help(AGAIN),
    })?;
    let findings = disagreements(&manifest, &picture);
    if json {
        println!("{}", serde_json::json!({ "picture": picture_path, "manifest": path, "disagreements": findings }));
    }
    if !findings.is_empty() {
        let message = format!("{} does not agree with {}:\n  {}", picture_path.display(), path.display(), findings.join("\n  "));
        return Err(Error::new(ExitCode::Verify, message).with_help(AGAIN));
    }
    if !json {
        println!("{} agrees with {}: {}", picture_path.display(), path.display(), agreed(&manifest));
    }
    Ok(())
}

/// `name.manifest.json` for `name.exr`; any other name is the manifest's own.
fn manifest_beside(path: &Path) -> PathBuf {
    match path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr")) {
        true => path.with_extension("manifest.json"),
        false => path.to_owned(),
    }
}

fn agreed(manifest: &Manifest) -> String {
    let holes = match manifest.image.holes.len() {
        0 => String::new(),
        count => format!(" with {count} holes that no node could render"),
    };
    let pixels = format!("{} x {} pixels{holes}", manifest.image.width, manifest.image.height);
    match (manifest.image.pixel_type, manifest.image.extended_from) {
        (_, Some(from)) => format!("identity, {pixels} (extended from {from} samples to {})", manifest.image.samples),
        (PixelType::Float, None) => format!("identity, {pixels}, {} parts", manifest.parts.len()),
        (PixelType::Half, None) => format!("identity, {pixels} (parts were hashed before their numbers became half floats)"),
    }
}

/// Everything in which a picture differs from what its manifest says of it.
fn disagreements(manifest: &Manifest, picture: &Picture) -> Vec<String> {
    let mut findings = Vec::new();
    let (image, film) = (&manifest.image, &picture.film);
    match &picture.identity {
        None => findings.push("the picture has no identity: it was not written by this program, or was edited".to_owned()),
        Some(identity) => {
            if identity.image_hash != image.image_hash {
                findings.push(format!("image_hash is {}, but should be {}", identity.image_hash, image.image_hash));
            }
            if identity.holes != image.holes {
                findings.push(format!("its holes are {:?}, but should be {:?}", identity.holes, image.holes));
            }
            if identity.seed != image.seed {
                findings.push(format!("the seed is {}, but should be {}", identity.seed, image.seed));
            }
            if identity.engine_revision != REVISION {
                findings.push(format!("it was rendered by engine revision {}; this program has {REVISION}", identity.engine_revision));
            }
        }
    }
    if (film.width(), film.height()) != (image.width, image.height) {
        let (width, height) = (film.width(), film.height());
        findings.push(format!("it has {width} x {height} pixels, but should have {} x {}", image.width, image.height));
        return findings;
    }
    if film.aovs().iter().map(Aov::name).ne(image.aovs.iter().map(String::as_str)) {
        let words = film.aovs().iter().map(Aov::name).collect::<Vec<_>>().join(", ");
        findings.push(format!("beside colours it tells {{{words}}}, but should tell {{{}}}", image.aovs.join(", ")));
    }
    if hexadecimal(&film.hash()) != image.pixels_hash {
        findings.push("pixels are not those that were rendered".to_owned());
    }
    // Parts are those of what was added last.
    if image.pixel_type == PixelType::Float && image.extended_from.is_none() {
        findings.extend(manifest.parts.iter().filter_map(|part| part_disagreement(part, &image.holes, film)));
    }
    findings
}

fn part_disagreement(part: &PartEntry, holes: &[[u32; 4]], film: &Film) -> Option<String> {
    let [x, y, width, height] = part.rect;
    let name = format!("part {} ({width} x {height} at {x}, {y})", part.id.0);
    if !part.replaced_by.is_empty() || holes.contains(&part.rect) {
        return None;
    }
    let Some(promised) = &part.hash else { return Some(format!("{name} was never committed")) };
    match cut(film, Rect { x, y, width, height }) {
        Some(pixels) if hexadecimal(&pixels.hash()) == *promised => None,
        Some(_) => Some(format!("{name} differs from what was committed")),
        None => Some(format!("{name} lies beyond the frame")),
    }
}

/// The pixels of a rectangle, if it lies on the film.
fn cut(film: &Film, rect: Rect) -> Option<RenderedPart> {
    let inside = u64::from(rect.x) + u64::from(rect.width) <= u64::from(film.width());
    if !inside || u64::from(rect.y) + u64::from(rect.height) > u64::from(film.height()) {
        return None;
    }
    let rows = film.pixels().chunks_exact(film.width() as usize).skip(rect.y as usize).take(rect.height as usize);
    let pixels = rows.flat_map(|row| &row[rect.x as usize..][..rect.width as usize]).copied().collect();
    let numbers = film.aovs().numbers();
    let extra = (rect.y..rect.y + rect.height).flat_map(|y| {
        let first = y as usize * film.width() as usize + rect.x as usize;
        &film.extra()[first * numbers..][..rect.width as usize * numbers]
    });
    Some(RenderedPart { rect, pixels, extra: extra.copied().collect(), counters: Counters::default() })
}

fn hexadecimal(hash: &[u8; 32]) -> String {
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use tessera_engine::{description::FrameHash, output::exr::Identity};

    use super::*;
    use crate::manifest::example::Example;

    /// A picture of two parts with its manifest, in a folder.
    fn written(folder: &Path, change: impl FnOnce(&mut Vec<[f32; 3]>, &mut Manifest)) -> PathBuf {
        let mut pixels: Vec<_> = (0..64 * 32).map(|i| [i as f32 * 1e-3, 0.5, 0.25]).collect();
        let film = Film::from_pixels(64, 32, pixels.clone()).unwrap();
        let mut manifest = Example::new().node(0, 1, 1.0).part(1.0, 0, 0.0, 1.0).part(1.0, 0, 1.0, 2.0).manifest();
        manifest.image.height = 32;
        manifest.image.image_hash = FrameHash([7; 32]).to_string();
        manifest.image.pixels_hash = hexadecimal(&film.hash());
        for part in &mut manifest.parts {
            let [x, y, width, height] = part.rect;
            part.hash = Some(hexadecimal(&cut(&film, Rect { x, y, width, height }).unwrap().hash()));
        }
        change(&mut pixels, &mut manifest);
        let film = Film::from_pixels(64, 32, pixels).unwrap();
        exr::write(&folder.join("example.exr"), &film, exr::PixelType::Float, &Identity::new(FrameHash([7; 32]), 0)).unwrap();
        manifest::write(&folder.join("example.manifest.json"), &manifest).unwrap();
        folder.join("example.manifest.json")
    }

    fn verify(path: &Path) -> Result<()> {
        picture(path.to_owned(), false)
    }

    #[test]
    fn a_picture_agrees_with_its_manifest_by_either_name() {
        let folder = tempfile::tempdir().unwrap();
        let manifest = written(folder.path(), |_, _| ());
        verify(&manifest).unwrap();
        verify(&folder.path().join("example.exr")).unwrap();
    }

    #[test]
    fn one_changed_bit_is_found_and_placed() {
        let folder = tempfile::tempdir().unwrap();
        let manifest = written(folder.path(), |pixels, _| pixels[40][1] = f32::from_bits(0.5_f32.to_bits() + 1));
        let error = verify(&manifest).unwrap_err();
        assert_eq!(error.code, ExitCode::Verify);
        assert!(error.message.contains("part 1 (32 x 32 at 32, 0) differs"), "{error}");
        assert!(!error.message.contains("part 0 "), "{error}");
    }

    #[test]
    fn another_identity_size_or_a_missing_part_is_found() {
        type Break = fn(&mut Manifest);
        let broken: [(Break, &str); 5] = [
            (|manifest| manifest.image.image_hash = "00".repeat(32), "image_hash is 0707"),
            (|manifest| manifest.image.seed = 5, "the seed is 0, but should be 5"),
            (|manifest| manifest.image.width = 65, "64 x 32 pixels, but should have 65 x 32"),
            (|manifest| manifest.parts[1].hash = None, "part 1 (32 x 32 at 32, 0) was never committed"),
            (|manifest| manifest.parts[0].rect[3] = u32::MAX, "lies beyond the frame"),
        ];
        for (change, said) in broken {
            let folder = tempfile::tempdir().unwrap();
            let error = verify(&written(folder.path(), |_, manifest| change(manifest))).unwrap_err();
            assert_eq!(error.code, ExitCode::Verify);
            assert!(error.message.contains(said), "{error}");
        }
    }

    #[test]
    fn a_picture_that_is_not_there_is_a_matter_of_files() {
        let folder = tempfile::tempdir().unwrap();
        let manifest = written(folder.path(), |_, _| ());
        std::fs::remove_file(folder.path().join("example.exr")).unwrap();
        assert_eq!(verify(&manifest).unwrap_err().code, ExitCode::File);
        assert_eq!(verify(&folder.path().join("other.exr")).unwrap_err().code, ExitCode::File);
    }
}
