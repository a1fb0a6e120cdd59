//! Where on a texture a point of a surface lies.

use glam::{DAffine2, DVec2};

use super::Footprint;
use crate::math::sin_cos;

/// Which texture coordinates of a surface a texture is looked up with, and how they are mapped before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coordinates {
    /// Whether the surface's second set is taken, where it has two.
    pub second: bool,
    /// From the surface's coordinates to the texture's; `None` is the identity.
    pub transform: Option<DAffine2>,
}

impl Coordinates {
    /// The texture's coordinates, of both sets of the surface.
    #[inline]
    pub fn of(&self, uvs: [DVec2; 2]) -> DVec2 {
        let uv = if self.second { uvs[1] } else { uvs[0] };
        match &self.transform {
            None => uv,
            Some(transform) => transform.transform_point2(uv),
        }
    }

    /// The footprint on the texture, of those in both sets of the surface.
    #[inline]
    pub fn footprint(&self, footprints: [Footprint; 2]) -> Footprint {
        let Footprint(sides) = footprints[usize::from(self.second)];
        match &self.transform {
            None => Footprint(sides),
            Some(transform) => Footprint(sides.map(|side| (transform.matrix2 * side.as_dvec2()).as_vec2())),
        }
    }
}

/// The map of `KHR_texture_transform`: scale, then rotation by radians, then offset.
pub fn texture_transform(scale: DVec2, rotation: f64, offset: DVec2) -> DAffine2 {
    let (sin, cos) = sin_cos(rotation);
    // v runs downwards, so that what is counter-clockwise on the image has this sign (see the extension's example).
    let (x, y) = (DVec2::new(cos, -sin), DVec2::new(sin, cos));
    DAffine2 { matrix2: glam::DMat2::from_cols(x * scale.x, y * scale.y), translation: offset }
}
