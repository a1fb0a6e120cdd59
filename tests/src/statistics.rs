//! What is needed to tell noise from error: distributions, and when something that was measured many times cannot be by chance.

use std::f64::consts::PI;

/// Probability that something as unlikely as this would be seen once in a whole test, by chance.
pub const SIGNIFICANCE: f64 = 0.01;

/// The significance of each of `count` independent tests of which none may fail by chance with more than the probability `whole` (Sidak, "Rectangular Confidence Regions for the
/// Means of Multivariate Normal Distributions", 1967). Where they are not independent, the whole fails by chance less often still.
pub fn sidak(whole: f64, count: usize) -> f64 {
    -((-whole).ln_1p() / count.max(1) as f64).exp_m1()
}

/// A mean, and what is known of how it would vary.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Variance of the mean.
    pub variance: f64,
    /// Third central moment of the mean: above 0 where rare values are high.
    pub third: f64,
    /// Degrees of freedom of the variance; infinite if it is known.
    pub freedom: f64,
}

impl Estimate {
    /// A number that is known.
    pub fn exact(mean: f64) -> Self {
        Self::known(mean, 0.0)
    }

    /// A number whose error has a variance that is known.
    pub fn known(mean: f64, variance: f64) -> Self {
        Self { mean, variance, third: 0.0, freedom: f64::INFINITY }
    }

    /// Of independent measurements of the same.
    pub fn of(values: &[f64]) -> Self {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let moment = |power| values.iter().map(|value| (value - mean).powi(power)).sum::<f64>();
        Self::of_sums(values.len() as f64, mean, moment(2), moment(3))
    }

    /// Of so many measurements, their mean, and the sums of the squares and cubes of their distances from it: without bias (Fisher's k-statistics).
    pub fn of_sums(count: f64, mean: f64, squares: f64, cubes: f64) -> Self {
        let third = if count > 2.0 { cubes / (count * (count - 1.0) * (count - 2.0)) } else { 0.0 };
        Self { mean, variance: squares / (count * (count - 1.0)), third, freedom: count - 1.0 }
    }

    /// The sum of independent estimates: variances and third moments add, and by Welch and Satterthwaite the degrees of freedom of their sum are
    /// `(sum v)^2 / sum(v^2 / f)` (Satterthwaite, "An Approximate Distribution of Estimates of Variance Components", 1946).
    pub fn sum(parts: impl IntoIterator<Item = Self>) -> Self {
        let (mut mean, mut variance, mut third, mut spread) = (0.0, 0.0, 0.0, 0.0);
        for part in parts {
            mean += part.mean;
            variance += part.variance;
            third += part.third;
            spread += part.variance * part.variance / part.freedom;
        }
        Self { mean, variance, third, freedom: if spread > 0.0 { variance * variance / spread } else { f64::INFINITY } }
    }

    /// The same, times a number.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { mean: self.mean * factor, variance: self.variance * factor * factor, third: self.third * factor.powi(3), ..self }
    }

    /// Standard error.
    pub fn error(&self) -> f64 {
        self.variance.sqrt()
    }

    /// By how many standard errors two differ, and the probability that chance makes them differ as much: Welch's test, two-sided ("The Generalization of `Student's' Problem
    /// when Several Different Population Variances are Involved", 1947). Where rare values are high, a mean that is too low comes with a variance that is too low: that skewness is taken away by
    /// Hall's transformation ("On the Removal of Skewness by Transformation", 1992).
    pub fn compared(self, other: Self) -> (f64, f64) {
        let difference = Self::sum([self, other.scaled(-1.0)]);
        // What rounds alike is alike: means are taken of single-precision numbers.
        if difference.mean.abs() <= 1e-7 * self.mean.abs().max(other.mean.abs()) {
            return (0.0, 1.0);
        }
        let t = difference.mean / difference.error();
        // Few numbers tell nothing of their skewness.
        if difference.freedom < 50.0 {
            return (t, two_sided(t, difference.freedom));
        }
        (t, two_sided(without_skewness(t, difference.third / difference.error().powi(3)), difference.freedom))
    }
}

/// Hall's transformation `t + g t^2 / 3 + g^2 t^3 / 27 + g / 6` of a mean over its estimated standard error, where `g` is the skewness of that mean.
fn without_skewness(t: f64, g: f64) -> f64 {
    if g.is_finite() && t.is_finite() { t * (1.0 + g * t / 3.0 * (1.0 + g * t / 9.0)) + g / 6.0 } else { t }
}

/// Probability that a number of Student's distribution lies as far from 0.
pub fn two_sided(t: f64, freedom: f64) -> f64 {
    // Beyond this, t and normal distribution differ by less than what is asked here.
    let freedom = freedom.min(1e7);
    if t.is_infinite() { 0.0 } else { beta(0.5 * freedom, 0.5, freedom / (freedom + t * t)) }
}

