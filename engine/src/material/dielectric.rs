//! Smooth interfaces: reflection, refraction, and Fresnel's equations (Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., 9.3 and 9.5).

use glam::DVec3;

/// The direction of perfect reflection of a ray that travels along the unit vector `d` on a surface of unit normal `n`: `d - 2 (d.n) n`.
#[inline(always)]
pub fn reflect(d: DVec3, n: DVec3) -> DVec3 {
    d - n * (2.0 * d.dot(n))
}

/// What a dielectric interface does with one ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// Share of unpolarised light that is reflected, in [0, 1]; 1 at total reflection.
    pub reflected: f64,
    /// Unit direction of the refracted ray; `None` at total reflection.
    pub refracted: Option<DVec3>,
}

/// Fresnel's equations and Snell's law for a ray along the unit vector `d` that meets an interface of unit normal `n`.
///
/// `n` points out of the denser side, and `ior` is that side's index relative to the other: a ray against `n` enters, a ray along it leaves.
#[inline(always)]
pub fn interface(d: DVec3, n: DVec3, ior: f64) -> Interface {
    let along = d.dot(n);
    // Turn the normal against the ray; `ratio` is the index before the interface relative to the one behind it.
    let (n, cos_i, ratio) = if along < 0.0 { (n, -along, 1.0 / ior) } else { (-n, along, ior) };
    let sin2_t = (1.0 - cos_i * cos_i).max(0.0) * (ratio * ratio);
    if sin2_t >= 1.0 {
        return Interface { reflected: 1.0, refracted: None };
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    // r_p = (cos_i - ratio cos_t) / (cos_i + ratio cos_t) and r_s = (ratio cos_i - cos_t) / (ratio cos_i + cos_t), over one denominator.
    let (below, beside) = (cos_i + ratio * cos_t, ratio * cos_i + cos_t);
    let parallel = (cos_i - ratio * cos_t) * beside;
    let perpendicular = (ratio * cos_i - cos_t) * below;
    let whole = below * beside;
    let reflected = 0.5 * (parallel * parallel + perpendicular * perpendicular) / (whole * whole);
    let refracted = d * ratio + n * (ratio * cos_i - cos_t);
    Interface { reflected, refracted: Some(refracted) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ray that meets the plane y = 0 from above with the given sine of incidence.
    fn incident(sin: f64) -> DVec3 {
        DVec3::new(sin, -(1.0 - sin * sin).sqrt(), 0.0)
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-14, "{a} is not {b}");
    }

    #[test]
    fn normal_incidence_reflects_by_the_closed_form() {
        for ior in [1.1, 1.33, 1.5, 2.4, 0.7] {
            let expected = ((ior - 1.0) / (ior + 1.0)) * ((ior - 1.0) / (ior + 1.0));
            let entering = interface(-DVec3::Y, DVec3::Y, ior);
            let leaving = interface(DVec3::Y, DVec3::Y, ior);
            close(entering.reflected, expected);
            close(leaving.reflected, expected);
            assert_eq!(entering.refracted, Some(-DVec3::Y));
            assert_eq!(leaving.refracted, Some(DVec3::Y));
        }
    }

    /// At Brewster's angle, tan = n, the parallel part vanishes and the rest is half of ((n^2 - 1) / (n^2 + 1))^2; reflected and refracted ray
    /// stand at a right angle.
    #[test]
    fn brewsters_angle_reflects_no_parallel_light() {
        for ior in [1.33_f64, 1.5, 2.4] {
            let d = incident(ior / (1.0 + ior * ior).sqrt());
            let at = interface(d, DVec3::Y, ior);
            let perpendicular = (ior * ior - 1.0) / (ior * ior + 1.0);
            close(at.reflected, 0.5 * perpendicular * perpendicular);
            close(at.refracted.unwrap().dot(reflect(d, DVec3::Y)), 0.0);
        }
    }

    #[test]
    fn total_reflection_begins_at_the_critical_angle() {
        let ior = 1.5;
        let leaving = |sin: f64| interface(-incident(sin), DVec3::Y, ior);
        assert!(leaving(1.0 / ior - 1e-9).refracted.is_some());
        assert!(leaving(1.0 / ior - 1e-9).reflected < 1.0);
        assert_eq!(leaving(1.0 / ior + 1e-9), Interface { reflected: 1.0, refracted: None });
        assert!(interface(incident(1.0 - 1e-12), DVec3::Y, ior).refracted.is_some(), "entering a denser side never reflects totally");
    }

    #[test]
    fn snells_law_holds_and_the_way_back_is_the_way_in() {
        for ior in [0.8, 1.2, 1.5, 2.4] {
            for step in 0..75 {
                let d = incident(f64::from(step) / 100.0);
                let Some(refracted) = interface(d, DVec3::Y, ior).refracted else { continue };
                close(refracted.length(), 1.0);
                close(d.x, ior * refracted.x);
                let back = interface(-refracted, DVec3::Y, ior);
                assert!((back.refracted.unwrap() + d).length() < 1e-14);
                // Stokes: both sides reflect the same share.
                close(back.reflected, interface(d, DVec3::Y, ior).reflected);
            }
        }
    }

    /// What is not reflected is refracted: 1 - F equals Fresnel's own transmission, (cos_t eta / cos_i) (t_s^2 + t_p^2) / 2.
    #[test]
    fn energy_is_kept() {
        let ior = 1.5;
        for step in 0..100 {
            let d = incident(f64::from(step) / 100.0);
            let at = interface(d, DVec3::Y, ior);
            let (cos_i, cos_t) = (-d.y, -at.refracted.unwrap().y);
            let s = 2.0 * cos_i / (cos_i + ior * cos_t);
            let p = 2.0 * cos_i / (ior * cos_i + cos_t);
            close(1.0 - at.reflected, 0.5 * (s * s + p * p) * ior * cos_t / cos_i);
        }
    }

    #[test]
    fn reflection_keeps_the_angle() {
        let d = incident(0.3);
        assert_eq!(reflect(d, DVec3::Y), DVec3::new(d.x, -d.y, 0.0));
        close(reflect(d, DVec3::new(0.6, 0.8, 0.0)).length(), 1.0);
    }
}
