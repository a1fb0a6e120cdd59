//! Text that people and programs write: settings, manifests.

use std::path::Path;

use tessera_node::{
    config::Config,
    manifest,
    report::{self, Style},
};

/// The settings of the daemons.
pub fn config(bytes: &[u8]) -> bool {
    std::str::from_utf8(bytes).is_ok_and(|text| Config::parse(Path::new("tessera.toml"), text).is_ok())
}

/// A manifest: what is read is written as it was read, and can be reported.
pub fn manifest(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let Ok(read) = manifest::parse("a", text) else { return false };
    let written = manifest::to_json(&read).unwrap();
    // Compared as text: not a number, which JSON does not know, is written as null.
    let again = manifest::parse("a", &written).unwrap_or_else(|error| panic!("{error}: {written}"));
    assert_eq!(manifest::to_json(&again).unwrap(), written);
    manifest::evaluate(&read);
    report::text(&read, &[], Style::PLAIN);
    let runs = [read, again];
    report::table(&runs, Style::PLAIN);
    report::html(&runs);
    true
}
