//! Reports as people see them.

use super::*;
use crate::manifest::{AttemptOutcome, EventKind, Manifest, example::Example};

/// Three nodes, of which one is lost; its part is rendered again.
fn disturbed() -> Manifest {
    let run = Example::new().node(0, 2, 1.0).node(1, 2, 1.1).node(2, 1, 0.4);
    let run = run.part(4.0, 0, 1.0, 5.0).part(3.0, 1, 1.0, 4.0);
    let run = run.attempted(2.0, &[(2, 1.0, 3.0, AttemptOutcome::Lost), (1, 4.0, 5.5, AttemptOutcome::Committed)]);
    let run = run.attempted(1.0, &[(0, 1.0, 2.0, AttemptOutcome::Committed), (1, 2.0, 3.5, AttemptOutcome::Discarded)]);
    run.event(3.0, EventKind::Suspected, 2, &[]).event(3.0, EventKind::Reassigned, 2, &[2]).manifest()
}

/// A run of equal nodes that finish at the given times.
fn equal_nodes(finish: &[f64]) -> Manifest {
    let run = (0..finish.len()).fold(Example::new(), |run, id| run.node(id as u32, 1, 1.0));
    finish.iter().enumerate().fold(run, |run, (id, &end)| run.part(end, id as u32, 0.0, end)).manifest()
}

#[test]
fn the_report_names_nodes_figures_losses_warnings_and_files() {
    insta::assert_snapshot!(text(&disturbed(), &["out/example.exr".into(), "out/example.png".into()], Style::PLAIN));
}

#[test]
fn colours_only_dress_the_text() {
    let dressed = text(&disturbed(), &[], Style { color: true });
    let mut bare = String::new();
    let mut rest = dressed.as_str();
    while let Some((before, after)) = rest.split_once("\x1b[") {
        bare += before;
        rest = after.split_once('m').unwrap().1;
    }
    assert_eq!(bare + rest, text(&disturbed(), &[], Style::PLAIN));
    assert!(dressed.contains("\x1b["));
}

#[test]
fn the_papers_table_takes_t1_from_the_run_on_one_node() {
    let manifests = [equal_nodes(&[30.0, 32.0]), equal_nodes(&[60.0]), equal_nodes(&[12.0, 12.0, 12.0, 12.0, 15.0])];
    let runs = runs(&manifests);
    assert_eq!(runs.iter().map(|run| run.nodes).collect::<Vec<_>>(), [1, 2, 5]);
    assert!(runs.iter().all(|run| run.measured_alone));
    let figures: Vec<_> = runs.iter().map(|run| (run.time, run.speedup, run.efficiency)).collect();
    assert_eq!(figures, [(60.0, 1.0, 1.0), (32.0, 1.875, 0.9375), (15.0, 4.0, 0.8)]);
    assert_eq!(runs[2].overbalance, 0.25);
    insta::assert_snapshot!(table(&manifests, Style::PLAIN));
}

#[test]
fn without_a_run_on_one_node_the_table_says_that_t1_is_estimated() {
    let table = table(&[equal_nodes(&[30.0, 32.0])], Style::PLAIN);
    assert!(table.contains("T_1 is estimated"), "{table}");
    let mut other = equal_nodes(&[60.0]);
    other.image.image_hash = "33".repeat(32);
    let runs = runs(&[equal_nodes(&[30.0, 32.0]), other]);
    assert!(!runs[1].measured_alone, "a run of another picture was taken for T_1");
}

#[test]
fn the_page_stands_alone_and_shows_every_attempt() {
    let mut manifest = disturbed();
    manifest.nodes[0].name = "<b>node</b>".into();
    let page = html(&[manifest.clone(), equal_nodes(&[60.0])]);
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    for foreign in ["src=", "href=", "@import", "url(", "<b>", "NaN", "inf "] {
        assert!(!page.contains(foreign), "the page holds {foreign}");
    }
    let attempts: usize = manifest.parts.iter().map(|part| part.attempts.len()).sum();
    assert_eq!(page.matches(" s, predicted cost ").count(), attempts + 1);
}
