//! Where samples lie: a pure function of (pixel, sample, dimension, seed).
//!
//! There is no generator whose state runs along, so neither the order of tiles nor the number of
//! threads can change a picture. A [`SampleKey`] names a set of points by hashing; a
//! [`StratifiedSet`] places the points of that set on the unit square.
//!
//! The sets are correlated multi-jittered (Kensler, "Correlated Multi-Jittered Sampling", Pixar
//! 2013), which exist for any count `N`, prime ones too: with `m = floor(sqrt N)` columns and
//! `n = ceil(N / m)` rows, point `i` lies in its own of `N` strips along `y` and of `m n` strips
//! along `x`, and in its own cell if `N = m n`.

use std::ops::Range;

use glam::Vec2;

use crate::scene::MAX_SAMPLES;

/// The dimension of the positions inside a pixel. Lights use those above it.
pub const PIXEL_DIMENSION: u64 = 0;

/// Rows of the largest set: `ceil(N / floor(sqrt N))` for N = 65,535 is 257.
const MAX_ROWS: usize = 258;

/// Names one set of sample points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleKey(u64);

impl SampleKey {
    /// The key of sample `sample` in pixel (`x`, `y`), counted in the full picture.
    pub fn new(x: u32, y: u32, sample: u32, seed: u64) -> Self {
        let pixel = mix(seed ^ mix(u64::from(x) | u64::from(y) << 32));
        Self(mix(pixel ^ u64::from(sample)))
    }

    /// The key of one of the decisions made for this sample: each has a dimension of its own.
    pub fn dimension(self, dimension: u64) -> Self {
        Self(mix(self.0.wrapping_add(dimension.wrapping_mul(ODD))))
    }
}

/// The dimension of the points on light `light`, seen after `bounce` mirrors, of `lights`.
pub fn light_dimension(bounce: u32, light: usize, lights: usize) -> u64 {
    PIXEL_DIMENSION + 1 + u64::from(bounce) * lights as u64 + light as u64
}

/// The points of one set.
#[derive(Clone, Debug)]
pub struct StratifiedSet {
    key: u64,
    count: u32,
    columns: u32,
    /// Where each column and each row really is: their order is shuffled.
    column_at: [u16; MAX_ROWS],
    row_at: [u16; MAX_ROWS],
    /// 1 / count, 1 / columns, 1 / rows.
    scale: f32,
    column_scale: f32,
    row_scale: f32,
}

impl StratifiedSet {
    /// The set of `count` points that `key` names; a count of 0 is taken as 1, one above
    /// [`MAX_SAMPLES`] as that.
    pub fn new(key: SampleKey, count: u32) -> Self {
        let count = count.clamp(1, MAX_SAMPLES);
        let columns = count.isqrt();
        let rows = count.div_ceil(columns);
        let mut set = Self {
            key: key.0,
            count,
            columns,
            column_at: [0; MAX_ROWS],
            row_at: [0; MAX_ROWS],
            scale: 1.0 / count as f32,
            column_scale: 1.0 / columns as f32,
            row_scale: 1.0 / rows as f32,
        };
        shuffle(&mut set.column_at[..columns as usize], mix(key.0 ^ COLUMNS));
        shuffle(&mut set.row_at[..rows as usize], mix(key.0 ^ ROWS));
        set
    }

    /// Point `index` of the set, in `[0, 1) x [0, 1)`. Points are numbered row by row of the
    /// stratification, so neighbours in number are neighbours on the square's second axis.
    /// Panics if `index` is not below the count.
    pub fn point(&self, index: u32) -> Vec2 {
        assert!(index < self.count, "point {index} of a set of {}", self.count);
        let (row, column) = (index / self.columns, index % self.columns);
        self.place(index, row, column)
    }

    /// Calls `use_point` with each point of `indices`, in order, clipped to the set.
    pub fn for_each(&self, indices: Range<u32>, mut use_point: impl FnMut(Vec2)) {
        let (mut row, mut column) = (indices.start / self.columns, indices.start % self.columns);
        for index in indices.start..indices.end.min(self.count) {
            use_point(self.place(index, row, column));
            column += 1;
            if column == self.columns {
                (row, column) = (row + 1, 0);
            }
        }
    }

    #[inline]
    fn place(&self, index: u32, row: u32, column: u32) -> Vec2 {
        let jitter = mix(self.key.wrapping_add(u64::from(index + 1).wrapping_mul(ODD)));
        let (jitter_x, jitter_y) = (unit_float((jitter >> 32) as u32), unit_float(jitter as u32));
        let column_at = f32::from(self.column_at[column as usize]);
        let row_at = f32::from(self.row_at[row as usize]);
        let x = (column_at + (row_at + jitter_x) * self.row_scale) * self.column_scale;
        let y = (index as f32 + jitter_y) * self.scale;
        // Rounding can reach 1.
        Vec2::new(x, y).min(Vec2::splat(1.0_f32.next_down()))
    }
}

/// Where in a pixel its camera rays go through: stratified over its samples, and the centre if
/// there is just one.
#[derive(Clone, Debug)]
pub struct PixelSamples(Option<StratifiedSet>);

