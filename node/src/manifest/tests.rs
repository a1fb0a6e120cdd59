//! The figures against values worked out by hand, and the schema against manifests that are right and wrong.

use super::{example::Example, *};
use crate::{
    error::ExitCode,
    schedule::{NodeId, PartId},
};

fn assert_near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-12 * b.abs().max(1.0), "{a} is not {b}");
}

#[test]
fn lanes_that_are_always_busy_have_efficiency_one_whatever_the_probe_believed() {
    // A fast node (2 lanes) and a slow one (1 lane), all lanes busy from 1 to 5 s. The probe thought the slow one the more powerful.
    let run = Example::new().node(0, 2, 1.0).node(1, 1, 3.0);
    let run = run.part(8.0, 0, 1.0, 5.0).part(6.0, 0, 1.0, 4.0).part(2.0, 0, 4.0, 5.0).part(3.0, 1, 1.0, 3.0).part(1.0, 1, 3.0, 5.0);
    let report = run.manifest().report;
    assert_near(report.makespan, 4.0);
    assert_near(report.work, 12.0);
    assert_near(report.efficiency, 1.0);
    assert_near(report.speedup, 2.0);
    assert_near(report.overbalance, 0.0);
    assert_near(report.total, 42.0);
}

#[test]
fn an_idle_lane_of_a_fast_node_costs_more_than_one_of_a_slow_node() {
    // Cost 4 a second on node 0, 1 a second on node 1. Node 0 stops after 2 of 4 s: it did 8 of 16; node 1 did 4 of 4. E = 12 / 20.
    let fast_idle = Example::new().node(0, 1, 1.0).node(1, 1, 1.0).part(8.0, 0, 0.0, 2.0).part(4.0, 1, 0.0, 4.0).manifest().report;
    assert_near(fast_idle.efficiency, 0.6);
    assert_near(fast_idle.speedup, 12.0 / 2.5 / 4.0);
    assert_near(fast_idle.overbalance, 1.0);
    let slow_idle = Example::new().node(0, 1, 1.0).node(1, 1, 1.0).part(16.0, 0, 0.0, 4.0).part(2.0, 1, 0.0, 2.0).manifest().report;
    assert_near(slow_idle.efficiency, 18.0 / 20.0);
}

#[test]
fn the_papers_own_table_follows_from_its_definitions() {
    // Five equal nodes; finish times 1553 s and 2 % less on one: S = 4.98, E = 0.996, L = 0.0204.
    let finish = [1553.0, 1553.0, 1553.0, 1553.0, 1522.0];
    let run = (0..5).fold(Example::new(), |run, id| run.node(id, 1, 1.0));
    let run = finish.iter().enumerate().fold(run, |run, (id, &end)| run.part(end, id as u32, 0.0, end));
    let report = run.manifest().report;
    assert_near(report.speedup, (4.0 * 1553.0 + 1522.0) / 1553.0);
    assert_near(report.efficiency, report.speedup / 5.0);
    assert_near(report.overbalance, 31.0 / 1522.0);
}

#[test]
fn a_lost_node_counts_for_as_long_as_it_was_there() {
    // Node 1 is silent from 4 s on (noticed then); its second part is rendered again by node 0, which has nothing else to do from 6 s on.
    let run = Example::new().node(0, 1, 1.0).node(1, 1, 1.0);
    let run = run.part(6.0, 0, 0.0, 6.0).part(2.0, 1, 0.0, 2.0);
    let run = run.attempted(2.0, &[(1, 2.0, 4.0, AttemptOutcome::Lost), (0, 6.0, 8.0, AttemptOutcome::Committed)]);
    let manifest = run.event(4.0, EventKind::Suspected, 1, &[]).event(4.0, EventKind::Reassigned, 0, &[2]).manifest();
    let report = &manifest.report;
    assert_near(report.efficiency, 10.0 / (8.0 + 4.0));
    assert_near(report.overbalance, 0.0); // one node is left
    assert_near(manifest.nodes[1].busy, 2.0);
    assert_near(manifest.nodes[1].finish, 2.0);
    assert_eq!(manifest.nodes[0].parts, 2);
}

#[test]
fn a_node_that_joins_late_or_is_heard_again_counts_from_then_on() {
    let run = Example::new().node(0, 1, 1.0).node(1, 1, 1.0).part(10.0, 0, 0.0, 10.0).part(2.0, 1, 5.0, 7.0);
    let run = run.event(5.0, EventKind::Joined, 1, &[]).event(7.0, EventKind::Suspected, 1, &[]).event(8.0, EventKind::Recovered, 1, &[]);
    let there = figures(&run.manifest())[1];
    assert_near(there.present, 2.0 + 2.0);
    assert!(there.at_end);
}

