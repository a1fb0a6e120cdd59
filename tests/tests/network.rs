//! Bad networks between nodes and coordinator: partitions, loss, delay, disorder, damage, addresses that change. No life ends of it, no part is
//! committed twice, and the bytes are those of an undisturbed run.

use std::{fs, time::Duration};

use serde_json::Value;
use tessera_tests::{
    farm::JOB,
    relay::{BLOCKED, Way, Weather},
    rig::{Rig, attempts, committed, events, id, list},
};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

fn time(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// One node with a job that has begun.
fn alone(seed: u64) -> (Rig, String) {
    let mut rig = Rig::new(BINARY, &["attic"], seed);
    rig.start("attic");
    let job = rig.submit(&[]);
    rig.wait_for_parts(8);
    (rig, job)
}

fn assert_no_death(manifest: &Value) {
    assert!(events(manifest, "lost").is_empty(), "{:#}", manifest["events"]);
}

#[test]
fn a_silent_partition_gives_a_node_s_parts_to_others() {
    let mut rig = Rig::new(BINARY, &["attic", "cellar"], 1);
    ["attic", "cellar"].iter().for_each(|name| rig.start(name));
    rig.wait_until_ready(&["attic", "cellar"]);
    let job = rig.submit(&["--min-nodes", "2"]);
    rig.wait_for_parts(10);
    rig.relay("cellar").set_both(BLOCKED);
    let manifest = rig.finished(&job, BINARY);
    let cellar = id(&manifest, "cellar");
    assert!(events(&manifest, "suspected").iter().any(|event| event["node"] == cellar), "{:#}", manifest["events"]);
    let late = |attempt: &&Value| attempt["node"] == cellar && attempt["outcome"] == "committed";
    let suspected = time(&events(&manifest, "suspected")[0]["time"]);
    assert!(attempts(&manifest).iter().filter(late).all(|attempt| time(&attempt["end"]) <= suspected), "nothing came through");
    rig.relay("cellar").set_both(Weather::default());
    rig.wait_until_ready(&["cellar"]);
}

/// The node hears the coordinator, which does not hear it: what it reports is lost until the way is free again. Its lease still counts, once.
#[test]
fn a_completion_report_that_is_lost_one_way_leads_to_one_commit() {
    let (rig, job) = alone(2);
    rig.relay("attic").set(Way::Up, BLOCKED);
    rig.wait_for_node("attic", "suspected");
    rig.relay("attic").set(Way::Up, Weather::default());
    let manifest = rig.finished(&job, BINARY);
    assert_no_death(&manifest);
    let (suspected, recovered) = (events(&manifest, "suspected"), events(&manifest, "recovered"));
    let (silent, heard) = (time(&suspected[0]["time"]), time(&recovered[0]["time"]));
    let spans = |attempt: &&Value| time(&attempt["start"]) < silent && attempt["end"].as_f64().is_some_and(|end| end >= heard);
    let attempts = attempts(&manifest);
    let spanning: Vec<&Value> = attempts.iter().filter(spans).collect();
    assert!(spanning.iter().any(|attempt| attempt["outcome"] == "committed"), "what was rendered meanwhile counts: {spanning:#?}");
}

/// The coordinator commits what it hears, and the node never hears of it: it connects anew and hands in again, and nothing is committed twice.
#[test]
fn an_acknowledgement_that_is_lost_one_way_leads_to_one_commit() {
    let (mut rig, job) = alone(3);
    let before = committed(&rig.wait(|_| true)["jobs"][0]);
    rig.relay("attic").set(Way::Down, BLOCKED);
    // What was on its way is committed; and then nothing more can be.
    rig.node("attic").wait_for_complaint("not connected");
    let meanwhile = committed(&rig.wait(|_| true)["jobs"][0]);
    rig.relay("attic").set(Way::Down, Weather::default());
    let manifest = rig.finished(&job, BINARY);
    assert_no_death(&manifest);
    assert!(meanwhile > before, "{before} parts were committed before, {meanwhile} after: no acknowledgement was lost");
}

/// Two nodes of which both have this weather in both directions.
fn survives(name: &str, seed: u64, weather: Weather) {
    let mut rig = Rig::new(BINARY, &["attic", "cellar"], seed);
    // Parts of a quarter of a second: shorter ones would only measure how long the way to the coordinator and back is.
    fs::write(rig.program.path("job.lua"), JOB.replace("size = 32", "size = 64")).unwrap();
    ["attic", "cellar"].iter().for_each(|name| rig.relay(name).set_both(weather));
    ["attic", "cellar"].iter().for_each(|name| rig.start(name));
    rig.wait_until_ready(&["attic", "cellar"]);
    let job = rig.submit(&["--min-nodes", "2"]);
    let manifest = rig.finished(&job, BINARY);
    assert_no_death(&manifest);
    println!("{name}: {} suspicions, rendered in {:.2} s", events(&manifest, "suspected").len(), time(&manifest["report"]["makespan"]));
}

#[test]
fn a_fine_network_for_comparison() {
    survives("fine", 10, Weather::default());
}

#[test]
fn five_percent_loss_is_no_death() {
    survives("5 % loss", 11, Weather { loss: 0.05, ..Weather::default() });
}

#[test]
fn jitter_of_200_ms_is_no_death() {
    survives("200 ms jitter", 12, Weather { jitter: Duration::from_millis(200), ..Weather::default() });
}

#[test]
fn reordering_is_no_death() {
    survives("reordering", 13, Weather { reorder: 0.2, ..Weather::default() });
}

#[test]
fn duplicates_are_committed_once() {
    survives("duplicates", 14, Weather { duplicates: 0.3, ..Weather::default() });
}

#[test]
fn corruption_in_transfer_never_reaches_the_picture() {
    survives("damage", 15, Weather { damage: 0.05, ..Weather::default() });
}

#[test]
fn everything_at_once_is_no_death() {
    let jitter = Duration::from_millis(100);
    survives("all of it", 16, Weather { loss: 0.05, duplicates: 0.1, damage: 0.02, reorder: 0.1, jitter, ..Weather::default() });
}

#[test]
fn an_address_that_changes_loses_no_lease_and_repeats_no_part() {
    let (mut rig, job) = alone(20);
    for parts in [14, 20, 26] {
        rig.relay("attic").rebind();
        rig.wait_for_parts(parts);
    }
    let manifest = rig.finished(&job, BINARY);
    assert_no_death(&manifest);
    let repeated: Vec<Value> = list(&manifest["parts"]).into_iter().filter(|part| list(&part["attempts"]).len() != 1).collect();
    assert!(repeated.is_empty(), "{repeated:#?}\n{:#}", manifest["events"]);
    let log = rig.node("attic").complaints();
    assert!(!log.contains("not connected") && log.matches("connected").count() == 1, "the connection went along: {log}");
}
