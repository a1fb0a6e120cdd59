//! One frame: all that is pictured, and the identity that follows from it.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{Aovs, Camera, Environment, Film, Group, GroupId, Light, Material, Medium, Quality, Render, Texture};
use crate::REVISION;

/// All that decides the pixels of one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// What is there.
    pub scene: Scene,
    /// Where it is seen from.
    pub camera: Camera,
    /// What it is gathered on.
    pub film: Film,
    /// How light is followed.
    pub render: Render,
    /// How accurately.
    pub quality: Quality,
    /// Chooses the sample pattern.
    pub seed: u64,
    /// What it tells beside colours.
    pub aovs: Aovs,
}

/// Shapes, materials, textures and lights. Materials, textures and groups are referred to by index.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Textures, referred to by [`super::TextureId`].
    pub textures: Vec<Texture>,
    /// Materials, referred to by [`super::MaterialId`].
    pub materials: Vec<Material>,
    /// Collections of objects, referred to by [`GroupId`]. A group holds instances only of groups before it, so there are no cycles.
    pub groups: Vec<Group>,
    /// The group that is the world.
    pub root: GroupId,
    /// Lights, in world coordinates.
    pub lights: Vec<Light>,
    /// Radiance of rays that leave the scene.
    pub background: Environment,
    /// What fills space outside of everything, for `path`.
    pub medium: Option<Medium>,
}

/// The identity of a picture: equal hashes promise equal bytes, on any farm.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct FrameHash(pub [u8; 32]);

impl fmt::Display for FrameHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for FrameHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "FrameHash({self})")
    }
}

impl Frame {
    /// The frame's identity: a hash of its canonical coding and of the engine's revision. Assets take part by their content ids.
    ///
    /// # Errors
    /// None in practice: a frame holds no type that postcard cannot code.
    pub fn hash(&self) -> Result<FrameHash, postcard::Error> {
        let mut coded = postcard::to_stdvec(self)?;
        if self.aovs.is_empty() {
            // The last byte says only that there are none: pictures without them are called what they were called before there were such.
            coded.pop();
        }
        let mut hasher = blake3::Hasher::new_derive_key("tessera frame identity");
        hasher.update(&REVISION.to_le_bytes());
        hasher.update(&coded);
        Ok(FrameHash(*hasher.finalize().as_bytes()))
    }
}
