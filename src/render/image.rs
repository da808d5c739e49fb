//! The picture in memory: linear floats or codes, row by row from the upper left.

use bytemuck::Zeroable;
use bytemuck::allocation::try_zeroed_vec;

use crate::render::{Aov, RenderError};

/// A picture of linear `f32` values, `width * height` pixels in rows from the upper left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels from left to right.
    pub width: u32,
    /// Pixels from top to bottom.
    pub height: u32,
    /// What the three values of a pixel are.
    pub aov: Aov,
    /// The distances from the camera between which the whole scene lies: what a depth picture of
    /// 8 bits runs from (white) and to (black).
    pub depth_range: [f32; 2],
    /// The pixels; see [`Aov`].
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A picture of zeros.
    ///
    /// # Errors
    /// [`RenderError::Memory`] if the memory is refused.
    pub fn new(width: u32, height: u32, aov: Aov) -> Result<Self, RenderError> {
        let pixels = zeroed_pixels(width, height)?;
        Ok(Self { width, height, aov, depth_range: [0.0, 0.0], pixels })
    }

    /// The pixel in column `x` of row `y`. Panics if there is none.
    pub fn pixel(&self, x: u32, y: u32) -> [f32; 3] {
        assert!(x < self.width && y < self.height, "({x}, {y}) is not in the picture");
        self.pixels[y as usize * self.width as usize + x as usize]
    }
}

/// A picture of eight bits a value: a quarter of the memory.
#[derive(Clone, Debug)]
pub(super) struct Codes {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) pixels: Vec<[u8; 3]>,
}

impl Codes {
    /// A picture of zeros.
    pub(super) fn new(width: u32, height: u32) -> Result<Self, RenderError> {
        Ok(Self { width, height, pixels: zeroed_pixels(width, height)? })
    }
}

/// Memory that comes as zeros is first touched by the threads that render into it, each its part.
fn zeroed_pixels<P: Zeroable>(width: u32, height: u32) -> Result<Vec<P>, RenderError> {
    let pixels = u64::from(width) * u64::from(height);
    let memory = RenderError::Memory { pixels };
    let count = usize::try_from(pixels).map_err(|_| memory.clone())?;
    try_zeroed_vec(count).map_err(|()| memory)
}
