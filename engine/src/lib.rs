//! The rendering engine of Tessera: plain data in, pixels out.
//!
//! Rooms are listed in import order: a room imports only from rooms above it. No clock, no socket, no global state:
//! the engine counts work, the worker around it measures seconds. `ARCHITECTURE.md` tells the way data takes.
#![warn(missing_docs)]

pub mod math;
pub mod description;
pub mod sampling;
pub mod texture;
pub mod assets;
pub mod shape;
pub mod camera;
pub mod light;
pub mod material;
pub(crate) mod accel;
pub mod scene;
pub mod integrator;
pub mod part;
pub mod film;
pub mod output;

/// Names the arithmetic of this engine. It is part of every `image_hash`: raise it with any change that moves a bit of any image.
pub const REVISION: u32 = 8;
