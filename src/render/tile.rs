//! Tiles: 64 x 64 pixels or fewer, the unit that workers take.
//!
//! Pixels run along Morton's curve, with all samples of a pixel one after the other. So each 16
//! neighbours in a batch are a block of 4 x 4 pixels (or fewer pixels with more samples), each 256
//! a block of 16 x 16, whatever the samples a pixel: bundles as narrow as they can be.

use bumpalo::Bump;

use crate::render::camera::{Paths, Place};
use crate::render::colors::Colors;
use crate::render::film::Film;
use crate::render::frame::{Cancelled, Crop, Frame};
use crate::render::stats::{Lap, RenderStats};
use crate::render::wave::{WAVE_RAYS, Wave};

/// Pixels along the side of the largest tiles. Larger ones start fewer batches: four times the pixels
/// make pictures 1.03 to 1.08 times as fast.
pub(super) const LARGEST_SIDE: u32 = 64;

/// Pixels along the side of tiles where larger ones would be too few to share.
const SMALLER_SIDE: u32 = 32;

/// A worker should have so many tiles, so that all end at about the same time.
const TILES_A_WORKER: u32 = 16;

/// The pixels of a whole tile, column and row, along Morton's curve. It starts with those of smaller tiles.
pub(super) const CURVE: [[u8; 2]; (LARGEST_SIDE * LARGEST_SIDE) as usize] = curve();

/// Where on the curve the pixels of a tile's first row are; those of its first column are at the doubles.
const ALONG: [u16; LARGEST_SIDE as usize] = along();

/// What a worker renders tiles with: arrays that are used again by each.
pub(super) struct TileRenderer<'b> {
    /// The pixels of the tile, in no order that matters.
    places: Vec<Place>,
    /// The means of several samples of those pixels.
    means: Colors<'b>,
    wave: Wave<'b>,
    tiling: Tiling,
}

/// How a picture is cut into tiles.
#[derive(Clone, Copy)]
pub(super) struct Tiling {
    area: Crop,
    /// Pixels along the side of a tile.
    pub(super) side: u32,
}

impl Tiling {
    /// Of the largest tiles of which `workers` have enough.
    pub(super) fn new(area: Crop, workers: usize) -> Self {
        let tiling = Self { area, side: LARGEST_SIDE };
        let (across, down) = tiling.counts();
        let enough = (workers as u32).saturating_mul(TILES_A_WORKER);
        if across * down < enough { Self { side: SMALLER_SIDE, ..tiling } } else { tiling }
    }

    /// The number of tiles across and down.
    pub(super) fn counts(&self) -> (u32, u32) {
        (self.area.width().div_ceil(self.side), self.area.height().div_ceil(self.side))
    }

    /// The pixels of tile `index`, counted row by row.
    pub(super) fn tile(&self, index: u32) -> Crop {
        let (area, side, across) = (&self.area, self.side, self.counts().0);
        let x0 = area.x0 + index % across * side;
        let y0 = area.y0 + index / across * side;
        Crop { x0, y0, x1: area.x1.min(x0 + side), y1: area.y1.min(y0 + side) }
    }
}

impl<'b> TileRenderer<'b> {
    pub(super) fn new_in(frame: &Frame<'_>, tiling: Tiling, arena: &'b Bump) -> Self {
        let rays = (tiling.side * tiling.side) as usize * frame.settings.spp as usize;
        let wave = Wave::with_capacity_in(frame, rays.min(WAVE_RAYS), arena);
        let means = if frame.settings.spp == 1 { 0 } else { (tiling.side * tiling.side) as usize };
        let means = Colors::with_capacity_in(means, arena);
        Self { places: Vec::new(), means, wave, tiling }
    }

