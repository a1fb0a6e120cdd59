//! How far one picture lies from another.

use serde::Serialize;
use tessera_engine::film::Film;

/// The difference of a picture from a reference of the same size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Difference {
    /// Root of the mean squared difference over all components, in radiance.
    pub rmse: f64,
    /// Mean of `(a - b)^2 / (b^2 + 0.01)` over all components: what is dark counts as much as what is bright (Rousselle, Knaus, Zwicker, "Adaptive
    /// Sampling and Reconstruction using Greedy Error Minimization", 2011, section 6).
    pub relative_mse: f64,
    /// Root of the mean squared difference of the sRGB values that a screen shows, each in [0, 1].
    pub on_screen: f64,
}

/// What keeps black pixels from counting without bound.
const EPSILON: f64 = 0.01;

/// Compares two pictures; `exposure` in stops is what the preview is shown with. `None` where their sizes differ.
pub fn difference(picture: &Film, reference: &Film, exposure: f64) -> Option<Difference> {
    if (picture.width(), picture.height()) != (reference.width(), reference.height()) {
        return None;
    }
    let scale = exposure.exp2();
    let (mut squared, mut relative, mut shown) = (0.0, 0.0, 0.0);
    for (a, b) in picture.pixels().iter().flatten().zip(reference.pixels().iter().flatten()) {
        let (a, b) = (f64::from(*a), f64::from(*b));
        squared += (a - b).powi(2);
        relative += (a - b).powi(2) / (b * b + EPSILON);
        shown += (screen(a * scale) - screen(b * scale)).powi(2);
    }
    let count = (picture.pixels().len() * 3).max(1) as f64;
    Some(Difference { rmse: (squared / count).sqrt(), relative_mse: relative / count, on_screen: (shown / count).sqrt() })
}

/// The sRGB value of a radiance, in [0, 1] (IEC 61966-2-1).
fn screen(linear: f64) -> f64 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(pixels: &[[f32; 3]]) -> Film {
        Film::from_pixels(pixels.len() as u32, 1, pixels.to_vec()).unwrap()
    }

    #[test]
    fn differences_are_those_of_the_definitions() {
        let (a, b) = (film(&[[0.5, 0.0, 2.0], [1.0; 3]]), film(&[[0.25, 0.0, 4.0], [1.0; 3]]));
        let found = difference(&a, &b, 0.0).unwrap();
        assert!((found.rmse - ((0.0625_f64 + 4.0) / 6.0).sqrt()).abs() < 1e-12);
        assert!((found.relative_mse - (0.0625 / 0.0725 + 4.0 / 16.01) / 6.0).abs() < 1e-12);
        // 0.5 is shown as code 188 of 255, 0.25 as 137; beyond 1 all is white.
        assert!((found.on_screen - ((188.0_f64 - 137.0) / 255.0) / 6.0_f64.sqrt()).abs() < 2e-3, "{found:?}");
        assert_eq!(difference(&a, &a, 0.0), Some(Difference::default()));
        assert!(difference(&a, &film(&[[0.0; 3]]), 0.0).is_none());
        assert!(difference(&a, &b, -2.0).unwrap().on_screen > found.on_screen, "at a lower exposure white is no longer white");
    }
}
