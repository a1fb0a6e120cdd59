//! The scripts of the repository, and what does not change from run to run.

use std::path::Path;

use tessera_engine::description::{Camera, Filter, Material, ObjectKind, Render, Shape};

use super::{BUDGET, job_with, load_file, repository, run, small_job};
use crate::job::{LoadedJob, evaluate::evaluate_bundle};

fn script(name: &str, parameters: &[(&str, &str)]) -> LoadedJob {
    load_file(&repository().join(name), parameters, BUDGET).unwrap_or_else(|fault| panic!("{fault}"))
}

fn spheres(job: &LoadedJob) -> Vec<([f64; 3], f64, Material)> {
    let scene = &job.description.frame.scene;
    let sphere = |kind: &ObjectKind| match kind {
        ObjectKind::Shape { shape: Shape::Sphere { center, radius }, material } => {
            Some((*center, *radius, scene.materials[*material as usize].clone()))
        }
        _ => None,
    };
    scene.groups[scene.root as usize].objects.iter().filter_map(|object| sphere(&object.kind)).collect()
}

#[test]
fn mini_demo_becomes_a_description() {
    let job = script("scripts/mini_demo.lua", &[("spheres", "12")]);
    let description = &job.description;
    assert_eq!((description.frame.film.width, description.frame.film.height), (1024, 768));
    assert_eq!(description.output.manifest, "mini_demo.manifest.json");
    let bundle = description.script.as_ref().expect("its assign is a function of the script");
    assert!(bundle.modules.contains_key("scenes.mini_demo"));
    let objects: usize = description.frame.scene.groups.iter().map(|group| group.objects.len()).sum();
    assert!(objects > 12, "{objects}");
    assert!(description.warnings.is_empty(), "{:?}", description.warnings);
}

/// The numbers of the scene's published text, written out a second time.
#[test]
fn s1_is_the_published_scene() {
    let job = script("scripts/reference/s1_whitted.lua", &[]);
    let frame = &job.description.frame;
    assert_eq!(frame.film.filter, Filter::Point);
    assert_eq!(frame.quality.samples, 1);
    assert_eq!(frame.render, Render::Whitted { max_depth: 8, transparent_shadows: true, min_weight: 1.0 / 255.0 });
    let Camera::Perspective { eye, look_at, horizontal_fov, .. } = frame.camera else { panic!() };
    assert_eq!((eye, look_at, horizontal_fov), ([0.0, 3.5, 11.0], [0.0, 0.8, 0.0], 45.0));
    let spheres = spheres(&job);
    assert_eq!(spheres.len(), 32);
    for (i, (center, radius, material)) in spheres[2..].iter().enumerate() {
        let i = i as f64;
        let (rho, t) = (0.95 * (i + 0.5).sqrt(), 2.399963 * i);
        assert!((radius - (0.3 + 0.1 * (i % 4.0))).abs() < 1e-12);
        let expected = [rho * t.cos(), *radius, rho * t.sin()];
        assert!(center.iter().zip(expected).all(|(got, expected)| (got - expected).abs() < 1e-9), "{i}");
        match i as u32 % 3 {
            0 => {
                let Material::Diffuse { reflectance, .. } = material else { panic!("{i}: {material:?}") };
                let phase = |turn: f64| (0.5 + 0.4 * ((i / 3.0).floor() + turn * std::f64::consts::TAU / 3.0).cos()) as f32;
                let expected = [phase(0.0), phase(1.0), phase(2.0)];
                assert!(reflectance.iter().zip(expected).all(|(got, expected)| (got - expected).abs() < 1e-6), "{i}");
            }
            1 => assert_eq!(*material, Material::Mirror { reflectance: [0.9; 3] }),
            _ => assert_eq!(*material, Material::smooth_glass(1.5, [1.0; 3])),
        }
    }
}

#[test]
fn two_machines_describe_the_same_frame() {
    let hash = |name: &str| script(name, &[]).description.frame.hash().unwrap();
    assert_eq!(hash("scripts/mini_demo.lua"), hash("scripts/mini_demo.lua"));
    let random = job_with(
        "local random = tessera.random(7)
local objects = {}
for i = 1, 100 do
  objects[i] = tessera.sphere { center = random:in_sphere(5), radius = random:uniform(0.1, 1) + math.random(), material = grey }
end
return tessera.job { scene = tessera.scene { objects = objects }, film = { width = 8, height = 8 } }",
    );
    let hash = || run(&random, &[], &[], BUDGET).unwrap().description.frame.hash().unwrap();
    assert_eq!(hash(), hash());
}

