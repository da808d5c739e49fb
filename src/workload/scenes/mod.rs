//! Scenes made by own code, each with its own camera: the same on every machine.
//!
//! All of them are functions of their size alone, up to the rounding of a system's sine.

mod atrium;
mod dense_scan;
mod grating;
mod mixed;
mod patch;
mod sphereflake;
mod terrain;

pub use atrium::atrium;
pub use dense_scan::dense_scan;
pub use grating::grating;
pub use mixed::mixed;
pub use sphereflake::sphereflake;
pub use terrain::terrain;
