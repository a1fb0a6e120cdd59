//! What gathers light: mirrors, and glass that is smooth.

use super::geometry::{Geometry, LocalShape, Placed};
use crate::{
    light::Ball,
    material::Material,
    shape::{Bounds, Sphere},
};

/// Balls around all finite objects that may gather light.
pub fn casters(geometry: &Geometry, materials: &[Material]) -> Vec<Ball> {
    let mut balls = Vec::new();
    let mut add = |material: u32, ball: &dyn Fn() -> Ball| {
        if materials[material as usize].recipe.gathers() {
            balls.push(ball());
        }
    };
    each(&geometry.spheres, |s| add(s.material, &|| Ball { center: s.shape.center, radius: s.shape.radius }));
    each(&geometry.cuboids, |s| add(s.material, &|| around(s.shape.bounds())));
    each(&geometry.discs, |s| add(s.material, &|| Ball { center: s.shape.center, radius: s.shape.radius }));
    each(&geometry.others, |s| add(s.material, &|| around(s.shape.bounds())));
    each(&geometry.transformed, |s| {
        add(s.material, &|| match s.shape.shape {
            LocalShape::Sphere(Sphere { center, radius }) => {
                let (map, [_, growth]) = (&s.shape.transform, s.shape.transform.growths());
                Ball { center: map.to_world.transform_point3(center), radius: radius * growth }
            }
            shape => around(s.shape.transform.bounds(shape.bounds())),
        });
    });
    each(&geometry.instances, |s| {
        add(s.material, &|| around(s.shape.transform.bounds(geometry.meshes[s.shape.mesh as usize].triangles.bounds())))
    });
    balls.retain(|ball| ball.radius > 0.0 && ball.radius.is_finite() && ball.center.is_finite());
    balls
}

fn each<S>(table: &[Placed<S>], mut f: impl FnMut(&Placed<S>)) {
    table.iter().for_each(&mut f);
}

fn around(Bounds { min, max }: Bounds) -> Ball {
    Ball { center: (min + max) * 0.5, radius: (max - min).length() * 0.5 }
}
