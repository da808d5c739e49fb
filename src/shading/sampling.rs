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
    #[inline]
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
        let (row, column) = (self.row_at[row as usize], self.column_at[column as usize]);
        let (x, y) = self.place(index, f32::from(column), f32::from(row));
        Vec2::new(x, y)
    }

    /// Writes the first points of the set, as many as there are and as both slices have places for.
    pub fn fill(&self, u: &mut [f32], v: &mut [f32]) {
        let count = u.len().min(v.len()).min(self.count as usize);
        let (u, v) = (&mut u[..count], &mut v[..count]);
        // Columns and rows first: what is left then has neither divisions nor gathers, and is compiled
        // to whole registers.
        let columns = self.columns as usize;
        let rows = u.chunks_mut(columns).zip(v.chunks_mut(columns)).zip(&self.row_at);
        for ((u, v), &row) in rows {
            for ((u, v), &column) in u.iter_mut().zip(v).zip(&self.column_at) {
                (*u, *v) = (f32::from(column), f32::from(row));
            }
        }
        for (index, (u, v)) in (0..).zip(u.iter_mut().zip(v)) {
            (*u, *v) = self.place(index, *u, *v);
        }
    }

    #[inline(always)]
    fn place(&self, index: u32, column_at: f32, row_at: f32) -> (f32, f32) {
        let jitter = |key: u32| unit_float(mix_short(key ^ (index + 1).wrapping_mul(SHORT_ODD)));
        let (jitter_x, jitter_y) = (jitter((self.key >> 32) as u32), jitter(self.key as u32));
        let x = (column_at + (row_at + jitter_x) * self.row_scale) * self.column_scale;
        let y = (index as f32 + jitter_y) * self.scale;
        // Rounding can reach 1.
        let last = 1.0_f32.next_down();
        (if x > last { last } else { x }, if y > last { last } else { y })
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
/// A step of the golden ratio's odd 32-bit fraction.
const SHORT_ODD: u32 = 0x9e37_79b9;

/// A 32-bit mixer whose bits all depend on all others (Wellons, "Prospecting for Hash Functions", 2018):
/// unlike [`mix`] it has a multiplication that registers of integers have too.
#[inline(always)]
fn mix_short(value: u32) -> u32 {
    let value = (value ^ (value >> 16)).wrapping_mul(0x7feb_352d);
    let value = (value ^ (value >> 15)).wrapping_mul(0x846c_a68b);
    value ^ (value >> 16)
}

#[inline(always)]
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
    fn all_at_once_are_the_same_points() {
        for count in [1, 2, 3, 5, 16, 23, 64, 300] {
            let set = StratifiedSet::new(SampleKey::new(1, 2, 3, 4), count);
            let points: Vec<_> = (0..count).map(|index| set.point(index)).collect();
            for len in [0, 1, count as usize - 1, count as usize, count as usize + 9] {
                let (mut u, mut v) = (vec![-1.0; len], vec![-1.0; len]);
                set.fill(&mut u, &mut v);
                for (place, (u, v)) in u.into_iter().zip(v).enumerate() {
                    let point = points.get(place).copied().unwrap_or(Vec2::splat(-1.0));
                    assert_eq!(Vec2::new(u, v), point, "{place} of {count}");
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