#[test]
fn a_node_without_any_commit_is_idle_capacity_at_the_rate_its_probe_promises() {
    // Node 1 was probed at twice the power of node 0, which renders cost 3 a second: 6 a second of it lay idle for 2 s.
    let manifest = Example::new().node(0, 1, 1.0).node(1, 1, 2.0).part(6.0, 0, 0.0, 2.0).manifest();
    assert_near(figures(&manifest)[1].rate, 6.0);
    assert_near(manifest.report.efficiency, 6.0 / (6.0 + 12.0));
    // Never probed: it counts as the mean of the others.
    let manifest = Example::new().node(0, 1, 1.0).node(1, 1, 0.0).part(6.0, 0, 0.0, 2.0).manifest();
    assert_near(manifest.report.efficiency, 0.5);
}

#[test]
fn a_node_that_dies_after_one_wrongly_predicted_part_does_not_spoil_the_figures() {
    // Node 1 dies at 0.5 s, after a part that was predicted a hundred times too dear; node 0 renders cost 1 a second for 10 s.
    let run = Example::new().node(0, 1, 1.0).node(1, 1, 1.0).part(10.0, 0, 0.0, 10.0).part(50.0, 1, 0.0, 0.5);
    let report = run.event(0.5, EventKind::Suspected, 1, &[]).manifest().report;
    assert_near(report.efficiency, 1.0);
    assert_near(report.speedup, 10.5 / 10.0);
}

#[test]
fn a_job_without_commits_has_figures_of_zero() {
    let manifest = Example::new().node(0, 1, 1.0).attempted(1.0, &[(0, 0.0, 1.0, AttemptOutcome::Lost)]).manifest();
    assert_eq!(manifest.report, ReportEntry { total: 42.0, ..ReportEntry::default() });
}

#[test]
fn the_papers_tables_rank_parts_by_cost_and_nodes_by_power() {
    let run =
        Example::new().node(1, 1, 2.0).node(0, 1, 2.0).node(2, 1, 5.0).part(1.0, 0, 0.0, 1.0).part(3.0, 1, 0.0, 1.0).part(1.0, 2, 0.0, 1.0);
    let manifest = run.manifest();
    assert_eq!(manifest.difficulty, [PartId(1), PartId(0), PartId(2)]);
    assert_eq!(manifest.power, [NodeId(2), NodeId(0), NodeId(1)]);
    assert_eq!(manifest.nodes.iter().map(|node| node.id.0).collect::<Vec<_>>(), [0, 1, 2]);
}

fn undisturbed() -> Manifest {
    Example::new().node(0, 1, 1.0).node(1, 2, 1.9).part(1.0, 0, 0.0, 1.0).part(3.0, 1, 0.0, 1.5).manifest()
}

fn published() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/manifest/schema.json")
}

/// Set `TESSERA_BLESS=1` to write the file anew after a change of the types.
#[test]
fn the_published_schema_is_the_types_own() {
    let path = published();
    let made = format!("{:#}\n", schema());
    if std::env::var_os("TESSERA_BLESS").is_some() {
        std::fs::write(&path, &made).unwrap();
    }
    assert!(std::fs::read_to_string(&path).unwrap() == made, "schema.json is behind the types: run this test with TESSERA_BLESS=1");
}

#[test]
fn a_manifest_survives_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("example.manifest.json");
    let manifest = undisturbed();
    write(&path, &manifest).unwrap();
    assert_eq!(read(&path).unwrap(), manifest);
}

#[test]
fn what_is_not_a_manifest_is_refused_with_its_place() {
    let text = to_json(&undisturbed()).unwrap();
    let messages = [
        ("no.json", read("no.json".as_ref()).unwrap_err()),
        ("cut off", parse("cut.json", &text[..text.len() / 2]).unwrap_err()),
        (
            "another version",
            parse("old.json", &text.replace("\"version\": 1", "\"version\": 7").replace("\"power\"", "\"force\"")).unwrap_err(),
        ),
        ("an unknown key", parse("new.json", &text.replace("\"makespan\"", "\"duration\"")).unwrap_err()),
        ("no version", parse("other.json", "{}").unwrap_err()),
    ];
    assert!(messages.iter().all(|(_, error)| error.code == ExitCode::File));
    let shown: Vec<_> = messages.iter().map(|(what, error)| format!("{what}\n{error}\n")).collect();
    insta::assert_snapshot!(shown.join("\n"));
}
