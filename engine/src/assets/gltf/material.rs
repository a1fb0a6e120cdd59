//! Materials: the diffuse part of glTF's metallic-roughness model, and their base colour textures.

use std::{collections::BTreeMap, sync::Arc};

use gltf::json::{
    Index, Root,
    image::Image as ImageEntry,
    material::{AlphaMode, Material},
    texture::{Info, MagFilter, Sampler, Texture as TextureEntry, WrappingMode},
    validation::Checked,
};

use super::{
    AssetError,
    buffer::{Buffers, fetch},
    document::{at, label},
};
use crate::{
    assets::{
        ModelMaterial,
        files::{Context, Files},
        mesh::fraction,
        warnings::Warnings,
    },
    description::{ColorSpace, Wrap},
    math::sin_cos,
    texture::{Image, Texture},
};

/// Most bytes that all images of a model may take in memory.
const MAX_IMAGE_BYTES: usize = 8 << 30;

/// The file's materials, and at the end the default of meshes that name none.
#[derive(Default)]
pub(super) struct Materials {
    pub materials: Vec<ModelMaterial>,
    /// Where each material's texture takes its coordinates from.
    pub coordinates: Vec<Coordinates>,
    pub textures: Vec<Texture>,
}

/// Which texture coordinates a material asks for.
#[derive(Clone, Copy, Default)]
pub(super) struct Coordinates {
    /// The n of `TEXCOORD_n`.
    pub set: u32,
    transform: Option<UvTransform>,
}

/// KHR_texture_transform: scale, then rotation, then offset.
#[derive(Clone, Copy)]
struct UvTransform {
    scale: [f64; 2],
    cos: f64,
    sin: f64,
    offset: [f64; 2],
}

impl Coordinates {
    /// Texture coordinates of the file as coordinates of the texture.
    pub fn apply(&self, uv: [f32; 2]) -> [f32; 2] {
        let Some(UvTransform { scale, cos, sin, offset }) = self.transform else { return uv };
        let (u, v) = (f64::from(uv[0]) * scale[0], f64::from(uv[1]) * scale[1]);
        // v runs downwards, so that what is counter-clockwise on the image has this sign (see the extension's example).
        [(u * cos + v * sin + offset[0]) as f32, (v * cos - u * sin + offset[1]) as f32]
    }

    fn of(info: &Info) -> Self {
        let Some(extension) = info.extensions.as_ref().and_then(|extensions| extensions.texture_transform.as_ref()) else {
            return Self { set: info.tex_coord, transform: None };
        };
        let rotation = f64::from(extension.rotation.0);
        let (sin, cos) = sin_cos(rotation);
        let transform = UvTransform { scale: extension.scale.0.map(f64::from), cos, sin, offset: extension.offset.0.map(f64::from) };
        Self { set: extension.tex_coord.unwrap_or(info.tex_coord), transform: Some(transform) }
    }
}

/// Reads all materials of a file and the textures that they need.
pub(super) fn load(root: &Root, buffers: &Buffers<'_>, files: &Files<'_>, warnings: &mut Warnings) -> Result<Materials, AssetError> {
    let mut images = Images { root, buffers, files, textures: BTreeMap::new(), images: BTreeMap::new(), bytes: 0 };
    let mut loaded = Materials::default();
    for (index, material) in root.materials.iter().enumerate() {
        let name = material.name.clone().unwrap_or_else(|| index.to_string());
        warn(material, &name, warnings);
        let mut texture = None;
        let mut coordinates = Coordinates::default();
        if let Some(info) = &material.pbr_metallic_roughness.base_color_texture {
            coordinates = Coordinates::of(info);
            let context = || label("material", index, material.name.as_deref());
            texture = Some(images.texture(info.index, &mut loaded.textures, warnings).context(context)?);
        }
        loaded.coordinates.push(coordinates);
        loaded.materials.push(ModelMaterial {
            name,
            base_color: material.pbr_metallic_roughness.base_color_factor.0.map(fraction),
            texture,
            alpha_cutoff: alpha_cutoff(material),
            double_sided: material.double_sided,
        });
    }
    loaded.materials.push(ModelMaterial::matte("default", 1.0, false));
    loaded.coordinates.push(Coordinates::default());
    Ok(loaded)
}

