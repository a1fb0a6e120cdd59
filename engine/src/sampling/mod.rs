//! Samples: the numbers behind every choice, and what is chosen by them.

#[cfg(test)]
mod extreme;
mod filter;
mod sobol;
mod warp;

pub use self::{
    filter::PixelFilter,
    sobol::Sampler,
    warp::{concentric_disc, cosine_hemisphere, sin_cos_of_turn, uniform_cone, uniform_cone_pdf, uniform_sphere, uniform_triangle},
};

#[cfg(test)]
pub(crate) use self::extreme::Numbers;
pub(crate) use self::sobol::mix;

impl Sampler {
    /// The set of numbers for the point on the film.
    pub const FILM: u32 = 0;
    /// The one for the point on the lens.
    pub const LENS: u32 = 1;
    /// The first of those that are free for integrators.
    pub const FIRST_FREE: u32 = 2;
}
