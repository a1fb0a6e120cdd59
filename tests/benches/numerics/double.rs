//! Twice the precision of f64, about 106 bits (Dekker, "A Floating-Point Technique for Extending the Available Precision", 1971).

use std::ops::{Add, Div, Mul, Neg, Sub};

use glam::DVec3;

/// A sum of two numbers, the second far below the first.
#[derive(Clone, Copy, Debug)]
pub struct Double(pub f64, pub f64);

impl Double {
    /// The square root; 0 of what is negative.
    pub fn root(self) -> Self {
        if self.0 <= 0.0 {
            return Self(0.0, 0.0);
        }
        let root = Self::from(self.0.sqrt());
        (root + self / root) * Self::from(0.5)
    }

    fn sum(a: f64, b: f64) -> Self {
        let sum = a + b;
        let from_b = sum - a;
        Self(sum, (a - (sum - from_b)) + (b - from_b))
    }
}

impl From<f64> for Double {
    fn from(x: f64) -> Self {
        Self(x, 0.0)
    }
}

impl Add for Double {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (Self(high, error), Self(low, rest)) = (Self::sum(self.0, other.0), Self::sum(self.1, other.1));
        let Self(high, error) = Self::sum(high, error + low);
        Self::sum(high, error + rest)
    }
}

impl Neg for Double {
    type Output = Self;

    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl Sub for Double {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Double {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let product = self.0 * other.0;
        let error = self.0.mul_add(other.0, -product);
        Self::sum(product, error + (self.0 * other.1 + self.1 * other.0))
    }
}

impl Div for Double {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let quotient = Self::from(self.0 / other.0);
        let rest = self - quotient * other;
        quotient + Self::from(rest.0 / other.0)
    }
}

/// A vector of such numbers.
#[derive(Clone, Copy, Debug)]
pub struct Vector(pub [Double; 3]);

impl Vector {
    /// The scalar product.
    pub fn dot(self, other: Self) -> Double {
        self.0[0] * other.0[0] + self.0[1] * other.0[1] + self.0[2] * other.0[2]
    }

    /// The vector product.
    pub fn cross(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
    }

    /// The Euclidean length.
    pub fn length(self) -> Double {
        self.dot(self).root()
    }

    /// Every component multiplied.
    pub fn times(self, factor: Double) -> Self {
        Self(self.0.map(|x| x * factor))
    }
}

impl From<DVec3> for Vector {
    fn from(v: DVec3) -> Self {
        Self(v.to_array().map(Double::from))
    }
}

impl Add for Vector {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl Sub for Vector {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - other.0[i]))
    }
}