#[test]
fn moving_a_line_or_naming_an_object_does_not_change_the_picture() {
    let hash = |script: &str| run(script, &[], &[], BUDGET).unwrap().description.frame.hash().unwrap();
    let plain = small_job("");
    assert_eq!(hash(&plain), hash(&format!("\n\n{}", plain.replace("tessera.sphere {", "tessera.sphere { name = \"ball\","))));
    assert_ne!(hash(&plain), hash(&small_job("seed = 1")));
}

#[test]
fn a_bundle_evaluates_to_the_same_job_without_any_file() {
    let job = script("scripts/mini_demo.lua", &[("spheres", "12")]);
    let bundle = job.description.script.as_ref().unwrap();
    let again = evaluate_bundle(bundle, &job.description.parameters, BUDGET).unwrap_or_else(|fault| panic!("{fault}"));
    let (scene, _) = crate::job::assemble::scene(&again.job.scene).unwrap();
    // Sources are numbered alike, so even those agree.
    assert_eq!(scene, job.description.frame.scene);
    assert_eq!(again.job.output, job.description.output);
    assert_eq!(again.job.film, job.description.frame.film);
}

#[test]
fn a_job_without_a_camera_is_framed_by_itself() {
    let job = run(&small_job("").replace("camera = tessera.perspective { eye = {0, 0, 5} },", ""), &[], &[], BUDGET).unwrap();
    let Camera::Perspective { eye, look_at, .. } = job.description.frame.camera else { panic!() };
    let distance = eye.iter().zip(look_at).map(|(eye, at)| (eye - at) * (eye - at)).sum::<f64>().sqrt();
    assert!(look_at.iter().all(|middle| middle.abs() < 1e-9), "the unit sphere's middle, got {look_at:?}");
    assert!(distance > 2.0 && distance < 20.0, "{distance}");
}

/// Models that nobody here made, where they are at hand.
#[test]
fn outside_models_load() {
    let Ok(folder) = std::env::var("TESSERA_MODELS") else {
        println!("skipped: TESSERA_MODELS is not set");
        return;
    };
    for entry in std::fs::read_dir(Path::new(&folder)).unwrap() {
        let path = entry.unwrap().path();
        let name = path.to_string_lossy().into_owned();
        if ["glb", "obj", "ply"].iter().any(|ending| name.ends_with(ending)) {
            let parameters = [("model".to_owned(), name.clone())].into();
            let (_, scene) =
                crate::job::load(&repository().join("scripts/model.lua"), &parameters).unwrap_or_else(|error| panic!("{error}"));
            assert!(scene.build().statistics.triangles > 0, "{name}");
        }
    }
}

#[test]
fn each_frame_of_a_sequence_is_a_job_of_its_own() {
    let text = job_with(
        "return tessera.job {
  frames = { 8, 12 },
  scene = function(frame)
    return tessera.scene { objects = { tessera.sphere { center = { 0, 0, frame }, radius = 1, material = grey } } }
  end,
  camera = function(frame) return tessera.perspective { eye = { frame, 0, -5 }, look_at = { 0, 0, 0 } } end,
  film = { width = 8, height = 8 },
  output = { exr = \"walk.exr\" },
}",
    );
    let first = run(&text, &[], &[], BUDGET).unwrap();
    assert_eq!(first.sequence(&Default::default()).unwrap().numbers().collect::<Vec<_>>(), [8, 9, 10, 11, 12]);
    let chosen = run(&text, &[], &[("frame", "12")], BUDGET).unwrap();
    assert_eq!(chosen.sequence(&[("frame".to_owned(), "12".to_owned())].into()), None, "one that was chosen is alone");
    for (job, frame) in [(&first, 8.0), (&chosen, 12.0)] {
        let description = &job.description;
        assert_eq!(spheres(job)[0].0, [0.0, 0.0, frame]);
        let Camera::Perspective { eye, .. } = description.frame.camera else { panic!() };
        assert_eq!(eye, [frame, 0.0, -5.0]);
        let number = format!("{frame:04}");
        assert_eq!(description.output.exr, format!("walk.{number}.exr"));
        assert!(description.output.png.as_ref().unwrap().ends_with(&format!(".{number}.png")));
        assert!(description.output.manifest.ends_with(&format!(".{number}.manifest.json")), "{}", description.output.manifest);
        assert!(description.name.ends_with(&format!(".{number}")), "{}", description.name);
    }
    let beyond = run(&text, &[], &[("frame", "13")], BUDGET).err().unwrap().message;
    assert!(beyond.contains("--set frame=13: it is no frame of 8 to 12"), "{beyond}");
}
