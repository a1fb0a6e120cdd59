//! Whether the metrics keep the rules of their format, say what happened, and are all explained to the operator.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
    time::Duration,
};

use super::{Metrics, Snapshot, tests::snapshot};

/// A family of samples: its type, and the value of each sample by its name and labels.
#[derive(Debug, Default)]
struct FamilyRead {
    kind: String,
    samples: BTreeMap<String, f64>,
    /// Samples in the order in which they stand, for histograms.
    order: Vec<(String, f64)>,
}

fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// Endings that samples of a type have behind their family's name.
fn endings(kind: &str) -> &'static [&'static str] {
    match kind {
        "counter" => &["_total"],
        "gauge" => &[""],
        "histogram" => &["_bucket", "_sum", "_count"],
        "info" => &["_info"],
        other => panic!("the type {other}"),
    }
}

fn check_labels(labels: &str) {
    let Some(inner) = labels.strip_prefix('{') else { return assert_eq!(labels, "") };
    let inner = inner.strip_suffix('}').unwrap_or_else(|| panic!("{labels} is not closed"));
    for label in inner.split(',') {
        let (name, value) = label.split_once('=').unwrap_or_else(|| panic!("{label} has no value"));
        assert!(is_name(name), "the label {name}");
        let value = value.strip_prefix('"').and_then(|value| value.strip_suffix('"')).unwrap_or_else(|| panic!("{value} without quotes"));
        assert!(!value.contains(['"', '\\', '\n']), "{value} needs escapes");
    }
}

/// Reads the text format by the rules of OpenMetrics 1.0 (those that text of this program can break).
fn read(text: &str) -> BTreeMap<String, FamilyRead> {
    let body = text.strip_suffix("# EOF\n").expect("the text ends in its mark");
    let mut families: BTreeMap<String, FamilyRead> = BTreeMap::new();
    let mut current = String::new();
    for line in body.lines() {
        assert!(!line.is_empty() && line.trim() == line, "spaces: {line:?}");
        if let Some(comment) = line.strip_prefix("# ") {
            let mut words = comment.splitn(3, ' ');
            let (what, name, rest) = (words.next().unwrap(), words.next().unwrap(), words.next().unwrap_or_default());
            assert!(is_name(name), "{name}");
            if name != current {
                assert!(!families.contains_key(name), "{name} stands in two places");
                name.clone_into(&mut current);
                families.insert(name.to_owned(), FamilyRead::default());
            }
            let family = families.get_mut(name).unwrap();
            assert!(family.samples.is_empty(), "{name}: its description stands behind its samples");
            match what {
                "HELP" => assert!(rest.len() > 5, "{name} without help"),
                "TYPE" => rest.clone_into(&mut family.kind),
                "UNIT" => assert!(name.ends_with(&format!("_{rest}")), "{name} does not end in its unit {rest}"),
                other => panic!("a comment {other}"),
            }
            continue;
        }
        let (key, value) = line.rsplit_once(' ').expect("a name and a value");
        let (name, labels) = key.split_at(key.find('{').unwrap_or(key.len()));
        check_labels(labels);
        let family = families.get_mut(&current).expect("a family before its samples");
        let ending = name.strip_prefix(&current).unwrap_or_else(|| panic!("{name} among samples of {current}"));
        assert!(endings(&family.kind).contains(&ending), "{name} of the type {}", family.kind);
        let value: f64 = value.parse().unwrap_or_else(|_| panic!("{line}: not a number"));
        assert!(family.samples.insert(key.to_owned(), value).is_none(), "{key} twice");
        family.order.push((key.to_owned(), value));
    }
    families.iter().for_each(|(name, family)| check_family(name, family));
    families
}

