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
//!
//! The samples of one pixel share cells and strips. Each moves all of its points by one step around
//! their cells, a number of whole strips and a part of one. The steps are the first points of Sobol's
//! sequence. So each sample's own set is as good as it was, while all points that the samples of a
//! pixel have in one cell are stratified, too: their sum is less noisy than that of independent sets.

use glam::Vec2;

use crate::scene::MAX_SAMPLES;
use crate::shading::orders::{ODD, SHORT_ODD, four, mix, mix_short, shuffle};
use crate::simd::each;

/// The dimension of the positions inside a pixel. Lights use those above it.
pub const PIXEL_DIMENSION: u64 = 0;

/// Room for the rows of the largest set, `ceil(N / floor(sqrt N))` = 257 for N = 65,535; a power of two,
/// so that places in it need no check.
const MAX_ROWS: usize = 512;

/// Room for those of most sets.
const FEW_ROWS: usize = 16;

/// How many points are placed together.
const LANES: usize = 16;

/// Names one set of sample points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleKey {
    pixel: u64,
    sample: u32,
}

impl SampleKey {
    /// The key of sample `sample` in pixel (`x`, `y`), counted in the full picture.
    pub fn new(x: u32, y: u32, sample: u32, seed: u64) -> Self {
        Self { pixel: mix(mix(seed) ^ (u64::from(x) | u64::from(y) << 32)), sample }
    }

    /// The key of one of the decisions made for this sample: each has a dimension of its own.
    pub fn dimension(self, dimension: u64) -> Self {
        Self { pixel: mix(self.pixel.wrapping_add(dimension.wrapping_mul(ODD))), ..self }
    }
}

/// The dimension of the points on light `light`, seen after `bounce` mirrors, of `lights`.
pub fn light_dimension(bounce: u32, light: usize, lights: usize) -> u64 {
    PIXEL_DIMENSION + 1 + u64::from(bounce) * lights as u64 + light as u64
}

/// The points of one set.
#[derive(Clone, Copy, Debug)]
pub struct StratifiedSet {
    key: u64,
    count: u32,
    columns: u32,
    rows: u32,
    /// 1 / count, 1 / columns, 1 / rows.
    scale: f32,
    column_scale: f32,
    row_scale: f32,
    /// How far all points are moved around their cells: whole strips and a part of one, along `x`
    /// and along `y`.
    step: [[f32; 2]; 2],
}

impl StratifiedSet {
    /// The set of `count` points that `key` names; a count of 0 is taken as 1, one above
    /// [`MAX_SAMPLES`] as that.
    #[inline]
    pub fn new(key: SampleKey, count: u32) -> Self {
        let count = count.clamp(1, MAX_SAMPLES);
        let columns = count.isqrt();
        let rows = count.div_ceil(columns);
        let set = Self {
            key: 0,
            count,
            columns,
            rows,
            scale: 1.0 / count as f32,
            column_scale: 1.0 / columns as f32,
            row_scale: 1.0 / rows as f32,
            step: [[0.0; 2]; 2],
        };
        set.named(key)
    }

    /// The set of as many points that `key` names.
    #[inline]
    pub fn named(self, key: SampleKey) -> Self {
        let mut step = [[0.0; 2]; 2];
        if key.sample != 0 {
            let [x, y] = sobol(key.sample);
            let (x, y) = (self.rows as f32 * x, self.columns as f32 * y);
            step = [[x.trunc(), x.fract()], [y.trunc(), y.fract()]];
        }
        Self { key: key.pixel, step, ..self }
    }

    /// Point `index` of the set, in `[0, 1) x [0, 1)`. Points are numbered row by row of the
    /// stratification, so neighbours in number are neighbours on the square's second axis.
    /// Panics if `index` is not below the count.
    ///
    /// Each call finds the order of columns and rows anew: [`StratifiedSet::fill`] does so once.
    pub fn point(&self, index: u32) -> Vec2 {
        assert!(index < self.count, "point {index} of a set of {}", self.count);
        let (column_at, row_at) = self.orders::<MAX_ROWS>();
        let (row, column) = (index / self.columns, index % self.columns);
        let (column, row) = (column_at[column as usize], row_at[row as usize]);
        let (x, y) = self.place(index, column, row);
        Vec2::new(x, y)
    }

