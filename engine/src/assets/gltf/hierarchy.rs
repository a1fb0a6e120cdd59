//! The node hierarchy: which mesh and which light appears where.

use glam::{DAffine3, DMat3, DVec3};
use gltf::json::{Index, Node, Root};

use super::{
    AssetError,
    document::{at, label},
    lights,
};
use crate::assets::{files::Context, warnings::Warnings};

/// A thing of the file at a place, from its own to model coordinates.
pub(super) struct Placement {
    /// Its index in the file.
    pub index: usize,
    /// Finite.
    pub transform: DAffine3,
}

/// Everything at its place.
#[derive(Default)]
pub(super) struct Placements {
    /// Under transforms that can be inverted.
    pub meshes: Vec<Placement>,
    /// The indices may be wrong.
    pub lights: Vec<Placement>,
}

/// All meshes and lights of the default scene in depth-first order. Without a default scene that is the first one, or all root nodes where there is none.
pub(super) fn placements(root: &Root, warnings: &mut Warnings) -> Result<Placements, AssetError> {
    let mut placements = Placements::default();
    let mut visited = vec![false; root.nodes.len()];
    // A stack of its own: a chain of a million nodes must not overflow the thread's.
    let mut stack: Vec<(Index<Node>, DAffine3)> = roots(root, warnings)?.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
    while let Some((index, parent)) = stack.pop() {
        let node = at(&root.nodes, index, "node")?;
        let context = || label("node", index.value(), node.name.as_deref());
        if std::mem::replace(&mut visited[index.value()], true) {
            return Err(AssetError::new("has two parents, or is its own ancestor")).context(context);
        }
        let transform = parent * local(node).context(context)?;
        let light = lights::of_node(node).context(context)?;
        let determinant = transform.matrix3.determinant();
        if (node.mesh.is_some() || light.is_some()) && !(transform.is_finite() && determinant.is_finite()) {
            return Err(AssetError::new("its transform is not finite")).context(context);
        }
        if let Some(mesh) = node.mesh {
            at(&root.meshes, mesh, "mesh").context(context)?;
            match determinant == 0.0 {
                true => warnings.object("node", name(node, index), "is scaled to nothing; left out"),
                false => placements.meshes.push(Placement { index: mesh.value(), transform }),
            }
        }
        placements.lights.extend(light.map(|index| Placement { index, transform }));
        if node.skin.is_some() {
            warnings.object("node", name(node, index), "skinning is not modelled; drawn as the mesh is stored");
        }
        stack.extend(node.children.iter().flatten().rev().map(|&child| (child, transform)));
    }
    Ok(placements)
}

fn name(node: &Node, index: Index<Node>) -> String {
    node.name.as_ref().map_or_else(|| index.value().to_string(), |name| format!("{name:?}"))
}

fn roots(root: &Root, warnings: &mut Warnings) -> Result<Vec<Index<Node>>, AssetError> {
    let default = match root.scene {
        Some(scene) => Some(at(&root.scenes, scene, "scene")?),
        None => root.scenes.first(),
    };
    let Some(scene) = default else {
        let mut is_child = vec![false; root.nodes.len()];
        for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
            at(&root.nodes, *child, "node")?;
            is_child[child.value()] = true;
        }
        return Ok((0..root.nodes.len()).filter(|&node| !is_child[node]).map(|node| Index::new(node as u32)).collect());
    };
    if root.scenes.len() > 1 {
        warnings.file(format!("has {} scenes; only its default one is drawn", root.scenes.len()));
    }
    Ok(scene.nodes.clone())
}

/// Node to parent coordinates (glTF 2.0, section 3.5.3).
fn local(node: &Node) -> Result<DAffine3, AssetError> {
    if let Some(m) = node.matrix {
        let m = m.map(f64::from);
        if m[3] != 0.0 || m[7] != 0.0 || m[11] != 0.0 || m[15] != 1.0 {
            return Err(AssetError::new("its matrix is a projection, not an affine map"));
        }
        let column = |i: usize| DVec3::new(m[i], m[i + 1], m[i + 2]);
        return Ok(DAffine3 { matrix3: DMat3::from_cols(column(0), column(4), column(8)), translation: column(12) });
    }
    let scale = DVec3::from_array(node.scale.unwrap_or([1.0; 3]).map(f64::from));
    let translation = DVec3::from_array(node.translation.unwrap_or_default().map(f64::from));
    let rotation = rotation(node.rotation.map_or([0.0, 0.0, 0.0, 1.0], |rotation| rotation.0.map(f64::from)))?;
    Ok(DAffine3 { matrix3: rotation * DMat3::from_diagonal(scale), translation })
}

/// The rotation of a quaternion (x, y, z, w) of any length but 0.
fn rotation([x, y, z, w]: [f64; 4]) -> Result<DMat3, AssetError> {
    let norm = x * x + y * y + z * z + w * w;
    if norm <= 0.0 || !norm.is_finite() {
        return Err(AssetError::new("its rotation is no quaternion"));
    }
    let s = 2.0 / norm;
    Ok(DMat3::from_cols(
        DVec3::new(1.0 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)),
        DVec3::new(s * (x * y - w * z), 1.0 - s * (x * x + z * z), s * (y * z + w * x)),
        DVec3::new(s * (x * z + w * y), s * (y * z - w * x), 1.0 - s * (x * x + y * y)),
    ))
}
