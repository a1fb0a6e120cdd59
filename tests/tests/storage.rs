//! Disks that change what they were given, and disks that are full.

use std::{
    fs,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
    process::Command,
};

use tessera_tests::rig::{Rig, assert_once, attempts, committed, events, undisturbed};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

/// The coordinator's file with a job's pixels.
fn segment(data: &Path, job: &str) -> PathBuf {
    let name = format!("job-{job}.pixels");
    let folders = [data.to_owned(), data.join("journal")];
    folders.iter().map(|folder| folder.join(&name)).find(|path| path.exists()).expect("a file with pixels")
}

fn flip(path: &Path, at: u64) {
    let file = fs::OpenOptions::new().read(true).write(true).open(path).unwrap();
    let mut byte = [0];
    file.read_exact_at(&mut byte, at).unwrap();
    file.write_all_at(&[byte[0] ^ 1], at).unwrap();
}

/// One node that has rendered some parts of a job, and where their pixels are.
fn begun() -> (Rig, String, PathBuf) {
    let mut rig = Rig::new(BINARY, &["attic"], 1);
    rig.start("attic");
    let job = rig.submit(&[]);
    rig.wait_for_parts(8);
    let path = segment(&rig.program.path("data"), &job);
    (rig, job, path)
}

fn assert_rendered_again(rig: &Rig, job: &str) {
    let outcome = rig.outcome(job);
    assert_eq!(outcome.code, Some(0), "{}", outcome.errors);
    assert!(fs::read(&outcome.exr).unwrap() == undisturbed(BINARY), "a flipped bit is in the picture");
    let again = attempts(&outcome.manifest).iter().filter(|attempt| attempt["outcome"] == "lost").count();
    assert!(again > 0, "nobody noticed: {:#}", outcome.manifest["events"]);
    println!("{again} parts were rendered again, after {} events of it", events(&outcome.manifest, "revoked").len());
    assert_once(&outcome.manifest);
}

#[test]
fn a_bit_that_flips_on_the_coordinator_s_disk_is_caught_when_the_picture_is_made() {
    let (rig, job, path) = begun();
    flip(&path, 1000);
    assert_rendered_again(&rig, &job);
}

#[test]
fn a_bit_that_flips_while_the_coordinator_is_away_is_caught_when_it_starts() {
    let (mut rig, job, path) = begun();
    rig.kill_coordinator();
    flip(&path, 1000);
    rig.restart_coordinator();
    assert_rendered_again(&rig, &job);
}

/// A small file system of its own; it goes with the test.
struct Small(PathBuf);

impl Small {
    fn mount(at: &Path, mebibytes: u32) -> Option<Self> {
        fs::create_dir_all(at).unwrap();
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", &format!("size={mebibytes}m"), "tmpfs"]).arg(at).output();
        mounted.is_ok_and(|output| output.status.success()).then(|| Self(at.to_owned()))
    }
}

impl Drop for Small {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.0).status();
    }
}

#[test]
fn a_disk_that_is_full_keeps_the_job_until_there_is_room() {
    let mut rig = Rig::new(BINARY, &["attic"], 2);
    rig.kill_coordinator();
    let data = rig.program.path("data");
    fs::remove_dir_all(&data).unwrap();
    let Some(_disk) = Small::mount(&data, 16) else {
        println!("SKIPPED: a file system of a few MiB cannot be mounted here; it takes root");
        return;
    };
    fs::write(rig.program.path("farm.toml"), "[coordinator]\nfree_bytes = 0\n").unwrap();
    rig.coordinator_arguments = vec!["--config".to_owned(), "farm.toml".to_owned()];
    rig.restart_coordinator();
    rig.start("attic");
    let job = rig.submit(&[]);
    rig.wait_for_parts(8);
    // Nothing is left for anyone.
    let filler = data.join("filler");
    let written = fs::File::create(&filler).and_then(|mut file| std::io::copy(&mut std::io::repeat(0), &mut file));
    assert!(written.is_err(), "the disk took it all");
    rig.coordinator().wait_for_complaint("disk");
    let stuck = committed(&rig.wait(|_| true)["jobs"][0]);
    assert!(stuck < 48, "the job was done before the disk was full");
    fs::remove_file(&filler).unwrap();
    rig.finished(&job, BINARY);
}