/// Base colour images that a file's materials need: URIs of further files.
pub(super) fn needed_images(root: &Root) -> Result<Vec<&ImageEntry>, AssetError> {
    let infos = root.materials.iter().filter_map(|material| material.pbr_metallic_roughness.base_color_texture.as_ref());
    infos.map(|info| at(&root.images, at(&root.textures, info.index, "texture")?.source, "image")).collect()
}

/// Blending is not modelled: what is less than half opaque is cut away, which of all yes-or-no pictures is the nearest.
fn alpha_cutoff(material: &Material) -> Option<f32> {
    match material.alpha_mode {
        Checked::Valid(AlphaMode::Mask) => Some(material.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0)),
        Checked::Valid(AlphaMode::Blend) => Some(0.5),
        _ => None,
    }
}

fn warn(material: &Material, name: &str, warnings: &mut Warnings) {
    let pbr = &material.pbr_metallic_roughness;
    let mut warn = |wanted: bool, text: &str| {
        if wanted {
            warnings.object("material", format!("{name:?}"), text);
        }
    };
    let metallic = pbr.metallic_factor.0 > 0.0;
    let rough = pbr.roughness_factor.0 < 1.0 || pbr.metallic_roughness_texture.is_some();
    warn(metallic, "metal is not modelled; drawn diffuse in its base colour");
    warn(!metallic && rough, "gloss is not modelled; drawn diffuse");
    warn(
        matches!(material.alpha_mode, Checked::Valid(AlphaMode::Blend)),
        "alpha blending is not modelled; cut away where it is less than half opaque",
    );
    warn(matches!(material.alpha_mode, Checked::Invalid), "its alphaMode is unknown; drawn opaque");
    let emissive = material.emissive_factor.0.iter().any(|&value| value > 0.0);
    warn(emissive, "emission is not modelled");
    warn(material.normal_texture.is_some(), "normal maps are not modelled");
    warn(material.occlusion_texture.is_some(), "occlusion maps are not modelled");
}

/// Textures and images already decoded, by their numbers in the file.
struct Images<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    files: &'a Files<'a>,
    textures: BTreeMap<usize, usize>,
    images: BTreeMap<usize, Arc<Image>>,
    bytes: usize,
}

impl Images<'_> {
    /// The place in `textures` of a texture of the file, put there when it is asked for first.
    fn texture(&mut self, index: Index<TextureEntry>, textures: &mut Vec<Texture>, warnings: &mut Warnings) -> Result<usize, AssetError> {
        if let Some(&known) = self.textures.get(&index.value()) {
            return Ok(known);
        }
        let entry = at(&self.root.textures, index, "texture")?;
        let wrap = match entry.sampler {
            Some(sampler) => wrap(at(&self.root.samplers, sampler, "sampler")?, index.value(), warnings),
            None => [Wrap::Repeat; 2],
        };
        textures.push(Texture::Image { image: self.image(entry.source)?, wrap });
        self.textures.insert(index.value(), textures.len() - 1);
        Ok(textures.len() - 1)
    }

    fn image(&mut self, index: Index<ImageEntry>) -> Result<Arc<Image>, AssetError> {
        if let Some(known) = self.images.get(&index.value()) {
            return Ok(known.clone());
        }
        let entry = at(&self.root.images, index, "image")?;
        let image = self.decode(entry).context(|| label("image", index.value(), entry.name.as_deref()))?;
        self.bytes += image.memory();
        if self.bytes > MAX_IMAGE_BYTES {
            return Err(AssetError::new(format!("its images take more than {} GiB of memory", MAX_IMAGE_BYTES >> 30)));
        }
        let image = Arc::new(image);
        self.images.insert(index.value(), image.clone());
        Ok(image)
    }

    fn decode(&self, entry: &ImageEntry) -> Result<Image, AssetError> {
        match (entry.buffer_view, &entry.uri) {
            (Some(view), _) => Image::decode(self.buffers.view(view)?.0, ColorSpace::Srgb),
            (None, Some(uri)) => Image::decode(&fetch(uri, self.files)?, ColorSpace::Srgb),
            (None, None) => Err(AssetError::new("has neither bufferView nor uri")),
        }
    }
}

fn wrap(sampler: &Sampler, texture: usize, warnings: &mut Warnings) -> [Wrap; 2] {
    if matches!(sampler.mag_filter, Some(Checked::Valid(MagFilter::Nearest))) {
        warnings.object("texture", texture.to_string(), "hard-edged pixels (NEAREST) are not modelled; interpolated");
    }
    [sampler.wrap_s, sampler.wrap_t].map(|mode| match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    })
}
