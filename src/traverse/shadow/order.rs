//! Points in no order, put in one: neighbours in space become neighbours in number.
//!
//! Blocks and bundles are of points that follow one another. Where those are strewn all over the scene
//! they meet everything, so such points are sorted along Morton's curve first. Points of pictures, in
//! tiles or rows, are left as they are: sorting them costs more than it saves.

use glam::Vec3;
use rayon::prelude::*;

use super::Query;
use crate::error::ShapeError;
use crate::points::{LightSamples, Points};
use crate::traverse::strewn::{LARGEST_SHARE, LOOKS, bounds, run};

/// Fewer points are left as they come.
const FEWEST: usize = 2048;

/// Points in another order than the caller's.
pub(crate) struct Ordered {
    /// The caller's number of each point.
    numbers: Vec<u32>,
    position: [Vec<f32>; 3],
    normal: Option<[Vec<f32>; 3]>,
}

impl Ordered {
    /// Puts points in order, on the rayon pool if `parallel`. `None` if they have one, or are few.
    pub(crate) fn new(points: &Points<'_>, parallel: bool) -> Option<Self> {
        let count = points.len();
        if count < FEWEST || u32::try_from(count).is_err() || !is_strewn(points) {
            return None;
        }
        let (low, high) = bounds((0..count).map(|point| points.position(point)));
        let scale = 1023.0 / (high - low).max_element();
        let key = |point: usize| {
            let cell = (points.position(point) - low) * scale;
            // Of NaN and beyond the ends the cast gives the nearer end.
            let part = |axis: usize| spread_bits(cell[axis].min(1023.0) as u64) << axis;
            (part(0) | part(1) | part(2)) << 32 | point as u64
        };
        let mut keys: Vec<u64>;
        if parallel {
            keys = (0..count).into_par_iter().map(key).collect();
            keys.par_sort_unstable();
        } else {
            keys = (0..count).map(key).collect();
            keys.sort_unstable();
        }
        let numbers: Vec<u32> = keys.into_iter().map(|key| key as u32).collect();
        let gather = |array: &[f32]| numbers.iter().map(|&at| array[at as usize]).collect();
        let position = points.position.map(gather);
        let normal = points.normal.map(|normal| normal.map(gather));
        Some(Self { numbers, position, normal })
    }

    /// The points in their new order.
    pub(crate) fn points(&self) -> Points<'_> {
        Points {
            position: self.position.each_ref().map(Vec::as_slice),
            normal: self.normal.as_ref().map(|normal| normal.each_ref().map(Vec::as_slice)),
        }
    }

    /// The samples of the points in their new order.
    pub(crate) fn samples<'a, S: LightSamples + ?Sized>(
        &'a self,
        samples: &'a S,
    ) -> OrderedSamples<'a, S> {
        OrderedSamples { samples, numbers: &self.numbers }
    }

    /// The same query about the points in their new order.
    pub(crate) fn query<'a, S: ?Sized, T: ?Sized>(
        &'a self,
        query: &Query<'_, S>,
        samples: &'a T,
    ) -> Query<'a, T> {
        Query { points: self.points(), light: query.light, samples }
    }

    /// Writes what was found in the new order in the caller's, `each` values a point.
    pub(crate) fn give<T: Copy>(&self, from: &[T], to: &mut [T], each: usize) {
        if each == 0 {
            return;
        }
        for (from, &number) in from.chunks_exact(each).zip(&self.numbers) {
            to[number as usize * each..][..each].copy_from_slice(from);
        }
    }
}

/// Samples of points in another order.
pub(crate) struct OrderedSamples<'a, S: ?Sized> {
    samples: &'a S,
    numbers: &'a [u32],
}

impl<S: LightSamples + ?Sized> LightSamples for OrderedSamples<'_, S> {
    fn per_point(&self) -> usize {
        self.samples.per_point()
    }

    fn check(&self, points: usize) -> Result<(), ShapeError> {
        self.samples.check(points)
    }

    fn place(&self, point: usize, u: &mut [f32], v: &mut [f32]) {
        self.samples.place(self.numbers[point] as usize, u, v);
    }
}

/// True if points that follow one another are far apart.
fn is_strewn(points: &Points<'_>) -> bool {
    let looks: [(Vec3, Vec3); LOOKS] = std::array::from_fn(|look| {
        bounds(run(look, points.len()).map(|point| points.position(point)))
    });
    let sum: f32 = looks.iter().map(|(low, high)| (high - low).element_sum()).sum();
    let all = bounds(looks.into_iter().flat_map(|(low, high)| [low, high]));
    // False where anything is infinite or NaN.
    sum > LARGEST_SHARE * LOOKS as f32 * (all.1 - all.0).element_sum()
}

/// Ten bits, two zeros after each.
fn spread_bits(bits: u64) -> u64 {
    let bits = (bits | bits << 16) & 0x0300_00ff;
    let bits = (bits | bits << 8) & 0x0300_f00f;
    let bits = (bits | bits << 4) & 0x030c_30c3;
    (bits | bits << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_an_order_and_strewn_points_get_one() {
        let count = FEWEST + 5;
        let rows: Vec<f32> = (0..count).map(|point| (point % 64) as f32).collect();
        let lines: Vec<f32> = (0..count).map(|point| (point / 64) as f32).collect();
        let strewn = |array: &[f32]| -> Vec<f32> {
            (0..count).map(|point| array[point * 1021 % count]).collect()
        };
        assert!(Ordered::new(&Points::new(&rows, &lines, &rows).unwrap(), false).is_none());
        let (x, y) = (strewn(&rows), strewn(&lines));
        for parallel in [false, true] {
            let points = Points::new(&x, &y, &x).unwrap();
            let ordered = Ordered::new(&points, parallel).expect("these are strewn");
            let mut back = vec![0.0; count];
            ordered.give(ordered.points().position[1], &mut back, 1);
            assert_eq!(back, y);
            let near = ordered.points().position[1].windows(2);
            assert!(near.map(|pair| (pair[1] - pair[0]).abs()).sum::<f32>() < 4.0 * count as f32);
        }
    }
}