    /// Writes the points from `first` on, as many as there are and as both slices have places for.
    #[inline]
    pub fn fill(&self, first: u32, u: &mut [f32], v: &mut [f32]) {
        // Most pictures take sixteen samples: these never leave the registers.
        let whole = |at| <&mut [f32; LANES]>::try_from(at).ok();
        if let (0, 16, Some(u), Some(v)) = (first, self.count, whole(&mut *u), whole(&mut *v)) {
            let (column_at, row_at) = (four(self.key ^ COLUMNS), four(self.key ^ ROWS_KEY));
            (*u, *v) = (each(|point| column_at[point % 4]), each(|point| row_at[point / 4]));
            self.place_all(0, u, v);
        } else {
            self.fill_any(first, u, v);
        }
    }

    fn fill_any(&self, first: u32, u: &mut [f32], v: &mut [f32]) {
        if self.rows as usize <= FEW_ROWS {
            self.fill_by::<FEW_ROWS>(first, u, v);
        } else {
            self.fill_by::<MAX_ROWS>(first, u, v);
        }
    }

    #[inline(always)]
    fn fill_by<const ROWS: usize>(&self, first: u32, u: &mut [f32], v: &mut [f32]) {
        let (column_at, row_at) = self.orders::<ROWS>();
        let first = first.min(self.count);
        let count = u.len().min(v.len()).min((self.count - first) as usize);
        let (u, v) = (&mut u[..count], &mut v[..count]);
        // Columns and rows first: what is left then has neither divisions nor gathers.
        let (mut row, mut column) = ((first / self.columns) as usize, first % self.columns);
        let mut at = 0;
        while at < count {
            let end = count.min(at + (self.columns - column) as usize);
            let row_at = row_at[row % ROWS];
            for (u, v) in u[at..end].iter_mut().zip(&mut v[at..end]) {
                (*u, *v) = (column_at[column as usize % ROWS], row_at);
                column += 1;
            }
            (at, row, column) = (end, row + 1, 0);
        }
        let (u, last_u) = u.as_chunks_mut();
        let (v, last_v) = v.as_chunks_mut();
        let mut index = first;
        for (u, v) in u.iter_mut().zip(v) {
            self.place_all(index, u, v);
            index += LANES as u32;
        }
        if !last_u.is_empty() {
            let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
            x[..last_u.len()].copy_from_slice(last_u);
            y[..last_v.len()].copy_from_slice(last_v);
            self.place_all(index, &mut x, &mut y);
            last_u.copy_from_slice(&x[..last_u.len()]);
            last_v.copy_from_slice(&y[..last_v.len()]);
        }
    }

    /// A loop of a known length over arrays of its own, which is compiled to whole registers.
    #[inline(always)]
    fn place_all(&self, first: u32, u: &mut [f32; LANES], v: &mut [f32; LANES]) {
        let (columns, rows) = (*u, *v);
        for lane in 0..LANES {
            (u[lane], v[lane]) = self.place(first + lane as u32, columns[lane], rows[lane]);
        }
    }

    /// Where each column and each row really is: their order is shuffled.
    #[inline(always)]
    fn orders<const ROWS: usize>(&self) -> ([f32; ROWS], [f32; ROWS]) {
        let (mut column_at, mut row_at) = ([0.0; ROWS], [0.0; ROWS]);
        shuffle(&mut column_at[..self.columns as usize], self.key ^ COLUMNS);
        shuffle(&mut row_at[..self.rows as usize], self.key ^ ROWS_KEY);
        (column_at, row_at)
    }

    #[inline(always)]
    fn place(&self, index: u32, column_at: f32, row_at: f32) -> (f32, f32) {
        let jitter = mix_short(self.key as u32 ^ (index + 1).wrapping_mul(SHORT_ODD));
        let (jitter_x, jitter_y) = (half_float(jitter >> 16), half_float(jitter & 0xffff));
        let [strips, part] = self.step[0];
        let strip = around(row_at + strips, self.rows as f32) + around(jitter_x + part, 1.0);
        let x = (column_at + strip * self.row_scale) * self.column_scale;

        // The row's first point and how many it has, in floats: adding 1.5 * 2^23 rounds to a whole
        // number, from which the middle of a point is half a step away.
        const ROUND: f32 = 12_582_912.0;
        let (index, columns) = (index as f32, self.columns as f32);
        let row = ((index + 0.5) * self.column_scale - 0.5 + ROUND) - ROUND;
        let first = row * columns;
        // A last row that is not full keeps its strips.
        let [strips, part] = self.step[1];
        let strips = if first + columns <= self.count as f32 { strips } else { 0.0 };
        let strip = around(index - first + strips, columns) + around(jitter_y + part, 1.0);
        let y = (first + strip) * self.scale;
        // Rounding can reach 1.
        let last = 1.0_f32.next_down();
        (if x > last { last } else { x }, if y > last { last } else { y })
    }
}

