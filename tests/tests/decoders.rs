//! Decoders of bytes from outside, fed with the seeds of their fuzz targets: those that are whole, and those that once failed.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use tessera_tests::decoders::{ALL, seeds};

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz").join(name)
}

/// Names in a folder, without their endings.
fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    entries.map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned()).collect()
}

/// Seeds that are called `found-...` once failed, or show what is refused; all others are whole, or fuzzing would begin with nothing.
#[test]
fn seeds_are_decoded_or_refused() {
    let mut wrong = Vec::new();
    for (target, check) in ALL {
        let seeds = folder("seeds").join(target);
        for name in names(&seeds) {
            let accepted = check(&fs::read(seeds.join(&name)).unwrap());
            if !accepted && !name.starts_with("found-") {
                wrong.push(format!("{target}/{name}"));
            }
        }
    }
    assert!(wrong.is_empty(), "these seeds are refused; TESSERA_BLESS=1 makes those of our own codings anew: {wrong:?}");
}

#[test]
fn every_decoder_has_a_target_and_seeds() {
    let known: BTreeSet<String> = ALL.map(|(name, _)| name.to_owned()).into();
    assert_eq!(names(&folder("fuzz_targets")), known);
    assert_eq!(names(&folder("seeds")), known);
    let manifest = fs::read_to_string(folder("Cargo.toml")).unwrap();
    let built = manifest.lines().filter_map(|line| line.strip_prefix("path = \"fuzz_targets/")?.strip_suffix(".rs\""));
    assert_eq!(built.map(str::to_owned).collect::<BTreeSet<_>>(), known);
}

#[test]
fn seeds_of_our_own_codings_are_those_that_are_made_now() {
    let bless = std::env::var_os("TESSERA_BLESS").is_some();
    let mut old = Vec::new();
    for (target, name, bytes) in seeds::made() {
        let path = folder("seeds").join(target).join(&name);
        if bless {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, &bytes).unwrap();
        }
        if fs::read(&path).ok().as_ref() != Some(&bytes) {
            old.push(format!("{target}/{name}"));
        }
    }
    assert!(old.is_empty(), "TESSERA_BLESS=1 makes these seeds anew: {old:?}");
}

/// These are different whenever they are made.
#[test]
fn seeds_with_keys_are_made_once() {
    for (target, name, bytes) in seeds::made_once() {
        let path = folder("seeds").join(target).join(&name);
        if std::env::var_os("TESSERA_BLESS").is_some() && !path.exists() {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, bytes).unwrap();
        }
        assert!(path.exists(), "TESSERA_BLESS=1 makes {target}/{name}");
    }
}
