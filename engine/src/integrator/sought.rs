//! Light that paths seek where they meet something: rays towards lights, which are traced many at a time.

use glam::DVec3;

use super::found;
use crate::{
    light::Arriving,
    scene::{Inside, Tracer},
    shape::Ray,
};

/// What is still to be traced. `MEDIA` says whether something may fill space on the way: see [`super::Path`].
#[derive(Debug, Default)]
pub struct Sought<const MEDIA: bool> {
    /// Towards lights that look the same from everywhere.
    plain: Rays,
    /// Towards emitters whose radiance has to be looked up.
    textured: Rays,
}

#[derive(Debug, Default)]
struct Rays {
    rays: Vec<Ray>,
    light: Vec<Light>,
    /// What they start inside of, where there are media.
    inside: Vec<Inside>,
}

/// What a ray is sent for.
#[derive(Clone, Copy, Debug)]
struct Light {
    /// Radiance in the pixel, if nothing stands before the light.
    radiance: DVec3,
    /// The path that it belongs to.
    number: u32,
    /// Index of the light among those without extent, if it is one of them; or of the emitter, if it is textured.
    index: Option<u32>,
}

impl<const MEDIA: bool> Sought<MEDIA> {
    /// Sends a ray, which may start inside of something, for light that arrives as `radiance` in the pixel of a path.
    #[inline(always)]
    pub fn push(&mut self, ray: Ray, arriving: &Arriving, radiance: DVec3, number: u32, inside: impl FnOnce() -> Inside) {
        let (to, index) = match arriving.textured {
            None => (&mut self.plain, arriving.delta),
            emitter => (&mut self.textured, emitter),
        };
        to.rays.push(ray);
        to.light.push(Light { radiance, number, index });
        if MEDIA {
            to.inside.push(inside());
        }
    }

    /// Adds the light that arrives to the radiance of its path. The order for each path is that in which it was sought, plain light first.
    #[inline(always)]
    pub fn arrive(&mut self, scene: impl Tracer, radiance: &mut [DVec3]) {
        let Self { plain, textured } = self;
        if MEDIA {
            plain.arrive(radiance, |ray, inside, _| found::through_media(scene, None, ray, inside));
            textured.arrive(radiance, |ray, inside, light| found::through_media(scene, light.index, ray, inside));
            return;
        }
        let light = &plain.light;
        let towards = |ray: usize| light[ray].index.map(|index| index as usize);
        let add = |ray: usize, is_blocked: bool| {
            if !is_blocked {
                radiance[light[ray].number as usize] += light[ray].radiance;
            }
        };
        scene.any_of(&plain.rays, towards, |_, _, _| true, add);
        plain.clear();
        textured.arrive(radiance, |ray, _, light| light.index.map_or(DVec3::ZERO, |emitter| found::looked_up(scene, emitter, ray)));
    }
}

impl Rays {
    /// Traces rays one by one: `share` says what of their light arrives.
    #[inline(always)]
    fn arrive(&mut self, radiance: &mut [DVec3], share: impl Fn(&Ray, &Inside, &Light) -> DVec3) {
        for (number, (ray, light)) in self.rays.iter().zip(&self.light).enumerate() {
            let share = share(ray, self.inside.get(number).unwrap_or(&Inside::default()), light);
            if share != DVec3::ZERO {
                radiance[light.number as usize] += light.radiance * share;
            }
        }
        self.clear();
    }

    fn clear(&mut self) {
        self.rays.clear();
        self.light.clear();
        self.inside.clear();
    }
}
