//! The manifest: what happened, part by part, as versioned JSON beside the picture.
//!
//! `types` say what stands in it, `build` makes it from what the farm's core recorded, `evaluate` works out the paper's figures,
//! `file` reads and writes it. Its JSON Schema, made from the types, is published as `schema.json` beside this file.

mod build;
mod evaluate;
mod file;
mod time;
mod types;

pub use build::{JobRecord, Submission, blackness, build, program};
pub use evaluate::{NodeFigures, evaluate, figures, overbalance};
pub use file::{parse, read, schema, to_json, write};
pub use time::rfc3339;
pub use types::*;

#[cfg(test)]
pub(crate) mod example;
#[cfg(test)]
mod tests;
