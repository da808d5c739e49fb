//! What the pixels of a picture are kept as while it is made.
//!
//! A picture that only becomes a file of eight bits a value is kept as its codes: a quarter of the
//! memory, whose first use took longer than all that is computed for it, and a tile's codes are made
//! while its colours are still in the cache.

use bytemuck::Zeroable;

use crate::render::codes::EightBits;
use crate::simd::each;

/// Makes pixels of the three values that a picture has at each.
pub(super) trait Film: Sync {
    /// A pixel of a tile, which is not yet in its place.
    type Latent: Copy;
    /// A pixel of the picture.
    type Pixel: Send + Zeroable;

    /// Replaces what is in `tile` by the pixels of these values, which come part by part.
    fn develop(&self, values: [&[f32]; 3], tile: &mut Vec<Self::Latent>);

    /// The same pixel for the picture.
    fn pixel(latent: Self::Latent) -> Self::Pixel;

    /// The same for four pixels in a row.
    fn four(latent: [Self::Latent; 4]) -> [Self::Pixel; 4];
}

/// Keeps the values.
pub(super) struct Linear;

impl Film for Linear {
    type Latent = [f32; 3];
    type Pixel = [f32; 3];

    fn develop(&self, [r, g, b]: [&[f32]; 3], tile: &mut Vec<[f32; 3]>) {
        tile.clear();
        tile.extend(r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]));
    }

    #[inline(always)]
    fn pixel(latent: [f32; 3]) -> [f32; 3] {
        latent
    }

    #[inline(always)]
    fn four(latent: [[f32; 3]; 4]) -> [[f32; 3]; 4] {
        latent
    }
}

impl Film for EightBits {
    /// Whole registers of codes are made; three bytes in a row would be put together one by one.
    type Latent = u32;
    type Pixel = [u8; 3];

    fn develop(&self, values: [&[f32]; 3], tile: &mut Vec<u32>) {
        tile.resize(values[0].len(), 0);
        self.pack(values, tile);
    }

    #[inline(always)]
    fn pixel(latent: u32) -> [u8; 3] {
        let [r, g, b, _] = latent.to_le_bytes();
        [r, g, b]
    }

    #[inline(always)]
    fn four(latent: [u32; 4]) -> [[u8; 3]; 4] {
        // Two stores, not eight.
        let [a, b, c, d] = each(|pixel| u128::from(latent[pixel]));
        let bytes = (a | b << 24 | c << 48 | d << 72).to_le_bytes();
        let twelve: [u8; 12] = *bytes.first_chunk().expect("twelve of sixteen bytes");
        bytemuck::cast(twelve)
    }
}
