//! Surfaces at hits, and those that are crossed on the way.

use glam::{DVec2, DVec3};

use super::{geometry::Placed, query::Hit};
use crate::{
    shape::{Point, Surface},
    texture::Footprint,
};

/// A surface that a ray crosses, for [`super::Scene::any`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Parameter of the ray: the distance, as its direction is a unit vector.
    pub t: f64,
    /// Place of the object in the order of the scene.
    pub object: u32,
}

/// Which thing of a scene a ray crosses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thing {
    /// Place of the object in the order of the scene.
    pub object: u32,
    /// Index of its material.
    pub material: u32,
}

impl<S> Placed<S> {
    /// What it is when it is crossed.
    #[inline(always)]
    pub(super) fn thing(&self) -> Thing {
        Thing { object: self.object, material: self.material }
    }
}

/// The surface of anything but a mesh.
#[inline(always)]
pub(super) fn in_world(point: Point, hit: &Hit, material: u32) -> Surface {
    let Point { position, error, normal, uv } = point;
    let Hit { t, object, part, .. } = *hit;
    Surface {
        point: position,
        t,
        error,
        ng: normal,
        ns: normal,
        uv,
        uv2: DVec2::ZERO,
        tangents: [DVec3::ZERO; 2],
        footprints: [Footprint::default(); 2],
        color: [1.0; 4],
        material,
        object,
        part,
        sphere: 0,
    }
}
