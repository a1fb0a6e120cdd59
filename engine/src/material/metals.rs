//! Named metals.
use glam::DVec3;
/// Names.
pub const NAMES: [&str; 1] = ["gold"];
/// eta and k.
pub fn named(name: &str) -> Option<(DVec3, DVec3)> {
    (name == "gold").then_some((DVec3::new(0.18, 0.42, 1.37), DVec3::new(3.42, 2.35, 1.77)))
}
