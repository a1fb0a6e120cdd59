//! What a pixel of the film covers of a texture.

use glam::{DVec2, Vec2};

/// By how much texture coordinates change from a pixel of the film to the next one to the right, and to the one below; 0 for a mere point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint(pub [Vec2; 2]);

/// Where on a surface textures are looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uvs {
    /// Both sets of texture coordinates.
    pub sets: [DVec2; 2],
    /// How far a pixel reaches, in each of them.
    pub footprints: [Footprint; 2],
}

impl From<[DVec2; 2]> for Uvs {
    /// A mere point.
    #[inline(always)]
    fn from(sets: [DVec2; 2]) -> Self {
        Self { sets, footprints: [Footprint::default(); 2] }
    }
}
