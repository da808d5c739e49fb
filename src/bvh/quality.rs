//! How much work goes into a tree.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// How much work goes into a tree. The answers are the same bits with each; only speed and memory
/// differ. The tree is the same for every number of threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum BuildQuality {
    /// Built soonest, for previews and for scenes that change.
    Fast,
    /// Good rays for a short build.
    #[default]
    Balanced,
    /// The fastest rays, for scenes that are traced for long.
    High,
}

impl BuildQuality {
    /// All of them, the fastest build first.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Balanced, Self::High];

    /// The name that scene files and the command line know it by.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::High => "high",
        }
    }
}

impl fmt::Display for BuildQuality {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// A name that is no [`BuildQuality`].
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("`{0}` is no build: give fast, balanced or high")]
pub struct UnknownBuild(pub String);

impl FromStr for BuildQuality {
    type Err = UnknownBuild;

    fn from_str(name: &str) -> Result<Self, UnknownBuild> {
        let named = Self::ALL.into_iter().find(|quality| quality.name() == name);
        named.ok_or_else(|| UnknownBuild(name.into()))
    }
}
