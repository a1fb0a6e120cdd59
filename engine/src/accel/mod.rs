//! Finding what a ray meets: bounding volume hierarchies and their traversal.
//!
//! `build` makes binary trees; `collapse` turns them into nodes of eight children, `traverse` walks those, eight boxes at a time. Two such levels
//! make a scene: one over all that stands at one place, and one tree for every mesh that stands at many, shared by all its instances.
//!
//! Boxes and triangle filters are f32 and *conservative*: they may let a ray through in vain, but never lose a hit. What is a hit, and
//! where, is decided in f64 alone (`shape`). So hits depend neither on the tree nor on the vector width, and equal distances are told
//! apart by the objects' order.

mod block;
mod build;
mod cluster;
mod collapse;
mod content;
mod entry;
mod frame;
mod identity;
mod interleave;
mod median;
mod node;
mod pack;
mod packet;
mod pages;
mod parallel;
mod pencil;
mod pending;
mod reinsert;
mod simd;
mod spheres;
mod split;
mod stream;
mod told;
mod traverse;
mod tree;
mod triangles;
mod visitor;

pub use block::{Block, SIZE as BLOCK};
pub use collapse::LeafRule;
pub use content::{Content, Part};
pub use identity::Identity;
pub use pencil::Pencil;
#[cfg(target_arch = "x86_64")]
pub(crate) use simd::Avx2;
pub use simd::Simd;
pub(crate) use simd::{Baseline, Lanes};
pub use spheres::{MOST as MOST_LISTED_SPHERES, SphereList};
pub use tree::{OTHER, Tree};
pub use triangles::Triangles;
pub use visitor::{MeshHit, Visitor};
