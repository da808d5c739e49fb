//! What can keep a picture from being made.

use thiserror::Error;

use crate::render::Crop;
use crate::scene::{CameraError, SettingsError};

/// Why there is no picture.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RenderError {
    /// A setting that is out of its range, the size of the picture among them.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// A crop that is empty or reaches out of the picture.
    #[error(
        "crop {crop} does not lie in the picture of {width}x{height}: it wants X0 < X1 <= {width} \
         and Y0 < Y1 <= {height}"
    )]
    Crop {
        /// The crop.
        crop: Crop,
        /// Pixels from left to right in the full picture.
        width: u32,
        /// Pixels from top to bottom in the full picture.
        height: u32,
    },
    /// A camera that sees nothing.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The memory for the pixels was refused.
    #[error("there is no memory for {pixels} pixels")]
    Memory {
        /// How many pixels were asked for.
        pixels: u64,
    },
    /// The threads could not be started.
    #[error("{count} threads could not be started: {why}")]
    Threads {
        /// How many were asked for.
        count: usize,
        /// What the system says.
        why: String,
    },
    /// The flag given to [`crate::render::Renderer::cancel`] was raised.
    #[error("the picture was cancelled")]
    Cancelled,
}