impl PixelSamples {
    /// The `spp` positions in pixel (`x`, `y`), counted in the full picture.
    pub fn new(x: u32, y: u32, spp: u32, seed: u64) -> Self {
        let key = SampleKey::new(x, y, 0, seed).dimension(PIXEL_DIMENSION);
        Self((spp > 1).then(|| StratifiedSet::new(key, spp)))
    }

    /// The position of sample `index`, in `[0, 1) x [0, 1)`. Panics if it is not below `spp`.
    pub fn at(&self, index: u32) -> Vec2 {
        self.0.as_ref().map_or(Vec2::splat(0.5), |set| set.point(index))
    }
}

/// The golden ratio's odd 64-bit fraction: steps of it visit all 64-bit numbers.
const ODD: u64 = 0x9e37_79b9_7f4a_7c15;
const COLUMNS: u64 = 0x5851_f42d_4c95_7f2d;
const ROWS: u64 = 0xda94_2042_e4dd_58b5;

/// A bijection of 64-bit numbers in which each input bit moves half of the output bits (the
/// finalizer of SplitMix64: Steele, Lea, Flood 2014).
#[inline]
fn mix(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// The upper 24 bits as a fraction of 1: exact, never 1.
#[inline]
fn unit_float(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Writes 0, 1, 2, .. in an order that `key` fixes (Fisher and Yates).
fn shuffle(order: &mut [u16], key: u64) {
    let mut state = key;
    for last in 0..order.len() {
        state = state.wrapping_add(ODD);
        let other = (((mix(state) >> 32) * (last as u64 + 1)) >> 32) as usize;
        order[last] = order[other];
        order[other] = last as u16;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(count: u32, seed: u64) -> Vec<Vec2> {
        let set = StratifiedSet::new(SampleKey::new(3, 4, 5, seed).dimension(6), count);
        (0..count).map(|index| set.point(index)).collect()
    }

    #[test]
    fn every_count_is_stratified_along_both_axes() {
        for count in (1..=70).chain([97, 256, 1000, 4096, 65535, 65536]) {
            let points = set(count, 7);
            let mut strip = vec![false; count as usize];
            let columns = count.isqrt() as usize;
            let cells = columns * (count as usize).div_ceil(columns);
            let mut column = vec![0_u32; cells];
            for point in points {
                assert!((0.0..1.0).contains(&point.x) && (0.0..1.0).contains(&point.y));
                let at = (f64::from(point.y) * f64::from(count) + 1e-4) as usize;
                strip[at.min(count as usize - 1)] = true;
                let at = (f64::from(point.x) * cells as f64) as usize;
                column[at.min(cells - 1)] += 1;
            }
            // Rounding may move a point over an edge in the largest sets, not further.
            if count < 1000 {
                assert!(strip.iter().all(|&taken| taken), "{count} points: a strip is empty");
                assert!(column.iter().all(|&points| points <= 1), "{count} points: two in a strip");
            }
        }
    }

    #[test]
    fn square_counts_fill_every_cell() {
        for seed in 0..50 {
            let mut cell = [0; 16];
            for point in set(16, seed) {
                cell[(point.x * 4.0) as usize + 4 * (point.y * 4.0) as usize] += 1;
            }
            assert_eq!(cell, [1; 16]);
        }
    }

    #[test]
    fn the_mean_over_seeds_is_the_centre() {
        for count in [1, 2, 3, 5, 7, 16] {
            let sum: Vec2 = (0..4000).flat_map(|seed| set(count, seed)).sum();
            let mean = sum / (4000.0 * count as f32);
            assert!((mean - 0.5).length() < 0.02, "{count} points: mean {mean}");
        }
    }

    #[test]
    fn ranges_are_parts_of_the_set() {
        let key = SampleKey::new(1, 2, 3, 4);
        let set = StratifiedSet::new(key, 23);
        let mut points = Vec::new();
        set.for_each(0..10, |point| points.push(point));
        set.for_each(10..99, |point| points.push(point));
        assert_eq!(points, (0..23).map(|index| set.point(index)).collect::<Vec<_>>());
    }

    #[test]
    fn each_input_names_another_set() {
        let key = SampleKey::new(1, 2, 3, 4).dimension(5);
        for other in [
            SampleKey::new(2, 1, 3, 4).dimension(5),
            SampleKey::new(1, 2, 4, 4).dimension(5),
            SampleKey::new(1, 2, 3, 5).dimension(5),
            SampleKey::new(1, 2, 3, 4).dimension(6),
        ] {
            assert_ne!(key, other);
        }
        assert_eq!(key, SampleKey::new(1, 2, 3, 4).dimension(5));
    }

    #[test]
    fn one_sample_a_pixel_is_its_centre() {
        assert_eq!(PixelSamples::new(9, 9, 1, 1).at(0), Vec2::splat(0.5));
        let of = |x| PixelSamples::new(x, 9, 4, 1).at(0);
        assert_ne!(of(9), of(8));
    }
}
