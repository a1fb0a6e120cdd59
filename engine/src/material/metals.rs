//! Named metals: complex indices of refraction for red, green and blue.
//!
//! One wavelength stands for each colour of linear Rec.709: about 650, 550 and 450 nm, of published measurements of thick films as collected on
//! refractiveindex.info and in renderers' tables.

use glam::DVec3;

/// A metal's name, and n and k at 650, 550 and 450 nm; where others are meant, they are said.
type Metal = (&'static str, [f64; 3], [f64; 3]);

const METALS: [Metal; 10] = [
    ("aluminium", [1.346, 0.965, 0.617], [7.475, 6.400, 5.303]),
    // 70 % copper, 30 % zinc.
    ("brass", [0.444, 0.527, 1.094], [3.695, 2.765, 1.829]),
    ("chromium", [3.177, 3.181, 2.323], [3.329, 3.329, 3.135]),
    // At 549 nm (Johnson and Christy, "Optical Constants of the Noble Metals", 1972): at 550 nm other films are paler.
    ("copper", [0.271, 1.02, 1.316], [3.609, 2.59, 2.292]),
    ("gold", [0.183, 0.421, 1.373], [3.424, 2.346, 1.770]),
    ("iron", [2.911, 2.950, 2.585], [3.089, 2.932, 2.767]),
    // About 633, 546 and 450 nm, two digits (Palik, "Handbook of Optical Constants of Solids", 1985).
    ("nickel", [1.98, 1.79, 1.66], [3.74, 3.31, 2.65]),
    // 670, 550 and 430 nm.
    ("platinum", [2.439, 2.085, 1.800], [4.368, 3.715, 3.021]),
    ("silver", [0.159, 0.145, 0.135], [3.929, 3.190, 2.381]),
    ("titanium", [2.741, 2.542, 2.267], [3.814, 3.435, 3.039]),
];

/// All names, in order.
pub const NAMES: [&str; METALS.len()] = {
    let mut names = [""; METALS.len()];
    let mut at = 0;
    while at < METALS.len() {
        names[at] = METALS[at].0;
        at += 1;
    }
    names
};

/// The index of refraction `eta + i k` of a metal against vacuum, as `(eta, k)` for red, green and blue; `None` for an unknown name.
pub fn named(name: &str) -> Option<(DVec3, DVec3)> {
    METALS.iter().find(|metal| metal.0 == name).map(|&(_, eta, k)| (DVec3::from_array(eta), DVec3::from_array(k)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::conductor::Fresnel;

    #[test]
    fn metals_have_their_colours() {
        let color = |name: &str| named(name).map(|(eta, k)| Fresnel::index(eta, k).at(1.0)).unwrap();
        for name in NAMES {
            assert!(color(name).min_element() > 0.3 && color(name).max_element() < 0.99, "{name}: {}", color(name));
        }
        assert!(color("gold").x > color("gold").y && color("gold").y > 2.0 * color("gold").z);
        assert!(color("copper").x > color("copper").y && color("copper").y > color("copper").z);
        assert!(color("silver").min_element() > 0.9, "{}", color("silver"));
        assert_eq!(named("adamantium"), None);
    }
}