fn check_family(name: &str, family: &FamilyRead) {
    assert!(!name.ends_with("_total") && !name.ends_with("_info"), "{name}: the ending is the format's own");
    assert!(family.kind == "gauge" || family.samples.values().all(|value| *value >= 0.0), "{name} is negative");
    if family.kind == "histogram" {
        let buckets: Vec<_> = family.order.iter().filter(|(key, _)| key.contains("_bucket{")).collect();
        let bound = |key: &str| key.split("le=\"").nth(1).unwrap().trim_end_matches("\"}").replace("+Inf", "inf").parse::<f64>().unwrap();
        assert!(buckets.windows(2).all(|pair| bound(&pair[0].0) < bound(&pair[1].0) && pair[0].1 <= pair[1].1), "{name}: {buckets:?}");
        let (last, count) = (buckets.last().unwrap(), family.samples[&format!("{name}_count")]);
        assert!(bound(&last.0).is_infinite() && last.1.to_bits() == count.to_bits(), "{name}: {last:?} of {count}");
    }
}

fn sample(text: &str, key: &str) -> f64 {
    let families = read(text);
    *families.values().find_map(|family| family.samples.get(key)).unwrap_or_else(|| panic!("no {key} in {text}"))
}

#[test]
fn what_happened_is_told_by_the_rules_of_the_format() {
    let metrics = Metrics::default();
    metrics.suspected(Duration::from_millis(520));
    metrics.committed(1200, Duration::from_millis(3));
    metrics.committed(800, Duration::from_secs(40));
    metrics.journal_bytes.set(5_000_000_000);
    metrics.finished(&crate::manifest::ReportEntry { efficiency: 0.975, overbalance: 0.5, ..Default::default() });
    let text = metrics.text(&snapshot()).unwrap();
    for (key, value) in [
        ("tessera_suspicions_total", 1.0),
        ("tessera_detection_latency_seconds_sum", 0.52),
        ("tessera_detection_latency_seconds_bucket{le=\"0.5\"}", 0.0),
        ("tessera_detection_latency_seconds_bucket{le=\"0.55\"}", 1.0),
        ("tessera_parts_committed_total", 2.0),
        ("tessera_pixels_stored_bytes_total", 2000.0),
        ("tessera_commit_latency_seconds_bucket{le=\"30.0\"}", 1.0),
        ("tessera_commit_latency_seconds_count", 2.0),
        ("tessera_journal_size_bytes", 5e9),
        ("tessera_last_job_efficiency_ratio", 0.975),
        ("tessera_nodes{state=\"refused\"}", 1.0),
        ("tessera_nodes{state=\"ready\"}", 0.0),
        ("tessera_jobs{state=\"rendering\"}", 1.0),
        ("tessera_jobs_ended_total{outcome=\"failed\"}", 0.0),
        ("tessera_jobs_held_up", 1.0),
        ("tessera_refuses_jobs", 1.0),
        ("tessera_parts_left", 2.0),
    ] {
        assert_eq!(sample(&text, key).to_bits(), f64::to_bits(value), "{key} in\n{text}");
    }
}

#[test]
fn names_keep_to_the_conventions() {
    for (name, family) in read(&Metrics::default().text(&Snapshot::default()).unwrap()) {
        assert!(name.starts_with("tessera_"), "{name}");
        for unit in ["milli", "micro", "_ms", "kilo", "_kb", "mega", "minutes", "percent"] {
            assert!(!name.contains(unit), "{name} is not in base units");
        }
        for label in ["job=", "part=", "node=", "lease="] {
            assert!(family.samples.keys().all(|key| !key.contains(label)), "{name} has a label without bound");
        }
    }
}

#[test]
fn the_guide_explains_every_metric_and_no_other() {
    let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy/README.md");
    let guide = fs::read_to_string(guide).unwrap();
    let rows = guide.lines().filter_map(|line| line.strip_prefix("| `tessera_")?.split_once('`'));
    let explained: BTreeSet<String> = rows.map(|(name, _)| format!("tessera_{name}")).collect();
    let families = read(&Metrics::default().text(&Snapshot::default()).unwrap());
    let ending = |kind: &str| if kind == "histogram" { "" } else { endings(kind)[0] };
    let told: BTreeSet<String> = families.iter().map(|(name, family)| name.clone() + ending(&family.kind)).collect();
    assert_eq!(explained, told);
}

#[test]
#[should_panic(expected = "stands behind its samples")]
fn a_broken_text_is_seen() {
    read("# HELP a_b Some help.\n# TYPE a_b gauge\na_b 1\n# UNIT a_b b\n# EOF\n");
}
