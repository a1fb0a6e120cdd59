//! Faces of several closed objects that lie in one place: water that fills its glass exactly.

use glam::DVec3;

use super::{
    Inside, Scene, Surface,
    inside::{Entry, MOST},
};
use crate::{
    math::max_abs,
    shape::{Bounds, Ray},
};

/// Where a ray meets faces of several objects at once, of which it has found one: as if they lay behind one another by a hair's breadth, overlapping.
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    /// The face that shows, or one of them if none does, at the place that was found.
    pub surface: Surface,
    /// What the ray is inside of where it meets this one.
    pub before: Inside,
    /// What it is inside of behind all of them.
    pub beyond: Inside,
}

/// Boxes that are compared with each other before objects are taken to touch.
const MOST_COMPARED: usize = 1 << 20;

impl Inside {
    /// What a ray of unit direction meets where it has found a surface; `None` if no face of another object with an inside lies there too.
    ///
    /// A ray that goes through the surface begins anew behind its error bound, and meets none of the faces up to there. What the ray enters comes first, then what it leaves, so that there is
    /// no gap between them; of both, that comes first before which others do not show: in the order in which faces would be met that overlap a little (Schmidt and Budge, "Simple
    /// Nested Dielectrics in Ray Traced Images", JGT 7(2), 2002).
    #[inline(never)]
    pub fn joint(&self, scene: &Scene, surface: &Surface, direction: DVec3) -> Option<Joint> {
        let has_inside = |material: u32| scene.materials[material as usize].recipe.has_inside();
        if !has_inside(surface.material) {
            return None;
        }
        let mut faces = Faces::new(surface, direction);
        let forwards = 1f64.copysign(direction.dot(surface.ng));
        let through = Ray { t_max: 2.0 * surface.error, ..Ray::new(surface.start(-forwards), surface.ng * forwards) };
        scene.any(&through, |material, crossing| {
            if crossing.object != surface.object && has_inside(material) {
                faces.cross(self, Entry { object: crossing.object, material }, crossing.t);
            }
            false
        });
        faces.in_order(scene).map(|faces| self.join(scene, surface, direction, faces))
    }

    fn join(&self, scene: &Scene, found: &Surface, direction: DVec3, faces: &[Face]) -> Joint {
        let mut shows: Option<(Surface, Self)> = None;
        let (mut surface, mut beyond) = (*found, *self);
        for face in faces {
            let side = if face.enters == (direction.dot(found.ng) < 0.0) { 1.0 } else { -1.0 };
            let Entry { object, material } = face.of;
            surface = Surface { object, material, ng: found.ng * side, ns: found.ns * side, ..*found };
            if shows.is_none() && beyond.shows(scene, &surface) {
                shows = Some((surface, beyond));
            }
            beyond.pass(face.of, face.enters);
        }
        // Of what does not show, the last one: behind it lies what is beyond.
        let (surface, before) = shows.unwrap_or((surface, beyond));
        Joint { surface, before, beyond }
    }
}

/// A face that a ray goes through.
#[derive(Clone, Copy, Debug, Default)]
struct Face {
    of: Entry,
    /// Whether the ray enters the object there.
    enters: bool,
    /// Where the last of its crossings is: a triangle that stands in several leaves is told several times.
    t: f64,
    /// Whether it goes through at all, and not in and out again.
    counts: bool,
}

/// Faces of different objects, first the one that was found.
struct Faces {
    faces: [Face; MOST],
    count: usize,
}

impl Faces {
    fn new(surface: &Surface, direction: DVec3) -> Self {
        let of = Entry::of(surface);
        let mut faces = [Face::default(); MOST];
        faces[0] = Face { of, enters: direction.dot(surface.ng) < 0.0, t: 0.0, counts: true };
        Self { faces, count: 1 }
    }

    /// Goes through a face of another object: out of it if the ray is inside.
    fn cross(&mut self, inside: &Inside, of: Entry, t: f64) {
        match self.faces[..self.count].iter_mut().find(|face| face.of.object == of.object) {
            Some(face) if face.t == t => {}
            Some(face) => (face.t, face.counts) = (t, !face.counts),
            None if self.count < MOST => {
                self.faces[self.count] = Face { of, enters: !inside.holds(of.object), t, counts: true };
                self.count += 1;
            }
            None => {}
        }
    }

    /// All of them as they would be met; `None` if there is only the one that was found.
    fn in_order(&mut self, scene: &Scene) -> Option<&[Face]> {
        let faces = &mut self.faces[..self.count];
        // First those that count.
        faces.sort_by_key(|face| {
            let priority = i32::from(scene.materials[face.of.material as usize].recipe.priority());
            (!face.counts, !face.enters, if face.enters { -priority } else { priority }, face.of.object)
        });
        let count = faces.partition_point(|face| face.counts);
        (count > 1).then_some(&self.faces[..count])
    }
}

/// Whether some of these boxes may touch others: `true` if that would take long to find out.
pub fn may_touch(mut boxes: Vec<Bounds>) -> bool {
    // As far as rounding may have made them smaller, or more.
    let slack = |Bounds { min, max }: Bounds| 1e-9 * max_abs(min).max(max_abs(max)).min(f64::MAX);
    boxes.iter_mut().for_each(|of| *of = Bounds { min: of.min - slack(*of), max: of.max + slack(*of) });
    boxes.sort_by(|a, b| a.min.x.total_cmp(&b.min.x));
    let mut compared = 0;
    for (index, first) in boxes.iter().enumerate() {
        for second in boxes[index + 1..].iter().take_while(|second| second.min.x <= first.max.x) {
            compared += 1;
            if compared > MOST_COMPARED || (first.min.cmple(second.max) & second.min.cmple(first.max)).all() {
                return true;
            }
        }
    }
    false
}
