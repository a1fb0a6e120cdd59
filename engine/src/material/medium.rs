//! Homogeneous media: how far light gets, and where to it is scattered.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::rgb;
use crate::{
    description,
    math::{exp, ln, orthonormal_basis},
    sampling::sin_cos_of_turn,
};

/// A compiled medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Absorption and scattering, per scene unit.
    extinction: DVec3,
    scattering: DVec3,
    /// Mean cosine of scattering.
    anisotropy: f64,
}

/// What becomes of light on its way to a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Travel {
    /// It arrives, with this weight.
    Arrives(DVec3),
    /// It is scattered at a distance, with this weight.
    Scatters(f64, DVec3),
}

impl Medium {
    /// Prepares a medium; `None` if there is nothing in it.
    pub fn compile(medium: &description::Medium) -> Option<Self> {
        let (absorption, scattering) = (rgb(medium.absorption), rgb(medium.scattering));
        let extinction = absorption + scattering;
        (extinction != DVec3::ZERO).then_some(Self { extinction, scattering, anisotropy: medium.anisotropy })
    }

    /// One that only absorbs; `None` if it does not.
    pub fn absorbing(extinction: DVec3) -> Option<Self> {
        (extinction != DVec3::ZERO).then_some(Self { extinction, scattering: DVec3::ZERO, anisotropy: 0.0 })
    }

    /// The share of light that is left after a distance: Beer and Lambert's law.
    pub fn transmittance(&self, distance: f64) -> DVec3 {
        (self.extinction * -distance).map(|x| if x == 0.0 || x.is_nan() { 1.0 } else { exp(x) })
    }

    /// Whether a ray to a surface at `distance` gets there, by numbers in [0, 1): the first chooses one of the channels, the second how far it gets; weights are those of
    /// all channels together (Pharr, Jakob, Humphreys, "Physically Based Rendering", 3rd ed., 15.2.1).
    pub fn travel(&self, distance: f64, u: DVec2) -> Travel {
        if self.scattering == DVec3::ZERO {
            return Travel::Arrives(self.transmittance(distance));
        }
        let channel = ((u.x * 3.0) as usize).min(2);
        let way = if self.extinction[channel] > 0.0 { -ln(1.0 - u.y) / self.extinction[channel] } else { f64::INFINITY };
        let third = |v: DVec3| (v.x + v.y + v.z) / 3.0;
        if way < distance {
            let left = self.transmittance(way);
            Travel::Scatters(way, self.scattering * left / third(self.extinction * left))
        } else {
            let left = self.transmittance(distance);
            let density = third(left);
            Travel::Arrives(if density > 0.0 { left / density } else { DVec3::ZERO })
        }
    }

    /// The density, by solid angle, with which light is scattered by an angle of this cosine between the directions of travel (Henyey and Greenstein, "Diffuse Radiation in the
    /// Galaxy", 1941).
    pub fn phase(&self, cos: f64) -> f64 {
        let g = self.anisotropy;
        let denominator = (1.0 + g * g - 2.0 * g * cos).max(f64::MIN_POSITIVE);
        0.25 * FRAC_1_PI * (1.0 - g * g) / (denominator * denominator.sqrt())
    }

    /// A direction in which light that travels along `direction` is scattered, and its density [`Self::phase`].
    pub fn scatter(&self, direction: DVec3, u: DVec2) -> (DVec3, f64) {
        let g = self.anisotropy;
        let cos = if g.abs() < 1e-3 {
            // The closed form loses all its digits here; this is its beginning in powers of g.
            let x = 1.0 - 2.0 * u.x;
            -x - 1.5 * g * (x * x - 1.0)
        } else {
            let root = (1.0 - g * g) / (1.0 + g - 2.0 * g * u.x);
            (1.0 + g * g - root * root) / (2.0 * g)
        };
        let cos = cos.clamp(-1.0, 1.0);
        let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
        let (y, x) = sin_cos_of_turn(u.y);
        let (across, beside) = orthonormal_basis(direction);
        (across * (sin * x) + beside * (sin * y) + direction * cos, self.phase(cos))
    }

    /// Whether it scatters light.
    pub fn scatters(&self) -> bool {
        self.scattering != DVec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::sampling::Sampler;

    fn medium(absorption: [f32; 3], scattering: [f32; 3], anisotropy: f64) -> Medium {
        Medium::compile(&description::Medium { absorption, scattering, anisotropy }).unwrap()
    }

    fn samples(count: u64) -> impl Iterator<Item = DVec2> {
        (0..count).map(|index| Sampler::new(3, (0, 0), index).pair(0))
    }

    #[test]
    fn the_phase_function_is_a_density_whose_mean_cosine_is_its_parameter() {
        for g in [-0.95, -0.3, -1e-4, 0.0, 5e-4, 0.6, 0.95] {
            let medium = medium([0.0; 3], [1.0; 3], g);
            const STEPS: u32 = 200_000;
            let (mut whole, mut mean) = (0.0, 0.0);
            for step in 0..STEPS {
                let cos = (f64::from(step) + 0.5) / f64::from(STEPS) * 2.0 - 1.0;
                let share = medium.phase(cos) * 4.0 * PI / f64::from(STEPS);
                whole += share;
                mean += share * cos;
            }
            assert!((whole - 1.0).abs() < 1e-5 && (mean - g).abs() < 1e-5, "{g}: {whole} {mean}");
            let sampled = samples(1 << 16).map(|u| medium.scatter(DVec3::Y, u).0.y).sum::<f64>() / f64::from(1 << 16);
            assert!((sampled - g).abs() < 1e-3, "{g}: {sampled}");
        }
    }

    /// Over all that can become of light, the mean weight of what arrives is the transmittance, and that of what is scattered is albedo times the rest.
    #[test]
    fn weights_are_those_of_beer_and_lambert() {
        let medium = medium([0.5, 0.1, 0.0], [0.5, 0.7, 2.0], 0.0);
        let (mut arrives, mut scatters) = (DVec3::ZERO, DVec3::ZERO);
        let count = 1 << 18;
        for u in samples(count) {
            match medium.travel(0.8, u) {
                Travel::Arrives(weight) => arrives += weight / count as f64,
                Travel::Scatters(way, weight) => {
                    assert!(way < 0.8);
                    scatters += weight / count as f64;
                }
            }
        }
        let left = medium.transmittance(0.8);
        let albedo = medium.scattering / medium.extinction;
        assert!((arrives - left).abs().max_element() < 2e-3, "{arrives} {left}");
        assert!((scatters - albedo * (DVec3::ONE - left)).abs().max_element() < 2e-3, "{scatters}");
    }

    #[test]
    fn the_ends_of_all_numbers_give_numbers() {
        let highest = 1.0 - f64::EPSILON / 2.0;
        for medium in [medium([1e-30; 3], [0.0, 1e12, 1e-12], 0.999), medium([0.0; 3], [1.0, 0.0, 0.0], -0.999)] {
            for u in [DVec2::ZERO, DVec2::splat(highest), DVec2::new(0.0, highest), DVec2::new(highest, 0.0)] {
                for distance in [0.0, 1e-20, 1.0, f64::INFINITY] {
                    match medium.travel(distance, u) {
                        Travel::Arrives(weight) => assert!(weight.is_finite(), "{medium:?} {u} {distance}"),
                        Travel::Scatters(way, weight) => assert!(way.is_finite() && weight.is_finite(), "{medium:?} {u} {distance}"),
                    }
                }
                let (direction, pdf) = medium.scatter(DVec3::X, u);
                assert!(direction.is_finite() && pdf.is_finite());
            }
        }
    }
}
