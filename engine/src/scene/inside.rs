//! What a ray is inside of.

use glam::DVec3;

use super::{Scene, Surface};
use crate::{
    material::{Medium, Recipe},
    shape::Ray,
};

/// Closed objects that a ray is inside of, in the order in which it entered them (Schmidt and Budge, "Simple Nested Dielectrics in Ray Traced Images", JGT 7(2), 2002): where
/// several overlap, the one of highest priority is there, of equal ones the last, and borders of the others do not show.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inside {
    entries: [Entry; MOST],
    count: usize,
}

/// Objects that may overlap at one place; more are taken for empty space.
pub(super) const MOST: usize = 8;

/// Surfaces that are looked at to find out what a point is inside of.
const MOST_CROSSINGS: u32 = 1024;

/// A closed object.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Entry {
    pub object: u32,
    pub material: u32,
}

impl Inside {
    /// What a point is inside of, by the borders that a ray from there leaves.
    pub fn of(scene: &Scene, point: DVec3) -> Self {
        let ray = Ray::new(point, DVec3::new(0.36, 0.8, 0.48));
        if scene.may_touch { Self::by_parity(scene, &ray) } else { Self::by_borders(scene, ray) }
    }

    /// Where faces may lie in one place, none may be left out: the start is inside of what the ray crosses an odd number of times.
    fn by_parity(scene: &Scene, ray: &Ray) -> Self {
        let mut crossings: Vec<(u32, f64, u32)> = Vec::new();
        scene.any(ray, |material, crossing| {
            if scene.materials[material as usize].recipe.has_inside() {
                crossings.push((crossing.object, crossing.t, material));
            }
            false
        });
        crossings.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        // A triangle that stands in several leaves is told several times.
        crossings.dedup_by_key(|&mut (object, t, _)| (object, t.to_bits()));
        let mut borders: Vec<_> = crossings.chunk_by(|a, b| a.0 == b.0).filter(|of| of.len() % 2 == 1).map(|of| of[0]).collect();
        borders.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut inside = Self::default();
        borders.iter().for_each(|&(object, _, material)| inside.pass(Entry { object, material }, true));
        inside
    }

    fn by_borders(scene: &Scene, mut ray: Ray) -> Self {
        let mut entered: Vec<u32> = Vec::new();
        let mut inside = Self::default();
        for _ in 0..MOST_CROSSINGS {
            let Some(surface) = scene.closest(&ray) else { break };
            if scene.materials[surface.material as usize].recipe.has_inside() {
                if ray.direction.dot(surface.ng) < 0.0 {
                    entered.push(surface.object);
                } else if let Some(at) = entered.iter().position(|&object| object == surface.object) {
                    entered.swap_remove(at);
                } else {
                    inside.pass(Entry::of(&surface), true);
                }
            }
            ray = surface.spawn(ray.direction);
        }
        inside
    }

    /// The index of refraction outside of a surface that the ray meets, if its border shows.
    #[inline]
    pub fn outside_of(&self, scene: &Scene, surface: &Surface) -> Option<f64> {
        let priority = |material: u32| scene.materials[material as usize].recipe.priority();
        let own = priority(surface.material);
        let mut outside: Option<&Entry> = None;
        for entry in self.entries[..self.count].iter().filter(|entry| entry.object != surface.object) {
            if priority(entry.material) >= outside.map_or(0, |entry| priority(entry.material)) && !self.is_boundary(scene, entry) {
                outside = Some(entry);
            }
        }
        match outside {
            Some(entry) if priority(entry.material) > own => None,
            Some(entry) => Some(scene.materials[entry.material as usize].recipe.ior()),
            None => Some(1.0),
        }
    }

    /// Whether a surface can be seen from here: a border between media cannot, nor can what something of higher priority fills.
    pub fn shows(&self, scene: &Scene, surface: &Surface) -> bool {
        match &scene.materials[surface.material as usize].recipe {
            Recipe::Boundary { .. } => false,
            recipe => !recipe.has_inside() || self.outside_of(scene, surface).is_some(),
        }
    }

    fn is_boundary(&self, scene: &Scene, entry: &Entry) -> bool {
        matches!(scene.materials[entry.material as usize].recipe, Recipe::Boundary { .. })
    }

    /// What fills the place.
    #[inline]
    pub fn medium<'s>(&self, scene: &'s Scene) -> Option<&'s Medium> {
        let recipe = |entry: &Entry| &scene.materials[entry.material as usize].recipe;
        match self.entries[..self.count].iter().max_by_key(|entry| recipe(entry).priority()) {
            Some(entry) => recipe(entry).interior(),
            None => scene.medium.as_ref(),
        }
    }

    /// Goes through a surface along a direction.
    #[inline]
    pub fn cross(&mut self, surface: &Surface, direction: DVec3) {
        self.pass(Entry::of(surface), direction.dot(surface.ng) < 0.0);
    }

    /// Whether a surface that a ray of unit direction meets shows, as [`Self::shows`] says, or one in the same place; and what the ray is inside of behind it.
    pub fn through(&self, scene: &Scene, surface: &Surface, direction: DVec3) -> (bool, Self) {
        if scene.may_touch
            && let Some(joint) = self.joint(scene, surface, direction)
        {
            return (joint.before.shows(scene, &joint.surface), joint.beyond);
        }
        let mut beyond = *self;
        beyond.cross(surface, direction);
        (self.shows(scene, surface), beyond)
    }

    /// Whether an object is one of those.
    pub(super) fn holds(&self, object: u32) -> bool {
        self.entries[..self.count].iter().any(|entry| entry.object == object)
    }

    /// Enters an object, or leaves it.
    #[inline]
    pub(super) fn pass(&mut self, of: Entry, enters: bool) {
        if enters {
            if self.count < MOST {
                self.entries[self.count] = of;
                self.count += 1;
            }
        } else if let Some(at) = self.entries[..self.count].iter().rposition(|entry| entry.object == of.object) {
            self.entries.copy_within(at + 1..self.count, at);
            self.count -= 1;
        }
    }
}

impl Entry {
    pub(super) fn of(surface: &Surface) -> Self {
        Self { object: surface.object, material: surface.material }
    }
}
