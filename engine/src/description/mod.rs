//! What a job says of its picture: plain serde data, made once by the job script, hashed, and sent to every node.
//!
//! Units: lengths in scene units, angles in degrees, colours linear Rec. 709 RGB, right-handed world. A [`Frame`] is *all that is
//! pictured*; where each object came from stands apart in [`Sources`], so that moving a line of a script does not change an image's identity.

mod aov;
mod asset;
mod camera;
mod environment;
mod film;
mod frame;
mod light;
mod material;
mod medium;
mod metallic_roughness;
mod object;
mod render;
mod source;
mod texture;

pub use aov::{Aov, Aovs};
pub use asset::{AssetError, AssetId, AssetSource, MemoryAssets, MeshData};
pub use camera::Camera;
pub use environment::Environment;
pub use film::{Film, Filter, Quality};
pub use frame::{Frame, FrameHash, Scene};
pub use light::{Falloff, Light};
pub use material::{Fresnel, Material};
pub use medium::Medium;
pub use metallic_roughness::{Absorption, Bumps, MetallicRoughness};
pub use object::{Group, Matrix, Model, ModelFormat, Object, ObjectKind, Shape};
pub use render::Render;
pub use source::{Source, SourceId, Sources};
pub use texture::{ColorSpace, Texture, TextureFilter, TextureId, Wrap};

/// A linear Rec. 709 colour; components are finite and, unless a docstring says otherwise, not negative.
pub type Rgb = [f32; 3];

/// Index into [`Scene::materials`].
pub type MaterialId = u32;

/// Index into [`Scene::groups`].
pub type GroupId = u32;
