//! Job scripts: the sandbox, the Lua API, policies as callables, and the description that comes out.
//!
//! A script is run twice: where it is submitted ([`load`]), for its description and assets; and, if a policy is one of its functions, on the
//! coordinator ([`Policies`]), from its bundle and without files.

mod api;
mod assemble;
mod compile;
mod context;
mod description;
mod evaluate;
mod fault;
mod handle;
mod keys;
mod library;
mod load;
mod modules;
mod place;
mod policy;
mod sandbox;

pub use api::FRAME_PARAMETER;
pub use description::{Frames, JobDescription, Output, PixelType, ScriptBundle, not_extended};
pub use load::{LoadedJob, load};
pub use policy::Policies;
#[doc(hidden)]
pub use {fault::Fault, load::load_within, sandbox::Budget};

#[cfg(test)]
mod tests;