/// Probability that a chi-square of this many degrees of freedom is at least so large, by the cube root's normal approximation (Wilson and Hilferty, "The Distribution of
/// Chi-Square", 1931): good to three digits from 30 degrees on.
pub fn chi_square_above(chi2: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    let z = ((chi2 / freedom).cbrt() - (1.0 - spread)) / spread.sqrt();
    let tail = 0.5 * two_sided(z, f64::INFINITY);
    if z > 0.0 { tail } else { 1.0 - tail }
}

/// The regularised incomplete beta function, by its continued fraction (Abramowitz and Stegun, 26.5.8), evaluated by Lentz's method.
fn beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - beta(b, a, 1.0 - x);
    }
    let front = (a * x.ln() + b * (1.0 - x).ln() + ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b)).exp() / a;
    let nonzero = |x: f64| if x.abs() < 1e-300 { 1e-300 } else { x };
    let (mut c, mut d) = (1.0, 1.0 / nonzero(1.0 - (a + b) * x / (a + 1.0)));
    let mut fraction = d;
    for m in 1..100_000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let before = fraction;
        for term in [even, odd] {
            d = 1.0 / nonzero(1.0 + term * d);
            c = nonzero(1.0 + term / c);
            fraction *= c * d;
        }
        if (fraction - before).abs() <= 1e-15 * fraction.abs() {
            break;
        }
    }
    front * fraction
}

/// Stirling's series, behind a shift to where it is good to 1e-15.
fn ln_gamma(x: f64) -> f64 {
    if x < 15.0 {
        return ln_gamma(x + 1.0) - x.ln();
    }
    let series = (1.0 / 12.0 - (1.0 / 360.0 - (1.0 / 1260.0 - 1.0 / (1680.0 * x * x)) / (x * x)) / (x * x)) / x;
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * PI).ln() + series
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a} is not {b}");
    }

    /// For 1 and 2 degrees of freedom, Student's distribution has closed forms; tables give the others.
    #[test]
    fn students_distribution_is_that_of_tables() {
        for t in [0.01, 0.5, 1.0, 3.0, 50.0] {
            close(two_sided(t, 1.0), 1.0 - 2.0 / PI * f64::atan(t), 1e-10);
            close(two_sided(t, 2.0), 1.0 - t / (2.0 + t * t).sqrt(), 1e-10);
        }
        close(two_sided(2.364_624, 7.0), 0.05, 1e-6);
        close(two_sided(3.499_483, 7.0), 0.01, 1e-6);
        close(two_sided(1.959_964, f64::INFINITY), 0.05, 1e-5);
        close(two_sided(5.0, 1e9), 5.733e-7, 1e-3);
        assert_eq!((two_sided(0.0, 5.0), two_sided(f64::INFINITY, 5.0)), (1.0, 0.0));
    }

    /// The mean of few numbers of an exponential distribution is as often far too high as far too low only where its skewness is taken away.
    #[test]
    fn skewness_is_taken_away() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            -(((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64).ln()
        };
        let (mut below, mut above, mut plain) = (0, 0, 0);
        for _ in 0..20_000 {
            let estimate = Estimate::of(&(0..100).map(|_| random()).collect::<Vec<_>>());
            let (t, p) = estimate.compared(Estimate::exact(1.0));
            below += u32::from(p < 0.02 && t < 0.0);
            above += u32::from(p < 0.02 && t > 0.0);
            plain += u32::from(t < -2.3646);
        }
        println!("{below} below, {above} above, {plain} below by the plain test; 200 each are meant");
        assert!((140..260).contains(&below) && (140..260).contains(&above) && plain > 450);
    }

    #[test]
    fn chi_square_is_that_of_tables() {
        close(chi_square_above(43.773, 30.0), 0.05, 5e-3);
        close(chi_square_above(135.807, 100.0), 0.01, 5e-3);
        close(chi_square_above(70.065, 100.0), 0.99, 1e-3);
    }

    #[test]
    fn many_tests_fail_together_as_often_as_was_asked() {
        close(1.0 - (1.0 - sidak(0.01, 5000)).powi(5000), 0.01, 1e-9);
        assert_eq!(sidak(0.01, 1), 0.01);
    }

    #[test]
    fn a_sum_of_equal_parts_has_the_freedom_of_all() {
        let part = Estimate::of(&[1.0, 2.0, 3.0, 4.0]);
        assert_eq!((part.mean, part.variance, part.freedom), (2.5, 5.0 / 12.0, 3.0));
        let sum = Estimate::sum([part; 10]);
        close(sum.mean, 25.0, 1e-15);
        close(sum.variance, 50.0 / 12.0, 1e-14);
        close(sum.freedom, 30.0, 1e-14);
        let one_matters = Estimate::sum([part, part.scaled(1e-6)]);
        close(one_matters.freedom, 3.0, 1e-9);
    }
}
