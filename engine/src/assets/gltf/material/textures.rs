//! Textures that materials ask for, and their images, each decoded once for every way in which its numbers are taken.

use std::{collections::BTreeMap, sync::Arc};

use glam::DVec2;
use gltf::json::{
    Index, Root,
    extensions::texture::TextureTransform,
    image::Image as ImageEntry,
    texture::{Info, MagFilter, MinFilter, Sampler, Texture as TextureEntry, WrappingMode},
    validation::Checked,
};
use serde::Deserialize;
use serde_json::{Map, Value};

use super::super::{
    AssetError,
    buffer::{Buffers, fetch},
    document::{at, label},
};
use crate::{
    assets::{
        files::{Context, Files},
        warnings::Warnings,
    },
    description::{ColorSpace, Wrap},
    texture::{Coordinates, Image, Pyramid, Texture, texture_transform},
};

/// Most bytes that all images of a model may take in memory.
const MAX_IMAGE_BYTES: usize = 8 << 30;

/// A texture as a material asks for it.
pub(super) struct Wanted {
    pub texture: Index<TextureEntry>,
    pub space: ColorSpace,
    /// The n of `TEXCOORD_n`.
    pub set: u32,
    transform: Option<glam::DAffine2>,
}

impl Wanted {
    /// By a plain reference.
    pub fn of(info: &Info, space: ColorSpace) -> Result<Self, AssetError> {
        let extension = info.extensions.as_ref().and_then(|extensions| extensions.texture_transform.as_ref());
        Self::new(info.index, info.tex_coord, extension, space)
    }

    /// By a reference of another kind, whose numbers are linear; `others` are its extensions.
    pub fn linear(texture: Index<TextureEntry>, set: u32, others: Option<&Map<String, Value>>) -> Result<Self, AssetError> {
        let name = "KHR_texture_transform";
        let transform = others.and_then(|others| others.get(name)).map(TextureTransform::deserialize).transpose();
        let transform = transform.map_err(|error| AssetError::new(format!("{name}: {error}")))?;
        Self::new(texture, set, transform.as_ref(), ColorSpace::Linear)
    }

    fn new(texture: Index<TextureEntry>, set: u32, extension: Option<&TextureTransform>, space: ColorSpace) -> Result<Self, AssetError> {
        let Some(extension) = extension else { return Ok(Self { texture, space, set, transform: None }) };
        let vector = |[x, y]: [f32; 2]| DVec2::new(x.into(), y.into());
        let (scale, rotation, offset) = (vector(extension.scale.0), f64::from(extension.rotation.0), vector(extension.offset.0));
        if !(scale.is_finite() && rotation.is_finite() && offset.is_finite()) {
            return Err(AssetError::new("KHR_texture_transform: its numbers are not finite"));
        }
        let transform = texture_transform(scale, rotation, offset);
        Ok(Self { texture, space, set: extension.tex_coord.unwrap_or(set), transform: Some(transform) })
    }
}

/// A texture by its number, whether it is linear, whether it takes the second set, and the bits of its transform.
type Key = (usize, bool, bool, Option<[u64; 6]>);

/// Textures and images already read, by their numbers in the file.
pub(super) struct Images<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    files: &'a Files<'a>,
    textures: BTreeMap<Key, usize>,
    /// By number, and whether linear.
    images: BTreeMap<(usize, bool), Arc<Image>>,
    /// Of these images, those that a sampler asks for.
    pyramids: BTreeMap<(usize, bool), Arc<Pyramid>>,
    bytes: usize,
}

impl<'a> Images<'a> {
    pub fn new(root: &'a Root, buffers: &'a Buffers<'a>, files: &'a Files<'a>) -> Self {
        Self { root, buffers, files, textures: BTreeMap::new(), images: BTreeMap::new(), pyramids: BTreeMap::new(), bytes: 0 }
    }

    /// The place in `textures` of a texture of the file, put there when it is asked for first. `second` says which set of a mesh's coordinates it takes.
    pub fn texture(
        &mut self,
        wanted: &Wanted,
        second: bool,
        textures: &mut Vec<Texture>,
        warnings: &mut Warnings,
    ) -> Result<usize, AssetError> {
        let number = wanted.texture.value();
        let bits = wanted.transform.map(|transform| transform.to_cols_array().map(f64::to_bits));
        let key = (number, wanted.space == ColorSpace::Linear, second, bits);
        if let Some(&known) = self.textures.get(&key) {
            return Ok(known);
        }
        let entry = at(&self.root.textures, wanted.texture, "texture")?;
        let sampler = entry.sampler.map(|sampler| at(&self.root.samplers, sampler, "sampler")).transpose()?;
        let wrap = sampler.map_or([Wrap::Repeat; 2], |sampler| wrap(sampler, number, warnings));
        let coordinates = Coordinates { second, transform: wanted.transform };
        let image = self.image(entry.source, wanted.space)?;
        let pyramid = sampler.filter(|sampler| asks_for_copies(sampler)).map(|_| self.pyramid(entry.source, wanted.space, &image));
        textures.push(Texture::Image { image, pyramid: pyramid.transpose()?, wrap, coordinates });
        self.textures.insert(key, textures.len() - 1);
        Ok(textures.len() - 1)
    }

    fn image(&mut self, index: Index<ImageEntry>, space: ColorSpace) -> Result<Arc<Image>, AssetError> {
        let key = (index.value(), space == ColorSpace::Linear);
        if let Some(known) = self.images.get(&key) {
            return Ok(known.clone());
        }
        let entry = at(&self.root.images, index, "image")?;
        let image = self.decode(entry, space).context(|| label("image", index.value(), entry.name.as_deref()))?;
        self.take(image.memory())?;
        let image = Arc::new(image);
        self.images.insert(key, image.clone());
        Ok(image)
    }

    fn pyramid(&mut self, index: Index<ImageEntry>, space: ColorSpace, image: &Image) -> Result<Arc<Pyramid>, AssetError> {
        let key = (index.value(), space == ColorSpace::Linear);
        if let Some(known) = self.pyramids.get(&key) {
            return Ok(known.clone());
        }
        let pyramid = Arc::new(Pyramid::new(image));
        self.take(pyramid.memory())?;
        self.pyramids.insert(key, pyramid.clone());
        Ok(pyramid)
    }

    fn take(&mut self, bytes: usize) -> Result<(), AssetError> {
        self.bytes += bytes;
        if self.bytes > MAX_IMAGE_BYTES {
            return Err(AssetError::new(format!("its images take more than {} GiB of memory", MAX_IMAGE_BYTES >> 30)));
        }
        Ok(())
    }

    fn decode(&self, entry: &ImageEntry, space: ColorSpace) -> Result<Image, AssetError> {
        match (entry.buffer_view, &entry.uri) {
            (Some(view), _) => Image::decode(self.buffers.view(view)?.0, space),
            (None, Some(uri)) => Image::decode(&fetch(uri, self.files)?, space),
            (None, None) => Err(AssetError::new("has neither bufferView nor uri")),
        }
    }
}

/// Whether a sampler makes small what is far away by smaller copies of the image.
fn asks_for_copies(sampler: &Sampler) -> bool {
    use MinFilter::{LinearMipmapLinear, LinearMipmapNearest, NearestMipmapLinear, NearestMipmapNearest};
    matches!(
        sampler.min_filter,
        Some(Checked::Valid(LinearMipmapLinear | LinearMipmapNearest | NearestMipmapLinear | NearestMipmapNearest))
    )
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
