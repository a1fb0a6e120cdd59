//! All that decodes bytes from outside, one check each: whatever the bytes are, nothing panics, and what is accepted keeps its promises.
//!
//! The fuzz targets in `tests/fuzz` feed them garbage; `tests/tests/decoders.rs` feeds them the seeds from which that begins.

pub mod identity;
pub mod image;
pub mod journal;
pub mod model;
pub mod picture;
pub mod scene;
pub mod script;
pub mod seeds;
pub mod settings;
pub mod wire;

use std::{panic, sync::Arc};

/// Feeds bytes to a decoder and says whether it accepted them.
pub type Check = fn(&[u8]) -> bool;

/// Every check, by the name of its fuzz target and of its folder of seeds.
pub const ALL: [(&str, Check); 27] = [
    ("certificate", identity::certificate),
    ("config", settings::config),
    ("exr", picture::exr),
    ("frame", scene::frame),
    ("gltf", model::gltf),
    ("identity", identity::identity),
    ("image_hdr", image::any),
    ("image_jpeg", image::any),
    ("image_png", image::any),
    ("journal_database", journal::database),
    ("journal_events", journal::events),
    ("journal_segment", journal::segment),
    ("manifest", settings::manifest),
    ("mesh", scene::mesh),
    ("mtl", model::mtl),
    ("obj", model::obj),
    ("ply", model::ply),
    ("revocations", identity::revocations),
    ("script", script::job),
    ("token", identity::token),
    ("wire_control", wire::control),
    ("wire_frame", wire::frame),
    ("wire_hello", wire::hello),
    ("wire_join", wire::join),
    ("wire_part", wire::part),
    ("wire_request", wire::request),
    ("wire_response", wire::response),
];

/// Runs a decoder that catches panics of the libraries below it, which fuzzing would take for faults at their first word. Panics of our own stay faults.
fn caught_of_libraries<T>(decode: impl FnOnce() -> T) -> T {
    let usual = Arc::new(panic::take_hook());
    let ours = usual.clone();
    panic::set_hook(Box::new(move |fault| {
        if !fault.location().is_some_and(|place| place.file().contains("/registry/src/")) {
            ours(fault);
        }
    }));
    let decoded = decode();
    drop(panic::take_hook());
    if let Some(usual) = Arc::into_inner(usual) {
        panic::set_hook(usual);
    }
    decoded
}
