//! The engine counts its work; whoever calls it measures seconds.

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

/// Work done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Rays from the camera: one a sample.
    pub camera_rays: u64,
    /// Rays towards lights.
    pub shadow_rays: u64,
    /// Reflected and refracted rays.
    pub secondary_rays: u64,
    /// Samples with a component that was negative or no finite number; they count as black.
    pub invalid_samples: u64,
}

impl AddAssign for Counters {
    fn add_assign(&mut self, other: Self) {
        self.camera_rays += other.camera_rays;
        self.shadow_rays += other.shadow_rays;
        self.secondary_rays += other.secondary_rays;
        self.invalid_samples += other.invalid_samples;
    }
}
