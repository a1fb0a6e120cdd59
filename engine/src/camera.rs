//! Cameras: from film coordinates to rays.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::{DVec2, DVec3};

use crate::{
    description::{self, Film},
    math::{max_abs, sin_cos, tan},
    shape::{Bounds, Ray},
};

/// Largest size of a lens or a film in scene units, so that no square of it overflows.
const LARGEST: f64 = 1e75;

/// A compiled camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    eye: DVec3,
    projection: Projection,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Projection {
    /// The plane lies at distance 1 before the eye.
    Pinhole(Plane),
    /// The same plane, seen through a disc instead of a point.
    ThinLens { plane: Plane, lens: Lens },
    /// The plane goes through the eye.
    Orthographic { plane: Plane, forward: DVec3 },
    /// No plane but a sphere.
    Panoramic { axes: Axes, radians_per_pixel: DVec2 },
}

/// Film coordinates on a plane in the world, relative to the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plane {
    /// Film coordinates (0, 0), the upper left corner.
    corner: DVec3,
    /// One pixel to the right.
    right: DVec3,
    /// One pixel down.
    down: DVec3,
}

impl Plane {
    /// A film whose middle is `middle` and whose width is twice `half`.
    fn new(middle: DVec3, axes: &Axes, half: f64, film: &Film) -> Self {
        let (width, height) = (f64::from(film.width), f64::from(film.height));
        let pixel = 2.0 * half / width;
        let corner = middle - axes.right * half + axes.upright * (half * height / width);
        Self { corner, right: axes.right * pixel, down: axes.upright * -pixel }
    }

    /// Unit vector along the view.
    fn forward(&self) -> DVec3 {
        self.right.cross(self.down).normalize()
    }

    #[inline(always)]
    fn at(&self, x: f64, y: f64) -> DVec3 {
        self.corner + self.right * x + self.down * y
    }
}

/// Unit vectors of the view, perpendicular to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axes {
    forward: DVec3,
    right: DVec3,
    upright: DVec3,
}

impl Axes {
    fn new(eye: DVec3, look_at: DVec3, up: DVec3) -> Result<Self, String> {
        if !(eye.is_finite() && look_at.is_finite() && up.is_finite()) {
            return Err("the camera's eye, look_at and up must be finite".into());
        }
        let forward = direction(look_at - eye).ok_or("the camera's look_at must differ from its eye")?;
        let right = direction(up)
            .and_then(|up| direction(forward.cross(up)).filter(|_| forward.cross(up).length() > 1e-9))
            .ok_or("the camera's up must not be parallel to its view")?;
        Ok(Self { forward, right, upright: right.cross(forward) })
    }
}

/// The opening of a lens: a disc around the eye, parallel to the film.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Lens {
    /// Its radius along the film's rows.
    right: DVec3,
    /// Its radius along the film's columns.
    upright: DVec3,
    /// 1 / distance of the plane that is sharp.
    closeness: f64,
}

impl Lens {
    /// `None` for a pinhole.
    fn new(radius: f64, focus_distance: f64, axes: &Axes) -> Result<Option<Self>, String> {
        if !(0.0..=LARGEST).contains(&radius) {
            return Err(format!("the camera's lens_radius must lie between 0 and {LARGEST:e}, not {radius}"));
        }
        if !(focus_distance > 0.0 && focus_distance.is_finite()) {
            return Err(format!("the camera's focus_distance must be finite and above 0, not {focus_distance}"));
        }
        if radius == 0.0 {
            return Ok(None);
        }
        let closeness = 1.0 / focus_distance;
        if !(closeness.is_finite() && radius * closeness <= LARGEST) {
            return Err(format!("the camera's focus_distance is too small for a lens_radius of {radius}: {focus_distance}"));
        }
        Ok(Some(Self { right: axes.right * radius, upright: axes.upright * radius, closeness }))
    }

    /// From the eye to a point of the opening, spread evenly.
    #[inline(always)]
    fn at(&self, sample: DVec2) -> DVec3 {
        let disc = concentric_disc(sample);
        self.right * disc.x + self.upright * disc.y
    }
}

impl Camera {
    /// Prepares a camera for a film.
    ///
    /// # Errors
    /// Says which of the camera's settings is wrong.
    pub fn compile(camera: &description::Camera, film: &Film) -> Result<Self, String> {
        use description::Camera::{Orthographic, Panoramic, Perspective};
        let (Perspective { eye, look_at, up, .. } | Orthographic { eye, look_at, up, .. } | Panoramic { eye, look_at, up }) = camera;
        let eye = DVec3::from(*eye);
        let axes = Axes::new(eye, DVec3::from(*look_at), DVec3::from(*up))?;
        let projection = match *camera {
            Perspective { horizontal_fov, lens_radius, focus_distance, .. } => {
                Projection::perspective(&axes, horizontal_fov, Lens::new(lens_radius, focus_distance, &axes)?, film)?
            }
            Orthographic { width, .. } => Projection::orthographic(&axes, width, film)?,
            Panoramic { .. } => Projection::panoramic(axes, film),
        };
        Ok(Self { eye, projection })
    }

    /// The same camera elsewhere.
    pub fn moved(self, by: DVec3) -> Self {
        Self { eye: self.eye + by, ..self }
    }

