//! What every model that was read promises, whatever its file was.

use super::LoadedModel;

/// For tests, of this crate and of the whole.
///
/// # Panics
/// When a promise is broken.
pub fn check_promises(model: &LoadedModel) {
    for instance in &model.instances {
        assert!(instance.mesh < model.meshes.len() && instance.transform.is_finite() && instance.transform.matrix3.determinant() != 0.0);
    }
    for mesh in &model.meshes {
        let count = mesh.positions.len();
        assert!(mesh.triangles.as_flattened().iter().all(|&index| (index as usize) < count));
        assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
        assert!(mesh.normals.is_empty() || mesh.normals.len() == count);
        for normal in &mesh.normals {
            let length = normal.iter().map(|x| x * x).sum::<f32>().sqrt();
            assert!((length - 1.0).abs() < 1e-6, "{normal:?}");
        }
        assert!(mesh.uvs.is_empty() || mesh.uvs.len() == count);
        assert!(mesh.uvs.as_flattened().iter().all(|x| x.is_finite()));
        assert!(mesh.colors.is_empty() || mesh.colors.len() == count);
        assert!(mesh.colors.as_flattened().iter().all(|x| (0.0..=1.0).contains(x)));
        let material = &model.materials[mesh.material];
        assert!(material.base_color.iter().all(|x| (0.0..=1.0).contains(x)));
        assert!(material.texture.is_none_or(|texture| texture < model.textures.len() && mesh.uvs.len() == count));
    }
}