/// Where in a pixel its camera rays go through: stratified over its samples, and the centre if
/// there is just one.
#[derive(Clone, Copy, Debug)]
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

    /// Writes the positions from sample `first` on, as many as there are and as both slices have
    /// places for.
    pub fn fill(&self, first: u32, x: &mut [f32], y: &mut [f32]) {
        match &self.0 {
            Some(set) => set.fill(first, x, y),
            None => {
                let one = usize::from(first == 0);
                x.iter_mut().take(one).chain(y.iter_mut().take(one)).for_each(|at| *at = 0.5);
            }
        }
    }
}

const COLUMNS: u64 = 0x5851_f42d_4c95_7f2d;
const ROWS_KEY: u64 = 0xda94_2042_e4dd_58b5;

/// 16 bits as a fraction of 1: exact, never 1. The middle of what other bits would add.
#[inline(always)]
fn half_float(bits: u32) -> f32 {
    (bits as f32 + 0.5) * (1.0 / 65_536.0)
}

/// `value`, which is below twice the `end`, without it.
#[inline(always)]
fn around(value: f32, end: f32) -> f32 {
    if value >= end { value - end } else { value }
}

/// Point `index` of Sobol's sequence in two dimensions.
#[inline]
fn sobol(index: u32) -> [f32; 2] {
    let (mut rest, mut direction, mut second) = (index, 1_u32 << 31, 0);
    while rest != 0 {
        second ^= if rest & 1 != 0 { direction } else { 0 };
        direction ^= direction >> 1;
        rest >>= 1;
    }
    let unit = |bits: u32| (bits >> 8) as f32 * (1.0 / 16_777_216.0);
    [unit(index.reverse_bits()), unit(second)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(count: u32, seed: u64) -> Vec<Vec2> {
        sample_set(0, count, seed)
    }

    fn sample_set(sample: u32, count: u32, seed: u64) -> Vec<Vec2> {
        let set = StratifiedSet::new(SampleKey::new(3, 4, sample, seed).dimension(6), count);
        (0..count).map(|index| set.point(index)).collect()
    }

    #[test]
    fn every_count_is_stratified_along_both_axes() {
        let counts = (1..=70).chain([97, 256, 1000, 4096, 65535, 65536]);
        for (count, sample) in counts.flat_map(|count| [(count, 0), (count, count % 19)]) {
            let points = sample_set(sample, count, 7);
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
    fn samples_of_a_pixel_fill_the_cells_of_the_light_together() {
        for seed in 0..50 {
            let mut cell = [0; 256];
            for sample in 0..16 {
                let mut own = [0; 16];
                for point in sample_set(sample, 16, seed) {
                    own[(point.x * 4.0) as usize + 4 * (point.y * 4.0) as usize] += 1;
                    cell[(point.x * 16.0) as usize + 16 * (point.y * 16.0) as usize] += 1;
                }
                assert_eq!(own, [1; 16], "sample {sample}");
            }
            assert_eq!(cell, [1; 256]);
        }
    }

    #[test]
    fn the_mean_over_seeds_is_the_centre() {
        for count in [1, 2, 3, 5, 7, 16] {
            for sample in [0, 1, 5] {
                let sum: Vec2 = (0..4000).flat_map(|seed| sample_set(sample, count, seed)).sum();
                let mean = sum / (4000.0 * count as f32);
                assert!((mean - 0.5).length() < 0.02, "{count} points: mean {mean}");
            }
        }
    }

    #[test]
    fn all_at_once_are_the_same_points() {
        for count in [1, 2, 3, 5, 16, 23, 64, 300] {
            let set = StratifiedSet::new(SampleKey::new(1, 2, 3, 4), count);
            let points: Vec<_> = (0..count).map(|index| set.point(index)).collect();
            for first in [0, 1, count / 2, count - 1, count, count + 1] {
                for len in [0, 1, count as usize - 1, count as usize, count as usize + 9] {
                    let (mut u, mut v) = (vec![-1.0; len], vec![-1.0; len]);
                    set.fill(first, &mut u, &mut v);
                    for (place, (u, v)) in (first as usize..).zip(u.into_iter().zip(v)) {
                        let point = points.get(place).copied().unwrap_or(Vec2::splat(-1.0));
                        assert_eq!(Vec2::new(u, v), point, "{place} of {count}");
                    }
                }
            }
        }
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
