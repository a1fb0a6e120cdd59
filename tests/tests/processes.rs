//! Nodes and coordinators that die, stop, hang, slow down and come back: real processes, and each time the bytes of an undisturbed run.

use std::{
    fs, thread,
    time::{Duration, Instant},
};

use rustix::process::Signal;
use tessera_node::simulate::Random;
use tessera_tests::{
    farm::{JOB, Program, signal},
    rig::{Rig, SAMPLES, assert_once, attempts, committed, events, id, is_in, list, undisturbed, wait_until},
};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");
const SABOTEUR: &str = env!("CARGO_BIN_EXE_tessera-saboteur");

fn time(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn a_node_killed_and_restarted_comes_back_with_a_new_life() {
    let mut rig = Rig::new(BINARY, &["attic"], 1);
    rig.start("attic");
    let job = rig.submit(&[]);
    rig.wait_for_parts(8);
    rig.kill("attic");
    rig.start("attic");
    let manifest = rig.finished(&job, BINARY);
    let over = events(&manifest, "lost");
    assert_eq!(over.len(), 1, "{over:?}");
    assert_eq!(over[0]["detail"], "it started anew");
    let lost: Vec<_> = attempts(&manifest).into_iter().filter(|attempt| attempt["outcome"] == "lost").collect();
    // How many, depends on how long the lane had to wait for parts before: on this machine's disk and load.
    assert!(lost.iter().all(|attempt| attempt["end"] == over[0]["time"]), "what its old life held, and nothing later: {lost:#?}");
    let begun = attempts(&manifest).into_iter().map(|attempt| time(&attempt["start"])).filter(|start| *start > time(&over[0]["time"]));
    println!("back at work {:.3} s after its new life joined", begun.fold(f64::INFINITY, f64::min) - time(&over[0]["time"]));
}

/// What it had rendered for its old life is void; the parts are rendered again, each once.
#[test]
fn a_node_that_returns_after_it_was_declared_dead_commits_nothing_stale() {
    let mut rig = Rig::new(BINARY, &["attic"], 2);
    rig.start("attic");
    let job = rig.submit(&[]);
    rig.wait_for_parts(8);
    rig.signal("attic", Signal::STOP);
    rig.wait_for_node("attic", "suspected");
    rig.wait_for_node("attic", "lost");
    rig.signal("attic", Signal::CONT);
    let manifest = rig.finished(&job, BINARY);
    let over = time(&events(&manifest, "lost")[0]["time"]);
    let stale = attempts(&manifest).into_iter().filter(|attempt| time(&attempt["start"]) < over && time(&attempt["end"]) > over);
    assert!(stale.clone().all(|attempt| attempt["outcome"] != "committed"), "{:?}", stale.collect::<Vec<_>>());
}

/// The connection lives, its heartbeats come: only the progress tells.
#[test]
fn a_wedged_lane_is_flagged_and_its_part_goes_elsewhere() {
    let mut rig = Rig::new(BINARY, &["attic", "cellar"], 3);
    rig.start("attic");
    rig.start_saboteur(SABOTEUR, "cellar", "hangs");
    rig.wait_until_ready(&["attic", "cellar"]);
    let job = rig.submit(&["--min-nodes", "2"]);
    let manifest = rig.finished(&job, BINARY);
    let cellar = id(&manifest, "cellar");
    let overdue = events(&manifest, "overdue");
    let speculated = events(&manifest, "speculated");
    assert!(!overdue.is_empty() || !speculated.is_empty(), "nobody noticed: {:#}", manifest["events"]);
    assert!(events(&manifest, "lost").is_empty() && events(&manifest, "suspected").iter().all(|event| event["node"] != cellar));
    assert!(rig.runs("cellar"), "its process lives, and its connection too");
}

/// There is so much left to do that nobody helps because of idleness: progress alone tells.
#[test]
fn a_wedged_lane_is_overdue_long_before_the_job_ends() {
    let mut rig = Rig::new(BINARY, &["attic", "cellar"], 4);
    rig.start("attic");
    rig.start_saboteur(SABOTEUR, "cellar", "hangs");
    rig.wait_until_ready(&["attic", "cellar"]);
    let submitted = rig.client(&["submit", "job.lua", "--min-nodes", "2", "--set", "samples=200"]);
    assert_eq!(submitted.code, Some(0), "{}", submitted.errors);
    let outcome = rig.outcome(&submitted.lines[0]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.errors);
    assert_once(&outcome.manifest);
    let overdue = events(&outcome.manifest, "overdue");
    assert!(overdue.iter().any(|event| event["node"] == id(&outcome.manifest, "cellar")), "{:#}", outcome.manifest["events"]);
}

/// Nodes go on meanwhile, and hand in afterwards what they rendered.
#[test]
fn a_coordinator_killed_at_random_moments_renders_no_committed_part_again() {
    const SEEDS: u64 = 3;
    let mut slowest = Duration::ZERO;
    for seed in 0..SEEDS {
        let mut random = Random::new(seed);
        let mut rig = Rig::new(BINARY, &["attic", "cellar"], seed);
        ["attic", "cellar"].iter().for_each(|name| rig.start(name));
        rig.wait_until_ready(&["attic", "cellar"]);
        let job = rig.submit(&["--min-nodes", "2"]);
        let mut seen = 0;
        for _ in 0..3 {
            thread::sleep(random.seconds(0.0, 0.4));
            rig.kill_coordinator();
            thread::sleep(random.seconds(0.0, 0.5));
            slowest = slowest.max(rig.restart_coordinator());
            let status = rig.wait(|status| !list(&status["jobs"]).is_empty());
            let now = committed(&status["jobs"][0]);
            assert!(now >= seen, "seed {seed}: of {seen} committed parts {now} are left");
            seen = now;
        }
        rig.finished(&job, BINARY);
    }
    println!("a coordinator listens again after {slowest:?} at the most");
}

#[test]
fn what_nodes_render_while_the_coordinator_is_away_is_handed_in_afterwards() {
    let mut rig = Rig::new(BINARY, &["attic"], 5);
    rig.start("attic");
    let job = rig.submit(&[]);
    let before = rig.wait_for_parts(8);
    rig.kill_coordinator();
    // Long enough for the part that it renders: heartbeats fail meanwhile.
    rig.node("attic").wait_for_complaint("not connected");
    rig.restart_coordinator();
    let manifest = rig.finished(&job, BINARY);
    assert!(committed(&before["jobs"][0]) >= 8);
    let lost: Vec<_> = attempts(&manifest).into_iter().filter(|attempt| attempt["outcome"] != "committed").collect();
    assert!(lost.is_empty(), "with one node no part has a reason to be tried twice: {lost:#?}");
}

/// The farm goes on with the job, and who waits for it need not do anything.
#[test]
fn a_client_that_waits_gets_its_files_though_the_coordinator_was_away() {
    let mut rig = Rig::new(BINARY, &["attic"], 9);
    rig.start("attic");
    let arguments = ["render", "job.lua", "--set", SAMPLES, "-o", "out", "--coordinator", &rig.address, "--keys", "keys"];
    let client = rig.program.start(&arguments);
    rig.wait_for_parts(8);
    rig.kill_coordinator();
    thread::sleep(Duration::from_secs(1));
    rig.restart_coordinator();
    let done = client.finish();
    assert_eq!(done.code, Some(0), "{}", done.errors);
    for said in ["is lost", "waiting for it to come back with job 1", "is back"] {
        assert!(done.errors.contains(said), "it never said {said:?}: {}", done.errors);
    }
    assert!(fs::read(rig.program.path("out/job.exr")).unwrap() == undisturbed(BINARY));
}

/// A coordinator that has lost its folder gives the number to another job: its files are not those that were asked for.
#[test]
fn a_client_that_waits_takes_no_other_job_of_the_same_number_for_its_own() {
    let mut rig = Rig::new(BINARY, &["attic"], 10);
    let arguments = ["render", "job.lua", "--set", SAMPLES, "-o", "out", "--coordinator", &rig.address, "--keys", "keys"];
    let client = rig.program.start(&arguments);
    rig.wait_for_parts(0);
    rig.kill_coordinator();
    // Moments of submission are told in seconds.
    thread::sleep(Duration::from_secs(2));
    fs::remove_dir_all(rig.program.path("data")).unwrap();
    rig.restart_coordinator();
    assert_eq!(rig.submit(&[]), "1");
    rig.start("attic");
    let done = client.finish();
    assert_eq!(done.code, Some(5), "{}", done.errors);
    assert!(done.errors.contains("does not have job 1 (job) any more"), "{}", done.errors);
    assert!(!rig.program.path("out/job.exr").exists());
}

#[test]
fn a_client_that_is_interrupted_says_that_the_farm_goes_on() {
    let rig = Rig::new(BINARY, &["attic"], 11);
    let farm = ["--coordinator", rig.address.as_str(), "--keys", "keys"];
    let interrupted = |arguments: &[&str], job: &str| {
        let client = rig.program.start(&[arguments, &farm].concat());
        client.wait_for_complaint("preparing: 0 nodes");
        signal(client.pid(), Signal::INT);
        let done = client.finish();
        assert_eq!(done.code, Some(130), "{}", done.errors);
        let said = format!("the farm goes on with it; `tessera cancel {job}` ends that");
        assert!(done.errors.contains(&said), "{arguments:?} {}", done.errors);
    };
    interrupted(&["render", "job.lua", "-o", "out"], "1");
    interrupted(&["watch", "1"], "1");
    interrupted(&["submit", "job.lua", "--wait", "-o", "out"], "2");
}

#[test]
fn fourteen_of_fifteen_nodes_die_then_all_then_some_come_back() {
    let names: Vec<String> = (1..=15).map(|number| format!("node-{number}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut rig = Rig::new(BINARY, &names, 6);
    names.iter().for_each(|name| rig.start(name));
    rig.wait_until_ready(&names);
    let job = rig.submit(&["--min-nodes", "15"]);
    rig.wait_for_parts(5);
    names[1..].iter().for_each(|name| rig.kill(name));
    let left = rig.wait(|status| names[1..].iter().all(|name| !is_in(status, name, "ready")));
    let now = committed(&left["jobs"][0]);
    rig.wait_for_parts((now + 3).min(40));
    rig.kill(names[0]);
    rig.wait(|status| names.iter().all(|name| !is_in(status, name, "ready")));
    names[3..5].iter().for_each(|name| rig.start(name));
    rig.finished(&job, BINARY);
}

/// Under a policy that looks at what is left; `assign.paper` deals all parts out at the beginning.
#[test]
fn a_node_that_joins_mid_render_works_at_once() {
    let mut rig = Rig::new(BINARY, &["attic", "cellar"], 7);
    fs::write(rig.program.path("job.lua"), JOB.replace("assign.paper", "assign.earliest_finish")).unwrap();
    rig.start("attic");
    let job = rig.submit(&[]);
    rig.wait_for_parts(5);
    rig.start("cellar");
    let manifest = rig.finished(&job, BINARY);
    let cellar = id(&manifest, "cellar");
    let theirs: Vec<_> = attempts(&manifest).into_iter().filter(|attempt| attempt["node"] == cellar).collect();
    let joined = events(&manifest, "joined").into_iter().find(|event| event["node"] == cellar).unwrap();
    let first = theirs.iter().map(|attempt| time(&attempt["start"])).fold(f64::INFINITY, f64::min);
    assert!(theirs.iter().any(|attempt| attempt["outcome"] == "committed"), "it helped: {theirs:?}");
    println!("its first part came {:.3} s after it joined", first - time(&joined["time"]));
}

/// Stopped for 60 of every 100 ms: too short to be suspected.
#[test]
fn a_node_slowed_down_halfway_keeps_its_life() {
    let mut rig = Rig::new(BINARY, &["attic", "cellar"], 8);
    ["attic", "cellar"].iter().for_each(|name| rig.start(name));
    rig.wait_until_ready(&["attic", "cellar"]);
    let job = rig.submit(&["--min-nodes", "2"]);
    rig.wait_for_parts(20);
    let slow = rig.node("cellar").pid();
    let begin = Instant::now();
    let mut watching = rig.program.start(&["watch", &job, "--quiet", "--coordinator", &rig.address, "--keys", "keys"]);
    while !watching.has_ended() {
        signal(slow, Signal::STOP);
        thread::sleep(Duration::from_millis(60));
        signal(slow, Signal::CONT);
        thread::sleep(Duration::from_millis(40));
    }
    let done = begin.elapsed();
    let manifest = rig.finished(&job, BINARY);
    assert!(events(&manifest, "lost").is_empty(), "{:#}", manifest["events"]);
    println!("the second half took {done:?} with one of two nodes 60 % slower");
}

#[test]
fn a_node_that_miscomputes_is_quarantined_and_all_it_rendered_is_rendered_again() {
    let mut rig = Rig::new(BINARY, &["attic", "barn", "cellar"], 9);
    rig.start("attic");
    rig.start_saboteur(SABOTEUR, "barn", "miscomputes");
    rig.start("cellar");
    rig.wait_until_ready(&["attic", "barn", "cellar"]);
    let job = rig.submit(&["--min-nodes", "3", "--set", "audit=1"]);
    let manifest = rig.finished(&job, BINARY);
    let barn = id(&manifest, "barn");
    assert!(events(&manifest, "quarantined").iter().any(|event| event["node"] == barn), "{:#}", manifest["events"]);
    let attempts = attempts(&manifest);
    let of_barn = |outcome: &str| attempts.iter().filter(|attempt| attempt["node"] == barn && attempt["outcome"] == outcome).count();
    assert_eq!(of_barn("committed"), 0, "nothing of it is in the picture");
    assert!(of_barn("revoked") > 0, "what it had delivered before was revoked");
    rig.wait_for_node("barn", "quarantined");
    rig.start("barn");
    rig.node("barn").wait_for_complaint("quarantine");
    assert_eq!(rig.client(&["release", "barn"]).code, Some(0));
    rig.wait_for_node("barn", "ready");
}

/// Every node dies of one pixel, and is started again by its service manager; the rest of the picture is delivered.
#[test]
fn a_poison_part_becomes_a_small_hole_and_the_exit_code_says_so() {
    const NAMES: [&str; 3] = ["attic", "barn", "cellar"];
    let mut rig = Rig::new(BINARY, &NAMES, 10);
    NAMES.iter().for_each(|name| rig.start_saboteur(SABOTEUR, name, "crashes"));
    rig.wait_until_ready(&NAMES);
    let job = rig.submit(&["--min-nodes", "3"]);
    let mut watching = rig.program.start(&["watch", &job, "--quiet", "--coordinator", &rig.address, "--keys", "keys"]);
    let mut deaths = 0;
    wait_until("the job ends", || {
        for name in NAMES {
            if !rig.runs(name) {
                deaths += 1;
                rig.start_saboteur(SABOTEUR, name, "crashes");
            }
        }
        watching.has_ended()
    });
    let outcome = rig.fetched(&job, watching.finish());
    assert_eq!(outcome.code, Some(9), "{}", outcome.errors);
    assert_once(&outcome.manifest);
    let holes = list(&outcome.manifest["image"]["holes"]);
    assert_eq!(holes.len(), 1, "{holes:?}");
    let hole: Vec<u32> = list(&holes[0]).iter().map(|number| u32::try_from(number.as_u64().unwrap()).unwrap()).collect();
    assert_eq!(hole[2..], [8, 8]);
    println!("{deaths} deaths until the hole of 8 x 8 pixels was found");
    assert_same_but_for(&outcome.exr, &hole);
}

fn assert_same_but_for(exr: &std::path::Path, hole: &[u32]) {
    let program = Program::new(BINARY);
    fs::write(program.path("whole.exr"), undisturbed(BINARY)).unwrap();
    let [picture, whole] = [exr, &program.path("whole.exr")].map(|path| tessera_engine::output::exr::read(path).unwrap().film);
    let width = whole.width();
    for (at, (pixel, expected)) in (0_u32..).zip(picture.pixels().iter().zip(whole.pixels())) {
        let (x, y) = (at % width, at / width);
        let inside = (hole[0]..hole[0] + hole[2]).contains(&x) && (hole[1]..hole[1] + hole[3]).contains(&y);
        assert_eq!(*pixel, if inside { [0.0; 3] } else { *expected }, "at {x}, {y}");
    }
}
