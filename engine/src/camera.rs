//! Cameras: from film coordinates to rays.

use glam::DVec3;

use crate::{
    description::{self, Film},
    math::{max_abs, tan},
    shape::{Bounds, Ray},
};

/// A compiled camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    eye: DVec3,
    /// Film coordinates (0, 0), the upper left corner, on the image plane at distance 1 before the eye.
    corner: DVec3,
    /// One pixel to the right.
    right: DVec3,
    /// One pixel down.
    down: DVec3,
}

impl Camera {
    /// Prepares a camera for a film.
    ///
    /// # Errors
    /// Says which of the camera's settings is wrong.
    pub fn compile(camera: &description::Camera, film: &Film) -> Result<Self, String> {
        let description::Camera::Perspective { eye, look_at, up, horizontal_fov } = camera;
        let (eye, look_at, up) = (DVec3::from(*eye), DVec3::from(*look_at), DVec3::from(*up));
        if !(eye.is_finite() && look_at.is_finite() && up.is_finite()) {
            return Err("the camera's eye, look_at and up must be finite".into());
        }
        if !(*horizontal_fov > 0.0 && *horizontal_fov < 180.0) {
            return Err(format!("the camera's fov must lie between 0 and 180 degrees, not {horizontal_fov}"));
        }
        let forward = direction(look_at - eye).ok_or("the camera's look_at must differ from its eye")?;
        let right = direction(up)
            .and_then(|up| direction(forward.cross(up)).filter(|_| forward.cross(up).length() > 1e-9))
            .ok_or("the camera's up must not be parallel to its view")?;
        let upright = right.cross(forward);
        let (width, height) = (f64::from(film.width), f64::from(film.height));
        let half = tan(horizontal_fov.to_radians() / 2.0);
        let pixel = 2.0 * half / width;
        let corner = forward - right * half + upright * (half * height / width);
        Ok(Self { eye, corner, right: right * pixel, down: upright * -pixel })
    }

    /// The same camera elsewhere.
    pub fn moved(self, by: DVec3) -> Self {
        Self { eye: self.eye + by, ..self }
    }

    /// Where all its rays start.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// The ray through film coordinates: pixel (i, j) covers [i, i + 1) x [j, j + 1), row 0 is the top.
    #[inline]
    pub fn ray(&self, x: f64, y: f64) -> Ray {
        Ray::new(self.eye, (self.corner + self.right * x + self.down * y).normalize())
    }
}

/// A unit vector, however large or small `v` is; `None` for 0.
fn direction(v: DVec3) -> Option<DVec3> {
    let size = max_abs(v);
    (size > 0.0 && size.is_finite()).then(|| (v / size).normalize())
}

