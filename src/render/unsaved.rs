//! A picture between its last pixel and its file.

use crate::render::image::Codes;
use crate::render::{Image, OutputError, PictureFile, RenderStats};

/// A picture made for a file, and not yet in it; see [`crate::render::Renderer::render_to`].
#[derive(Clone, Debug)]
pub struct Unsaved<'f> {
    file: &'f PictureFile,
    pixels: Pixels,
    stats: RenderStats,
}

/// A picture as its file wants it.
#[derive(Clone, Debug)]
pub(super) enum Pixels {
    Linear(Image),
    Codes(Codes),
}

impl<'f> Unsaved<'f> {
    pub(super) fn new(file: &'f PictureFile, pixels: Pixels, stats: RenderStats) -> Self {
        Self { file, pixels, stats }
    }

    /// What the pixels cost.
    pub fn stats(&self) -> &RenderStats {
        &self.stats
    }

    /// Writes the file as [`PictureFile::write`] does.
    ///
    /// # Errors
    /// [`OutputError`] names the file; nothing new is left in the directory.
    pub fn save(&self) -> Result<(), OutputError> {
        match &self.pixels {
            Pixels::Linear(image) => self.file.write(image),
            Pixels::Codes(codes) => self.file.write_codes(codes),
        }
    }
}
