//! Tiles: 32 x 32 pixels, the unit that workers take.
//!
//! Pixels run along Morton's curve, with all samples of a pixel one after the other. So each 16
//! neighbours in a batch are a block of 4 x 4 pixels (or fewer pixels with more samples), each 256
//! a block of 16 x 16, whatever the samples a pixel: bundles as narrow as they can be.

use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::Vec3;

use crate::render::frame::{Cancelled, Crop, Frame};
use crate::render::stats::{Lap, RenderStats};
use crate::render::wave::{WAVE_RAYS, Wave};
use crate::shading::sampling::{PixelSamples, SampleKey};

/// Pixels along the side of a tile.
pub(super) const TILE_SIDE: u32 = 32;

/// One pixel of a tile.
#[derive(Clone, Copy)]
pub(super) struct Pixel {
    /// Column and row in the full picture.
    pub(super) x: u32,
    pub(super) y: u32,
    /// The sum of its samples; at the end their mean.
    pub(super) color: Vec3,
}

/// The number of tiles across and down.
pub(super) fn tile_counts(area: &Crop) -> (u32, u32) {
    (area.width().div_ceil(TILE_SIDE), area.height().div_ceil(TILE_SIDE))
}

/// The pixels of tile `index`, counted row by row.
fn tile_area(area: &Crop, index: u32) -> Crop {
    let across = tile_counts(area).0;
    let x0 = area.x0 + index % across * TILE_SIDE;
    let y0 = area.y0 + index / across * TILE_SIDE;
    Crop { x0, y0, x1: area.x1.min(x0 + TILE_SIDE), y1: area.y1.min(y0 + TILE_SIDE) }
}

/// Renders tile `index` in `arena` and returns its pixels, in no order that matters.
pub(super) fn render_tile<'b>(
    frame: &Frame<'_>,
    index: u32,
    arena: &'b Bump,
    stats: &mut RenderStats,
) -> Result<ArenaVec<'b, Pixel>, Cancelled> {
    let area = tile_area(&frame.area, index);
    let mut pixels = ArenaVec::with_capacity_in((area.width() * area.height()) as usize, arena);
    pixels.extend(
        (0..TILE_SIDE * TILE_SIDE)
            .map(|code| (area.x0 + every_second_bit(code), area.y0 + every_second_bit(code >> 1)))
            .filter(|&(x, y)| x < area.x1 && y < area.y1)
            .map(|(x, y)| Pixel { x, y, color: Vec3::ZERO }),
    );
    let (spp, seed) = (frame.settings.spp as usize, frame.settings.seed);
    let rays = pixels.len() * spp;
    let mut wave = Wave::with_capacity_in(frame, rays.min(WAVE_RAYS), arena);
    let mut positions = PixelSamples::new(0, 0, 1, 0);
    let mut first = 0;
    while first < rays {
        let mut lap = Lap::start();
        let last = rays.min(first + WAVE_RAYS);
        wave.clear();
        for ray in first..last {
            let (Pixel { x, y, .. }, sample) = (pixels[ray / spp], (ray % spp) as u32);
            if spp > 1 && (sample == 0 || ray == first) {
                positions = PixelSamples::new(x, y, frame.settings.spp, seed);
            }
            let camera_ray = frame.camera_ray(x, y, positions.at(sample));
            wave.push(&camera_ray, SampleKey::new(x, y, sample, seed));
        }
        stats.phases.camera += lap.seconds();
        wave.trace(frame, stats)?;
        lap.seconds();
        for (ray, &color) in (first..last).zip(wave.colors()) {
            pixels[ray / spp].color += color;
        }
        stats.phases.film += lap.seconds();
        first = last;
    }
    for pixel in &mut pixels {
        pixel.color /= spp as f32;
    }
    Ok(pixels)
}

/// The bits 0, 2, 4, 6 and 8 of `code` side by side: a coordinate of Morton's curve.
fn every_second_bit(code: u32) -> u32 {
    (0..5).fold(0, |bits, bit| bits | (code >> (2 * bit) & 1) << bit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_neighbours_are_a_block() {
        for block in 0..64 {
            let codes = 16 * block..16 * block + 16;
            let at = |code| (every_second_bit(code), every_second_bit(code >> 1));
            let (x, y) = at(codes.start);
            assert!(x % 4 == 0 && y % 4 == 0);
            let mut seen = [false; 16];
            for (cx, cy) in codes.map(at) {
                seen[((cx - x) + 4 * (cy - y)) as usize] = true;
            }
            assert_eq!(seen, [true; 16]);
        }
    }

    #[test]
    fn tiles_cover_a_crop_once() {
        let area = Crop { x0: 5, y0: 7, x1: 5 + 70, y1: 7 + 33 };
        let (across, down) = tile_counts(&area);
        assert_eq!((across, down), (3, 2));
        let pixels: u32 = (0..across * down)
            .map(|index| tile_area(&area, index))
            .map(|tile| tile.width() * tile.height())
            .sum();
        assert_eq!(pixels, 70 * 33);
    }
}
