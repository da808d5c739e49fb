//! What the pixels of a picture are kept as while it is made.
//!
//! A picture that only becomes a file of eight bits a value is kept as its codes: a quarter of the
//! memory, whose first use took longer than all that is computed for it, and a tile's codes are made
//! while its colours are still in the cache.

use bytemuck::Zeroable;

use crate::render::codes::EightBits;

/// Makes pixels of the three values that a picture has at each.
pub(super) trait Film: Sync {
    type Pixel: Copy + Send + Zeroable;

    /// The pixels of these values. `memory` is for them.
    fn pixels<'a>(
        &self,
        values: &'a [[f32; 3]],
        memory: &'a mut Vec<Self::Pixel>,
    ) -> &'a [Self::Pixel];
}

/// Keeps the values.
pub(super) struct Linear;

impl Film for Linear {
    type Pixel = [f32; 3];

    fn pixels<'a>(&self, values: &'a [[f32; 3]], _: &'a mut Vec<[f32; 3]>) -> &'a [[f32; 3]] {
        values
    }
}

impl Film for EightBits {
    type Pixel = [u8; 3];

    fn pixels<'a>(&self, values: &'a [[f32; 3]], memory: &'a mut Vec<[u8; 3]>) -> &'a [[u8; 3]] {
        memory.resize(values.len(), [0; 3]);
        self.write(values, memory);
        memory
    }
}
