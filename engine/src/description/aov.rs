//! Arbitrary output variables: what a frame tells of each pixel beside its colour.

use serde::{Deserialize, Serialize};

/// One of them. What a ray from the camera meets first is what it meets through borders of media that cannot be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// Share of light that is passed on, as a colour and filtered as colours are: the reflectance with texture and vertex colours, what metals and mirrors reflect straight
    /// on, what glass reflects and lets through straight on. 0 where nothing is, and on what only shines.
    Albedo,
    /// Unit shading normal in the world, on the side that is seen, filtered as colours are; 0 where nothing is.
    Normal,
    /// Distance along the ray from where it starts, in scene units: the mean over those samples that meet something, at most [`Aov::FARTHEST`], which stands where none does.
    Depth,
    /// Place in the world: the mean over those samples that meet something; 0 where none does.
    Position,
    /// Number of the object that the first sample meets, from 1 in the order of the scene; 0 where it meets nothing. Meshes of models are objects by themselves.
    Object,
    /// Number of the material that the first sample meets, from 1 in the order of the scene, those of models behind all others; 0 where it meets nothing.
    Material,
    /// How many samples the pixel has.
    Samples,
    /// Standard error of the pixel's colour, by its samples as if they were independent (they are spread more evenly, so it is less); 0 for a single sample.
    Error,
    /// What the colour of the pixel, a float of 32 bits, lacks of the mean of its samples, as another one, times 2^32: with it, a picture of 2^n samples can be extended.
    Residual,
}

impl Aov {
    /// All of them, in the order in which a pixel holds them.
    pub const ALL: [Self; 9] =
        [Self::Albedo, Self::Normal, Self::Depth, Self::Position, Self::Object, Self::Material, Self::Samples, Self::Error, Self::Residual];

    /// The depth of nothing, in scene units: finite, as filters of compositors make NaN of what is not.
    pub const FARTHEST: f32 = 1e30;

    /// What it is called.
    pub fn name(self) -> &'static str {
        self.channels()[0].split('.').next().unwrap_or_default()
    }

    /// Its channels in a file, in the order in which a pixel holds them.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Albedo => &["albedo.R", "albedo.G", "albedo.B"],
            Self::Normal => &["normal.X", "normal.Y", "normal.Z"],
            Self::Depth => &["depth.Z"],
            Self::Position => &["position.X", "position.Y", "position.Z"],
            Self::Object => &["object.ID"],
            Self::Material => &["material.ID"],
            Self::Samples => &["samples.N"],
            Self::Error => &["error.R", "error.G", "error.B"],
            Self::Residual => &["residual.R", "residual.G", "residual.B"],
        }
    }

    /// Whether a picture that tells it can be extended to more samples: see [`crate::film::Film::joined`].
    pub fn can_be_extended(self) -> bool {
        matches!(self, Self::Object | Self::Material | Self::Samples | Self::Residual)
    }

    fn bit(self) -> u16 {
        1 << self as u16
    }
}

/// Those that a frame has: a set, so that the same ones are always coded alike.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "u16", into = "u16")]
pub struct Aovs(u16);

impl From<u16> for Aovs {
    /// Bit n stands for place n of [`Aov::ALL`]; further bits mean nothing.
    fn from(bits: u16) -> Self {
        Self(bits & ((1 << Aov::ALL.len()) - 1))
    }
}

impl From<Aovs> for u16 {
    fn from(aovs: Aovs) -> Self {
        aovs.0
    }
}

impl FromIterator<Aov> for Aovs {
    fn from_iter<I: IntoIterator<Item = Aov>>(aovs: I) -> Self {
        Self(aovs.into_iter().fold(0, |bits, aov| bits | aov.bit()))
    }
}

impl Aovs {
    /// None at all.
    pub const NONE: Self = Self(0);

    /// Whether there is none.
    pub fn is_empty(self) -> bool {
        self == Self::NONE
    }

    /// Whether this one is among them.
    pub fn contains(self, aov: Aov) -> bool {
        self.0 & aov.bit() != 0
    }

    /// They, in the order in which a pixel holds them.
    pub fn iter(self) -> impl Iterator<Item = Aov> {
        Aov::ALL.into_iter().filter(move |aov| self.contains(*aov))
    }

    /// Their channels in a file, in the order in which a pixel holds them.
    pub fn channels(self) -> impl Iterator<Item = &'static str> {
        self.iter().flat_map(|aov| aov.channels().iter().copied())
    }

    /// How many numbers they are in each pixel.
    pub fn numbers(self) -> usize {
        self.iter().map(|aov| aov.channels().len()).sum()
    }

    /// Bytes of a pixel of a part: red, green, blue and they, each as a float of 32 bits.
    pub fn bytes_per_pixel(self) -> u64 {
        4 * (3 + self.numbers() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_ones_are_coded_alike() {
        let some: Aovs = [Aov::Error, Aov::Albedo, Aov::Error].into_iter().collect();
        assert_eq!(some.iter().collect::<Vec<_>>(), [Aov::Albedo, Aov::Error]);
        assert_eq!(some.channels().collect::<Vec<_>>(), ["albedo.R", "albedo.G", "albedo.B", "error.R", "error.G", "error.B"]);
        assert_eq!((some.numbers(), some.bytes_per_pixel(), Aovs::NONE.bytes_per_pixel()), (6, 36, 12));
        let coded = postcard::to_stdvec(&some).unwrap();
        assert_eq!(postcard::from_bytes::<Aovs>(&coded).unwrap(), some);
        assert_eq!(postcard::to_stdvec(&Aovs::NONE).unwrap(), [0]);
        assert_eq!(Aovs::from(u16::MAX), Aov::ALL.into_iter().collect(), "bits that mean nothing do not stay");
    }

    #[test]
    fn each_has_a_name_and_channels_of_that_name() {
        for (place, aov) in Aov::ALL.into_iter().enumerate() {
            assert_eq!(aov as usize, place);
            assert!(aov.channels().iter().all(|channel| channel.split_once('.').is_some_and(|(name, _)| name == aov.name())));
        }
    }
}
