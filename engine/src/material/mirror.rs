//! A perfect mirror.

use glam::DVec3;

use super::Scattered;

/// Reflects by the law of reflection, on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// The share of light that is reflected at every angle, each component in [0, 1].
    pub reflectance: DVec3,
}

impl Mirror {
    /// See [`super::Bsdf::sample`].
    #[inline(always)]
    pub fn sample(&self, wo: DVec3) -> Option<Scattered> {
        (wo.z != 0.0).then(|| Scattered::mirrored(wo, self.reflectance, 1.0))
    }
}
