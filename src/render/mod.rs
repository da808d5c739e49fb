//! Pictures of scenes: a client of the queries, in tiles.
//!
//! A worker renders one tile of 64 x 64 pixels at a time in arrays of its own that it uses again for
//! each. Inside, a tile is a small wavefront (`tile`, `wave`): up to 4,096 camera rays as one SoA
//! batch (`camera`), the surfaces that they hit, sixteen side by side (`shade`), which part of each
//! light they see (`shadows`), and the mirror rays packed together for the next round, until none is
//! left.
//!
//! A picture is a function of (scene, camera, settings) alone: neither threads, nor the order of
//! tiles, nor a crop can change a bit of it. [`reference`](mod@reference) makes the same picture by
//! plain recursion and says what is right; `output`, `encode` and `codes` put pictures into files. A
//! picture that only becomes a file is kept as the codes that the file will hold (`film`).

mod arena;
mod camera;
mod codes;
mod colors;
mod encode;
mod error;
mod film;
mod frame;
mod image;
mod output;
pub mod reference;
mod renderer;
mod shade;
mod shadows;
mod stats;
mod tile;
mod unsaved;
mod wave;

pub use crate::points::SHADOW_T_MAX;
pub use error::RenderError;
pub use frame::{Aov, Crop};
pub use image::Image;
pub use output::{OutputError, PictureFile, PictureFormat};
pub use renderer::{Progress, Rendered, Renderer};
pub use stats::{PhaseSeconds, RenderStats};
pub use unsaved::Unsaved;
