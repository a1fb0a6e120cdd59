//! Files: the picture as EXR, its preview as PNG. Files appear whole or not at all.

mod atomic;
pub mod exr;
pub mod png;
mod rows;
mod zip;

pub use atomic::{OutputError, write_atomically};
pub use rows::Rows;
