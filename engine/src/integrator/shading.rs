//! How a surface scatters light at a point, in the world's coordinates.

use glam::{DVec2, DVec3};

use crate::{
    material::{Bsdf, CoatNormal, Material, NormalMap, Scattered},
    math::orthonormal_basis,
    scene::Scene,
    shape::Surface,
};

/// A BSDF and the frame that it stands in.
pub struct Shading<'s> {
    /// In its own coordinates, where z is the shading normal.
    pub bsdf: Bsdf<'s>,
    axes: [DVec3; 3],
    ng: DVec3,
    /// Towards the viewer, in the BSDF's coordinates.
    wo: DVec3,
    /// Whether the viewer is on the outward side.
    outside: bool,
}

impl<'s> Shading<'s> {
    /// At the end of a ray along `direction`. The BSDF's x lies along the surface's tangent, turned by an angle of this cosine and sine.
    #[inline(always)]
    pub fn new(bsdf: Bsdf<'s>, turn: DVec2, scene: &Scene, material: &Material, surface: &Surface, direction: DVec3) -> Self {
        let outside = direction.dot(surface.ng) < 0.0;
        let axes = axes(turn, scene, material, surface, direction);
        let [x, y, z] = axes;
        let wo = -DVec3::new(x.dot(direction), y.dot(direction), z.dot(direction));
        Self { bsdf, axes, ng: surface.ng, wo, outside }
    }

    /// `f |cos|` for light from a direction, and the density with which [`Self::sample`] chooses it.
    #[inline(always)]
    pub fn evaluate(&self, direction: DVec3) -> (DVec3, f64) {
        let [x, y, z] = self.axes;
        let wi = DVec3::new(x.dot(direction), y.dot(direction), z.dot(direction));
        // Light must come from the same side by both normals, or it leaks through the surface (Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 5.3).
        if (wi.z > 0.0) != (direction.dot(self.ng) > 0.0) {
            return (DVec3::ZERO, 0.0);
        }
        self.bsdf.evaluate(self.wo, wi)
    }

    /// A direction in which the path goes on.
    #[inline(always)]
    pub fn sample(&self, pick: f64, u: DVec2) -> Option<(Scattered, DVec3)> {
        let scattered = self.bsdf.sample(self.wo, pick, u)?;
        let [x, y, z] = self.axes;
        let direction = x * scattered.wi.x + y * scattered.wi.y + z * scattered.wi.z;
        let to_outside = direction.dot(self.ng) > 0.0;
        ((to_outside == self.outside) != scattered.transmitted).then_some((scattered, direction))
    }
}

/// The axes of a BSDF in the world.
#[inline(always)]
fn axes(turn: DVec2, scene: &Scene, material: &Material, surface: &Surface, direction: DVec3) -> [DVec3; 3] {
    let z = normal(scene, Some(material), surface, direction);
    let (x, y) = match material.tangents.and_then(|_| surface.tangents_across(z)) {
        Some((x, y)) => (x * turn.x + y * turn.y, y * turn.x - x * turn.y),
        None => orthonormal_basis(z),
    };
    [x, y, z]
}

/// The normal of a clear coat that does not follow its base, in the BSDF's coordinates as seen from the viewer's side; `None` where it follows.
#[inline(never)]
pub fn coat_normal(turn: DVec2, scene: &Scene, material: &Material, surface: &Surface, direction: DVec3) -> Option<DVec3> {
    let map = match &material.coat_normal {
        CoatNormal::Base => return None,
        CoatNormal::Mesh => None,
        CoatNormal::Mapped(map) => Some(map),
    };
    let normal = bent(scene, map, surface, direction);
    let [x, y, z] = axes(turn, scene, material, surface, direction).map(|axis| axis.dot(normal));
    // Behind, both normals point the other way.
    let side = if direction.dot(surface.ng) < 0.0 { 1.0 } else { -1.0 };
    (z > 0.0).then_some(DVec3::new(x * side, y * side, z))
}

/// The shading normal at the end of a ray along `direction`, on the outward side, as the bumps of a material bend it.
#[inline(always)]
pub fn normal(scene: &Scene, bumpy: Option<&Material>, surface: &Surface, direction: DVec3) -> DVec3 {
    bent(scene, bumpy.and_then(|material| material.normal_map.as_ref()), surface, direction)
}

/// The same, as a map bends it.
#[inline(always)]
fn bent(scene: &Scene, map: Option<&NormalMap>, surface: &Surface, direction: DVec3) -> DVec3 {
    let outside = direction.dot(surface.ng) < 0.0;
    // A shading normal that looks away from the viewer tells nothing about what is seen.
    let seen = |normal: &DVec3| (direction.dot(*normal) < 0.0) == outside;
    let mapped = map.and_then(|map| map.normal(&scene.textures, surface)).filter(seen);
    mapped.unwrap_or(if seen(&surface.ns) { surface.ns } else { surface.ng })
}