    /// Renders tile `index`. Returns the values of its pixels, part by part, in the order of its places.
    pub(super) fn render(
        &mut self,
        frame: &Frame<'_>,
        index: u32,
        stats: &mut RenderStats,
    ) -> Result<[&[f32]; 3], Cancelled> {
        let Self { places, means, wave, tiling } = self;
        let mut lap = Lap::start();
        let area = tiling.tile(index);
        let count = (area.width() * area.height()) as usize;
        places.clear();
        let curve = &CURVE[..(tiling.side * tiling.side) as usize];
        let curve = curve.iter().map(|&[x, y]| [area.x0 + u32::from(x), area.y0 + u32::from(y)]);
        if count == curve.len() {
            places.extend(curve);
        } else {
            places.extend(curve.filter(|&[x, y]| x < area.x1 && y < area.y1));
        }
        let (spp, seed) = (frame.settings.spp, frame.settings.seed);
        let rays = count * spp as usize;
        stats.phases.camera += lap.seconds();
        let paths = |first: usize| {
            let last = rays.min(first + WAVE_RAYS);
            Paths { places, corner: [area.x0, area.y0], spp, seed, first, last }
        };
        if spp == 1 {
            // A tile has no more pixels than a wave has rays.
            return Ok(wave.trace(frame, &paths(0), stats)?.parts(count));
        }
        means.clear(count);
        for first in (0..rays).step_by(WAVE_RAYS) {
            let paths = paths(first);
            let found = wave.trace(frame, &paths, stats)?;
            lap.seconds();
            means.add_each(found, (first, paths.len()), spp as usize);
            stats.phases.film += lap.seconds();
        }
        means.divide(count, spp as f32);
        stats.phases.film += lap.seconds();
        Ok(means.parts(count))
    }

    /// Writes the pixels of tile `index`, which was rendered last, to its rows of the picture.
    pub(super) fn write<F: Film>(&self, index: u32, pixels: &[F::Latent], rows: &mut [F::Pixel]) {
        let (area, tile, side) = (&self.tiling.area, self.tiling.tile(index), self.tiling.side);
        let (width, left) = (area.width() as usize, (tile.x0 - area.x0) as usize);
        if pixels.len() == (side * side) as usize {
            for (row, down) in rows.chunks_exact_mut(width).zip(ALONG) {
                let (row, _) = row[left..left + side as usize].as_chunks_mut();
                for (four, across) in row.iter_mut().zip(ALONG.into_iter().step_by(4)) {
                    // Four in a row are of one block of 4 x 4, pairs of the curve.
                    let first = usize::from(across + 2 * down);
                    let [a, b, _, _, c, d] = *pixels[first..].first_chunk().expect("a whole block");
                    *four = F::four([a, b, c, d]);
                }
            }
            return;
        }
        for (&[x, y], &pixel) in self.places.iter().zip(pixels) {
            let (x, y) = (x - area.x0, y - tile.y0);
            rows[y as usize * width + x as usize] = F::pixel(pixel);
        }
    }
}

const fn curve() -> [[u8; 2]; (LARGEST_SIDE * LARGEST_SIDE) as usize] {
    let mut curve = [[0; 2]; (LARGEST_SIDE * LARGEST_SIDE) as usize];
    let mut code = 0;
    while code < curve.len() {
        curve[code] = [every_second_bit(code), every_second_bit(code >> 1)];
        code += 1;
    }
    curve
}

const fn along() -> [u16; LARGEST_SIDE as usize] {
    let mut along = [0; LARGEST_SIDE as usize];
    let mut code = 0;
    while code < CURVE.len() {
        if CURVE[code][1] == 0 {
            along[CURVE[code][0] as usize] = code as u16;
        }
        code += 1;
    }
    along
}

/// The bits 0, 2, 4, 6 and 8 of `code` side by side: a coordinate of Morton's curve.
const fn every_second_bit(code: usize) -> u8 {
    let (mut bits, mut bit) = (0, 0);
    while bit < 6 {
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
    fn pixels_are_found_on_the_curve() {
        for (code, [x, y]) in CURVE.into_iter().enumerate() {
            assert_eq!(usize::from(ALONG[x as usize] + 2 * ALONG[y as usize]), code);
        }
    }

    #[test]
    fn tiles_cover_a_crop_once() {
        let area = Crop { x0: 5, y0: 7, x1: 5 + 70, y1: 7 + 33 };
        for (workers, counts) in [(0, (2, 1)), (1, (3, 2))] {
            let tiling = Tiling::new(area, workers);
            assert_eq!(tiling.counts(), counts);
            let pixels: u32 = (0..counts.0 * counts.1)
                .map(|index| tiling.tile(index))
                .map(|tile| tile.width() * tile.height())
                .sum();
            assert_eq!(pixels, 70 * 33);
        }
    }
}
