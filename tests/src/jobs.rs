//! The job scripts of this repository.

use std::{collections::BTreeMap, path::Path};

use tessera_engine::{part, scene::Scene};
use tessera_node::job;

/// The scene of a script in `scripts`, ready to be rendered.
pub fn scene(script: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scripts").join(script);
    let (_, unbuilt) = job::load(&path, &BTreeMap::new()).unwrap_or_else(|error| panic!("{error}"));
    part::prepared(unbuilt.build())
}
