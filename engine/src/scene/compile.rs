//! From a description and its assets to a scene.

use super::{
    Inside, Scene, Statistics, Unbuilt,
    emitters::emitters,
    error::{CompileError, Warning},
    place::{FARTHEST, Placer},
};
use std::sync::OnceLock;

use glam::{DMat3, DVec3};

use crate::{
    camera::Camera,
    description::{self, AssetSource, Frame, Fresnel, Render, Rgb, SourceId},
    light::{Environment, ImageEnvironment, Light, LightSampler, SunSky, turned},
    material::{Material, Medium, SharedTables, rgb},
    math::max_abs,
    sampling::PixelFilter,
    texture::{Image, Texture},
};

type Result<T> = std::result::Result<T, CompileError>;

/// Rows of the picture of a clear sky.
const SKY_ROWS: u32 = 256;

/// Most pixels of an environment's image, 16384 x 8192: each takes 16 bytes.
const ENVIRONMENT_PIXELS: u64 = 1 << 27;

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
        let mut tables = matches!(frame.render, Render::Path { .. }).then(SharedTables::default);
        let materials = frame.scene.materials.iter().enumerate();
        let materials = materials.map(|(i, m)| material(i, m, &textures, tables.as_mut())).collect::<Result<Vec<_>>>()?;
        let medium = frame.scene.medium.as_ref();
        medium.map_or(Ok(()), check_medium).map_err(|error| CompileError::new(SourceId::default(), format!("the scene: {error}")))?;
        let medium = medium.and_then(Medium::compile);
        let (environment, sun) = environment(&frame.scene.background, assets)?;
        let mut lights = lights;
        lights.extend(sun);
        let mut placed = Placer::new(&frame.scene, -begin, assets, materials, textures, tables).place()?;
        for description in &placed.lights {
            lights.push(light(description)?);
        }
        placed.materials.iter_mut().for_each(|material| material.has_coordinates = material.is_textured());
        let (emitters, hidden) = emitters(&placed.geometry, &placed.materials, &placed.textures);
        if hidden > 0 {
            let message = format!(
                "{hidden} objects shine that light is not sampled from (cones, cylinders, planes, unevenly scaled spheres): their light is noisy"
            );
            placed.warnings.push(Warning { source: SourceId::default(), message });
        }
        let light_sampler = LightSampler::new(emitters, &lights, &environment);
        // Whether a surface that blends is there is decided by the ray.
        let may_blend = matches!(frame.render, Render::Path { .. }) && placed.materials.iter().any(|material| material.blends);
        Ok(Unbuilt(Self {
            camera,
            lights,
            environment,
            medium,
            may_touch: false,
            media: false,
            around_eye: Inside::default(),
            light_sampler,
            filter: if may_blend { PixelFilter::of(frame.film.filter).shaken() } else { PixelFilter::of(frame.film.filter) },
            film: frame.film.clone(),
            render: frame.render.clone(),
            quality: frame.quality.clone(),
            seed: frame.seed,
            aovs: frame.aovs,
            statistics: Statistics::default(),
            caustics: OnceLock::new(),
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
    Ok(())
}

/// What surrounds the scene, and its sun.
fn environment(environment: &description::Environment, assets: &dyn AssetSource) -> Result<(Environment, Option<Light>)> {
    match environment {
        description::Environment::Constant(radiance) => {
            if !is_color(radiance) {
                return Err(CompileError::new(SourceId::default(), "the background must be finite and not negative"));
            }
            Ok((Environment::Constant(rgb(*radiance)), None))
        }
        description::Environment::Image { file, scale, rotation, source } => {
            let wrong = |message: String| CompileError::new(*source, message);
            if !is_color(scale) || !rotation.is_finite() {
                return Err(wrong("the environment's scale and rotation must be finite, and the scale not negative".into()));
            }
            let bytes = assets.bytes(*file).ok_or_else(|| wrong(format!("the image's bytes ({file}) are not here")))?;
            let image = Image::decode(&bytes, description::ColorSpace::Srgb).map_err(|error| CompileError::asset(*source, error))?;
            let [width, height] = image.size();
            if u64::from(width) * u64::from(height) > ENVIRONMENT_PIXELS {
                return Err(wrong(format!(
                    "the environment's image has {width} x {height} pixels; {ENVIRONMENT_PIXELS} are enough for any"
                )));
            }
            let scaled = |[r, g, b, _]: [f32; 4]| [r * scale[0], g * scale[1], b * scale[2]];
            let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| scaled(image.pixel(x, y))).collect();
            let turn = turned(*rotation);
            Ok((Environment::Image(ImageEnvironment::new(width, height, pixels, turn, 1.0).map_err(wrong)?), None))
        }
        description::Environment::Sky { sun, turbidity, ground, scale, disc, source } => {
            let towards = DVec3::from(*sun);
            let fits = towards.is_finite() && towards != DVec3::ZERO && is_color(ground) && *scale >= 0.0 && scale.is_finite();
            if !(fits && (1.0..=20.0).contains(turbidity)) {
                let message =
                    "the sky's sun must have a direction, its turbidity lie in 1 to 20, its ground and scale be finite and not negative";
                return Err(CompileError::new(*source, message));
            }
            let towards = (towards / max_abs(towards)).normalize();
            let sky = SunSky { sun_direction: towards, turbidity: *turbidity, ground_albedo: rgb(*ground) };
            let (width, height, pixels) = sky.sky(SKY_ROWS);
            let image = ImageEnvironment::new(width, height, pixels, DMat3::IDENTITY, *scale);
            let image = image.map_err(|message| CompileError::new(*source, message))?;
            let (radiance, degrees) = sky.sun();
            let sun = Light::disc(towards, radiance * *scale, degrees.to_radians());
            Ok((Environment::Image(image), disc.then_some(sun).filter(|_| radiance.max_element() > 0.0)))
        }
    }
}

fn light(light: &description::Light) -> Result<Light> {
    use description::Light::{Directional, Point, Spot};
    let (source, place, direction, strength) = match light {
        Point { position, intensity, source, .. } => (*source, position, None, intensity),
        Directional { direction, irradiance, source, angle } => {
            if !(0.0..180.0).contains(angle) {
                return Err(CompileError::new(*source, "the light's angle must lie in 0 to 180 degrees"));
            }
            (*source, direction, Some(direction), irradiance)
        }
        Spot { position, direction, intensity, inner, outer, source } => {
            if !(*inner >= 0.0 && inner <= outer && *outer > 0.0 && *outer <= 180.0) {
                return Err(CompileError::new(
                    *source,
                    "the light's angles must lie in 0 to 180 degrees, the inner one within the outer one",
                ));
            }
            (*source, position, Some(direction), intensity)
        }
    };
    if direction.is_some_and(|direction| direction.iter().all(|x| *x == 0.0)) {
        return Err(CompileError::new(source, "the light's direction is 0"));
    }
    if !place.iter().chain(direction.into_iter().flatten()).all(|x| x.is_finite()) {
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
        _ => SourceId::default(),
    };
    Texture::compile(texture, assets).map_err(|error| CompileError::asset(source, error))
}

fn material(index: usize, material: &description::Material, textures: &[Texture], tables: Option<&mut SharedTables>) -> Result<Material> {
    use description::Material::{Boundary, Diffuse, Emitter, Glass, Metal, MetallicRoughness, Mirror, Plastic, RoughDiffuse};
    let wrong = |what: &str| Err(CompileError::new(SourceId::default(), format!("material {index}: {what}")));
    let (colors, roughness, ior, medium): (&[&Rgb], &[f64], _, _) = match material {
        Diffuse { reflectance, .. } => (&[reflectance], &[], 1.0, None),
        RoughDiffuse { reflectance, roughness, .. } => (&[reflectance], &[*roughness], 1.0, None),
        Mirror { reflectance } => (&[reflectance], &[], 1.0, None),
        Metal { fresnel, roughness, .. } => match fresnel {
            Fresnel::Index { eta, k } => (&[eta, k], roughness, 1.0, None),
            Fresnel::Schlick(color) | Fresnel::Constant(color) => (&[color], roughness, 1.0, None),
        },
        Glass { ior, reflectance, transmittance, roughness, interior, .. } => {
            (&[reflectance, transmittance], &[*roughness], *ior, interior.as_ref())
        }
        Plastic { reflectance, ior, roughness, .. } => (&[reflectance], &[*roughness], *ior, None),
        Emitter { radiance, .. } => (&[radiance], &[], 1.0, None),
        Boundary { interior } => (&[], &[], 1.0, Some(interior)),
        MetallicRoughness(model) => match model.fault() {
            Some(fault) => return wrong(fault),
            None => (&[], &[], 1.0, None),
        },
    };
    if material.clone().textures_mut().any(|texture| *texture as usize >= textures.len()) {
        return wrong("it names a texture that does not exist");
    }
    if !(ior > 0.0 && ior.is_finite()) {
        return wrong("its index of refraction must be above 0");
    }
    if !roughness.iter().all(|roughness| (0.0..=1.0).contains(roughness)) {
        return wrong("its roughness must lie in 0 to 1");
    }
    if !colors.iter().all(|color| is_color(color)) {
        return wrong("its colours must be finite and not negative");
    }
    medium.map_or(Ok(()), check_medium).map_err(|error| CompileError::new(SourceId::default(), format!("material {index}: {error}")))?;
    Ok(Material::compile(material, textures, tables))
}

fn check_medium(medium: &description::Medium) -> std::result::Result<(), &'static str> {
    if !is_color(&medium.absorption) || !is_color(&medium.scattering) {
        return Err("its medium's coefficients must be finite and not negative");
    }
    if !(medium.anisotropy > -1.0 && medium.anisotropy < 1.0) {
        return Err("its medium's anisotropy must lie between -1 and 1");
    }
    Ok(())
}

fn is_color(color: &description::Rgb) -> bool {
    color.iter().all(|x| x.is_finite() && *x >= 0.0)
}
