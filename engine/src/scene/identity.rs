//! What all trees of a scene are, in 32 bytes.

use super::Scene;
use crate::accel::Identity;

impl Scene {
    /// Equal for scenes whose trees are equal to the last bit, on every machine; others differ. Pictures do not depend on it, except in a last bit where light
    /// goes through several clear surfaces, whose shares are multiplied as they are met; but time does.
    pub fn tree_hash(&self) -> [u8; 32] {
        let mut identity = Identity::new();
        self.geometry.trees().for_each(|tree| tree.identify(&mut identity));
        identity.finish()
    }

    /// The same scene for other instructions.
    #[cfg(test)]
    pub(crate) fn with_simd(mut self, simd: crate::accel::Simd) -> Self {
        self.geometry.simd = simd;
        self
    }

    /// The same scene with other leaves in its trees.
    #[cfg(test)]
    pub(crate) fn with_leaves(mut self, rule: crate::accel::LeafRule) -> Self {
        self.geometry.plant(rule);
        self
    }
}
