//! Numbers at the ends of what samplers give, for tests: what seldom or never comes by chance must do no harm.

use std::cell::Cell;

/// What becomes of all numbers of this thread's samplers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbers {
    /// They are what they are.
    Random,
    /// All are 0.
    Least,
    /// All are the largest number below 1.
    Greatest,
    /// A quarter of them are 0, a quarter the largest number below 1, at random.
    Mixed,
}

/// The largest number below 1.
const GREATEST: f64 = 1.0 - f64::EPSILON / 2.0;

thread_local! {
    static NUMBERS: Cell<Numbers> = const { Cell::new(Numbers::Random) };
}

impl Numbers {
    /// Does work of this thread with such numbers.
    pub fn during<T>(self, work: impl FnOnce() -> T) -> T {
        let before = NUMBERS.replace(self);
        let done = work();
        NUMBERS.set(before);
        done
    }
}

/// What becomes of a number.
pub(super) fn instead_of(number: f64) -> f64 {
    match NUMBERS.get() {
        Numbers::Random => number,
        Numbers::Least => 0.0,
        Numbers::Greatest => GREATEST,
        Numbers::Mixed => match (number * (1_u64 << 53) as f64) as u64 % 4 {
            0 => 0.0,
            1 => GREATEST,
            _ => number,
        },
    }
}
