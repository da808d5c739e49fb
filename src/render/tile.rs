//! Tiles: 32 x 32 pixels, the unit that workers take.
//!
//! Pixels run along Morton's curve, with all samples of a pixel one after the other. So each 16
//! neighbours in a batch are a block of 4 x 4 pixels (or fewer pixels with more samples), each 256
//! a block of 16 x 16, whatever the samples a pixel: bundles as narrow as they can be.

use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::Vec3;

use crate::render::camera::{Paths, Place};
use crate::render::frame::{Cancelled, Crop, Frame};
use crate::render::stats::{Lap, RenderStats};
use crate::render::wave::{WAVE_RAYS, Wave};

/// Pixels along the side of a tile.
pub(super) const TILE_SIDE: u32 = 32;

/// The pixels of a whole tile, column and row, along Morton's curve.
const CURVE: [[u8; 2]; (TILE_SIDE * TILE_SIDE) as usize] = curve();

/// The finished pixels of a tile, in no order that matters.
pub(super) struct TilePixels<'b> {
    pub(super) places: ArenaVec<'b, Place>,
    pub(super) colors: ArenaVec<'b, Vec3>,
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

/// Renders tile `index` in `arena`.
pub(super) fn render_tile<'b>(
    frame: &Frame<'_>,
    index: u32,
    arena: &'b Bump,
    stats: &mut RenderStats,
) -> Result<TilePixels<'b>, Cancelled> {
    let mut lap = Lap::start();
    let area = tile_area(&frame.area, index);
    let count = (area.width() * area.height()) as usize;
    let mut places = ArenaVec::with_capacity_in(count, arena);
    let curve = CURVE.iter().map(|&[x, y]| [area.x0 + u32::from(x), area.y0 + u32::from(y)]);
    if count == CURVE.len() {
        places.extend(curve);
    } else {
        places.extend(curve.filter(|&[x, y]| x < area.x1 && y < area.y1));
    }
    let mut colors = ArenaVec::with_capacity_in(count, arena);
    colors.resize(count, Vec3::ZERO);

    let (spp, seed) = (frame.settings.spp, frame.settings.seed);
    let rays = count * spp as usize;
    let mut wave = Wave::with_capacity_in(frame, rays.min(WAVE_RAYS), arena);
    stats.phases.camera += lap.seconds();
    let (mut pixel, mut sample) = (0, 0);
    for first in (0..rays).step_by(WAVE_RAYS) {
        let last = rays.min(first + WAVE_RAYS);
        let paths = Paths { places: &places, spp, seed, first, last };
        let found = wave.trace(frame, &paths, stats)?;
        lap.seconds();
        for &color in found {
            colors[pixel] += color;
            sample += 1;
            if sample == spp {
                (pixel, sample) = (pixel + 1, 0);
            }
        }
        stats.phases.film += lap.seconds();
    }
    for color in &mut colors {
        *color /= spp as f32;
    }
    stats.phases.film += lap.seconds();
    Ok(TilePixels { places, colors })
}

const fn curve() -> [[u8; 2]; (TILE_SIDE * TILE_SIDE) as usize] {
    let mut curve = [[0; 2]; (TILE_SIDE * TILE_SIDE) as usize];
    let mut code = 0;
    while code < curve.len() {
        curve[code] = [every_second_bit(code), every_second_bit(code >> 1)];
        code += 1;
    }
    curve
}

/// The bits 0, 2, 4, 6 and 8 of `code` side by side: a coordinate of Morton's curve.
const fn every_second_bit(code: usize) -> u8 {
    let (mut bits, mut bit) = (0, 0);
    while bit < 5 {
        bits |= (code >> (2 * bit) & 1) << bit;
        bit += 1;
    }
    bits as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_neighbours_are_a_block() {
        for block in CURVE.chunks(16) {
            let [x, y] = block[0];
            assert!(x % 4 == 0 && y % 4 == 0);
            let mut seen = [false; 16];
            for [cx, cy] in block {
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
