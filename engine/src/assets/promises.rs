//! What every model that was read promises, whatever its file was.

use glam::DVec3;

use super::{AlphaMode, LoadedModel, ModelLightKind, ModelMaterial};

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
        for uvs in [&mesh.uvs, &mesh.second_uvs] {
            assert!(uvs.is_empty() || uvs.len() == count);
            assert!(uvs.as_flattened().iter().all(|x| x.is_finite()));
        }
        assert!(mesh.tangents.is_empty() || mesh.tangents.len() == count);
        for &[x, y, z, side] in &mesh.tangents {
            let length = (x * x + y * y + z * z).sqrt();
            assert!((length == 0.0 || (length - 1.0).abs() < 1e-6) && side.abs() == 1.0);
        }
        assert!(mesh.colors.is_empty() || mesh.colors.len() == count);
        assert!(mesh.colors.as_flattened().iter().all(|x| (0.0..=1.0).contains(x)));
        for texture in model.materials[mesh.material].textures() {
            let uvs = if model.textures[texture].coordinates().second { &mesh.second_uvs } else { &mesh.uvs };
            assert_eq!(uvs.len(), count);
        }
    }
    model.materials.iter().for_each(check_material);
    for light in &model.lights {
        assert!(light.strength.iter().all(|x| x.is_finite() && *x >= 0.0));
        let (position, direction) = match light.kind {
            ModelLightKind::Point { position } => (position, DVec3::Z),
            ModelLightKind::Directional { direction } => (DVec3::ZERO, direction),
            ModelLightKind::Spot { position, direction, inner, outer } => {
                assert!(inner >= 0.0 && inner <= outer && outer > 0.0 && outer <= std::f64::consts::FRAC_PI_2);
                (position, direction)
            }
        };
        assert!(position.is_finite() && direction.is_finite() && direction != DVec3::ZERO);
    }
}

fn check_material(material: &ModelMaterial) {
    let fraction = |x: f32| assert!((0.0..=1.0).contains(&x));
    let amount = |x: f32| assert!(x.is_finite() && x >= 0.0);
    material.base_color.into_iter().chain([material.metallic, material.roughness, material.specular.factor]).for_each(fraction);
    material.emission.radiance.into_iter().chain(material.specular.color).for_each(amount);
    assert!(material.ior == 0.0 || (1.0..=1e4).contains(&material.ior));
    if let AlphaMode::Mask(cutoff) = material.alpha {
        assert!(cutoff.is_finite());
    }
    material.transmission.iter().for_each(|transmission| fraction(transmission.factor));
    if let Some(volume) = &material.volume {
        amount(volume.thickness);
        assert!(volume.attenuation_distance > 0.0);
        volume.attenuation_color.into_iter().for_each(fraction);
    }
    material.clearcoat.iter().flat_map(|coat| [coat.factor, coat.roughness]).for_each(fraction);
    material.sheen.iter().flat_map(|sheen| sheen.color.into_iter().chain([sheen.roughness])).for_each(fraction);
    if let Some(anisotropy) = &material.anisotropy {
        fraction(anisotropy.strength);
        assert!(anisotropy.rotation.is_finite());
    }
    let coat = material.clearcoat.and_then(|coat| coat.normal);
    material.normal.iter().chain(&coat).for_each(|map| assert!(map.scale.is_finite()));
}