/// A camera that frames a model by itself: three quarters from the front, from a little above, everything visible, a margin around it.
///
/// `aspect` is the film's width over its height.
pub fn frame_all(bounds: Bounds, aspect: f64) -> description::Camera {
    const FOV: f64 = 35.0;
    const MARGIN: f64 = 1.08;
    let center = bounds.min + (bounds.max - bounds.min) * 0.5;
    let towards_eye = DVec3::new(0.55, 0.38, 0.75).normalize();
    let forward = -towards_eye;
    let right = direction(forward.cross(DVec3::Y)).unwrap_or(DVec3::X);
    let up = right.cross(forward);
    let half = tan(FOV.to_radians() / 2.0) / MARGIN;
    // A corner at (x, y) beside the axis and z before the centre is in view from distance z + |x| / half and z + |y| aspect / half on.
    let distance = bounds
        .corners()
        .map(|corner| {
            let offset = corner - center;
            let beside = offset.dot(right).abs().max(offset.dot(up).abs() * aspect);
            offset.dot(towards_eye) + beside / half
        })
        .into_iter()
        .fold(0.0, f64::max);
    // A single point has no size: any distance shows it.
    let distance = if distance > 0.0 { distance } else { max_abs(center).max(1.0) };
    let eye = center + towards_eye * distance;
    description::Camera::Perspective { eye: eye.into(), look_at: center.into(), up: [0.0, 1.0, 0.0], horizontal_fov: FOV }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Filter;

    fn film(width: u32, height: u32) -> Film {
        Film { width, height, filter: Filter::Box }
    }

    fn looking(eye: [f64; 3], look_at: [f64; 3], horizontal_fov: f64) -> description::Camera {
        description::Camera::Perspective { eye, look_at, up: [0.0, 1.0, 0.0], horizontal_fov }
    }

    /// With a field of view of 90 degrees the film at distance 1 reaches from -1 to 1; rows go down, square pixels.
    #[test]
    fn film_coordinates_map_to_directions_by_the_closed_form() {
        let camera = Camera::compile(&looking([0.0; 3], [0.0, 0.0, -5.0], 90.0), &film(8, 4)).unwrap();
        for (x, y, expected) in [
            (4.0, 2.0, DVec3::new(0.0, 0.0, -1.0)),
            (0.0, 0.0, DVec3::new(-1.0, 0.5, -1.0)),
            (8.0, 0.0, DVec3::new(1.0, 0.5, -1.0)),
            (8.0, 4.0, DVec3::new(1.0, -0.5, -1.0)),
            (0.5, 2.5, DVec3::new(-0.875, -0.125, -1.0)),
        ] {
            let ray = camera.ray(x, y);
            assert!((ray.direction - expected.normalize()).length() < 1e-15, "({x}, {y}): {ray:?}");
            assert_eq!((ray.origin, ray.t_max), (DVec3::ZERO, f64::INFINITY));
        }
    }

    #[test]
    fn the_field_of_view_is_the_horizontal_one() {
        let camera = Camera::compile(&looking([1.0, 2.0, 3.0], [4.0, 2.5, 1.0], 40.0), &film(300, 900)).unwrap();
        let (left, right) = (camera.ray(0.0, 450.0).direction, camera.ray(300.0, 450.0).direction);
        assert!((crate::math::acos(left.dot(right)).to_degrees() - 40.0).abs() < 1e-12);
        let middle = camera.ray(150.0, 450.0);
        assert!((middle.direction - DVec3::new(3.0, 0.5, -2.0).normalize()).length() < 1e-15);
    }

    #[test]
    fn settings_that_show_nothing_are_refused() {
        let of = |camera| Camera::compile(&camera, &film(4, 4));
        assert!(of(looking([0.0; 3], [0.0; 3], 40.0)).unwrap_err().contains("look_at must differ"));
        assert!(of(looking([0.0; 3], [0.0, 3.0, 0.0], 40.0)).unwrap_err().contains("parallel"));
        assert!(of(looking([0.0; 3], [0.0, 0.0, f64::NAN], 40.0)).unwrap_err().contains("finite"));
        for fov in [0.0, 180.0, -1.0, f64::NAN] {
            assert!(of(looking([0.0; 3], [0.0, 0.0, 1.0], fov)).unwrap_err().contains("between 0 and 180"));
        }
    }

    /// Where a point falls on the film, in units of its width and height; the inverse of [`Camera::ray`], solved here by Cramer's rule.
    fn projected(camera: &Camera, point: DVec3, width: f64, height: f64) -> (f64, f64) {
        let towards = point - camera.eye;
        let (a, b, c) = (camera.right, camera.down, -towards);
        let determinant = a.dot(b.cross(c));
        let solve = |x: DVec3, y: DVec3, z: DVec3| x.dot(y.cross(z)) / determinant;
        let scale = solve(a, b, -camera.corner);
        assert!(scale > 0.0, "in front of the camera");
        (solve(-camera.corner, b, c) / width, solve(a, -camera.corner, c) / height)
    }

    #[test]
    fn framing_keeps_every_corner_in_view_and_fills_the_film() {
        let boxes = [
            (DVec3::ZERO, DVec3::ONE),
            (DVec3::new(-1e-6, 0.0, 0.0), DVec3::splat(1e-6)),
            (DVec3::new(1e6, -4.0, 3.0), DVec3::new(1e6 + 900.0, 2.0, 4.0)),
            (DVec3::new(-3.0, 0.0, 1.0), DVec3::new(-3.0, 50.0, 1.5)),
            (DVec3::new(0.0, 0.0, -70.0), DVec3::new(1.0, 1.0, 70.0)),
        ];
        for (min, max) in boxes {
            for (width, height) in [(1024, 768), (300, 900), (1920, 400)] {
                let bounds = Bounds { min, max };
                let (w, h) = (f64::from(width), f64::from(height));
                let camera = Camera::compile(&frame_all(bounds, w / h), &film(width, height)).unwrap();
                let corners = bounds.corners().map(|corner| projected(&camera, corner, w, h));
                let reach = corners.iter().map(|(x, y)| (x - 0.5).abs().max((y - 0.5).abs())).fold(0.0, f64::max);
                assert!(reach < 0.5, "{bounds:?} on {width} x {height} reaches {reach}");
                assert!(reach > 0.44, "{bounds:?} on {width} x {height} reaches {reach} only");
            }
        }
    }
}
