//! From a description and its assets to a scene.

use super::{
    Scene, Statistics, Unbuilt,
    error::CompileError,
    place::{FARTHEST, Placer},
};
use glam::DVec3;

use crate::{
    camera::Camera,
    description::{self, AssetSource, Falloff, Frame, SourceId},
    light::Light,
    material::Material,
    texture::Texture,
};

type Result<T> = std::result::Result<T, CompileError>;

/// Most rows and columns of a film.
const LARGEST_FILM: u32 = 65_536;

impl Scene {
    /// Compiles a frame: checks all that it says, reads its assets, builds its trees. The scene's coordinates begin at the camera's eye, as coordinates are finest near
    /// their origin (Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., section 5.1.1): a world far from its own looks the same.
    ///
    /// # Errors
    /// Names the object that is wrong, or whose asset is missing or damaged.
    pub fn compile(frame: &Frame, assets: &dyn AssetSource) -> Result<Self> {
        Ok(Self::read(frame, assets)?.build())
    }

    /// All of that, but for the trees.
    ///
    /// # Errors
    /// As [`Self::compile`].
    pub fn read(frame: &Frame, assets: &dyn AssetSource) -> Result<Unbuilt> {
        let eye = camera(frame)?.eye();
        Self::read_around(frame, assets, eye)
    }

    /// [`Self::compile`] in coordinates that begin at a place of the world.
    ///
    /// # Errors
    /// As [`Self::compile`].
    pub fn compile_around(frame: &Frame, assets: &dyn AssetSource, begin: DVec3) -> Result<Self> {
        Ok(Self::read_around(frame, assets, begin)?.build())
    }

    fn read_around(frame: &Frame, assets: &dyn AssetSource, begin: DVec3) -> Result<Unbuilt> {
        check_film(frame)?;
        let camera = camera(frame)?.moved(-begin);
        let lights = frame.scene.lights.iter().map(|description| Ok(light(description)?.moved(-begin))).collect::<Result<Vec<_>>>()?;
        let textures = frame.scene.textures.iter().map(|t| texture(t, assets)).collect::<Result<Vec<_>>>()?;
        let materials =
            frame.scene.materials.iter().enumerate().map(|(i, m)| material(i, m, textures.len())).collect::<Result<Vec<_>>>()?;
        let placed = Placer::new(&frame.scene, -begin, assets, materials, textures).place()?;
        Ok(Unbuilt(Self {
            camera,
            lights,
            background: frame.scene.background,
            film: frame.film.clone(),
            render: frame.render.clone(),
            quality: frame.quality.clone(),
            seed: frame.seed,
            statistics: Statistics::default(),
            materials: placed.materials,
            textures: placed.textures,
            warnings: placed.warnings,
            geometry: placed.geometry,
        }))
    }
}

fn camera(frame: &Frame) -> Result<Camera> {
    let whole = SourceId::default();
    let camera = Camera::compile(&frame.camera, &frame.film).map_err(|message| CompileError::new(whole, message))?;
    if camera.eye().abs().max_element() > FARTHEST {
        return Err(CompileError::new(whole, format!("the camera stands farther than {FARTHEST:e} from the middle of the world")));
    }
    Ok(camera)
}

fn check_film(frame: &Frame) -> Result<()> {
    let (width, height) = (frame.film.width, frame.film.height);
    let fits = |n: u32| (1..=LARGEST_FILM).contains(&n);
    if !fits(width) || !fits(height) {
        let message = format!("the film is {width} x {height} pixels; each side must be 1 to {LARGEST_FILM}");
        return Err(CompileError::new(SourceId::default(), message));
    }
    if frame.quality.samples == 0 {
        return Err(CompileError::new(SourceId::default(), "quality.samples is 0; a picture needs at least 1"));
    }
    if !is_color(&frame.scene.background) {
        return Err(CompileError::new(SourceId::default(), "the background must be finite and not negative"));
    }
    Ok(())
}

fn light(light: &description::Light) -> Result<Light> {
    use description::Light::{Directional, Point};
    let (source, place, strength) = match light {
        Point { position, intensity, source, falloff: Falloff::InverseSquare | Falloff::None } => (*source, position, intensity),
        Directional { direction, irradiance, source } => {
            if direction.iter().all(|x| *x == 0.0) {
                return Err(CompileError::new(*source, "the light's direction is 0"));
            }
            (*source, direction, irradiance)
        }
    };
    if !place.iter().all(|x| x.is_finite()) {
        return Err(CompileError::new(source, "the light's position or direction is not finite"));
    }
    if place.iter().any(|x| x.abs() > FARTHEST) {
        return Err(CompileError::new(source, format!("the light's position or direction is farther than {FARTHEST:e}")));
    }
    if !is_color(strength) {
        return Err(CompileError::new(source, "the light's colour must be finite and not negative"));
    }
    Ok(Light::compile(light))
}

fn texture(texture: &description::Texture, assets: &dyn AssetSource) -> Result<Texture> {
    let source = match texture {
        description::Texture::Image { source, .. } => *source,
        description::Texture::Checker { .. } => SourceId::default(),
    };
    Texture::compile(texture, assets).map_err(|error| CompileError::asset(source, error))
}

fn material(index: usize, material: &description::Material, textures: usize) -> Result<Material> {
    let wrong = |what: &str| Err(CompileError::new(SourceId::default(), format!("material {index}: {what}")));
    let colors: &[&description::Rgb] = match material {
        description::Material::Diffuse { texture: Some(texture), .. } if *texture as usize >= textures => {
            return wrong("it names a texture that does not exist");
        }
        description::Material::Glass { ior, .. } if !(*ior > 0.0 && ior.is_finite()) => {
            return wrong("its index of refraction must be above 0");
        }
        description::Material::Diffuse { reflectance, .. } | description::Material::Mirror { reflectance } => &[reflectance],
        description::Material::Glass { reflectance, transmittance, .. } => &[reflectance, transmittance],
    };
    if !colors.iter().all(|color| is_color(color)) {
        return wrong("its colours must be finite and not negative");
    }
    Ok(Material::compile(material))
}

fn is_color(color: &description::Rgb) -> bool {
    color.iter().all(|x| x.is_finite() && *x >= 0.0)
}
