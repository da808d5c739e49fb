//! What a workload is: its kind, its rays, and the query that they are for.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::Lamp;
use super::random::Random;
use crate::ray::RayBatch;

/// What is asked about the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Query {
    /// The closest hit.
    Intersect,
    /// Whether there is any hit.
    Occluded,
}

/// The kinds of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Through the pixels of a pinhole camera, jittered in the pixel, in tiles of 16 x 16 pixels
    /// which are made of blocks of 4 x 4.
    Primary,
    /// The mirror images of the primary rays at their hits, in their order.
    Mirror,
    /// One ray from each primary hit, with the density of the cosine around the normal.
    Diffuse,
    /// From each primary hit to the middle of the light: hard shadows.
    Hard,
    /// This many rays from each primary hit to jittered points of the light: soft shadows. The
    /// samples of a point follow one another in blocks of 4 x 4. The hits are those of evenly
    /// spread tiles, so that there are about as many rays as pixels.
    Soft(u32),
    /// As [`Kind::Soft`], with other lights: so many rays from each hit to each of them, light by
    /// light, to the same places on each.
    Lamp(Lamp, u32),
    /// One ray from each primary hit, with the density of the cosine around the normal, no longer
    /// than half of the model's diagonal: ambient occlusion.
    Ao,
}

impl Kind {
    /// The kinds that speed is usually measured with.
    pub const ALL: [Self; 8] = [
        Self::Primary,
        Self::Mirror,
        Self::Diffuse,
        Self::Hard,
        Self::Soft(16),
        Self::Soft(64),
        Self::Soft(256),
        Self::Ao,
    ];

    /// What is asked about rays of this kind.
    pub fn query(self) -> Query {
        match self {
            Self::Primary | Self::Mirror | Self::Diffuse => Query::Intersect,
            Self::Hard | Self::Soft(_) | Self::Lamp(..) | Self::Ao => Query::Occluded,
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Primary => out.pad("primary"),
            Self::Mirror => out.pad("mirror"),
            Self::Diffuse => out.pad("diffuse"),
            Self::Hard => out.pad("hard"),
            Self::Soft(samples) => out.pad(&format!("soft{samples}")),
            Self::Lamp(lamp, samples) => out.pad(&format!("{lamp}{samples}")),
            Self::Ao => out.pad("ao"),
        }
    }
}

/// A name that no kind of rays has.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error(
    "no workload is called `{0}`: there are primary, mirror, diffuse, hard, ao, and soft, near, huge, \
     grazing and many with a number of samples such as soft16"
)]
pub struct UnknownKind(String);

impl FromStr for Kind {
    type Err = UnknownKind;

    fn from_str(name: &str) -> Result<Self, UnknownKind> {
        match name {
            "primary" => Ok(Self::Primary),
            "mirror" => Ok(Self::Mirror),
            "diffuse" => Ok(Self::Diffuse),
            "hard" => Ok(Self::Hard),
            "ao" => Ok(Self::Ao),
            _ => {
                let samples = |samples: &str| {
                    samples.parse().ok().filter(|samples| (1..=4096).contains(samples))
                };
                let of_lamp = |lamp: Lamp| {
                    let rest = name.strip_prefix(lamp.name())?;
                    Some(Self::Lamp(lamp, samples(rest)?))
                };
                let soft = name.strip_prefix("soft").and_then(samples).map(Self::Soft);
                soft.or_else(|| Lamp::ALL.into_iter().find_map(of_lamp))
                    .ok_or_else(|| UnknownKind(name.into()))
            }
        }
    }
}

/// Rays and what is asked about them.
#[derive(Clone, Debug)]
pub struct Workload {
    /// The kind's name, with `-shuffled` behind it if the rays were shuffled.
    pub name: String,
    /// The rays.
    pub rays: RayBatch,
    /// The question.
    pub query: Query,
}

impl Workload {
    /// The same rays in random order: an incoherent stream.
    pub fn shuffled(&self, seed: u64) -> Self {
        let order = Random::new(seed, 0x5817_ff1e).permutation(self.rays.len());
        let rays = self.rays.as_rays();
        Self {
            name: format!("{}-shuffled", self.name),
            rays: order.iter().map(|&index| rays.get(index as usize)).collect(),
            query: self.query,
        }
    }
}
