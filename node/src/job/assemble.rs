//! From the things that a script made to the plain description of a frame.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use serde::Serialize;
use tessera_engine::description::{AssetId, Environment, Group, GroupId, MaterialId, Object, ObjectKind, Scene, Shape, Texture, TextureId};

use super::handle::{GroupNode, MaterialNode, NodeKind, ObjectNode, SceneNode};

/// The scene's description and the assets that it needs.
///
/// # Errors
/// None in practice: these types can be coded.
pub fn scene(node: &SceneNode) -> Result<(Scene, BTreeSet<AssetId>), postcard::Error> {
    let mut assembly = Assembly::default();
    let objects = assembly.objects(&node.objects)?;
    let mut scene = assembly.scene;
    scene.groups.push(Group { objects });
    scene.root = index(scene.groups.len() - 1);
    scene.lights.clone_from(&node.lights);
    scene.background.clone_from(&node.background);
    scene.medium.clone_from(&node.medium);
    if let Environment::Image { file, .. } = &scene.background {
        assembly.assets.insert(*file);
    }
    Ok((scene, assembly.assets))
}

/// Equal materials and textures are described once, in the order in which the scene meets them.
#[derive(Default)]
struct Assembly {
    scene: Scene,
    assets: BTreeSet<AssetId>,
    materials: BTreeMap<Vec<u8>, MaterialId>,
    textures: BTreeMap<Vec<u8>, TextureId>,
    /// Groups by identity. Only looked up, never walked: addresses decide nothing.
    groups: BTreeMap<*const GroupNode, GroupId>,
}

impl Assembly {
    fn objects(&mut self, nodes: &[Arc<ObjectNode>]) -> Result<Vec<Object>, postcard::Error> {
        nodes.iter().map(|node| self.object(node)).collect()
    }

    fn object(&mut self, node: &ObjectNode) -> Result<Object, postcard::Error> {
        let kind = match &node.kind {
            NodeKind::Shape { shape, material } => {
                self.assets.extend(shape_asset(shape));
                ObjectKind::Shape { shape: shape.clone(), material: self.material(material)? }
            }
            NodeKind::Model { model, material } => {
                self.assets.insert(model.file);
                self.assets.extend(model.parts.iter().map(|(_, id)| *id));
                let material = material.as_ref().map(|material| self.material(material)).transpose()?;
                ObjectKind::Model { model: model.clone(), material }
            }
            NodeKind::Instance { group } => ObjectKind::Instance { group: self.group(group)? },
        };
        Ok(Object { kind, transform: node.transform, source: node.source })
    }

    fn group(&mut self, node: &Arc<GroupNode>) -> Result<GroupId, postcard::Error> {
        if let Some(id) = self.groups.get(&Arc::as_ptr(node)) {
            return Ok(*id);
        }
        let objects = self.objects(&node.objects)?;
        self.scene.groups.push(Group { objects });
        let id = index(self.scene.groups.len() - 1);
        self.groups.insert(Arc::as_ptr(node), id);
        Ok(id)
    }

    fn material(&mut self, node: &MaterialNode) -> Result<MaterialId, postcard::Error> {
        let ids = node.textures.iter().map(|texture| self.texture(texture)).collect::<Result<Vec<_>, _>>()?;
        let mut material = node.material.clone();
        for texture in material.textures_mut() {
            *texture = ids[*texture as usize];
        }
        intern(&mut self.materials, &mut self.scene.materials, material)
    }

    fn texture(&mut self, texture: &Texture) -> Result<TextureId, postcard::Error> {
        if let Texture::Image { file, .. } = texture {
            self.assets.insert(*file);
        }
        intern(&mut self.textures, &mut self.scene.textures, texture.clone())
    }
}

fn intern<T: Serialize>(known: &mut BTreeMap<Vec<u8>, u32>, values: &mut Vec<T>, value: T) -> Result<u32, postcard::Error> {
    let id = *known.entry(postcard::to_stdvec(&value)?).or_insert(index(values.len()));
    if id as usize == values.len() {
        values.push(value);
    }
    Ok(id)
}

fn shape_asset(shape: &Shape) -> Option<AssetId> {
    match shape {
        Shape::Mesh { data } => Some(*data),
        _ => None,
    }
}

/// Scripts make far fewer than 2^32 things: `limits::SCRIPT_OBJECTS`.
fn index(position: usize) -> u32 {
    u32::try_from(position).unwrap_or(u32::MAX)
}
