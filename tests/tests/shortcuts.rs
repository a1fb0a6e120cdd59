//! What a scene does not ask for is not computed: pixels are the same as with all of it, down to the last bit.

use std::sync::atomic::AtomicBool;

use tessera_engine::{
    part::{self, Rect, SampleRange},
    scene::{Scene, Shortcut},
};
use tessera_tests::jobs;

/// Scenes of all kinds of shapes, materials and lights, by two integrators.
const SCRIPTS: [&str; 7] =
    ["reference/s1_whitted.lua", "reference/s2_cornell.lua", "mini_demo.lua", "still_life.lua", "interior.lua", "anatomy.lua", "city.lua"];

/// The hash of some parts from all over a picture.
fn pixels(scene: &Scene) -> Vec<[u8; 32]> {
    let (width, height) = (scene.film.width, scene.film.height);
    let rects = (0..16).map(|i| Rect { x: i % 4 * (width / 4) + width / 8, y: i / 4 * (height / 4) + height / 8, width: 12, height: 8 });
    let samples = SampleRange { first: 0, count: 4 };
    rects.map(|rect| part::render(scene, rect, samples, &AtomicBool::new(false)).unwrap().hash()).collect()
}

#[test]
fn the_general_way_shows_the_same_pixels() {
    let mut taken = Vec::new();
    for script in SCRIPTS {
        let mut scene = jobs::scene(script);
        let expected = pixels(&scene);
        for shortcut in Shortcut::ALL.into_iter().filter(|shortcut| scene.takes(*shortcut)).collect::<Vec<_>>() {
            scene.close(shortcut);
            assert!(!scene.takes(shortcut));
            println!("{script}: {}", shortcut.name());
            assert!(pixels(&scene) == expected, "{script} depends on {}", shortcut.name());
            taken.push(shortcut);
        }
    }
    for shortcut in Shortcut::ALL {
        assert!(taken.contains(&shortcut), "no scene takes {}", shortcut.name());
    }
}