    /// Where all its rays start if [`Camera::rays_start_at_eye`]; otherwise a point among those where they start: the centre of the lens, the
    /// middle of the film of an orthographic camera.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Whether all rays start at [`Camera::eye`].
    pub fn rays_start_at_eye(&self) -> bool {
        matches!(self.projection, Projection::Pinhole(_) | Projection::Panoramic { .. })
    }

    /// Whether rays depend on the sample of the lens.
    pub fn needs_lens(&self) -> bool {
        matches!(self.projection, Projection::ThinLens { .. })
    }

    /// The ray through film coordinates: pixel (i, j) covers [i, i + 1) x [j, j + 1), row 0 is the top. `lens`, in [0, 1)^2, chooses the point of
    /// the lens and means nothing unless [`Camera::needs_lens`].
    #[inline]
    pub fn ray(&self, x: f64, y: f64, lens: DVec2) -> Ray {
        match &self.projection {
            Projection::Pinhole(plane) => Ray::new(self.eye, plane.at(x, y).normalize()),
            // To where the pinhole's ray meets the plane in focus; its distance is divided out, however large it is (pbrt-v4, section 5.2.3).
            Projection::ThinLens { plane, lens: opening } => {
                let offset = opening.at(lens);
                Ray::new(self.eye + offset, (plane.at(x, y) - offset * opening.closeness).normalize())
            }
            Projection::Orthographic { plane, forward } => Ray::new(self.eye + plane.at(x, y), *forward),
            Projection::Panoramic { axes, radians_per_pixel } => {
                let (sin_longitude, cos_longitude) = sin_cos(x * radians_per_pixel.x - PI);
                let (sin_polar, cos_polar) = sin_cos(y * radians_per_pixel.y);
                let level = axes.forward * cos_longitude + axes.right * sin_longitude;
                Ray::new(self.eye, (level * sin_polar + axes.upright * cos_polar).normalize())
            }
        }
    }

    /// How far a place moves on its tangent plane when it is seen one pixel to the right, and one pixel down, of where it is: to first order
    /// (Igehy, "Tracing Ray Differentials", 1999). A thin lens sees as its middle does. Not finite where the plane is seen edge on.
    pub fn pixel_on(&self, place: DVec3, normal: DVec3) -> [DVec3; 2] {
        let from_eye = place - self.eye;
        let (view, beside) = match &self.projection {
            Projection::Pinhole(plane) | Projection::ThinLens { plane, .. } => {
                let depth = plane.forward().dot(from_eye);
                (from_eye, [plane.right * depth, plane.down * depth])
            }
            Projection::Orthographic { plane, forward } => (*forward, [plane.right, plane.down]),
            Projection::Panoramic { axes, radians_per_pixel } => {
                let right = from_eye.cross(axes.upright);
                (from_eye, [right * radians_per_pixel.x, from_eye.cross(right.normalize_or_zero()) * radians_per_pixel.y])
            }
        };
        let slope = normal / normal.dot(view);
        beside.map(|step| step - view * slope.dot(step))
    }
}

impl Projection {
    fn perspective(axes: &Axes, horizontal_fov: f64, lens: Option<Lens>, film: &Film) -> Result<Self, String> {
        if !(horizontal_fov > 0.0 && horizontal_fov < 180.0) {
            return Err(format!("the camera's fov must lie between 0 and 180 degrees, not {horizontal_fov}"));
        }
        let plane = Plane::new(axes.forward, axes, tan(horizontal_fov.to_radians() / 2.0), film);
        Ok(match lens {
            None => Self::Pinhole(plane),
            Some(lens) => Self::ThinLens { plane, lens },
        })
    }

    fn orthographic(axes: &Axes, width: f64, film: &Film) -> Result<Self, String> {
        if !(width > 0.0 && width <= LARGEST) {
            return Err(format!("the camera's width must lie above 0 and up to {LARGEST:e}, not {width}"));
        }
        Ok(Self::Orthographic { plane: Plane::new(DVec3::ZERO, axes, width / 2.0, film), forward: axes.forward })
    }

    fn panoramic(axes: Axes, film: &Film) -> Self {
        Self::Panoramic { axes, radians_per_pixel: DVec2::new(TAU / f64::from(film.width), PI / f64::from(film.height)) }
    }
}

/// A point of the unit disc, spread evenly, neighbours of neighbours (Shirley, Chiu, "A Low Distortion Map Between Disk and Square", JGT 2(3),
/// 1997).
fn concentric_disc(sample: DVec2) -> DVec2 {
    let DVec2 { x, y } = sample * 2.0 - 1.0;
    if x == 0.0 && y == 0.0 {
        return DVec2::ZERO;
    }
    let (radius, angle) = if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, FRAC_PI_2 - FRAC_PI_4 * (x / y)) };
    let (sin, cos) = sin_cos(angle);
    DVec2::new(cos, sin) * radius
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
    description::Camera::Perspective {
        eye: eye.into(),
        look_at: center.into(),
        up: [0.0, 1.0, 0.0],
        horizontal_fov: FOV,
        lens_radius: 0.0,
        focus_distance: distance,
    }
}

#[cfg(test)]
mod tests;
