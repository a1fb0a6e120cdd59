//! What of light will be modelled in a scene, and what not, because nothing there asks for it.

use super::{Scene, Shortcut};
use crate::{
    description::Render,
    light::{Environment, Light},
    material::Recipe,
};

impl Scene {
    /// What rendering it will compute, in words, one concept a line.
    pub fn explain(&self) -> Vec<String> {
        let mut plan = match self.render {
            Render::Raycast => vec!["nearest hits alone: no shadows, no reflections; every light shines unhindered".into()],
            Render::Whitted { .. } => vec![self.lights_of_whitted(), self.surfaces_of_whitted()],
            Render::Path { .. } => {
                vec![self.local_lights(), self.distant_lights(), self.surfaces(), self.gathering(), self.media(), self.lens()]
            }
        };
        if self.takes(Shortcut::Outlines) {
            plan.push("few spheres: rays from the camera, and to lights that stand somewhere, find them by their outlines".into());
        }
        plan
    }

    fn lights_of_whitted(&self) -> String {
        let count = self.lights.len();
        format!("a shadow ray to each of {}; surfaces and surroundings that shine are seen but light nothing", counted(count, "light"))
    }

    fn surfaces_of_whitted(&self) -> String {
        "surfaces are diffuse, mirrors or clear glass, whichever is nearest to their material".into()
    }

    fn local_lights(&self) -> String {
        let points = self.lights.iter().filter(|light| light.power().is_some()).count();
        let surfaces = self.light_sampler.emitters.len();
        match points + surfaces {
            0 => "no light stands in the scene: no rays are sent to any".into(),
            1 => "one light stands in the scene: each vertex sends it a ray".into(),
            all => {
                format!("{all} lights stand in the scene ({surfaces} of them surfaces): each vertex sends a ray to one, chosen by a tree")
            }
        }
    }

    fn distant_lights(&self) -> String {
        let surroundings = match &self.environment {
            Environment::Constant(radiance) if radiance.max_element() > 0.0 => "an even sky, found by rays that leave",
            Environment::Constant(_) => "no sky",
            Environment::Image(_) => "a sky with bright places, to which rays are sent",
        };
        let suns = self.lights.iter().filter(|light| matches!(light, Light::Directional { .. })).count();
        if suns == 0 { surroundings.to_owned() } else { format!("{surroundings}; {}", counted(suns, "light at infinity")) }
    }

    fn surfaces(&self) -> String {
        let any = |is: fn(&Recipe) -> bool| self.materials.iter().any(|material| is(&material.recipe));
        let kinds = [
            (any(|recipe| matches!(recipe, Recipe::Mirror(_))), "mirrors"),
            (any(|recipe| matches!(recipe, Recipe::Metal { .. })), "metals"),
            (any(|recipe| matches!(recipe, Recipe::Plastic { .. })), "coats"),
            (any(Recipe::has_inside), "refraction"),
            (any(|recipe| matches!(recipe, Recipe::Model(_))), "layered materials of files"),
            (self.materials.iter().any(|material| material.is_textured()), "texture coordinates"),
            (self.materials.iter().any(|material| material.normal_map.is_some()), "normal maps"),
            (self.materials.iter().any(|material| material.is_masked()), "surfaces that are partly absent"),
        ];
        let there: Vec<&str> = kinds.iter().filter(|(there, _)| *there).map(|(_, kind)| *kind).collect();
        let absent: Vec<&str> = kinds.iter().filter(|(there, _)| !there).map(|(_, kind)| *kind).collect();
        match (there.as_slice(), absent.as_slice()) {
            ([], _) => "matte surfaces alone".into(),
            (_, []) => format!("{}, and matte surfaces", there.join(", ")),
            _ => format!("{}; nothing asks for {}", there.join(", "), absent.join(", ")),
        }
    }

    fn gathering(&self) -> String {
        if self.gathered().is_some() {
            "smooth glass or mirrors gather light: photons are sent to them first, and paths look for light where these came from".into()
        } else {
            "nothing gathers the light of lamps or of the sun: no photons are sent".into()
        }
    }

    fn media(&self) -> String {
        if self.media {
            "media: light is absorbed and scattered on its way; shadow rays are followed from border to border".into()
        } else {
            "no media: paths run without code for them, and shadow rays end at the first thing in their way".into()
        }
    }

    fn lens(&self) -> String {
        if self.camera.needs_lens() { "a lens that is sharp at one distance" } else { "a camera for which everything is sharp" }.into()
    }
}

fn counted(count: usize, what: &str) -> String {
    if count == 1 { format!("one {what}") } else { format!("{count} {what}s").replace("light at infinitys", "lights at infinity") }
}
