//! A job's scene is read once where it is submitted: what is wrong with a file shows at once, at the line that names it.

use tessera_engine::{
    camera::frame_all,
    description::{Camera, Frame, MemoryAssets, Scene, SourceId, Sources},
    scene::{self, Unbuilt},
    shape::Bounds,
};

use super::{fault::Fault, handle::JobNode};

/// A frame, its scene, and what is to be said about it.
pub struct Compiled {
    pub frame: Frame,
    pub scene: Unbuilt,
    pub warnings: Vec<String>,
}

/// Stands in for the camera of a job that gives none, until the scene's size is known.
const ANY: Camera = Camera::Panoramic { eye: [0.0, 0.0, 1.0], look_at: [0.0; 3], up: [0.0, 1.0, 0.0] };

/// Compiles the scene of the script `name`, and frames it where the job gives no camera.
///
/// # Errors
/// What cannot be compiled, at the object's place in the script.
pub fn compile(name: &str, scene: Scene, job: &JobNode, assets: &MemoryAssets, sources: &Sources) -> Result<Compiled, Fault> {
    let JobNode { camera, film, render, quality, seed, aovs, .. } = job;
    let place = |source: SourceId| sources.get(source).map_or_else(|| name.to_owned(), ToString::to_string);
    let mut frame = Frame {
        scene,
        camera: camera.clone().unwrap_or(ANY),
        film: film.clone(),
        render: render.clone(),
        quality: quality.clone(),
        seed: *seed,
        aovs: *aovs,
    };
    let read = |frame: &Frame| {
        scene::Scene::read(frame, assets)
            .map_err(|error| Fault { message: format!("{}: {}", place(error.source), error.message), help: error.help })
    };
    let mut scene = read(&frame)?;
    if camera.is_none() {
        let (min, max) = scene.bounds().ok_or_else(|| {
            Fault::new(format!("{name}: job: nothing in the scene has a size that a camera could frame")).with_help("give `camera`")
        })?;
        frame.camera = frame_all(Bounds { min, max }, f64::from(film.width) / f64::from(film.height));
        // Its coordinates begin at the camera.
        scene = read(&frame)?;
    }
    let warnings = scene.warnings().iter().map(|warning| format!("{}: {}", place(warning.source), warning.message)).collect();
    Ok(Compiled { frame, scene, warnings })
}
